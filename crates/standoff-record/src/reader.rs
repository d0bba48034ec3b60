//! Reads a record: the manifest immediately, the frames one by one in bounded memory.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use standoff_io::bounded_input;

use crate::checkpoint::{self, Checkpoint};
use crate::column::Row;
use crate::directory::SCENARIO;
use crate::frame::{
    AgentEventRow, AgentRow, ByAgent, DetectionRow, EventRow, Frame, FrameRow, GroupRow, IntruderRow, TeammateRow,
    TentativeRow, TrackRow, TruthRow, UavRow,
};
use crate::limits::{LimitExceeded, RecordLimits};
use crate::schema::{At, TargetRow, seconds};
use crate::table::{MAX_TABLE, TableReader, file_of};
use crate::{Counts, Manifest, RecordError, column};

/// Maximum size of a resolved scenario, bytes.
pub const SCENARIO_MAX: u64 = 4 << 20;

/// A record on disk.
#[derive(Debug, Clone)]
pub struct Record {
    dir: PathBuf,
    manifest: Manifest,
    scenario_toml: String,
    target_names: Vec<String>,
    /// Checkpoint of an unfinished record.
    checkpoint: Option<Arc<Checkpoint>>,
}

impl Record {
    /// Opens the record in `dir` and reads everything except the frames. An unfinished record ends at
    /// [`Record::ends_s`].
    ///
    /// Damage that makes the Parquet library panic is returned as an error. The panic is caught, but the process's
    /// panic hook still runs; it can ignore the panic if [`panic_is_expected`](standoff_io::parquet_file::panic_is_expected) is true.
    pub fn open(dir: &Path) -> Result<Self, RecordError> {
        let manifest = Manifest::read(dir)?;
        if manifest.unfinished && !checkpoint::is_in(dir) {
            return Err(RecordError::NothingKept { dir: dir.to_owned() });
        }
        let checkpoint = manifest.unfinished.then(|| Checkpoint::read(dir).map(Arc::new)).transpose()?;
        let path = dir.join(SCENARIO);
        let scenario_toml =
            bounded_input::text(&path, SCENARIO_MAX).map_err(|reason| RecordError::read(&path, reason))?;
        let target_names = read_names(dir)?;
        check_count::<TargetRow>(&manifest, target_names.len() as u64, &file_of::<TargetRow>(dir))?;
        Ok(Self { dir: dir.to_owned(), manifest, scenario_toml, target_names, checkpoint })
    }

    /// End time of an unfinished record, s; `None` if it is finished.
    #[must_use]
    pub fn ends_s(&self) -> Option<f64> {
        self.checkpoint.as_ref().map(|checkpoint| seconds(checkpoint.last_us))
    }

    /// Folder of the record.
    #[must_use]
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Manifest: scenario name, seed, version and so on.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Resolved scenario, TOML.
    #[must_use]
    pub fn scenario_toml(&self) -> &str {
        &self.scenario_toml
    }

    /// Names of the targets, by id.
    #[must_use]
    pub fn target_names(&self) -> &[String] {
        &self.target_names
    }

    /// True if the record contains the truth. Users may remove it.
    #[must_use]
    pub fn has_truth(&self) -> bool {
        file_of::<TruthRow>(&self.dir).exists()
    }

    /// True if the record contains the estimates of several agents. Users may remove them.
    #[must_use]
    pub fn has_agents(&self) -> bool {
        self.has_table::<AgentRow>()
    }

    /// True if the run had intruders and the record contains them. Users may remove them.
    #[must_use]
    pub fn has_intruders(&self) -> bool {
        self.has_table::<IntruderRow>()
    }

    /// True if the record contains tentative tracks. Users may remove them.
    #[must_use]
    pub fn has_tentative_tracks(&self) -> bool {
        self.has_table::<TentativeRow>()
    }

    /// True if the record has an optional table, and the checkpoint is not older than the table.
    fn has_table<R: Row>(&self) -> bool {
        let is_before = self.checkpoint.as_ref().is_some_and(|checkpoint| checkpoint.is_without(R::TABLE));
        file_of::<R>(&self.dir).exists() && !is_before
    }

    /// Number of rows of the larger one of the tables of tracks and truth.
    pub fn target_rows(&self) -> Result<u64, RecordError> {
        let tracks = self.table::<TrackRow>()?.rows();
        if !self.has_truth() {
            return Ok(tracks);
        }
        Ok(tracks.max(self.table::<TruthRow>()?.rows()))
    }

