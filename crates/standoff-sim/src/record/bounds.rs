//! What no frame of a run may go beyond: who reads a record has memory for every id in it. It holds both ways, so that
//! what is written can be read.

use std::collections::BTreeSet;

use super::Manifest;
use super::rows::{MOST_INTRUDERS, MOST_UAVS, microseconds, seconds};
use super::table::Row;
use crate::frame::{AgentEventRow, DetectionRow, EventRow, Frame, IntruderRow, OfAgent, TrackRow, TruthRow, UavRow};

/// Most targets: as many as a traffic file may hold vehicles.
const MAX_TARGETS: usize = crate::traffic::MAX_VEHICLES;
/// Longest names of all targets together, bytes: 300 for each of the most.
const MAX_NAMES: usize = 30 << 20;
/// Most instants: a scenario has up to ten million periods.
const MAX_INSTANTS: u64 = 10_000_001;

/// The bounds of a run, and what has been of it.
pub(super) struct Bounds {
    until_s: f64,
    period_us: i64,
    /// How many targets it names.
    pub(super) targets: usize,
    /// UAVs that there have been.
    uavs: BTreeSet<u32>,
    /// Instants that there have been.
    pub(super) instants: u64,
}

/// A table that goes beyond them, and how.
pub(super) struct Beyond {
    pub(super) table: &'static str,
    pub(super) what: String,
}

/// Refuses more targets than a run may have, or longer names of all of them together.
pub(super) fn check_names(targets: usize, bytes: usize) -> Result<(), String> {
    if targets > MAX_TARGETS {
        return Err(format!("it has more than {MAX_TARGETS} targets"));
    }
    if bytes > MAX_NAMES {
        return Err(format!("the names of its targets have more than {MAX_NAMES} bytes together"));
    }
    Ok(())
}

impl Bounds {
    pub(super) fn new(manifest: &Manifest, targets: usize) -> Self {
        let (until_s, period_us) = (manifest.duration_s, microseconds(manifest.period_s));
        Self { until_s, period_us, targets, uavs: BTreeSet::new(), instants: 0 }
    }

    /// Takes in the next instant: those of a run are its periods, from 0 on.
    pub(super) fn begin(&mut self, time_us: i64) -> Result<(), Beyond> {
        let time_s = seconds(time_us);
        let beyond = |what: String| Err(Beyond { table: UavRow::TABLE, what });
        if !(0.0..=self.until_s).contains(&time_s) {
            return beyond(format!("it has rows at {time_s} s; 0 to {} s, the length of the run", self.until_s));
        }
        let due_us = i64::try_from(self.instants).ok().and_then(|periods| self.period_us.checked_mul(periods));
        if due_us != Some(time_us) {
            let (due_s, period_s) = (seconds(due_us.unwrap_or(i64::MAX)), seconds(self.period_us));
            let what = format!("it has rows at {time_s} s where {due_s} s is due");
            return beyond(format!("{what}: from 0 on, an instant every {period_s} s"));
        }
        self.instants += 1;
        if self.instants > MAX_INSTANTS {
            return beyond(format!("it has more than {MAX_INSTANTS} instants"));
        }
        Ok(())
    }

    /// Takes in the frame of that instant.
    pub(super) fn check(&mut self, frame: &Frame) -> Result<(), Beyond> {
        let Frame { time_us, uavs, truth, tracks, detections, events, intruders, agents, .. } = frame;
        let time_s = seconds(*time_us);
        self.uavs.extend(uavs.iter().map(|row| row.uav));
        if self.uavs.len() > MOST_UAVS {
            let what = format!("it has more than {MOST_UAVS} UAVs by {time_s} s");
            return Err(Beyond { table: UavRow::TABLE, what });
        }
        if let Some(stranger) = intruders.iter().find(|row| row.intruder as usize >= MOST_INTRUDERS) {
            let what =
                format!("it has intruder {} at {time_s} s; at most {MOST_INTRUDERS}, from 0 on", stranger.intruder);
            return Err(Beyond { table: IntruderRow::TABLE, what });
        }
        self.check_minds(time_s, &agents.all, |row| row.agent)?;
        self.check_minds(time_s, &agents.tracks, |of| of.agent)?;
        self.check_minds(time_s, &agents.groups, |of| of.agent)?;
        self.check_minds(time_s, &agents.events, |row| row.agent)?;
        self.check_minds(time_s, &agents.team, |row| row.agent)?;
        self.check_minds(time_s, &agents.team, |row| row.uav)?;
        self.check_targets(time_s, &agents.tracks, |of: &OfAgent<TrackRow>| Some(of.row.target))?;
        self.check_targets(time_s, &agents.events, |row: &AgentEventRow| row.event.target)?;
        self.check_targets(time_s, truth, |row: &TruthRow| Some(row.target))?;
        self.check_targets(time_s, tracks, |row: &TrackRow| Some(row.target))?;
        self.check_targets(time_s, detections, |row: &DetectionRow| Some(row.target))?;
        self.check_targets(time_s, events, |row: &EventRow| row.target)
    }

    /// Refuses rows of a target that has no name: the table may be another record's.
    fn check_targets<R: Row>(&self, time_s: f64, rows: &[R], target: impl Fn(&R) -> Option<u32>) -> Result<(), Beyond> {
        let stranger = rows.iter().filter_map(target).find(|&target| target as usize >= self.targets);
        stranger.map_or(Ok(()), |stranger| {
            let what = format!("it has target {stranger} at {time_s} s, and the run has {} targets", self.targets);
            Err(Beyond { table: R::TABLE, what })
        })
    }

    /// Refuses rows of a UAV that the run does not have, whose mind it would be.
    fn check_minds<R: Row>(&self, time_s: f64, rows: &[R], uav: impl Fn(&R) -> u32) -> Result<(), Beyond> {
        let stranger = rows.iter().map(uav).find(|uav| !self.uavs.contains(uav));
        stranger.map_or(Ok(()), |stranger| {
            let what = format!("it has UAV {stranger} at {time_s} s, which the uavs table does not have by then");
            Err(Beyond { table: R::TABLE, what })
        })
    }
}
