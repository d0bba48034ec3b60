//! What was said and not heard at once: who waits for what, and that all come to the same in the end.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::Team;
use common::radio::{PERIOD, Radio, Truth, Words};
use proptest::prelude::*;
use standoff::*;

/// How many periods ago what each agent has committed was; `None`: nothing yet.
fn committed_ago(team: &Team) -> Vec<Option<i64>> {
    let ago = |agent: &Agent| Some((agent.picture().time - agent.committed_at()?).us() / PERIOD.us());
    team.agents.iter().map(ago).collect()
}

/// Once everybody has reported an instant and the next one; at first nobody knows who is there, so a lease, of 3 s, has to go
/// by.
#[test]
fn with_a_perfect_radio_all_but_two_instants_are_committed() {
    let mut team = Team::new(3, 4);
    for tick in 0..40 {
        team.tick(tick);
        assert_eq!(committed_ago(&team), [if tick <= 6 { None } else { Some(2) }; 3], "{tick}");
    }
}

/// Who falls silent may come back and say what it has measured; a minute later nobody waits for that any more.
#[test]
fn who_is_silent_holds_up_what_is_committed_for_the_horizon() {
    let mut team = Team::new(3, 4);
    for tick in 0..180 {
        team.silent = if tick < 20 { Vec::new() } else { vec![UavId(2)] };
        team.tick(tick);
        // The last report is that of tick 19, and nobody knows what else it had heard by then.
        let ago = match tick {
            7..=20 => 2,
            21..=139 => tick - 18,
            // A few more, until the last picture that is kept is of an instant after that.
            140..=169 => 121,
            170.. => 2,
            _ => continue,
        };
        let committed_ago = committed_ago(&team);
        let is_so = |told: &Option<i64>| *told == Some(ago) || tick > 140 && *told == Some(2);
        assert!(committed_ago[..2].iter().all(is_so), "{tick}: {committed_ago:?}");
        let presence: Vec<_> = team.agents[0].presence().map(|(_, presence)| presence).collect();
        let expected = match tick - 19 {
            ..=1 => Some(Presence::Live),
            2..=6 => Some(Presence::Silent),
            7..=120 => Some(Presence::Gone),
            121..=150 => continue,
            _ => None,
        };
        assert_eq!((presence[0], presence[1], presence.get(2).copied()), (Presence::Live, Presence::Live, expected));
    }
}

/// Who says that it leaves is not waited for, nor counted on from the next instant on.
#[test]
fn who_leaves_holds_nothing_up() {
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
        let picture = team.agents[0].picture();
        assert_eq!((picture.team.len(), picture.crew.len()), if tick <= 20 { (3, 3) } else { (2, 2) }, "{tick}");
        assert!(!team.agents[0].is_disturbed());
    }
    assert_eq!(team.agents[0].presence().last(), Some((UavId(2), Presence::Left)));
}

/// Whose computer has started anew, with nothing, knows within 6 s what the others know, to the bit.
#[test]
fn who_starts_anew_comes_to_know_what_the_others_know() {
    let mut team = Team::new(3, 4);
    (0..40).for_each(|tick| team.tick(tick));
    team.agents[1] = Agent::new(UavId(1), TeamParams::table_1()).unwrap().with_epoch(1);
    // What it had said itself it is told, too.
    (40..52).for_each(|tick| team.tick(tick));
    let digests: Vec<_> = team.agents.iter().map(|agent| agent.picture().digest()).collect();
    assert!(digests[0] == digests[1] && digests[0] == digests[2], "{digests:?}");
    assert_eq!(committed_ago(&team), [Some(2); 3]);
    assert_eq!(team.agents[1].committed().map(Picture::digest), team.agents[0].committed().map(Picture::digest));
    assert_eq!((team.agents[1].picture().known().len(), team.agents[1].picture().crew.len()), (4, 3));
}

/// A UAV that hears nobody for half a minute, and of the cues nothing for 7 s more, while all hear it, and of which others wait for nothing: it comes to commit as
/// they do, whichever it is, and nothing that was said meanwhile is lost.
#[test]
fn who_was_deaf_for_a_while_commits_again_with_the_others() {
    for deaf in 0..3 {
        let mut team = Team::new(3, 5).with_motion(|id, now| {
            let velocity = Velocity::from_m_s(6.0, 2.0);
            let start = Position::from_m(20.0 * f64::from(id), 0.0);
            // The last one appears meanwhile, and far from all sensors.
            let is_there = id < 4 || now >= Time::from_us(30 * PERIOD.us());
            is_there.then(|| {
                (start + Displacement::from_m(if id < 4 { 0.0 } else { 9000.0 }, 0.0) + velocity * now.s(), velocity)
            })
        });
        for tick in 0..160 {
            let (now, scans, inbox) = team.speak(tick);
            let hears = |message: &&Message| match message {
                Message::Cue(_) => !(20..100).contains(&tick),
                _ => !(20..85).contains(&tick),
            };
            let mine = |index: usize| inbox.iter().filter(move |message| index != deaf || hears(message)).cloned();
            team.decide_each(now, &scans, |index| mine(index).collect());
            if tick == 84 {
                let ago = committed_ago(&team);
                assert!(ago[deaf] == Some(66) && (0..3).all(|index| index == deaf || ago[index] == Some(2)), "{ago:?}");
            }
        }
        assert_eq!(committed_ago(&team), [Some(2); 3], "{deaf}");
        let digests: Vec<_> = team.agents.iter().map(|agent| agent.picture().digest()).collect();
        assert!(digests[0] == digests[1] && digests[0] == digests[2], "{deaf}: {digests:?}");
        assert_eq!(team.agents.iter().map(|agent| agent.picture().known().len()).collect::<Vec<_>>(), [5; 3], "{deaf}");
    }
}

