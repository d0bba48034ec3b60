use proptest::prelude::*;

use super::*;
use crate::message::{Cue, Detection, Message, Report, Scan, TargetLabel};
use crate::team::TeamParams;
use crate::{Angle, Displacement, Fleet, Position, Time, UavId, UavState, Velocity, sensor};

/// In periods: Table I's 2 s, of half a second each.
const LAG: i64 = 4;

/// The log of a UAV that nobody sees, and its pictures.
struct Told {
    log: Log,
    history: History,
    now: i64,
}

fn time(instant: i64) -> Time {
    Time::from_us(instant * 500_000)
}

fn target(label: u32, instant: i64) -> Position {
    Position::from_m(90.0 * f64::from(label), 0.0) + Velocity::from_m_s(6.0, 2.0) * time(instant).s()
}

/// What a UAV says: it circles about where the targets start, and sees them all.
fn report(uav: u32, instant: i64, targets: u32) -> Report {
    let phase = Angle::from_deg(90.0 * f64::from(uav) + 5.0 * instant as f64);
    let position = Position::ORIGIN + Displacement::from_polar(450.0, phase);
    let heading = phase + Angle::from_deg(90.0);
    let state = UavState { position, heading, speed_m_s: 40.0, turn_rate_rad_s: 0.09, vertical: None };
    let seen =
        |label| Detection { label: TargetLabel(label), measurement: sensor::measure(position, target(label, instant)) };
    let boresight = Some(phase + Angle::from_deg(180.0));
    let detections = (0..targets).map(seen).collect();
    Report { sequence: instant as u32, boresight, detections, ..Report::of(UavId(uav), time(instant), state) }
}

fn cue(label: u32, instant: i64) -> Cue {
    Cue {
        searcher: 0,
        said: time(instant),
        number: label as u16,
        label: TargetLabel(label),
        time: time(instant),
        position: target(label, instant),
        velocity: Velocity::from_m_s(6.0, 2.0),
        position_sd_m: 20.0,
        velocity_sd_m_s: 2.0,
    }
}

impl Told {
    fn new() -> Self {
        let params = TeamParams::table_1();
        let mut log = Log::new(UavId(9), &params);
        log.begin(0);
        Self { log, history: History::new(Fold::new(params).unwrap()), now: -1 }
    }

    /// Another instant, of which these are heard.
    fn tick(&mut self, uavs: &[u32]) {
        self.now += 1;
        self.log.turn_to(self.now, self.history.kept_from() + 1);
        self.history.turn_over();
        uavs.iter().for_each(|uav| self.hear(*uav, self.now));
        self.follow();
    }

    fn hear(&mut self, uav: u32, instant: i64) {
        self.log.hear_report(&report(uav, instant, 2), self.now, self.history.committed);
    }

    fn follow(&mut self) {
        self.history.follow(&mut self.log, self.now);
    }

    fn settle(&mut self, is_disturbed: bool) {
        self.history.settle_on(&self.log, self.now, is_disturbed);
    }

    fn instants(&self) -> Vec<i64> {
        self.history.pictures.iter().map(|(instant, _)| *instant).collect()
    }

