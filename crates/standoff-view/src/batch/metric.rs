//! Descriptions of metrics for the page. `docs/user/metrics.md` defines each metric.

use serde::Serialize;
use standoff_score::{MetricInfo, Metrics, WorseDirection};

use super::histogram::Histogram;

/// Description of a metric that at least one batch has.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Metric {
    name: String,
    /// Short description; empty for an unknown metric.
    what: &'static str,
    /// Unit of the shown values.
    unit: &'static str,
    /// Factor that converts a value to `unit`.
    factor: f64,
    /// Whether small or large values are bad, if known.
    bad: Option<WorseDirection>,
    /// True if its mean is computed from sums over all runs instead of the values of the runs.
    pooled: bool,
    /// Histogram of all batches with common classes; `None` if there are no values.
    histogram: Option<Histogram>,
}

impl Metric {
    pub(super) fn of(name: &str, histogram: Option<Histogram>) -> Self {
        let ((unit, factor), about) = (MetricInfo::unit(name), MetricInfo::of(name));
        let (what, bad) = about.map_or(("", None), |about| (about.label, about.worse));
        let pooled = Metrics::POOLED.iter().any(|(pooled, ..)| *pooled == name);
        Self { name: name.to_owned(), what, unit, factor, bad, pooled, histogram }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_is_derived_from_the_name() {
        let unit = |name| (Metric::of(name, None).unit, Metric::of(name, None).factor);
        assert_eq!(unit("velocity_error_m_s"), ("m/s", 1.0));
        assert_eq!(unit("member_longest_out_of_view_s"), ("s", 1.0));
        assert_eq!(unit("standoff_error_m_settled"), ("m", 1.0));
        assert_eq!(unit("velocity_crlb_m2_s2"), ("m\u{b2}/s\u{b2}", 1.0));
        assert_eq!(unit("ungrouped_fraction"), ("%", 100.0));
        assert_eq!(unit("turn_reversals_per_min"), ("1/min", 1.0));
        assert_eq!(unit("anees"), ("", 1.0));
    }
}
