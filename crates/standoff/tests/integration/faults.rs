//! Behaviour of a team with faults of radio, computers and clocks, and with malicious messages of a team member.

use crate::common::Team;
use crate::common::radio::{PERIOD, Radio};
use standoff::coordination::assignment::Assignment;
use standoff::message::CommitDigest;
use standoff::message::LogStatus;
use standoff::message::MessageSource;
use standoff::message::ReceivedRange;
use standoff::message::SnapshotRequest;
use standoff::*;

/// Teammate timeout of Table I, 3 s, in periods.
const LEASE: i64 = 6;

/// 5 s, in periods.
const SOON: i64 = 10;
/// 10 s, in periods.
const LATER: i64 = 20;

/// State that is the same in all agents that agree: assignments, last commit, its digest, and the current digest.
fn agreed_state(agent: &Agent) -> (Vec<Assignment>, Option<Time>, Option<u64>, u64) {
    let team_state = agent.team_state();
    (
        team_state.assignments.clone(),
        agent.committed_at(),
        agent.committed().map(TeamState::digest),
        team_state.digest(),
    )
}

fn all_agree(team: &Team) -> bool {
    (0..team.agents.len()).all(|uav| agree(team, [0, uav]))
}

/// Returns true if two agents have the same team state and assignments. Their last commits may differ.
fn agree(team: &Team, uavs: [usize; 2]) -> bool {
    let [one, other] = uavs.map(|uav| team.agents[uav].team_state());
    one.assignments == other.assignments && one.digest() == other.digest()
}

/// UAVs with an assignment, according to an agent.
fn assigned_uavs(agent: &Agent) -> Vec<u32> {
    agent.team_state().assignments.iter().map(|assignment| assignment.uav.0).collect()
}

fn group_ids(agent: &Agent) -> Vec<GroupId> {
    agent.team_state().groups.iter().map(|group| group.id).collect()
}

fn labels(agent: &Agent) -> Vec<u32> {
    agent.team_state().tracks().iter().map(|known| known.track.label().unwrap().0).collect()
}

fn fly(team: &mut Team, radio: &mut Radio, ticks: core::ops::Range<i64>) {
    for tick in ticks {
        for (uav, step) in team.tick_over(tick, radio).steps {
            let Command { speed_m_s, turn_rate_rad_s } = step.command;
            assert!((25.0..=55.0).contains(&speed_m_s) && turn_rate_rad_s.abs() <= 0.3, "{tick}: {uav}: {step:?}");
        }
    }
}

fn fallible() -> TeamParams {
    TeamParams { link: standoff::LinkModel::Lossy, ..TeamParams::paper() }
}

/// The computers start in any order, the lowest id first or last.
#[test]
fn computers_started_up_to_30_s_apart_agree() {
    for starts in [[0, 20, 40, 60], [60, 0, 30, 59], [60, 40, 20, 0], [3, 0, 1, 2], [0, 60, 60, 1], [60, 60, 0, 60]] {
        let (mut team, mut radio) = (Team::of(4, 5, fallible()), Radio::new(1));
        for tick in 0..60 + LATER {
            team.off = (0..4).filter(|index| starts[*index] > tick).collect();
            fly(&mut team, &mut radio, tick..tick + 1);
        }
        assert!(all_agree(&team), "{starts:?}");
        assert_eq!(
            (assigned_uavs(&team.agents[0]), labels(&team.agents[0])),
            (vec![0, 1, 2, 3], vec![0, 1, 2, 3, 4]),
            "{starts:?}"
        );
    }
}

/// Any UAV that restarts receives the team state from its teammates, and no teammate adopts its empty state.
#[test]
fn a_restarted_uav_is_assigned_again_within_5_s() {
    for uav in 0..3 {
        for down in [0, 2, LEASE, 40] {
            let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
            fly(&mut team, &mut radio, 0..30);
            let groups = group_ids(&team.agents[uav]);
            team.off = vec![uav];
            fly(&mut team, &mut radio, 30..30 + down);
            team.off.clear();
            team.agents[uav] = Agent::new(UavId(uav as u32), fallible()).unwrap().with_restart_count(1);
            fly(&mut team, &mut radio, 30 + down..30 + down + SOON);
            for agent in &team.agents {
                assert_eq!((assigned_uavs(agent), labels(agent)), (vec![0, 1, 2], vec![0, 1, 2, 3]), "{uav}, {down}");
                assert!(down > LEASE || group_ids(agent) == groups, "{uav}, {down}: {groups:?}");
            }
            fly(&mut team, &mut radio, 30 + down + SOON..30 + down + SOON + LATER);
            assert!(all_agree(&team), "{uav}, {down}");
        }
    }
}

