//! Head of a replay: the properties of the run.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};
use standoff::{AreaOfInterest, Position, Zone};
use standoff_io::geodesy::Origin;
use standoff_record::Manifest;
use standoff_score::{Alarm, Building, Gap, Problem, problems};

use crate::Bytes;
use crate::figures::Setup;
use crate::replay::Encoder;

/// Format number of heads and parts; it increases when either format changes.
pub const FORMAT: u32 = 6;

/// Maximum number of alarms, and of gaps, that a page shows; the others are in `alarms.csv` and `gaps.csv`.
const PROBLEMS_MAX: usize = 5000;

/// Properties of a run that the page needs in addition to the parts.
#[derive(Debug, Clone, Serialize)]
pub struct Head {
    format: u32,
    /// Name of the scenario.
    pub scenario: String,
    /// Description of the scenario in one line. It may come from an untrusted file, so the page shows it as plain text.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub about: String,
    /// Settings that differ from those of another run of the same scenario on the page, each `KEY=VALUE`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<String>,
    /// Seed of the run, as text because JavaScript numbers have only 53 bits.
    pub seed: String,
    /// Version of standoff that simulated the run.
    pub version: String,
    /// Length of the mission, s.
    pub duration_s: f64,
    /// Length of a time step, s.
    pub period_s: f64,
    /// Point at which the local plane touches the Earth.
    pub origin: Option<Origin>,
    /// Start of the mission in UTC, microseconds since 1970.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub begin_unix_us: Option<i64>,
    /// Limits of the UAVs.
    pub limits: Setup,
    /// Basemap, encoded by `standoff-map`. In the JSON it is a flag; if it is set, the page requests the map.
    #[serde(serialize_with = "serialize_is_some")]
    pub map: Option<Bytes>,
    /// Buildings that hide targets.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub buildings: Vec<Prism>,
    /// Keep-out and keep-in zones, and areas of interest.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub zones: Vec<Outline>,
    /// Priorities of targets by id; 1 for all others.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub priorities: BTreeMap<u32, f64>,
    /// True if collision avoidance is on.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub has_separation: bool,
    /// True if the UAVs fly in wind.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub has_wind: bool,
    /// Names of the targets by id. They may come from untrusted files, so the page shows them as plain text.
    pub targets: Vec<String>,
    /// Results of the run; empty while it is in progress.
    pub outcome: Vec<Line>,
    /// Times in which targets were in no UAV's view; empty while the run is in progress.
    pub gaps: Vec<Gap>,
    /// Alarms; empty while the run is in progress.
    pub alarms: Vec<Alarm>,
    /// All alarms by kind and cause; empty while the run is in progress.
    pub problems: Vec<Problem>,
    /// Number of gaps and alarms that the page does not show, because there are too many.
    #[serde(skip_serializing_if = "is_none")]
    pub problems_left_out: u64,
    /// Interval between details, in time steps.
    pub stride: usize,
    /// True while the run is in progress: the page shows the newest time step.
    pub live: bool,
    /// True if the run was stopped before the end of the mission.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub unfinished: bool,
    /// Number of events of the run that are in no part, because a page could not show them all.
    #[serde(skip_serializing_if = "is_none")]
    pub events_left_out: u64,
    /// Number of events reported only by other agents that are in no part.
    #[serde(skip_serializing_if = "is_none")]
    pub other_events_left_out: u64,
}

/// A building.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prism {
    /// Height, m.
    pub height_m: f64,
    /// Vertices of outline and courtyards, east and north, m.
    pub rings_m: Vec<Vec<[f64; 2]>>,
}

impl Prism {
    fn of(building: &Building) -> Self {
        let ring = |ring: &Vec<Position>| ring.iter().map(|at| [at.x_m(), at.y_m()]).collect();
        Self { height_m: building.height_m, rings_m: building.rings.iter().map(ring).collect() }
    }
}

/// Outline of a zone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outline {
    /// Name of the zone. It may come from an untrusted file, so the page shows it as plain text.
    pub name: String,
    /// `keep-out`, `keep-in` or `area-of-interest`.
    pub kind: &'static str,
    /// Vertices, east and north, m.
    pub corners_m: Vec<[f64; 2]>,
    /// Floor, m; `None`: no lower limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub altitude_min_m: Option<f64>,
    /// Ceiling, m; `None`: no upper limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub altitude_max_m: Option<f64>,
}

