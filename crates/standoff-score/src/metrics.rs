//! Values of all metrics of a run, and the selection of the metrics to compute.

use std::fmt;
use std::ops::Index;

use serde::ser::{Serialize, SerializeMap, Serializer};
use standoff_io::display_text::{did_you_mean, nearest, quoted};
use standoff_record::ReportedTables;

use crate::families::cramer_rao;
use crate::mean;
use crate::metric::{MetricInfo, MetricSet};

/// Scores of a run by the name of the metric, defined in `docs/user/metrics.md`. A value is `None` if the metric was not
/// selected or if nothing could be measured, for example the phase error of a single UAV.
#[derive(Clone, PartialEq)]
pub struct Metrics(Vec<Option<f64>>);

impl Metrics {
    /// Ratios pooled over runs as the square root of the ratio of two means: ratio, numerator, denominator. Selecting
    /// the ratio selects all three.
    pub const POOLED: [(&'static str, &'static str, &'static str); 2] = cramer_rao::POOLED;

    /// Returns the metrics with these values and no others.
    pub(crate) fn of(values: impl IntoIterator<Item = (&'static str, f64)>) -> Self {
        let mut metrics = Self(vec![None; MetricInfo::all().len()]);
        for (name, value) in values {
            metrics.0[index(name)] = Some(value);
        }
        metrics
    }

    /// Sets the values of some metrics, in the order of [`MetricInfo::all`].
    pub(crate) fn set(&mut self, first: usize, values: &[Option<f64>]) {
        self.0[first..first + values.len()].copy_from_slice(values);
    }

    /// Returns all values, in the order of [`MetricInfo::all`].
    #[must_use]
    pub fn values(&self) -> &[Option<f64>] {
        &self.0
    }

    /// Sets the metrics to `None` that need data the controller does not report.
    pub(crate) fn only_by(mut self, reported: ReportedTables) -> Self {
        for (value, info) in self.0.iter_mut().zip(MetricInfo::all()) {
            *value = value.filter(|_| reported.has(info.needs));
        }
        self
    }

    /// Replaces the metrics of the team state of one agent by the weighted means of `others`.
    pub(crate) fn averaged(mut self, others: &[(Self, u64)]) -> Self {
        for (index, info) in MetricInfo::all().iter().enumerate().filter(|(_, info)| info.is_of_one_agent) {
            let mean = mean::weighted(others.iter().filter_map(|(of, times)| Some((of.0[index]?, *times))));
            self.0[index] = if info.is_count { mean.map(f64::floor) } else { mean };
        }
        self
    }
}

fn index(name: &str) -> usize {
    position(name).unwrap_or_else(|| panic!("no metric is called {name}"))
}

fn position(name: &str) -> Option<usize> {
    MetricInfo::all().iter().position(|info| info.name == name)
}

/// Returns the value of a metric.
///
/// # Panics
///
/// If the name is unknown.
impl Index<&str> for Metrics {
    type Output = Option<f64>;

    fn index(&self, name: &str) -> &Option<f64> {
        &self.0[index(name)]
    }
}

impl fmt::Debug for Metrics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(MetricInfo::all().iter().map(|info| info.name).zip(&self.0)).finish()
    }
}

/// Metrics with a selection; serialised as a map from the selected names to their values.
#[derive(Debug, Clone, PartialEq)]
pub struct SelectedMetrics {
    /// Values of the metrics.
    pub metrics: Metrics,
    /// Metrics that were selected.
    pub choice: MetricSelection,
}

impl SelectedMetrics {
    /// Returns the value of a selected metric; the inner value is `None` if nothing was measured.
    pub fn get(&self, name: &str) -> Option<Option<f64>> {
        let index = position(name)?;
        self.choice.has(index).then(|| self.metrics.0[index])
    }
}

impl Serialize for SelectedMetrics {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (index, (info, value)) in MetricInfo::all().iter().zip(&self.metrics.0).enumerate() {
            if !self.choice.has(index) {
                continue;
            }
            if info.is_count {
                map.serialize_entry(info.name, &value.map(|count| count as u64))?;
            } else {
                map.serialize_entry(info.name, value)?;
            }
        }
        map.end()
    }
}

/// Selection of metrics; metrics that are not selected are not computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MetricSelection(u128);

/// Columns of Table II.
const TABLE_2: &[&str] = &[
    "position_error_m",
    "velocity_error_m_s",
    "standoff_error_m",
    "standoff_error_own_estimate_m",
    "phase_error_deg",
    "off_boresight_mean_deg",
];

impl MetricSelection {
    /// All metrics.
    #[must_use]
    pub fn all() -> Self {
        Self::of(|_| true)
    }

