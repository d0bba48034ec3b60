use super::*;
use crate::message::{CommitDigest, TargetLabel};
use crate::message_log::retransmission::{RadioLoad, Retransmission};
use crate::message_log::teammates::TeammateStatus;
use crate::{Angle, Position, UavState, Velocity};

/// Teammate timeout and retention time of Table I, 3 s and one minute, in periods of half a second.
const LEASE: i64 = 6;
const HORIZON: i64 = 120;

fn log() -> MessageLog {
    let mut log = MessageLog::new(UavId(0), &TeamParams::paper());
    log.begin(0);
    log
}

fn us(step: i64) -> Time {
    Time::from_us(step * 500_000)
}

fn report(uav: u32, step: i64) -> Report {
    let state = UavState::level_flight(Position::ORIGIN, Angle::ZERO, 40.0);
    Report { sequence: step as u32, ..Report::position_only(UavId(uav), us(step), state) }
}

/// A report that lists all reports of these UAVs up to the previous time step as received.
fn listing(uav: u32, step: i64, of: &[u32]) -> Report {
    let held = |of: &u32| ReceivedRange { source: MessageSource::Uav(UavId(*of)), from: 0, to: step - 1 };
    let held = of.iter().filter(|_| step > 0).map(held).collect();
    let (since, committed, commit_digest, listed_after) = (us(0), us(-1), CommitDigest::default(), us(-1));
    let (disturbed, snapshot_request) = (us(-99), None);
    let log_status = LogStatus {
        start: since,
        committed_until: committed,
        commit_digest,
        listed_after,
        received: held,
        degraded_at: disturbed,
        snapshot_request,
    };
    Report { log_status: Some(Box::new(log_status)), ..report(uav, step) }
}

/// A report that lists these ranges as received.
fn listing_ranges(uav: u32, step: i64, held: Vec<ReceivedRange>) -> Report {
    let mut report = listing(uav, step, &[]);
    report.log_status.as_mut().unwrap().received = held;
    report
}

fn cue(label: u32, step: i64) -> Cue {
    Cue {
        source: 5,
        issued_at: us(step),
        sequence: label as u16,
        label: Some(TargetLabel(label)),
        time: us(step),
        position: Position::ORIGIN,
        velocity: Velocity::ZERO,
        position_sd_m: 20.0,
        velocity_sd_m_s: 3.0,
        priority: None,
    }
}

fn stored_uavs(log: &MessageLog, step: i64) -> Vec<u32> {
    log.messages(step).map_or(Vec::new(), |row| row.reports().iter().map(|report| report.uav.0).collect())
}

#[test]
fn late_reports_count_for_their_time_step_until_it_is_committed() {
    let mut log = log();
    log.receive_report(&report(1, 9), 9, 4);
    assert_eq!(core::mem::replace(&mut log.changed_from, i64::MAX), 9);
    log.receive_report(&report(1, 5), 9, 4);
    assert_eq!((stored_uavs(&log, 5), log.changed_from), (vec![1], 5));
    // A duplicate changes nothing, and is not an error, whether its time step is committed or not.
    log.changed_from = i64::MAX;
    log.receive_report(&report(1, 5), 9, 4);
    log.receive_report(&report(1, 5), 9, 5);
    assert_eq!((log.rejected, log.changed_from), (Rejected::default(), i64::MAX));
    log.receive_report(&report(1, 4), 9, 4);
    log.receive_cue(&cue(7, 4), 9, 4);
    assert_eq!((log.rejected, log.changed_from), (Rejected { late: 2, ..Rejected::default() }, i64::MAX));
    assert!(stored_uavs(&log, 4).is_empty() && log.messages(4).unwrap().cues().is_empty());
}

