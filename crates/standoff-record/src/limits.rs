//! Limits on the number of rows, their times and their ids. Writer and reader apply the same limits to times and ids,
//! so every written record can be read.

use std::collections::BTreeSet;

use crate::Manifest;
use crate::column::Row;
use crate::frame::{AgentEventRow, ByAgent, DetectionRow, EventRow, Frame, NO_TARGET, TrackRow, TruthRow, UavRow};
use crate::schema::{microseconds, seconds};

/// Maximum number of rows of targets in a new record: 1,000 targets once per second for a day.
pub const MAX_ROWS: u64 = 100_000_000;

/// Limits of a run, and its progress so far.
pub(crate) struct RecordLimits {
    period_us: i64,
    /// Number of named targets.
    pub(crate) targets: usize,
    /// UAVs so far.
    uavs: BTreeSet<u32>,
    /// Number of time steps so far.
    pub(crate) steps: u64,
}

/// Violated limit: the table and the problem.
pub(crate) struct LimitExceeded {
    pub(crate) table: &'static str,
    pub(crate) what: String,
}

/// Returns the target with this key; `None` if it is the key of a track of no target.
fn target_of(key: u32) -> Option<u32> {
    Some(key).filter(|key| *key < NO_TARGET)
}

impl RecordLimits {
    pub(crate) fn new(manifest: &Manifest, targets: usize) -> Self {
        Self { period_us: microseconds(manifest.period_s), targets, uavs: BTreeSet::new(), steps: 0 }
    }

    /// Starts the next time step. Time steps begin at 0 and are one period apart.
    pub(crate) fn begin(&mut self, time_us: i64) -> Result<(), LimitExceeded> {
        let due_us = i64::try_from(self.steps).ok().and_then(|periods| self.period_us.checked_mul(periods));
        if due_us != Some(time_us) {
            let [time_s, due_s, period_s] = [time_us, due_us.unwrap_or(i64::MAX), self.period_us].map(seconds);
            let what = format!("it has rows at {time_s} s instead of {due_s} s");
            let what = format!("{what}: time steps start at 0 s and are {period_s} s apart");
            return Err(LimitExceeded { table: UavRow::TABLE, what });
        }
        self.steps += 1;
        Ok(())
    }

    /// Checks the frame of that time step.
    pub(crate) fn check(&mut self, frame: &Frame) -> Result<(), LimitExceeded> {
        let Frame { time_us, uavs, truth, tracks, detections, events, agents, .. } = frame;
        let time_s = seconds(*time_us);
        self.uavs.extend(uavs.iter().map(|row| row.uav));
        self.check_agents(time_s, &agents.all, |row| row.agent)?;
        self.check_agents(time_s, &agents.tracks, |of| of.agent)?;
        self.check_agents(time_s, &agents.groups, |of| of.agent)?;
        self.check_agents(time_s, &agents.events, |row| row.agent)?;
        self.check_agents(time_s, &agents.teammates, |row| row.agent)?;
        self.check_agents(time_s, &agents.teammates, |row| row.uav)?;
        self.check_targets(time_s, &agents.tracks, |of: &ByAgent<TrackRow>| target_of(of.row.target))?;
        self.check_targets(time_s, &agents.events, |row: &AgentEventRow| row.event.target.and_then(target_of))?;
        self.check_targets(time_s, truth, |row: &TruthRow| Some(row.target))?;
        self.check_targets(time_s, tracks, |row: &TrackRow| target_of(row.target))?;
        self.check_targets(time_s, detections, |row: &DetectionRow| row.target.and_then(target_of))?;
        self.check_targets(time_s, events, |row: &EventRow| row.target.and_then(target_of))
    }

    /// Refuses rows of an unnamed target: the table may belong to another record.
    fn check_targets<R: Row>(
        &self,
        time_s: f64,
        rows: &[R],
        target: impl Fn(&R) -> Option<u32>,
    ) -> Result<(), LimitExceeded> {
        let unknown = rows.iter().filter_map(target).find(|&target| target as usize >= self.targets);
        unknown.map_or(Ok(()), |unknown| {
            let what = format!("it has target {unknown} at {time_s} s, but the run has {} targets", self.targets);
            Err(LimitExceeded { table: R::TABLE, what })
        })
    }

    /// Refuses rows of the agent of a UAV that is not in the run.
    fn check_agents<R: Row>(&self, time_s: f64, rows: &[R], uav: impl Fn(&R) -> u32) -> Result<(), LimitExceeded> {
        let unknown = rows.iter().map(uav).find(|uav| !self.uavs.contains(uav));
        unknown.map_or(Ok(()), |unknown| {
            let what = format!("it has UAV {unknown} at {time_s} s, which is not in the uavs table up to that time");
            Err(LimitExceeded { table: R::TABLE, what })
        })
    }
}
