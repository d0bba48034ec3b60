use super::*;
use crate::log::repair::Repair;
use crate::message::{Stamp, TargetLabel};
use crate::{Angle, Position, UavState, Velocity};

/// In periods: Table I's 3 s and a minute, of half a second each.
const LEASE: i64 = 6;
const HORIZON: i64 = 120;

fn log() -> Log {
    let mut log = Log::new(UavId(0), &TeamParams::table_1());
    log.begin(0);
    log
}

fn us(instant: i64) -> Time {
    Time::from_us(instant * 500_000)
}

fn report(uav: u32, instant: i64) -> Report {
    let state = UavState::straight(Position::ORIGIN, Angle::ZERO, 40.0);
    Report { sequence: instant as u32, ..Report::of(UavId(uav), us(instant), state) }
}

/// A report that tells to hold all of these UAVs up to the instant before.
fn telling(uav: u32, instant: i64, of: &[u32]) -> Report {
    let held = |of: &u32| Held { speaker: Speaker::Uav(UavId(*of)), from: 0, to: instant - 1 };
    let held = of.iter().filter(|_| instant > 0).map(held).collect();
    let (since, committed, stamp, listed_after) = (us(0), us(-1), Stamp::default(), us(-1));
    let (disturbed, asks) = (us(-99), None);
    let knowledge = Knowledge { since, committed, stamp, listed_after, held, disturbed, asks };
    Report { knowledge: Some(Box::new(knowledge)), ..report(uav, instant) }
}

/// The same, telling to hold this.
fn telling_of(uav: u32, instant: i64, held: Vec<Held>) -> Report {
    let mut report = telling(uav, instant, &[]);
    report.knowledge.as_mut().unwrap().held = held;
    report
}

fn cue(label: u32, instant: i64) -> Cue {
    Cue {
        searcher: 5,
        said: us(instant),
        number: label as u16,
        label: TargetLabel(label),
        time: us(instant),
        position: Position::ORIGIN,
        velocity: Velocity::ZERO,
        position_sd_m: 20.0,
        velocity_sd_m_s: 3.0,
    }
}

fn heard(log: &Log, instant: i64) -> Vec<u32> {
    log.row(instant).map_or(Vec::new(), |row| row.reports().iter().map(|report| report.uav.0).collect())
}

#[test]
fn a_late_report_counts_for_its_instant_until_that_is_committed() {
    let mut log = log();
    log.hear_report(&report(1, 9), 9, 4);
    assert_eq!(core::mem::replace(&mut log.changed_from, i64::MAX), 9);
    log.hear_report(&report(1, 5), 9, 4);
    assert_eq!((heard(&log, 5), log.changed_from), (vec![1], 5));
    // A second time it is no news; nor is it wrong, whether that instant is committed by now or not.
    log.changed_from = i64::MAX;
    log.hear_report(&report(1, 5), 9, 4);
    log.hear_report(&report(1, 5), 9, 5);
    assert_eq!((log.refused, log.changed_from), (Refused::NONE, i64::MAX));
    log.hear_report(&report(1, 4), 9, 4);
    log.hear_cue(&cue(7, 4), 9, 4);
    assert_eq!((log.refused, log.changed_from), (Refused { late: 2, ..Refused::NONE }, i64::MAX));
    assert!(heard(&log, 4).is_empty() && log.row(4).unwrap().cues().is_empty());
}

#[test]
fn a_stamp_within_a_tenth_of_a_period_is_that_of_its_instant() {
    let mut log = log();
    for off_us in [-50_000, -1, 0, 1, 50_000] {
        assert_eq!(log.instant(us(7) + Duration::from_us(off_us)), Some(7));
        assert_eq!(log.instant(us(-7) + Duration::from_us(off_us)), Some(-7));
    }
    for off_us in [-50_001, 50_001, 250_000] {
        assert_eq!(log.instant(us(7) + Duration::from_us(off_us)), None);
        log.hear_report(&Report { time: us(7) + Duration::from_us(off_us), ..report(1, 7) }, 7, -1);
        log.hear_cue(&Cue { said: us(7) + Duration::from_us(off_us), ..cue(1, 7) }, 7, -1);
    }
    assert_eq!((log.refused, heard(&log, 7)), (Refused { off_grid: 6, ..Refused::NONE }, vec![]));
    // No time overflows, wherever it leads to.
    for us in [i64::MIN, i64::MIN + 1, i64::MAX - 1, i64::MAX] {
        log.hear_report(&Report { time: Time::from_us(us), ..report(1, 7) }, 7, -1);
    }
    assert!(log.refused.messages() <= 10 && log.peers().iter().all(|peer| peer.newest < 7));
}

