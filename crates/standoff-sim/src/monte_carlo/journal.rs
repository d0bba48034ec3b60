//! The journal of a batch: every complete run, kept so that no end of the process loses it or makes it wrong.
//!
//! ```text
//! "standoff journal" | length of the batch | its CRC-32 | CRC-32 of all that | the batch, JSON | slot 0 | slot 1 | ...
//!     16 bytes                4                 4               4
//! slot: run, 8 bytes | a double per metric, NaN where there was nothing to measure | CRC-32, 4 bytes
//! ```
//!
//! Numbers are little-endian. Every run has its own place, in the order of runs, and a checksum that starts from the
//! batch's: a slot that was never written, was torn, was changed or belongs to another batch is not a run, and is flown
//! again. So the order in which runs end does not matter, and reading them back takes no memory, and no time for runs
//! behind the last that was kept.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::batch::{Batch, Values};
use super::error::{FORMAT, MonteCarloError};
use crate::disk;
use crate::record::RecordError;
use crate::text::{self, words};

/// Name of the file.
const JOURNAL: &str = "monte-carlo.journal";

const MAGIC: &[u8; 16] = b"standoff journal";

/// Magic, length of the batch, its checksum and their checksum.
const PREAMBLE: usize = 16 + 4 + 4 + 4;

/// Largest description of a batch, bytes: the scenario's text and some 2,000 more.
pub(super) const MAX_BATCH: u64 = 8 << 20;

/// What is written is seen onto the disk this often: what a power cut may cost.
const SYNC_EVERY: Duration = Duration::from_secs(1);

/// There is a journal in `dir`.
pub(super) fn is_in(dir: &Path) -> bool {
    dir.join(JOURNAL).is_file()
}