#[test]
fn times_within_a_tenth_of_a_period_belong_to_the_time_step() {
    let mut log = log();
    for off_us in [-50_000, -1, 0, 1, 50_000] {
        assert_eq!(log.step(us(7) + Duration::from_us(off_us)), Some(7));
        assert_eq!(log.step(us(-7) + Duration::from_us(off_us)), Some(-7));
    }
    for off_us in [-50_001, 50_001, 250_000] {
        assert_eq!(log.step(us(7) + Duration::from_us(off_us)), None);
        log.receive_report(&Report { time: us(7) + Duration::from_us(off_us), ..report(1, 7) }, 7, -1);
        log.receive_cue(&Cue { issued_at: us(7) + Duration::from_us(off_us), ..cue(1, 7) }, 7, -1);
    }
    assert_eq!((log.rejected, stored_uavs(&log, 7)), (Rejected { off_grid: 6, ..Rejected::default() }, vec![]));
    // No time causes an overflow.
    for us in [i64::MIN, i64::MIN + 1, i64::MAX - 1, i64::MAX] {
        log.receive_report(&Report { time: Time::from_us(us), ..report(1, 7) }, 7, -1);
    }
    assert!(log.rejected.messages() <= 10 && log.teammates().iter().all(|peer| peer.newest < 7));
}

#[test]
fn early_reports_are_stored_and_too_early_ones_are_rejected() {
    let mut log = log();
    log.turn_to(3, 0);
    log.receive_report(&report(1, 3 + LEASE), 3, -1);
    assert_eq!((stored_uavs(&log, 3 + LEASE), log.rejected), (vec![1], Rejected::default()));
    log.receive_report(&report(2, 4 + LEASE), 3, -1);
    assert_eq!((stored_uavs(&log, 4 + LEASE), log.rejected.off_grid), (vec![], 1));
}

#[test]
fn lists_that_are_too_long_or_unordered_are_malformed() {
    let held = |uav, from, to| ReceivedRange { source: MessageSource::Uav(UavId(uav)), from, to };
    let many = |count| (0..count).map(|number| held(1, 2 * number, 2 * number)).collect::<Vec<_>>();
    let is_rejected = |held: Vec<ReceivedRange>| {
        let mut log = log();
        log.receive_report(&listing_ranges(1, 3, held), 3, -1);
        assert_eq!(stored_uavs(&log, 3).is_empty(), log.rejected.malformed == 1);
        log.rejected.malformed == 1
    };
    assert!(!is_rejected(many(RECEIVED_RANGES_MAX as i64)) && is_rejected(many(RECEIVED_RANGES_MAX as i64 + 1)));
    assert!(!is_rejected(vec![held(1, 0, 1), held(1, 2, 2), held(2, 0, 0)]));
    for wrong in [[held(1, 1, 0), held(2, 0, 0)], [held(2, 0, 0), held(1, 0, 0)], [held(1, 0, 1), held(1, 1, 2)]] {
        assert!(is_rejected(wrong.to_vec()), "{wrong:?}");
    }
}

#[test]
fn silent_teammates_time_out_and_leaving_teammates_are_gone() {
    let mut log = log();
    log.receive_report(&report(1, 10), 10, -1);
    let mut left = report(2, 10);
    left.is_leaving = true;
    log.receive_report(&left, 10, -1);
    let status = |log: &MessageLog, now: i64| {
        let statuses = log.teammates().iter().map(|peer| (peer.uav.0, peer.status(now, log.teammate_timeout())));
        statuses.collect::<Vec<_>>()
    };
    let left = (2, TeammateStatus::Left);
    for (later, one) in [
        (0, TeammateStatus::Live),
        (1, TeammateStatus::Live),
        (2, TeammateStatus::Silent),
        (LEASE, TeammateStatus::Silent),
        (LEASE + 1, TeammateStatus::TimedOut),
    ] {
        assert_eq!(status(&log, 10 + later), [(1, one), left]);
    }
    log.receive_report(&report(2, 20), 20, -1);
    assert_eq!(status(&log, 20)[1], (2, TeammateStatus::Live));
    // A retransmitted report from before its return does not make it leave again.
    log.receive_report(&Report { is_leaving: true, ..report(2, 15) }, 20, -1);
    assert_eq!(status(&log, 20)[1], (2, TeammateStatus::Live));
    // A teammate has received a report since.
    log.receive_report(&Report { is_leaving: true, ..report(2, 21) }, 21, -1);
    assert_eq!(status(&log, 21)[1], left);
    log.receive_report(
        &listing_ranges(1, 24, vec![ReceivedRange { source: MessageSource::Uav(UavId(2)), from: 10, to: 23 }]),
        24,
        -1,
    );
    assert_eq!(status(&log, 24)[1], (2, TeammateStatus::Live));
}

