use proptest::prelude::*;

use super::*;
use crate::message::{Cue, Detection, Message, Report, Scan, TargetLabel};
use crate::params::TeamParams;
use crate::{Angle, Displacement, Position, TeamAgent, Time, UavId, UavState, Velocity, sensor};

/// Decision lag of Table I, 2 s, in periods of half a second.
const LAG: i64 = 4;

/// Message log and history of a UAV that sends no reports itself.
struct Replica {
    log: MessageLog,
    history: TeamStateHistory,
    now: i64,
}

fn time(step: i64) -> Time {
    Time::from_us(step * 500_000)
}

fn target(label: u32, step: i64) -> Position {
    Position::from_m(90.0 * f64::from(label), 0.0) + Velocity::from_m_s(6.0, 2.0) * time(step).s()
}

/// Report of a UAV that circles the start of the targets and detects them all.
fn report(uav: u32, step: i64, targets: u32) -> Report {
    let phase = Angle::from_deg(90.0 * f64::from(uav) + 5.0 * step as f64);
    let position = Position::ORIGIN + Displacement::from_polar(450.0, phase);
    let heading = phase + Angle::from_deg(90.0);
    let state = UavState { position, heading, speed_m_s: 40.0, turn_rate_rad_s: 0.09, vertical: None };
    let detect = |label| Detection {
        label: Some(TargetLabel(label)),
        measurement: sensor::measure(position, target(label, step)),
        range_rate_m_s: None,
    };
    let boresight = Some(phase + Angle::from_deg(180.0));
    let detections = (0..targets).map(detect).collect();
    Report { sequence: step as u32, boresight, detections, ..Report::position_only(UavId(uav), time(step), state) }
}

fn cue(label: u32, step: i64) -> Cue {
    Cue {
        source: 0,
        issued_at: time(step),
        sequence: label as u16,
        label: Some(TargetLabel(label)),
        time: time(step),
        position: target(label, step),
        velocity: Velocity::from_m_s(6.0, 2.0),
        position_sd_m: 20.0,
        velocity_sd_m_s: 2.0,
        priority: None,
    }
}

impl Replica {
    fn new() -> Self {
        let params = TeamParams::paper();
        let mut log = MessageLog::new(UavId(9), &params);
        log.begin(0);
        Self { log, history: TeamStateHistory::new(TeamStateUpdater::new(params).unwrap()), now: -1 }
    }

    /// Starts a time step and receives its reports of these UAVs.
    fn tick(&mut self, uavs: &[u32]) {
        self.now += 1;
        self.log.turn_to(self.now, self.history.kept_from() + 1);
        self.history.start_decision();
        uavs.iter().for_each(|uav| self.hear(*uav, self.now));
        self.follow();
    }

    fn hear(&mut self, uav: u32, step: i64) {
        self.log.receive_report(&report(uav, step, 2), self.now, self.history.committed);
    }

    fn follow(&mut self) {
        self.history.replay(&mut self.log, self.now);
    }

    fn settle(&mut self, link_is_degraded: bool) {
        self.history.select_published(&self.log, self.now, link_is_degraded);
    }

    fn steps(&self) -> Vec<i64> {
        self.history.states.iter().map(|(step, _)| *step).collect()
    }

