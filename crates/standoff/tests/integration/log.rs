//! The message log with late and lost messages: which messages delay the commits, and eventual agreement of all agents.

use crate::common::Team;
use crate::common::radio::{PERIOD, Radio, TickMessages, Truth};
use proptest::prelude::*;
use standoff::*;

/// Age of each agent's last committed time step, in periods; `None` before the first commit.
fn committed_ago(team: &Team) -> Vec<Option<i64>> {
    let ago = |agent: &Agent| Some((agent.team_state().time - agent.committed_at()?).us() / PERIOD.us());
    team.agents.iter().map(ago).collect()
}

/// A time step is committed once all UAVs have sent their reports of it and of the next one. At the start the team is
/// unknown, so the first commit waits for the teammate timeout of 3 s.
#[test]
fn with_an_ideal_radio_all_but_the_last_two_time_steps_are_committed() {
    let mut team = Team::new(3, 4);
    for tick in 0..40 {
        team.tick(tick);
        assert_eq!(committed_ago(&team), [if tick <= 6 { None } else { Some(2) }; 3], "{tick}");
    }
}

/// A silent teammate may come back and send its old measurements. After one minute the commits no longer wait for it.
#[test]
fn a_silent_teammate_delays_commits_for_the_horizon() {
    let mut team = Team::new(3, 4);
    for tick in 0..180 {
        team.silent = if tick < 20 { Vec::new() } else { vec![UavId(2)] };
        team.tick(tick);
        // The last report is that of tick 19; it is unknown what else the UAV had received by then.
        let ago = match tick {
            7..=20 => 2,
            21..=139 => tick - 18,
            // A few more ticks, until the oldest team state in the history is later than that.
            140..=169 => 121,
            170.. => 2,
            _ => continue,
        };
        let committed_ago = committed_ago(&team);
        let is_expected = |got: &Option<i64>| *got == Some(ago) || tick > 140 && *got == Some(2);
        assert!(committed_ago[..2].iter().all(is_expected), "{tick}: {committed_ago:?}");
        let status: Vec<_> = team.agents[0].teammate_status().map(|(_, status)| status).collect();
        let expected = match tick - 19 {
            ..=1 => Some(TeammateStatus::Live),
            2..=6 => Some(TeammateStatus::Silent),
            7..=120 => Some(TeammateStatus::TimedOut),
            121..=150 => continue,
            _ => None,
        };
        assert_eq!(
            (status[0], status[1], status.get(2).copied()),
            (TeammateStatus::Live, TeammateStatus::Live, expected)
        );
    }
}

/// From the next time step on, a UAV that has announced that it leaves neither delays the commits nor counts as a
/// teammate.
#[test]
fn a_leaving_teammate_does_not_delay_commits() {
    let mut team = Team::new(3, 4);
    for tick in 0..40 {
        if tick == 20 {
            team.agents[2].leave();
        }
        team.silent = if tick <= 20 { Vec::new() } else { vec![UavId(2)] };
        team.tick(tick);
        if tick > 6 {
            assert_eq!(committed_ago(&team)[..2], [Some(2); 2], "{tick}");
        }
        let team_state = team.agents[0].team_state();
        assert_eq!(
            (team_state.teammates.len(), team_state.assignments.len()),
            if tick <= 20 { (3, 3) } else { (2, 2) },
            "{tick}"
        );
        assert!(!team.agents[0].link_is_degraded());
    }
    assert_eq!(team.agents[0].teammate_status().last(), Some((UavId(2), TeammateStatus::Left)));
}

/// An agent that restarts with an empty team state has the same team state as the others within 6 s, bit for bit.
#[test]
fn a_restarted_agent_recovers_the_team_state() {
    let mut team = Team::new(3, 4);
    (0..40).for_each(|tick| team.tick(tick));
    team.agents[1] = Agent::new(UavId(1), TeamParams::paper()).unwrap().with_restart_count(1);
    // It also receives the messages that it had sent itself before the restart.
    (40..52).for_each(|tick| team.tick(tick));
    let digests: Vec<_> = team.agents.iter().map(|agent| agent.team_state().digest()).collect();
    assert!(digests[0] == digests[1] && digests[0] == digests[2], "{digests:?}");
    assert_eq!(committed_ago(&team), [Some(2); 3]);
    assert_eq!(team.agents[1].committed().map(TeamState::digest), team.agents[0].committed().map(TeamState::digest));
    assert_eq!((team.agents[1].team_state().tracks().len(), team.agents[1].team_state().assignments.len()), (4, 3));
}