/// Bytes that each says again, and how often, at an instant.
fn said_again(uavs: usize, Words { said, .. }: &Words) -> Vec<(usize, usize)> {
    let of = |uav| said.iter().filter(move |(speaker, _)| *speaker == Some(uav)).skip(1);
    (0..uavs).map(|uav| (of(uav).map(|(_, message)| message.size_bytes()).sum(), of(uav).count())).collect()
}

/// What all have heard nobody says again; what one has not, whose it is and another, and the next one whose turn it is before
/// an answer can have come; each once.
#[test]
fn one_lost_word_is_said_again_a_few_times() {
    let (mut team, mut radio) = (Team::new(4, 5), Radio::new(1));
    let mut count = 0;
    for tick in 0..60 {
        if tick == 20 {
            radio.deaf.push((1, 0));
        }
        let words = team.tick_over(tick, &mut radio);
        radio.heal();
        let again: usize = said_again(4, &words).iter().map(|(_, times)| times).sum();
        assert!(tick > 20 || again == 0, "{tick}: {again}");
        count += again;
    }
    assert!((2..=3).contains(&count), "{count}");
}

/// What is said again keeps to its bytes a second, of which one is saved, but for the message that goes beyond.
#[test]
fn what_is_said_again_keeps_to_its_budget() {
    const BYTES_PER_S: f64 = 400.0;
    let mut params = TeamParams::table_1();
    params.log.repair_bytes_per_s = BYTES_PER_S;
    let (mut team, mut radio) = (Team::of(4, 5, params), Radio::new(3));
    radio.loss = 0.5;
    let (mut total, mut largest) = ([0; 4], 0);
    for tick in 0..80 {
        let words = team.tick_over(tick, &mut radio);
        largest = words.said.iter().map(|(_, message)| message.size_bytes()).max().unwrap().max(largest);
        let allowed = BYTES_PER_S * (PERIOD.s() * tick as f64 + 1.0) + largest as f64;
        for (total, (bytes, _)) in total.iter_mut().zip(said_again(4, &words)) {
            *total += bytes;
            assert!((*total as f64) <= allowed, "{tick}: {total}");
        }
    }
    // Almost all of it is needed.
    assert!(total.iter().all(|total| *total as f64 > 0.8 * BYTES_PER_S * 40.0), "{total:?}");
}

/// Two pictures that will be followed by others have two digests: also if nothing but a group differs, or a duty.
#[test]
fn a_digest_tells_groups_and_duties_apart() {
    let mut team = Team::new(3, 4);
    (0..20).for_each(|tick| team.tick(tick));
    let picture = team.agents[0].picture();
    let digest_with = |change: &dyn Fn(&mut Picture)| {
        let mut other = picture.clone();
        change(&mut other);
        other.digest()
    };
    assert_eq!(digest_with(&|_| {}), picture.digest());
    for change in [
        &|other: &mut Picture| other.groups[0].altitude_m += 1.0,
        &|other: &mut Picture| other.groups[0].standoff.distance_m += 1e-9,
        &|other: &mut Picture| other.crew.truncate(2),
        &|other: &mut Picture| other.team.truncate(2),
    ] as [&dyn Fn(&mut Picture); 4]
    {
        assert_ne!(digest_with(change), picture.digest());
    }
}

/// What may happen to a team's words: so many UAVs and targets, losses, delays, words heard twice, one who hears nothing of
/// another; all until the faults end.
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

/// Whatever is missing by then has been said again, and words are taken to come in time again, so many periods after the
/// faults have ended.
const REPAIRED_AFTER: i64 = 45;

/// 60, or more if `PROPTEST_CASES` says so.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").map_or(60, |cases| cases.parse().unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(cases()) })]
    /// Whatever is lost, late, said twice or out of order: every picture that anybody has committed is that of a fleet that
    /// has heard all at once, to the bit; and soon after the faults have ended all have caught up.
    #[test]
    fn all_commit_to_the_same_whatever_is_lost_or_late(faults in any_faults()) {
        let mut params = TeamParams::table_1();
        // So that repairs need not wait.
        params.log.repair_bytes_per_s = 20_000.0;
        let mut team = Team::of(faults.uavs, faults.targets, params);
        let (mut radio, mut truth) = (Radio::new(faults.seed), Truth::new(params));
        (radio.late_max, radio.twice) = (faults.late_max, faults.twice);
        for tick in 0..faults.until + REPAIRED_AFTER {
            if tick == 1 {
                // Who is never heard in the beginning is not waited for.
                radio.loss = faults.loss;
                radio.deaf.extend(faults.deaf);
            }
            if tick == faults.until {
                radio.heal();
            }
            let Words { said, .. } = team.tick_over(tick, &mut radio);
            truth.hear(Time::from_us(tick * PERIOD.us()), &said);
            for agent in &team.agents {
                prop_assert!(agent.committed().is_none_or(|picture| truth.is(picture)), "{:?} at {tick}", agent.id());
            }
        }
        prop_assert_eq!(committed_ago(&team), vec![Some(2); team.agents.len()]);
        prop_assert!(team.agents.iter().all(|agent| truth.is(agent.picture())));
    }
}