/// Another process writes the journal in `dir`.
pub(super) fn is_in_use(dir: &Path) -> bool {
    File::open(dir.join(JOURNAL)).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Removes the journal that a complete batch has left, if it has.
pub(super) fn remove_left_over(dir: &Path) {
    // It is in nobody's way.
    let _ = fs::remove_file(dir.join(JOURNAL));
}

/// Sees new names in a folder onto the disk.
pub(super) fn sync_folder(dir: &Path) -> Result<(), RecordError> {
    disk::sync_folder(dir).map_err(|reason| RecordError::write(dir, reason))
}

/// An open journal, which no other process may write.
#[derive(Debug)]
pub(super) struct Journal {
    dir: PathBuf,
    file: File,
    slots: Slots,
    metrics: Vec<String>,
    unsynced: bool,
    synced: Instant,
}

/// Where the runs are in the file.
#[derive(Debug, Clone)]
struct Slots {
    /// Offset of the first.
    start: u64,
    runs: Range<u64>,
    metrics: usize,
    /// What every slot's checksum starts from.
    seal: u32,
}

impl Journal {
    /// Opens the journal of `batch` in `dir`, or begins one: the folder is made if it is not there.
    ///
    /// Refuses the journal of another batch, one that another process writes, and one whose beginning is damaged. One
    /// that breaks off before its first slot holds nothing yet and is begun again.
    pub(super) fn open(dir: &Path, batch: &Batch) -> Result<Self, MonteCarloError> {
        let path = dir.join(JOURNAL);
        let refused = |reason| RecordError::write(&path, reason);
        fs::create_dir_all(dir).map_err(|reason| RecordError::write(dir, reason))?;
        // Where a link leads to, something else may lie.
        if fs::symlink_metadata(&path).is_ok_and(|found| !found.is_file()) {
            return Err(RecordError::Occupied { dir: dir.to_owned(), what: JOURNAL.to_owned() }.into());
        }
        let mut file =
            File::options().read(true).write(true).create(true).truncate(false).open(&path).map_err(refused)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                // Of another batch nobody needs to wait for the end.
                read_head(&mut file, &path)?.map_or(Ok(()), |there| batch.must_be(&there, dir))?;
                return Err(RecordError::InUse { dir: dir.to_owned() }.into());
            }
            // Where files cannot be locked, batches are trusted to have folders of their own.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        let json = serde_json::to_vec(batch).map_err(|error| RecordError::write(Path::new(JOURNAL), error.into()))?;
        let (head, seal) = head(&json)?;
        let runs = batch.flown();
        let slots = Slots { start: head.len() as u64, runs, metrics: batch.metrics.len(), seal };
        match read_head(&mut file, &path)? {
            Some(there) => batch.must_be(&there, dir)?,
            None => {
                file.set_len(0).and_then(|()| file.rewind()).map_err(refused)?;
                file.write_all(&head).and_then(|()| file.sync_all()).map_err(refused)?;
                sync_folder(dir)?;
            }
        }
        let metrics = batch.metrics.clone();
        Ok(Self { dir: dir.to_owned(), file, slots, metrics, unsynced: false, synced: Instant::now() })
    }

    /// Where it lies.
    pub(super) fn dir(&self) -> &Path {
        &self.dir
    }

    /// Keeps a run: `values` has one value per metric.
    pub(super) fn put(&mut self, seed: u64, run: u64, values: &[Option<f64>]) -> Result<(), MonteCarloError> {
        for (value, metric) in values.iter().zip(&self.metrics) {
            if value.is_some_and(|value| !value.is_finite()) {
                return Err(MonteCarloError::NotFinite { seed, metric: metric.clone() });
            }
        }
        let slot = self.slots.encode(run, values);
        let at = SeekFrom::Start(self.slots.offset(run));
        self.unsynced = true;
        let written = self.file.seek(at).and_then(|_| self.file.write_all(&slot));
        written.map_err(|reason| self.refused(reason))
    }

    /// Sees what was kept onto the disk, if the last time is a while ago.
    pub(super) fn sync_now_and_then(&mut self) -> Result<(), MonteCarloError> {
        if self.synced.elapsed() < SYNC_EVERY { Ok(()) } else { self.sync() }
    }

    /// Sees what was kept onto the disk.
    pub(super) fn sync(&mut self) -> Result<(), MonteCarloError> {
        if self.unsynced {
            // A second try might pass without the data being there: whoever fails here once gives up.
            self.file.sync_data().map_err(|reason| self.refused(reason))?;
            self.unsynced = false;
        }
        self.synced = Instant::now();
        Ok(())
    }

    /// Every run in order: its values, or `None` if it is not complete. When `stop` is set, as in the methods below, an
    /// error that says so.
    pub(super) fn rows<'a>(&self, stop: &'a AtomicBool) -> Result<Rows<'a>, MonteCarloError> {
        let path = self.dir.join(JOURNAL);
        let opened = File::open(&path).and_then(|file| Rows::new(path.clone(), file, self.slots.clone(), stop));
        Ok(opened.map_err(|reason| RecordError::read(&path, reason))?)
    }

    /// The runs that are not complete yet. Those that are being flown meanwhile do not come twice.
    pub(super) fn missing<'a>(
        &self,
        stop: &'a AtomicBool,
    ) -> Result<impl Iterator<Item = Result<u64, MonteCarloError>> + Send + use<'a>, MonteCarloError> {
        Ok(self.rows(stop)?.filter_map(|row| match row {
            Ok((_, Some(_))) => None,
            Ok((run, None)) => Some(Ok(run)),
            Err(error) => Some(Err(error)),
        }))
    }

    /// Every run's values, in order; all must be complete.
    pub(super) fn complete_rows<'a>(
        &self,
        stop: &'a AtomicBool,
    ) -> Result<impl Iterator<Item = Result<Values, MonteCarloError>> + use<'a>, MonteCarloError> {
        let path = self.dir.join(JOURNAL);
        Ok(self.rows(stop)?.map(move |row| match row? {
            (_, Some(values)) => Ok(values),
            (run, None) => Err(RecordError::read(&path, io::Error::other(format!("run {run} was not kept"))).into()),
        }))
    }

    /// The first complete run.
    pub(super) fn first_complete(&self, stop: &AtomicBool) -> Result<Option<(u64, Values)>, MonteCarloError> {
        let rows = self.rows(stop)?.with_a_slot();
        rows.filter_map(|row| row.map(|(run, values)| Some((run, values?))).transpose()).next().transpose()
    }

    /// Number of complete runs.
    pub(super) fn count(&self, stop: &AtomicBool) -> Result<u64, MonteCarloError> {
        self.rows(stop)?.with_a_slot().try_fold(0, |n, row| Ok(n + u64::from(row?.1.is_some())))
    }

    /// Ends the journal: its runs are kept elsewhere.
    pub(super) fn remove(self) -> Result<(), MonteCarloError> {
        let path = self.dir.join(JOURNAL);
        match fs::remove_file(&path) {
            // Another process has found the batch complete meanwhile.
            Err(reason) if reason.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => Ok(removed.map_err(|reason| RecordError::write(&path, reason))?),
        }
    }

    fn refused(&self, reason: io::Error) -> MonteCarloError {
        RecordError::write(&self.dir.join(JOURNAL), reason).into()
    }
}

