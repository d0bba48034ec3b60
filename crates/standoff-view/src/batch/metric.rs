//! What a metric is, for people. `docs/metrics.md` defines each.

use serde::Serialize;
use standoff_sim::monte_carlo::BadEnd;
use standoff_sim::score::Metrics;

/// A metric, as the page names it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Metric {
    pub(super) name: String,
    /// In words; empty if it is not known.
    what: &'static str,
    /// The unit in which it is shown.
    unit: &'static str,
    /// What a value is multiplied by to be in `unit`.
    factor: f64,
    /// At which end runs are bad, if that is known.
    bad: Option<BadEnd>,
    /// Its mean is that of sums over all runs, not that of the runs' values.
    pooled: bool,
}

const WHAT: [(&str, &str); 29] = [
    ("position_error_m", "position error"),
    ("velocity_error_m_s", "velocity error"),
    ("position_error_all_m", "position error, all known targets"),
    ("standoff_distance_m", "standoff distance"),
    ("standoff_error_m", "standoff error, true geometry"),
    ("standoff_tracking_error_m", "standoff error, the agents' own view"),
    ("standoff_error_m_settled", "standoff error, true geometry, settled"),
    ("standoff_tracking_error_m_settled", "standoff error, own view, settled"),
    ("phase_error_deg", "phase error"),
    ("line_of_sight_deg", "furthest member off boresight, mean"),
    ("line_of_sight_max_deg", "furthest member off boresight, at worst"),
    ("out_of_view_fraction", "time of group members in no view"),
    ("out_of_view_longest_s", "longest time of one in no view"),
    ("uncovered_fraction", "time of targets in no group"),
    ("infeasible_fraction", "time without a feasible orbit"),
    ("turn_rate_saturated_fraction", "time with turn rate at its limit"),
    ("separation_min_m", "smallest separation of two UAVs"),
    ("handoffs", "handoffs"),
    ("discards", "discards"),
    ("anees", "consistency of estimates (1 is right)"),
    ("standoff_surprise_m_settled", "standoff surprise, true geometry"),
    ("standoff_tracking_surprise_m_settled", "standoff surprise, own view"),
    ("nis", "consistency of innovations (1 is right)"),
    ("position_bound_ratio", "position error over its bound"),
    ("velocity_bound_ratio", "velocity error over its bound"),
    ("position_squared_error_m2", "position error squared"),
    ("position_bound_m2", "position bound"),
    ("velocity_squared_error_m2_s2", "velocity error squared"),
    ("velocity_bound_m2_s2", "velocity bound"),
];

/// By the end of a metric's name, the longer first: the unit in which it is shown, and the factor into it.
const UNITS: [(&str, &str, f64); 8] = [
    ("_m2_s2", "m\u{b2}/s\u{b2}", 1.0),
    ("_m_s", "m/s", 1.0),
    ("_m2", "m\u{b2}", 1.0),
    ("_deg", "\u{b0}", 1.0),
    ("_fraction", "%", 100.0),
    ("_m", "m", 1.0),
    ("_s", "s", 1.0),
    ("", "", 1.0),
];

impl Metric {
    pub(super) fn of(name: &str) -> Self {
        let plain = name.strip_suffix("_settled").unwrap_or(name);
        let (_, unit, factor) = UNITS.iter().find(|(end, ..)| plain.ends_with(end)).copied().unwrap_or_default();
        let what = WHAT.iter().find(|(known, _)| *known == name).map_or("", |(_, what)| what);
        Self { name: name.to_owned(), what, unit, factor, bad: BadEnd::of(name), pooled: is_pooled(name) }
    }
}

fn is_pooled(name: &str) -> bool {
    Metrics::POOLED.iter().any(|(pooled, ..)| *pooled == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_metric_is_told_in_words() {
        assert_eq!(WHAT.map(|(name, _)| name).to_vec(), Metrics::NAMES);
    }

    #[test]
    fn the_unit_is_the_one_in_the_name() {
        let unit = |name| (Metric::of(name).unit, Metric::of(name).factor);
        assert_eq!(unit("velocity_error_m_s"), ("m/s", 1.0));
        assert_eq!(unit("out_of_view_longest_s"), ("s", 1.0));
        assert_eq!(unit("standoff_error_m_settled"), ("m", 1.0));
        assert_eq!(unit("velocity_bound_m2_s2"), ("m\u{b2}/s\u{b2}", 1.0));
        assert_eq!(unit("uncovered_fraction"), ("%", 100.0));
        assert_eq!(unit("anees"), ("", 1.0));
    }
}