/// If a snapshot takes longer to send than the request timeout, all parts are still received from the same sender.
#[test]
fn a_large_snapshot_is_received_from_a_single_sender() {
    let (mut team, mut radio) = (Team::of(3, 60, fallible()), Radio::new(1));
    fly(&mut team, &mut radio, 0..30);
    team.agents[1] = Agent::new(UavId(1), fallible()).unwrap().with_restart_count(1);
    fly(&mut team, &mut radio, 30..30 + 4 * LEASE);
    assert!(agree(&team, [0, 1]));
}

/// A forged snapshot part in the name of the requested sender, with a future time, does not block the genuine parts.
#[test]
fn a_forged_snapshot_part_from_the_future_does_not_block_the_snapshot() {
    let (mut team, mut radio) = (Team::of(2, 4, fallible()), Radio::new(1));
    fly(&mut team, &mut radio, 0..30);
    team.agents[1] = Agent::new(UavId(1), fallible()).unwrap().with_restart_count(1);
    for tick in 30..30 + SOON {
        let commit_digest = CommitDigest { time: FAR, digest: 1 };
        let forged = SnapshotPart { commit_digest, count: 2, bytes: vec![0; 512], ..SnapshotPart::default() };
        radio.deliver(tick, 1, Message::Snapshot(forged));
        fly(&mut team, &mut radio, tick..tick + 1);
    }
    let step = team.tick_over(30 + SOON, &mut radio).steps.remove(1).1;
    assert!(step.diagnostics.rejected.malformed > 0);
    fly(&mut team, &mut radio, 31 + SOON..30 + SOON + LATER);
    assert!(agree(&team, [0, 1]));
}

/// A UAV that restarts twice receives the current snapshot, not the first one again. The horizon is short, and some
/// measurements of silent UAVs are lost forever.
#[test]
fn a_uav_that_restarts_twice_receives_the_current_snapshot() {
    let mut params = fallible();
    params.log.message_retention_s = 15.0;
    let (mut team, mut radio) = (Team::of(4, 2, params), Radio::new(1));
    for tick in 0..37 + SOON {
        if tick == 9 || tick == 33 {
            team.agents[0] = Agent::new(UavId(0), params).unwrap().with_restart_count(tick as u32);
        }
        team.silent = match tick {
            21..25 => vec![UavId(1)],
            29..37 => vec![UavId(0)],
            _ => Vec::new(),
        };
        fly(&mut team, &mut radio, tick..tick + 1);
    }
    assert!((1..4).all(|uav| agree(&team, [0, uav])));
}

/// Both sides of a partition continue with their own team state and receive different cues. After the partition, all
/// agree within 10 s.
#[test]
fn two_halves_separated_for_longer_than_the_horizon_agree_within_10_s() {
    let mut params = fallible();
    params.log.message_retention_s = 15.0;
    let sides = [[0, 2], [1, 3]];
    let mut team = Team::of(4, 6, params).with_motion(|id, now| {
        let start = [0.0, 60.0, 0.0, 60.0, -3000.0, 3000.0][id as usize];
        let velocity = Velocity::from_m_s(6.0, 2.0);
        let exists = now >= Time::from_us([0, 0, 0, 0, 80, 84][id as usize] * PERIOD.us());
        exists.then(|| (Position::from_m(start, 20.0 * f64::from(id)) + velocity * now.s(), velocity))
    });
    let mut radio = Radio::new(1);
    fly(&mut team, &mut radio, 0..40);
    assert!(all_agree(&team));
    radio.part(&sides[0], &sides[1]);
    for tick in 40..140 {
        radio.uncued = sides[usize::from(tick < 82)].to_vec();
        fly(&mut team, &mut radio, tick..tick + 1);
    }
    for (side, other) in [(sides[0], 4), (sides[1], 5)] {
        for uav in side {
            let agent = &team.agents[uav];
            assert_eq!(assigned_uavs(agent), side.map(|uav| uav as u32), "{uav}");
            assert!(
                labels(agent).contains(&other) && !labels(agent).contains(&(9 - other)),
                "{uav}: {:?}",
                labels(agent)
            );
        }
    }
    radio.heal();
    fly(&mut team, &mut radio, 140..140 + LATER);
    let all: Vec<_> =
        team.agents.iter().map(|agent| (assigned_uavs(agent), labels(agent), agent.committed_at())).collect();
    assert!(all_agree(&team), "{all:?}");
    assert_eq!(assigned_uavs(&team.agents[0]), [0, 1, 2, 3]);
    // All have the targets of the first half, which contains the reference agent.
    assert!((0..5).all(|label| labels(&team.agents[3]).contains(&label)), "{all:?}");
}

