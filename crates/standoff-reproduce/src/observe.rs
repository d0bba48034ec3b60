//! What the studies look at in a frame.

use standoff_sim::geometry::{self, Geometry};
use standoff_sim::record::{Frame, GroupRow, UavRow};

/// Time of a frame, s.
pub(crate) fn time_s(frame: &Frame) -> f64 {
    frame.time_us as f64 * 1e-6
}

/// |r - r_d| of a UAV by the agents' own view, m: what the paper calls the standoff distance error.
pub(crate) fn standoff_error_m(frame: &Frame, uav: &UavRow) -> Option<f64> {
    geometry::group_of(frame, uav).map(|group| geometry::tracking_error_m(uav, group).abs())
}

/// Angle about the estimated centre between the two UAVs of a group, degrees in [0, 180]; none for fewer or more.
pub(crate) fn separation_deg(frame: &Frame, group: &GroupRow) -> Option<f64> {
    let mut separations = geometry::separations(frame).into_iter();
    let of_pair = separations.find(|(id, (count, ..), _)| *id == group.group && *count == 2);
    of_pair.map(|(.., angle_rad)| angle_rad.to_degrees())
}

/// Distance from the estimated centre of a group to the true centroid, m.
pub(crate) fn centre_error_m(frame: &Frame, group: &GroupRow) -> Option<f64> {
    Geometry::of(frame).centre_error_m(group)
}

/// Largest angle between a UAV's boresight and the true position of a member of its group, degrees.
pub(crate) fn line_of_sight_deg(frame: &Frame, uav: &UavRow) -> Option<f64> {
    Geometry::of(frame).line_of_sight_rad(uav).map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flights::{Plan, watch};
    use standoff_sim::score::{Choice, Rules, Scorer};

    /// What is seen here is what the scores say of the same run, found there by code of their own.
    #[test]
    fn what_is_observed_agrees_with_the_scores() {
        let scenario = Plan { runs: 2, first_seed: 5, threads: None, traffic: Vec::new() }
            .first("paper/figure-8", &[])
            .map_err(|_| ())
            .unwrap();
        let mut scorer = Scorer::new(Rules::of(&scenario.settings), Choice::ALL);
        let (mut standoff, mut widest, mut n) = (0.0, 0.0f64, 0.0);
        let watched = watch(&scenario, |frame| {
            scorer.frame(frame);
            for uav in &frame.uavs {
                standoff += standoff_error_m(frame, uav).unwrap();
                widest = widest.max(line_of_sight_deg(frame, uav).unwrap_or(0.0));
                n += 1.0;
            }
        });
        assert!(watched.is_ok());
        let metrics = scorer.metrics();
        assert!((standoff / n - metrics.standoff_tracking_error_m.unwrap()).abs() < 1e-9);
        assert!((widest - metrics.line_of_sight_max_deg.unwrap()).abs() < 1e-9);
    }
}