#[test]
fn what_comes_early_waits_for_its_instant_and_what_comes_too_early_is_refused() {
    let mut log = log();
    log.turn_to(3, 0);
    log.hear_report(&report(1, 3 + LEASE), 3, -1);
    assert_eq!((heard(&log, 3 + LEASE), log.refused), (vec![1], Refused::NONE));
    log.hear_report(&report(2, 4 + LEASE), 3, -1);
    assert_eq!((heard(&log, 4 + LEASE), log.refused.off_grid), (vec![], 1));
}

#[test]
fn lists_out_of_bounds_or_out_of_order_are_nonsense() {
    let held = |uav, from, to| Held { speaker: Speaker::Uav(UavId(uav)), from, to };
    let many = |count| (0..count).map(|number| held(1, 2 * number, 2 * number)).collect::<Vec<_>>();
    let is_refused = |held: Vec<Held>| {
        let mut log = log();
        log.hear_report(&telling_of(1, 3, held), 3, -1);
        assert_eq!(heard(&log, 3).is_empty(), log.refused.nonsense == 1);
        log.refused.nonsense == 1
    };
    assert!(!is_refused(many(HELD_MAX as i64)) && is_refused(many(HELD_MAX as i64 + 1)));
    assert!(!is_refused(vec![held(1, 0, 1), held(1, 2, 2), held(2, 0, 0)]));
    for wrong in [[held(1, 1, 0), held(2, 0, 0)], [held(2, 0, 0), held(1, 0, 0)], [held(1, 0, 1), held(1, 1, 2)]] {
        assert!(is_refused(wrong.to_vec()), "{wrong:?}");
    }
}

#[test]
fn who_is_silent_is_there_for_the_lease_and_who_has_left_is_not() {
    let mut log = log();
    log.hear_report(&report(1, 10), 10, -1);
    let mut left = report(2, 10);
    left.leaves = true;
    log.hear_report(&left, 10, -1);
    let presence = |log: &Log, now: i64| {
        let told = log.peers().iter().map(|peer| (peer.uav.0, peer.presence(now, log.lease())));
        told.collect::<Vec<_>>()
    };
    let left = (2, Presence::Left);
    for (later, one) in [
        (0, Presence::Live),
        (1, Presence::Live),
        (2, Presence::Silent),
        (LEASE, Presence::Silent),
        (LEASE + 1, Presence::Gone),
    ] {
        assert_eq!(presence(&log, 10 + later), [(1, one), left]);
    }
    log.hear_report(&report(2, 20), 20, -1);
    assert_eq!(presence(&log, 20)[1], (2, Presence::Live));
    // What it said before it came back is said again: it does not leave once more.
    log.hear_report(&Report { leaves: true, ..report(2, 15) }, 20, -1);
    assert_eq!(presence(&log, 20)[1], (2, Presence::Live));
    // Others have heard it again.
    log.hear_report(&Report { leaves: true, ..report(2, 21) }, 21, -1);
    assert_eq!(presence(&log, 21)[1], left);
    log.hear_report(&telling_of(1, 24, vec![Held { speaker: Speaker::Uav(UavId(2)), from: 10, to: 23 }]), 24, -1);
    assert_eq!(presence(&log, 24)[1], (2, Presence::Live));
}

#[test]
fn whom_others_have_heard_is_there_too() {
    let mut log = log();
    log.hear_report(&telling(1, 10, &[1, 7]), 10, -1);
    let told: Vec<_> = log.peers().iter().map(|peer| (peer.uav.0, peer.newest)).collect();
    assert_eq!(told, [(1, 10), (7, 9)]);
    // Nobody has heard of an instant to come.
    let lie = vec![Held { speaker: Speaker::Uav(UavId(8)), from: 3, to: 12 }];
    log.hear_report(&telling_of(1, 11, lie), 11, -1);
    assert_eq!(log.peers().len(), 2);
}

