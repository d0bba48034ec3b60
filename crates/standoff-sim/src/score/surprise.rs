//! What no guidance can know: how far an orbit lies from where it was foretold.
//!
//! Where a UAV is at an instant was commanded at the instant before or earlier, when the orbit of now could only be
//! foretold. So a UAV that is exactly where the orbit was foretold still has this error; and none that knows no more can
//! have a smaller one, as far as the surprise is as likely inward as outward.
//!
//! ```text
//! e = |u - c| - r_d        surprise = | e(orbit of now) - e(orbit as foretold an instant ago) |
//! ```

use standoff::{Duration, OrbitMotion, TargetState, Transition, Velocity};

use super::mean::Mean;
use super::rules::Rules;
use super::true_orbits::TrueOrbits;
use crate::frame::{Frame, GroupRow, TrackRow};
use crate::geometry::{at, centre, off_orbit_m};

/// Surprises of a run, from `settle_s` on.
#[derive(Debug, Clone)]
pub(super) struct Surprises {
    rules: Rules,
    transition: Transition,
    before: Vec<TrackRow>,
    groups_before: Vec<GroupRow>,
    orbits_before: TrueOrbits,
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
            orbits_before: TrueOrbits::default(),
            truth: Mean::default(),
            own: Mean::default(),
        }
    }

    /// Takes in the next frame, and the true orbits in it.
    pub(super) fn frame(&mut self, frame: &Frame, orbits: &TrueOrbits) {
        if frame.time_us as f64 / 1e6 >= self.rules.settle_s {
            frame.groups.iter().for_each(|group| self.group(frame, orbits, group));
        }
        self.orbits_before.clone_from(orbits);
        self.before.clone_from(&frame.tracks);
        self.groups_before.clone_from(&frame.groups);
    }

    /// A group counts while its members stay the same: that one comes or goes is another matter.
    fn group(&mut self, frame: &Frame, orbits: &TrueOrbits, group: &GroupRow) {
        let is_on = |track: &&TrackRow| [track.group, track.to_group].contains(&Some(group.group));
        let ids = |tracks: &[TrackRow]| tracks.iter().filter(is_on).map(|track| track.target).collect::<Vec<_>>();
        let Some(old) = self.groups_before.iter().find(|old| old.group == group.group) else { return };
        if ids(&self.before) != ids(&frame.tracks) {
            return;
        }
        let expected = |track: &TrackRow| self.transition.predict(&TargetState(track.state.into()));
        let members: Vec<TargetState> = self.before.iter().filter(is_on).map(expected).collect();
        let (Some(truth), Some(wanted)) = (orbits.of(group.group), self.rules.orbit(&members)) else { return };
        let after = |flown: &OrbitMotion, margin_m: f64| self.rules.orbit_after(flown, &wanted, &members, margin_m);
        let expected_true = self.orbits_before.of(group.group).map_or(wanted, |orbit| after(&orbit.flown, 0.0));
        let orbit = |row: &GroupRow| OrbitMotion {
            centre: centre(row),
            velocity: Velocity::from_m_s(row.vx_m_s, row.vy_m_s),
            radius_m: row.standoff_distance_m,
            rate_m_s: row.standoff_rate_m_s,
        };
        let (own, was) = (orbit(group), orbit(old));
        let expected_own = if self.rules.orbit_motion.is_at_once() {
            // The agents' own centre goes on as it went.
            let centre = was.centre + was.velocity * self.rules.period_s;
            let state = TargetState::new(centre, was.velocity, [0.0; 2]);
            OrbitMotion::start(&state, &self.rules.standoff_distance(&members, &state, group.margin_m))
        } else {
            after(&was, group.margin_m)
        };
        for uav in frame.uavs.iter().filter(|uav| uav.group == Some(group.group)) {
            let off_m = |orbit: &OrbitMotion| off_orbit_m(at(uav), orbit.centre, orbit.radius_m);
            self.truth.add((off_m(&truth.flown) - off_m(&expected_true)).abs());
            self.own.add((off_m(&own) - off_m(&expected_own)).abs());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff::Position;

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
        let mut orbits = TrueOrbits::default();
        for frame in frames {
            orbits.next(rules, &frame.groups, &known(frame).collect::<Vec<_>>());
            surprises.frame(frame, &orbits);
        }
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