    /// Number of detections.
    pub fn detection_rows(&self) -> Result<u64, RecordError> {
        Ok(self.table::<DetectionRow>()?.rows())
    }

    /// Number of track rows of all agents; 0 if one agent acts for the whole team.
    pub fn agent_track_rows(&self) -> Result<u64, RecordError> {
        if self.has_agents() { Ok(self.table::<ByAgent<TrackRow>>()?.rows()) } else { Ok(0) }
    }

    /// Calls `look` for every row of the UAVs table.
    pub fn each_uav(&self, mut look: impl FnMut(&UavRow)) -> Result<(), RecordError> {
        let mut table = self.table::<UavRow>()?;
        while let Some(At { row, .. }) = table.next_row()? {
            look(&row);
        }
        Ok(())
    }

    fn table<R: Row>(&self) -> Result<TableReader<At<R>>, RecordError> {
        let table = self.uncounted::<R>()?;
        check_count::<R>(&self.manifest, table.rows(), table.path())?;
        Ok(table)
    }

    fn uncounted<R: Row>(&self) -> Result<TableReader<At<R>>, RecordError> {
        let path = file_of::<R>(&self.dir);
        if let Some(checkpoint) = &self.checkpoint {
            let file = bounded_input::open(&path, MAX_TABLE).map_err(|reason| RecordError::read(&path, reason))?;
            if let Some(sources) = checkpoint.sources(R::TABLE, file) {
                return TableReader::of(path, At::default(), column::columns(), sources);
            }
        }
        TableReader::open(path)
    }

    /// Starts reading the frames; there is at least one.
    pub fn frames(&self) -> Result<Frames, RecordError> {
        let uavs: Merged<UavRow> = Merged::open(self)?;
        if uavs.ahead.is_none() {
            let what = "it has no rows, but every run has at least one UAV";
            return Err(RecordError::damaged(uavs.table.path(), what));
        }
        let mut others = Vec::new();
        if self.has_truth() {
            others.push(Merged::<TruthRow>::boxed(self)?);
        }
        others.push(Merged::<TrackRow>::boxed(self)?);
        others.push(Merged::<GroupRow>::boxed(self)?);
        others.push(Merged::<DetectionRow>::boxed(self)?);
        others.push(Merged::<EventRow>::boxed(self)?);
        if self.has_intruders() {
            others.push(Merged::<IntruderRow>::boxed(self)?);
        }
        if self.has_tentative_tracks() {
            others.push(Merged::<TentativeRow>::boxed(self)?);
        }
        if self.has_agents() {
            others.push(Merged::<AgentRow>::boxed(self)?);
            others.push(Merged::<ByAgent<TrackRow>>::boxed(self)?);
            others.push(Merged::<ByAgent<GroupRow>>::boxed(self)?);
            others.push(Merged::<AgentEventRow>::boxed(self)?);
            others.push(Merged::<TeammateRow>::boxed(self)?);
        }
        let bounds = RecordLimits::new(&self.manifest, self.target_names.len());
        Ok(Frames { uavs, others, bounds, record: self.clone(), last_us: None, ended: false })
    }
}

/// Frames of a record in chronological order; ends after the first error.
pub struct Frames {
    uavs: Merged<UavRow>,
    others: Vec<Box<dyn FrameTable>>,
    bounds: RecordLimits,
    record: Record,
    last_us: Option<i64>,
    ended: bool,
}

impl Iterator for Frames {
    type Item = Result<Frame, RecordError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let frame = self.frame().transpose();
        self.ended = !matches!(frame, Some(Ok(_)));
        frame
    }
}

impl Frames {
    fn frame(&mut self) -> Result<Option<Frame>, RecordError> {
        // The UAVs define the time steps.
        let Some(time_us) = self.uavs.step() else { return self.end().map(|()| None) };
        let beyond = |LimitExceeded { table, what }: LimitExceeded| {
            let path = self.record.dir.join(format!("{table}.parquet"));
            RecordError::damaged(&path, what)
        };
        self.bounds.begin(time_us).map_err(beyond)?;
        let mut frame = Frame { time_us, ..Frame::default() };
        self.uavs.read(&mut frame)?;
        self.others.iter_mut().try_for_each(|table| table.read(&mut frame))?;
        self.bounds.check(&frame).map_err(beyond)?;
        self.last_us = Some(time_us);
        Ok(Some(frame))
    }

