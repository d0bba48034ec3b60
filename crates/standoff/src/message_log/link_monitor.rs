//! Link monitor: delay of reports, loss of messages, and whether the link is degraded.

use super::ranges::Ranges;
use super::teammates::NEVER;
use crate::message::{LogStatus, MessageSource};
use crate::time::{Duration, TimeGrid};
use crate::uav::UavId;

/// Duration that the link counts as degraded after the last missing message, s.
const DEGRADED_HOLD_S: f64 = 10.0;

/// Quality of the link, as seen by one agent.
#[derive(Debug, Clone)]
pub(crate) struct LinkMonitor {
    grid: TimeGrid,
    degraded_hold: i64,
    /// Histogram of the delays of recent reports, in periods; the last bin contains all longer delays.
    delays: [u32; 8],
    /// Typical delay of reports, in periods: the median, so that occasional losses do not count.
    pub(super) typical_delay: i64,
    /// Longest delay of recent reports, in periods.
    pub(super) longest_delay: i64,
    /// Time step at which the last late report arrived.
    late_at: i64,
    /// Last time step with a missing message, here or at a teammate.
    pub(crate) degraded_at: i64,
    /// Numbers of entries that teammates should have received, and of those that they lacked.
    expected: f64,
    missing: f64,
}

impl LinkMonitor {
    pub(super) fn new(grid: TimeGrid) -> Self {
        Self {
            grid,
            degraded_hold: grid.periods(Duration::from_s(DEGRADED_HOLD_S)),
            delays: [0; 8],
            typical_delay: 0,
            longest_delay: 0,
            late_at: NEVER,
            degraded_at: NEVER,
            expected: 0.0,
            missing: 0.0,
        }
    }

    /// Forgets when messages were late or missing.
    pub(super) fn restart(&mut self) {
        (self.degraded_at, self.late_at) = (NEVER, NEVER);
    }

    /// True if messages went missing recently, here or at a teammate.
    pub(crate) fn is_degraded(&self, now: i64) -> bool {
        now - self.degraded_at <= self.degraded_hold
    }

    /// Takes the last time step with a missing message that a teammate reports.
    pub(super) fn note_degraded(&mut self, step: i64) {
        self.degraded_at = self.degraded_at.max(step);
    }

    /// Fraction of entries that teammates lacked when they should have arrived, over about [`DEGRADED_HOLD_S`].
    pub(crate) fn loss(&self) -> f64 {
        self.missing / self.expected.max(1.0)
    }

    /// Adjusts the averages to a new time step.
    pub(super) fn turn_to(&mut self, now: i64) {
        let kept = 1.0 - 1.0 / self.degraded_hold.max(1) as f64;
        (self.expected, self.missing) = (kept * self.expected, kept * self.missing);
        if !self.is_degraded(now) {
            // Without degradation, messages that seem to be missing are requested immediately.
            self.typical_delay = 0;
        }
        if now - self.late_at > self.degraded_hold {
            (self.delays, self.longest_delay) = ([0; 8], 0);
        }
    }

    /// Takes a report of time step `step` that arrived at `now`.
    pub(super) fn note_delay(&mut self, step: i64, now: i64) {
        let periods = now - step;
        self.late_at = if periods > 0 { now } else { self.late_at };
        // Usually no report is late.
        if periods <= 0 && self.longest_delay == 0 {
            self.delays[0] += 1;
            self.delays[0] >>= u32::from(self.delays[0] > 64);
            return;
        }
        self.delays[periods.clamp(0, 7) as usize] += 1;
        // Halves the counts, so that older delays lose weight.
        if self.delays.iter().sum::<u32>() > 64 {
            self.delays.iter_mut().for_each(|count| *count /= 2);
        }
        let half = self.delays.iter().sum::<u32>() / 2;
        let mut sum = 0;
        let index = self.delays.iter().position(|count| {
            sum += count;
            sum > half
        });
        self.typical_delay = index.unwrap_or_default() as i64;
        self.longest_delay = self.delays.iter().rposition(|count| *count > 0).unwrap_or_default() as i64;
    }

    /// Measures the loss by the newest entries that the sender of a log status should have received. `received` are the
    /// entries of each source here.
    pub(super) fn measure_loss(
        &mut self,
        log_status: &LogStatus,
        by: UavId,
        (step, is_alike): (i64, bool),
        received: &[(MessageSource, Ranges)],
    ) {
        let due = step - 1 - self.typical_delay;
        if self.grid.step_at(log_status.committed_until) >= due {
            return;
        }
        let is_listed = |source: MessageSource| {
            log_status.received.iter().any(|run| run.source == source && run.from <= due && due <= run.to)
        };
        for (source, runs) in received {
            if matches!(source, MessageSource::Uav(uav) if *uav != by) && runs.holds(due) {
                self.expected += 1.0;
                self.missing += f64::from(!is_alike && !is_listed(*source));
            }
        }
    }
}
