//! Metrics of runs, batches and comparisons as tables with one row per metric.

use pyo3::prelude::*;
use standoff_app::{PerTarget, Verdict};
use standoff_score::{MetricInfo, SelectedMetrics};
use standoff_sim::monte_carlo::{Comparison, Summary};

use crate::table::{Column, Table};

/// Makes a table of metrics: name, label and unit, then `more`.
fn table<'a>(names: impl Iterator<Item = &'a str>, more: Vec<(&str, Column)>) -> PyResult<Table> {
    let names: Vec<&str> = names.collect();
    let text = |of: fn(&str) -> &str| Column::Text(names.iter().map(|name| Some(of(name).to_owned())).collect());
    let mut columns = vec![
        ("metric", text(|name| name)),
        ("label", text(|name| MetricInfo::of(name).map_or("", |info| info.label))),
        ("unit", text(unit)),
    ];
    columns.extend(more);
    Table::in_memory("metrics", columns)
}

/// Unit of the stored values: fractions are 0 to 1, not percent.
fn unit(name: &str) -> &'static str {
    match MetricInfo::unit(name) {
        ("", _) | ("%", _) => "1",
        (unit, _) => unit,
    }
}

/// Makes the column of a number of each metric.
fn numbers<T>(metrics: &[(String, T)], value: impl Fn(&T) -> Option<f64>) -> Column {
    Column::Float(metrics.iter().map(|(_, statistics)| value(statistics)).collect())
}

/// Table of the metrics of a run.
pub(crate) fn of_run(metrics: &SelectedMetrics) -> PyResult<Table> {
    let names = || metrics.choice.names();
    let values = names().map(|name| metrics.get(name).flatten()).collect();
    table(names(), vec![("value", Column::Float(values))])
}

/// Table of the statistics of a batch.
pub(crate) fn of_batch(summary: &Summary) -> PyResult<Table> {
    let metrics = &summary.metrics;
    let runs = metrics.iter().map(|(_, statistics)| i64::try_from(statistics.n).ok()).collect();
    let columns = vec![
        ("n", Column::Integer(runs)),
        ("mean", numbers(metrics, |s| s.mean)),
        ("ci95_low", numbers(metrics, |s| s.ci95.map(|[low, _]| low))),
        ("ci95_high", numbers(metrics, |s| s.ci95.map(|[_, high]| high))),
        ("sd", numbers(metrics, |s| s.sd)),
        ("p5", numbers(metrics, |s| s.p5)),
        ("p50", numbers(metrics, |s| s.p50)),
        ("p95", numbers(metrics, |s| s.p95)),
        ("max", numbers(metrics, |s| s.max)),
    ];
    table(metrics.iter().map(|(name, _)| name.as_str()), columns)
}

/// Table of the differences of a comparison, with the verdicts of `standoff compare`.
pub(crate) fn of_comparison(comparison: &Comparison) -> PyResult<Table> {
    let metrics = &comparison.metrics;
    let runs = metrics.iter().map(|(_, paired)| i64::try_from(paired.n).ok()).collect();
    let verdicts = metrics.iter().map(|(_, paired)| Some(Verdict::of(paired).text().to_owned())).collect();
    let columns = vec![
        ("n", Column::Integer(runs)),
        ("mean_a", numbers(metrics, |paired| paired.mean_a)),
        ("mean_b", numbers(metrics, |paired| paired.mean_b)),
        ("difference", numbers(metrics, |paired| paired.difference)),
        ("ci95_low", numbers(metrics, |paired| paired.ci95.map(|[low, _]| low))),
        ("ci95_high", numbers(metrics, |paired| paired.ci95.map(|[_, high]| high))),
        ("b_smaller", numbers(metrics, |paired| paired.b_smaller)),
        ("interest", numbers(metrics, |paired| Some(paired.interest))),
        ("verdict", Column::Text(verdicts)),
    ];
    table(metrics.iter().map(|(name, _)| name.as_str()), columns)
}

/// Table of the scores of each target.
pub(crate) fn of_targets(targets: &[PerTarget]) -> PyResult<Table> {
    let scores = |value: fn(&PerTarget) -> Option<f64>| Column::Float(targets.iter().map(value).collect());
    let ids = targets.iter().map(|one| Some(i64::from(one.score.target))).collect();
    let columns = vec![
        ("target", Column::Integer(ids)),
        ("name", Column::Text(targets.iter().map(|one| Some(one.target.clone())).collect())),
        ("until_s", scores(|one| Some(one.score.until_s))),
        ("manoeuvres", Column::Boolean(targets.iter().map(|one| Some(one.score.manoeuvres)).collect())),
        ("custody_fraction", scores(|one| one.score.custody_fraction)),
        ("in_view_fraction", scores(|one| one.score.in_view_fraction)),
        ("longest_out_of_view_s", scores(|one| one.score.longest_out_of_view_s)),
        ("position_error_m", scores(|one| one.score.position_error_m)),
        ("anees", scores(|one| one.score.anees)),
    ];
    Table::in_memory("targets", columns)
}
