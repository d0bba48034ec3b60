//! Results of a sweep: the statistics of each point as a table, as text, as JSON and on a page.

use std::path::Path;

use serde::Serialize;
use serde_json::{Map, Value};
use standoff_io::atomic_file::{self, PARTIAL};
use standoff_io::display_text::{self, count};
use standoff_record::RecordError;
use standoff_record::column::{self, Columns, Declaration, Field, Part, Row};
use standoff_record::table::TableWriter;
use standoff_score::MetricInfo;
use standoff_sim::monte_carlo::{Results, Statistics, Summary};
use standoff_view::page;
use standoff_view::sweep::{SweepMetric, SweepPage, SweepPoint};

use super::definition::Sweep;
use crate::batch::REPORT;
use crate::error::{Failure, of_batch};
use crate::metric_table::{in_unit, interval};

/// File name of the table of a sweep.
pub const SWEEP_TABLE: &str = "sweep.parquet";

/// Metrics that are printed if the user selects none; the table contains all.
const PRINTED: [&str; 3] = ["custody_fraction", "position_error_m", "standoff_error_on_orbit_m"];

/// Statistics of every point of a sweep.
#[derive(Debug, Clone)]
pub struct SweepResults {
    sweep: Sweep,
    /// Statistics of each point.
    points: Vec<Summary>,
}

impl SweepResults {
    /// Computes the statistics of the points, whose batches are complete. Fails if they are not those of the sweep.
    pub fn of(sweep: &Sweep, results: &[Results]) -> Result<Self, Failure> {
        for results in results {
            let batch = results.batch();
            let is_same = batch.flown() == (0..sweep.runs) && batch.seed_of(0) == sweep.seed;
            if !is_same || !batch.metrics().eq(sweep.metrics.iter().map(String::as_str)) {
                let dir = display_text::path(results.dir());
                return Err(Failure::Input(format!("{dir}: its runs or metrics are not those of the sweep")));
            }
        }
        let points = results.iter().map(|results| results.summary().map_err(of_batch));
        Ok(Self { sweep: sweep.clone(), points: points.collect::<Result<_, _>>()? })
    }

    /// Opens the complete sweep in `dir`.
    pub fn open(dir: &Path) -> Result<Self, Failure> {
        let sweep = Sweep::open(dir)?;
        let results = (0..sweep.size()).map(|point| Results::open(&dir.join(sweep.point_dir(point))).map_err(of_batch));
        Self::of(&sweep, &results.collect::<Result<Vec<_>, _>>()?)
    }

    /// Writes the table and the page.
    pub fn save(self, dir: &Path) -> Result<Self, Failure> {
        let page = page::sweep_report(&self.page()).map_err(Failure::running)?;
        self.save_table(dir).map_err(Failure::running)?;
        let path = dir.join(REPORT);
        atomic_file::save(&path, page).map_err(|reason| Failure::running(RecordError::write(&path, reason)))?;
        Ok(self)
    }