    /// Default selection: all metrics except the comparisons with limits and those of the association.
    #[must_use]
    pub fn standard() -> Self {
        Self::of(|info| matches!(info.set, MetricSet::Standard | MetricSet::Agents))
    }

    /// Parses a comma-separated list of metric names and sets (`standard`, `limits`, `association`, `table-2`,
    /// `all`).
    pub fn parse(list: &str) -> Result<Self, String> {
        let mut choice = Self(0);
        for word in list.split(',').map(str::trim).filter(|word| !word.is_empty()) {
            choice.0 |= match word {
                "all" => Self::all().0,
                "standard" => Self::standard().0,
                "limits" => Self::of(|info| info.set == MetricSet::Limits).0,
                "association" => Self::of(|info| info.set == MetricSet::Association).0,
                "table-2" => Self::of_names(TABLE_2).0,
                name if position(name).is_none() => return Err(unknown(name)),
                name => Self::of_names(&[name]).0,
            };
        }
        for (ratio, numerator, denominator) in Metrics::POOLED {
            if choice.has(index(ratio)) {
                choice.0 |= Self::of_names(&[numerator, denominator]).0;
            }
        }
        if choice.0 == 0 { Err("must name at least one metric".to_owned()) } else { Ok(choice) }
    }

    /// True if tables of results show this metric. The default selection shows only the main metrics.
    #[must_use]
    pub fn shows(self, info: &MetricInfo) -> bool {
        position(info.name).is_some_and(|index| self.has(index)) && (self != Self::standard() || info.is_main())
    }

    /// Returns the selected names, in the order of [`MetricInfo::all`].
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        MetricInfo::all().iter().enumerate().filter(move |(index, _)| self.has(*index)).map(|(_, info)| info.name)
    }

    /// Returns the selected metrics that depend on tracks or groups: each of several agents has its own values.
    pub(crate) fn of_team_states(self) -> Self {
        Self(self.0 & Self::of(|info| info.is_of_one_agent).0)
    }

    /// True if nothing is selected.
    pub(crate) fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// True if the metric at this index of [`MetricInfo::all`] is selected.
    pub(crate) fn has(self, index: usize) -> bool {
        self.0 & (1 << index) != 0
    }

    fn of(is_selected: impl Fn(&MetricInfo) -> bool) -> Self {
        let bits =
            MetricInfo::all().iter().enumerate().filter(|(_, info)| is_selected(info)).map(|(index, _)| 1 << index);
        Self(bits.fold(0, |bits, bit: u128| bits | bit))
    }

    fn of_names(names: &[&str]) -> Self {
        Self::of(|info| names.contains(&info.name))
    }
}

/// Describes an unknown name.
fn unknown(name: &str) -> String {
    let names: Vec<&str> = MetricInfo::all().iter().map(|info| info.name).collect();
    let advice = match nearest(name, &names) {
        Some(near) => did_you_mean(near),
        None => format!("allowed: standard, limits, association, table-2, all, {}", names.join(", ")),
    };
    format!("{}: no such metric; {advice}", quoted(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(list: &str) -> Vec<&'static str> {
        MetricSelection::parse(list).unwrap().names().collect()
    }

    #[test]
    fn parsed_selection_is_in_the_order_of_the_metrics() {
        let all: Vec<&str> = MetricInfo::all().iter().map(|info| info.name).collect();
        assert_eq!(names("anees, position_error_m"), ["position_error_m", "anees"]);
        assert_eq!(names("all"), all);
        assert!(names("table-2,handoffs").contains(&"phase_error_deg"));
        assert_eq!(names("standard,limits,association"), all);
        assert_eq!(names("association").len(), 8);
        assert!(!names("standard").contains(&"nis"));
        assert!(MetricSelection::parse("speed").unwrap_err().contains("no such metric"));
        assert!(MetricSelection::parse("").is_err());
    }

    /// A pooled ratio also selects its numerator and denominator, and Table II contains only known metrics.
    #[test]
    fn pooled_ratio_selects_its_numerator_and_denominator() {
        for (ratio, numerator, denominator) in Metrics::POOLED {
            assert_eq!(names(ratio), [ratio, numerator, denominator]);
        }
        assert_eq!(names("table-2").len(), TABLE_2.len());
    }

    /// A selection has one bit for each metric, and each name is unique.
    #[test]
    fn metrics_have_unique_names_and_fit_a_selection() {
        let mut all: Vec<&str> = MetricInfo::all().iter().map(|info| info.name).collect();
        assert!(all.len() < u128::BITS as usize);
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count);
    }
}
