//! What a metric is, for people. `docs/metrics.md` defines each.

use serde::Serialize;
use standoff_sim::score::{About, BadEnd, Metrics};

use super::histogram::Histogram;

/// A metric that any batch has, as the page names it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Metric {
    name: String,
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
    /// Of all batches, on the same classes; of none if there is nothing to count.
    histogram: Option<Histogram>,
}

impl Metric {
    pub(super) fn of(name: &str, histogram: Option<Histogram>) -> Self {
        let ((unit, factor), about) = (About::unit(name), About::of(name));
        let (what, bad) = about.map_or(("", None), |about| (about.words, about.bad));
        let pooled = Metrics::POOLED.iter().any(|(pooled, ..)| *pooled == name);
        Self { name: name.to_owned(), what, unit, factor, bad, pooled, histogram }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_is_the_one_in_the_name() {
        let unit = |name| (Metric::of(name, None).unit, Metric::of(name, None).factor);
        assert_eq!(unit("velocity_error_m_s"), ("m/s", 1.0));
        assert_eq!(unit("out_of_view_longest_s"), ("s", 1.0));
        assert_eq!(unit("standoff_error_m_settled"), ("m", 1.0));
        assert_eq!(unit("velocity_bound_m2_s2"), ("m\u{b2}/s\u{b2}", 1.0));
        assert_eq!(unit("uncovered_fraction"), ("%", 100.0));
        assert_eq!(unit("turn_reversals_per_min"), ("1/min", 1.0));
        assert_eq!(unit("anees"), ("", 1.0));
    }
}
