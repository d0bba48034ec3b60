//! How far an unfinished record tells: what its growing tables lack to be read.
//!
//! A Parquet file is readable only once its footer is written. So now and then a writer puts into one small file, for
//! every table, the footer of what has gone into the table's file, and the rows that have not:
//!
//! ```text
//! "standoff partial" | last instant, us | a table | ... | CRC-32 of all that
//!      16 bytes             8                               4
//! table: lengths of its footer and of its rows, 8 bytes each | footer, as Parquet has it | rows: a whole Parquet file
//! ```
//!
//! Numbers are little-endian. Tables only grow, and the file is replaced as a whole: it fits them whatever ends the run.
//! Without tables it says that theirs are whole. Those of intruders, and of what each of several minds
//! believes, come last, if they are there.

use std::fs::{self, File};
use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;

use standoff_parquet::{Footer, Source};

use super::RecordError;
use super::rows::{OF_AGENTS, TIMED};
use super::table::{Missing, Row as _};
use crate::frame::IntruderRow;
use crate::{disk, input};

/// Name of the file.
pub(super) const CHECKPOINT: &str = "checkpoint";

/// Largest checkpoint, bytes: fewer rows than a row group has, of every table, and their footers.
const MAX_BYTES: u64 = 128 << 20;

const MAGIC: &[u8; 16] = b"standoff partial";

/// Writes the checkpoint of a record: `tables` in the order of [`TIMED`], then the intruders' and [`OF_AGENTS`] if there
/// are some, or none if they are whole.
pub(super) fn write(dir: &Path, last_us: i64, tables: &[Missing]) -> Result<(), RecordError> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(last_us.to_le_bytes());
    for Missing { footer, rows } in tables {
        bytes.extend((footer.len() as u64).to_le_bytes());
        bytes.extend((rows.len() as u64).to_le_bytes());
        bytes.extend(footer);
        bytes.extend(rows);
    }
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    let path = dir.join(CHECKPOINT);
    let saved = disk::save(&path, bytes).and_then(|()| disk::sync_folder(dir));
    saved.map_err(|reason| RecordError::write(&path, reason))
}

/// A record has a checkpoint; whether it is whole is not looked at.
pub(super) fn is_in(dir: &Path) -> bool {
    dir.join(CHECKPOINT).is_file()
}

/// Removes the checkpoint of a record that needs none any more.
pub(super) fn remove(dir: &Path) -> Result<(), RecordError> {
    let path = dir.join(CHECKPOINT);
    if !is_in(dir) {
        return Ok(());
    }
    fs::remove_file(&path).map_err(|reason| RecordError::write(&path, reason))
}

/// The checkpoint of an unfinished record.
#[derive(Debug)]
pub(super) struct Checkpoint {
    file: Arc<File>,
    /// The last instant it tells of.
    pub(super) last_us: i64,
    /// Of each of [`TIMED`], then of the intruders and of [`OF_AGENTS`] if there are some, unless they are whole.
    tables: Vec<Table>,
}

#[derive(Debug)]
struct Table {
    footer: Footer,
    rows: Footer,
}

impl Checkpoint {
    /// Reads the checkpoint in `dir`.
    pub(super) fn read(dir: &Path) -> Result<Self, RecordError> {
        let path = dir.join(CHECKPOINT);
        // Read and kept open as one: a run that goes on may replace the file meanwhile.
        let unreadable = |reason| RecordError::read(&path, reason);
        let mut file = input::open(&path, MAX_BYTES).map_err(unreadable)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(unreadable)?;
        let broken = || RecordError::damaged(&path, "its checksum is wrong");
        let (told, crc) = bytes.split_last_chunk().ok_or_else(broken)?;
        let head = told.strip_prefix(MAGIC).and_then(|told| told.split_first_chunk());
        let (last_us, mut rest) =
            head.filter(|_| crc32fast::hash(told) == u32::from_le_bytes(*crc)).ok_or_else(broken)?;
        let mut tables = Vec::new();
        // Their number tells which there are.
        const WITH_AGENTS: usize = TIMED.len() + OF_AGENTS.len();
        while !rest.is_empty() && tables.len() <= WITH_AGENTS {
            let at = told.len() - rest.len();
            let (table, after) = split_table(rest, at).map_err(|error| RecordError::parquet_read(&path, error))?;
            tables.push(table);
            rest = after;
        }
        let sound = [0, TIMED.len(), TIMED.len() + 1, WITH_AGENTS, WITH_AGENTS + 1];
        if !sound.contains(&tables.len()) || !rest.is_empty() {
            return Err(RecordError::damaged(&path, "it does not have the tables of a record"));
        }
        Ok(Self { file: Arc::new(file), last_us: i64::from_le_bytes(*last_us), tables })
    }

    /// Everything that it tells of was written before there were tables of what each of several minds believes.
    pub(super) fn is_without_agents(&self) -> bool {
        [TIMED.len(), TIMED.len() + 1].contains(&self.tables.len())
    }

    /// The same of the table of intruders.
    pub(super) fn is_without_intruders(&self) -> bool {
        [TIMED.len(), TIMED.len() + OF_AGENTS.len()].contains(&self.tables.len())
    }

    /// Where the rows of a table are, given its own file; `None` if that is whole.
    pub(super) fn sources(&self, table: &str, file: File) -> Option<[Source; 2]> {
        let intruders = Some(IntruderRow::TABLE).filter(|_| !self.is_without_intruders());
        let mut names = TIMED.into_iter().chain(intruders).chain(OF_AGENTS);
        let place = names.position(|name| name == table)?;
        let Table { footer, rows } = self.tables.get(place)?;
        Some([Source::with_footer(Arc::new(file), footer), Source::with_footer(Arc::clone(&self.file), rows)])
    }
}

/// The first table of the bytes, which begin at `at` in the file, and what follows it.
fn split_table(bytes: &[u8], at: usize) -> Result<(Table, &[u8]), standoff_parquet::Error> {
    let split = || {
        let (footer_length, bytes) = bytes.split_first_chunk()?;
        let (rows_length, bytes) = bytes.split_first_chunk()?;
        let length = |bytes: &[u8; 8]| usize::try_from(u64::from_le_bytes(*bytes)).ok();
        let (footer, bytes) = bytes.split_at_checked(length(footer_length)?)?;
        let (rows, bytes) = bytes.split_at_checked(length(rows_length)?)?;
        Some((footer, rows, bytes))
    };
    let breaks_off = || standoff_parquet::Error::Damaged("a table breaks off".to_owned());
    let (footer, rows, rest) = split().ok_or_else(breaks_off)?;
    // What is in memory has far fewer bytes than that.
    let offset = i64::try_from(at + 8 + 8 + footer.len()).unwrap_or(i64::MAX);
    let table = Table { footer: Footer::at_end_of(footer, 0)?, rows: Footer::at_end_of(rows, offset)? };
    Ok((table, rest))
}
