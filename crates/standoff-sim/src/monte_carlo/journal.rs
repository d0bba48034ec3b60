//! Journal of a batch: stores every complete run, so that the end of the process neither loses nor corrupts runs.
//!
//! ```text
//! "standoff journal" | length of the batch | its CRC-32 | CRC-32 of these | the batch, JSON | slot 0 | slot 1 | ...
//!     16 bytes                4                 4               4
//! slot: run, 8 bytes | a double per metric, NaN if nothing was measured | CRC-32, 4 bytes
//! ```
//!
//! Numbers are little-endian. Every run has a fixed slot, in the order of runs, and a checksum that is seeded with that
//! of the batch. A slot that was never written, was only partly written, was changed or belongs to another batch is not
//! a valid run, and the run is repeated. Hence the order in which runs end does not matter. Reading the runs takes
//! constant memory, and no time for runs after the last stored one.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use standoff_io::atomic_file;
use standoff_io::display_text::{self, printable};
use standoff_record::RecordError;

use super::batch::{Batch, Values};
use super::error::{FORMAT, MonteCarloError};

/// Name of the file.
const JOURNAL: &str = "monte-carlo.journal";

const MAGIC: &[u8; 16] = b"standoff journal";

/// Size of the magic bytes, length of the batch, its checksum, and the checksum of these.
const PREAMBLE: usize = 16 + 4 + 4 + 4;

/// Maximum size of the description of a batch, bytes: the text of the scenario and about 2,000 more.
pub(super) const MAX_BATCH: u64 = 8 << 20;

/// Interval at which data are synced to disk: the most data that a power failure loses.
const SYNC_EVERY: Duration = Duration::from_secs(1);

/// True if there is a journal in `dir`.
pub(super) fn is_in(dir: &Path) -> bool {
    dir.join(JOURNAL).is_file()
}

