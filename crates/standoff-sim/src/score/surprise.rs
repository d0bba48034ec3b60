//! What no guidance can know: how far an orbit lies from where it was foretold.
//!
//! Where a UAV is at an instant was commanded at the instant before or earlier, when the orbit of now could only be
//! foretold. So a UAV that is exactly where the orbit was foretold still has this error; and none that knows no more can
//! have a smaller one, as far as the surprise is as likely inward as outward.
//!
//! ```text
//! e = |u - c| - r_d        surprise = | e(orbit of now) - e(orbit as foretold an instant ago) |
//! ```

use standoff::{Duration, Position, TargetState, Transition};

use super::mean::Mean;
use super::rules::Rules;
use crate::frame::{Frame, GroupRow, TrackRow};
use crate::geometry::{Known, at, centre, off_orbit_m, on_orbit};

/// Surprises of a run, from `settle_s` on.
#[derive(Debug, Clone)]
pub(super) struct Surprises {
    rules: Rules,
    transition: Transition,
    before: Vec<TrackRow>,
    groups_before: Vec<GroupRow>,
    /// Of the true orbit, m.
    pub(super) truth: Mean,
    /// Of the agents' own orbit, m.
    pub(super) own: Mean,
}

impl Surprises {
    pub(super) fn new(rules: Rules) -> Self {
        Self {
            transition: rules.target.transition(Duration::from_s(rules.period_s)),
            rules,
            before: Vec::new(),
            groups_before: Vec::new(),
            truth: Mean::default(),
            own: Mean::default(),
        }
    }

    /// Takes in the next frame, in which these targets are known and exist.
    pub(super) fn frame(&mut self, frame: &Frame, known: &[Known]) {
        if frame.time_us as f64 / 1e6 >= self.rules.settle_s {
            frame.groups.iter().for_each(|group| self.group(frame, known, group));
        }
        self.before.clone_from(&frame.tracks);
        self.groups_before.clone_from(&frame.groups);
    }

    /// A group counts while its members stay the same: that one comes or goes is another matter.
    fn group(&mut self, frame: &Frame, known: &[Known], group: &GroupRow) {
        let is_on = |track: &&TrackRow| [track.group, track.to_group].contains(&Some(group.group));
        let ids = |tracks: &[TrackRow]| tracks.iter().filter(is_on).map(|track| track.target).collect::<Vec<_>>();
        let Some(old) = self.groups_before.iter().find(|old| old.group == group.group) else { return };
        if ids(&self.before) != ids(&frame.tracks) {
            return;
        }
        let expected = |track: &TrackRow| self.transition.predict(&TargetState(track.state.into())).position();
        let members: Vec<Position> = self.before.iter().filter(is_on).map(expected).collect();
        let truths: Vec<Position> = on_orbit(known, group.group).collect();
        let (Some((true_centre, true_m)), Some((expected_true_centre, expected_true_m))) =
            (self.rules.orbit(&truths), self.rules.orbit(&members))
        else {
            return;
        };
        // The agents' own centre goes on as it went.
        let period_s = self.rules.period_s;
        let centre = centre(group);
        let expected_centre = Position::from_m(old.x_m + old.vx_m_s * period_s, old.y_m + old.vy_m_s * period_s);
        let expected_own_m = self.rules.standoff_m(&members, expected_centre, group.margin_m);
        for uav in frame.uavs.iter().filter(|uav| uav.group == Some(group.group)) {
            let off_m = |centre: Position, radius_m: f64| off_orbit_m(at(uav), centre, radius_m);
            self.truth.add((off_m(true_centre, true_m) - off_m(expected_true_centre, expected_true_m)).abs());
            let own_m = off_m(centre, group.standoff_distance_m) - off_m(expected_centre, expected_own_m);
            self.own.add(own_m.abs());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::known;
    use crate::run::{Mission, fly};
    use crate::scenario::{Edits, Scenario};
    use crate::score::Choice;

    fn frames(set: &[&str]) -> (Rules, Vec<Frame>) {
        let edits = Edits { set: set.iter().map(|edit| (*edit).to_owned()).collect(), ..Edits::default() };
        let scenario = Scenario::load("paper/table-2-pair", &edits, 4).unwrap();
        let mut mission = Mission::new(&scenario).unwrap();
        (Rules::of(&scenario.settings), std::iter::from_fn(|| mission.frame().cloned()).collect())
    }

    fn surprises(rules: &Rules, frames: &[Frame]) -> [f64; 2] {
        let mut surprises = Surprises::new(rules.clone());
        frames.iter().for_each(|frame| surprises.frame(frame, &known(frame).collect::<Vec<_>>()));
        [surprises.truth.value().unwrap(), surprises.own.value().unwrap()]
    }

    /// With exact cues, exact measurements and targets that keep their velocities, nothing surprises.
    #[test]
    fn a_world_without_noise_holds_no_surprise() {
        let exact = [
            "sensor.range_sd_m=0",
            "sensor.bearing_sd_deg=0",
            "cue.position_sd_m=1e-3",
            "cue.velocity_sd_m_s=1e-3",
            "targets.acceleration_sd_m_s2=0",
            "filter.acceleration_sd_m_s2=1e-3",
        ];
        let (rules, frames) = frames(&exact);
        let [truth_m, own_m] = surprises(&rules, &frames);
        assert!(truth_m < 0.02 && own_m < 0.02, "{truth_m} {own_m}");
    }

    /// A truth that is 700 m behind where it is believed to be, seen from the UAV, surprises by that much; what the agents
    /// believe does not change with it.
    #[test]
    fn a_truth_elsewhere_is_a_surprise() {
        let (rules, mut frames) = frames(&[]);
        frames.iter_mut().for_each(|frame| frame.uavs.truncate(1));
        let [_, own_m] = surprises(&rules, &frames);
        for frame in &mut frames {
            let (uav, group) = (frame.uavs[0], &frame.groups[0]);
            let away = Position::from_m(group.x_m, group.y_m) - at(&uav);
            for truth in &mut frame.truth {
                truth.x_m += 700.0 * away.direction().cos();
                truth.y_m += 700.0 * away.direction().sin();
            }
        }
        let [truth_m, own_after_m] = surprises(&rules, &frames);
        assert!((truth_m - 700.0).abs() < 10.0, "{truth_m}");
        assert_eq!(own_m.to_bits(), own_after_m.to_bits());
    }

    /// Errors are never below their surprise, within what 60 runs tell.
    #[test]
    fn no_error_is_below_its_surprise() {
        let choice = Choice::parse("standard,limits").unwrap();
        let (mut errors_m, mut surprises_m) = ([0.0; 2], [0.0; 2]);
        let edits = Edits { set: vec!["guidance.lead=predicted".to_owned()], ..Edits::default() };
        for seed in 0..60 {
            let metrics = fly(&Scenario::load("paper/table-2-pair", &edits, seed).unwrap(), choice).unwrap();
            errors_m[0] += metrics.standoff_error_m_settled.unwrap();
            errors_m[1] += metrics.standoff_tracking_error_m_settled.unwrap();
            surprises_m[0] += metrics.standoff_surprise_m_settled.unwrap();
            surprises_m[1] += metrics.standoff_tracking_surprise_m_settled.unwrap();
        }
        assert!(errors_m[0] > surprises_m[0] && errors_m[1] > surprises_m[1], "{errors_m:?} {surprises_m:?}");
        assert!(surprises_m.iter().all(|surprise_m| *surprise_m > 60.0 * 0.1));
    }
}