impl Slots {
    /// Bytes of a slot.
    fn size(&self) -> usize {
        8 + 8 * self.metrics + 4
    }

    fn offset(&self, run: u64) -> u64 {
        self.start + (run - self.runs.start) * self.size() as u64
    }

    fn encode(&self, run: u64, values: &[Option<f64>]) -> Vec<u8> {
        let mut slot = run.to_le_bytes().to_vec();
        slot.extend(values.iter().flat_map(|value| value.unwrap_or(f64::NAN).to_le_bytes()));
        slot.extend(self.checksum(&slot).to_le_bytes());
        slot
    }

    /// The values in the slot of `run`, if they are that.
    fn decode(&self, run: u64, slot: &[u8]) -> Option<Values> {
        let (row, checksum) = slot.split_last_chunk()?;
        let (number, values) = row.split_first_chunk()?;
        let whole = self.checksum(row) == u32::from_le_bytes(*checksum) && u64::from_le_bytes(*number) == run;
        let values = || values.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
        // None is ever put that is infinite.
        (whole && !values().any(f64::is_infinite))
            .then(|| values().map(|value| Some(value).filter(|value| !value.is_nan())).collect())
    }

    fn checksum(&self, row: &[u8]) -> u32 {
        let mut crc = crc32fast::Hasher::new_with_initial(self.seal);
        crc.update(row);
        crc.finalize()
    }
}

/// Reads the runs of a journal, one after the other; ends after an error.
pub(super) struct Rows<'a> {
    path: PathBuf,
    file: BufReader<File>,
    slots: Slots,
    /// What was read last.
    slot: Vec<u8>,
    left: Range<u64>,
    /// The first run for which the file has no slot: nothing is read for it and those behind it.
    first_without: u64,
    stop: &'a AtomicBool,
}

impl<'a> Rows<'a> {
    fn new(path: PathBuf, mut file: File, slots: Slots, stop: &'a AtomicBool) -> io::Result<Self> {
        let bytes = file.metadata()?.len().saturating_sub(slots.start);
        let first_without = slots.runs.start + bytes / slots.size() as u64;
        file.seek(SeekFrom::Start(slots.start))?;
        let (file, slot, left) = (BufReader::new(file), vec![0; slots.size()], slots.runs.clone());
        Ok(Self { path, file, slots, slot, left, first_without, stop })
    }

    /// Without those behind the last slot, none of which is complete: there may be a hundred million.
    fn with_a_slot(mut self) -> Self {
        self.left.end = self.left.end.min(self.first_without);
        self
    }

