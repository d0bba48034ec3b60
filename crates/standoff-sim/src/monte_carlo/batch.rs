//! Definition of a batch: everything that determines its rows.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use standoff_io::display_text::{path, printable, quoted};
use standoff_record::{MAX_NAME, MAX_VERSION, check_length};
use standoff_score::{MetricInfo, MetricSelection, Metrics};

use super::error::{FORMAT, MonteCarloError};
use super::shard::Shard;
use crate::scenario::ScenarioTemplate;

/// Scores of a run: a value per metric of its batch, `None` if nothing was measured.
pub(super) type Values = Vec<Option<f64>>;

/// Maximum number of runs of a batch. Reading the journal of a larger one would take too long.
const MAX_RUNS: u64 = 100_000_000;

/// Maximum number of metrics of a batch, far above the number that exist.
const MAX_METRICS: usize = 200;

/// Everything that determines the rows of a batch: equal batches give the same bytes.
///
/// ```
/// use standoff_sim::monte_carlo::{Batch, Shard};
/// use standoff_sim::scenario::{Overrides, ScenarioTemplate};
/// use standoff_score::MetricSelection;
///
/// let template = ScenarioTemplate::load("paper/table-2-pair", &Overrides::default())?;
/// // The second of four shards of a batch of a hundred runs.
/// let batch = Batch::new(&template, 1, 100, Some(Shard { index: 1, of: 4 }), MetricSelection::standard())?;
/// assert_eq!((batch.flown(), batch.seed_of(25)), (25..50, 26));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Batch {
    /// Format of journal and results.
    pub(super) format: u64,
    /// Version of standoff that flies the batch.
    pub(super) version: String,
    /// Name of the scenario.
    pub(super) scenario: String,
    /// Seed of run 0.
    pub(super) seed: u64,
    /// Number of runs of the whole batch.
    pub(super) runs: u64,
    /// Shard that this batch flies, if not all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) shard: Option<Shard>,
    /// Names of the metrics, in the order of [`MetricInfo::all`].
    pub(super) metrics: Vec<String>,
    /// Checksum of the traffic data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) traffic_crc32: Option<u32>,
    /// Scenario with all changes from the command line, as TOML.
    pub(super) scenario_toml: String,
}

