//! Goals, limits and bounds of the metrics, and remarks that explain unusual values.

use standoff::Margin;
use standoff_sim::scenario::Settings;
use standoff_sim::score::SelectedMetrics;

use super::Events;

/// Distance below which two UAVs at one altitude get a remark, m. The event `proximity-alert` has a separate limit.
const CLOSE_M: f64 = 100.0;
/// Standoff error above which a remark explains it, m; errors on a steady orbit are smaller.
const UNSETTLED_M: f64 = 20.0;
/// Range of `anees` that needs no remark.
const CONSISTENT: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// Remark below a table that compares a run with the paper's law.
pub(super) const PAPERS_LAW: &str = "paper's law: same scenario, initial positions and seed; its margin (16) as \
                                     published adds a squared distance to a length (an erratum), so that orbits jump \
                                     to r_d,max whenever members change";

/// Returns the desired values of a metric: a goal (closer is better), a limit (must not be exceeded) or a bound (cannot
/// be exceeded). Empty if none is known.
pub(super) fn target(metric: &str, settings: &Settings) -> String {
    let sensor = &settings.team.track.sensor;
    let half_deg = 0.5 * sensor.field_of_view_rad.to_degrees();
    match metric {
        "custody_fraction" | "in_view_fraction" | "reacquired_fraction" => "goal 100".to_owned(),
        "off_boresight_mean_deg" | "off_boresight_max_deg" => format!("limit {half_deg:.0}: half the field of view"),
        "position_error_m" | "position_error_single_uav_m" | "position_error_multi_uav_m" => {
            let (range_m, bearing_deg) = (settings.noise.range_sd_m, settings.noise.bearing_sd_rad.to_degrees());
            format!("small (one scan: {range_m} m, {bearing_deg:.0} deg)")
        }
        "velocity_error_m_s" | "reacquisition_time_s" | "turn_reversals_per_min" | "reassignments_per_uav_min" => {
            "small".to_owned()
        }
        "commit_lag_s" | "commit_lag_max_s" | "sent_bytes_per_s" | "sent_bytes_per_s_max" => "small".to_owned(),
        "separation_min_m" => "altitudes may differ".to_owned(),
        "separation_min_same_altitude_m" => {
            format!("limit {:.0}: UAVs at one altitude", close_m(settings))
        }
        "avoidance_time_s" => "small".to_owned(),
        "turn_rate_saturated_fraction" => {
            format!("small; the limit is {:.2} rad/s", settings.team.uav.turn_rate_max_rad_s)
        }
        "speed_saturated_fraction" => {
            let uav = &settings.team.uav;
            let bounds_m_s = [-1.0, 1.0].map(|sign| uav.speed_m_s + sign * uav.speed_change_max_m_s);
            format!("small; the limits are {} and {} m/s", bounds_m_s[0], bounds_m_s[1])
        }
        "anees" | "anees_nonmanoeuvring" | "anees_manoeuvring" | "nis" => "goal 1".to_owned(),
        "position_crlb_ratio" | "velocity_crlb_ratio" => "bound 1".to_owned(),
        "handoffs" | "removals" => String::new(),
        name if name.contains("surprise") => "lower bound of the standoff error".to_owned(),
        _ => "goal 0".to_owned(),
    }
}

/// Returns the minimum distance of two UAVs at one altitude, m.
fn close_m(settings: &Settings) -> f64 {
    settings.team.separation.map_or(CLOSE_M, |separation| separation.horizontal_min_m)
}

/// Returns remarks that explain values that could be mistaken for a failure.
pub(super) fn notes(
    metrics: &SelectedMetrics,
    events: &Events,
    settings: &Settings,
    is_shown: impl Fn(&str) -> bool,
) -> Vec<String> {
    let get = |metric: &str| metrics.get(metric).flatten().filter(|_| is_shown(metric));
    let mut remarks = Vec::new();
    if settings.team.group.margin == Margin::Mahalanobis {
        let remedy = "--set orbit.margin=standard-deviations";
        remarks.push(format!("r_d jumps: margin (16) is not a length (an erratum); use {remedy}"));
    }
    if let Some(closest_m) = get("separation_min_same_altitude_m").filter(|closest_m| *closest_m < close_m(settings)) {
        let required = match settings.team.separation {
            Some(separation) => format!("the required minimum is {} m", separation.horizontal_min_m),
            None => "the scenario sets no minimum separation".to_owned(),
        };
        remarks.push(format!("two UAVs at one altitude came within {closest_m:.0} m; {required}"));
    }
    let is_custody_complete = get("custody_fraction").is_none_or(|share| share >= 1.0);
    if events.count("uav-timeout") > 0 && !is_custody_complete {
        let what = "UAVs were out of service (uav-timeout below)";
        remarks.push(format!("{what}: targets that only they could see count as out of view"));
    }
    if events.count("removed") > 0 && !is_custody_complete {
        let what = "custody_fraction, in_view_fraction and longest_out_of_view_s include removed targets";
        remarks.push(format!("{what}; the events below give the reasons"));
    }
    let changes = events.count("removed") + events.count("handoff-completed");
    if changes > 0 && get("standoff_error_m_settled").is_some_and(|error_m| error_m > UNSETTLED_M) {
        remarks.push(format!(
            "standoff errors include transitions to another orbit, as after handoffs and removals ({changes} here)"
        ));
    }
    let half_deg = 0.5 * settings.team.track.sensor.field_of_view_rad.to_degrees();
    if get("off_boresight_max_deg").is_some_and(|worst_deg| worst_deg > half_deg) {
        let what = "off_boresight_max_deg exceeds half the field of view for one UAV";
        remarks.push(format!("{what}; member_out_of_view_fraction counts targets that no UAV had in view"));
    }
    let quiet = get("anees_nonmanoeuvring").or(get("anees")).filter(|anees| !CONSISTENT.contains(anees));
    if let Some(anees) = quiet {
        let assumed = settings.team.track.target.acceleration_sd_m_s2;
        let wider = settings.model.filter(|model| model.acceleration_sd_m_s2 < assumed);
        remarks.push(match (wider, anees < 1.0) {
            (Some(model), true) => format!(
                "anees below 1: the filter assumes accelerations of {assumed} m/s2, non-manoeuvring targets have {}",
                model.acceleration_sd_m_s2
            ),
            (_, true) => "anees below 1: the estimates are more accurate than the filter assumes".to_owned(),
            (_, false) => "anees above 1: the estimates are less accurate than the filter assumes".to_owned(),
        });
    }
    if get("anees_manoeuvring").is_some_and(|anees| !CONSISTENT.contains(&anees)) {
        remarks.push("anees_manoeuvring: the filter's target model does not include manoeuvres".to_owned());
    }
    remarks
}
