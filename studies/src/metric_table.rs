//! Tables of metrics: means of runs, and differences from a reference with the same seeds.

use standoff_score::{MetricSelection, Metrics};

use super::claim::{shown, signed};
use super::statistics::Estimate;
use super::study::Table;
use crate::error::Failure;

/// A column: metric, heading, factor from the unit of the metric to that of the heading.
pub(crate) type Column = (&'static str, &'static str, f64);

/// Selects metrics by their names.
pub(crate) fn select(metrics: &[&str]) -> Result<MetricSelection, Failure> {
    MetricSelection::parse(&metrics.join(",")).map_err(Failure::running)
}

/// Selects the metrics of the columns.
pub(crate) fn select_columns(columns: &[Column]) -> Result<MetricSelection, Failure> {
    select(&columns.iter().map(|(metric, ..)| *metric).collect::<Vec<_>>())
}

/// Creates a table without rows.
pub(crate) fn table(title: impl Into<String>, columns: &[Column]) -> Table {
    Table::new(title, [""].into_iter().chain(columns.iter().map(|(_, heading, _)| *heading)))
}

/// A table of differences from the runs in its first row.
pub(crate) struct Differences<'a> {
    columns: &'a [Column],
    reference: &'a [Metrics],
    pub(crate) table: Table,
}

impl<'a> Differences<'a> {
    /// Creates a table with the means of the reference.
    pub(crate) fn new(title: String, name: &str, columns: &'a [Column], reference: &'a [Metrics]) -> Self {
        let mut table = table(title, columns);
        let means = columns.iter().map(|(metric, _, factor)| Estimate::of(reference, metric).times(*factor));
        table.add(name, means.map(|mean| mean.formatted(shown)));
        Self { columns, reference, table }
    }

    /// Adds a row of the mean differences, paired by seed. Returns its data: for each column, in the unit of the
    /// metric, the mean of the reference, the difference, and half the width of its 95 % interval.
    pub(crate) fn add(&mut self, name: &str, runs: &[Metrics]) -> Vec<f64> {
        let difference = |metric| Estimate::difference(self.reference, runs, metric);
        let cells = self.columns.iter().map(|(metric, _, factor)| difference(metric).times(*factor).formatted(signed));
        self.table.add(name, cells);
        let data = |&(metric, ..): &Column| {
            let difference = difference(metric);
            let half_width = 0.5 * (difference.high - difference.low);
            [Estimate::of(self.reference, metric).value, difference.value, half_width]
        };
        self.columns.iter().flat_map(data).collect()
    }
}

/// Returns the names of the data of [`Differences::add`], each after a comma.
pub(crate) fn data_columns(columns: &[Column], reference: &str) -> String {
    let names = |(metric, ..): &Column| format!(",{metric}_{reference},{metric}_difference,{metric}_half_width");
    columns.iter().map(names).collect()
}
