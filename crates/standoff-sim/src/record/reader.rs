//! Reads a record back: its manifest at once, its frames one after the other in bounded memory.

use std::fs;
use std::path::{Path, PathBuf};

use super::folder::SCENARIO;
use super::frame::{DetectionRow, EventRow, Frame, GroupRow, TrackRow, TruthRow, UavRow};
use super::rows::{At, TargetRow, seconds};
use super::table::{Row, TableReader, file_of};
use super::{Manifest, RecordError};

/// A record on disk.
#[derive(Debug, Clone)]
pub struct Record {
    dir: PathBuf,
    manifest: Manifest,
    scenario_toml: String,
    target_names: Vec<String>,
}

impl Record {
    /// Opens the record in `dir`: reads all but the frames.
    pub fn open(dir: &Path) -> Result<Self, RecordError> {
        let manifest = Manifest::read(dir)?;
        let path = dir.join(SCENARIO);
        let scenario_toml = fs::read_to_string(&path).map_err(|reason| RecordError::read(&path, reason))?;
        Ok(Self { dir: dir.to_owned(), manifest, scenario_toml, target_names: read_names(dir)? })
    }

    /// The folder of the record.
    #[must_use]
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// What was run, and by which version.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The resolved scenario, TOML.
    #[must_use]
    pub fn scenario_toml(&self) -> &str {
        &self.scenario_toml
    }

    /// The targets' names, by id.
    #[must_use]
    pub fn target_names(&self) -> &[String] {
        &self.target_names
    }

    /// The record holds the truth; somebody may have taken it out.
    #[must_use]
    pub fn has_truth(&self) -> bool {
        file_of::<TruthRow>(&self.dir).exists()
    }

    /// Rows of the larger of the tables of targets: how much there is to show.
    pub fn target_rows(&self) -> Result<u64, RecordError> {
        let tracks = TableReader::<At<TrackRow>>::open(file_of::<TrackRow>(&self.dir))?.rows();
        if !self.has_truth() {
            return Ok(tracks);
        }
        Ok(tracks.max(TableReader::<At<TruthRow>>::open(file_of::<TruthRow>(&self.dir))?.rows()))
    }

    /// Begins to read the frames.
    pub fn frames(&self) -> Result<Frames, RecordError> {
        let truth = self.has_truth().then(|| Merged::open(&self.dir));
        Ok(Frames {
            uavs: Merged::open(&self.dir)?,
            truth: truth.transpose()?,
            tracks: Merged::open(&self.dir)?,
            groups: Merged::open(&self.dir)?,
            detections: Merged::open(&self.dir)?,
            events: Merged::open(&self.dir)?,
            last_us: None,
            ended: false,
        })
    }
}

/// The frames of a record, in order of time; ends after the first error.
pub struct Frames {
    uavs: Merged<UavRow>,
    truth: Option<Merged<TruthRow>>,
    tracks: Merged<TrackRow>,
    groups: Merged<GroupRow>,
    detections: Merged<DetectionRow>,
    events: Merged<EventRow>,
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
        // The UAVs define the instants. After the last, no table may have anything left.
        let instant = self.uavs.instant();
        let time_us = instant.unwrap_or(i64::MAX);
        if instant.is_some() && self.last_us.is_some_and(|last| last >= time_us) {
            return Err(self.uavs.stray(time_us));
        }
        self.last_us = instant;
        let truth = self.truth.as_mut().map(|truth| truth.rows_at(time_us));
        let frame = Frame {
            time_us,
            uavs: self.uavs.rows_at(time_us)?,
            truth: truth.transpose()?.unwrap_or_default(),
            tracks: self.tracks.rows_at(time_us)?,
            groups: self.groups.rows_at(time_us)?,
            detections: self.detections.rows_at(time_us)?,
            events: self.events.rows_at(time_us)?,
        };
        Ok(instant.map(|_| frame))
    }
}

/// A table that is read in step with others, one row ahead.
struct Merged<R> {
    table: TableReader<At<R>>,
    ahead: Option<At<R>>,
}

impl<R: Row> Merged<R> {
    fn open(dir: &Path) -> Result<Self, RecordError> {
        let mut table = TableReader::open(file_of::<R>(dir))?;
        let ahead = table.next_row()?;
        Ok(Self { table, ahead })
    }

    fn instant(&self) -> Option<i64> {
        self.ahead.as_ref().map(|ahead| ahead.time_us)
    }

    /// The rows of an instant. A row before it belongs to no frame.
    fn rows_at(&mut self, time_us: i64) -> Result<Vec<R>, RecordError> {
        let mut rows = Vec::new();
        while let Some(at) = self.ahead.take_if(|ahead| ahead.time_us <= time_us) {
            if at.time_us < time_us {
                return Err(self.stray(at.time_us));
            }
            rows.push(at.row);
            self.ahead = self.table.next_row()?;
        }
        Ok(rows)
    }

    fn stray(&self, time_us: i64) -> RecordError {
        let what =
            format!("its rows at {} s are out of order, or the uavs table has none for that instant", seconds(time_us));
        RecordError::damaged(self.table.path(), what)
    }
}

fn read_names(dir: &Path) -> Result<Vec<String>, RecordError> {
    let mut table = TableReader::<TargetRow>::open(file_of::<TargetRow>(dir))?;
    let mut names = Vec::new();
    while let Some(row) = table.next_row()? {
        if usize::try_from(row.target).ok() != Some(names.len()) {
            let what = format!("target {} is not in its place", row.target);
            return Err(RecordError::damaged(table.path(), what));
        }
        names.push(row.name);
    }
    Ok(names)
}
