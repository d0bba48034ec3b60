//! Folder of a complete batch: `runs.parquet` with a row per run, `summary.json` with the statistics, and
//! `monte-carlo.json` with the definition of the batch.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize, Serializer};
use standoff_io::atomic_file::{self, PARTIAL, sibling};
use standoff_io::bounded_input;
use standoff_io::display_text;
use standoff_io::parquet_file::Source;
use standoff_record::column::{self, Columns, Declaration, Field, Part, Row};
use standoff_record::table::{MAX_TABLE, TableReader, TableWriter, source};
use standoff_record::{NO_FOLDER, RecordError, first_in};
use standoff_score::Metrics;

use super::batch::{Batch, Values};
use super::diff::{Settings, settings_of};
use super::journal::{self, MAX_BATCH, check_format, sync_folder};
use super::{MonteCarloError, Shard, Statistics, pooled_root_ratio};

const MANIFEST: &str = "monte-carlo.json";
const RUNS: &str = "runs.parquet";
const SUMMARY: &str = "summary.json";

/// A complete batch on disk.
#[derive(Debug, Clone)]
pub struct Results {
    dir: PathBuf,
    manifest: Manifest,
}

/// Statistics of a batch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of run 0; run k has this plus k.
    pub seed: u64,
    /// Number of runs of the whole batch.
    pub runs: u64,
    /// Shard of the batch, if it is not the whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// Metrics by name, in the order of [`standoff_score::MetricInfo::all`].
    #[serde(serialize_with = "as_object")]
    pub metrics: Vec<(String, Statistics)>,
}

/// Contents of `monte-carlo.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
struct Manifest {
    #[serde(flatten)]
    batch: Batch,
    /// Checksum of `runs.parquet`.
    runs_crc32: u32,
}

impl Manifest {
    /// Parses in two steps, because errors in flattened fields would have no line number.
    fn of_json(json: &[u8]) -> serde_json::Result<Self> {
        #[derive(Deserialize)]
        struct Seal {
            runs_crc32: u32,
        }
        let batch = serde_json::from_slice(json)?;
        let Seal { runs_crc32 } = serde_json::from_slice(json)?;
        Ok(Self { batch, runs_crc32 })
    }
}

/// Row of `runs.parquet`: fixed columns, then one per metric.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct RunRow {
    run: i64,
    pub(super) seed: i64,
    pub(super) values: Values,
}

impl Row for RunRow {
    const TABLE: &'static str = "runs";
}

impl Field for RunRow {
    /// Declares the columns before the metrics.
    fn declare<T: 'static>(_: Declaration, columns: &mut Columns<T>, part: impl Part<T, Self>) {
        i64::declare(Declaration::new("run", ""), columns, move |row| &mut part(row).run);
        i64::declare(Declaration::new("seed", ""), columns, move |row| &mut part(row).seed);
    }
}

fn columns<'a>(metrics: impl IntoIterator<Item = &'a str>) -> Columns<RunRow> {
    let mut columns = column::columns();
    for (index, metric) in metrics.into_iter().enumerate() {
        let declaration = Declaration::new(metric.to_owned(), "");
        Option::declare(declaration, &mut columns, move |row: &mut RunRow| &mut row.values[index]);
    }
    columns
}

impl Results {
    /// Opens the complete batch in `dir`. Fails if it is missing, if it was changed since it was written, or if it has
    /// another format.
    pub fn open(dir: &Path) -> Result<Self, MonteCarloError> {
        if !are_in(dir) {
            // An unreadable folder may contain results.
            let found = fs::metadata(dir.join(RUNS));
            let reason = found.err().filter(|reason| reason.kind() == io::ErrorKind::PermissionDenied);
            let what = match reason {
                Some(reason) => return Err(RecordError::read(dir, reason).into()),
                None if journal::is_in_use(dir) => return Err(RecordError::InUse { dir: dir.to_owned() }.into()),
                None if journal::is_in(dir) => "its batch is not complete; run the same command again to continue it",
                None => "contains no results of standoff monte-carlo; give the folder of a batch",
            };
            return Err(MonteCarloError::Folder(format!("{}: {what}", display_text::path(dir))));
        }
        let path = dir.join(MANIFEST);
        let bytes = bounded_input::bytes(&path, MAX_BATCH).map_err(|reason| RecordError::read(&path, reason))?;
        let damaged = |error: serde_json::Error| RecordError::damaged(&path, error.to_string());
        check_format(&bytes, &path)?.map_err(damaged)?;
        let manifest = Manifest::of_json(&bytes).map_err(damaged)?;
        manifest.batch.check().map_err(|error| RecordError::damaged(&path, error.to_string()))?;
        let path = dir.join(RUNS);
        if checksum(&path)? != manifest.runs_crc32 {
            let what = "it was changed since it was written";
            return Err(RecordError::damaged(&path, what).into());
        }
        Ok(Self { dir: dir.to_owned(), manifest })
    }

