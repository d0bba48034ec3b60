//! Clock of an agent: the time step of each observation, by a clock that may be off, drift, or be set.

use crate::time::{Duration, Time, TimeGrid};

/// Longest accepted time between two observations. A longer gap counts as a clock jump: if the agent accepted one wrong time
/// in the future, it would reject all correct times before it, and would lose its tracks.
pub(crate) const TIME_JUMP_MAX: Duration = Duration::from_us(10_000_000);

/// Time in which a clock may gain or lose 1 us: 2,000 ppm. Crystals drift by up to 200 ppm.
const DRIFT_1_US: i64 = 500;

/// Follows the clock of one UAV.
#[derive(Debug, Clone)]
pub(crate) struct StepClock {
    grid: TimeGrid,
    /// Last observed time step.
    now: Option<i64>,
    /// Error of the clock against the grid, as far as it is known.
    error: Duration,
    /// Time of the last observation, if it was rejected because it was off the grid.
    off_grid: Option<Time>,
    /// First and last of the time steps that were rejected since then and that follow each other.
    rejected_steps: Option<(i64, i64)>,
}

impl StepClock {
    pub(crate) fn new(grid: TimeGrid) -> Self {
        Self { grid, now: None, error: Duration::ZERO, off_grid: None, rejected_steps: None }
    }

    /// Accepts any time as the next one.
    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.grid);
    }

    /// Last observed time step.
    pub(crate) fn now(&self) -> Option<i64> {
        self.now
    }

    /// True if the last observations had two or more rejected times that follow each other.
    pub(crate) fn is_time_jump(&self) -> bool {
        self.rejected_steps.is_some_and(|(first, last)| first < last)
    }

    /// Takes the time of an observation. Returns its time step; `None` if the time is rejected.
    pub(crate) fn observe(&mut self, time: Time) -> Option<i64> {
        let step = self.step(time);
        let Some(accepted) = step.filter(|step| self.now.is_none_or(|now| self.is_next(now, *step))) else {
            self.off_grid = Some(time).filter(|_| step.is_none());
            let follows = |(first, last)| step.filter(|step| self.is_next(last, *step)).map(|step| (first, step));
            self.rejected_steps = self.rejected_steps.and_then(follows).or(step.zip(step));
            return None;
        };
        (self.rejected_steps, self.off_grid) = (None, None);
        if self.now != Some(accepted) {
            self.follow(time, accepted);
            self.now = Some(accepted);
        }
        Some(accepted)
    }

    /// Time step of a time of this clock; `None` if it is off the grid. The first time, and one that is whole periods after
    /// another one off the grid, belong to the nearest time step.
    fn step(&self, time: Time) -> Option<i64> {
        let grid = self.grid;
        let by_clock = Time::from_us(time.us().saturating_sub(self.error.us()));
        let is_set =
            self.off_grid.is_some_and(|before| grid.step(Time::EPOCH + (time - before)).is_some_and(|step| step > 0));
        if self.now.is_some() && !is_set {
            return grid.step(by_clock);
        }
        Some(grid.step_at(Time::from_us(by_clock.us().saturating_add(grid.period.us() / 2))))
    }

    /// Updates the error of the clock, which shows `time` at a new time step.
    fn follow(&mut self, time: Time, step: i64) {
        let error_us = (time - self.grid.time(step)).us();
        let (known_us, tolerance_us) = (self.error.us(), self.grid.period.us() / 10);
        let is_set = self.now.is_none() || error_us.abs_diff(known_us) > tolerance_us.unsigned_abs();
        let drift_us = self.now.map_or(0, |last| (self.grid.time(step) - self.grid.time(last)).us() / DRIFT_1_US);
        let drifted_us = || error_us.clamp(known_us - drift_us, known_us + drift_us);
        self.error = Duration::from_us(if is_set { error_us } else { drifted_us() });
    }

    /// True for the time step `now` and for those that may follow it.
    fn is_next(&self, now: i64, step: i64) -> bool {
        let ahead = step.saturating_sub(now);
        ahead >= 0 && ahead.saturating_mul(self.grid.period.us()) <= TIME_JUMP_MAX.us()
    }
}