/// One UAV misses one report at the first time step.
#[test]
fn a_lost_message_at_the_first_time_step_does_not_prevent_agreement() {
    for sender in 0..3 {
        for receiver in (0..3).filter(|receiver| *receiver != sender) {
            let (mut team, mut radio) = (Team::of(3, 5, fallible()), Radio::new(1));
            radio.deaf.push((sender, receiver));
            fly(&mut team, &mut radio, 0..1);
            radio.heal();
            fly(&mut team, &mut radio, 1..30);
            assert!(all_agree(&team), "{sender}, {receiver}");
        }
    }
}

/// The clock of a UAV jumps by an hour, forward or backward, and is corrected later. The others are not affected, and
/// after a reset all agree.
#[test]
fn a_clock_that_jumps_does_not_affect_the_other_uavs() {
    for hours in [1, -1] {
        let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
        let (mut without, mut silence) = (team.clone(), Radio::new(1));
        for tick in 0..100 {
            if tick == 30 {
                team.clock_ahead[1] = Duration::from_us(hours * 3_600_000_000);
                without.off = vec![1];
            }
            // The agent is reset to the wrong time, later to the correct one.
            if tick == 45 || tick == 62 {
                team.agents[1].reset();
            }
            if tick == 60 {
                team.clock_ahead[1] = Duration::ZERO;
            }
            let is_rejected = (30..45).contains(&tick) || (60..62).contains(&tick);
            let before = team.agents[1].clone();
            let steps = team.tick_over(tick, &mut radio).steps;
            let rejected = steps[1].1.diagnostics.rejected.bad_time;
            assert_eq!(rejected, (tick - 29).clamp(0, 15) as u32 + (tick - 59).clamp(0, 2) as u32, "{tick}");
            if is_rejected {
                assert_eq!(format!("{:?}", before.team_state()), format!("{:?}", team.agents[1].team_state()));
            }
            assert!(agree(&team, [0, 2]), "{tick}");
            if tick < 62 {
                without.tick_over(tick, &mut silence);
                assert_eq!(agreed_state(&team.agents[0]), agreed_state(&without.agents[0]), "{tick}");
            }
        }
        assert!(all_agree(&team) && assigned_uavs(&team.agents[1]) == [0, 1, 2]);
    }
}

/// Messages that a malicious UAV sends at a tick to one receiver in place of its correct report.
type Lie = fn(i64, usize, &Report) -> Vec<Message>;

fn report_with(report: &Report, change: impl Fn(&mut Report)) -> Vec<Message> {
    let mut report = report.clone();
    change(&mut report);
    vec![Message::Report(report)]
}

fn log_status_with(report: &Report, change: impl Fn(&mut LogStatus)) -> Vec<Message> {
    report_with(report, |report| change(report.log_status.get_or_insert_default()))
}

fn held(uav: u32, from: i64, to: i64) -> ReceivedRange {
    ReceivedRange { source: MessageSource::Uav(UavId(uav)), from, to }
}

const FAR: Time = Time::from_us(i64::MAX);
const LONG_AGO: Time = Time::from_us(i64::MIN);

