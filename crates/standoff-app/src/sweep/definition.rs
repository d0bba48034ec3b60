//! Definition of a sweep: everything that determines its results.

use std::fs;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};
use standoff_io::{atomic_file, bounded_input, display_text};
use standoff_record::{RecordError, first_in};
use standoff_score::MetricSelection;
use standoff_sim::monte_carlo::Batch;
use standoff_sim::scenario::ScenarioTemplate;

use super::axis::{Axis, AxisValues};
use super::design::{self, LatinHypercube, POINTS_MAX};
use crate::error::{Failure, of_batch};

/// File name of the definition of a sweep.
pub const SWEEP: &str = "sweep.json";

/// Format of the definition.
const FORMAT: u32 = 1;

/// Maximum size of a definition, bytes.
const SWEEP_MAX: u64 = 64 << 20;

/// Place within a range of a number that is not whole, as a fraction of the range; irrational.
const WITHIN: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Maximum number of keys of a sweep.
const KEYS_MAX: usize = 20;

/// Definition of a sweep: contents of `sweep.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    format: u32,
    /// Version of standoff that flies the sweep.
    version: String,
    /// Name of the scenario.
    pub(super) scenario: String,
    /// Seed of the first run of each point.
    pub(super) seed: u64,
    /// Number of runs of each point.
    pub(super) runs: u64,
    /// Names of the metrics.
    pub(super) metrics: Vec<String>,
    /// Swept keys.
    pub(super) keys: Vec<String>,
    /// Sampling by a Latin hypercube; a grid if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) latin_hypercube: Option<LatinHypercube>,
    /// Values of the keys at each point, as TOML text.
    pub(super) points: Vec<Vec<String>>,
}

