//! Detections without label: the same log gives the same tracks, and the tracks are those of the targets.
use std::collections::BTreeSet;

use crate::common::radio::Radio;
use crate::common::{Team, Unlabelled, observe_all};
use standoff::*;

const SENSOR: Unlabelled = Unlabelled { detection_probability: 0.9, false_alarms: 3 };

/// Parameters that match [`SENSOR`].
fn params() -> TeamParams {
    let mut params = TeamParams { link: LinkModel::Lossy, ..TeamParams::recommended() };
    for (path, value) in [("track.sensor.detection_probability", 0.9), ("track.sensor.false_alarms_per_scan", 3.0)] {
        let info = TeamParams::table().iter().find(|info| info.path == path).unwrap();
        assert!(info.set(&mut params, ParamValue::Number(value)));
    }
    params
}

fn team(uavs: u32, targets: u32) -> Team {
    let mut team = Team::of(uavs, targets, params()).with_motion(apart);
    team.unlabelled = Some(SENSOR);
    team
}

/// Targets 150 m apart that drive east.
fn apart(id: u32, now: Time) -> Option<(Position, Velocity)> {
    let (x_m, y_m) = (150.0 * f64::from(id % 2), 150.0 * f64::from(id / 2));
    let velocity = Velocity::from_m_s(6.0, 2.0);
    Some((Position::from_m(x_m, y_m) + velocity * now.s(), velocity))
}

fn live(state: &TeamState) -> Vec<&Track> {
    let live = state.tracks().iter().map(|known| &known.track);
    live.filter(|track| !matches!(track.status, TrackStatus::Lost(_))).collect()
}

fn ids(state: &TeamState) -> BTreeSet<TrackId> {
    live(state).iter().map(|track| track.id).collect()
}

/// Number of targets with a track within 30 m, and of tracks without such a target.
fn matched(state: &TeamState, targets: u32, motion: crate::common::Motion) -> (usize, usize) {
    let truth: Vec<Position> = (0..targets).filter_map(|id| Some(motion(id, state.time)?.0)).collect();
    let tracks: Vec<Position> = live(state).iter().map(|track| track.estimate().state.position()).collect();
    let near = |a: &Position, all: &[Position]| all.iter().any(|b| a.distance_m(*b) < 30.0);
    let found = truth.iter().filter(|target| near(target, &tracks)).count();
    (found, tracks.iter().filter(|track| !near(track, &truth)).count())
}

#[test]
fn each_target_has_a_track_and_no_false_alarm_has_one() {
    let (mut team, mut radio) = (team(3, 4), Radio::new(1));
    for tick in 0..120 {
        team.tick_over(tick, &mut radio);
        if tick > 20 {
            let state = team.agents[0].team_state();
            assert_eq!(matched(state, 4, apart), (4, 0), "{tick}");
            assert_eq!(live(state).len(), 4, "{tick}");
            assert!(live(state).iter().all(|track| track.label().is_none() && track.id.0 >= 1 << 63));
        }
    }
}

/// The first scan of a team without cues finds targets that have been there before: they are confirmed sooner than targets
/// of a later scan.
#[test]
fn targets_of_the_first_scan_are_confirmed_sooner() {
    let steps_until_confirmed = |first_tick: i64, hidden_ticks: i64| {
        let (mut team, mut fleet) = (team(2, 4), TeamAgent::new(params()).unwrap());
        let mut is_confirmed = |tick: i64| {
            let (now, mut scans, inbox) = team.speak(tick);
            team.decide(now, &scans, &inbox);
            if tick < first_tick {
                return false;
            }
            if tick < first_tick + hidden_ticks {
                scans.iter_mut().for_each(|scan| scan.1.clear());
            }
            let observed = observe_all(&mut fleet, now, &team.states, &scans, &[]);
            fleet.decide(&observed[0]);
            matched(fleet.team_state(), 4, apart).0 == 4
        };
        (0..60).find(|tick| is_confirmed(*tick)).unwrap() - first_tick - hidden_ticks
    };
    let [first, later]: [i64; 2] = [0, 1].map(|hidden| (5..25).map(|tick| steps_until_confirmed(tick, hidden)).sum());
    assert!(first + 5 < later, "{first} and {later} time steps in 20 missions");
}

