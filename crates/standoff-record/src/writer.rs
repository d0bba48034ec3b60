//! Writes a record during the run, in a temporary folder that is moved to its destination when the record is complete.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use standoff_io::atomic_file::{self, sibling};

use crate::checkpoint;
use crate::column::Row;
use crate::directory::{self, FolderLock, MAP_FILE, Partial, SCENARIO};
use crate::error::RecordError;
use crate::frame::{Frame, TruthRow};
use crate::frame_tables::{DerivedColumns, FrameTables, write_targets};
use crate::manifest::{MANIFEST, Manifest};
use crate::schema::seconds;
use crate::table::{Missing, file_of};

/// Minimum time between two checkpoints: the most data that is lost if the process ends.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(1);
/// Minimum ratio of the time between checkpoints to the time that one takes.
const CHECKPOINT_SHARE: u32 = 50;

/// Writes a record frame by frame, in bounded memory.
///
/// The files grow in `<dir>.partial`. [`FinishedRecord::publish`] moves that folder to `dir`. If the record is never
/// published, the folder remains as an unfinished record that can be read up to its last checkpoint; without a
/// checkpoint it is removed.
///
/// The times of checkpoints depend on the system clock, but the contents of the finished record do not.
///
/// ```
/// use standoff_record::{Frame, Manifest, Record, UavRow, Writer};
///
/// # let folder = tempfile::tempdir()?;
/// # let dir = folder.path().join("mine-1");
/// let manifest = Manifest::new("mine", 1, 1.0, 0.5);
/// let mut writer = Writer::create(&dir, &manifest, "", &["lorry".to_owned()])?;
/// for step in 0..3 {
///     let uav = UavRow { uav: 0, x_m: 20.0 * step as f64, speed_m_s: 40.0, ..UavRow::default() };
///     writer.frame(&Frame { time_us: 500_000 * step, uavs: vec![uav], ..Frame::default() })?;
/// }
/// writer.finish()?;
///
/// let record = Record::open(&dir)?;
/// assert_eq!(record.target_names(), ["lorry"]);
/// let last = record.frames()?.last().expect("the run has three frames")?;
/// assert_eq!((last.time_us, last.uavs[0].x_m), (1_000_000, 40.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Writer {
    tables: FrameTables,
    next_checkpoint: Instant,
    /// Time of the last checkpoint.
    kept_us: Option<i64>,
    set_aside: Option<PathBuf>,
    manifest: Manifest,
    dir: PathBuf,
    // Fields are dropped in order: the tables are closed before their folder is removed, and the lock is released last.
    partial: Partial,
    /// Kept open, because it holds the lock.
    lock: File,
}

/// Readable part of a run that ended early.
#[derive(Debug, Clone, PartialEq)]
pub struct PartialRecord {
    /// Folder of the record.
    pub dir: PathBuf,
    /// Time of its last frame, s.
    pub until_s: f64,
}

impl Writer {
    /// Starts the record that will be published in `dir`, with the targets' names by id. Creates parent folders. An
    /// unfinished record of an earlier run is moved aside ([`Writer::set_aside`]) until this one is published.
    ///
    /// The record always contains the version of this program, not that of `manifest`.
    ///
    /// Fails if `dir` is [`crate::Occupancy::Other`] or if another run is writing it.
    pub fn create(
        dir: &Path,
        manifest: &Manifest,
        scenario_toml: &str,
        target_names: &[String],
    ) -> Result<Self, RecordError> {
        let manifest = manifest.begun();
        let json = manifest.to_json()?;
        let (mut partial, set_aside) = directory::make_partial(dir)?;
        let lock = replace_manifest(&partial.path, &json, false)?;
        partial.turn = None;
        let path = partial.path.join(SCENARIO);
        atomic_file::save(&path, scenario_toml).map_err(|reason| RecordError::write(&path, reason))?;
        write_targets(Some(&partial.path), target_names)?;
        Ok(Self {
            tables: FrameTables::create(Some(&partial.path), &manifest, target_names.len())?,
            next_checkpoint: Instant::now() + CHECKPOINT_EVERY,
            kept_us: None,
            set_aside,
            manifest,
            dir: dir.to_owned(),
            partial,
            lock,
        })
    }

    /// Adds columns and rows that `derive` computes from each frame. Without this call they are empty.
    #[must_use]
    pub fn deriving(mut self, derive: impl FnMut(&Frame) -> DerivedColumns + Send + 'static) -> Self {
        self.tables.derive = Some(Box::new(derive));
        self
    }

    /// Leaves out the table of the truth, which is unknown in a real flight. Scores that need it are then absent.
    pub fn without_truth(mut self) -> Result<Self, RecordError> {
        self.tables.remove(TruthRow::TABLE);
        let path = file_of::<TruthRow>(&self.partial.path);
        std::fs::remove_file(&path).map_err(|reason| RecordError::write(&path, reason))?;
        Ok(self)
    }

    /// Sets the start of the mission before its first frame, in UTC, microseconds since 1970, if it was not known at the
    /// start of the record. The manifest must have some start.
    pub fn begin_at(&mut self, unix_us: i64) -> Result<(), RecordError> {
        self.manifest.begin_unix_us = Some(unix_us);
        self.tables.earth.begin_unix_us = Some(unix_us);
        self.lock = replace_manifest(&self.partial.path, &self.manifest.to_json()?, false)?;
        Ok(())
    }

    /// Adds a packed background map to the record.
    pub fn with_map(self, gz: &[u8]) -> Result<Self, RecordError> {
        let path = self.partial.path.join(MAP_FILE);
        atomic_file::save_quickly(&path, gz).map_err(|reason| RecordError::write(&path, reason))?;
        Ok(self)
    }

