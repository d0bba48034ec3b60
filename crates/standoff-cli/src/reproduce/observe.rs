//! What the studies look at in a frame.

use standoff::{Angle, Position};
use standoff_sim::record::{Frame, GroupRow, TrackRow, UavRow};

/// Time of a frame, s.
pub(crate) fn time_s(frame: &Frame) -> f64 {
    frame.time_us as f64 * 1e-6
}

/// |r - r_d| of a UAV by the agents' own view, m: what the paper calls the standoff distance error.
pub(crate) fn standoff_error_m(frame: &Frame, uav: &UavRow) -> Option<f64> {
    let group = frame.groups.iter().find(|group| Some(group.group) == uav.group)?;
    let distance_m = at(uav).distance_m(Position::from_m(group.x_m, group.y_m));
    Some((distance_m - group.standoff_distance_m).abs())
}

/// Angle about the estimated centre between the two UAVs of a group, degrees in [0, 180]; none for fewer or more.
pub(crate) fn separation_deg(frame: &Frame, group: &GroupRow) -> Option<f64> {
    let centre = Position::from_m(group.x_m, group.y_m);
    let crew: Vec<Angle> = frame
        .uavs
        .iter()
        .filter(|uav| uav.group == Some(group.group))
        .map(|uav| (at(uav) - centre).direction())
        .collect();
    let [first, second] = crew[..] else { return None };
    Some((second - first).abs_rad().to_degrees())
}

/// Distance from the estimated centre of a group to the centroid of its members' true positions, those in dwell
/// included, m.
pub(crate) fn centre_error_m(frame: &Frame, group: &GroupRow) -> Option<f64> {
    let id = Some(group.group);
    let of_group = |track: &&TrackRow| track.group == id || track.to_group == id;
    let (mut x_m, mut y_m, mut n) = (0.0, 0.0, 0.0);
    for track in frame.tracks.iter().filter(of_group) {
        let truth = true_position(frame, track.target)?;
        (x_m, y_m, n) = (x_m + truth.x_m(), y_m + truth.y_m(), n + 1.0);
    }
    (n > 0.0).then(|| Position::from_m(x_m / n, y_m / n).distance_m(Position::from_m(group.x_m, group.y_m)))
}

/// Largest angle between a UAV's boresight and the true position of a member of its group, degrees; targets in dwell
/// are the duty of the passing group.
pub(crate) fn line_of_sight_deg(frame: &Frame, uav: &UavRow) -> Option<f64> {
    let (group, boresight) = (Some(uav.group?), Angle::from_rad(uav.boresight_rad?));
    let members = frame.tracks.iter().filter(|track| track.group == group);
    let places = members.filter_map(|track| true_position(frame, track.target));
    places.map(|place| ((place - at(uav)).direction() - boresight).abs_rad().to_degrees()).reduce(f64::max)
}

fn at(uav: &UavRow) -> Position {
    Position::from_m(uav.x_m, uav.y_m)
}

fn true_position(frame: &Frame, target: u32) -> Option<Position> {
    let index = frame.truth.binary_search_by_key(&target, |truth| truth.target).ok()?;
    Some(Position::from_m(frame.truth[index].x_m, frame.truth[index].y_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduce::flights::{Plan, watch};
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
