//! One half of a part: a directory and its tables, compressed.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;
use standoff_sim::record::EventRow;

use super::table::{Directory, Table};
use crate::serve::Bytes;

/// An event, as the page lists it.
#[derive(Debug, Serialize)]
pub(super) struct Event {
    time_us: i64,
    kind: String,
    target: Option<u32>,
    group: Option<u32>,
    to_group: Option<u32>,
    uavs: Vec<u32>,
    reason: String,
}

impl Event {
    pub(super) fn of(time_us: i64, row: &EventRow) -> Self {
        let EventRow { kind, target, group, to_group, uavs, .. } = row.clone();
        Self { time_us, kind, target, group, to_group, uavs, reason: row.why() }
    }
}

#[derive(Serialize)]
struct Contents<'a> {
    times_us: &'a [i64],
    events: &'a [Event],
    tables: Vec<Directory>,
}

/// Gzip of it all.
pub(super) fn half(times_us: &[i64], events: &[Event], tables: &[&Table]) -> Bytes {
    let contents = Contents { times_us, events, tables: tables.iter().map(|table| table.directory()).collect() };
    let directory = serde_json::to_vec(&contents).unwrap_or_default();
    let mut bytes = (directory.len() as u32).to_le_bytes().to_vec();
    bytes.extend(directory);
    tables.iter().for_each(|table| table.write(&mut bytes));
    gzip(&bytes).into()
}

/// Gzip of bytes; nothing in it tells when or where it was made.
pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut gz = GzEncoder::new(Vec::new(), Compression::default());
    // Writing to a vector cannot fail.
    let _ = gz.write_all(bytes);
    gz.finish().unwrap_or_default()
}