/// After two targets were together, the covariance of their tracks includes that they may have changed places.
#[test]
fn tracks_of_targets_that_have_met_are_uncertain_about_their_identity() {
    fn meeting(id: u32, now: Time) -> Option<(Position, Velocity)> {
        let away_m = (30.0 - now.s()).abs() * 2.0;
        let velocity = Velocity::from_m_s(6.0, 0.0);
        Some((Position::from_m(0.0, if id == 0 { away_m } else { -away_m }) + velocity * now.s(), velocity))
    }
    let sd_m = |until: i64| {
        let (mut team, mut radio) = (team(3, 2).with_motion(meeting), Radio::new(1));
        (0..until).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
        let state = team.agents[0].team_state();
        let sds_m = live(state).iter().map(|track| track.estimate().position_sd_max_m()).collect::<Vec<_>>();
        sds_m.into_iter().fold(0.0, f64::max)
    };
    // Both are 30 m apart, at 22.5 s before they meet at 30 s, and at 37.5 s after.
    let (before_m, after_m) = (sd_m(45), sd_m(75));
    assert!(after_m > 15.0 && before_m < 12.0, "{before_m} m before, {after_m} m after");
}

/// Late, repeated and reordered reports: all agents have the same tracks, bit for bit.
#[test]
fn agents_with_the_same_messages_have_the_same_tracks() {
    for seed in 0..3 {
        let (mut team, mut radio) = (team(3, 4), Radio::new(seed));
        (radio.loss, radio.late_max, radio.twice) = (0.2, 4, 0.1);
        (0..60).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
        radio.heal();
        (60..100).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
        let digests: BTreeSet<u64> = team.agents.iter().map(|agent| agent.team_state().digest()).collect();
        assert_eq!(digests.len(), 1, "{seed}");
        assert_eq!(matched(team.agents[1].team_state(), 4, apart), (4, 0), "{seed}");
    }
}

/// A UAV that was switched off receives the tracks with a snapshot.
#[test]
fn a_restarted_agent_receives_the_tracks() {
    let (mut team, mut radio) = (team(3, 4), Radio::new(1));
    (0..40).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
    let before = ids(team.agents[0].team_state());
    team.off = vec![1];
    (40..60).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
    team.off.clear();
    team.agents[1] = Agent::new(UavId(1), params()).unwrap().with_restart_count(1);
    (60..120).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
    let states = [0, 1].map(|uav| team.agents[uav].team_state());
    assert_eq!(states[0].digest(), states[1].digest());
    assert_eq!((ids(states[0]), ids(states[1])), (before.clone(), before));
}

/// The order of the detections of a scan makes no difference.
#[test]
fn shuffled_detections_give_the_same_tracks() {
    let mut team = team(2, 4);
    let mut fleets = [(); 2].map(|()| TeamAgent::new(params()).unwrap());
    for tick in 0..40 {
        let (now, mut scans, inbox) = team.speak(tick);
        for (reverses, fleet) in [false, true].into_iter().zip(&mut fleets) {
            if reverses {
                scans.iter_mut().for_each(|scan| scan.1.reverse());
            }
            let observed = observe_all(fleet, now, &team.states, &scans, &inbox);
            fleet.decide(&observed[0]);
        }
        assert_eq!(fleets[0].team_state().digest(), fleets[1].team_state().digest(), "{tick}");
        team.decide(now, &scans, &inbox);
    }
    assert_eq!(matched(fleets[0].team_state(), 4, apart), (4, 0));
}

/// A report that arrives 55 s late changes no id except those of tracks that it started.
#[test]
fn a_late_report_renames_no_track() {
    let (mut team, mut radio) = (team(3, 4), Radio::new(1));
    (0..10).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
    // UAV 2 is not received for a moment; its report of time step 10 arrives 55 s later.
    radio.deaf = vec![(2, 0), (2, 1)];
    let (_, _, sent) = team.speak(10);
    let late = sent.into_iter().find(|message| matches!(message, Message::Report(report) if report.uav == UavId(2)));
    team.tick_over(10, &mut radio);
    (11..118).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
    let before = ids(team.agents[0].team_state());
    radio.deliver(118, 0, late.unwrap());
    (118..122).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
    assert_eq!((ids(team.agents[0].team_state()), before.len()), (before, 4));
}