/// True if another process is writing the journal in `dir`.
pub(super) fn is_in_use(dir: &Path) -> bool {
    File::open(dir.join(JOURNAL)).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Removes the leftover journal of a complete batch, if there is one.
pub(super) fn remove_left_over(dir: &Path) {
    // Errors are ignored: the file does no harm.
    let _ = fs::remove_file(dir.join(JOURNAL));
}

/// Syncs the entries of a folder to disk.
pub(super) fn sync_folder(dir: &Path) -> Result<(), RecordError> {
    atomic_file::sync_folder(dir).map_err(|reason| RecordError::write(dir, reason))
}

/// An open journal, locked against other processes.
#[derive(Debug)]
pub(super) struct Journal {
    dir: PathBuf,
    file: File,
    slots: Slots,
    metrics: Vec<String>,
    unsynced: bool,
    synced: Instant,
}

/// Location of the runs in the file.
#[derive(Debug, Clone)]
struct Slots {
    /// Offset of the first slot.
    start: u64,
    runs: Range<u64>,
    metrics: usize,
    /// Initial value of every slot's checksum.
    seal: u32,
}

impl Journal {
    /// Opens the journal of `batch` in `dir`, or creates it, with the folder if necessary.
    ///
    /// Refuses the journal of another batch, one that another process is writing, and one with a damaged header. A
    /// journal that is truncated before its first slot contains no runs and is started again.
    pub(super) fn open(dir: &Path, batch: &Batch) -> Result<Self, MonteCarloError> {
        let path = dir.join(JOURNAL);
        let refused = |reason| RecordError::write(&path, reason);
        fs::create_dir_all(dir).map_err(|reason| RecordError::write(dir, reason))?;
        // A link may point to something else.
        if fs::symlink_metadata(&path).is_ok_and(|found| !found.is_file()) {
            return Err(RecordError::Occupied { dir: dir.to_owned(), what: JOURNAL.to_owned() }.into());
        }
        let mut file =
            File::options().read(true).write(true).create(true).truncate(false).open(&path).map_err(refused)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                // For a different batch, waiting would be useless, so that error comes first.
                read_head(&mut file, &path)?.map_or(Ok(()), |existing| batch.check_same(&existing, dir))?;
                return Err(RecordError::InUse { dir: dir.to_owned() }.into());
            }
            // If locking is not supported, batches are assumed to use different folders.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        let json = serde_json::to_vec(batch).map_err(|error| RecordError::write(Path::new(JOURNAL), error.into()))?;
        let (head, seal) = head(&json)?;
        let runs = batch.flown();
        let slots = Slots { start: head.len() as u64, runs, metrics: batch.metrics.len(), seal };
        match read_head(&mut file, &path)? {
            Some(existing) => batch.check_same(&existing, dir)?,
            None => {
                file.set_len(0).and_then(|()| file.rewind()).map_err(refused)?;
                file.write_all(&head).and_then(|()| file.sync_all()).map_err(refused)?;
                sync_folder(dir)?;
            }
        }
        let metrics = batch.metrics.clone();
        Ok(Self { dir: dir.to_owned(), file, slots, metrics, unsynced: false, synced: Instant::now() })
    }

    /// Folder of the journal.
    pub(super) fn dir(&self) -> &Path {
        &self.dir
    }

    /// Stores a run; `values` has one value per metric.
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

    /// Syncs stored runs to disk if the last time is long enough ago.
    pub(super) fn sync_now_and_then(&mut self) -> Result<(), MonteCarloError> {
        if self.synced.elapsed() < SYNC_EVERY { Ok(()) } else { self.sync() }
    }

    /// Syncs stored runs to disk.
    pub(super) fn sync(&mut self) -> Result<(), MonteCarloError> {
        if self.unsynced {
            // After a failed sync, another one might succeed without the data being on disk, so the batch is aborted.
            self.file.sync_data().map_err(|reason| self.refused(reason))?;
            self.unsynced = false;
        }
        self.synced = Instant::now();
        Ok(())
    }

    /// Returns every run in order: its values, or `None` if it is not complete. Here and in the methods below, the
    /// error is [`MonteCarloError::Interrupted`] if `stop` is set.
    pub(super) fn rows<'a>(&self, stop: &'a AtomicBool) -> Result<Rows<'a>, MonteCarloError> {
        let path = self.dir.join(JOURNAL);
        let opened = File::open(&path).and_then(|file| Rows::new(path.clone(), file, self.slots.clone(), stop));
        Ok(opened.map_err(|reason| RecordError::read(&path, reason))?)
    }

    /// Returns the runs that are not complete yet. Runs that are being flown in the meantime are not repeated.
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

    /// Returns the values of every run, in order; all runs must be complete.
    pub(super) fn complete_rows<'a>(
        &self,
        stop: &'a AtomicBool,
    ) -> Result<impl Iterator<Item = Result<Values, MonteCarloError>> + use<'a>, MonteCarloError> {
        let path = self.dir.join(JOURNAL);
        Ok(self.rows(stop)?.map(move |row| match row? {
            (_, Some(values)) => Ok(values),
            (run, None) => Err(RecordError::read(&path, io::Error::other(format!("run {run} is missing"))).into()),
        }))
    }

    /// Returns the first complete run.
    pub(super) fn first_complete(&self, stop: &AtomicBool) -> Result<Option<(u64, Values)>, MonteCarloError> {
        let rows = self.rows(stop)?.with_a_slot();
        rows.filter_map(|row| row.map(|(run, values)| Some((run, values?))).transpose()).next().transpose()
    }

    /// Returns the number of complete runs.
    pub(super) fn count(&self, stop: &AtomicBool) -> Result<u64, MonteCarloError> {
        self.rows(stop)?.with_a_slot().try_fold(0, |n, row| Ok(n + u64::from(row?.1.is_some())))
    }

    /// Removes the journal, after its runs have been stored in the results.
    pub(super) fn remove(self) -> Result<(), MonteCarloError> {
        let path = self.dir.join(JOURNAL);
        match fs::remove_file(&path) {
            // Another process has found the batch complete in the meantime.
            Err(reason) if reason.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => Ok(removed.map_err(|reason| RecordError::write(&path, reason))?),
        }
    }

    fn refused(&self, reason: io::Error) -> MonteCarloError {
        RecordError::write(&self.dir.join(JOURNAL), reason).into()
    }
}

