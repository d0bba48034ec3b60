//! Goals, limits and bounds of the metrics, and lines that explain their values.

use standoff::params::Margin;
use standoff_score::SelectedMetrics;
use standoff_sim::scenario::Settings;

use super::Events;

/// Distance below which two UAVs at one altitude get a remark, m. The event `proximity-alert` has a separate limit.
const CLOSE_M: f64 = 100.0;
/// Range of `anees` that needs no remark.
const CONSISTENT: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// Remark below a table that compares a run with the paper's law.
pub(super) const PAPER_LAW: &str = "paper's law: same scenario, initial positions and seed; its margin (16) as \
                                     published adds a squared distance to a length (an erratum), so that orbits jump \
                                     to r_d,max whenever members change";

/// Returns the desired value of a metric: a goal (closer is better), a limit (must not be exceeded) or a bound (cannot
/// be exceeded). Empty if none is known.
pub(super) fn target(metric: &str, settings: &Settings) -> String {
    match metric {
        "custody_fraction" | "priority_custody_fraction" | "in_view_fraction" | "reacquired_fraction" => {
            "goal 100".to_owned()
        }
        "off_boresight_mean_deg" | "off_boresight_max_deg" => {
            format!("limit {:.0}", 0.5 * settings.team.track.sensor.field_of_view_rad.to_degrees())
        }
        "separation_min_same_altitude_m" => {
            settings.team.separation.map_or_else(String::new, |least| format!("limit {:.0}", least.horizontal_min_m))
        }
        "anees" | "anees_nonmanoeuvring" | "anees_manoeuvring" | "nis" | "track_purity" => "goal 1".to_owned(),
        "position_crlb_ratio" | "velocity_crlb_ratio" => "bound 1".to_owned(),
        "handoffs"
        | "removals"
        | "standoff_distance_m"
        | "detected_fraction"
        | "separation_min_m"
        | "separation_min_same_group_m"
        | "orbit_prediction_error_m_settled"
        | "own_orbit_prediction_error_m_settled" => String::new(),
        "position_error_m"
        | "position_error_single_uav_m"
        | "position_error_multi_uav_m"
        | "velocity_error_m_s"
        | "reacquisition_time_s"
        | "turn_rate_saturated_fraction"
        | "turn_rate_saturated_fraction_settled"
        | "speed_saturated_fraction"
        | "turn_reversals_per_min"
        | "reassignments_per_uav_min"
        | "avoidance_time_s"
        | "commit_lag_s"
        | "commit_lag_max_s"
        | "sent_bytes_per_s"
        | "sent_bytes_per_s_max" => "lower is better".to_owned(),
        _ => "goal 0".to_owned(),
    }
}

/// Returns one line that prevents a misreading of a metric; `None` if its label is clear.
pub(super) fn meaning(metric: &str, value: f64, settings: &Settings) -> Option<String> {
    let uav = &settings.team.uav;
    let text = match metric {
        "in_view_fraction" => "in a group or not",
        "custody_fraction" => "in a group and in some UAV's view",
        "member_out_of_view_fraction" if value > 0.0 => "targets that are in a group, but in no UAV's view",
        "off_boresight_max_deg" => "of the outermost member of a UAV's group; the limit is half the field of view",
        "position_error_m" => {
            let (range_m, bearing_deg) =
                (settings.sensor.truth.range_sd_m, settings.sensor.truth.bearing_sd_rad.to_degrees());
            if range_m == 0.0 {
                return None;
            }
            return Some(format!(
                "of group members; standard deviations of one measurement: {range_m} m, {bearing_deg:.0}\u{b0}"
            ));
        }
        "anees" | "anees_nonmanoeuvring" => "squared error relative to the filter's own covariance",
        "position_crlb_ratio" => "relative to the Cramer-Rao bound: no unbiased filter is below 1",
        "standoff_error_on_orbit_m" => "of UAVs since they arrived on the orbit of their group",
        "standoff_error_own_estimate_m" => "relative to the orbit that the UAVs estimate, which may itself be wrong",
        "orbit_prediction_error_m_settled" => "part of the standoff error that no guidance law can avoid",
        "phase_error_deg" => "deviation from the desired phase difference between UAVs on one orbit",
        "infeasible_fraction" if value > 0.0 => "no orbit within the limits covers the whole group",
        "turn_rate_saturated_fraction" => return Some(format!("the limit is {:.2} rad/s", uav.turn_rate_max_rad_s)),
        "speed_saturated_fraction" => {
            let [low_m_s, high_m_s] = uav.speeds_m_s();
            return Some(format!("the limits are {low_m_s} and {high_m_s} m/s"));
        }
        "separation_min_m" => "horizontal distance of any two UAVs; their altitudes may differ",
        "duplicate_coverage_fraction" if value > 0.0 => {
            "UAVs of two groups each have the target as a member of their own group, not only during handoffs"
        }
        _ => return None,
    };
    Some(text.to_owned())
}

