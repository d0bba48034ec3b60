//! Packed background map for the page: gzip of JSON, in whole decimetres, with delta-encoded points.
//!
//! ```text
//! {"format": 2, "credit": attribution, if required, "layers": [LAYER, ...]}
//! LAYER: {"kind": "green" | ... | "major", "width_m": of lines, "lines": [LINE, ...], "areas": [[LINE, ...], ...],
//!         "names": {name of a road: [index of LINE in "lines", ...], ...}, if there are any}
//! LINE: [x, y of the first point, then dx, dy of each next point, ...]
//! ```
//!
//! Layers are drawn in this order. An area is its outer ring followed by the rings of its holes; each ring ends where
//! it starts.

use std::collections::BTreeMap;
use std::io::{self, Read as _, Write as _};
use std::path::Path;

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use serde::{Deserialize, Serialize};
use standoff_io::display_text::printable;
use standoff_record::MAP_FILE;

use crate::feature_class::Kind;
use crate::limits::{MAX_NAME, MAX_PACKED, MAX_UNPACKED};

/// Format of the JSON, incremented when it changes.
const FORMAT: u32 = 2;
/// Oldest supported format; it has no names.
const FORMAT_MIN: u32 = 1;

/// A map, packed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packed {
    /// Gzip of JSON, as in a record and in the page.
    pub gz: Vec<u8>,
    /// Note on omitted contents, if any.
    pub note: Option<String>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Contents {
    pub(crate) format: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) credit: Option<String>,
    pub(crate) layers: Vec<Layer>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Layer {
    pub(crate) kind: Kind,
    pub(crate) width_m: f64,
    pub(crate) lines: Vec<Vec<i32>>,
    pub(crate) areas: Vec<Vec<Vec<i32>>>,
    /// Indices of lines by the name of their road.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) names: BTreeMap<String, Vec<u32>>,
}

impl Contents {
    pub(crate) fn new(credit: Option<String>, layers: Vec<Layer>) -> Self {
        Self { format: FORMAT, credit, layers }
    }

    /// Packs the map. The output does not contain when or where it was made. Returns `None` if it is too large.
    pub(crate) fn packed(&self) -> Option<Vec<u8>> {
        let json = serde_json::to_vec(self).ok()?;
        if json.len() as u64 > MAX_UNPACKED {
            return None;
        }
        let mut gz = GzEncoder::new(Vec::new(), Compression::default());
        gz.write_all(&json).ok()?;
        gz.finish().ok().filter(|gz| gz.len() <= MAX_PACKED)
    }
}

/// Returns the packed map of the record in `dir`, if there is one. An invalid file gives an error message.
pub fn of_record(dir: &Path) -> Result<Option<Packed>, String> {
    let path = dir.join(MAP_FILE);
    let bytes = match standoff_io::bounded_input::bytes(&path, MAX_PACKED as u64) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(format!("{MAP_FILE} cannot be read: {error}")),
    };
    check(&bytes).map_err(|what| format!("{MAP_FILE} is not a valid packed map: {what}"))?;
    Ok(Some(Packed { gz: bytes, note: None }))
}

/// Refuses data that `Contents::packed` cannot produce.
pub(crate) fn check(gz: &[u8]) -> Result<(), String> {
    let mut json = Vec::new();
    let read = GzDecoder::new(gz).take(MAX_UNPACKED + 1).read_to_end(&mut json);
    read.map_err(|error| printable(&error.to_string()))?;
    if json.len() as u64 > MAX_UNPACKED {
        return Err(format!("it unpacks to more than {MAX_UNPACKED} bytes"));
    }
    let contents: Contents = serde_json::from_slice(&json).map_err(|error| printable(&error.to_string()))?;
    if !(FORMAT_MIN..=FORMAT).contains(&contents.format) {
        return Err(format!("it has format {}; supported are {FORMAT_MIN} to {FORMAT}", contents.format));
    }
    let are_pairs = contents.layers.iter().all(|layer| {
        layer.lines.iter().chain(layer.areas.iter().flatten()).all(|line| line.len() >= 4 && line.len() % 2 == 0)
    });
    let widths = contents.layers.iter().all(|layer| (0.0..=1000.0).contains(&layer.width_m));
    let names = contents.layers.iter().all(|layer| {
        let exists = |index: &u32| (*index as usize) < layer.lines.len();
        layer.names.iter().all(|(name, lines)| name.len() <= MAX_NAME && lines.iter().all(exists))
    });
    let credit = contents.credit.is_none_or(|credit| credit.chars().count() <= 100);
    for (is_right, what) in [(are_pairs, "lines"), (widths, "widths"), (names, "names"), (credit, "credit")] {
        if !is_right {
            return Err(format!("invalid {what}"));
        }
    }
    Ok(())
}