    fn text(&self) -> String {
        format!("{:?}", self.history.newest())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]
    /// Whatever is heard when, late, twice, in whatever order: in the end the picture is that of a fleet which has heard all
    /// at once, to the bit.
    #[test]
    fn pictures_are_the_same_whatever_order_the_words_come_in(
        delays in proptest::collection::vec((0..20i64, 0..20i64), 3 * 30),
        cue_delays in proptest::collection::vec(0..20i64, 3),
    ) {
        const INSTANTS: i64 = 30;
        let mut fleet = Fleet::new(TeamParams::table_1()).unwrap();
        let mut told = Told::new();
        for now in 0..INSTANTS + 20 {
            told.tick(&[]);
            for instant in 0..INSTANTS {
                for uav in 0..3u32 {
                    let (one, other) = delays[(3 * instant) as usize + uav as usize];
                    // Again and again within an instant: nothing else has come of it.
                    (instant + one == now || instant + other == now).then(|| told.hear(uav, instant));
                }
            }
            for (label, delay) in (0..).zip(&cue_delays) {
                let said = i64::from(label) * 7;
                (said + delay == now).then(|| told.log.hear_cue(&cue(label, said), now, -1));
            }
            told.follow();
            let mut observed = None;
            for uav in (0..3).filter(|_| now < INSTANTS) {
                let Report { state, boresight, ref detections, .. } = report(uav, now, 2);
                observed = Some(fleet.observe(time(now), UavId(uav), &state, Some(Scan { boresight, detections })));
            }
            let observed = observed.unwrap_or_else(|| fleet.observe(time(now), UavId(0), &report(0, now, 0).state, None));
            for label in (0..3).filter(|label| i64::from(*label) * 7 == now) {
                fleet.hear(&observed, &Message::Cue(cue(label, now)));
            }
            let _ = fleet.decide(&observed);
        }
        prop_assert_eq!(told.log.refused.messages(), 0);
        // What a UAV was said to do it was not told here.
        prop_assert_eq!(told.history.newest().known(), fleet.picture().known());
        prop_assert_eq!(&told.history.newest().groups, &fleet.picture().groups);
        prop_assert_eq!(&told.history.newest().crew, &fleet.picture().crew);
        let mut at_once = Told::new();
        for now in 0..INSTANTS + 20 {
            at_once.tick(if now < INSTANTS { &[2, 0, 1] } else { &[] });
            for label in (0..3).filter(|label| i64::from(*label) * 7 == now) {
                at_once.log.hear_cue(&cue(label, now), now, -1);
                at_once.follow();
            }
        }
        prop_assert_eq!(told.text(), at_once.text());
        prop_assert_eq!(told.history.newest().digest(), at_once.history.newest().digest());
    }
}

/// A UAV keeps its place for the lease of 3 s, and is told of when that is over; what it said late keeps it longer.
#[test]
fn who_is_silent_for_longer_than_the_lease_leaves_the_team() {
    let mut told = Told::new();
    (0..10).for_each(|_| told.tick(&[0, 1]));
    let team = |told: &Told| told.history.newest().team.iter().map(|mate| mate.uav.0).collect::<Vec<_>>();
    for later in 1..=8 {
        told.tick(&[0]);
        assert_eq!(team(&told), if later <= 6 { vec![0, 1] } else { vec![0] }, "{later}");
        assert_eq!(told.history.newest().crew.len(), team(&told).len());
    }
    told.hear(1, 12);
    told.follow();
    assert_eq!(team(&told), [0, 1]);
    let mut leaving = report(1, 18, 2);
    leaving.leaves = true;
    told.now += 1;
    told.log.turn_to(18, 0);
    told.log.hear_report(&leaving, 18, -1);
    told.follow();
    assert_eq!(team(&told), [0, 1]);
    // It need not be silent first.
    told.tick(&[0]);
    assert_eq!(team(&told), [0]);
}

/// Of those further back fewer are kept, always those that are stamped; what changes far back is worked out from there.
#[test]
fn further_back_pictures_thin_out_to_those_that_are_stamped() {
    let (mut told, mut whole) = (Told::new(), Told::new());
    for now in 0..240 {
        told.tick(if now == 21 { &[0] } else { &[0, 1] });
        whole.tick(&[0, 1]);
        let kept = told.instants();
        let is_kept = |instant: &i64| *instant == -1 || instant % STAMP_EVERY == 0 || now - instant <= DENSE + LAG;
        assert!((0..=now).filter(is_kept).all(|instant| kept.contains(&instant)), "{kept:?}");
        assert!(kept.len() as i64 <= 4 * (DENSE + LAG) + now / STAMP_EVERY, "{kept:?}");
    }
    let kept = told.instants();
    assert!(
        kept.iter()
            .filter(|instant| **instant < 240 - 9 * (DENSE + LAG))
            .all(|instant| *instant == -1 || instant % STAMP_EVERY == 0)
    );
    // What is told to others is the newest that there is.
    for instant in 0..240 {
        let newest = kept.iter().rfind(|kept| **kept <= instant).copied();
        assert_eq!(Some(told.history.kept_up_to(instant)), newest);
    }
    assert_ne!(told.text(), whole.text());
    told.hear(1, 21);
    told.follow();
    assert_eq!((told.text(), told.instants()), (whole.text(), whole.instants()));
}

