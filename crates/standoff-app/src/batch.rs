//! Results of a batch: its HTML page, and the table of its statistics.

use std::slice;

use standoff_io::display_text::{WIDTH, count, printable, shell_path};
use standoff_sim::monte_carlo::{Results, Statistics, Summary};
use standoff_view::batch::Batch;
use standoff_view::page;

use crate::error::{Failure, of_batch};
use crate::metric_table::{MetricRow, Shown, in_unit, interval, metric_table, remarks};

/// File name of a batch's page, next to its results.
pub const REPORT: &str = "report.html";

/// Renders the page of a complete batch; returns `None` if the folder has it already.
pub fn batch_page(results: &Results) -> Result<Option<String>, Failure> {
    if results.dir().join(REPORT).is_file() {
        return Ok(None);
    }
    let shown = Batch::of(slice::from_ref(results)).map_err(of_batch)?;
    page::batch_report(&shown).map(Some).map_err(Failure::running)
}

/// Formats the statistics of the main metrics of a batch; of all, if the user selected them.
pub fn batch_text(summary: &Summary, results: &Results) -> String {
    let runs = |runs: u64| count(usize::try_from(runs).unwrap_or(usize::MAX), "run");
    let batch = results.batch();
    let flown = batch.flown();
    let (first, last) = (batch.seed_of(flown.start), batch.seed_of(flown.end - 1));
    let part = summary.shard.map_or_else(String::new, |shard| format!(", shard {shard} of {}", runs(summary.runs)));
    let (scenario, total) = (printable(&summary.scenario), flown.end - flown.start);
    let mut text = format!("{scenario}, {}, seeds {first} to {last}{part}\n", runs(total));
    let shown = Shown::of(&summary.metrics);
    let measured = || summary.metrics.iter().filter(|(_, of)| shown.are_named() || of.n > 0);
    let rows: Vec<_> = measured().filter(|(name, _)| shown.has(name)).map(|(name, of)| row(name, of)).collect();
    text += &metric_table(&[("mean", 8), ("95 % of the mean", 19), ("5 %", 8), ("95 %", 8)], "", &rows, WIDTH);
    let numbers = summary.metrics.iter().filter(|(name, _)| shown.has(name)).map(|(name, of)| (name.as_str(), of.n));
    text += &remarks(numbers, total, measured().count() - rows.len());
    text += "5 %, 95 %: percentiles of the runs\n";
    let (dir, page) = (shell_path(results.dir()), shell_path(&results.dir().join(REPORT)));
    text + &format!(
        "\nresults in {dir}\nnext:\n  open {page}  (plots, and every run)\n  \
         standoff compare {dir} OTHER  (with another batch)\n"
    )
}

fn row<'a>(metric: &'a str, of: &Statistics) -> MetricRow<'a> {
    let [mean, p5, p95] = [of.mean, of.p5, of.p95].map(|value| in_unit(metric, value));
    let cells = vec![mean, interval(metric, of.ci95), p5, p95];
    MetricRow { metric, cells, end: String::new(), remarks: Vec::new() }
}
