//! `run.json`: what was run and which version of standoff wrote the record.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::RecordError;
use crate::frame::Reported;
use crate::input;
use crate::text::{quoted, words};
use crate::traffic::{Origin, Unit};

/// The format of the records that this version writes and reads. It rises when the manifest or a table changes.
pub const FORMAT: u64 = 4;
/// Its file's name.
pub(super) const MANIFEST: &str = "run.json";
/// Largest manifest, bytes: one has some 300.
const MAX_MANIFEST: u64 = 64 << 10;
/// Longest name of a scenario, characters: that of a file has 255 bytes.
pub(crate) const MAX_NAME: usize = 1_000;
/// Longest version, characters.
pub(crate) const MAX_VERSION: usize = 100;
/// Records of these formats are read, too: they only have no counts, or no origin either.
const WITHOUT_COUNTS: [u64; 2] = [3, 2];

/// What was run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Format of the record, [`FORMAT`] in what this version writes.
    pub format: u64,
    /// Version of standoff that wrote the record.
    pub version: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the run's random numbers.
    pub seed: u64,
    /// Length of the mission, s.
    pub duration_s: f64,
    /// Time from one instant to the next, s.
    pub period_s: f64,
    /// Where the local plane touches the Earth, if the scenario says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// What the coordinates of the traffic file were taken for, if the scenario has one. Older records
    /// say it only by their origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traffic_unit: Option<Unit>,
    /// What the brain tells of itself, if it does not tell all.
    #[serde(default, skip_serializing_if = "is_whole")]
    pub reported: Reported,
    /// How much a complete record holds, by which is noticed what has gone missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts: Option<Counts>,
    /// The run is under way, or was ended before its mission was over.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unfinished: bool,
}

fn is_whole(reported: &Reported) -> bool {
    *reported == Reported::default()
}

/// How much a record holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Number of instants.
    pub instants: u64,
    /// Number of rows, by the name of the table.
    pub rows: BTreeMap<String, u64>,
}

impl Manifest {
    /// The manifest of a run by this version of standoff.
    #[must_use]
    pub fn new(scenario: &str, seed: u64, duration_s: f64, period_s: f64) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scenario: scenario.to_owned(),
            seed,
            duration_s,
            period_s,
            origin: None,
            traffic_unit: None,
            reported: Reported::default(),
            counts: None,
            unfinished: false,
        }
    }

    /// Scenario and seed, as pictures of the run are titled.
    #[must_use]
    pub fn title(&self) -> String {
        format!("{}, seed {}{}", words(&self.scenario), self.seed, if self.unfinished { ", unfinished" } else { "" })
    }

    /// What the coordinates of the traffic file were taken for, in words; `None` if there was none, or if the record does
    /// not say.
    #[must_use]
    pub fn traffic_told(&self) -> Option<String> {
        match (self.origin, self.traffic_unit) {
            (Some(Origin { latitude_deg, longitude_deg }), _) => {
                Some(format!("degrees, projected about {latitude_deg:.6}, {longitude_deg:.6}"))
            }
            (None, Some(Unit::Metres)) => Some("metres".to_owned()),
            (None, _) => None,
        }
    }

    pub(super) fn to_json(&self) -> Result<String, RecordError> {
        for (column, value) in [("duration_s", self.duration_s), ("period_s", self.period_s)] {
            if !value.is_finite() {
                return Err(RecordError::NotFinite { table: MANIFEST, column: column.to_owned(), time_s: 0.0 });
            }
        }
        check_length("scenario", &self.scenario, MAX_NAME)
            .map_err(|what| RecordError::damaged(Path::new(MANIFEST), what))?;
        serde_json::to_string_pretty(self)
            .map(|text| text + "\n")
            .map_err(|error| RecordError::write(Path::new(MANIFEST), error.into()))
    }

    pub(super) fn read(dir: &Path) -> Result<Self, RecordError> {
        let path = dir.join(MANIFEST);
        let text = match input::text(&path, MAX_MANIFEST) {
            Ok(text) => text,
            Err(reason) if reason.kind() == io::ErrorKind::NotFound && dir.is_dir() => {
                return Err(RecordError::NotARecord { dir: dir.to_owned() });
            }
            Err(reason) => return Err(RecordError::read(&path, reason)),
        };
        let damaged = |error: serde_json::Error| RecordError::damaged(&path, error.to_string());
        // A later format may have other fields: look at the format before insisting on ours.
        let Heading { format, version } = serde_json::from_str(&text).map_err(damaged)?;
        if format != FORMAT && !WITHOUT_COUNTS.contains(&format) {
            return Err(RecordError::OtherFormat { path, format, known: FORMAT, version });
        }
        let manifest: Self = serde_json::from_str(&text).map_err(damaged)?;
        manifest.check().map_err(|what| RecordError::damaged(&path, what))?;
        Ok(manifest)
    }

    /// Refuses what no run can be.
    fn check(&self) -> Result<(), String> {
        check_length("scenario", &self.scenario, MAX_NAME)?;
        check_length("version", &self.version, MAX_VERSION)?;
        if self.format == FORMAT && self.counts.is_none() != self.unfinished {
            return Err("it has counts only if the run is finished, and then it has them".to_owned());
        }
        let mut values = vec![("duration_s", self.duration_s, 0.0..=1e9), ("period_s", self.period_s, 1e-6..=1e9)];
        if let Some(Origin { latitude_deg, longitude_deg }) = self.origin {
            values.push(("origin.latitude_deg", latitude_deg, -90.0..=90.0));
            values.push(("origin.longitude_deg", longitude_deg, -180.0..=180.0));
        }
        if self.traffic_unit.is_some_and(|unit| (unit == Unit::Degrees) != self.origin.is_some()) {
            return Err("traffic_unit and origin contradict each other: degrees have an origin, metres none".to_owned());
        }
        match values.into_iter().find(|(_, value, allowed)| !allowed.contains(value)) {
            None => Ok(()),
            Some((key, value, allowed)) => {
                Err(format!("{key} = {value:e} is out of range; {:e} to {:e}", allowed.start(), allowed.end()))
            }
        }
    }

    /// The folder's `run.json` is that of a record, of this format or another one.
    pub(super) fn is_in(dir: &Path) -> bool {
        matches!(Self::read(dir), Ok(_) | Err(RecordError::OtherFormat { .. }))
    }
}

/// Refuses a text of more than so many characters.
pub(crate) fn check_length(key: &str, value: &str, most: usize) -> Result<(), String> {
    match value.chars().count() {
        count if count <= most => Ok(()),
        count => Err(format!("{key} has {count} characters; at most {most}: {}", quoted(value))),
    }
}

/// What every format of the manifest begins with.
#[derive(Deserialize)]
struct Heading {
    format: u64,
    version: String,
}