    /// Definition of the sweep.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    fn save_table(&self, dir: &Path) -> Result<(), RecordError> {
        let path = dir.join(SWEEP_TABLE);
        let mut table = TableWriter::with_columns(atomic_file::sibling(&path, PARTIAL), self.columns())?;
        for (index, (values, summary)) in self.sweep.points.iter().zip(&self.points).enumerate() {
            let statistics = summary.metrics.iter().flat_map(|(_, of)| {
                let [low, high] = of.ci95.map_or([None, None], |ends| ends.map(Some));
                [of.mean, low, high, of.sd]
            });
            let texts = values.iter().map(|value| value.trim_matches('"').to_owned());
            table.push(&mut [PointRow {
                point: index as i64,
                texts: texts.collect(),
                numbers: values.iter().map(|value| value.parse().ok()).chain(statistics).collect(),
                runs: summary.metrics.iter().map(|(_, of)| of.n as i64).collect(),
            }])?;
        }
        table.finish()?;
        atomic_file::publish(&path).map_err(|reason| RecordError::write(&path, reason))
    }

    /// True if all values of a key are numbers.
    fn is_number(&self, key: usize) -> bool {
        self.sweep.points.iter().all(|point| point[key].parse().is_ok_and(f64::is_finite))
    }

    fn columns(&self) -> Columns<PointRow> {
        let mut columns = column::columns();
        let keys = self.sweep.keys.len();
        for (index, key) in self.sweep.keys.iter().enumerate() {
            let declaration = Declaration::new(key.clone(), "");
            if self.is_number(index) {
                Option::declare(declaration, &mut columns, move |row: &mut PointRow| &mut row.numbers[index]);
            } else {
                String::declare(declaration, &mut columns, move |row: &mut PointRow| &mut row.texts[index]);
            }
        }
        for (metric, name) in self.sweep.metrics.iter().enumerate() {
            for (statistic, suffix) in ["", "_ci95_low", "_ci95_high", "_sd"].into_iter().enumerate() {
                let index = keys + 4 * metric + statistic;
                let declaration = Declaration::new(format!("{name}{suffix}"), "");
                Option::declare(declaration, &mut columns, move |row: &mut PointRow| &mut row.numbers[index]);
            }
            let declaration = Declaration::new(format!("{name}_n"), "");
            i64::declare(declaration, &mut columns, move |row: &mut PointRow| &mut row.runs[metric]);
        }
        columns
    }

    fn page(&self) -> SweepPage {
        let Sweep { scenario, seed, runs, keys, latin_hypercube, .. } = &self.sweep;
        SweepPage {
            scenario: scenario.clone(),
            seed: seed.to_string(),
            runs: *runs,
            keys: keys.clone(),
            is_grid: latin_hypercube.is_none(),
            metrics: self.sweep.metrics.iter().map(|name| SweepMetric::of(name)).collect(),
            points: self
                .sweep
                .points
                .iter()
                .zip(&self.points)
                .map(|(values, summary)| SweepPoint {
                    values: values.clone(),
                    statistics: summary.metrics.iter().map(|(_, of)| (of.n, of.mean, of.ci95)).collect(),
                })
                .collect(),
        }
    }

    /// Returns the definition with the statistics of every point as one JSON object and a newline.
    pub fn json(&self) -> Result<String, Failure> {
        #[derive(Serialize)]
        struct Point {
            values: Map<String, Value>,
            metrics: Map<String, Value>,
        }
        #[derive(Serialize)]
        struct Whole<'a> {
            scenario: &'a str,
            seed: u64,
            runs: u64,
            points: Vec<Point>,
        }
        let Sweep { scenario, seed, runs, .. } = &self.sweep;
        let point = |(values, summary): (&Vec<String>, &Summary)| -> serde_json::Result<Point> {
            let value = |text: &String| match text.parse::<f64>() {
                // Whole numbers stay whole.
                Ok(number) => text.parse::<i64>().map_or_else(|_| number.into(), Value::from),
                Err(_) => text.trim_matches('"').into(),
            };
            let statistics = |(name, of): &(String, Statistics)| Ok((name.clone(), serde_json::to_value(of)?));
            Ok(Point {
                values: self.sweep.keys.iter().cloned().zip(values.iter().map(value)).collect(),
                metrics: summary.metrics.iter().map(statistics).collect::<serde_json::Result<_>>()?,
            })
        };
        let points = self.sweep.points.iter().zip(&self.points).map(point).collect::<Result<_, _>>();
        let whole = Whole { scenario, seed: *seed, runs: *runs, points: points.map_err(Failure::running)? };
        Ok(serde_json::to_string_pretty(&whole).map_err(Failure::running)? + "\n")
    }

    /// Formats the mean and the interval of each point: of all metrics, or of the most important ones.
    pub fn text(&self, all_metrics: bool, dir: &Path) -> String {
        let Sweep { scenario, seed, runs, keys, points, metrics, .. } = &self.sweep;
        let (size, last) = (count(points.len(), "point"), seed + runs - 1);
        let each = count(usize::try_from(*runs).unwrap_or(usize::MAX), "run");
        let scenario = display_text::printable(scenario);
        let mut text = format!("{scenario}, {size} with {each} each, seeds {seed} to {last}\n");
        let widths: Vec<usize> = keys
            .iter()
            .enumerate()
            .map(|(index, key)| points.iter().map(|point| point[index].len()).fold(key.len(), usize::max))
            .collect();
        let row = |cells: &[String]| {
            cells.iter().zip(&widths).map(|(cell, width)| format!("  {cell:>width$}")).collect::<String>()
        };
        let is_shown = |name: &str| all_metrics || PRINTED.contains(&name);
        let fallback = !metrics.iter().any(|name| is_shown(name));
        let mut left_out = 0;
        for (index, name) in metrics.iter().enumerate() {
            let of = |point: &Summary| point.metrics[index].1;
            if !is_shown(name) && !fallback || self.points.iter().all(|point| of(point).n == 0) {
                left_out += 1;
                continue;
            }
            let (unit, _) = MetricInfo::unit(name);
            let label = MetricInfo::of(name).map_or(name.as_str(), |info| info.label);
            let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
            text += &format!("\n{label}{unit}\n{} {:>6} {:>9}  95 % interval\n", row(keys), "n", "mean");
            for (values, summary) in points.iter().zip(&self.points) {
                let Statistics { n, mean, ci95, .. } = of(summary);
                let interval = interval(name, ci95);
                text += &format!("{} {n:>6} {:>9}  {interval}\n", row(values), in_unit(name, mean));
            }
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
}

/// Row of `sweep.parquet`: the point, the values of its keys, and the statistics of each metric.
#[derive(Debug, Clone, Default, PartialEq)]
struct PointRow {
    point: i64,
    /// Values of the keys as text.
    texts: Vec<String>,
    /// Values of the keys as numbers, then mean, ends of the interval and standard deviation of each metric.
    numbers: Vec<Option<f64>>,
    /// Number of runs with a value of each metric.
    runs: Vec<i64>,
}

impl Row for PointRow {
    const TABLE: &'static str = "sweep";
}

impl Field for PointRow {
    /// Declares the column before those of keys and metrics.
    fn declare<T: 'static>(_: Declaration, columns: &mut Columns<T>, part: impl Part<T, Self>) {
        i64::declare(Declaration::new("point", ""), columns, move |row| &mut part(row).point);
    }
}
