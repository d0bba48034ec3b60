//! Data of the page of a sweep: the statistics of each point, and paired differences between points. `page/sweep.js` draws them.

use serde::Serialize;
use standoff_score::MetricInfo;

/// Page data of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepPage {
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the first run of each point, as text: JavaScript rounds large numbers.
    pub seed: String,
    /// Number of runs of each point.
    pub runs: u64,
    /// Swept keys.
    pub keys: Vec<String>,
    /// True for a grid, false for a Latin hypercube.
    pub is_grid: bool,
    /// Metrics, in the order of the statistics.
    pub metrics: Vec<SweepMetric>,
    /// Points, in order.
    pub points: Vec<SweepPoint>,
    /// Differences by reference point, point and metric. The references are the first points: all or one.
    pub differences: Vec<Vec<Vec<Difference>>>,
}

/// Number of runs in which a point and the reference have a value, mean of the point minus the reference with its paired
/// 95 % interval, and the verdict on the point.
pub type Difference = (u64, Option<f64>, Option<[f64; 2]>, &'static str);

/// Description of a metric.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepMetric {
    name: String,
    /// Short description; the name for an unknown metric.
    label: String,
    /// Unit of the shown values.
    unit: &'static str,
    /// Factor that converts a value to `unit`.
    factor: f64,
    /// True for the main metrics, which have a small plot.
    is_main: bool,
}

impl SweepMetric {
    /// Returns the description of the metric with this name.
    pub fn of(name: &str) -> Self {
        let (unit, factor) = MetricInfo::unit(name);
        let info = MetricInfo::of(name);
        let label = info.map_or(name, |info| info.label).to_owned();
        Self { name: name.to_owned(), label, unit, factor, is_main: info.is_some_and(MetricInfo::is_main) }
    }
}

/// A point of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepPoint {
    /// Values of the keys, as TOML text.
    pub values: Vec<String>,
    /// Number of runs with a value, mean and 95 % interval of each metric.
    pub statistics: Vec<(u64, Option<f64>, Option<[f64; 2]>)>,
}