impl Slots {
    /// Size of a slot, bytes.
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

    /// Returns the values in the slot of `run` if the slot is valid.
    fn decode(&self, run: u64, slot: &[u8]) -> Option<Values> {
        let (row, checksum) = slot.split_last_chunk()?;
        let (number, values) = row.split_first_chunk()?;
        let whole = self.checksum(row) == u32::from_le_bytes(*checksum) && u64::from_le_bytes(*number) == run;
        let values = || values.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
        // Infinite values are never written.
        (whole && !values().any(f64::is_infinite))
            .then(|| values().map(|value| Some(value).filter(|value| !value.is_nan())).collect())
    }

    fn checksum(&self, row: &[u8]) -> u32 {
        let mut crc = crc32fast::Hasher::new_with_initial(self.seal);
        crc.update(row);
        crc.finalize()
    }
}

/// Iterator over the runs of a journal; ends after an error.
pub(super) struct Rows<'a> {
    path: PathBuf,
    file: BufReader<File>,
    slots: Slots,
    /// Slot that was read last.
    slot: Vec<u8>,
    left: Range<u64>,
    /// First run without a slot in the file: nothing is read for this and later runs.
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

    /// Excludes the runs after the last slot: none of them is complete, and there may be a hundred million.
    fn with_a_slot(mut self) -> Self {
        self.left.end = self.left.end.min(self.first_without);
        self
    }

    /// Reads the values of the next run.
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

/// Returns the header of a batch's journal, with the batch as JSON, and the initial value of the slots' checksums.
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

/// Reads the batch of a journal; `None` if the file is truncated before its first slot.
fn read_head(file: &mut File, path: &Path) -> Result<Option<Batch>, MonteCarloError> {
    let unreadable = |reason| RecordError::read(path, reason);
    let damaged = |what: &str| {
        let (journal, what) = (display_text::path(path), printable(what));
        MonteCarloError::Folder(format!("{journal} is damaged: {what}; remove it to repeat all of its runs"))
    };
    let size = file.metadata().map_err(unreadable)?.len();
    let mut preamble = [0; PREAMBLE];
    if size < PREAMBLE as u64 {
        return Ok(None);
    }
    file.read_exact(&mut preamble).map_err(unreadable)?;
    let word = |at: usize| preamble[at..].first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    if !preamble.starts_with(MAGIC) || word(24) != crc32fast::hash(&preamble[..24]) {
        return Err(damaged("it does not start with a journal header"));
    }
    let length = word(16);
    if u64::from(length) > MAX_BATCH {
        return Err(damaged("its description of the batch is too long"));
    }
    if size < PREAMBLE as u64 + u64::from(length) {
        return Ok(None);
    }
    let mut json = vec![0; length as usize];
    file.read_exact(&mut json).map_err(unreadable)?;
    if crc32fast::hash(&json) != word(20) {
        return Err(damaged("the checksum of its description of the batch is wrong"));
    }
    check_format(&json, path)?.map_err(|error| damaged(&error.to_string()))?;
    let batch: Batch = serde_json::from_slice(&json).map_err(|error| damaged(&error.to_string()))?;
    batch.check().map_err(|error| damaged(&error.to_string()))?;
    Ok(Some(batch))
}

/// Refuses an unsupported format before anything else is parsed.
pub(super) fn check_format(json: &[u8], path: &Path) -> Result<serde_json::Result<()>, MonteCarloError> {
    match serde_json::from_slice(json) {
        Ok(Heading { format: FORMAT, .. }) => Ok(Ok(())),
        Ok(Heading { format, version }) => {
            let existing =
                format!("{} has format {format} of standoff {}", display_text::path(path), printable(&version));
            Err(MonteCarloError::Folder(format!(
                "{existing}; this version supports format {FORMAT}; use the version that wrote it"
            )))
        }
        Err(error) => Ok(Err(error)),
    }
}

/// Common start of a batch in every format.
#[derive(serde::Deserialize)]
struct Heading {
    format: u64,
    version: String,
}

#[cfg(test)]
pub(super) mod tests;
