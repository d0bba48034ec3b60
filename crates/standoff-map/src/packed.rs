//! A map as the page takes it: gzip of JSON, whole decimetres, every point told from the one before.
//!
//! ```text
//! {"format": 1, "credit": who made it, if that has to be said, "layers": [LAYER, ...]}
//! LAYER: {"kind": "green" | ... | "major", "width_m": of its lines, "lines": [LINE, ...], "areas": [[LINE, ...], ...]}
//! LINE: [x, y of the first point, and then by how much x and y go on, ...]
//! ```
//!
//! Layers lie one on the other as they stand. An area is the ring around it and those around its holes, each ending where it
//! begins.

use std::io::{self, Read as _, Write as _};
use std::path::Path;

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use serde::{Deserialize, Serialize};
use standoff_sim::record::MAP_FILE;
use standoff_sim::text::words;

use crate::kind::Kind;
use crate::limit::{MAX_PACKED, MAX_UNPACKED};

/// Format of the JSON; it rises when that changes.
const FORMAT: u32 = 1;

/// A map, packed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packed {
    /// Gzip of JSON: what a record keeps and a page shows.
    pub gz: Vec<u8>,
    /// What was left out of it, in a sentence, if anything was.
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
}

impl Contents {
    pub(crate) fn new(credit: Option<String>, layers: Vec<Layer>) -> Self {
        Self { format: FORMAT, credit, layers }
    }

    /// Gzip of it; nothing in that tells when or where it was made. `None` if it is too large.
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

/// The map of the record in `dir`, if there is one: as it was packed, and nothing else. What is none says so in a sentence.
pub fn of_record(dir: &Path) -> Result<Option<Packed>, String> {
    let path = dir.join(MAP_FILE);
    let bytes = match standoff_sim::source::bytes(&path, MAX_PACKED as u64) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(format!("{MAP_FILE} cannot be read: {error}")),
    };
    check(&bytes).map_err(|what| format!("{MAP_FILE} is no map as it was packed: {what}"))?;
    Ok(Some(Packed { gz: bytes, note: None }))
}

/// Refuses what `Contents::packed` does not give.
pub(crate) fn check(gz: &[u8]) -> Result<(), String> {
    let mut json = Vec::new();
    let read = GzDecoder::new(gz).take(MAX_UNPACKED + 1).read_to_end(&mut json);
    read.map_err(|error| words(&error.to_string()))?;
    if json.len() as u64 > MAX_UNPACKED {
        return Err(format!("it unpacks to more than {MAX_UNPACKED} bytes"));
    }
    let contents: Contents = serde_json::from_slice(&json).map_err(|error| words(&error.to_string()))?;
    if contents.format != FORMAT {
        return Err(format!("it has format {}; known is {FORMAT}", contents.format));
    }
    let are_pairs = contents.layers.iter().all(|layer| {
        layer.lines.iter().chain(layer.areas.iter().flatten()).all(|line| line.len() >= 4 && line.len() % 2 == 0)
    });
    let widths = contents.layers.iter().all(|layer| (0.0..=1000.0).contains(&layer.width_m));
    let credit = contents.credit.is_none_or(|credit| credit.chars().count() <= 100);
    for (is_right, what) in [(are_pairs, "lines"), (widths, "widths"), (credit, "credit")] {
        if !is_right {
            return Err(format!("its {what} cannot be what was packed"));
        }
    }
    Ok(())
}
