//! A block of a part: a directory and its tables, compressed.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;
use standoff::math::hypot;
use standoff_record::{AgentEventRow, EventRow, Frame, IntruderRow};

use super::table::{Directory, Table};
use crate::Bytes;

/// An event in the page's list.
#[derive(Debug, Serialize)]
pub(super) struct Event {
    time_us: i64,
    kind: String,
    target: Option<u32>,
    group: Option<u32>,
    to_group: Option<u32>,
    uavs: Vec<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    intruder: Option<u32>,
    reason: String,
    /// With one agent per UAV: the agents that report the event.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) by: Vec<u32>,
    /// Time of the event in the state of these agents, if it differs from `time_us`.
    #[serde(skip_serializing_if = "Option::is_none")]
    event_time_us: Option<i64>,
    /// True if the event is not committed and may still change.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    provisional: bool,
}

impl Event {
    pub(super) fn of(time_us: i64, row: &EventRow) -> Self {
        let EventRow { kind, group, to_group, uavs, intruder, .. } = row.clone();
        let reason = row.reason_text();
        Self {
            time_us,
            kind,
            target: row.target_or_track(),
            group,
            to_group,
            uavs,
            intruder,
            reason,
            by: Vec::new(),
            event_time_us: None,
            provisional: false,
        }
    }

    /// Adds an agent that reports the event.
    pub(super) fn reported_by(&mut self, of: &AgentEventRow) {
        self.by.push(of.agent);
        self.event_time_us = Some(of.event_time_us).filter(|event_time_us| *event_time_us != self.time_us);
        self.provisional = of.provisional;
    }

    /// Returns true if the events are equal apart from the reporting agents.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        let key = |event: &Self| (event.time_us, event.event_time_us, event.provisional, event.target, event.group);
        key(self) == key(other)
            && (self.to_group, &self.kind, &self.uavs, &self.reason)
                == (other.to_group, &other.kind, &other.uavs, &other.reason)
    }
}

/// An intruder further than this from every UAV is not relevant, and the map need not be extended to show it, m.
/// `scene.js` uses the same distance.
const RELEVANT_M: f64 = 1200.0;

/// Axis-aligned bounding box of everything shown in several time steps.
#[derive(Debug, Default)]
pub(super) struct PartBounds {
    /// West, south, east, north, m.
    around_m: Option<[f64; 4]>,
}

impl PartBounds {
    /// Extends the box by UAVs, intruders near them, orbits, and true and estimated positions of targets.
    pub(super) fn take(&mut self, frame: &Frame) {
        frame.uavs.iter().for_each(|row| self.put(row.x_m, row.y_m, 0.0));
        let is_near =
            |row: &&IntruderRow| frame.uavs.iter().any(|uav| hypot(uav.x_m - row.x_m, uav.y_m - row.y_m) <= RELEVANT_M);
        frame.intruders.iter().filter(is_near).for_each(|row| self.put(row.x_m, row.y_m, 0.0));
        frame.groups.iter().for_each(|row| self.put(row.x_m, row.y_m, row.standoff_distance_m));
        frame.truth.iter().for_each(|row| self.put(row.x_m, row.y_m, 0.0));
        frame.tracks.iter().for_each(|row| self.put(row.state[0], row.state[3], 0.0));
    }

    fn put(&mut self, x_m: f64, y_m: f64, radius_m: f64) {
        let circle_m = [x_m - radius_m, y_m - radius_m, x_m + radius_m, y_m + radius_m];
        if circle_m.iter().all(|side_m| side_m.is_finite()) {
            let [west, south, east, north] = self.around_m.unwrap_or(circle_m);
            let [w, s, e, n] = circle_m;
            self.around_m = Some([west.min(w), south.min(s), east.max(e), north.max(n)]);
        }
    }

    /// Bounds rounded outwards to whole metres; `None` if the box is empty.
    pub(super) fn listed_m(&self) -> Option<[f64; 4]> {
        self.around_m.map(|[west, south, east, north]| [west.floor(), south.floor(), east.ceil(), north.ceil()])
    }
}

#[derive(Serialize)]
struct Contents<'a> {
    times_us: &'a [i64],
    #[serde(skip_serializing_if = "Option::is_none")]
    bounds_m: Option<[f64; 4]>,
    events: &'a [Event],
    tables: Vec<Directory>,
}

/// Serialises and compresses a block.
pub(super) fn block<'a>(
    times_us: &[i64],
    bounds_m: Option<[f64; 4]>,
    events: &[Event],
    tables: impl IntoIterator<Item = &'a Table>,
) -> Bytes {
    let tables: Vec<&Table> = tables.into_iter().collect();
    let contents =
        Contents { times_us, bounds_m, events, tables: tables.iter().map(|table| table.directory()).collect() };
    let directory = serde_json::to_vec(&contents).unwrap_or_default();
    let mut bytes = (directory.len() as u32).to_le_bytes().to_vec();
    bytes.extend(directory);
    tables.iter().for_each(|table| table.write(&mut bytes));
    gzip(&bytes).into()
}

/// Compresses bytes with gzip, without time stamp or file name, so that the result is reproducible.
pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut gz = GzEncoder::new(Vec::new(), Compression::default());
    // Writing to a vector cannot fail.
    let _ = gz.write_all(bytes);
    gz.finish().unwrap_or_default()
}
