//! Reference orbits from the truth: the configured orbit rule, with its motion limits, applied to the true target
//! positions.

use standoff::TargetState;
use standoff::guidance::orbit_motion::OrbitMotion;
use standoff_record::GroupRow;

use crate::config::ScoreConfig;
use crate::geometry::on_orbit;
use crate::matching::Matching;

/// True orbit of a group at a time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrueOrbit {
    /// Orbit with motion limits, from the first time step at which the group had existing targets. Equal to
    /// `unfiltered` if motion limits are off.
    pub(crate) flown: OrbitMotion,
    /// Orbit of the targets of this time step, without motion limits.
    pub(crate) unfiltered: OrbitMotion,
}

/// True orbits at a time step.
#[derive(Debug, Clone, Default)]
pub(crate) struct TrueOrbits {
    /// Ascending by group.
    of: Vec<(u32, TrueOrbit)>,
    /// Reused buffers: the orbits of the previous time step, and the members of one group.
    before: Vec<(u32, TrueOrbit)>,
    members: Vec<TargetState>,
}

impl TrueOrbits {
    /// Advances to the next time step, with these groups (ascending by id), targets and tracks.
    pub(crate) fn next(&mut self, config: &ScoreConfig, groups: &[GroupRow], matching: &Matching<'_>) {
        core::mem::swap(&mut self.of, &mut self.before);
        self.of.clear();
        for group in groups {
            self.members.clear();
            self.members.extend(on_orbit(matching, group.group));
            let Some(unfiltered) = config.orbit(&self.members) else { continue };
            let previous = orbit_of(&self.before, group.group).map(|orbit| &orbit.flown);
            let flown =
                previous.map_or(unfiltered, |previous| config.orbit_after(previous, &unfiltered, &self.members, 0.0));
            self.of.push((group.group, TrueOrbit { flown, unfiltered }));
        }
    }

    pub(crate) fn of(&self, group: u32) -> Option<&TrueOrbit> {
        orbit_of(&self.of, group)
    }
}

fn orbit_of(orbits: &[(u32, TrueOrbit)], group: u32) -> Option<&TrueOrbit> {
    orbits.binary_search_by_key(&group, |(id, _)| *id).ok().map(|index| &orbits[index].1)
}

#[cfg(test)]
mod tests {
    use standoff::Position;
    use standoff::params::CentreEstimate;
    use standoff::params::MotionParams;

    use super::*;
    use crate::FrameScorer;
    use crate::common::{score, score_config};
    use crate::row_fixtures::{group_row, track_row, truth_row, uav_row};
    use standoff_record::{Frame, TruthRow, UavRow};

    fn config() -> ScoreConfig {
        let orbit_motion =
            MotionParams { time_constant_s: 1.5, acceleration_max_m_s2: 3.0, closing_speed_max_m_s: 25.0 };
        ScoreConfig { centre: CentreEstimate::EnclosingCircle, orbit_motion, transient_s: 0.0, ..score_config() }
    }

    /// Two targets 300 m apart, whose r_d is 300 m, and a UAV 300 m east of their centre. In the second frame, the
    /// targets are 100 m farther west. The agents' estimates do not matter.
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

    /// From a standstill at 3 m/s2, the centre moves 0.375 m west in half a second. The targets are sqrt(99.625^2 +
    /// 150^2) = 180.07 m from there, so the radius begins to grow by the same amount. With (alpha_f - eps_m)/2 = 30
    /// degrees, r_d is twice the spread.
    #[test]
    fn true_orbit_moves_gradually_to_its_targets() {
        let (config, [first, second]) = (config(), jump());
        let mut orbits = TrueOrbits::default();
        orbits.next(&config, &first.groups, &Matching::of(&first));
        let start = orbits.of(0).unwrap().unfiltered;
        assert_eq!(orbits.of(0).unwrap().flown, start);
        assert!((start.radius_m - 300.0).abs() < 1e-9 && start.centre == Position::ORIGIN);
        orbits.next(&config, &second.groups, &Matching::of(&second));
        let TrueOrbit { flown, unfiltered } = *orbits.of(0).unwrap();
        assert_eq!(unfiltered.centre, Position::from_m(-100.0, 0.0));
        assert!((unfiltered.radius_m - 300.0).abs() < 1e-9);
        assert!(flown.centre.distance_m(Position::from_m(-0.375, 0.0)) < 1e-9 && flown.velocity.x_m_s() == -1.5);
        assert!((flown.radius_m - 300.375).abs() < 1e-9 && (flown.rate_m_s - 1.5).abs() < 1e-9);
        // A group that disappears starts from scratch.
        orbits.next(&config, &[], &Matching::default());
        orbits.next(&config, &second.groups, &Matching::of(&second));
        assert_eq!(orbits.of(0).unwrap().flown, unfiltered);
    }

    /// The UAV is on the first orbit, and 300.375 m from the centre of the second, which has the same radius. It misses
    /// the orbit without motion limits by 100 m.
    #[test]
    fn standoff_errors_use_the_orbit_with_motion_limits() {
        let (config, frames) = (config(), jump());
        let near = |value: Option<f64>, expected_m: f64| (value.unwrap() - expected_m).abs() < 1e-9;
        let metrics = score(&config, &frames);
        assert!(near(metrics["standoff_error_m"], 0.0) && near(metrics["standoff_error_m_settled"], 0.0));
        assert!(near(metrics["standoff_error_unfiltered_m_settled"], 50.0));
        let mut scorer = FrameScorer::new(config.clone());
        scorer.frame(&frames[0]);
        let scores = scorer.frame(&frames[1]);
        assert!(near(scores.standoff_error_m(&frames[1].uavs[0]), 0.0));
        assert!(near(scores.centre_error_m(&frames[1].groups[0]), 0.375));

        let unfiltered = MotionParams { time_constant_s: 0.0, ..config.orbit_motion };
        let metrics = score(&ScoreConfig { orbit_motion: unfiltered, ..config }, &frames);
        assert!(near(metrics["standoff_error_m"], 50.0) && near(metrics["standoff_error_unfiltered_m_settled"], 50.0));
    }
}
