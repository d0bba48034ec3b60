//! Declaration of metrics in families. A family is one accumulator that yields several metrics.

#[cfg(test)]
use std::borrow::Borrow;
use std::fmt::Debug;

#[cfg(test)]
use standoff_record::Frame;
use standoff_record::ReportedTables;

use crate::config::ScoreConfig;
use crate::per_target::PerTarget;
#[cfg(test)]
use crate::step::Steps;
use crate::step::{Inputs, Step};

/// Worse direction of a metric.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum WorseDirection {
    /// Smaller values are worse.
    Small,
    /// Larger values are worse.
    Large,
}

/// Set of metrics that are selected together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MetricSet {
    /// Computed by default.
    Standard,
    /// Computed by default; compare several agents, and are `None` if one agent acts for the whole team.
    Agents,
    /// Compare a run with theoretical limits. They take longer than most and are computed on request only.
    Limits,
    /// Concern sensors that do not detect every target or report no identities; computed on request only.
    Association,
}

/// Label and comparison settings of a metric; `docs/user/metrics.md` has the definitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MetricInfo {
    /// Name of the metric.
    pub name: &'static str,
    /// Section of the results table that shows the metric.
    pub section: &'static str,
    /// Short label for users.
    pub label: &'static str,
    /// True if the values of single runs are whole numbers.
    pub is_count: bool,
    /// Worse direction of the metric, `None` if it has no preferred one: a consistent filter has an `anees` of 1, and
    /// fewer handoffs may be good or bad.
    pub worse: Option<WorseDirection>,
    /// Smallest difference of practical interest, in the metric's unit: designs that differ by less are equivalent,
    /// even if the difference is statistically significant.
    pub interest: f64,
    /// Set that contains the metric.
    pub set: MetricSet,
    /// Tables that the controller must report; without them, the value is `None`.
    pub(crate) needs: ReportedTables,
    /// True if each of several agents has its own value, so that the metric is their mean.
    pub(crate) is_of_one_agent: bool,
}

/// Display unit and conversion factor by suffix of the metric name; longer suffixes come first.
const UNITS: [(&str, &str, f64); 10] = [
    ("_per_s", "B/s", 1.0),
    ("_m2_s2", "m\u{b2}/s\u{b2}", 1.0),
    ("_m_s", "m/s", 1.0),
    ("_m2", "m\u{b2}", 1.0),
    ("_deg", "\u{b0}", 1.0),
    ("_fraction", "%", 100.0),
    ("_min", "1/min", 1.0),
    ("_m", "m", 1.0),
    ("_s", "s", 1.0),
    ("", "", 1.0),
];

/// Metrics that tables of results show if the user selects none.
const MAIN: [&str; 12] = [
    "custody_fraction",
    "priority_custody_fraction",
    "in_view_fraction",
    "longest_out_of_view_s",
    "off_boresight_max_deg",
    "position_error_m",
    "anees",
    "standoff_error_on_orbit_m",
    "phase_error_deg",
    "infeasible_fraction",
    "separation_min_same_altitude_m",
    "zone_violations",
];

impl MetricInfo {
    /// True for the few metrics that tables of results show if the user selects none.
    #[must_use]
    pub fn is_main(&self) -> bool {
        MAIN.contains(&self.name)
    }

    /// Returns the worse direction in a comparison. Too little separation is dangerous, but more than necessary is not
    /// better.
    #[must_use]
    pub fn rated(&self) -> Option<WorseDirection> {
        self.worse.filter(|_| !self.name.starts_with("separation_"))
    }

    /// Returns the display unit of a metric and the factor that converts its value to that unit. Fractions are shown in
    /// percent.
    #[must_use]
    pub fn unit(metric: &str) -> (&'static str, f64) {
        let plain = metric.trim_end_matches("_settled").trim_end_matches("_max");
        let (_, unit, factor) = UNITS.iter().find(|(end, ..)| plain.ends_with(end)).copied().unwrap_or_default();
        (unit, factor)
    }
}

pub(crate) const SMALL: Option<WorseDirection> = Some(WorseDirection::Small);
pub(crate) const LARGE: Option<WorseDirection> = Some(WorseDirection::Large);
pub(crate) const NEITHER: Option<WorseDirection> = None;

