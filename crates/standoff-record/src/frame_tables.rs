//! Tables of a record that grow with the frames, in a folder or in memory.

use std::iter;
use std::path::PathBuf;

use crate::column::{self, Row};
use crate::earth::{Earth, PositionColumns};
use crate::error::RecordError;
use crate::frame::{
    AgentEventRow, AgentRow, ByAgent, DetectionRow, EventRow, Frame, FrameRow, GroupRow, IntruderRow, PerAgentTables,
    TeammateRow, TentativeRow, TrackRow, TruthRow, UavRow, ViewRow,
};
use crate::limits::{LimitExceeded, RecordLimits};
use crate::manifest::{Counts, Manifest};
use crate::schema::{At, HasErrorColumn, TargetRow, WithError, frame_tables, seconds};
use crate::table::{Folder, Missing, TableWriter};

/// Columns and rows that depend on the truth, for other programs: [`Record`](crate::Record) does not read them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DerivedColumns {
    /// Column `standoff_error_m` of each UAV in [`Frame::uavs`], in the same order.
    pub standoff_errors_m: Vec<Option<f64>>,
    /// Column `position_error_m` of each track in [`Frame::tracks`], in the same order.
    pub position_errors_m: Vec<Option<f64>>,
    /// Rows of the table `in_view`.
    pub views: Vec<ViewRow>,
}

type Derive = Box<dyn FnMut(&Frame) -> DerivedColumns + Send>;

/// The tables of a record.
pub(crate) struct FrameTables {
    /// Those of `TIMED`; those of intruders, tentative tracks and `OF_AGENTS` from the first row on.
    tables: Vec<Box<dyn FrameTable>>,
    /// Derived from the frames for other programs; a checkpoint does not contain it.
    views: Box<dyn FrameTable>,
    pub(crate) derive: Option<Derive>,
    pub(crate) earth: Earth,
    bounds: RecordLimits,
    pub(crate) last_us: Option<i64>,
    /// False after an error.
    pub(crate) is_sound: bool,
    folder: Option<PathBuf>,
}

impl FrameTables {
    pub(crate) fn create(folder: Folder<'_>, manifest: &Manifest, targets: usize) -> Result<Self, RecordError> {
        let earth = Earth::of(manifest)?;
        let new = New { folder, earth: &earth };
        Ok(Self {
            tables: vec![
                with_error::<UavRow>(new, |derived| &derived.standoff_errors_m)?,
                plain::<TruthRow>(new)?,
                with_error::<TrackRow>(new, |derived| &derived.position_errors_m)?,
                plain::<GroupRow>(new)?,
                plain::<DetectionRow>(new)?,
                plain::<EventRow>(new)?,
            ],
            views: table(new, |_, derived, put| derived.views.iter().copied().for_each(put))?,
            derive: None,
            earth,
            bounds: RecordLimits::new(manifest, targets),
            last_us: None,
            is_sound: true,
            folder: folder.map(Into::into),
        })
    }

    /// Leaves out a table.
    pub(crate) fn remove(&mut self, name: &str) {
        self.tables.retain(|table| table.count().0 != name);
    }

    /// Adds a time step. After an error, the tables can be neither continued nor finished.
    pub(crate) fn frame(&mut self, frame: &Frame) -> Result<(), RecordError> {
        let time_us = frame.time_us;
        self.check_sound(time_us)?;
        self.is_sound = false;
        if frame.uavs.is_empty() {
            return Err(bad_frame(time_us, "it has no UAV"));
        }
        let within = self.bounds.begin(time_us).and_then(|()| self.bounds.check(frame));
        within.map_err(|LimitExceeded { table, what }| bad_frame(time_us, format!("{table}: {what}")))?;
        let derived = self.derive.as_mut().map(|derive| derive(frame)).unwrap_or_default();
        let new = New { folder: self.folder.as_deref(), earth: &self.earth };
        let has = |name: &str| self.tables.iter().any(|table| table.count().0 == name);
        let (intruders, tentative, of_agents) =
            (has(IntruderRow::TABLE), has(TentativeRow::TABLE), has(AgentRow::TABLE));
        if !intruders && !frame.intruders.is_empty() {
            self.tables.push(plain::<IntruderRow>(new)?);
        }
        if !tentative && !frame.tentative.is_empty() {
            self.tables.push(plain::<TentativeRow>(new)?);
        }
        if !of_agents && frame.agents != PerAgentTables::default() {
            self.tables.push(plain::<AgentRow>(new)?);
            self.tables.push(plain::<ByAgent<TrackRow>>(new)?);
            self.tables.push(plain::<ByAgent<GroupRow>>(new)?);
            self.tables.push(plain::<AgentEventRow>(new)?);
            self.tables.push(plain::<TeammateRow>(new)?);
        }
        self.tables.iter_mut().try_for_each(|table| table.put(frame, &derived, &self.earth))?;
        self.views.put(frame, &derived, &self.earth)?;
        self.last_us = Some(time_us);
        self.is_sound = true;
        Ok(())
    }