/// A UAV receives nothing for half a minute, and no cues for 7 s more, while all others receive its messages and do not
/// wait for it. Whichever UAV it is, it catches up with the commits of the others, and no message is lost.
#[test]
fn a_uav_that_received_nothing_for_a_while_catches_up_with_the_commits() {
    for deaf in 0..3 {
        let mut team = Team::new(3, 5).with_motion(|id, now| {
            let velocity = Velocity::from_m_s(6.0, 2.0);
            let start = Position::from_m(20.0 * f64::from(id), 0.0);
            // The last target appears in the meantime, far from all sensors.
            let exists = id < 4 || now >= Time::from_us(30 * PERIOD.us());
            exists.then(|| {
                (start + Displacement::from_m(if id < 4 { 0.0 } else { 9000.0 }, 0.0) + velocity * now.s(), velocity)
            })
        });
        for tick in 0..160 {
            let (now, scans, inbox) = team.speak(tick);
            let is_received = |message: &&Message| match message {
                Message::Cue(_) => !(20..100).contains(&tick),
                _ => !(20..85).contains(&tick),
            };
            let inbox_of =
                |index: usize| inbox.iter().filter(move |message| index != deaf || is_received(message)).cloned();
            team.decide_each(now, &scans, |index| inbox_of(index).collect());
            if tick == 84 {
                let ago = committed_ago(&team);
                assert!(ago[deaf] == Some(66) && (0..3).all(|index| index == deaf || ago[index] == Some(2)), "{ago:?}");
            }
        }
        assert_eq!(committed_ago(&team), [Some(2); 3], "{deaf}");
        let digests: Vec<_> = team.agents.iter().map(|agent| agent.team_state().digest()).collect();
        assert!(digests[0] == digests[1] && digests[0] == digests[2], "{deaf}: {digests:?}");
        assert_eq!(
            team.agents.iter().map(|agent| agent.team_state().tracks().len()).collect::<Vec<_>>(),
            [5; 3],
            "{deaf}"
        );
    }
}

/// Bytes and number of the retransmissions of each UAV in one time step.
fn retransmitted(uavs: usize, TickMessages { sent, .. }: &TickMessages) -> Vec<(usize, usize)> {
    let of = |uav| sent.iter().filter(move |(sender, _)| *sender == Some(uav)).skip(1);
    (0..uavs).map(|uav| (of(uav).map(|(_, message)| message.size_bytes()).sum(), of(uav).count())).collect()
}

/// Messages received by all UAVs are not retransmitted. A message that one UAV has missed is retransmitted by its
/// sender, by another UAV, and by the UAV whose turn is next before an acknowledgement can arrive; by each once.
#[test]
fn one_lost_message_is_retransmitted_a_few_times() {
    let (mut team, mut radio) = (Team::new(4, 5), Radio::new(1));
    let mut count = 0;
    for tick in 0..60 {
        if tick == 20 {
            radio.deaf.push((1, 0));
        }
        let words = team.tick_over(tick, &mut radio);
        radio.heal();
        let retransmissions: usize = retransmitted(4, &words).iter().map(|(_, times)| times).sum();
        assert!(tick > 20 || retransmissions == 0, "{tick}: {retransmissions}");
        count += retransmissions;
    }
    assert!((2..=3).contains(&count), "{count}");
}