impl Outline {
    fn of(zone: &Zone) -> Self {
        let corners_m = corners_m(&zone.vertices);
        let (altitude_min_m, altitude_max_m) = (zone.altitude_min_m, zone.altitude_max_m);
        Self { name: zone.name.clone(), kind: zone.kind.name(), corners_m, altitude_min_m, altitude_max_m }
    }

    fn of_area(area: &AreaOfInterest) -> Self {
        let (name, corners_m) = (format!("priority {}", area.priority), corners_m(&area.vertices));
        Self { name, kind: "area-of-interest", corners_m, altitude_min_m: None, altitude_max_m: None }
    }
}

fn corners_m(vertices: &[Position]) -> Vec<[f64; 2]> {
    vertices.iter().map(|at| [at.x_m(), at.y_m()]).collect()
}

/// Returns the longest ones, in their order.
fn longest<T>(mut all: Vec<T>, duration_us: impl Fn(&T) -> i64) -> Vec<T> {
    if all.len() > PROBLEMS_MAX {
        let mut durations: Vec<i64> = all.iter().map(&duration_us).collect();
        let (_, least, _) = durations.select_nth_unstable_by(PROBLEMS_MAX - 1, |a, b| b.cmp(a));
        let least = *least;
        all.retain(|one| duration_us(one) >= least);
        all.truncate(PROBLEMS_MAX);
    }
    all
}

fn is_none(events: &u64) -> bool {
    *events == 0
}

fn serialize_is_some<S: Serializer>(map: &Option<Bytes>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bool(map.is_some())
}

/// A line of the table of results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// Name of the metric.
    pub metric: &'static str,
    /// Topic of the metric.
    pub section: &'static str,
    /// Short description of the metric.
    pub label: &'static str,
    /// Value, in `unit`.
    pub value: Option<f64>,
    /// Unit of the value.
    pub unit: &'static str,
    /// Goal, limit or bound of the value, as text.
    pub target: String,
    /// True if tables show the metric if the user selects none.
    pub is_main: bool,
}

impl Head {
    /// Makes the head of a run without results.
    #[must_use]
    pub fn new(manifest: &Manifest, limits: Setup, targets: Vec<String>) -> Self {
        let areas = limits.rules.priorities.areas.iter().map(Outline::of_area);
        Self {
            format: FORMAT,
            scenario: manifest.scenario.clone(),
            about: limits.about.clone(),
            changes: Vec::new(),
            seed: manifest.seed.to_string(),
            version: manifest.version.clone(),
            duration_s: manifest.duration_s,
            period_s: manifest.period_s,
            origin: manifest.origin,
            begin_unix_us: manifest.begin_unix_us,
            buildings: limits.rules.buildings.all().iter().map(Prism::of).collect(),
            zones: limits.rules.geofence.zones().map(Outline::of).chain(areas).collect(),
            priorities: limits.rules.priorities.of_target.clone(),
            has_separation: limits.rules.has_separation,
            has_wind: limits.rules.has_wind,
            limits,
            map: None,
            targets,
            outcome: Vec::new(),
            gaps: Vec::new(),
            alarms: Vec::new(),
            problems: Vec::new(),
            problems_left_out: 0,
            stride: 1,
            live: false,
            unfinished: manifest.unfinished,
            events_left_out: 0,
            other_events_left_out: 0,
        }
    }

    /// Adds the results of a run that has ended.
    pub fn complete(&mut self, outcome: Vec<Line>, encoder: &Encoder) {
        (self.outcome, self.live) = (outcome, false);
        self.problems = problems(encoder.alarms());
        let (gaps, alarms) = (encoder.gaps(), encoder.alarms());
        let left_out = |all: usize| all.saturating_sub(PROBLEMS_MAX) as u64;
        self.problems_left_out = left_out(gaps.len()) + left_out(alarms.len());
        self.gaps = longest(gaps, |gap| gap.end_us - gap.begin_us);
        self.alarms = longest(alarms.to_vec(), |alarm| alarm.end_us - alarm.begin_us);
        self.events_left_out = encoder.events_left_out();
        self.other_events_left_out = encoder.other_events_left_out();
    }

    /// Serialises the head to JSON.
    pub fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }
}
