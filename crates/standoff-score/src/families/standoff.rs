//! Distances of the UAVs from their orbits.

use standoff::guidance::orbit_motion::OrbitMotion;

use crate::geometry::{at, centre, off_orbit_m};
use crate::mean::Mean;
use crate::metric::{BOTH, Family, GROUPS, LARGE, Metric, NEITHER, metric};
use crate::step::{Inputs, Step};
use crate::transit::Transit;

/// Means over the UAVs of all groups, m.
#[derive(Debug, Default)]
pub(crate) struct Standoff {
    distance_m: Mean,
    error_m: Mean,
    own_estimate_m: Mean,
    transit: Transit,
    settled_m: Mean,
    own_estimate_settled_m: Mean,
    /// With respect to the orbit without motion limits.
    unfiltered_settled_m: Mean,
}

impl Family for Standoff {
    const SECTION: &'static str = "Guidance";
    const METRICS: &'static [Metric<Self>] = &[
        metric("standoff_distance_m", "desired standoff distance", NEITHER, 5.0, GROUPS, |of, _| of.distance_m.value()),
        metric("standoff_error_m", "standoff error", LARGE, 0.5, BOTH, |of, _| of.error_m.value()),
        metric("standoff_error_own_estimate_m", "standoff error (own estimate)", LARGE, 0.5, GROUPS, |of, _| {
            of.own_estimate_m.value()
        }),
        metric("standoff_error_on_orbit_m", "standoff error on the orbit", LARGE, 0.5, BOTH, |of, _| {
            of.transit.on_orbit_m.value()
        }),
        metric("transit_fraction", "UAV time in transit to an orbit", LARGE, 0.01, BOTH, |of, _| {
            of.transit.fraction.value()
        }),
        metric("standoff_error_m_settled", "standoff error, settled", LARGE, 0.5, BOTH, |of, _| of.settled_m.value()),
        metric(
            "standoff_error_own_estimate_m_settled",
            "standoff error (own estimate), settled",
            LARGE,
            0.5,
            GROUPS,
            |of, _| of.own_estimate_settled_m.value(),
        ),
        metric(
            "standoff_error_unfiltered_m_settled",
            "standoff error (unfiltered orbit), settled",
            LARGE,
            0.5,
            BOTH,
            |of, _| of.unfiltered_settled_m.value(),
        ),
    ];

    fn inputs(_: &[&str]) -> Inputs {
        Inputs { true_orbits: true, ..Inputs::default() }
    }

    fn add(&mut self, step: &Step<'_>) {
        let settled = step.config.is_settled(step.frame);
        for group in &step.frame.groups {
            for index in step.uavs.of(group.group) {
                let error_m = off_orbit_m(at(&step.frame.uavs[index]), centre(group), group.standoff_distance_m).abs();
                self.distance_m.add(group.standoff_distance_m);
                self.own_estimate_m.add(error_m);
                if settled {
                    self.own_estimate_settled_m.add(error_m);
                }
            }
            let Some(orbit) = step.true_orbits.of(group.group) else { continue };
            for index in step.uavs.of(group.group) {
                let uav = &step.frame.uavs[index];
                let off_m = |orbit: &OrbitMotion| off_orbit_m(at(uav), orbit.centre, orbit.radius_m).abs();
                let error_m = off_m(&orbit.flown);
                self.error_m.add(error_m);
                self.transit.add(uav.uav, group.group, error_m, orbit.flown.radius_m);
                if settled {
                    self.settled_m.add(error_m);
                    self.unfiltered_settled_m.add(off_m(&orbit.unfiltered));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::FrameScorer;
    use crate::ScoreConfig;
    use crate::common::{score, score_config};
    use crate::row_fixtures::{group_row, track_row, truth_row, uav_row};
    use standoff::params::CentreEstimate;
    use standoff::{Displacement, math};
    use standoff_record::{Frame, GroupRow, UavRow};

    /// The minimum enclosing circle of these four targets passes through the second and third: its centre is (160, 120)
    /// m, its radius 200 m. The centroid is (90, 70) m, and the second target is 100 sqrt(5.78) m from it. Two UAVs are
    /// 500 m east and north of the circle's centre, at the desired phase of a right angle.
    #[test]
    fn standoff_errors_use_the_configured_centre_rule() {
        let score_config = ScoreConfig {
            centre: CentreEstimate::EnclosingCircle,
            desired_phase_rad: math::PI / 2.0,
            ..score_config()
        };
        let places_m = [(0.0, 0.0), (320.0, 0.0), (0.0, 240.0), (40.0, 40.0)];
        let mut frame = Frame { time_us: 100_000_000, ..Frame::default() };
        frame.truth.extend((0..).zip(places_m).map(|(target, (x_m, y_m))| truth_row(target, x_m, y_m)));
        frame.tracks.extend((0..4).map(|target| track_row(target, Some(0))));
        frame.groups.push(GroupRow { x_m: 160.0, y_m: 123.0, ..group_row(0) });
        let uav = |uav: u32, x_m: f64, y_m: f64| UavRow { x_m, y_m, ..uav_row(uav) };
        frame.uavs.extend([uav(0, 660.0, 120.0), uav(1, 160.0, 620.0)]);
        let half_rad =
            0.5 * (score_config.sensor.field_of_view_rad - score_config.team.group.standoff.field_of_view_margin_rad);
        let r_d_m = |d_max_m: f64| d_max_m / math::sin(half_rad);
        let near = |value: Option<f64>, expected: f64| (value.unwrap() - expected).abs() < 1e-9;

        let metrics = score(&score_config, [&frame]);
        assert!(near(metrics["standoff_error_m"], 500.0 - r_d_m(200.0)), "{metrics:?}");
        assert!(
            near(metrics["standoff_error_m_settled"], 500.0 - r_d_m(200.0)) && near(metrics["phase_error_deg"], 0.0)
        );
        assert!(near(metrics["standoff_error_unfiltered_m_settled"], 500.0 - r_d_m(200.0)));
        let mut scorer = FrameScorer::new(score_config.clone());
        let scores = scorer.frame(&frame);
        assert!(near(scores.standoff_error_m(&frame.uavs[1]), 500.0 - r_d_m(200.0)));
        assert!(near(scores.centre_error_m(&frame.groups[0]), 3.0));

        let centroid = ScoreConfig { centre: CentreEstimate::Filtered, ..score_config.clone() };
        let off_m = Displacement::from_m(570.0, 50.0).length_m() - r_d_m(100.0 * 5.78f64.sqrt());
        let mut scorer = FrameScorer::new(centroid.clone());
        let scores = scorer.frame(&frame);
        assert!(near(scores.standoff_error_m(&frame.uavs[0]), off_m));
        assert_eq!(
            score(&centroid, [&frame]),
            score(&ScoreConfig { centre: CentreEstimate::Filtered, ..score_config }, [&frame])
        );
    }
}