/// Two cars side by side for a minute stay two tracks, or become two again when they part.
#[test]
fn side_by_side_targets_are_not_merged_for_good() {
    fn side_by_side(id: u32, now: Time) -> Option<(Position, Velocity)> {
        let apart_m = if now.s() < 20.0 { 60.0 - 2.5 * now.s() } else { (now.s() - 80.0).max(0.0) * 2.5 + 10.0 };
        let velocity = Velocity::from_m_s(8.0, 0.0);
        Some((Position::from_m(0.0, apart_m * f64::from(id)) + velocity * now.s(), velocity))
    }
    let (mut team, mut radio) = (team(3, 2).with_motion(side_by_side), Radio::new(1));
    (0..240).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
    let state = team.agents[0].team_state();
    assert_eq!((matched(state, 2, side_by_side), live(state).len()), ((2, 0), 2));
}

/// A cue without label for a target that has a track starts no second one.
#[test]
fn a_cue_of_a_tracked_target_starts_no_track() {
    let (mut team, mut radio) = (team(3, 2), Radio::new(1));
    (0..40).for_each(|tick| drop(team.tick_over(tick, &mut radio)));
    let before = ids(team.agents[0].team_state());
    let count = team.agents[0].team_state().tracks().len();
    let now = Time::from_us(40 * 500_000);
    let (position, velocity) = apart(0, now).unwrap();
    let cue = Cue {
        source: 1,
        issued_at: now,
        sequence: 0,
        label: None,
        time: now,
        position: position + Displacement::from_polar(20.0, Angle::ZERO),
        velocity,
        position_sd_m: 20.0,
        velocity_sd_m_s: 2.0,
        priority: None,
    };
    (0..3).for_each(|to| radio.deliver(40, to, Message::Cue(cue)));
    let elsewhere = Position::from_m(-3000.0, 0.0);
    let other = Cue { sequence: 1, position: elsewhere, ..cue };
    (0..3).for_each(|to| radio.deliver(40, to, Message::Cue(other)));
    team.tick_over(40, &mut radio);
    let after = ids(team.agents[0].team_state());
    let new: Vec<TrackId> = after.difference(&before).copied().collect();
    let of_new = |id: &TrackId| team.agents[0].team_state().track(*id).unwrap().track.estimate().state.position();
    assert_eq!(new.iter().map(of_new).collect::<Vec<_>>(), [elsewhere]);
    // Nor one that is lost immediately.
    assert_eq!(team.agents[0].team_state().tracks().len(), count + 1);
}

/// A false alarm shortly before does not change the id of the track of a target that appears.
#[test]
fn the_id_of_a_track_does_not_depend_on_other_tracks() {
    fn appears(id: u32, now: Time) -> Option<(Position, Velocity)> {
        if now.s() < 5.0 && id == 1 { None } else { apart(id, now) }
    }
    let mut team = team(2, 2).with_motion(appears);
    let mut fleets = [(); 2].map(|()| TeamAgent::new(params()).unwrap());
    for tick in 0..30 {
        let (now, scans, inbox) = team.speak(tick);
        let mut disturbed = scans.clone();
        if tick == 9 {
            let measurement = RangeBearingMeasurement { range_m: 900.0, bearing: scans[0].0.unwrap() };
            disturbed[0].1.push(Detection { label: None, measurement, range_rate_m_s: None });
        }
        for (scans, fleet) in [&scans, &disturbed].into_iter().zip(&mut fleets) {
            let observed = observe_all(fleet, now, &team.states, scans, &[]);
            fleet.decide(&observed[0]);
        }
        team.decide(now, &scans, &inbox);
    }
    let [plain, disturbed] = fleets.map(|fleet| ids(fleet.team_state()));
    assert_eq!((plain.len(), &plain), (2, &disturbed));
}
