//! What is good: goals, limits and bounds of the metrics; and a word why a number is what it is.

use standoff::Margin;
use standoff_sim::scenario::Settings;
use standoff_sim::score::Chosen;

use super::Events;

/// Two UAVs at one altitude that come nearer than this are told of, m. The event `uavs-close` has a limit of its own.
const CLOSE_M: f64 = 100.0;
/// A standoff error that is larger than what following an orbit leaves needs a word, m.
const UNSETTLED_M: f64 = 20.0;
/// An `anees` outside of these needs a word.
const CONSISTENT: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// What is said below a table with the paper's law beside the run.
pub(super) const PAPERS_LAW: &str = "paper's law: the same scenario, starts and seed under it; its printed margin (16), \
    an erratum, adds a squared distance to metres: orbits jump to r_d,max whenever members change";

/// What values of a metric are good: a goal (better the nearer), a limit (not to be passed) or a bound (cannot be
/// passed). Empty where neither is known.
pub(super) fn good(metric: &str, settings: &Settings) -> String {
    let sensor = &settings.team.track.sensor;
    let half_deg = 0.5 * sensor.field_of_view_rad.to_degrees();
    match metric {
        "watched_fraction" | "seen_fraction" | "refound_fraction" => "goal 100".to_owned(),
        "line_of_sight_deg" | "line_of_sight_max_deg" => format!("limit {half_deg:.0}: half the field of view"),
        "position_error_m" | "position_error_one_m" | "position_error_more_m" => {
            let (range_m, bearing_deg) = (settings.noise.range_sd_m, settings.noise.bearing_sd_rad.to_degrees());
            format!("small (one scan: {range_m} m, {bearing_deg:.0} deg)")
        }
        "velocity_error_m_s" | "refind_time_s" | "turn_reversals_per_min" | "reassignments_per_uav_min" => {
            "small".to_owned()
        }
        "commit_lag_s" | "commit_lag_max_s" | "bytes_per_s" | "bytes_max_per_s" => "small".to_owned(),
        "separation_min_m" => "altitudes may differ".to_owned(),
        "separation_min_layer_m" => {
            format!("limit {:.0}: two at one altitude", close_m(settings))
        }
        "separation_time_s" => "small".to_owned(),
        "turn_rate_saturated_fraction" => {
            format!("small; the limit is {:.2} rad/s", settings.team.uav.turn_rate_max_rad_s)
        }
        "speed_saturated_fraction" => {
            let uav = &settings.team.uav;
            let bounds_m_s = [-1.0, 1.0].map(|sign| uav.speed_m_s + sign * uav.speed_change_max_m_s);
            format!("small; the limits are {} and {} m/s", bounds_m_s[0], bounds_m_s[1])
        }
        "anees" | "anees_quiet" | "anees_manoeuvring" | "nis" => "goal 1".to_owned(),
        "position_bound_ratio" | "velocity_bound_ratio" => "bound 1".to_owned(),
        "handoffs" | "discards" => String::new(),
        name if name.contains("surprise") => "bound of the error of the same name".to_owned(),
        _ => "goal 0".to_owned(),
    }
}

/// Two at one altitude are to be further apart than this, m.
fn close_m(settings: &Settings) -> f64 {
    settings.team.separation.map_or(CLOSE_M, |separation| separation.minimum_m)
}

/// Why numbers are what they are, where they could be taken for a failure.
pub(super) fn words(
    metrics: &Chosen,
    events: &Events,
    settings: &Settings,
    is_told: impl Fn(&str) -> bool,
) -> Vec<String> {
    let get = |metric: &str| metrics.get(metric).flatten().filter(|_| is_told(metric));
    let mut words = Vec::new();
    if settings.team.group.margin == Margin::Mahalanobis {
        let without = "--set orbit.margin=standard-deviations";
        words.push(format!("r_d jumps: margin (16) is no length (an erratum); without: {without}"));
    }
    if let Some(closest_m) = get("separation_min_layer_m").filter(|closest_m| *closest_m < close_m(settings)) {
        let kept = match settings.team.separation {
            Some(separation) => format!("they are to be kept {} m apart", separation.minimum_m),
            None => "nothing enforces a distance".to_owned(),
        };
        words.push(format!("two UAVs at one altitude came within {closest_m:.0} m; {kept}"));
    }
    let is_all_watched = get("watched_fraction").is_none_or(|share| share >= 1.0);
    if events.count("uav-lost") > 0 && !is_all_watched {
        words.push("UAVs were out (uav-lost below): what only they could see counts as not seen".to_owned());
    }
    if events.count("discarded") > 0 && !is_all_watched {
        let what = "watched_fraction, seen_fraction and longest_gap_s count discarded targets, too";
        words.push(format!("{what}; the events below say why they were"));
    }
    let changes = events.count("discarded") + events.count("handoff-completed");
    if changes > 0 && get("standoff_error_m_settled").is_some_and(|error_m| error_m > UNSETTLED_M) {
        words.push(format!(
            "standoff errors count the ways onto another orbit, too, as after handoffs and discards ({changes} here)"
        ));
    }
    let half_deg = 0.5 * settings.team.track.sensor.field_of_view_rad.to_degrees();
    if get("line_of_sight_max_deg").is_some_and(|worst_deg| worst_deg > half_deg) {
        words.push(
            "line_of_sight_max_deg beyond half the field of view: one UAV's; out_of_view_fraction tells what no UAV saw"
                .to_owned(),
        );
    }
    let quiet = get("anees_quiet").or(get("anees")).filter(|anees| !CONSISTENT.contains(anees));
    if let Some(anees) = quiet {
        let assumed = settings.team.track.target.acceleration_sd_m_s2;
        let wider = settings.model.filter(|model| model.acceleration_sd_m_s2 < assumed);
        words.push(match (wider, anees < 1.0) {
            (Some(model), true) => format!(
                "anees below 1: the filter allows for accelerations of {assumed} m/s2, of which its quiet targets have {}",
                model.acceleration_sd_m_s2
            ),
            (_, true) => "anees below 1: the estimates are better than the filter says".to_owned(),
            (_, false) => "anees above 1: the estimates are worse than the filter says".to_owned(),
        });
    }
    if get("anees_manoeuvring").is_some_and(|anees| !CONSISTENT.contains(&anees)) {
        words.push("anees_manoeuvring: a manoeuvre is no part of the filter's model of its targets".to_owned());
    }
    words
}
