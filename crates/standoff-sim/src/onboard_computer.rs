//! Onboard computer of a UAV: when it is on, how often it has restarted, and the time of its clock.

use standoff::{Time, UavId};

use crate::scenario::{Clock, Restart, Scenario, uav_of};

/// The computer that runs the agent of a UAV.
pub(crate) struct OnboardComputer {
    /// Time at which the computer is first switched on, s.
    starts_s: f64,
    restarts: Vec<Restart>,
    clock: Option<Clock>,
    /// Number of the restart after which the agent runs, from 1; 0 before the first restart.
    restart_count: u32,
}

impl OnboardComputer {
    pub(crate) fn new(uav: UavId, scenario: &Scenario) -> Self {
        Self {
            starts_s: scenario.starts_s.get(uav.0 as usize).copied().unwrap_or_default(),
            restarts: scenario.restarts.iter().filter(|restart| uav_of(restart.uav) == uav).cloned().collect(),
            clock: scenario.clocks.iter().find(|clock| uav_of(clock.uav) == uav).cloned(),
            restart_count: 0,
        }
    }

    /// Returns whether the computer is on at a time.
    pub(crate) fn is_on(&self, now: Time) -> bool {
        let is_down = |restart: &Restart| (restart.at_s..restart.at_s + restart.down_s).contains(&now.s());
        now.s() >= self.starts_s && !self.restarts.iter().any(is_down)
    }

    /// Returns the new restart count if the computer has restarted since the last call. Restarts count from the first
    /// start on, including those that begin and end between two time steps.
    pub(crate) fn restarted(&mut self, now: Time) -> Option<u32> {
        let is_over = |restart: &&Restart| (self.starts_s..=now.s()).contains(&restart.at_s);
        let restart_count = self.restarts.iter().filter(is_over).count() as u32;
        let is_new = restart_count != std::mem::replace(&mut self.restart_count, restart_count);
        is_new.then_some(restart_count)
    }

    /// Returns the time of the computer's clock.
    pub(crate) fn time(&self, now: Time) -> Time {
        let ahead_us = |clock: &Clock| (clock.offset_s * 1e6 + clock.drift_ppm * now.s()).round() as i64;
        Time::from_us(now.us() + self.clock.as_ref().map_or(0, ahead_us))
    }
}