/// If messages are late and a teammate probably lacks the last report, its sender repeats it without an answer. Without
/// latency, it waits for the answer.
#[test]
fn the_last_report_is_repeated_if_messages_are_late_and_a_teammate_probably_lacks_it() {
    for (late_max, is_repeated) in [(4, true), (0, false)] {
        let (mut team, mut radio) = (Team::new(8, 4), Radio::new(1));
        (radio.loss, radio.late_max) = (0.2, late_max);
        let mut repeated = 0;
        for tick in 0..80 {
            let TickMessages { sent, .. } = team.tick_over(tick, &mut radio);
            let last = Time::EPOCH + Duration::from_us((tick - 1) * PERIOD.us());
            let is_repetition = |(sender, message): &&(Option<usize>, Message)| matches!(message, Message::Report(report) if report.time == last && Some(report.uav.0 as usize) == *sender);
            repeated += sent.iter().filter(|_| tick >= 40).filter(is_repetition).count() as u32;
        }
        let fraction = f64::from(repeated) / (40.0 * 8.0);
        assert!(if is_repeated { fraction > 0.95 } else { fraction < 0.85 }, "{late_max}: {fraction}");
    }
}

/// Reports and retransmissions together stay within the stated bandwidth, which a long report and the last retransmission
/// of a time step may exceed until the next ones. What is missing waits, and the agent reports it.
#[test]
fn retransmissions_stay_within_the_bandwidth() {
    const BYTES_PER_S: f64 = 1600.0;
    let mut params = TeamParams::paper();
    params.log.bandwidth_bytes_per_s = Some(BYTES_PER_S);
    let (mut team, mut radio) = (Team::of(4, 5, params), Radio::new(3));
    radio.loss = 0.5;
    let (mut total, mut largest, mut limited) = ([0; 4], 0, 0);
    for tick in 0..80 {
        let words = team.tick_over(tick, &mut radio);
        largest = words.sent.iter().map(|(_, message)| message.size_bytes()).max().unwrap().max(largest);
        let allowed = BYTES_PER_S * PERIOD.s() * (tick + 1) as f64 + 2.0 * largest as f64;
        for (uav, total) in (0..).map(UavId).zip(&mut total) {
            let sent = words.sent.iter().filter(|(sender, _)| *sender == Some(uav.0 as usize));
            *total += sent.map(|(_, message)| message.size_bytes()).sum::<usize>();
            assert!((*total as f64) <= allowed, "{tick}: {total}");
        }
        limited += team.agents.iter().filter(|agent| agent.is_retransmission_limited()).count();
    }
    // Most of the bandwidth is used.
    assert!(total.iter().all(|total| *total as f64 > 0.8 * BYTES_PER_S * 40.0), "{total:?}");
    assert!(limited > 80, "{limited}");
}

/// Without a stated bandwidth, the budget follows the load: larger teams with more targets commit as soon as small ones,
/// and retransmissions wait for the budget only briefly.
#[test]
fn the_commit_lag_does_not_grow_with_team_and_targets() {
    for (uavs, targets) in [(2, 4), (8, 4), (3, 60), (8, 60)] {
        let (mut team, mut radio) = (Team::new(uavs, targets), Radio::new(1));
        (radio.loss, radio.late_max) = (0.2, 2);
        let (mut lags, mut limited) = (Vec::new(), 0);
        for tick in 0..100 {
            team.tick_over(tick, &mut radio);
            lags.extend(committed_ago(&team).into_iter().flatten().filter(|_| tick > 40));
            limited += team.agents.iter().filter(|agent| agent.is_retransmission_limited()).count();
        }
        let mean_s = PERIOD.s() * lags.iter().sum::<i64>() as f64 / lags.len() as f64;
        let limited = limited as f64 / (100 * uavs) as f64;
        assert!(mean_s < 8.0 && limited < 0.02, "{uavs} UAVs, {targets} targets: {mean_s} s, {limited}");
    }
}

/// Cue sources send each cue only once. The agents repeat cues until teammates list them, so that all have all tracks
/// after 4 s, in spite of losses and latency; then no cue is sent any more. With an ideal radio, none is repeated.
#[test]
fn cues_are_repeated_until_teammates_list_them() {
    for (loss, late_max) in [(0.4, 2), (0.0, 0)] {
        let (mut team, mut radio) = (Team::new(3, 40), Radio::new(5));
        (radio.loss, radio.late_max) = (loss, late_max);
        for tick in 0..30 {
            let words = team.tick_over(tick, &mut radio);
            let repeated =
                words.sent.iter().filter(|(from, message)| from.is_some() && matches!(message, Message::Cue(_)));
            let is_expected = loss > 0.0 && (2..=8).contains(&tick);
            assert!(is_expected || repeated.count() == 0, "{loss}, {tick}");
            let tracks: Vec<usize> = team.agents.iter().map(|agent| agent.team_state().tracks().len()).collect();
            assert!(tick < 8 || tracks == [40; 3], "{loss}, {tick}: {tracks:?}");
        }
    }
}