const LIES: [(&str, Lie); 12] = [
    ("restart_counts", |tick, _, report| {
        let absurd = [(u32::MAX, u32::MAX), (0, 0), (u32::MAX, 0), (7, u32::MAX)][tick as usize % 4];
        report_with(report, |report| (report.restart_count, report.sequence) = absurd)
    }),
    ("gaps", |tick, _, report| {
        log_status_with(report, |status| {
            status.received = (0..1024).map(|run| held(run % 2, 2 * tick - 4 * i64::from(run), 2 * tick)).collect()
        })
    }),
    ("unlimited ranges", |_, _, report| {
        log_status_with(report, |status| status.received = (0..300).map(|uav| held(uav, i64::MIN, i64::MAX)).collect())
    }),
    ("UAVs that do not exist", |tick, _, report| {
        log_status_with(report, |status| status.received = (0..300).map(|uav| held(uav, tick - 9, tick - 1)).collect())
    }),
    ("cues", |tick, _, report| {
        let cue = |number: u16| {
            let position = Position::from_m(1e300, f64::from(number));
            let (velocity, position_sd_m, velocity_sd_m_s) = (Velocity::from_m_s(-1e300, 0.0), 1e-300, 1e300);
            let label = TargetLabel(u32::MAX - u32::from(number) % 3);
            let (searcher, issued_at, time) = (u32::MAX, report.time, Time::from_us(i64::MIN + tick));
            Message::Cue(Cue {
                source: searcher,
                issued_at,
                sequence: number,
                label: Some(label),
                time,
                position,
                velocity,
                position_sd_m,
                velocity_sd_m_s,
                priority: None,
            })
        };
        (0..20).chain([u16::MAX]).map(cue).collect()
    }),
    ("times", |tick, _, report| {
        let wrong =
            [FAR, LONG_AGO, report.time + Duration::from_us(1_500_000), report.time + Duration::from_us(77_777)];
        report_with(report, |report| report.time = wrong[tick as usize % 4])
    }),
    ("commit digests", |_, _, report| {
        log_status_with(report, |status| {
            let commit_digest = CommitDigest { time: status.committed_until, digest: 1 };
            (status.start, status.commit_digest, status.committed_until) = (LONG_AGO, commit_digest, FAR)
        })
    }),
    ("lists", |_, _, report| {
        log_status_with(report, |status| {
            (status.listed_after, status.degraded_at, status.received) = (FAR, FAR, Vec::new())
        })
    }),
    ("snapshots", |tick, to, report| {
        let part = |index| {
            let commit_digest = CommitDigest { time: report.time, digest: tick as u64 };
            SnapshotPart { uav: UavId(2), start: LONG_AGO, commit_digest, index, count: 2, bytes: vec![255; 512] }
        };
        let ask = SnapshotRequest {
            receiver: UavId(to as u32),
            commit_digest: None,
            first_missing_part: 0,
            received_mask: 0,
        };
        let mut messages = log_status_with(report, |status| status.snapshot_request = Some(ask));
        messages.extend([0, 1, 1, 7].map(|index| Message::Snapshot(part(index))));
        messages
    }),
    ("jumps", |tick, _, report| {
        let far_m = [1e4, -1e4, 1e300][tick as usize % 3];
        report_with(report, |report| report.state.position = Position::from_m(far_m, far_m))
    }),
    ("measurements", |_, _, report| {
        report_with(report, |report| {
            for detection in &mut report.detections {
                detection.measurement.range_m = 5e3;
            }
        })
    }),
    ("duties", |tick, _, report| report_with(report, |report| report.assigned_group = Some(GroupId(tick as u64 * 77)))),
];

/// If a malicious UAV sends the same messages to all, the others agree at every time step.
#[test]
fn a_malicious_uav_that_sends_the_same_to_all_does_not_prevent_agreement() {
    for (name, lie) in LIES {
        let (team, disagreements) = with_malicious_uav(lie);
        assert_eq!(disagreements, 0, "{name}");
        assert!(agree(&team, [0, 1]) && agree(&team, [0, 2]), "{name}");
    }
}

