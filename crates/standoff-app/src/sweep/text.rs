//! Results of a sweep as text for a terminal of 100 columns.

use std::path::Path;

use standoff_io::display_text::{self, WIDTH, count, wrapped};
use standoff_score::MetricInfo;

use super::results::{SWEEP_TABLE, SweepResults};
use crate::batch::REPORT;
use crate::metric_table::{in_unit, interval};

/// Metrics that are printed if the user selects none; the table contains all.
const PRINTED: [&str; 3] = ["custody_fraction", "position_error_m", "standoff_error_on_orbit_m"];

/// Column of a table: its cells, the first of which is the heading.
struct Column {
    cells: Vec<String>,
    /// Minimum width.
    width: usize,
    /// True for text, which is aligned to the left.
    is_text: bool,
}

impl Column {
    fn of(heading: &str, width: usize, is_text: bool, cells: impl Iterator<Item = String>) -> Self {
        Self { cells: std::iter::once(heading.to_owned()).chain(cells).collect(), width, is_text }
    }

    /// Width of the widest cell, or the minimum width.
    fn width(&self) -> usize {
        self.cells.iter().map(|cell| cell.chars().count()).fold(self.width, usize::max)
    }
}

impl SweepResults {
    /// Formats the mean of each point and its difference from the first point, with their intervals: of all metrics, or of
    /// the most important ones.
    pub fn text(&self, all_metrics: bool, dir: &Path) -> String {
        let mut text = self.heading();
        let metrics = &self.sweep.metrics;
        let is_shown = |name: &str| all_metrics || PRINTED.contains(&name);
        let fallback = !metrics.iter().any(|name| is_shown(name));
        let mut left_out = 0;
        for (index, name) in metrics.iter().enumerate() {
            if !is_shown(name) && !fallback || self.points.iter().all(|point| point.metrics[index].1.n == 0) {
                left_out += 1;
                continue;
            }
            let unit = MetricInfo::unit(name).0;
            let label = MetricInfo::of(name).map_or(name.as_str(), |info| info.label);
            let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
            text += &format!("\n{label}{unit}\n{}", self.metric_table(index));
        }
        if left_out > 0 {
            text += &format!(
                "\n{} not shown: see {SWEEP_TABLE}, or select metrics with --metrics\n",
                count(left_out, "metric")
            );
        }
        let (dir, page) = (display_text::shell_path(dir), display_text::shell_path(&dir.join(REPORT)));
        text + &format!("\nresults in {dir}\nnext:\n  open {page}\n")
    }

    /// Describes the sweep and the reference of the differences.
    fn heading(&self) -> String {
        let (seed, runs, size) = (self.sweep.seed, self.sweep.runs, self.sweep.size());
        let (points, last) = (count(size, "point"), seed + runs - 1);
        let each = count(usize::try_from(runs).unwrap_or(usize::MAX), "run");
        let scenario = display_text::printable(&self.sweep.scenario);
        let text = format!("{scenario}, {points} with {each} each, seeds {seed} to {last}\n");
        if size == 1 {
            return text;
        }
        let first = display_text::printable(&self.sweep.changes(0).join(", "));
        text + &wrapped("", &format!("differences from {first}, paired by seed"), WIDTH)
    }

    /// Formats the statistics of a metric at each point. Differences that do not fit are left out: their intervals first.
    fn metric_table(&self, metric: usize) -> String {
        let name = self.sweep.metrics[metric].as_str();
        let statistics = || self.points.iter().map(|point| point.metrics[metric].1);
        let mut columns: Vec<Column> = (0..self.sweep.keys.len())
            .map(|key| {
                let values = self.sweep.points.iter().map(|point| point[key].clone());
                Column::of(&self.sweep.keys[key], 0, false, values)
            })
            .collect();
        columns.push(Column::of("n", 5, false, statistics().map(|of| of.n.to_string())));
        columns.push(Column::of("mean", 8, false, statistics().map(|of| in_unit(name, of.mean))));
        columns.push(Column::of("95 % interval", 0, true, statistics().map(|of| interval(name, of.ci95))));
        if self.points.len() > 1 {
            let differences = || self.differences[0].iter().skip(1).map(|point| &point[metric]);
            let column = |heading: &str, is_text, reference: &str, cells: &mut dyn Iterator<Item = String>| {
                Column::of(heading, 0, is_text, std::iter::once(reference.to_owned()).chain(cells))
            };
            let mut means = differences().map(|(_, mean, ..)| in_unit(name, *mean));
            let mut intervals = differences().map(|(_, _, ci95, _)| interval(name, *ci95));
            let mut verdicts = differences().map(|(.., verdict)| (*verdict).to_owned());
            let difference = column("difference", false, "-", &mut means);
            let verdict = column("verdict", true, "reference", &mut verdicts);
            let ci95 = column("95 % interval", true, "-", &mut intervals);
            let used = width(&columns);
            let fits = |more: &[&Column]| used + more.iter().map(|column| column.width() + 2).sum::<usize>() <= WIDTH;
            if fits(&[&difference, &ci95, &verdict]) {
                columns.extend([difference, ci95, verdict]);
            } else if fits(&[&difference, &verdict]) {
                columns.extend([difference, verdict]);
            }
        }
        table(&columns)
    }
}

/// Width of a table.
fn width(columns: &[Column]) -> usize {
    columns.iter().map(|column| column.width() + 2).sum()
}

/// Formats a table with two spaces before each column.
fn table(columns: &[Column]) -> String {
    let row = |index: usize| {
        let cells = columns.iter().map(|column| {
            let (cell, width) = (&column.cells[index], column.width());
            if column.is_text { format!("  {cell:<width$}") } else { format!("  {cell:>width$}") }
        });
        cells.collect::<String>().trim_end().to_owned() + "\n"
    };
    (0..columns[0].cells.len()).map(row).collect()
}