    /// The values of the next run.
    fn read(&mut self, run: u64) -> Result<Option<Values>, MonteCarloError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(MonteCarloError::Interrupted);
        }
        if run >= self.first_without {
            return Ok(None);
        }
        self.file.read_exact(&mut self.slot).map_err(|reason| RecordError::read(&self.path, reason))?;
        Ok(self.slots.decode(run, &self.slot))
    }
}

impl Iterator for Rows<'_> {
    type Item = Result<(u64, Option<Values>), MonteCarloError>;

    fn next(&mut self) -> Option<Self::Item> {
        let run = self.left.next()?;
        let row = self.read(run).map(|values| (run, values));
        if row.is_err() {
            self.left = 0..0;
        }
        Some(row)
    }
}

/// The beginning of the journal of a batch, which is told as JSON, and the checksum from which its slots start.
fn head(json: &[u8]) -> Result<(Vec<u8>, u32), MonteCarloError> {
    let length = u32::try_from(json.len()).ok().filter(|&length| u64::from(length) <= MAX_BATCH);
    let length = length.ok_or_else(|| RecordError::damaged(Path::new(JOURNAL), "scenario too long"))?;
    let seal = crc32fast::hash(json);
    let mut head = MAGIC.to_vec();
    head.extend(length.to_le_bytes());
    head.extend(seal.to_le_bytes());
    head.extend(crc32fast::hash(&head).to_le_bytes());
    head.extend(json);
    Ok((head, seal))
}

/// The batch of a journal; `None` if the file breaks off before its first slot.
fn read_head(file: &mut File, path: &Path) -> Result<Option<Batch>, MonteCarloError> {
    let unreadable = |reason| RecordError::read(path, reason);
    let damaged = |what: &str| {
        let (journal, what) = (text::path(path), words(what));
        MonteCarloError::Folder(format!("{journal} is damaged: {what}; remove it to fly all its runs again"))
    };
    let size = file.metadata().map_err(unreadable)?.len();
    let mut preamble = [0; PREAMBLE];
    if size < PREAMBLE as u64 {
        return Ok(None);
    }
    file.read_exact(&mut preamble).map_err(unreadable)?;
    let word = |at: usize| preamble[at..].first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    if !preamble.starts_with(MAGIC) || word(24) != crc32fast::hash(&preamble[..24]) {
        return Err(damaged("it does not begin as a journal"));
    }
    let length = word(16);
    if u64::from(length) > MAX_BATCH {
        return Err(damaged("what was flown is too long"));
    }
    if size < PREAMBLE as u64 + u64::from(length) {
        return Ok(None);
    }
    let mut json = vec![0; length as usize];
    file.read_exact(&mut json).map_err(unreadable)?;
    if crc32fast::hash(&json) != word(20) {
        return Err(damaged("what was flown cannot be read"));
    }
    check_format(&json, path)?.map_err(|error| damaged(&error.to_string()))?;
    let batch: Batch = serde_json::from_slice(&json).map_err(|error| damaged(&error.to_string()))?;
    batch.check().map_err(|error| damaged(&error.to_string()))?;
    Ok(Some(batch))
}

/// Refuses another format than ours before anything else of it is read.
pub(super) fn check_format(json: &[u8], path: &Path) -> Result<serde_json::Result<()>, MonteCarloError> {
    match serde_json::from_slice(json) {
        Ok(Heading { format: FORMAT, .. }) => Ok(Ok(())),
        Ok(Heading { format, version }) => {
            let there = format!("{} has format {format} of standoff {}", text::path(path), words(&version));
            Err(MonteCarloError::Folder(format!("{there}, this one knows {FORMAT}; use that version")))
        }
        Err(error) => Ok(Err(error)),
    }
}

/// What every format of a batch begins with.
#[derive(serde::Deserialize)]
struct Heading {
    format: u64,
    version: String,
}

#[cfg(test)]
pub(super) mod tests;