// Tables that the controller has to report for a metric to be computed.
pub(crate) const NOTHING: ReportedTables = ReportedTables::NOTHING;
pub(crate) const TRACKS: ReportedTables = ReportedTables { tracks: true, ..NOTHING };
pub(crate) const GROUPS: ReportedTables = ReportedTables { groups: true, ..NOTHING };
pub(crate) const BOTH: ReportedTables = ReportedTables { tracks: true, groups: true, ..NOTHING };
pub(crate) const EVENTS: ReportedTables = ReportedTables { events: true, ..NOTHING };

/// What values depend on besides their family.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run<'a> {
    pub(crate) config: &'a ScoreConfig,
    /// Empty unless an input of a family.
    pub(crate) targets: &'a PerTarget,
}

/// Computes a value of a family; `None` if nothing was measured.
type Value<F> = fn(&F, &Run<'_>) -> Option<f64>;

/// Metric of a family `F`; the family determines section and set.
#[derive(Debug)]
pub(crate) struct Metric<F> {
    info: MetricInfo,
    value: Value<F>,
}

/// Declares a metric. Those of tracks and groups depend on the team state of one agent.
pub(crate) const fn metric<F>(
    name: &'static str,
    label: &'static str,
    worse: Option<WorseDirection>,
    interest: f64,
    needs: ReportedTables,
    value: Value<F>,
) -> Metric<F> {
    let (section, set, is_of_one_agent) = ("", MetricSet::Standard, needs.tracks || needs.groups);
    let info = MetricInfo { name, section, label, is_count: false, worse, interest, set, needs, is_of_one_agent };
    Metric { info, value }
}

/// Declares that the values of single runs are whole numbers.
pub(crate) const fn count<F>(mut metric: Metric<F>) -> Metric<F> {
    metric.info.is_count = true;
    metric
}

/// Declares that a metric is computed for all agents together.
pub(crate) const fn of_all_agents<F>(mut metric: Metric<F>) -> Metric<F> {
    metric.info.is_of_one_agent = false;
    metric
}

/// Accumulator of the metrics of a family; the default is without data.
pub(crate) trait Family: Default + Debug + Send + 'static {
    /// Section of the results table.
    const SECTION: &'static str;
    const SET: MetricSet = MetricSet::Standard;
    /// Metrics in the order of the results table.
    const METRICS: &'static [Metric<Self>];

    /// Returns the inputs of the selected metrics.
    fn inputs(_selected: &[&str]) -> Inputs {
        Inputs::default()
    }

    /// Adds the next time step. Values that were not selected may be `None`.
    fn add(&mut self, step: &Step<'_>);
}

/// Accumulator of any family.
pub(crate) trait AnyFamily: Debug + Send {
    /// Returns the metrics, in the order of the values.
    fn metrics(&self) -> Vec<MetricInfo>;
    /// Returns the inputs of the selected metrics.
    fn inputs_of(&self, selected: &[&str]) -> Inputs;
    /// Adds the next time step.
    fn add_step(&mut self, step: &Step<'_>);
    /// Returns the values so far.
    fn values(&self, run: &Run<'_>) -> Vec<Option<f64>>;
}

impl<F: Family> AnyFamily for F {
    fn metrics(&self) -> Vec<MetricInfo> {
        F::METRICS.iter().map(|metric| MetricInfo { section: F::SECTION, set: F::SET, ..metric.info }).collect()
    }

    fn inputs_of(&self, selected: &[&str]) -> Inputs {
        F::inputs(selected)
    }

    fn add_step(&mut self, step: &Step<'_>) {
        self.add(step);
    }

    fn values(&self, run: &Run<'_>) -> Vec<Option<f64>> {
        F::METRICS.iter().map(|metric| (metric.value)(self, run)).collect()
    }
}

/// Accumulates these frames, for tests of a family.
#[cfg(test)]
pub(crate) fn accumulated<F: Family>(config: &ScoreConfig, frames: impl IntoIterator<Item: Borrow<Frame>>) -> F {
    let all: Vec<&str> = F::METRICS.iter().map(|metric| metric.info.name).collect();
    let (mut family, mut steps) = (F::default(), Steps::new(config, F::inputs(&all)));
    frames.into_iter().for_each(|frame| steps.next(config, frame.borrow(), |step| family.add(step)));
    family
}