/// A flood of cues: the number of tracks is limited, all agents have the same tracks, and every rejected cue is
/// counted. When the tracks are lost, new ones are accepted again.
#[test]
fn the_number_of_false_targets_is_limited() {
    let mut params = fallible();
    params.track.deletion_position_sd_m = 25.0;
    let (mut team, mut radio) = (Team::of(2, 3, params), Radio::new(1));
    let false_cues = |tick: i64| {
        let time = Time::from_us(tick * PERIOD.us());
        let cue = move |number: u16| Cue {
            source: 7,
            issued_at: time,
            sequence: number,
            label: Some(TargetLabel(1000 + 10_000 * tick as u32 + u32::from(number))),
            time,
            position: Position::from_m(5e4, f64::from(number)),
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 2.0,
            priority: None,
        };
        (0..10_000).map(cue)
    };
    for tick in 0..12 {
        for cue in false_cues(tick).filter(|_| (5..8).contains(&tick)) {
            (0..2).for_each(|to| radio.deliver(tick, to, Message::Cue(cue)));
        }
        let (steps, known) = (team.tick_over(tick, &mut radio).steps, team.agents[0].team_state().tracks().len());
        assert!(agree(&team, [0, 1]) && known <= 16_384, "{tick}: {known}");
        let rejected = steps[1].1.diagnostics.rejected.implausible;
        assert_eq!(rejected > 0, tick > 5, "{tick}: {rejected}");
    }
    // A cue that is accepted.
    fly(&mut team, &mut radio, 12..40);
    let last = false_cues(40).next().unwrap();
    (0..2).for_each(|to| radio.deliver(40, to, Message::Cue(last)));
    fly(&mut team, &mut radio, 40..41);
    assert!(agree(&team, [0, 1]) && team.agents[0].team_state().track_by_label(last.label.unwrap()).is_some());
}

/// A malicious UAV that sends different reports to different receivers prevents agreement only until it stops.
#[test]
fn contradictory_reports_do_not_prevent_agreement_for_long() {
    let (team, _) = with_malicious_uav(|tick, to, report| {
        report_with(report, |report| {
            let by_m = if to == 0 { 20.0 } else { -20.0 };
            report.state.position = report.state.position + Displacement::from_m(by_m, 0.0);
            report.sequence += if tick % 2 == 0 { to as u32 } else { 0 };
        })
    });
    assert!(agree(&team, [0, 1]));
}

/// Runs a team for 40 s, in which UAV 2 sends malicious messages from 5 to 20 s. Returns the team and the number of
/// time steps at which the others disagreed.
fn with_malicious_uav(lie: Lie) -> (Team, i64) {
    let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
    let mut disagreements = 0;
    for tick in 0..80 {
        radio.deaf.clear();
        if (10..40).contains(&tick) {
            send_lies(&team, &mut radio, tick, lie);
        }
        fly(&mut team, &mut radio, tick..tick + 1);
        disagreements += i64::from(!agree(&team, [0, 1]));
    }
    (team, disagreements)
}

/// Replaces the messages of UAV 2 by malicious ones.
fn send_lies(team: &Team, radio: &mut Radio, tick: i64, lie: Lie) {
    radio.deaf = vec![(2, 0), (2, 1)];
    let sent = team.clone().tick_over(tick, &mut Radio::new(1)).sent;
    let own = sent.iter().find_map(|(sender, message)| match message {
        Message::Report(report) if *sender == Some(2) => Some(report),
        _ => None,
    });
    for to in 0..2 {
        lie(tick, to, own.unwrap()).into_iter().for_each(|message| radio.deliver(tick, to, message));
    }
}