#[test]
fn uavs_listed_by_teammates_are_added() {
    let mut log = log();
    log.receive_report(&listing(1, 10, &[1, 7]), 10, -1);
    let peers: Vec<_> = log.teammates().iter().map(|peer| (peer.uav.0, peer.newest)).collect();
    assert_eq!(peers, [(1, 10), (7, 9)]);
    // A list entry of a future time step is ignored.
    let listed = vec![ReceivedRange { source: MessageSource::Uav(UavId(8)), from: 3, to: 12 }];
    log.receive_report(&listing_ranges(1, 11, listed), 11, -1);
    assert_eq!(log.teammates().len(), 2);
}

/// A time step is complete once every UAV has reported it and has listed, in its next report, which other entries of it
/// have arrived.
#[test]
fn a_time_step_is_complete_when_no_entry_can_be_missing() {
    let mut log = log();
    let mut hear = |report: Report| {
        if report.uav == UavId(0) {
            log.append_own(report.sequence.into(), ReportView::of(&report));
        } else {
            log.receive_report(&report, report.sequence.into(), -1);
        }
        [0, 1].map(|step| log.is_complete(step))
    };
    for uav in 0..3 {
        assert_eq!(hear(listing(uav, 0, &[])), [false; 2]);
    }
    assert_eq!(hear(listing(0, 1, &[])), [false; 2]);
    assert_eq!(hear(listing(1, 1, &[0, 1])), [false; 2]);
    assert_eq!(hear(listing(2, 1, &[2])), [true, false]);
    // UAV 1 lists a fourth UAV, which then reports: its reports are now due.
    assert_eq!(hear(listing(1, 2, &[0, 1, 7])), [false; 2]);
    assert_eq!(hear(listing(7, 0, &[])), [false; 2]);
    assert_eq!(hear(listing(7, 1, &[])), [true, false]);
    for uav in [0, 2, 7] {
        assert_eq!(hear(listing(uav, 2, &[]))[1], uav == 7);
    }
}

/// A time step is incomplete while a teammate lists a cue that is missing here, or while its list does not reach back
/// to the time step.
#[test]
fn entries_listed_by_teammates_delay_completion() {
    let with = |change: &dyn Fn(&mut Report), late: Option<Cue>| {
        let mut log = log();
        for step in 0..2 {
            log.append_own(step, ReportView::of(&report(0, step)));
        }
        log.receive_report(&listing(1, 0, &[]), 0, -1);
        let mut next = listing(1, 1, &[0, 1]);
        change(&mut next);
        log.receive_report(&next, 1, -1);
        late.iter().for_each(|cue| log.receive_cue(cue, 1, -1));
        log.is_complete(0)
    };
    let status = |report: &mut Report| report.log_status.clone().unwrap();
    let lists_a_cue = |report: &mut Report| {
        let mut log_status = status(report);
        log_status.received.push(ReceivedRange { source: MessageSource::CueSource(5), from: 3, to: 3 });
        report.log_status = Some(log_status);
    };
    let lists_less = |report: &mut Report| {
        let log_status = LogStatus { listed_after: us(0), ..*status(report) };
        report.log_status = Some(Box::new(log_status));
    };
    assert!(with(&|_| {}, None) && !with(&lists_a_cue, None));
    assert!(with(&lists_a_cue, Some(cue(3, 0))) && !with(&lists_a_cue, Some(cue(4, 0))));
    assert!(!with(&lists_less, None) && !with(&|report| report.log_status = None, None));
}