    fn text(&self) -> String {
        format!("{:?}", self.history.newest())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]
    /// Messages arrive late, repeatedly and in any order. In the end, the team state is bitwise equal to that of a team
    /// that received all messages immediately.
    #[test]
    fn team_states_do_not_depend_on_the_order_of_messages(
        delays in proptest::collection::vec((0..20i64, 0..20i64), 3 * 30),
        cue_delays in proptest::collection::vec(0..20i64, 3),
    ) {
        const TIME_STEPS: i64 = 30;
        let mut fleet = TeamAgent::new(TeamParams::paper()).unwrap();
        let mut replica = Replica::new();
        for now in 0..TIME_STEPS + 20 {
            replica.tick(&[]);
            for step in 0..TIME_STEPS {
                for uav in 0..3u32 {
                    let (one, other) = delays[(3 * step) as usize + uav as usize];
                    // Repeated recomputation within one time step changes nothing.
                    (step + one == now || step + other == now).then(|| replica.hear(uav, step));
                }
            }
            for (label, delay) in (0..).zip(&cue_delays) {
                let issued_at = i64::from(label) * 7;
                (issued_at + delay == now).then(|| replica.log.receive_cue(&cue(label, issued_at), now, -1));
            }
            replica.follow();
            let mut observed = None;
            for uav in (0..3).filter(|_| now < TIME_STEPS) {
                let Report { state, boresight, ref detections, .. } = report(uav, now, 2);
                observed = Some(fleet.observe(time(now), UavId(uav), &state, Some(Scan { boresight, detections })));
            }
            let observed = observed.unwrap_or_else(|| fleet.observe(time(now), UavId(0), &report(0, now, 0).state, None));
            for label in (0..3).filter(|label| i64::from(*label) * 7 == now) {
                fleet.receive(&observed, &Message::Cue(cue(label, now)));
            }
            let _ = fleet.decide(&observed);
        }
        prop_assert_eq!(replica.log.rejected.messages(), 0);
        // The reports here do not contain the assignments.
        prop_assert_eq!(replica.history.newest().tracks(), fleet.team_state().tracks());
        prop_assert_eq!(&replica.history.newest().groups, &fleet.team_state().groups);
        prop_assert_eq!(&replica.history.newest().assignments, &fleet.team_state().assignments);
        let mut at_once = Replica::new();
        for now in 0..TIME_STEPS + 20 {
            at_once.tick(if now < TIME_STEPS { &[2, 0, 1] } else { &[] });
            for label in (0..3).filter(|label| i64::from(*label) * 7 == now) {
                at_once.log.receive_cue(&cue(label, now), now, -1);
                at_once.follow();
            }
        }
        prop_assert_eq!(replica.text(), at_once.text());
        prop_assert_eq!(replica.history.newest().digest(), at_once.history.newest().digest());
    }
}

/// A silent UAV keeps its place for the teammate timeout of 3 s; a late report extends it.
#[test]
fn uavs_silent_for_longer_than_the_teammate_timeout_are_removed() {
    let mut replica = Replica::new();
    (0..10).for_each(|_| replica.tick(&[0, 1]));
    let team = |replica: &Replica| {
        replica.history.newest().teammates.iter().map(|teammate| teammate.uav.0).collect::<Vec<_>>()
    };
    for later in 1..=8 {
        replica.tick(&[0]);
        assert_eq!(team(&replica), if later <= 6 { vec![0, 1] } else { vec![0] }, "{later}");
        assert_eq!(replica.history.newest().assignments.len(), team(&replica).len());
    }
    replica.hear(1, 12);
    replica.follow();
    assert_eq!(team(&replica), [0, 1]);
    let mut leaving = report(1, 18, 2);
    leaving.is_leaving = true;
    replica.now += 1;
    replica.log.turn_to(18, 0);
    replica.log.receive_report(&leaving, 18, -1);
    replica.follow();
    assert_eq!(team(&replica), [0, 1]);
    // A leaving UAV is removed without being silent first.
    replica.tick(&[0]);
    assert_eq!(team(&replica), [0]);
}

/// Fewer old states are kept, always those with digests; a change far back is recomputed from there.
#[test]
fn old_states_thin_out_to_those_with_digests() {
    let (mut replica, mut whole) = (Replica::new(), Replica::new());
    for now in 0..240 {
        replica.tick(if now == 21 { &[0] } else { &[0, 1] });
        whole.tick(&[0, 1]);
        let kept = replica.steps();
        let is_kept = |step: &i64| *step == -1 || step % DIGEST_EVERY == 0 || now - step <= DENSE + LAG;
        assert!((0..=now).filter(is_kept).all(|step| kept.contains(&step)), "{kept:?}");
        assert!(kept.len() as i64 <= 4 * (DENSE + LAG) + now / DIGEST_EVERY, "{kept:?}");
    }
    let kept = replica.steps();
    assert!(
        kept.iter().filter(|step| **step < 240 - 9 * (DENSE + LAG)).all(|step| *step == -1 || step % DIGEST_EVERY == 0)
    );
    // A snapshot uses the newest stored state.
    for step in 0..240 {
        let newest = kept.iter().rfind(|kept| **kept <= step).copied();
        assert_eq!(Some(replica.history.kept_up_to(step)), newest);
    }
    assert_ne!(replica.text(), whole.text());
    replica.hear(1, 21);
    replica.follow();
    assert_eq!((replica.text(), replica.steps()), (whole.text(), whole.steps()));
}