/// An instant is complete once everybody has reported it and has told, at the next one, what else was said of it.
#[test]
fn an_instant_is_complete_when_nothing_of_it_can_be_missing() {
    let mut log = log();
    let mut hear = |report: Report| {
        if report.uav == UavId(0) {
            log.say(report.sequence.into(), Said::of(&report));
        } else {
            log.hear_report(&report, report.sequence.into(), -1);
        }
        [0, 1].map(|instant| log.is_complete(instant))
    };
    for uav in 0..3 {
        assert_eq!(hear(telling(uav, 0, &[])), [false; 2]);
    }
    assert_eq!(hear(telling(0, 1, &[])), [false; 2]);
    assert_eq!(hear(telling(1, 1, &[0, 1])), [false; 2]);
    assert_eq!(hear(telling(2, 1, &[2])), [true, false]);
    // One has heard of a fourth UAV, and so does it speak: its report is waited for.
    assert_eq!(hear(telling(1, 2, &[0, 1, 7])), [false; 2]);
    assert_eq!(hear(telling(7, 0, &[])), [false; 2]);
    assert_eq!(hear(telling(7, 1, &[])), [true, false]);
    for uav in [0, 2, 7] {
        assert_eq!(hear(telling(uav, 2, &[]))[1], uav == 7);
    }
}

/// Nor is it while a peer holds a cue of it that is missing here, or its list does not go back so far.
#[test]
fn what_a_peer_holds_is_waited_for() {
    let with = |change: &dyn Fn(&mut Report), late: Option<Cue>| {
        let mut log = log();
        for instant in 0..2 {
            log.say(instant, Said::of(&report(0, instant)));
        }
        log.hear_report(&telling(1, 0, &[]), 0, -1);
        let mut next = telling(1, 1, &[0, 1]);
        change(&mut next);
        log.hear_report(&next, 1, -1);
        late.iter().for_each(|cue| log.hear_cue(cue, 1, -1));
        log.is_complete(0)
    };
    let told = |report: &mut Report| report.knowledge.clone().unwrap();
    let holds_a_cue = |report: &mut Report| {
        let mut knowledge = told(report);
        knowledge.held.push(Held { speaker: Speaker::Searcher(5), from: 3, to: 3 });
        report.knowledge = Some(knowledge);
    };
    let lists_less = |report: &mut Report| {
        let knowledge = Knowledge { listed_after: us(0), ..*told(report) };
        report.knowledge = Some(Box::new(knowledge));
    };
    assert!(with(&|_| {}, None) && !with(&holds_a_cue, None));
    assert!(with(&holds_a_cue, Some(cue(3, 0))) && !with(&holds_a_cue, Some(cue(4, 0))));
    assert!(!with(&lists_less, None) && !with(&|report| report.knowledge = None, None));
}

/// Who was off is waited for only until it is back and tells that there is nothing to wait for, unless a teammate holds it.
#[test]
fn what_a_peer_tells_that_it_never_said_is_not_waited_for() {
    let mut log = log();
    for instant in 0..9 {
        log.say(instant, Said::of(&report(0, instant)));
        if !(2..5).contains(&instant) {
            let from = if instant < 2 { 0 } else { 5 };
            log.hear_report(
                &telling_of(1, instant, vec![Held { speaker: Speaker::Uav(UavId(1)), from, to: instant }]),
                instant,
                -1,
            );
        }
        let complete = (0..9).filter(|instant| log.is_complete(*instant)).collect::<Vec<_>>();
        assert_eq!(complete, (0..if instant < 5 { instant.min(1) } else { instant }).collect::<Vec<_>>());
    }
    let other = vec![Held { speaker: Speaker::Uav(UavId(1)), from: 0, to: 3 }];
    log.hear_report(&telling_of(2, 9, other), 9, -1);
    assert_eq!([2, 3, 4].map(|instant| log.is_complete(instant)), [false, false, true]);
}