    /// Returns the results of `batch` if they are complete in `dir`. Refuses a folder with another batch or other
    /// contents.
    pub(super) fn find(dir: &Path, batch: &Batch) -> Result<Option<Self>, MonteCarloError> {
        if are_in(dir) {
            let results = Self::open(dir)?;
            batch.check_same(results.batch(), dir)?;
            return Ok(Some(results));
        }
        if !journal::is_in(dir) {
            must_be_free(dir)?;
        }
        Ok(None)
    }

    /// Folder of the results.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Definition of the batch.
    pub fn batch(&self) -> &Batch {
        &self.manifest.batch
    }

    /// Opens the table of runs: only once for any number of metrics.
    pub fn runs(&self) -> Result<Runs<'_>, MonteCarloError> {
        Runs::open(self.batch(), self.dir.join(RUNS))
    }

    /// Computes the statistics from the rows.
    pub fn summary(&self) -> Result<Summary, MonteCarloError> {
        self.runs()?.summary()
    }

    /// Rewrites the summary if it does not match the rows.
    pub(super) fn mend_summary(&self, stop: &AtomicBool) -> Result<(), MonteCarloError> {
        let text = summary_text(&self.dir, &self.runs()?, stop)?;
        let existing = bounded_input::bytes(&self.dir.join(SUMMARY), text.len() as u64);
        if !existing.is_ok_and(|existing| existing == text.as_bytes()) {
            self.add(SUMMARY, &text)?;
        }
        Ok(())
    }

    /// Adds a file to the folder, atomically: it is complete or missing.
    pub fn add(&self, name: &str, text: &str) -> Result<(), MonteCarloError> {
        save(&self.dir, name, text)?;
        Ok(sync_folder(&self.dir)?)
    }

    /// Returns every value of the scenario as TOML, by its dotted key.
    pub fn settings(&self) -> Result<Settings, MonteCarloError> {
        let damaged = |error: toml::de::Error| RecordError::damaged(&self.dir.join(MANIFEST), error.message());
        Ok(settings_of(self.batch().scenario_toml()).map_err(damaged)?)
    }
}

impl Summary {
    /// Returns one JSON object and a newline.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

/// True if `dir` contains a complete batch: the rows are written last.
fn are_in(dir: &Path) -> bool {
    dir.join(RUNS).is_file() && dir.join(MANIFEST).is_file()
}

/// Refuses a folder with any contents.
fn must_be_free(dir: &Path) -> Result<(), MonteCarloError> {
    let what = || first_in(dir, |_| true).unwrap_or_else(|| NO_FOLDER.to_owned());
    let occupied = || RecordError::Occupied { dir: dir.to_owned(), what: what() };
    match fs::read_dir(dir) {
        Err(reason) if reason.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(reason) if reason.kind() == io::ErrorKind::NotADirectory => Err(occupied().into()),
        Err(reason) => Err(RecordError::read(dir, reason).into()),
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(_) => Err(occupied().into()),
        },
    }
}

/// Completes the folder of a batch from its rows, in the order of runs. Every file is written under another name,
/// synced to disk and renamed, the rows last. If `stop` is set earlier, the batch is not complete.
pub(super) fn write(
    dir: &Path,
    batch: &Batch,
    rows: impl Iterator<Item = Result<Values, MonteCarloError>>,
    stop: &AtomicBool,
) -> Result<Results, MonteCarloError> {
    let path = dir.join(RUNS);
    let partial = sibling(&path, PARTIAL);
    let mut table = TableWriter::with_columns(partial.clone(), columns(batch.metrics()))?;
    for (run, values) in batch.flown().zip(rows) {
        // Batches have no seeds above the maximum of i64.
        table.push(&mut [RunRow { run: run as i64, seed: batch.seed_of(run) as i64, values: values? }])?;
    }
    table.finish()?;
    let manifest = Manifest { batch: batch.clone(), runs_crc32: checksum(&partial)? };
    let unwritable = |error: serde_json::Error| RecordError::write(dir, error.into());
    save(dir, SUMMARY, &summary_text(dir, &Runs::open(batch, partial.clone())?, stop)?)?;
    save(dir, MANIFEST, &(serde_json::to_string_pretty(&manifest).map_err(unwritable)? + "\n"))?;
    atomic_file::publish(&path).map_err(|reason| RecordError::write(&path, reason))?;
    Ok(Results { dir: dir.to_owned(), manifest })
}

