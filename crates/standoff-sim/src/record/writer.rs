//! Writes a record while the run goes: in a folder beside its place, moved there when complete.

use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::folder::{self, MANIFEST, SCENARIO};
use super::frame::{DetectionRow, EventRow, Frame, GroupRow, TrackRow, TruthRow, UavRow};
use super::rows::{At, TargetRow, seconds};
use super::table::{Row, TableWriter, file_of};
use super::{FORMAT, Manifest, RecordError};

/// Writes a record, frame by frame, in bounded memory.
///
/// The files grow in `<dir>.partial`. [`Closed::publish`] moves that folder to `dir`; a writer that
/// is dropped before removes it.
///
/// ```
/// use standoff_sim::record::{Manifest, Record, Writer};
/// use standoff_sim::run::Mission;
/// use standoff_sim::scenario::{Edits, Scenario};
/// use standoff_sim::world::World;
///
/// # let folder = tempfile::tempdir()?;
/// # let dir = folder.path().join("mine-1");
/// let scenario = Scenario::load("tour/01-one-uav", &Edits::default(), 1)?;
/// let settings = &scenario.settings;
/// let manifest = Manifest::new(&scenario.name, scenario.seed, settings.duration.s(), settings.period.s());
/// let mut writer = Writer::create(&dir, &manifest, &scenario.resolved()?)?;
/// let mut mission = Mission::new(&scenario).expect("a loaded scenario can be flown");
/// while let Some(frame) = mission.frame() {
///     writer.frame(frame)?;
/// }
/// writer.finish(&World::names(&scenario))?;
///
/// let record = Record::open(&dir)?;
/// assert_eq!(record.target_names(), ["target-1"]);
/// let first = record.frames()?.next().expect("there is one")?;
/// assert_eq!((first.time_us, first.uavs.len()), (0, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Writer {
    uavs: TableWriter<At<UavRow>>,
    truth: TableWriter<At<TruthRow>>,
    tracks: TableWriter<At<TrackRow>>,
    groups: TableWriter<At<GroupRow>>,
    detections: TableWriter<At<DetectionRow>>,
    events: TableWriter<At<EventRow>>,
    last_us: Option<i64>,
    sound: bool,
    manifest: File,
    dir: PathBuf,
    // Last, as fields are dropped in order: the files are closed before their folder goes.
    partial: Partial,
}

impl Writer {
    /// Begins the record that is to lie in `dir`. Parent folders are made; what an interrupted run
    /// left in `<dir>.partial` is removed.
    ///
    /// The record says that this version wrote it, whatever `manifest` says.
    ///
    /// Fails if `dir` is [`super::Occupancy::Other`] or if another run is writing it.
    pub fn create(dir: &Path, manifest: &Manifest, scenario_toml: &str) -> Result<Self, RecordError> {
        let manifest = Manifest { format: FORMAT, version: env!("CARGO_PKG_VERSION").to_owned(), ..manifest.clone() };
        let json = manifest.to_json()?;
        let partial = Partial::make(dir)?;
        let path = partial.path.join(MANIFEST);
        let mut file = File::create(&path).map_err(|reason| RecordError::write(&path, reason))?;
        folder::lock(&file, &partial.path)?;
        file.write_all(json.as_bytes()).map_err(|reason| RecordError::write(&path, reason))?;
        let path = partial.path.join(SCENARIO);
        fs::write(&path, scenario_toml).map_err(|reason| RecordError::write(&path, reason))?;
        Ok(Self {
            uavs: table(&partial)?,
            truth: table(&partial)?,
            tracks: table(&partial)?,
            groups: table(&partial)?,
            detections: table(&partial)?,
            events: table(&partial)?,
            last_us: None,
            sound: true,
            manifest: file,
            dir: dir.to_owned(),
            partial,
        })
    }