    /// After the last time step, no table may have remaining rows, and the number of time steps must be that of the
    /// manifest.
    fn end(&self) -> Result<(), RecordError> {
        self.others.iter().try_for_each(|table| table.check_end())?;
        let damaged = |what: String| Err(RecordError::damaged(self.uavs.table.path(), what));
        let (there, last_us) = (self.bounds.steps, self.last_us.unwrap_or_default());
        match (&self.record.manifest.counts, &self.record.checkpoint) {
            (Some(Counts { time_steps, .. }), _) if *time_steps != there => {
                damaged(format!("it has {there} time steps, but run.json contains {time_steps}"))
            }
            (_, Some(checkpoint)) if checkpoint.last_us != last_us => {
                let (ends_s, last_s) = (seconds(checkpoint.last_us), seconds(last_us));
                damaged(format!("it ends at {last_s} s, but the checkpoint ends at {ends_s} s"))
            }
            _ => Ok(()),
        }
    }
}

/// Table that is read in step with others.
trait FrameTable: Send {
    /// Adds the rows of the frame's time step. A row before it belongs to no frame.
    fn read(&mut self, frame: &mut Frame) -> Result<(), RecordError>;
    /// Refuses rows that belong to no frame.
    fn check_end(&self) -> Result<(), RecordError>;
}

/// Table of frames, buffering one row.
struct Merged<R> {
    table: TableReader<At<R>>,
    ahead: Option<At<R>>,
}

impl<R: FrameRow> Merged<R> {
    fn open(record: &Record) -> Result<Self, RecordError> {
        let mut table = record.table::<R>()?;
        let ahead = table.next_row()?;
        Ok(Self { table, ahead })
    }

    fn boxed(record: &Record) -> Result<Box<dyn FrameTable>, RecordError> {
        Ok(Box::new(Self::open(record)?))
    }

    fn step(&self) -> Option<i64> {
        self.ahead.as_ref().map(|ahead| ahead.time_us)
    }

    fn stray(&self, time_us: i64) -> RecordError {
        let what =
            format!("its rows at {} s are out of order, or the uavs table has no rows at that time", seconds(time_us));
        RecordError::damaged(self.table.path(), what)
    }
}

impl<R: FrameRow> FrameTable for Merged<R> {
    fn read(&mut self, frame: &mut Frame) -> Result<(), RecordError> {
        let (time_us, rows) = (frame.time_us, R::of_mut(frame));
        while let Some(at) = self.ahead.take_if(|ahead| ahead.time_us <= time_us) {
            if at.time_us < time_us {
                return Err(self.stray(at.time_us));
            }
            rows.push(at.row);
            self.ahead = self.table.next_row()?;
        }
        if rows.is_sorted_by(|row, next| row.id().is_none() || row.id() < next.id()) {
            return Ok(());
        }
        let what = format!("the ids of its rows at {} s are not unique and ascending", seconds(time_us));
        Err(RecordError::damaged(self.table.path(), what))
    }

    fn check_end(&self) -> Result<(), RecordError> {
        self.step().map_or(Ok(()), |time_us| Err(self.stray(time_us)))
    }
}

/// Refuses a table whose number of rows differs from that of the completed record.
fn check_count<R: Row>(manifest: &Manifest, rows: u64, path: &Path) -> Result<(), RecordError> {
    match manifest.counts.as_ref().map(|counts| counts.rows.get(R::TABLE)) {
        None => Ok(()),
        Some(Some(counted)) if *counted == rows => Ok(()),
        Some(Some(counted)) => {
            let what = format!("it has {rows} rows, but run.json contains {counted}");
            Err(RecordError::damaged(path, what))
        }
        Some(None) => Err(RecordError::damaged(path, "run.json does not contain its number of rows")),
    }
}

fn read_names(dir: &Path) -> Result<Vec<String>, RecordError> {
    let mut table = TableReader::<TargetRow>::open(file_of::<TargetRow>(dir))?;
    let mut names = Vec::new();
    while let Some(row) = table.next_row()? {
        if usize::try_from(row.target).ok() != Some(names.len()) {
            let what = format!("target {} is out of order", row.target);
            return Err(RecordError::damaged(table.path(), what));
        }
        names.push(row.name);
    }
    Ok(names)
}
