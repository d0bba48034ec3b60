//! Missions whose UAVs do not know their own positions and headings exactly.

use crate::common::{frames, load};
use standoff::sensor::measure;
use standoff::{Angle, Position};
use standoff_score::{MetricSelection, Metrics};
use standoff_sim::run::fly;

const FIGURE_9: &str = "improved/figure-9";
const TOUR: &str = "tour/10-unlabelled-detections";
const ERRORS: [&str; 2] = ["navigation.position_sd_m=3", "navigation.heading_bias_deg=2"];

/// Errors of zero change no bit of a frame, whatever their correlation time is.
#[test]
fn exact_navigation_changes_nothing() {
    for name in [FIGURE_9, TOUR] {
        let zeros = ["navigation.position_sd_m=0", "navigation.correlation_s=5", "navigation.heading_bias_deg=0"];
        let plain = frames(&load(name, &[], 2));
        assert!(frames(&load(name, &zeros, 2)) == plain, "{name}");
        let rows = || plain.iter().flat_map(|frame| &frame.uavs);
        assert!(rows().all(|row| row.believed_x_m.is_none() && row.believed_heading_rad.is_none()));
    }
}

#[test]
fn determinism_equal_seeds_give_equal_pose_errors_for_any_agents() {
    let shared = load(FIGURE_9, &[&ERRORS[..], &["team.agents=shared"]].concat(), 2);
    let mut others = frames(&load(FIGURE_9, &[&ERRORS[..], &["team.agents=per-uav"]].concat(), 2));
    let first = frames(&shared);
    assert!(frames(&shared) == first);
    for (other, first) in others.iter_mut().zip(&first) {
        assert_eq!((&other.uavs, &other.tracks), (&first.uavs, &first.tracks));
    }
    let others = frames(&load(FIGURE_9, &ERRORS, 3));
    assert_ne!(
        others[0].uavs[0].believed_x_m.unwrap() - others[0].uavs[0].x_m,
        first[0].uavs[0].believed_x_m.unwrap() - first[0].uavs[0].x_m
    );
}

/// A sensor without noise: ranges are those from the true position, and bearings are rotated by the heading error.
#[test]
fn measurements_are_from_the_true_pose_and_bearings_relative_to_the_assumed_heading() {
    let noise_free = ["sensor.range_sd_m=0", "sensor.bearing_sd_deg=0"];
    let mut count = 0;
    for frame in frames(&load(FIGURE_9, &[&ERRORS[..], &noise_free].concat(), 2)) {
        for row in &frame.detections {
            let uav = frame.uavs.iter().find(|uav| uav.uav == row.uav).unwrap();
            let target = frame.truth.iter().find(|truth| Some(truth.target) == row.target).unwrap();
            let exact = measure(Position::from_m(uav.x_m, uav.y_m), Position::from_m(target.x_m, target.y_m));
            let angle = Angle::from_rad;
            let error = angle(uav.believed_heading_rad.unwrap()) - angle(uav.heading_rad);
            assert!((row.range_m - exact.range_m).abs() < 1e-9);
            assert!((angle(row.bearing_rad) - exact.bearing - error).abs_rad() < 1e-9);
            // The recorded boresight is the true one.
            assert!((exact.bearing - angle(uav.boresight_rad.unwrap())).abs_rad() <= 35f64.to_radians() + 1e-9);
            count += 1;
        }
    }
    assert!(count > 1_000);
}

/// Means over 20 runs: a team that knows the size of its pose errors is as consistent as without errors, and more
/// accurate than one that ignores them. All updates are linearised: the other ones (`filter.near_range_m`) assume errors
/// without correlation in time, and lose 1.3 m of accuracy with this bias.
#[test]
fn stat_known_pose_errors_leave_the_filter_consistent() {
    let mean = |set: &[&str], of: fn(&Metrics) -> Option<f64>| {
        let set = [&["filter.near_range_m=0"], set].concat();
        let of_run = |seed| of(&fly(&load(FIGURE_9, &set, seed), MetricSelection::all()).unwrap()).unwrap();
        (1..=20).map(of_run).sum::<f64>() / 20.0
    };
    let exact = mean(&[], |run| run["anees"]);
    for (error, ignored) in [(ERRORS[0], "filter.own_position_sd_m=0"), (ERRORS[1], "filter.own_heading_sd_deg=0")] {
        let known = mean(&[error], |run| run["anees"]);
        let overconfident = mean(&[error, ignored], |run| run["anees"]);
        assert!((known / exact - 1.0).abs() < 0.15, "{error}: {known}, {exact} without errors");
        assert!(overconfident > 1.3 * exact, "{error}: {overconfident}");
        let position = |set: &[&str]| mean(set, |run| run["position_error_m"]);
        assert!(position(&[error]) < position(&[error, ignored]), "{error}");
    }
}