/// Returns remarks that explain values that could be mistaken for a failure, each with the metric that it concerns.
pub(super) fn remarks(metrics: &SelectedMetrics, events: &Events, settings: &Settings) -> Vec<(&'static str, String)> {
    let get = |metric: &str| metrics.get(metric).flatten();
    let mut remarks = Vec::new();
    let is_custody_complete = get("custody_fraction").is_none_or(|share| share >= 1.0);
    if events.count("uav-timeout") > 0 && !is_custody_complete {
        let what = "UAVs timed out (uav-timeout below): if a UAV was in an outage, targets that only it could see count \
                    as out of view";
        remarks.push(("custody_fraction", what.to_owned()));
    }
    if events.count("removed") > 0 && !is_custody_complete {
        remarks.push((
            "custody_fraction",
            "removed targets count as not in custody; the problems below give the reasons".to_owned(),
        ));
    }
    if settings.team.group.margin == Margin::Mahalanobis {
        let remedy = "--set orbit.margin=standard-deviations";
        let what = format!("r_d jumps because margin (16) is not a length (an erratum); use {remedy}");
        remarks.push(("standoff_error_on_orbit_m", what));
    }
    let half_deg = 0.5 * settings.team.track.sensor.field_of_view_rad.to_degrees();
    if get("off_boresight_max_deg").is_some_and(|worst_deg| worst_deg > half_deg) {
        let what = "above the limit for one UAV; another UAV may have had the target in view: see \"group-member time \
                    out of view\"";
        remarks.push(("off_boresight_max_deg", what.to_owned()));
    }
    let closest_m = get("separation_min_same_altitude_m").unwrap_or(f64::INFINITY);
    if closest_m < settings.team.separation.map_or(CLOSE_M, |separation| separation.horizontal_min_m) {
        let required = match settings.team.separation {
            Some(separation) => format!("the required minimum is {} m", separation.horizontal_min_m),
            None => "the scenario sets no minimum (see [separation])".to_owned(),
        };
        let what = format!("two UAVs at one altitude came within {closest_m:.0} m; {required}");
        remarks.push(("separation_min_same_altitude_m", what));
    }
    let nonmanoeuvring = get("anees_nonmanoeuvring");
    if let Some(anees) = nonmanoeuvring.or(get("anees")).filter(|anees| !CONSISTENT.contains(anees)) {
        let of = nonmanoeuvring.map_or_else(String::new, |anees| format!("{anees:.2} without manoeuvring targets, "));
        let assumed = settings.team.track.target.acceleration_sd_m_s2;
        let wider = settings.model.filter(|model| model.acceleration_sd_m_s2 < assumed);
        let what = match (wider, anees < 1.0) {
            (Some(model), true) => format!(
                "below 1: the filter assumes accelerations of {assumed} m/s2, non-manoeuvring targets have {}",
                model.acceleration_sd_m_s2
            ),
            (_, true) => "below 1: the estimates are more accurate than the filter assumes".to_owned(),
            (_, false) => "above 1: the estimates are less accurate than the filter assumes".to_owned(),
        };
        remarks.push(("anees", of + &what));
    }
    if let Some(anees) = get("anees_manoeuvring").filter(|anees| !CONSISTENT.contains(anees)) {
        let what = format!("{anees:.2} of manoeuvring targets: the filter's target model does not include manoeuvres");
        remarks.push(("anees", what));
    }
    remarks
}