impl Batch {
    /// Makes a batch of `runs` runs of a scenario, the first with `seed`, scored by the metrics of `choice`; or one
    /// shard of it.
    ///
    /// There must be at least one run for every shard, and the last seed must be at most 2^63 - 1.
    pub fn new(
        template: &ScenarioTemplate,
        seed: u64,
        runs: u64,
        shard: Option<Shard>,
        choice: MetricSelection,
    ) -> Result<Self, MonteCarloError> {
        check_runs(seed, runs, shard)?;
        Ok(Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scenario: template.name().to_owned(),
            seed,
            runs,
            shard,
            metrics: choice.names().map(str::to_owned).collect(),
            traffic_crc32: template.traffic_crc32(),
            scenario_toml: template.text()?,
        })
    }

    /// Serialises the batch as JSON, for another process or machine.
    pub fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }

    /// Parses the output of [`Self::json`]. Refuses invalid batches, and those of another version of standoff.
    pub fn from_json(json: &str) -> Result<Self, MonteCarloError> {
        let other = |what: String| MonteCarloError::Batch(format!("batch JSON: {what}"));
        let batch: Self = serde_json::from_str(json).map_err(|error| other(error.to_string()))?;
        batch.check()?;
        let (ours, theirs) = (env!("CARGO_PKG_VERSION"), printable(&batch.version));
        if batch.format != FORMAT || batch.version != ours {
            return Err(other(format!(
                "it is from standoff {theirs}, but this is {ours}: use the same version for both"
            )));
        }
        Ok(batch)
    }

    /// Returns one shard of this batch, or of the whole batch if this is a shard itself.
    pub fn part(&self, shard: Shard) -> Result<Self, MonteCarloError> {
        check_runs(self.seed, self.runs, Some(shard))?;
        Ok(Self { shard: Some(shard), ..self.clone() })
    }

    /// Refuses invalid batches; needed because batches are read from files.
    pub(super) fn check(&self) -> Result<(), MonteCarloError> {
        check_runs(self.seed, self.runs, self.shard)?;
        let lengths = check_length("scenario", &self.scenario, MAX_NAME)
            .and_then(|()| check_length("version", &self.version, MAX_VERSION));
        lengths.map_err(MonteCarloError::Batch)?;
        // Another version may have other metrics, so only the form of names is checked.
        let is_name = |name: &String| {
            let known = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            (1..=100).contains(&name.len()) && name.chars().all(known)
        };
        if self.metrics.len() > MAX_METRICS {
            return Err(wrong_metrics(format!("there are {}; at most {MAX_METRICS}", self.metrics.len())));
        }
        let different = self.metrics.iter().collect::<BTreeSet<_>>().len();
        match self.metrics.iter().find(|name| !is_name(name)) {
            Some(name) => Err(wrong_metrics(format!("{}: must be lowercase letters, digits and _", quoted(name)))),
            None if different < self.metrics.len() => {
                Err(wrong_metrics("one is listed twice; each may appear only once".to_owned()))
            }
            None => Ok(()),
        }
    }

    /// Returns the runs of this batch or shard.
    pub fn flown(&self) -> Range<u64> {
        self.shard.map_or(0..self.runs, |shard| shard.of_runs(self.runs))
    }

    /// Returns the seed of a run.
    pub fn seed_of(&self, run: u64) -> u64 {
        self.seed + run
    }

    /// Returns the scenario, to repeat runs of it. Any `traffic` replaces its traffic files, because a batch only has
    /// the files' names and checksum.
    pub fn template(&self, traffic: &[PathBuf]) -> Result<ScenarioTemplate, MonteCarloError> {
        let template = ScenarioTemplate::of_text(&self.scenario, &self.scenario_toml, traffic)?;
        if template.traffic_crc32() != self.traffic_crc32 {
            let of = format!("the traffic of {} differs from that of these runs", printable(&self.scenario));
            return Err(MonteCarloError::Batch(of + "; give the original file with --traffic"));
        }
        Ok(template)
    }

    /// Version of standoff that flew the batch.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Scenario with all changes from the command line, as TOML.
    pub fn scenario_toml(&self) -> &str {
        &self.scenario_toml
    }

    /// Names of the metrics, in the order of [`MetricInfo::all`].
    pub fn metrics(&self) -> impl Iterator<Item = &str> {
        self.metrics.iter().map(String::as_str)
    }

    /// True if the batch uses traffic from a file.
    pub fn has_traffic(&self) -> bool {
        self.traffic_crc32.is_some()
    }

    /// Returns the metrics as a selection.
    pub(super) fn choice(&self) -> Result<MetricSelection, MonteCarloError> {
        MetricSelection::parse(&self.metrics.join(",")).map_err(wrong_metrics)
    }

    /// Selects the values of this batch's metrics.
    pub(super) fn values(&self, metrics: &Metrics) -> Values {
        let all = MetricInfo::all().iter().zip(metrics.values());
        all.filter(|(info, _)| self.metrics.iter().any(|chosen| chosen == info.name)).map(|(_, value)| *value).collect()
    }

    /// Returns the whole batch that contains this shard.
    pub(super) fn whole_batch(&self) -> Self {
        Self { shard: None, ..self.clone() }
    }

    /// Describes the first difference between another batch and this one: `is theirs, not ours`.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let differ = |what: &str, ours: &dyn fmt::Display, theirs: &dyn fmt::Display| {
            let (ours, theirs) = (ours.to_string(), theirs.to_string());
            (ours != theirs).then(|| format!("{what} is {}, not {}", printable(&theirs), printable(&ours)))
        };
        let shard = |batch: &Self| batch.shard.map_or_else(|| "none".to_owned(), |shard| shard.to_string());
        let traffic = |batch: &Self| batch.traffic_crc32.map_or_else(|| "none".to_owned(), |crc| format!("{crc:08x}"));
        differ("its format", &self.format, &other.format)
            .or_else(|| differ("the version of standoff", &self.version, &other.version))
            .or_else(|| differ("the scenario", &self.scenario, &other.scenario))
            .or_else(|| different_line(&self.scenario_toml, &other.scenario_toml))
            .or_else(|| differ("the checksum of its traffic", &traffic(self), &traffic(other)))
            .or_else(|| differ("the first seed", &self.seed, &other.seed))
            .or_else(|| differ("the number of runs", &self.runs, &other.runs))
            .or_else(|| differ("the shard", &shard(self), &shard(other)))
            .or_else(|| different_metrics(&self.metrics, &other.metrics))
    }

    /// Refuses an existing batch in `dir` that differs from this one.
    pub(super) fn check_same(&self, existing: &Self, dir: &Path) -> Result<(), MonteCarloError> {
        match self.difference(existing) {
            None => Ok(()),
            Some(difference) => {
                let advice = "choose another folder, or remove that one";
                Err(MonteCarloError::Folder(format!(
                    "{} contains a different batch: {difference}; {advice}",
                    path(dir)
                )))
            }
        }
    }
}

