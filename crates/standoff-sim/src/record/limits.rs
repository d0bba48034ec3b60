//! Limits on ids and numbers of rows, so that readers may allocate memory per id. Writer and reader apply the same
//! limits, so every written record can be read.

use std::collections::BTreeSet;

use super::Manifest;
use super::schema::{MAX_INTRUDERS, MAX_UAVS, microseconds, seconds};
use super::table::Row;
use crate::frame::{AgentEventRow, ByAgent, DetectionRow, EventRow, Frame, IntruderRow, TrackRow, TruthRow, UavRow};

/// Maximum number of rows of a table: 1,000 targets once per second for a day.
pub const MAX_ROWS: u64 = 100_000_000;
/// Maximum size of a table's file, bytes. The widest table has 25 GB at the maximum number of rows.
pub(super) const MAX_TABLE: u64 = 32 << 30;
/// Maximum number of targets: that of vehicles in a traffic file.
const MAX_TARGETS: usize = crate::traffic::MAX_VEHICLES;
/// Maximum total length of all target names, bytes: 300 for each of the maximum number of targets.
const MAX_NAMES: usize = 30 << 20;
/// Maximum number of time steps: a scenario has up to ten million periods.
const MAX_TIME_STEPS: u64 = 10_000_001;

/// Limits of a run, and its progress so far.
pub(super) struct RecordLimits {
    until_s: f64,
    period_us: i64,
    /// Number of named targets.
    pub(super) targets: usize,
    /// UAVs so far.
    uavs: BTreeSet<u32>,
    /// Number of time steps so far.
    pub(super) steps: u64,
}

/// Violated limit: the table and the problem.
pub(super) struct LimitExceeded {
    pub(super) table: &'static str,
    pub(super) what: String,
}

/// Refuses too many targets, and target names that are too long in total.
pub(super) fn check_names(targets: usize, bytes: usize) -> Result<(), String> {
    if targets > MAX_TARGETS {
        return Err(format!("it has more than {MAX_TARGETS} targets"));
    }
    if bytes > MAX_NAMES {
        return Err(format!("the names of its targets have more than {MAX_NAMES} bytes in total"));
    }
    Ok(())
}

impl RecordLimits {
    pub(super) fn new(manifest: &Manifest, targets: usize) -> Self {
        let (until_s, period_us) = (manifest.duration_s, microseconds(manifest.period_s));
        Self { until_s, period_us, targets, uavs: BTreeSet::new(), steps: 0 }
    }

    /// Starts the next time step. Time steps begin at 0 and are one period apart.
    pub(super) fn begin(&mut self, time_us: i64) -> Result<(), LimitExceeded> {
        let time_s = seconds(time_us);
        let beyond = |what: String| Err(LimitExceeded { table: UavRow::TABLE, what });
        if !(0.0..=self.until_s).contains(&time_s) {
            return beyond(format!(
                "it has rows at {time_s} s; must be 0 to {} s, the length of the run",
                self.until_s
            ));
        }
        let due_us = i64::try_from(self.steps).ok().and_then(|periods| self.period_us.checked_mul(periods));
        if due_us != Some(time_us) {
            let (due_s, period_s) = (seconds(due_us.unwrap_or(i64::MAX)), seconds(self.period_us));
            let what = format!("it has rows at {time_s} s instead of {due_s} s");
            return beyond(format!("{what}: time steps start at 0 s and are {period_s} s apart"));
        }
        self.steps += 1;
        if self.steps > MAX_TIME_STEPS {
            return beyond(format!("it has more than {MAX_TIME_STEPS} time steps"));
        }
        Ok(())
    }

    /// Checks the frame of that time step.
    pub(super) fn check(&mut self, frame: &Frame) -> Result<(), LimitExceeded> {
        let Frame { time_us, uavs, truth, tracks, detections, events, intruders, agents, .. } = frame;
        let time_s = seconds(*time_us);
        self.uavs.extend(uavs.iter().map(|row| row.uav));
        if self.uavs.len() > MAX_UAVS {
            let what = format!("it has more than {MAX_UAVS} UAVs by {time_s} s");
            return Err(LimitExceeded { table: UavRow::TABLE, what });
        }
        if let Some(unknown) = intruders.iter().find(|row| row.intruder as usize >= MAX_INTRUDERS) {
            let what = format!(
                "it has intruder {} at {time_s} s; at most {MAX_INTRUDERS} intruders, counted from 0",
                unknown.intruder
            );
            return Err(LimitExceeded { table: IntruderRow::TABLE, what });
        }
        self.check_agents(time_s, &agents.all, |row| row.agent)?;
        self.check_agents(time_s, &agents.tracks, |of| of.agent)?;
        self.check_agents(time_s, &agents.groups, |of| of.agent)?;
        self.check_agents(time_s, &agents.events, |row| row.agent)?;
        self.check_agents(time_s, &agents.teammates, |row| row.agent)?;
        self.check_agents(time_s, &agents.teammates, |row| row.uav)?;
        self.check_targets(time_s, &agents.tracks, |of: &ByAgent<TrackRow>| Some(of.row.target))?;
        self.check_targets(time_s, &agents.events, |row: &AgentEventRow| row.event.target)?;
        self.check_targets(time_s, truth, |row: &TruthRow| Some(row.target))?;
        self.check_targets(time_s, tracks, |row: &TrackRow| Some(row.target))?;
        self.check_targets(time_s, detections, |row: &DetectionRow| Some(row.target))?;
        self.check_targets(time_s, events, |row: &EventRow| row.target)
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