/// Where words come late, a cue may be in nobody's list when all have spoken again: by as much as words have been late.
#[test]
fn as_long_as_words_have_been_late_cues_of_an_instant_are_waited_for() {
    let mut log = log();
    for instant in 0..9 {
        log.say(instant, Said::of(&report(0, instant)));
        log.hear_report(&telling(1, instant, &[0, 1]), instant + if instant == 2 { 3 } else { 0 }, -1);
    }
    assert_eq!((0..9).filter(|instant| log.is_complete(*instant)).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
}

#[test]
fn what_the_horizon_has_passed_is_forgotten_unless_a_picture_needs_it() {
    let mut log = log();
    log.say(0, Said::of(&report(0, 0)));
    log.hear_report(&report(1, 1), 1, -1);
    log.turn_to(HORIZON + 1, 0);
    assert_eq!((heard(&log, 0), heard(&log, 1), log.peers().len()), (vec![0], vec![1], 2));
    log.turn_to(HORIZON + 1, HORIZON + 1);
    assert_eq!((heard(&log, 0), heard(&log, 1), log.peers().len()), (vec![], vec![1], 2));
    log.turn_to(HORIZON + 2, HORIZON + 2);
    // Who was not heard for so long was never there; but for this UAV.
    assert_eq!((heard(&log, 1), log.peers().iter().map(|peer| peer.uav.0).collect()), (vec![], vec![0]));
    assert!(!log.holds(Speaker::Uav(UavId(1)), 1));
    // Older than the log: nobody's fault, and nothing.
    log.hear_report(&report(2, 1), HORIZON + 2, -1);
    assert_eq!((heard(&log, 1), log.refused), (vec![], Refused::NONE));
    log.reach_back(1);
    log.hear_report(&report(2, 1), HORIZON + 2, -1);
    assert_eq!(heard(&log, 1), [2]);
}

/// Ghosts take all the room there is, until they have been silent for the horizon.
#[test]
fn uavs_that_are_silent_for_the_horizon_make_room() {
    let mut log = log();
    log.say(0, Said::of(&report(0, 0)));
    (0..TEAM_MAX as u32).for_each(|ghost| log.hear_report(&report(1000 + ghost, 0), 0, -1));
    assert_eq!((heard(&log, 0).len(), log.refused.nonsense), (TEAM_MAX, 1));
    for (now, is_heard) in [(HORIZON, false), (HORIZON + 1, true)] {
        log.turn_to(now, now);
        log.hear_report(&report(1, now), now, now - 1);
        assert_eq!(heard(&log, now).contains(&1), is_heard, "{now}");
        // The own report has its room.
        log.say(now, Said::of(&report(0, now)));
        assert!(heard(&log, now).contains(&0));
    }
}

/// Who is only heard of takes nobody's place: not that of this agent before it has spoken, nor that of who speaks.
#[test]
fn a_list_of_ghosts_shuts_nobody_out() {
    let mut log = log();
    let ghosts: Vec<u32> = (1000..1300).collect();
    log.hear_report(&telling(1, 3, &ghosts), 3, -1);
    assert_eq!(log.peers().len(), TEAM_MAX - 1);
    assert_ne!(log.say(3, Said::of(&report(0, 3))), Put::Refused);
    for uav in 2..9 {
        log.hear_report(&report(uav, 3), 3, -1);
        log.hear_report(&telling(1, 3, &ghosts), 3, -1);
    }
    assert_eq!((heard(&log, 3), log.refused), ((0..9).collect(), Refused::NONE));
    assert_eq!(log.peers().len(), TEAM_MAX);
}

/// As late as words come, so long is waited for those that nobody has told of yet, also while they all come alike.
#[test]
fn what_is_late_all_the_time_is_waited_for_all_the_time() {
    let mut log = log();
    for now in 3..90 {
        log.turn_to(now, 0);
        if now < 50 {
            log.hear_report(&report(1, now - 3), now, -1);
        } else {
            log.hear_report(&report(1, now), now, -1);
        }
        // Ten seconds, or 20 periods, after the last one that was late, none is.
        assert_eq!(log.longest_delay, if now <= 69 { 3 } else { 0 }, "{now}");
    }
}

#[test]
fn the_shortest_lease_is_a_period() {
    let params = TeamParams { teammate_timeout_s: 1e-7, ..TeamParams::table_1() };
    assert!(params.errors().is_empty());
    assert_eq!(Log::new(UavId(0), &params).lease(), 1);
}

#[test]
fn what_is_held_is_listed_from_a_little_before_what_is_committed() {
    let mut log = log();
    let committed = LISTED_BEFORE + 12;
    for instant in (0..committed + 9).filter(|instant| *instant != committed + 5) {
        log.hear_report(&report(1, instant), instant, -1);
    }
    log.hear_cue(&cue(3, 12), committed + 9, -1);
    log.hear_cue(&cue(3, committed + 8), committed + 9, -1);
    let mut knowledge = Knowledge::default();
    log.list(committed, &mut knowledge);
    let held = |speaker, from, to| Held { speaker, from, to };
    let (one, searcher) = (Speaker::Uav(UavId(1)), Speaker::Searcher(5));
    let number = (committed + 8) * 65_536 + 3;
    assert_eq!(knowledge.listed_after, us(12));
    let of_one = [held(one, 13, committed + 4), held(one, committed + 6, committed + 8)];
    assert_eq!(knowledge.held, [of_one[0], of_one[1], held(searcher, number, number)]);
}

/// Of one transmitter that speaks as many, each of which lacks all; a team of four that lacks as much is told all of it that is
/// not late as all was.
#[test]
fn of_what_ever_so_many_lack_a_part_is_looked_at_in_a_period() {
    for (uavs, said) in [(4, 4 * 44), (250, 16)] {
        let mut log = log();
        (0..50).for_each(|instant| _ = log.say(instant, Said::of(&report(0, instant))));
        log.turn_to(50, 0);
        for instant in 0..50 {
            (1..4).for_each(|uav| log.hear_report(&report(uav, instant), 50, -1));
        }
        (1..uavs).for_each(|uav| log.hear_report(&telling_of(uav, 51, Vec::new()), 50, -1));
        let (mut repair, mut told) = (Repair::default(), 0);
        repair.earn(1e9, 0.5);
        repair.say(&log, 52, |_| told += 1);
        assert_eq!(told, said, "{uavs}");
    }
}

#[test]
fn those_who_hand_targets_over_are_only_so_many() {
    let mut log = log();
    let said_by = |searcher| Cue { searcher, ..cue(1, 3) };
    (0..=TEAM_MAX as u32).for_each(|searcher| log.hear_cue(&said_by(searcher), 3, -1));
    let cues = |log: &Log| log.row(3).map(|row| row.cues().len());
    assert_eq!((cues(&log), log.refused.nonsense), (Some(TEAM_MAX), 1));
    // Who is known is heard on.
    log.hear_cue(&Cue { number: 7, ..said_by(0) }, 3, -1);
    assert_eq!((cues(&log), log.refused.nonsense), (Some(TEAM_MAX + 1), 1));
}

/// Who counts as alike lacks nothing that is held here, and nothing that it holds is missing here, as every list is read
/// that differs.
#[test]
fn who_counts_as_alike_holds_what_is_held_here() {
    let mut seed = 1u64;
    let mut draw = |n: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % n
    };
    let (mut alike, mut unlike) = (0, 0);
    let mut check = |log: &Log, now: i64| {
        for peer in log.peers().iter().filter(|peer| peer.knows_at != NEVER) {
            let unlike_peer = Peer { is_alike: false, ..peer.clone() };
            let mut lacks = 0;
            for (speaker, runs) in &log.held {
                let range = (first_of(*speaker, 0), last_of(*speaker, peer.knows_at - 1));
                runs.without(peer.held(*speaker), range, |_| lacks += 1);
            }
            let is_alike = lacks == 0 && !log.lacks_of(&unlike_peer, (0, now));
            assert!(is_alike || !peer.is_alike, "{now}: {peer:?}, {:?}", log.held);
            *(if peer.is_alike { &mut alike } else { &mut unlike }) += 1;
        }
    };
    for _ in 0..200 {
        let (mut log, mut on_the_way) = (log(), Vec::new());
        for now in 0..20 {
            log.turn_to(now, 0);
            log.say(now, Said::of(&report(0, now)));
            if draw(6) == 0 {
                log.hear_cue(&cue(now as u32, now - draw(3) as i64), now, -1);
            }
            for uav in 1..4 {
                let mut report = telling(uav, now, &[]);
                let knowledge = report.knowledge.as_mut().unwrap();
                log.list(-1, knowledge);
                // It has heard what is heard here, but for what is said just now; now and then less or more.
                let own = Speaker::Uav(UavId(uav));
                for run in &mut knowledge.held {
                    let is_own_last = run.speaker == own && run.to == now - 1;
                    run.to += i64::from(is_own_last) - i64::from(run.speaker != own && run.to == now);
                    run.from += i64::from(draw(30) == 0);
                    run.to += [-1, 1][draw(2) as usize] * i64::from(draw(30) == 0);
                }
                knowledge.held.retain(|run| run.from <= run.to && draw(40) > 0);
                if draw(8) == 0 {
                    on_the_way.push(report);
                } else {
                    log.hear_report(&report, now, -1);
                    check(&log, now);
                }
            }
            if draw(3) == 0 {
                for late in on_the_way.drain(..) {
                    log.hear_report(&late, now, -1);
                    check(&log, now);
                }
            }
        }
    }
    assert!(alike > 1000 && unlike > 1000, "{alike} {unlike}");
}