/// Team states that lead to different later states have different digests, also if only a group or an assignment
/// differs.
#[test]
fn the_digest_depends_on_groups_and_assignments() {
    let mut team = Team::new(3, 4);
    (0..20).for_each(|tick| team.tick(tick));
    let team_state = team.agents[0].team_state();
    let digest_with = |change: &dyn Fn(&mut TeamState)| {
        let mut other = team_state.clone();
        change(&mut other);
        other.digest()
    };
    assert_eq!(digest_with(&|_| {}), team_state.digest());
    for change in [
        &|other: &mut TeamState| other.groups[0].altitude_m += 1.0,
        &|other: &mut TeamState| other.groups[0].standoff.distance_m += 1e-9,
        &|other: &mut TeamState| other.assignments.truncate(2),
        &|other: &mut TeamState| other.teammates.truncate(2),
    ] as [&dyn Fn(&mut TeamState); 4]
    {
        assert_ne!(digest_with(change), team_state.digest());
    }
}

/// Faults of the links of a team: packet loss, latency, duplication and a blocked link, until the faults end.
#[derive(Debug, Clone)]
struct Faults {
    seed: u64,
    uavs: u32,
    targets: u32,
    loss: f64,
    late_max: i64,
    twice: f64,
    deaf: Option<(usize, usize)>,
    until: i64,
}

prop_compose! {
    fn any_faults()(
        seed in any::<u64>(),
        uavs in 2..5u32,
        targets in 3..7u32,
        loss in prop_oneof![Just(0.0), 0.0..0.6f64],
        late_max in 0..6i64,
        twice in 0.0..0.3f64,
        deaf in proptest::option::weighted(0.3, (0..4usize, 0..4usize)),
        until in 20..45i64,
    ) -> Faults {
        Faults { seed, uavs, targets, loss, late_max, twice, deaf, until }
    }
}

/// Periods after the end of the faults until all missing messages are retransmitted and latencies are assumed to be
/// normal.
const REPAIRED_AFTER: i64 = 45;

/// Number of cases: `PROPTEST_CASES`, or 60 if it is not set.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").map_or(60, |cases| cases.parse().unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(cases()) })]
    /// Messages are lost, late, duplicated and reordered. Every committed team state equals that of a fleet that
    /// receives all messages immediately, bit for bit. Soon after the end of the faults, all agents have caught up.
    #[test]
    fn all_agents_commit_to_the_same_team_state_despite_lost_and_late_messages(faults in any_faults()) {
        let params = TeamParams::paper();
        let mut team = Team::of(faults.uavs, faults.targets, params);
        let (mut radio, mut truth) = (Radio::new(faults.seed), Truth::new(params));
        (radio.late_max, radio.twice) = (faults.late_max, faults.twice);
        for tick in 0..faults.until + REPAIRED_AFTER {
            if tick == 1 {
                // A UAV that is never received at the beginning does not delay commits.
                radio.loss = faults.loss;
                radio.deaf.extend(faults.deaf);
            }
            if tick == faults.until {
                radio.heal();
            }
            let TickMessages { sent, .. } = team.tick_over(tick, &mut radio);
            truth.hear(Time::from_us(tick * PERIOD.us()), &sent);
            for agent in &team.agents {
                let committed = agent.committed();
                prop_assert!(committed.is_none_or(|state| truth.is(state)), "{:?} at {tick}", agent.id());
            }
        }
        prop_assert_eq!(committed_ago(&team), vec![Some(2); team.agents.len()]);
        prop_assert!(team.agents.iter().all(|agent| truth.is(agent.team_state())));
    }
}