fn summary_text(dir: &Path, runs: &Runs<'_>, stop: &AtomicBool) -> Result<String, MonteCarloError> {
    Ok(runs.summary_unless_stopped(stop)?.json().map_err(|error| RecordError::write(dir, error.into()))?)
}

fn save(dir: &Path, name: &str, text: &str) -> Result<(), RecordError> {
    let path = dir.join(name);
    atomic_file::save(&path, text).map_err(|reason| RecordError::write(&path, reason))
}

fn checksum(path: &Path) -> Result<u32, RecordError> {
    let unreadable = |reason| RecordError::read(path, reason);
    let mut file = bounded_input::open(path, MAX_TABLE).map_err(unreadable)?;
    let (mut crc, mut bytes) = (crc32fast::Hasher::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut bytes).map_err(unreadable)? {
            0 => return Ok(crc.finalize()),
            n => crc.update(&bytes[..n]),
        }
    }
}

/// Table of a batch's runs.
#[derive(Debug, Clone)]
pub struct Runs<'a> {
    batch: &'a Batch,
    path: PathBuf,
    table: Source,
}

impl<'a> Runs<'a> {
    fn open(batch: &'a Batch, path: PathBuf) -> Result<Self, MonteCarloError> {
        let table = source(&path)?;
        Ok(Self { batch, path, table })
    }

    /// Computes the statistics of every metric.
    pub fn summary(&self) -> Result<Summary, MonteCarloError> {
        self.summary_unless_stopped(&AtomicBool::new(false))
    }

    /// Computes the statistics of every metric; fails if `stop` is set.
    fn summary_unless_stopped(&self, stop: &AtomicBool) -> Result<Summary, MonteCarloError> {
        // One metric at a time, so that only one column is in memory.
        let column = |name: &str| {
            if stop.load(Ordering::Relaxed) { Err(MonteCarloError::Interrupted) } else { self.column(name) }
        };
        let statistics = |name: &String| {
            let mut statistics = Statistics::of(&column(name)?);
            if let Some((_, above, below)) = Metrics::POOLED.iter().find(|(pooled, ..)| pooled == name) {
                let pooled = pooled_root_ratio(&column(above)?, &column(below)?);
                statistics.mean = pooled.map(|pooled| pooled.mean);
                statistics.ci95 = pooled.and_then(|pooled| pooled.ci95);
            }
            Ok((name.clone(), statistics))
        };
        let Batch { scenario, seed, runs, shard, metrics, .. } = self.batch;
        Ok(Summary {
            scenario: scenario.clone(),
            seed: *seed,
            runs: *runs,
            shard: *shard,
            metrics: metrics.iter().map(statistics).collect::<Result<_, MonteCarloError>>()?,
        })
    }

    /// Returns the values of a metric, one per run, in the order of runs; `None` if a run has none.
    pub fn column(&self, metric: &str) -> Result<Vec<Option<f64>>, MonteCarloError> {
        self.rows(&[metric])?.map(|row| Ok(row?.values.pop().flatten())).collect()
    }

    /// Returns the rows in the order of runs, with the values of these metrics; checks that they belong to the batch.
    pub(super) fn rows(
        &self,
        metrics: &[&str],
    ) -> Result<impl Iterator<Item = Result<RunRow, MonteCarloError>> + use<'a>, MonteCarloError> {
        let (batch, path) = (self.batch, self.path.clone());
        let prototype = RunRow { values: vec![None; metrics.len()], ..RunRow::default() };
        let mut table =
            TableReader::of(path.clone(), prototype, columns(metrics.iter().copied()), [self.table.clone()])?;
        let (rows, flown) = (table.rows(), batch.flown().end - batch.flown().start);
        if rows != flown {
            let what = format!("it has {rows} rows, but the batch has {flown} runs");
            return Err(RecordError::damaged(&path, what).into());
        }
        let mut runs = batch.flown();
        Ok(std::iter::from_fn(move || {
            let row = match table.next_row() {
                Ok(row) => row,
                Err(error) => return Some(Err(error.into())),
            };
            let expected = runs.next().map(|run| (run as i64, batch.seed_of(run) as i64));
            if row.as_ref().map(|row| (row.run, row.seed)) == expected {
                return row.map(Ok);
            }
            runs = 0..0;
            let what = match expected {
                Some((run, seed)) => format!("the row of run {run} with seed {seed} is out of order"),
                None => "it has more rows than the batch has runs".to_owned(),
            };
            Some(Err(RecordError::damaged(&path, what).into()))
        }))
    }
}

/// Serialises pairs as an object and keeps their order.
pub(super) fn as_object<T: Serialize, S: Serializer>(pairs: &[(String, T)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().map(|(name, value)| (name, value)))
}