    /// Adds an instant: later than the one before, and with at least one UAV.
    ///
    /// After an error the record cannot be continued nor finished.
    pub fn frame(&mut self, frame: &Frame) -> Result<(), RecordError> {
        let time_us = frame.time_us;
        self.check_sound(time_us)?;
        self.sound = false;
        if frame.uavs.is_empty() {
            return Err(bad_frame(time_us, "it has no UAV"));
        }
        if self.last_us.is_some_and(|last| last >= time_us) {
            return Err(bad_frame(time_us, "it is not later than the one before"));
        }
        put(&mut self.uavs, time_us, &frame.uavs)?;
        put(&mut self.truth, time_us, &frame.truth)?;
        put(&mut self.tracks, time_us, &frame.tracks)?;
        put(&mut self.groups, time_us, &frame.groups)?;
        put(&mut self.detections, time_us, &frame.detections)?;
        put(&mut self.events, time_us, &frame.events)?;
        self.last_us = Some(time_us);
        self.sound = true;
        Ok(())
    }

    /// Completes the record with the targets' names, by id, and moves it to its place.
    pub fn finish(self, target_names: &[String]) -> Result<(), RecordError> {
        self.close(target_names)?.publish()
    }

    /// Completes the tables, with the targets' names by id. The record can be read where it lies, and added to, before
    /// it is published.
    pub fn close(self, target_names: &[String]) -> Result<Closed, RecordError> {
        self.check_sound(self.last_us.unwrap_or_default())?;
        let mut targets = table::<TargetRow>(&self.partial)?;
        for (target, name) in (0..).zip(target_names) {
            let name = name.clone();
            targets.push(&TargetRow { target, name })?;
        }
        targets.finish()?;
        self.uavs.finish()?;
        self.truth.finish()?;
        self.tracks.finish()?;
        self.groups.finish()?;
        self.detections.finish()?;
        self.events.finish()?;
        let synced = self.manifest.sync_all();
        synced.map_err(|reason| RecordError::write(&self.partial.path.join(MANIFEST), reason))?;
        Ok(Closed { _manifest: self.manifest, dir: self.dir, partial: self.partial })
    }

    fn check_sound(&self, time_us: i64) -> Result<(), RecordError> {
        if self.sound {
            return Ok(());
        }
        Err(bad_frame(time_us, "an earlier frame failed"))
    }
}

/// A complete record that is not in its place yet; dropped, it is removed.
pub struct Closed {
    /// Open, because it holds the lock.
    _manifest: File,
    dir: PathBuf,
    partial: Partial,
}

impl Closed {
    /// Where the record lies until it is published. `summary.json`, `report.html` and `*.svg` may be added; with
    /// anything else in it, a later run will not replace the record.
    #[must_use]
    pub fn dir(&self) -> &Path {
        &self.partial.path
    }

    /// Moves the record to its place. An older run there is removed just before.
    ///
    /// If only the move fails, the record is kept where it is: [`RecordError::NotMoved`].
    pub fn publish(mut self) -> Result<(), RecordError> {
        self.partial.keep = true;
        folder::move_into_place(&self.partial.path, &self.dir)
            .map_err(|reason| RecordError::NotMoved { kept: self.partial.path.clone(), reason: Box::new(reason) })
    }
}

fn table<R: Row>(partial: &Partial) -> Result<TableWriter<R>, RecordError> {
    TableWriter::create(file_of::<R>(&partial.path))
}

fn put<R: Row + Clone>(table: &mut TableWriter<At<R>>, time_us: i64, rows: &[R]) -> Result<(), RecordError> {
    rows.iter().cloned().try_for_each(|row| table.push(&At { time_us, row }))
}

fn bad_frame(time_us: i64, what: &'static str) -> RecordError {
    let time_s = seconds(time_us);
    RecordError::BadFrame { time_s, what }
}

/// The folder of an unfinished record, removed when dropped.
struct Partial {
    path: PathBuf,
    /// Parents made for it, innermost first.
    made: Vec<PathBuf>,
    keep: bool,
}

impl Partial {
    fn make(dir: &Path) -> Result<Self, RecordError> {
        let (path, made) = folder::make_partial(dir)?;
        Ok(Self { path, made, keep: false })
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if !self.keep {
            // Nobody is left to tell, and the next run tries again.
            let _ = folder::remove_ours(&self.path);
            for parent in &self.made {
                let _ = std::fs::remove_dir(parent);
            }
        }
    }
}