/// A malicious UAV claims to have the oldest team state, but sends no snapshot or repeatedly starts another one. It
/// delays a restarted UAV only until that UAV stops requesting from it.
#[test]
fn a_uav_that_offers_a_snapshot_without_sending_it_does_not_block_a_restarted_uav() {
    let lies: [Lie; 2] = [
        |_, _, report| log_status_with(report, |status| (status.start, status.commit_digest.digest) = (LONG_AGO, 1)),
        |tick, _, report| {
            let mut messages =
                log_status_with(report, |status| (status.start, status.commit_digest.digest) = (LONG_AGO, 1));
            let commit_digest = CommitDigest { time: Time::from_us((tick - 1) * PERIOD.us()), digest: 1 };
            let (uav, since, bytes) = (UavId(2), LONG_AGO, vec![255; 512]);
            messages.push(Message::Snapshot(SnapshotPart {
                uav,
                start: since,
                commit_digest,
                index: 0,
                count: 2,
                bytes,
            }));
            messages
        },
    ];
    for (which, lie) in lies.into_iter().enumerate() {
        let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
        for tick in 0..30 + LATER {
            if tick == 30 {
                team.agents[1] = Agent::new(UavId(1), fallible()).unwrap().with_restart_count(1);
            }
            if tick >= 10 {
                send_lies(&team, &mut radio, tick, lie);
            }
            fly(&mut team, &mut radio, tick..tick + 1);
        }
        assert!(agree(&team, [0, 1]), "{which}");
    }
}

/// A UAV that receives no messages any more is a team of one after the teammate timeout. It continues with its targets
/// and keeps its altitude.
#[test]
fn a_uav_without_links_continues_alone_at_its_altitude() {
    let params = fallible();
    let altitude_m = |uav: usize| Some(params.group.altitude_lowest_m + params.group.altitude_step_m * uav as f64);
    let (mut team, mut radio) = (Team::of(2, 4, params), Radio::new(1));
    for tick in 0..120 {
        if tick == 40 {
            radio.part(&[0], &[1]);
        }
        for (uav, step) in team.tick_over(tick, &mut radio).steps {
            assert_eq!(step.altitude_m, altitude_m(uav), "{tick}");
            let is_assigned_alone =
                step.diagnostics.group.is_some() && assigned_uavs(&team.agents[uav]) == [uav as u32];
            assert!(
                tick < 40 + LEASE + 1 || is_assigned_alone,
                "{tick}: {uav}: {:?}",
                assigned_uavs(&team.agents[uav])
            );
        }
    }
    for (uav, agent) in team.agents.iter().enumerate() {
        let team_state = agent.team_state();
        assert!(
            team_state.tracks().iter().all(|known| known.track.status == TrackStatus::Updated),
            "{uav}: {team_state:?}"
        );
        let error_m = team.states[uav].position.distance_m(team_state.groups[0].centre().state.position())
            - team_state.groups[0].standoff.distance_m;
        assert!(error_m.abs() < 30.0, "{uav}: {error_m}");
    }
    // Without targets it flies a circle.
    let (mut team, mut radio) = (Team::of(2, 0, params), Radio::new(1));
    radio.part(&[0], &[1]);
    for tick in 0..20 {
        for (uav, step) in team.tick_over(tick, &mut radio).steps {
            let circle = Command { speed_m_s: 40.0, turn_rate_rad_s: 0.16 };
            assert_eq!((step.command, step.altitude_m), (circle, altitude_m(uav)));
        }
    }
}

/// A UAV that fails is detected within the teammate timeout plus one period: in the list of teammates, in the
/// assignments and in the teammate status.
#[test]
fn a_failed_uav_is_detected_within_the_teammate_timeout_plus_one_period() {
    for failed in 0..3 {
        let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
        fly(&mut team, &mut radio, 0..40);
        team.off = vec![failed];
        // Its last report was sent at the time step before.
        fly(&mut team, &mut radio, 40..40 + LEASE);
        let rest: Vec<u32> = (0..3).filter(|uav| *uav != failed as u32).collect();
        let state_of = |agent: &Agent| {
            let teammates: Vec<u32> = agent.team_state().teammates.iter().map(|teammate| teammate.uav.0).collect();
            (teammates, assigned_uavs(agent), agent.teammate_status().nth(failed))
        };
        let status = |status| Some((UavId(failed as u32), status));
        for uav in &rest {
            let all = vec![0, 1, 2];
            assert_eq!(state_of(&team.agents[*uav as usize]), (all.clone(), all, status(TeammateStatus::Silent)));
        }
        fly(&mut team, &mut radio, 40 + LEASE..40 + LEASE + 1);
        for uav in &rest {
            assert_eq!(
                state_of(&team.agents[*uav as usize]),
                (rest.clone(), rest.clone(), status(TeammateStatus::TimedOut))
            );
        }
    }
}