/// All agents stamp the same instants, in however many steps they commit, and of each the same picture.
#[test]
fn of_so_many_committed_pictures_one_is_stamped() {
    let (mut at_once, mut by_and_by) = (Told::new(), Told::new());
    let mut digests = Vec::new();
    for now in 0..50 {
        for told in [&mut at_once, &mut by_and_by] {
            told.tick(&[0, 1]);
            told.settle(false);
        }
        digests.push(by_and_by.history.newest().digest());
        by_and_by.history.commit(now - 2);
        assert_eq!(
            by_and_by.instants(),
            if now < 2 { (-1..=now).collect::<Vec<_>>() } else { vec![now - 2, now - 1, now] }
        );
    }
    assert_eq!(at_once.history.stamp(&at_once.log), Stamp::default());
    at_once.history.commit(47);
    for told in [&at_once, &by_and_by] {
        let stamped: Vec<_> = (0..50).filter_map(|instant| Some((instant, told.history.digest_at(instant)?))).collect();
        let expected: Vec<_> =
            [0, STAMP_EVERY, 2 * STAMP_EVERY].map(|instant| (instant, digests[instant as usize])).into();
        assert_eq!(stamped, expected);
        let (instant, digest) = expected[2];
        assert_eq!(told.history.stamp(&told.log), Stamp { time: time(instant), digest });
        assert_eq!((told.history.committed, told.history.kept_from()), (47, 47));
    }
    // Never back.
    at_once.history.commit(3);
    assert_eq!(at_once.history.committed, 47);
}

#[test]
fn so_many_stamps_are_kept_and_no_more() {
    let mut told = Told::new();
    let last = STAMP_EVERY * STAMPS_KEPT as i64;
    for now in 0..=last {
        told.tick(&[]);
        told.history.commit(now);
    }
    assert_eq!((told.history.digest_at(0), told.history.stamps.len()), (None, STAMPS_KEPT));
    assert!(told.history.digest_at(STAMP_EVERY).is_some() && told.history.digest_at(last).is_some());
}

/// While words go missing, groups and duties are those of the lag ago, estimates and UAVs those of now; what was acted on
/// stays.
#[test]
fn while_words_go_missing_groups_and_duties_are_those_of_the_lag_ago() {
    let mut told = Told::new();
    (0..10).for_each(|_| told.tick(&[0]));
    told.settle(false);
    let crew = |told: &Told| told.history.head().crew.iter().map(|duty| duty.uav.0).collect::<Vec<_>>();
    assert_eq!(crew(&told), [0]);
    for later in 0..=LAG {
        told.tick(&[0, 1]);
        told.settle(true);
        assert_eq!(crew(&told), if later < LAG { vec![0] } else { vec![0, 1] }, "{later}");
        let (head, newest) = (told.history.head(), told.history.newest());
        assert_eq!((head.time, head.team.len(), newest.crew.len()), (newest.time, 2, 2));
        assert_eq!(head.known(), newest.known());
    }
    // In between nothing is missing: the next one is acted on at once, and stays.
    told.tick(&[0, 1, 2]);
    told.settle(false);
    assert_eq!(crew(&told), [0, 1, 2]);
    told.tick(&[0, 1, 2]);
    told.settle(true);
    assert_eq!(crew(&told), [0, 1, 2]);
}

/// Duties of the lag ago may name who is gone since; who is there is on its group's orbit all the same.
#[test]
fn held_back_duties_of_who_is_gone_leave_the_others_theirs() {
    let mut told = Told::new();
    (0..10).for_each(|_| told.tick(&[0, 1]));
    (0..7).for_each(|_| told.tick(&[1]));
    told.settle(true);
    let head = told.history.head();
    let uavs: Vec<u32> = head.crew.iter().map(|duty| duty.uav.0).collect();
    let team: Vec<_> = head.team.iter().map(|mate| (mate.uav.0, mate.group)).collect();
    assert_eq!((uavs, team), (vec![0, 1], vec![(1, Some(head.groups[0].id))]));
}

/// Who takes another's picture over goes on from it as that one does, and has none from before.
#[test]
fn a_picture_that_is_taken_over_is_followed_as_by_whose_it_is() {
    let (mut teller, mut taker) = (Told::new(), Told::new());
    for _ in 0..20 {
        teller.tick(&[0, 1]);
        taker.tick(&[]);
    }
    taker.history.take_over(-5, 12, teller.history.at(12).unwrap().clone());
    assert_eq!((taker.history.since, taker.history.committed, taker.instants()), (-5, 12, vec![12]));
    taker.log.reach_back(13);
    (13..20).for_each(|instant| [0, 1].iter().for_each(|uav| taker.hear(*uav, instant)));
    taker.follow();
    assert_eq!(taker.text(), teller.text());
    assert_eq!(taker.history.at(11), None);
}
