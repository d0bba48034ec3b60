//! What a replay says before anything moves.

use serde::{Serialize, Serializer};
use standoff::Zone;
use standoff_sim::record::Manifest;
use standoff_sim::traffic::Origin;

use crate::figures::Setup;
use crate::serve::Bytes;

/// Format of heads and parts; it rises when either changes.
pub const FORMAT: u32 = 3;

/// What the page needs to know of a run beside its parts.
#[derive(Debug, Clone, Serialize)]
pub struct Head {
    format: u32,
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the run, as text: a page's numbers have 53 bits.
    pub seed: String,
    /// Version of standoff that flew it.
    pub version: String,
    /// Length of the mission, s.
    pub duration_s: f64,
    /// Time between instants, s.
    pub period_s: f64,
    /// Where the local plane touches the Earth.
    pub origin: Option<Origin>,
    /// The UAVs' limits.
    pub limits: Setup,
    /// What lies under the vehicles, packed by `standoff-map`; the page asks for it where the head says that it is there.
    #[serde(serialize_with = "is_there")]
    pub map: Option<Bytes>,
    /// Zones that UAVs keep out of, and in.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub zones: Vec<Outline>,
    /// UAVs keep away from one another.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub keeps_apart: bool,
    /// Names of the targets by id. They come from files of strangers: the page shows them as text.
    pub targets: Vec<String>,
    /// What the run came to; empty while it flies.
    pub outcome: Vec<Line>,
    /// Only every so many instants have a detail.
    pub stride: usize,
    /// It is being flown: the page shows the newest instant.
    pub live: bool,
    /// It was ended before the mission was over.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub unfinished: bool,
    /// How many of the run's events are in no part, because they are too many for a page.
    #[serde(skip_serializing_if = "is_none")]
    pub events_left_out: u64,
    /// The same of events that only other minds tell of.
    #[serde(skip_serializing_if = "is_none")]
    pub other_events_left_out: u64,
}

/// A zone to be drawn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outline {
    /// What people call it; from files of strangers, too: the page shows it as text.
    pub name: String,
    /// `keep-out` or `keep-in`.
    pub kind: &'static str,
    /// Its corners, east and north, m.
    pub corners_m: Vec<[f64; 2]>,
}

impl Outline {
    fn of(zone: &Zone) -> Self {
        let corners_m = zone.outline.iter().map(|at| [at.x_m(), at.y_m()]).collect();
        Self { name: zone.name.clone(), kind: zone.kind.name(), corners_m }
    }
}

fn is_none(events: &u64) -> bool {
    *events == 0
}

fn is_there<S: Serializer>(map: &Option<Bytes>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bool(map.is_some())
}

/// A line of the table of outcomes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// Name of the metric.
    pub metric: &'static str,
    /// What it is, in words.
    pub words: &'static str,
    /// Its value, in `unit`.
    pub value: Option<f64>,
    /// The unit.
    pub unit: &'static str,
    /// Which values are good.
    pub good: String,
}

impl Head {
    /// The head of a run that has not come to anything yet.
    #[must_use]
    pub fn new(manifest: &Manifest, limits: Setup, targets: Vec<String>) -> Self {
        Self {
            format: FORMAT,
            scenario: manifest.scenario.clone(),
            seed: manifest.seed.to_string(),
            version: manifest.version.clone(),
            duration_s: manifest.duration_s,
            period_s: manifest.period_s,
            origin: manifest.origin,
            zones: limits.rules.airspace.zones().map(Outline::of).collect(),
            keeps_apart: limits.rules.keeps_apart,
            limits,
            map: None,
            targets,
            outcome: Vec::new(),
            stride: 1,
            live: false,
            unfinished: manifest.unfinished,
            events_left_out: 0,
            other_events_left_out: 0,
        }
    }

    /// As JSON.
    pub fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }
}
