//! Results of a sweep: the statistics of each point as a table, as JSON and on a page.

use std::path::Path;

use serde::Serialize;
use serde_json::{Map, Value};
use standoff_io::atomic_file::{self, PARTIAL};
use standoff_io::display_text;
use standoff_record::RecordError;
use standoff_record::column::{self, Columns, Declaration, Field, Part, Row};
use standoff_record::table::TableWriter;
use standoff_sim::monte_carlo::{Results, Statistics, Summary};
use standoff_view::page;
use standoff_view::sweep::{SweepMetric, SweepPage, SweepPoint};

use super::definition::Sweep;
use super::differences::{Differences, differences};
use crate::batch::REPORT;
use crate::error::{Failure, of_batch};

/// File name of the table of a sweep.
pub const SWEEP_TABLE: &str = "sweep.parquet";

/// Statistics of every point of a sweep, and differences between points.
#[derive(Debug, Clone)]
pub struct SweepResults {
    pub(super) sweep: Sweep,
    /// Statistics of each point.
    pub(super) points: Vec<Summary>,
    pub(super) differences: Differences,
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
        let points = results.iter().map(|results| results.summary().map_err(of_batch)).collect::<Result<_, _>>()?;
        let differences = differences(results, &sweep.metrics).map_err(of_batch)?;
        Ok(Self { sweep: sweep.clone(), points, differences })
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
            differences: self.differences.clone(),
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