impl Sweep {
    /// Defines a sweep of `axes` over a scenario: a grid or, with `latin_hypercube`, random points. Checks the scenario of every point
    /// with the first seed.
    pub fn new(
        axes: &[Axis],
        latin_hypercube: Option<LatinHypercube>,
        template: &ScenarioTemplate,
        seed: u64,
        runs: u64,
        choice: MetricSelection,
    ) -> Result<Self, Failure> {
        let keys: Vec<String> = axes.iter().map(|axis| axis.key().to_owned()).collect();
        if let Some(index) = (1..keys.len()).find(|&index| keys[..index].contains(&keys[index])) {
            return Err(Failure::Input(format!("{}: this key is varied twice; give it once", keys[index])));
        }
        if !(1..=KEYS_MAX).contains(&keys.len()) {
            return Err(Failure::Input(format!("{} keys to vary: must be from 1 to {KEYS_MAX}", keys.len())));
        }
        let points = match latin_hypercube {
            None => design::grid(axes),
            Some(hypercube) => design::latin_hypercube(axes, hypercube, |index| is_whole(&axes[index], template, seed)),
        };
        let points = points.map_err(Failure::Input)?;
        let batch = Batch::new(template, seed, runs, None, choice).map_err(of_batch)?;
        let sweep = Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scenario: template.name().to_owned(),
            seed,
            runs,
            metrics: batch.metrics().map(str::to_owned).collect(),
            keys,
            latin_hypercube,
            points,
        };
        for point in 0..sweep.points.len() {
            let changed = template.changed(&sweep.changes(point));
            changed.and_then(|changed| changed.draw(seed)).map_err(Failure::Scenario)?;
        }
        Ok(sweep)
    }

    /// Reads the definition in the folder of a sweep.
    pub fn open(dir: &Path) -> Result<Self, Failure> {
        let path = dir.join(SWEEP);
        let bytes = bounded_input::bytes(&path, SWEEP_MAX).map_err(|reason| match reason.kind() {
            io::ErrorKind::NotFound => {
                let what = "contains no results of standoff sweep; give the folder of a sweep";
                Failure::Input(format!("{}: {what}", display_text::path(dir)))
            }
            _ => Failure::input(RecordError::read(&path, reason)),
        })?;
        Self::from_json(&String::from_utf8_lossy(&bytes), &display_text::path(&path))
    }

    /// Parses the output of [`Self::json`]; messages name its `place`.
    pub fn from_json(json: &str, place: &str) -> Result<Self, Failure> {
        let damaged = |what: String| Failure::Input(format!("{place} is damaged: {}", display_text::printable(&what)));
        let sweep: Self = serde_json::from_str(json).map_err(|error| damaged(error.to_string()))?;
        if sweep.format != FORMAT {
            return Err(Failure::Input(format!("{place} has format {}; this version supports {FORMAT}", sweep.format)));
        }
        if !(1..=POINTS_MAX).contains(&sweep.points.len())
            || sweep.points.iter().any(|point| point.len() != sweep.keys.len())
        {
            return Err(damaged("its points do not match its keys".to_owned()));
        }
        Ok(sweep)
    }

    /// Swept keys.
    pub fn keys(&self) -> &[String] {
        &self.keys
    }

    /// Number of points.
    pub fn size(&self) -> usize {
        self.points.len()
    }

    /// Folder of a point's batch, relative to that of the sweep.
    pub fn point_dir(&self, point: usize) -> String {
        format!("points/{point}")
    }

    /// Changes to the scenario at a point, each `KEY=VALUE`.
    pub fn changes(&self, point: usize) -> Vec<String> {
        self.keys.iter().zip(&self.points[point]).map(|(key, value)| format!("{key}={value}")).collect()
    }

    /// Returns the definition as one JSON object and a newline.
    pub fn json(&self) -> Result<String, Failure> {
        Ok(serde_json::to_string_pretty(self).map_err(Failure::running)? + "\n")
    }

    /// Describes the first difference between another sweep and this one.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let differ = |what: &str, ours: String, theirs: String| {
            let shown = display_text::printable;
            (ours != theirs).then(|| format!("{what} is {}, not {}", shown(&theirs), shown(&ours)))
        };
        let sampling = |sweep: &Self| {
            sweep.latin_hypercube.map_or_else(
                || "a grid".to_owned(),
                |LatinHypercube { points, seed }| format!("a Latin hypercube of {points} points with seed {seed}"),
            )
        };
        let point = |index: usize| {
            let of = |sweep: &Self| {
                sweep.points.get(index).map_or_else(|| "missing".to_owned(), |_| sweep.changes(index).join(" "))
            };
            differ(&format!("point {index}"), of(self), of(other))
        };
        differ("the version of standoff", self.version.clone(), other.version.clone())
            .or_else(|| differ("the scenario", self.scenario.clone(), other.scenario.clone()))
            .or_else(|| differ("the first seed", self.seed.to_string(), other.seed.to_string()))
            .or_else(|| differ("the number of runs of a point", self.runs.to_string(), other.runs.to_string()))
            .or_else(|| differ("the list of keys", self.keys.join(", "), other.keys.join(", ")))
            .or_else(|| differ("the sampling", sampling(self), sampling(other)))
            .or_else(|| differ("the list of metrics", self.metrics.join(", "), other.metrics.join(", ")))
            .or_else(|| (0..self.size().max(other.size())).find_map(point))
    }

    /// Writes the definition to the folder of a sweep, which must be new, empty or of the same sweep.
    pub fn prepare(&self, dir: &Path) -> Result<(), Failure> {
        let shown = display_text::path(dir);
        if dir.join(SWEEP).exists() {
            return match self.difference(&Self::open(dir)?) {
                None => Ok(()),
                Some(difference) => Err(Failure::Input(format!(
                    "{shown} contains a different sweep: {difference}; choose another folder, or remove that one"
                ))),
            };
        }
        if let Some(what) = first_in(dir, |_| true) {
            let what = display_text::printable(&what);
            return Err(Failure::Input(format!("{shown} contains {what}, but no sweep; choose another folder")));
        }
        let unwritable = |reason| Failure::running(RecordError::write(&dir.join(SWEEP), reason));
        fs::create_dir_all(dir).map_err(unwritable)?;
        atomic_file::save(&dir.join(SWEEP), self.json()?).map_err(unwritable)
    }
}

/// True if the key of an axis takes whole numbers only: the scenario accepts both whole numbers and no other one.
fn is_whole(axis: &Axis, template: &ScenarioTemplate, seed: u64) -> bool {
    let AxisValues::Range { from, to } = axis.values else { return false };
    let accepts = |value: f64| {
        let changed = template.changed(&[format!("{}={value}", axis.key())]);
        changed.is_ok_and(|changed| changed.draw(seed).is_ok())
    };
    from.ceil() <= to.floor() && accepts(from.ceil()) && !accepts(from + (to - from) * WITHIN)
}
