//! `run.json`: scenario and seed of the run, and the version of standoff that wrote the record.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};
use standoff_io::bounded_input;
use standoff_io::display_text::{printable, quoted};
use standoff_io::geodesy::{Origin, Unit};

use crate::error::RecordError;
use crate::frame::ReportedTables;

/// Record format that this version writes and reads. It is incremented when the manifest or a table changes.
pub const FORMAT: u64 = 7;
/// File name of the manifest.
pub(crate) const MANIFEST: &str = "run.json";
/// Maximum size of a manifest, bytes; typical are 300.
const MAX_MANIFEST: u64 = 64 << 10;
/// Maximum length of a scenario name, characters; file names have up to 255 bytes.
pub const MAX_NAME: usize = 1_000;
/// Maximum length of a version, characters.
pub const MAX_VERSION: usize = 100;

/// Description of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Format of the record; [`FORMAT`] in records of this version.
    pub format: u64,
    /// Version of standoff that wrote the record.
    pub version: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the run's random numbers.
    pub seed: u64,
    /// Length of the mission, s.
    pub duration_s: f64,
    /// Time between two time steps, s.
    pub period_s: f64,
    /// Origin of the local plane on the Earth, if the scenario has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// Unit of the coordinates of the traffic file, if the scenario has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traffic_unit: Option<Unit>,
    /// Start of the mission in UTC, microseconds since 1970, if it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub begin_unix_us: Option<i64>,
    /// Tables that the controller reports, if not all.
    #[serde(default, skip_serializing_if = "is_whole")]
    pub reported: ReportedTables,
    /// Size of a complete record, used to detect missing data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts: Option<Counts>,
    /// True while the run is in progress, or if it ended before the mission was over.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unfinished: bool,
}

fn is_whole(reported: &ReportedTables) -> bool {
    *reported == ReportedTables::default()
}

/// Size of a record.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Number of time steps.
    pub time_steps: u64,
    /// Number of rows, by table name.
    pub rows: BTreeMap<String, u64>,
}

impl Manifest {
    /// Makes the manifest of a run by this version of standoff.
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
            begin_unix_us: None,
            reported: ReportedTables::default(),
            counts: None,
            unfinished: false,
        }
    }

    /// The manifest of the same run while this version of standoff writes its record.
    pub(crate) fn begun(&self) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self { format: FORMAT, version, counts: None, unfinished: true, ..self.clone() }
    }

    /// Returns scenario and seed, as in the titles of figures.
    #[must_use]
    pub fn title(&self) -> String {
        format!(
            "{}, seed {}{}",
            printable(&self.scenario),
            self.seed,
            if self.unfinished { ", unfinished" } else { "" }
        )
    }

    /// Describes the unit of the traffic file's coordinates; `None` without a traffic file or if the record does not
    /// contain it.
    #[must_use]
    pub fn traffic_note(&self) -> Option<String> {
        match (self.origin, self.traffic_unit) {
            (Some(Origin { latitude_deg, longitude_deg }), _) => {
                Some(format!("degrees, projected about {latitude_deg:.6}, {longitude_deg:.6}"))
            }
            (None, Some(Unit::Metres)) => Some("metres".to_owned()),
            (None, _) => None,
        }
    }

    pub(crate) fn to_json(&self) -> Result<String, RecordError> {
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

    pub(crate) fn read(dir: &Path) -> Result<Self, RecordError> {
        let path = dir.join(MANIFEST);
        let text = match bounded_input::text(&path, MAX_MANIFEST) {
            Ok(text) => text,
            Err(reason) if reason.kind() == io::ErrorKind::NotFound && dir.is_dir() => {
                return Err(RecordError::NotARecord { dir: dir.to_owned() });
            }
            Err(reason) => return Err(RecordError::read(&path, reason)),
        };
        let damaged = |error: serde_json::Error| RecordError::damaged(&path, error.to_string());
        // A later format may have other fields, so the format is checked first.
        let Heading { format, version } = serde_json::from_str(&text).map_err(damaged)?;
        if format != FORMAT {
            return Err(RecordError::OtherFormat { path, format, known: FORMAT, version });
        }
        let manifest: Self = serde_json::from_str(&text).map_err(damaged)?;
        manifest.check().map_err(|what| RecordError::damaged(&path, what))?;
        Ok(manifest)
    }

    /// Refuses values that no run can have.
    fn check(&self) -> Result<(), String> {
        check_length("scenario", &self.scenario, MAX_NAME)?;
        check_length("version", &self.version, MAX_VERSION)?;
        if self.counts.is_none() != self.unfinished {
            return Err("it must have counts if and only if the run is finished".to_owned());
        }
        let mut values = vec![("duration_s", self.duration_s, 0.0..=1e9), ("period_s", self.period_s, 1e-6..=1e9)];
        if let Some(Origin { latitude_deg, longitude_deg }) = self.origin {
            values.push(("origin.latitude_deg", latitude_deg, -90.0..=90.0));
            values.push(("origin.longitude_deg", longitude_deg, -180.0..=180.0));
        }
        if let Some(begin_us) = self.begin_unix_us {
            values.push(("begin_unix_us", begin_us as f64, -1e16..=1e16));
        }
        if self.traffic_unit.is_some_and(|unit| (unit == Unit::Degrees) != self.origin.is_some()) {
            return Err(
                "traffic_unit and origin contradict each other: degrees need an origin, metres must not have one"
                    .to_owned(),
            );
        }
        match values.into_iter().find(|(_, value, allowed)| !allowed.contains(value)) {
            None => Ok(()),
            Some((key, value, allowed)) => {
                Err(format!("{key} = {value:e} is out of range; must be {:e} to {:e}", allowed.start(), allowed.end()))
            }
        }
    }

    /// True if the folder's `run.json` is that of a record, of this format or another one.
    pub(crate) fn is_in(dir: &Path) -> bool {
        matches!(Self::read(dir), Ok(_) | Err(RecordError::OtherFormat { .. }))
    }
}

/// Refuses a text longer than `most` characters.
pub fn check_length(key: &str, value: &str, most: usize) -> Result<(), String> {
    match value.chars().count() {
        count if count <= most => Ok(()),
        count => Err(format!("{key} has {count} characters; at most {most}: {}", quoted(value))),
    }
}

/// Common start of the manifest in every format.
#[derive(Deserialize)]
struct Heading {
    format: u64,
    version: String,
}