    /// Returns the folder to which an earlier unfinished run was moved, until this record is published.
    #[must_use]
    pub fn set_aside(&self) -> Option<&Path> {
        self.set_aside.as_deref()
    }

    /// Adds a time step with at least one UAV. The first one is at 0, and the next ones follow at the period of the
    /// manifest.
    ///
    /// After an error, the record can be neither continued nor finished.
    pub fn frame(&mut self, frame: &Frame) -> Result<(), RecordError> {
        self.tables.frame(frame)?;
        let now = Instant::now();
        if now >= self.next_checkpoint {
            let made = self.checkpoint();
            // If there is no disk space for the checkpoint, the run goes on: the tables may still fit, and the previous
            // checkpoint stays.
            if !self.tables.is_sound {
                return made;
            }
            self.next_checkpoint = Instant::now() + CHECKPOINT_EVERY.max(now.elapsed() * CHECKPOINT_SHARE);
        }
        Ok(())
    }

    /// Syncs the data so far to disk, so that the record can be read even if the process ends. [`Writer::frame`] calls
    /// this from time to time.
    ///
    /// After an error in its tables, the record can be neither continued nor finished. If only the checkpoint cannot be
    /// written, it can.
    pub fn checkpoint(&mut self) -> Result<(), RecordError> {
        let Some(last_us) = self.tables.last_us else { return Ok(()) };
        let missing = self.tables.missing()?;
        self.keep(last_us, &missing)
    }

    /// Completes the record and moves it to its destination.
    pub fn finish(self) -> Result<(), RecordError> {
        self.close()?.publish()
    }

    /// Completes the tables. Before it is published, the record can be read in its temporary folder, and files can be
    /// added to it.
    pub fn close(mut self) -> Result<FinishedRecord, RecordError> {
        self.tables.finish()?;
        self.complete()
    }

    /// Like [`Self::close`], for a run whose length was not known at its start: sets its length, s, and the scenario
    /// with that length.
    pub fn close_with_length(mut self, duration_s: f64, scenario_toml: &str) -> Result<FinishedRecord, RecordError> {
        self.tables.finish()?;
        self.manifest.duration_s = duration_s;
        let path = self.partial.path.join(SCENARIO);
        atomic_file::save(&path, scenario_toml).map_err(|reason| RecordError::write(&path, reason))?;
        self.complete()
    }

    /// Marks the record with complete tables as finished.
    fn complete(mut self) -> Result<FinishedRecord, RecordError> {
        let json = self.tables.completed(&self.manifest).to_json()?;
        let lock = replace_manifest(&self.partial.path, &json, true)?;
        self.partial.keep = true;
        checkpoint::remove(&self.partial.path)?;
        Ok(FinishedRecord { _locks: [self.lock, lock], dir: self.partial.path.clone(), place: self.dir })
    }

    /// Ends the record before the mission is over. It stays unfinished, with complete tables up to the last frame.
    /// Without a frame, nothing is kept.
    pub fn stop(mut self) -> Result<Option<PartialRecord>, RecordError> {
        let Some(last_us) = self.tables.last_us else { return Ok(None) };
        self.tables.finish()?;
        self.keep(last_us, &[])?;
        Ok(self.kept())
    }

    /// Returns the part of the record that is readable if the process ends now.
    #[must_use]
    pub fn kept(&self) -> Option<PartialRecord> {
        self.kept_us.map(|last_us| PartialRecord { dir: self.partial.path.clone(), until_s: seconds(last_us) })
    }

    fn keep(&mut self, last_us: i64, tables: &[Option<Missing>]) -> Result<(), RecordError> {
        if self.kept_us.is_none() {
            let synced = self.lock.sync_all();
            synced.map_err(|reason| RecordError::write(&self.partial.path.join(MANIFEST), reason))?;
        }
        checkpoint::write(&self.partial.path, last_us, tables)?;
        self.kept_us = Some(last_us);
        self.partial.keep = true;
        Ok(())
    }
}

/// Complete record that is not at its destination yet. If it is dropped, it stays in its temporary folder.
pub struct FinishedRecord {
    /// Kept open, because they hold the lock.
    _locks: [File; 2],
    dir: PathBuf,
    place: PathBuf,
}

impl FinishedRecord {
    /// Returns the folder of the record before publication. `map.json.gz`, `summary.json`, `report.html` and `*.svg`
    /// may be added. With any other file in it, a later run does not replace the record.
    #[must_use]
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Moves the record to its destination and then removes an older run there.
    ///
    /// If only the move fails, the record stays in its temporary folder: [`RecordError::NotMoved`].
    pub fn publish(self) -> Result<(), RecordError> {
        let moved =
            FolderLock::for_sibling(&self.place).and_then(|_turn| directory::move_into_place(&self.dir, &self.place));
        moved.map_err(|reason| match self.dir.exists() {
            true => RecordError::NotMoved { kept: self.dir.clone(), reason: Box::new(reason) },
            false => reason,
        })
    }
}

/// Replaces the manifest atomically (with `onto_disk`, even in case of a power failure) and returns the file with its
/// lock. The replaced file stays locked while it is open, so that no other run can take over the folder in between.
fn replace_manifest(partial: &Path, json: &str, onto_disk: bool) -> Result<File, RecordError> {
    let place = partial.join(MANIFEST);
    let path = sibling(&place, atomic_file::PARTIAL);
    let refused = |reason| RecordError::write(&path, reason);
    let mut file = File::create(&path).map_err(refused)?;
    directory::lock(&file, partial)?;
    let sync = |file: &File| if onto_disk { file.sync_all() } else { Ok(()) };
    let written = file.write_all(json.as_bytes()).and_then(|()| sync(&file));
    written.and_then(|()| std::fs::rename(&path, &place)).map_err(refused)?;
    Ok(file)
}
