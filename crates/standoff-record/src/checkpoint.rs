//! Checkpoint of an unfinished record: the data that its growing tables lack to be readable.
//!
//! A Parquet file is readable only after its footer has been written. Therefore the writer regularly saves one small
//! file that contains, for every table, the footer of the data in the table's file and the rows that are not in it yet:
//!
//! ```text
//! "standoff partial" | last time, us    | a table | ... | CRC-32 of the above
//!      16 bytes             8                               4
//! table: lengths of its footer and of its rows, 8 bytes each | footer in Parquet format | rows: complete Parquet file
//! ```
//!
//! Numbers are little-endian. The tables are in the order of `frame_tables`; a table that the record lacks has two lengths
//! of 0. Tables only grow, and this file is replaced as a whole, so it matches the tables however
//! the run ends. A checkpoint without tables means that the files of the tables are complete.

use std::fs;
use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;

use standoff_io::atomic_file;
use standoff_io::bounded_input::{self, Input};
use standoff_io::parquet_file::{self, Footer, Source};

use crate::RecordError;
use crate::column::Row;
use crate::frame::TruthRow;
use crate::schema::{OF_AGENTS, TIMED, frame_tables};
use crate::table::Missing;

/// Name of the file.
pub(crate) const CHECKPOINT: &str = "checkpoint";

/// Maximum size of a checkpoint, bytes: for every table, less than a row group, and the footer.
const MAX_BYTES: u64 = 128 << 20;

const MAGIC: &[u8; 16] = b"standoff partial";

/// Writes the checkpoint of a record. `tables` are in the order of [`frame_tables`]; empty if the files are complete.
pub(crate) fn write(dir: &Path, last_us: i64, tables: &[Option<Missing>]) -> Result<(), RecordError> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(last_us.to_le_bytes());
    for table in tables {
        let (footer, rows) = table.as_ref().map_or((&[][..], &[][..]), |table| (&table.footer, &table.rows));
        bytes.extend((footer.len() as u64).to_le_bytes());
        bytes.extend((rows.len() as u64).to_le_bytes());
        bytes.extend(footer);
        bytes.extend(rows);
    }
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    let path = dir.join(CHECKPOINT);
    let saved = atomic_file::save(&path, bytes).and_then(|()| atomic_file::sync_folder(dir));
    saved.map_err(|reason| RecordError::write(&path, reason))
}

/// True if a record has a checkpoint, valid or not.
pub(crate) fn is_in(dir: &Path) -> bool {
    dir.join(CHECKPOINT).is_file()
}

/// Removes the checkpoint of a completed record.
pub(crate) fn remove(dir: &Path) -> Result<(), RecordError> {
    let path = dir.join(CHECKPOINT);
    if !is_in(dir) {
        return Ok(());
    }
    fs::remove_file(&path).map_err(|reason| RecordError::write(&path, reason))
}

/// Checkpoint of an unfinished record.
#[derive(Debug)]
pub(crate) struct Checkpoint {
    file: Arc<Input>,
    /// Time of the last frame in it.
    pub(crate) last_us: i64,
    /// In the order of [`frame_tables`], `None` for those that the record lacks; empty if the files are complete.
    tables: Vec<Option<Table>>,
}

#[derive(Debug)]
struct Table {
    footer: Footer,
    rows: Footer,
}

impl Checkpoint {
    /// Reads the checkpoint in `dir`.
    pub(crate) fn read(dir: &Path) -> Result<Self, RecordError> {
        let path = dir.join(CHECKPOINT);
        // Read and kept open as the same file: a run in progress may replace it meanwhile.
        let unreadable = |reason| RecordError::read(&path, reason);
        let mut file = bounded_input::open(&path, MAX_BYTES).map_err(unreadable)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(unreadable)?;
        let broken = || RecordError::damaged(&path, "its checksum is wrong");
        let (contents, crc) = bytes.split_last_chunk().ok_or_else(broken)?;
        let head = contents.strip_prefix(MAGIC).and_then(|contents| contents.split_first_chunk());
        let (last_us, mut rest) =
            head.filter(|_| crc32fast::hash(contents) == u32::from_le_bytes(*crc)).ok_or_else(broken)?;
        let mut tables = Vec::new();
        let all = frame_tables().count();
        while !rest.is_empty() && tables.len() < all {
            let at = contents.len() - rest.len();
            let (table, after) = split_table(rest, at).map_err(|error| RecordError::parquet_read(&path, error))?;
            tables.push(table);
            rest = after;
        }
        // The record of a real flight has no truth.
        let is_there = |(name, table): (&str, &Option<Table>)| table.is_some() || name == TruthRow::TABLE;
        let has_all = tables.len() == all && TIMED.into_iter().zip(&tables).all(is_there);
        let of_agents = tables.iter().skip(all - OF_AGENTS.len()).map(Option::is_some);
        let is_sound = tables.is_empty() || has_all && of_agents.clone().all(|is| Some(is) == of_agents.clone().next());
        if !is_sound || !rest.is_empty() {
            return Err(RecordError::damaged(&path, "it does not contain the tables of a record"));
        }
        Ok(Self { file: Arc::new(file), last_us: i64::from_le_bytes(*last_us), tables })
    }

    /// True if the checkpoint was written before a table existed.
    pub(crate) fn is_without(&self, table: &str) -> bool {
        frame_tables().zip(&self.tables).any(|(name, found)| name == table && found.is_none())
    }

    /// Returns the sources of the rows of a table, given its own file; `None` if that file is complete.
    pub(crate) fn sources(&self, table: &str, file: Input) -> Option<[Source; 2]> {
        let (_, found) = frame_tables().zip(&self.tables).find(|(name, _)| *name == table)?;
        let Table { footer, rows } = found.as_ref()?;
        Some([Source::with_footer(Arc::new(file), footer), Source::with_footer(Arc::clone(&self.file), rows)])
    }
}

/// Splits off the first table of the bytes, which start at `at` in the file, and returns it with the rest; `None` for a
/// table that the record lacks.
fn split_table(bytes: &[u8], at: usize) -> Result<(Option<Table>, &[u8]), parquet_file::Error> {
    let split = || {
        let (footer_length, bytes) = bytes.split_first_chunk()?;
        let (rows_length, bytes) = bytes.split_first_chunk()?;
        let length = |bytes: &[u8; 8]| usize::try_from(u64::from_le_bytes(*bytes)).ok();
        let (footer, bytes) = bytes.split_at_checked(length(footer_length)?)?;
        let (rows, bytes) = bytes.split_at_checked(length(rows_length)?)?;
        Some((footer, rows, bytes))
    };
    let breaks_off = || parquet_file::Error::Damaged("a table is truncated".to_owned());
    let (footer, rows, rest) = split().ok_or_else(breaks_off)?;
    if footer.is_empty() && rows.is_empty() {
        return Ok((None, rest));
    }
    // The size of data in memory is far below that limit.
    let offset = i64::try_from(at + 8 + 8 + footer.len()).unwrap_or(i64::MAX);
    let table = Table { footer: Footer::at_end_of(footer, 0)?, rows: Footer::at_end_of(rows, offset)? };
    Ok((Some(table), rest))
}