    /// Returns what each table on disk lacks to be readable.
    pub(crate) fn missing(&mut self) -> Result<Vec<Option<Missing>>, RecordError> {
        self.check_sound(self.last_us.unwrap_or_default())?;
        self.is_sound = false;
        let missing = |name: &str| {
            let table = self.tables.iter_mut().find(|table| table.count().0 == name);
            table.map(|table| table.missing()).transpose()
        };
        let missing = frame_tables().map(missing).collect::<Result<Vec<_>, _>>()?;
        self.is_sound = true;
        Ok(missing)
    }

    /// Completes the tables.
    pub(crate) fn finish(&mut self) -> Result<(), RecordError> {
        self.check_sound(self.last_us.unwrap_or_default())?;
        self.is_sound = false;
        self.tables.iter_mut().chain([&mut self.views]).try_for_each(|table| table.finish())
    }

    /// Returns the manifest of the finished record.
    pub(crate) fn completed(&self, manifest: &Manifest) -> Manifest {
        let tables = self.tables.iter().chain([&self.views]).map(|table| table.count());
        let rows = tables.chain([(TargetRow::TABLE, self.bounds.targets as u64)]);
        let rows = rows.map(|(table, rows)| (table.to_owned(), rows)).collect();
        let counts = Some(Counts { time_steps: self.bounds.steps, rows });
        Manifest { counts, unfinished: false, ..manifest.clone() }
    }

    /// Names and bytes of the finished tables in memory.
    pub(crate) fn into_files(self) -> impl Iterator<Item = (String, Vec<u8>)> {
        self.tables.into_iter().chain([self.views]).filter_map(|table| table.into_file())
    }

    fn check_sound(&self, time_us: i64) -> Result<(), RecordError> {
        if self.is_sound {
            return Ok(());
        }
        Err(bad_frame(time_us, "an earlier frame failed"))
    }
}

/// Writes the table of the targets' names by id. Returns its name and bytes if it is in memory.
pub(crate) fn write_targets(
    folder: Folder<'_>,
    target_names: &[String],
) -> Result<Option<(String, Vec<u8>)>, RecordError> {
    let mut targets = TableWriter::create(folder, column::columns())?;
    let rows = (0..).zip(target_names).map(|(target, name)| TargetRow { target, name: name.clone() });
    targets.push(&mut rows.collect::<Vec<_>>())?;
    targets.finish()?;
    Ok(targets.into_file())
}

/// Table that grows with the frames.
trait FrameTable: Send {
    /// Adds the rows of a frame.
    fn put(&mut self, frame: &Frame, derived: &DerivedColumns, earth: &Earth) -> Result<(), RecordError>;
    /// Returns the name of the table and its number of rows.
    fn count(&self) -> (&'static str, u64);
    fn missing(&mut self) -> Result<Missing, RecordError>;
    fn finish(&mut self) -> Result<(), RecordError>;
    fn into_file(self: Box<Self>) -> Option<(String, Vec<u8>)>;
}

/// Table with the rows that `rows` adds for each frame.
struct FrameTableWriter<R, F> {
    table: TableWriter<At<R>>,
    position: PositionColumns<R>,
    rows: F,
    /// Reused buffer.
    buffer: Vec<At<R>>,
}

impl<R: Row, F> FrameTable for FrameTableWriter<R, F>
where
    F: Fn(&Frame, &DerivedColumns, &mut dyn FnMut(R)) + Send,
{
    fn put(&mut self, frame: &Frame, derived: &DerivedColumns, earth: &Earth) -> Result<(), RecordError> {
        self.buffer.clear();
        (self.rows)(frame, derived, &mut |row| self.buffer.push(At::new(frame.time_us, row)));
        self.buffer.iter_mut().for_each(|row| earth.locate(row, &self.position));
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

    fn into_file(self: Box<Self>) -> Option<(String, Vec<u8>)> {
        self.table.into_file()
    }
}

/// Where tables are created, and the place and time of their rows.
#[derive(Clone, Copy)]
struct New<'a> {
    folder: Folder<'a>,
    earth: &'a Earth,
}

/// Creates a table of a record. `rows` passes on the rows of a frame.
fn table<R: Row>(
    new: New<'_>,
    rows: impl Fn(&Frame, &DerivedColumns, &mut dyn FnMut(R)) + Send + 'static,
) -> Result<Box<dyn FrameTable>, RecordError> {
    let (columns, position) = new.earth.columns();
    let table = TableWriter::create(new.folder, columns)?;
    Ok(Box::new(FrameTableWriter { table, position, rows, buffer: Vec::new() }))
}

fn plain<R: FrameRow>(new: New<'_>) -> Result<Box<dyn FrameTable>, RecordError> {
    table(new, |frame, _, put| R::of(frame).iter().cloned().for_each(put))
}

fn with_error<R: FrameRow + HasErrorColumn>(
    new: New<'_>,
    errors_m: fn(&DerivedColumns) -> &[Option<f64>],
) -> Result<Box<dyn FrameTable>, RecordError> {
    table(new, move |frame, derived, put| {
        let errors_m = errors_m(derived).iter().copied().chain(iter::repeat(None));
        R::of(frame).iter().cloned().zip(errors_m).for_each(|(row, error_m)| put(WithError { row, error_m }));
    })
}

fn bad_frame(time_us: i64, what: impl Into<String>) -> RecordError {
    let (time_s, what) = (seconds(time_us), what.into());
    RecordError::BadFrame { time_s, what }
}