/// A UAV that was off delays completion only until it is back and its list shows that its reports never existed, unless
/// a teammate lists them.
#[test]
fn reports_that_never_existed_do_not_delay_completion() {
    let mut log = log();
    for step in 0..9 {
        log.append_own(step, ReportView::of(&report(0, step)));
        if !(2..5).contains(&step) {
            let from = if step < 2 { 0 } else { 5 };
            log.receive_report(
                &listing_ranges(1, step, vec![ReceivedRange { source: MessageSource::Uav(UavId(1)), from, to: step }]),
                step,
                -1,
            );
        }
        let complete = (0..9).filter(|step| log.is_complete(*step)).collect::<Vec<_>>();
        assert_eq!(complete, (0..if step < 5 { step.min(1) } else { step }).collect::<Vec<_>>());
    }
    let other = vec![ReceivedRange { source: MessageSource::Uav(UavId(1)), from: 0, to: 3 }];
    log.receive_report(&listing_ranges(2, 9, other), 9, -1);
    assert_eq!([2, 3, 4].map(|step| log.is_complete(step)), [false, false, true]);
}

/// With delays, a cue may be missing in all lists although all have reported again: completion waits for the longest
/// delay.
#[test]
fn completion_waits_for_the_longest_delay_of_reports() {
    let mut log = log();
    for step in 0..9 {
        log.append_own(step, ReportView::of(&report(0, step)));
        log.receive_report(&listing(1, step, &[0, 1]), step + if step == 2 { 3 } else { 0 }, -1);
    }
    assert_eq!((0..9).filter(|step| log.is_complete(*step)).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
}

#[test]
fn entries_older_than_the_retention_time_are_removed_unless_a_team_state_needs_them() {
    let mut log = log();
    log.append_own(0, ReportView::of(&report(0, 0)));
    log.receive_report(&report(1, 1), 1, -1);
    log.turn_to(HORIZON + 1, 0);
    assert_eq!((stored_uavs(&log, 0), stored_uavs(&log, 1), log.teammates().len()), (vec![0], vec![1], 2));
    log.turn_to(HORIZON + 1, HORIZON + 1);
    assert_eq!((stored_uavs(&log, 0), stored_uavs(&log, 1), log.teammates().len()), (vec![], vec![1], 2));
    log.turn_to(HORIZON + 2, HORIZON + 2);
    // A UAV without reports for that long is removed, except the agent's own.
    assert_eq!((stored_uavs(&log, 1), log.teammates().iter().map(|peer| peer.uav.0).collect()), (vec![], vec![0]));
    assert!(!log.holds(MessageSource::Uav(UavId(1)), 1));
    // Entries older than the log are ignored and not counted as errors.
    log.receive_report(&report(2, 1), HORIZON + 2, -1);
    assert_eq!((stored_uavs(&log, 1), log.rejected), (vec![], Rejected::default()));
    log.reach_back(1);
    log.receive_report(&report(2, 1), HORIZON + 2, -1);
    assert_eq!(stored_uavs(&log, 1), [2]);
}

/// Fake ids fill the list of teammates until they have been silent for the retention time.
#[test]
fn uavs_silent_for_the_retention_time_free_their_place_in_the_list() {
    let mut log = log();
    log.append_own(0, ReportView::of(&report(0, 0)));
    (0..TEAMMATES_MAX as u32).for_each(|fake_uav| log.receive_report(&report(1000 + fake_uav, 0), 0, -1));
    assert_eq!((stored_uavs(&log, 0).len(), log.rejected.malformed), (TEAMMATES_MAX, 1));
    for (now, is_stored) in [(HORIZON, false), (HORIZON + 1, true)] {
        log.turn_to(now, now);
        log.receive_report(&report(1, now), now, now - 1);
        assert_eq!(stored_uavs(&log, now).contains(&1), is_stored, "{now}");
        // The own report always has a place.
        log.append_own(now, ReportView::of(&report(0, now)));
        assert!(stored_uavs(&log, now).contains(&0));
    }
}

/// UAVs that are only listed by others take no place from senders, or from this agent before its first report.
#[test]
fn listed_fake_uavs_do_not_exclude_senders() {
    let mut log = log();
    let fake_uavs: Vec<u32> = (1000..1300).collect();
    log.receive_report(&listing(1, 3, &fake_uavs), 3, -1);
    assert_eq!(log.teammates().len(), TEAMMATES_MAX - 1);
    assert_ne!(log.append_own(3, ReportView::of(&report(0, 3))), Insert::Rejected);
    for uav in 2..9 {
        log.receive_report(&report(uav, 3), 3, -1);
        log.receive_report(&listing(1, 3, &fake_uavs), 3, -1);
    }
    assert_eq!((stored_uavs(&log, 3), log.rejected), ((0..9).collect(), Rejected::default()));
    assert_eq!(log.teammates().len(), TEAMMATES_MAX);
}

/// Completion waits for the longest delay, also while all reports are delayed equally.
#[test]
fn completion_also_waits_for_constant_delays() {
    let mut log = log();
    for now in 3..90 {
        log.turn_to(now, 0);
        if now < 50 {
            log.receive_report(&report(1, now - 3), now, -1);
        } else {
            log.receive_report(&report(1, now), now, -1);
        }
        // The delay is forgotten ten seconds, 20 periods, after the last late report.
        assert_eq!(log.link.longest_delay, if now <= 69 { 3 } else { 0 }, "{now}");
    }
}

#[test]
fn the_shortest_teammate_timeout_is_one_period() {
    let params = TeamParams { teammate_timeout_s: 1e-7, ..TeamParams::paper() };
    assert!(params.errors().is_empty());
    assert_eq!(MessageLog::new(UavId(0), &params).teammate_timeout(), 1);
}

#[test]
fn received_entries_are_listed_from_shortly_before_the_last_commit() {
    let mut log = log();
    let committed = LISTED_BEFORE + 12;
    for step in (0..committed + 9).filter(|step| *step != committed + 5) {
        log.receive_report(&report(1, step), step, -1);
    }
    log.receive_cue(&cue(3, 12), committed + 9, -1);
    log.receive_cue(&cue(3, committed + 8), committed + 9, -1);
    let mut log_status = LogStatus::default();
    log.list(committed, &mut log_status);
    let held = |source, from, to| ReceivedRange { source, from, to };
    let (one, searcher) = (MessageSource::Uav(UavId(1)), MessageSource::CueSource(5));
    let number = (committed + 8) * 65_536 + 3;
    assert_eq!(log_status.listed_after, us(12));
    let of_one = [held(one, 13, committed + 4), held(one, committed + 6, committed + 8)];
    assert_eq!(log_status.received, [of_one[0], of_one[1], held(searcher, number, number)]);
}

/// A transmitter that pretends to be many UAVs, all without entries, causes limited work; a team of four without
/// entries gets all entries that are not within the usual delay.
#[test]
fn the_number_of_retransmissions_examined_per_period_is_limited() {
    for (uavs, expected) in [(4, 4 * 44), (250, 16)] {
        let mut log = log();
        (0..50).for_each(|step| _ = log.append_own(step, ReportView::of(&report(0, step))));
        log.turn_to(50, 0);
        for step in 0..50 {
            (1..4).for_each(|uav| log.receive_report(&report(uav, step), 50, -1));
        }
        (1..uavs).for_each(|uav| log.receive_report(&listing_ranges(uav, 51, Vec::new()), 50, -1));
        let (mut retransmission, mut sent) = (Retransmission::default(), 0);
        let (mean_report_bytes, bandwidth_bytes_per_s) = (1e9, None);
        let (period_s, own_report_bytes, teammates, loss) = (0.5, 0, 1, 0.0);
        let load = RadioLoad { period_s, own_report_bytes, mean_report_bytes, teammates, loss, bandwidth_bytes_per_s };
        retransmission.add_budget(&load);
        retransmission.next_messages(&log, 52, |_| sent += 1);
        assert_eq!(sent, expected, "{uavs}");
    }
}

#[test]
fn the_number_of_cue_sources_is_limited() {
    let mut log = log();
    let cue_of = |searcher| Cue { source: searcher, ..cue(1, 3) };
    (0..=TEAMMATES_MAX as u32).for_each(|searcher| log.receive_cue(&cue_of(searcher), 3, -1));
    let cues = |log: &MessageLog| log.messages(3).map(|row| row.cues().len());
    assert_eq!((cues(&log), log.rejected.malformed), (Some(TEAMMATES_MAX), 1));
    // Further cues of a known source are accepted.
    log.receive_cue(&Cue { sequence: 7, ..cue_of(0) }, 3, -1);
    assert_eq!((cues(&log), log.rejected.malformed), (Some(TEAMMATES_MAX + 1), 1));
}

/// A teammate marked as matching lacks no entry that is stored here, and lists no entry that is missing here. The
/// reference result comes from comparing every list in full.
#[test]
fn matching_teammates_have_the_same_entries() {
    let mut seed = 1u64;
    let mut draw = |n: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % n
    };
    let (mut matching, mut different) = (0, 0);
    let mut check = |log: &MessageLog, now: i64| {
        for peer in log.teammates().iter().filter(|peer| peer.log_status_at != NEVER) {
            let unmatched_peer = TeammateLog { log_matches: false, ..peer.clone() };
            let mut lacks = 0;
            for (source, runs) in &log.received {
                let range = (first_of(*source, 0), last_of(*source, peer.log_status_at - 1));
                runs.without(peer.received(*source), range, |_| lacks += 1);
            }
            let is_matching = lacks == 0 && !log.lacks_of(&unmatched_peer, (0, now));
            assert!(is_matching || !peer.log_matches, "{now}: {peer:?}, {:?}", log.received);
            *(if peer.log_matches { &mut matching } else { &mut different }) += 1;
        }
    };
    for _ in 0..200 {
        let (mut log, mut in_transit) = (log(), Vec::new());
        for now in 0..20 {
            log.turn_to(now, 0);
            log.append_own(now, ReportView::of(&report(0, now)));
            if draw(6) == 0 {
                log.receive_cue(&cue(now as u32, now - draw(3) as i64), now, -1);
            }
            for uav in 1..4 {
                let mut report = listing(uav, now, &[]);
                let log_status = report.log_status.as_mut().unwrap();
                log.list(-1, log_status);
                // The sender has received what is stored here except the messages of this time step; at random, less or
                // more.
                let own = MessageSource::Uav(UavId(uav));
                for run in &mut log_status.received {
                    let is_own_last = run.source == own && run.to == now - 1;
                    run.to += i64::from(is_own_last) - i64::from(run.source != own && run.to == now);
                    run.from += i64::from(draw(30) == 0);
                    run.to += [-1, 1][draw(2) as usize] * i64::from(draw(30) == 0);
                }
                log_status.received.retain(|run| run.from <= run.to && draw(40) > 0);
                if draw(8) == 0 {
                    in_transit.push(report);
                } else {
                    log.receive_report(&report, now, -1);
                    check(&log, now);
                }
            }
            if draw(3) == 0 {
                for late in in_transit.drain(..) {
                    log.receive_report(&late, now, -1);
                    check(&log, now);
                }
            }
        }
    }
    assert!(matching > 1000 && different > 1000, "{matching} {different}");
}
