//! The orbits that groups should be flown on: the rule flown, its motion included, on where their targets truly are.

use standoff::{OrbitMotion, TargetState};

use super::rules::Rules;
use crate::frame::GroupRow;
use crate::geometry::{Known, on_orbit};

/// The true orbit of a group at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TrueOrbit {
    /// Its motion included, from the first instant on in which the group had targets that exist; without one, as the next.
    pub(super) flown: OrbitMotion,
    /// About the targets of the instant, whatever was before.
    pub(super) at_once: OrbitMotion,
}

/// The true orbits at an instant.
#[derive(Debug, Clone, Default)]
pub(super) struct TrueOrbits {
    /// By ascending group.
    of: Vec<(u32, TrueOrbit)>,
    /// Room that lives on: those of the instant before, and the members of one group.
    before: Vec<(u32, TrueOrbit)>,
    members: Vec<TargetState>,
}

impl TrueOrbits {
    /// Goes on to the next instant, with these groups by ascending id, in which these targets are known and exist.
    pub(super) fn next(&mut self, rules: &Rules, groups: &[GroupRow], known: &[Known]) {
        core::mem::swap(&mut self.of, &mut self.before);
        self.of.clear();
        for group in groups {
            self.members.clear();
            self.members.extend(on_orbit(known, group.group));
            let Some(at_once) = rules.orbit(&self.members) else { continue };
            let was = orbit_of(&self.before, group.group).map(|orbit| &orbit.flown);
            let flown = was.map_or(at_once, |was| rules.orbit_after(was, &at_once, &self.members, 0.0));
            self.of.push((group.group, TrueOrbit { flown, at_once }));
        }
    }

    pub(super) fn of(&self, group: u32) -> Option<&TrueOrbit> {
        orbit_of(&self.of, group)
    }
}

fn orbit_of(orbits: &[(u32, TrueOrbit)], group: u32) -> Option<&TrueOrbit> {
    orbits.binary_search_by_key(&group, |(id, _)| *id).ok().map(|index| &orbits[index].1)
}

#[cfg(test)]
mod tests {
    use standoff::{CentreEstimate, MotionParams, Position};

    use super::*;
    use crate::frame::{Frame, TruthRow, UavRow};
    use crate::geometry::known;
    use crate::scenario::{Edits, Scenario};
    use crate::score::fixtures::{group_row, track_row, truth_row, uav_row};
    use crate::score::{Choice, Judge, Metrics, Scorer};

    fn rules() -> Rules {
        let scenario = Scenario::load("paper/table-2-pair", &Edits::default(), 1).unwrap();
        let orbit_motion = MotionParams { response_s: 1.5, acceleration_max_m_s2: 3.0, approach_max_m_s: 25.0 };
        Rules { centre: CentreEstimate::SmallestCircle, orbit_motion, settle_s: 0.0, ..Rules::of(&scenario.settings) }
    }

    /// Two targets 300 m apart, about whom r_d is 300 m, and a UAV 300 m east of their middle; then they are all 100 m
    /// further west. The agents believe what they like.
    fn jump() -> [Frame; 2] {
        [0.0, -100.0].map(|x_m| {
            let truth: [TruthRow; 2] = [(0, -150.0), (1, 150.0)].map(|(target, y_m)| truth_row(target, x_m, y_m));
            Frame {
                truth: truth.to_vec(),
                tracks: vec![track_row(0, Some(0)), track_row(1, Some(0))],
                groups: vec![group_row(0)],
                uavs: vec![UavRow { x_m: 300.0, ..uav_row(0) }],
                ..Frame::default()
            }
        })
    }

    fn scored(rules: &Rules) -> Metrics {
        let mut scorer = Scorer::new(rules.clone(), Choice::ALL);
        jump().iter().for_each(|frame| scorer.frame(frame));
        scorer.metrics()
    }

    /// From rest with all of 3 m/s2, the centre is 0.375 m further west after half a second. The two are
    /// sqrt(99.625^2 + 150^2) = 180.07 m from there, so that the radius begins to grow, by as much. With (alpha_f - eps_m)/2
    /// = 30 degrees r_d is twice the spread.
    #[test]
    fn a_true_orbit_is_on_its_way_to_where_its_targets_are() {
        let (rules, [first, second]) = (rules(), jump());
        let mut orbits = TrueOrbits::default();
        orbits.next(&rules, &first.groups, &known(&first).collect::<Vec<_>>());
        let start = orbits.of(0).unwrap().at_once;
        assert_eq!(orbits.of(0).unwrap().flown, start);
        assert!((start.radius_m - 300.0).abs() < 1e-9 && start.centre == Position::ORIGIN);
        orbits.next(&rules, &second.groups, &known(&second).collect::<Vec<_>>());
        let TrueOrbit { flown, at_once } = *orbits.of(0).unwrap();
        assert_eq!(at_once.centre, Position::from_m(-100.0, 0.0));
        assert!((at_once.radius_m - 300.0).abs() < 1e-9);
        assert!(flown.centre.distance_m(Position::from_m(-0.375, 0.0)) < 1e-9 && flown.velocity.x_m_s() == -1.5);
        assert!((flown.radius_m - 300.375).abs() < 1e-9 && (flown.rate_m_s - 1.5).abs() < 1e-9);
        // A group that has gone starts anew.
        orbits.next(&rules, &[], &[]);
        orbits.next(&rules, &second.groups, &known(&second).collect::<Vec<_>>());
        assert_eq!(orbits.of(0).unwrap().flown, at_once);
    }

    /// The UAV is on the first orbit, and 300.375 m from the centre of the second, whose radius is as large. The orbit of
    /// the instant, without a motion, it misses by 100 m.
    #[test]
    fn errors_are_about_the_orbit_as_it_may_move() {
        let (rules, frames) = (rules(), jump());
        let near = |value: Option<f64>, wanted_m: f64| (value.unwrap() - wanted_m).abs() < 1e-9;
        let metrics = scored(&rules);
        assert!(near(metrics.standoff_error_m, 0.0) && near(metrics.standoff_error_m_settled, 0.0));
        assert!(near(metrics.standoff_error_instant_m_settled, 50.0));
        let mut judge = Judge::new(rules.clone());
        judge.frame(&frames[0]);
        let judged = judge.frame(&frames[1]);
        assert!(near(judged.standoff_error_m(&frames[1].uavs[0]), 0.0));
        assert!(near(judged.centre_error_m(&frames[1].groups[0]), 0.375));

        let at_once = MotionParams { response_s: 0.0, ..rules.orbit_motion };
        let metrics = scored(&Rules { orbit_motion: at_once, ..rules });
        assert!(near(metrics.standoff_error_m, 50.0) && near(metrics.standoff_error_instant_m_settled, 50.0));
    }
}