/// All agents keep digests of the same time steps and states, in however many steps they commit.
#[test]
fn digests_are_kept_at_a_fixed_interval_of_commits() {
    let (mut at_once, mut step_by_step) = (Replica::new(), Replica::new());
    let mut digests = Vec::new();
    for now in 0..50 {
        for replica in [&mut at_once, &mut step_by_step] {
            replica.tick(&[0, 1]);
            replica.settle(false);
        }
        digests.push(step_by_step.history.newest().digest());
        step_by_step.history.commit(now - 2);
        assert_eq!(
            step_by_step.steps(),
            if now < 2 { (-1..=now).collect::<Vec<_>>() } else { vec![now - 2, now - 1, now] }
        );
    }
    assert_eq!(at_once.history.commit_digest(&at_once.log), CommitDigest::default());
    at_once.history.commit(47);
    for replica in [&at_once, &step_by_step] {
        let digests_kept: Vec<_> = (0..50).filter_map(|step| Some((step, replica.history.digest_at(step)?))).collect();
        let expected: Vec<_> = [0, DIGEST_EVERY, 2 * DIGEST_EVERY].map(|step| (step, digests[step as usize])).into();
        assert_eq!(digests_kept, expected);
        let (step, digest) = expected[2];
        assert_eq!(replica.history.commit_digest(&replica.log), CommitDigest { time: time(step), digest });
        assert_eq!((replica.history.committed, replica.history.kept_from()), (47, 47));
    }
    // A commit never moves back.
    at_once.history.commit(3);
    assert_eq!(at_once.history.committed, 47);
}

#[test]
fn the_number_of_digests_kept_is_limited() {
    let mut replica = Replica::new();
    let last = DIGEST_EVERY * DIGESTS_KEPT_MAX as i64;
    for now in 0..=last {
        replica.tick(&[]);
        replica.history.commit(now);
    }
    assert_eq!((replica.history.digest_at(0), replica.history.digests.len()), (None, DIGESTS_KEPT_MAX));
    assert!(replica.history.digest_at(DIGEST_EVERY).is_some() && replica.history.digest_at(last).is_some());
}

/// While messages are missing, groups and assignments are those of the decision lag ago; estimates and UAV states are
/// current. They never go back in time.
#[test]
fn while_messages_are_missing_groups_and_assignments_lag() {
    let mut replica = Replica::new();
    (0..10).for_each(|_| replica.tick(&[0]));
    replica.settle(false);
    let assigned_uavs = |replica: &Replica| {
        replica.history.head().assignments.iter().map(|assignment| assignment.uav.0).collect::<Vec<_>>()
    };
    assert_eq!(assigned_uavs(&replica), [0]);
    for later in 0..=LAG {
        replica.tick(&[0, 1]);
        replica.settle(true);
        assert_eq!(assigned_uavs(&replica), if later < LAG { vec![0] } else { vec![0, 1] }, "{later}");
        let (head, newest) = (replica.history.head(), replica.history.newest());
        assert_eq!((head.time, head.teammates.len(), newest.assignments.len()), (newest.time, 2, 2));
        assert_eq!(head.tracks(), newest.tracks());
    }
    // When nothing is missing, the current assignment is used immediately, and stays in use afterwards.
    replica.tick(&[0, 1, 2]);
    replica.settle(false);
    assert_eq!(assigned_uavs(&replica), [0, 1, 2]);
    replica.tick(&[0, 1, 2]);
    replica.settle(true);
    assert_eq!(assigned_uavs(&replica), [0, 1, 2]);
}

/// Lagging assignments may name UAVs that have left; the other UAVs keep theirs.
#[test]
fn lagging_assignments_of_departed_uavs_do_not_affect_others() {
    let mut replica = Replica::new();
    (0..10).for_each(|_| replica.tick(&[0, 1]));
    (0..7).for_each(|_| replica.tick(&[1]));
    replica.settle(true);
    let head = replica.history.head();
    let uavs: Vec<u32> = head.assignments.iter().map(|assignment| assignment.uav.0).collect();
    let team: Vec<_> = head.teammates.iter().map(|teammate| (teammate.uav.0, teammate.group)).collect();
    assert_eq!((uavs, team), (vec![0, 1], vec![(1, Some(head.groups[0].id))]));
}

/// An agent that adopts a state continues from it exactly like its sender, and has no older states.
#[test]
fn an_adopted_state_evolves_like_that_of_its_sender() {
    let (mut sender, mut receiver) = (Replica::new(), Replica::new());
    for _ in 0..20 {
        sender.tick(&[0, 1]);
        receiver.tick(&[]);
    }
    receiver.history.adopt(-5, 12, sender.history.at(12).unwrap().clone());
    assert_eq!((receiver.history.start, receiver.history.committed, receiver.steps()), (-5, 12, vec![12]));
    receiver.log.reach_back(13);
    (13..20).for_each(|step| [0, 1].iter().for_each(|uav| receiver.hear(*uav, step)));
    receiver.follow();
    assert_eq!(receiver.text(), sender.text());
    assert_eq!(receiver.history.at(11), None);
}