fn check_runs(seed: u64, runs: u64, shard: Option<Shard>) -> Result<(), MonteCarloError> {
    let what = if runs == 0 {
        "the number of runs is 0; must be at least 1".to_owned()
    } else if seed.checked_add(runs).is_none_or(|end| end - 1 > i64::MAX as u64) {
        let most = i64::MAX;
        format!("seed {seed} and {runs} runs: the last seed must be at most {most}; use a smaller seed or fewer runs")
    } else if runs > MAX_RUNS {
        let most = format!("at most {MAX_RUNS} in a batch; use fewer, or several batches with different seeds");
        format!("{runs} runs are too many: {most}")
    } else if let Some(shard) = shard.filter(|shard| shard.index >= shard.of || shard.of > runs) {
        let must = "must be I/N, I from 0 to N - 1, with at least one run for each of N shards";
        format!("shard {shard} of {runs} runs: {must}")
    } else {
        return Ok(());
    };
    Err(MonteCarloError::Batch(what))
}

fn wrong_metrics(what: String) -> MonteCarloError {
    MonteCarloError::Batch(format!("metrics: {what}"))
}

/// Describes the metrics that only one of the two batches has.
fn different_metrics(ours: &[String], theirs: &[String]) -> Option<String> {
    let only = |of: &[String], other: &[String]| {
        let other: BTreeSet<&String> = other.iter().collect();
        of.iter().filter(|name| !other.contains(name)).cloned().collect::<Vec<_>>().join(", ")
    };
    match (only(ours, theirs), only(theirs, ours)) {
        (lacks, _) if !lacks.is_empty() => Some(format!("it lacks the metrics {}", printable(&lacks))),
        (_, more) if !more.is_empty() => Some(format!("it has additional metrics: {}", printable(&more))),
        _ => None,
    }
}

/// Describes the first different line of two scenarios, with its table.
fn different_line(ours: &str, theirs: &str) -> Option<String> {
    let (ours, theirs) = (lines_with_tables(ours), lines_with_tables(theirs));
    let missing = |from: &[(&str, &str)], other: &[(&str, &str)]| {
        let other: BTreeSet<_> = other.iter().collect();
        let found = from.iter().find(|line| !other.contains(line));
        found.map(|(table, line)| if table.is_empty() { (*line).to_owned() } else { format!("{table} {line}") })
    };
    let nothing = || "nothing".to_owned();
    match (missing(&ours, &theirs), missing(&theirs, &ours)) {
        (None, None) if ours == theirs => None,
        (None, None) => Some("its scenario has the same lines in another order".to_owned()),
        (ours, theirs) => {
            let (theirs, ours) = (theirs.unwrap_or_else(nothing), ours.unwrap_or_else(nothing));
            Some(format!("its scenario contains {} instead of {}", printable(&theirs), printable(&ours)))
        }
    }
}

/// Returns the lines of a scenario, each with the heading of its table.
fn lines_with_tables(text: &str) -> Vec<(&str, &str)> {
    let mut table = "";
    let mut lines = Vec::new();
    for line in text.lines().filter(|line| !line.is_empty()) {
        if line.starts_with('[') {
            table = line;
            lines.push(("", line));
        } else {
            lines.push((table, line));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn different_line_of_two_scenarios_is_reported() {
        let ours = "[a]\nx = 1\ny = 2\n\n[b]\nx = 1\n";
        assert_eq!(different_line(ours, ours), None);
        let theirs = ours.replace("[b]\nx = 1", "[b]\nx = 3");
        assert_eq!(different_line(ours, &theirs).unwrap(), "its scenario contains [b] x = 3 instead of [b] x = 1");
        let without = ours.replace("y = 2\n", "");
        assert_eq!(different_line(ours, &without).unwrap(), "its scenario contains nothing instead of [a] y = 2");
    }
}
