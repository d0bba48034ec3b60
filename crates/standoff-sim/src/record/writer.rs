//! Writes a record during the run, in a temporary folder that is moved to its destination when the record is complete.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use standoff_io::atomic_file::{self, sibling};

use super::checkpoint;
use super::column::Row;
use super::directory::{self, FolderLock, MAP_FILE, Partial, SCENARIO};
use super::error::RecordError;
use super::limits::{LimitExceeded, RecordLimits};
use super::manifest::{Counts, FORMAT, MANIFEST, Manifest};
use super::schema::{At, HasErrorColumn, TIMED, TargetRow, WithError, seconds};
use super::table::{Missing, TableWriter};
use crate::frame::{
    AgentEventRow, AgentRow, ByAgent, DetectionRow, EventRow, Frame, FrameRow, GroupRow, IntruderRow, PerAgentTables,
    TeammateRow, TrackRow, TruthRow, UavRow,
};
use crate::score::{FrameScorer, FrameScores, ScoreConfig};

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
/// use standoff_sim::record::{Manifest, Record, Writer};
/// use standoff_sim::run::Mission;
/// use standoff_sim::scenario::{Overrides, Scenario};
/// use standoff_sim::world::World;
///
/// # let folder = tempfile::tempdir()?;
/// # let dir = folder.path().join("mine-1");
/// let scenario = Scenario::load("tour/01-one-uav", &Overrides::default(), 1)?;
/// let settings = &scenario.settings;
/// let manifest = Manifest::new(&scenario.name, scenario.seed, settings.duration.s(), settings.period.s());
/// let mut writer = Writer::create(&dir, &manifest, &scenario.resolved()?, &World::names(&scenario))?;
/// let mut mission = Mission::new(&scenario).expect("a loaded scenario can be flown");
/// while let Some(frame) = mission.frame() {
///     writer.frame(frame)?;
/// }
/// writer.finish()?;
///
/// let record = Record::open(&dir)?;
/// assert_eq!(record.target_names(), ["target-0"]);
/// let first = record.frames()?.next().expect("a run has at least one frame")?;
/// assert_eq!((first.time_us, first.uavs.len()), (0, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Writer {
    /// In the order of `TIMED`; then the intruders, from the first one on, and those of `OF_AGENTS`, from the first
    /// data of agents on.
    tables: Vec<Box<dyn FrameTable>>,
    /// Derived from the frames for other programs; a checkpoint does not contain it.
    views: Box<dyn FrameTable>,
    scorer: Option<FrameScorer>,
    bounds: RecordLimits,
    last_us: Option<i64>,
    sound: bool,
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
    /// Fails if `dir` is [`super::Occupancy::Other`] or if another run is writing it.
    pub fn create(
        dir: &Path,
        manifest: &Manifest,
        scenario_toml: &str,
        target_names: &[String],
    ) -> Result<Self, RecordError> {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let manifest = Manifest { format: FORMAT, version, counts: None, unfinished: true, ..manifest.clone() };
        let json = manifest.to_json()?;
        let (mut partial, set_aside) = directory::make_partial(dir)?;
        let lock = replace_manifest(&partial.path, &json, false)?;
        partial.turn = None;
        let path = partial.path.join(SCENARIO);
        atomic_file::save(&path, scenario_toml).map_err(|reason| RecordError::write(&path, reason))?;
        let mut targets = TableWriter::create(&partial.path)?;
        let rows = (0..).zip(target_names).map(|(target, name)| TargetRow { target, name: name.clone() });
        targets.push(&mut rows.collect::<Vec<_>>())?;
        targets.finish()?;
        let folder = &partial.path;
        Ok(Self {
            tables: vec![
                with_error::<UavRow>(folder, |scores, row| scores.standoff_error_m(row))?,
                plain::<TruthRow>(folder)?,
                with_error::<TrackRow>(folder, |scores, row| scores.geometry.position_error_m(row))?,
                plain::<GroupRow>(folder)?,
                plain::<DetectionRow>(folder)?,
                plain::<EventRow>(folder)?,
            ],
            views: table(folder, |_, scores, put| scores.into_iter().flat_map(FrameScores::views).for_each(put))?,
            scorer: None,
            bounds: RecordLimits::new(&manifest, target_names.len()),
            last_us: None,
            sound: true,
            next_checkpoint: Instant::now() + CHECKPOINT_EVERY,
            kept_us: None,
            set_aside,
            manifest,
            dir: dir.to_owned(),
            partial,
            lock,
        })
    }

    /// Adds quantities computed from the truth to the record, for other programs: views, and errors of standoff
    /// distances and positions. Without this call they are empty.
    #[must_use]
    pub fn scored_with(self, score_config: ScoreConfig) -> Self {
        Self { scorer: Some(FrameScorer::new(score_config)), ..self }
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
        let time_us = frame.time_us;
        self.check_sound(time_us)?;
        self.sound = false;
        if frame.uavs.is_empty() {
            return Err(bad_frame(time_us, "it has no UAV"));
        }
        let within = self.bounds.begin(time_us).and_then(|()| self.bounds.check(frame));
        within.map_err(|LimitExceeded { table, what }| bad_frame(time_us, format!("{table}: {what}")))?;
        let scores = self.scorer.as_mut().map(|scorer| scorer.frame(frame));
        let folder = &self.partial.path;
        let has = |name: &str| self.tables.iter().any(|table| table.count().0 == name);
        let (intruders, of_agents) = (has(IntruderRow::TABLE), has(AgentRow::TABLE));
        if !intruders && !frame.intruders.is_empty() {
            self.tables.insert(TIMED.len(), plain::<IntruderRow>(folder)?);
        }
        if !of_agents && frame.agents != PerAgentTables::default() {
            self.tables.push(plain::<AgentRow>(folder)?);
            self.tables.push(plain::<ByAgent<TrackRow>>(folder)?);
            self.tables.push(plain::<ByAgent<GroupRow>>(folder)?);
            self.tables.push(plain::<AgentEventRow>(folder)?);
            self.tables.push(plain::<TeammateRow>(folder)?);
        }
        self.tables.iter_mut().try_for_each(|table| table.put(frame, scores.as_ref()))?;
        self.views.put(frame, scores.as_ref())?;
        self.last_us = Some(time_us);
        self.sound = true;
        let now = Instant::now();
        if now >= self.next_checkpoint {
            let made = self.checkpoint();
            // If there is no disk space for the checkpoint, the run goes on: the tables may still fit, and the previous
            // checkpoint stays.
            if !self.sound {
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
        let Some(last_us) = self.last_us else { return Ok(()) };
        self.check_sound(last_us)?;
        self.sound = false;
        let tables = self.tables.iter_mut().map(|table| table.missing()).collect::<Result<Vec<_>, _>>()?;
        self.sound = true;
        self.keep(last_us, &tables)
    }

    /// Completes the record and moves it to its destination.
    pub fn finish(self) -> Result<(), RecordError> {
        self.close()?.publish()
    }

    /// Completes the tables. Before it is published, the record can be read in its temporary folder, and files can be
    /// added to it.
    pub fn close(mut self) -> Result<FinishedRecord, RecordError> {
        self.finish_tables()?;
        let tables = self.tables.iter().chain([&self.views]).map(|table| table.count());
        let rows = tables.chain([(TargetRow::TABLE, self.bounds.targets as u64)]);
        let rows = rows.map(|(table, rows)| (table.to_owned(), rows)).collect();
        let counts = Some(Counts { time_steps: self.bounds.steps, rows });
        let json = Manifest { counts, unfinished: false, ..self.manifest.clone() }.to_json()?;
        let lock = replace_manifest(&self.partial.path, &json, true)?;
        self.partial.keep = true;
        checkpoint::remove(&self.partial.path)?;
        Ok(FinishedRecord { _locks: [self.lock, lock], dir: self.partial.path.clone(), place: self.dir })
    }

    /// Ends the record before the mission is over. It stays unfinished, with complete tables up to the last frame.
    /// Without a frame, nothing is kept.
    pub fn stop(mut self) -> Result<Option<PartialRecord>, RecordError> {
        let Some(last_us) = self.last_us else { return Ok(None) };
        self.finish_tables()?;
        self.keep(last_us, &[])?;
        Ok(self.kept())
    }

    /// Returns the part of the record that is readable if the process ends now.
    #[must_use]
    pub fn kept(&self) -> Option<PartialRecord> {
        self.kept_us.map(|last_us| PartialRecord { dir: self.partial.path.clone(), until_s: seconds(last_us) })
    }

    fn keep(&mut self, last_us: i64, tables: &[Missing]) -> Result<(), RecordError> {
        if self.kept_us.is_none() {
            let synced = self.lock.sync_all();
            synced.map_err(|reason| RecordError::write(&self.partial.path.join(MANIFEST), reason))?;
        }
        checkpoint::write(&self.partial.path, last_us, tables)?;
        self.kept_us = Some(last_us);
        self.partial.keep = true;
        Ok(())
    }

    fn finish_tables(&mut self) -> Result<(), RecordError> {
        self.check_sound(self.last_us.unwrap_or_default())?;
        self.sound = false;
        self.tables.iter_mut().chain([&mut self.views]).try_for_each(|table| table.finish())
    }

    fn check_sound(&self, time_us: i64) -> Result<(), RecordError> {
        if self.sound {
            return Ok(());
        }
        Err(bad_frame(time_us, "an earlier frame failed"))
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

/// Table that grows with the frames.
trait FrameTable: Send {
    /// Adds the rows of a frame.
    fn put(&mut self, frame: &Frame, scores: Option<&FrameScores<'_>>) -> Result<(), RecordError>;
    /// Returns the name of the table and its number of rows.
    fn count(&self) -> (&'static str, u64);
    fn missing(&mut self) -> Result<Missing, RecordError>;
    fn finish(&mut self) -> Result<(), RecordError>;
}

/// Table with the rows that `rows` adds for each frame.
struct FrameTableWriter<R, F> {
    table: TableWriter<At<R>>,
    rows: F,
    /// Reused buffer.
    buffer: Vec<At<R>>,
}

impl<R: Row, F> FrameTable for FrameTableWriter<R, F>
where
    F: Fn(&Frame, Option<&FrameScores<'_>>, &mut dyn FnMut(R)) + Send,
{
    fn put(&mut self, frame: &Frame, scores: Option<&FrameScores<'_>>) -> Result<(), RecordError> {
        self.buffer.clear();
        (self.rows)(frame, scores, &mut |row| self.buffer.push(At::new(frame.time_us, row)));
        self.table.push(&mut self.buffer)
    }

    fn count(&self) -> (&'static str, u64) {
        (R::TABLE, self.table.pushed)
    }

    fn missing(&mut self) -> Result<Missing, RecordError> {
        self.table.missing()
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        self.table.finish()
    }
}

/// Creates a table in a record's folder. `rows` passes on the rows of a frame.
fn table<R: Row>(
    folder: &Path,
    rows: impl Fn(&Frame, Option<&FrameScores<'_>>, &mut dyn FnMut(R)) + Send + 'static,
) -> Result<Box<dyn FrameTable>, RecordError> {
    Ok(Box::new(FrameTableWriter { table: TableWriter::create(folder)?, rows, buffer: Vec::new() }))
}

fn plain<R: FrameRow>(folder: &Path) -> Result<Box<dyn FrameTable>, RecordError> {
    table(folder, |frame, _, put| R::of(frame).iter().cloned().for_each(put))
}

fn with_error<R: FrameRow + HasErrorColumn>(
    folder: &Path,
    error_m: fn(&FrameScores<'_>, &R) -> Option<f64>,
) -> Result<Box<dyn FrameTable>, RecordError> {
    let with_error = move |row: &R, scores: Option<&FrameScores<'_>>| WithError {
        row: row.clone(),
        error_m: scores.and_then(|scores| error_m(scores, row)),
    };
    table(folder, move |frame, scores, put| R::of(frame).iter().for_each(|row| put(with_error(row, scores))))
}

fn bad_frame(time_us: i64, what: impl Into<String>) -> RecordError {
    let (time_s, what) = (seconds(time_us), what.into());
    RecordError::BadFrame { time_s, what }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use standoff::research::math::{cos, sin};

    use super::super::table::{TableReader, file_of};
    use super::*;
    use crate::common::{frames, load, score, writer};
    use crate::frame::ViewRow;

    fn rows<R: Row>(dir: &Path) -> Vec<At<R>> {
        let mut table = TableReader::open(file_of::<At<R>>(dir)).unwrap();
        std::iter::from_fn(|| table.next_row().unwrap()).collect()
    }

    /// Other programs can compute the metrics from the tables without any geometry.
    #[test]
    fn tables_contain_the_inputs_of_the_metrics() {
        let home = tempfile::tempdir().unwrap();
        let dir = home.path().join("run");
        let scenario = load("paper/table-2-pair", &[], 3);
        let score_config = ScoreConfig::of(&scenario.settings);
        let mut writer = writer(&dir, &scenario).scored_with(score_config.clone());
        let frames = frames(&scenario);
        frames.iter().for_each(|frame| writer.frame(frame).unwrap());
        writer.finish().unwrap();
        let metrics = score(&score_config, &frames);

        let uavs = rows::<WithError<UavRow>>(&dir);
        let errors_m: Vec<f64> = uavs.iter().filter_map(|at| at.row.error_m).collect();
        let mean_m = errors_m.iter().map(|error_m| error_m.abs()).sum::<f64>() / errors_m.len() as f64;
        assert_eq!(Some(mean_m), metrics.standoff_error_m);
        assert!(errors_m.iter().any(|error_m| *error_m < 0.0) && errors_m.iter().any(|error_m| *error_m > 0.0));

        let tracks = rows::<WithError<TrackRow>>(&dir);
        let members = tracks.iter().filter(|at| at.row.row.group.is_some());
        let errors_m: Vec<f64> = members.filter_map(|at| at.row.error_m).collect();
        assert_eq!(Some(errors_m.iter().sum::<f64>() / errors_m.len() as f64), metrics.position_error_m);

        let views = rows::<ViewRow>(&dir);
        let seen: BTreeSet<(i64, u32)> = views.iter().map(|at| (at.time_us, at.row.target)).collect();
        let steps = (frames.len() - 1) * frames[0].truth.len();
        assert_eq!(Some(seen.len() as f64 / steps as f64), metrics.in_view_fraction);
        for At { time_us, row, .. } in &views {
            let frame = frames.iter().find(|frame| frame.time_us == *time_us).unwrap();
            let uav = frame.uavs[row.uav as usize];
            let truth = frame.truth[row.target as usize];
            let direction_rad = uav.boresight_rad.unwrap() + row.off_boresight_rad;
            let (dx_m, dy_m) = (row.range_m * cos(direction_rad), row.range_m * sin(direction_rad));
            assert!((uav.x_m + dx_m - truth.x_m).abs() < 1e-6 && (uav.y_m + dy_m - truth.y_m).abs() < 1e-6);
            assert!(row.off_boresight_rad.abs() <= score_config.sensor.half_field_of_view_rad());
        }
        assert!(views.iter().any(|at| at.row.off_boresight_rad < 0.0));
        let counts = super::super::reader::Record::open(&dir).unwrap().manifest().counts.clone().unwrap();
        assert_eq!(counts.rows["in_view"], views.len() as u64);
    }
}
