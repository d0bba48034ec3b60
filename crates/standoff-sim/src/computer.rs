//! A UAV's computer: when it is on, how often it was started, and what its clock reads.

use standoff::{Time, UavId};

use crate::scenario::{Clock, Restart, Scenario};

/// The computer that a UAV's mind runs on.
pub(crate) struct Computer {
    /// When it is first switched on, s.
    starts_s: f64,
    restarts: Vec<Restart>,
    clock: Option<Clock>,
    /// The restart after which its mind runs, counted from 1; 0: none yet.
    epoch: u32,
}

impl Computer {
    pub(crate) fn new(uav: UavId, scenario: &Scenario) -> Self {
        Self {
            starts_s: scenario.starts_s.get(uav.0 as usize).copied().unwrap_or_default(),
            restarts: scenario.restarts.iter().filter(|restart| restart.uav == uav).copied().collect(),
            clock: scenario.clocks.iter().find(|clock| clock.uav == uav).copied(),
            epoch: 0,
        }
    }

    /// It is on at an instant.
    pub(crate) fn is_on(&self, now: Time) -> bool {
        let is_down = |restart: &Restart| (restart.at_s..restart.at_s + restart.down_s).contains(&now.s());
        now.s() >= self.starts_s && !self.restarts.iter().any(is_down)
    }

    /// Its epoch, if it has been started again since it was last asked. Restarts count from when it first runs, also those
    /// that begin and end between two instants.
    pub(crate) fn started_again(&mut self, now: Time) -> Option<u32> {
        let is_over = |restart: &&Restart| (self.starts_s..=now.s()).contains(&restart.at_s);
        let epoch = self.restarts.iter().filter(is_over).count() as u32;
        let is_new = epoch != std::mem::replace(&mut self.epoch, epoch);
        is_new.then_some(epoch)
    }

    /// What its clock reads.
    pub(crate) fn time(&self, now: Time) -> Time {
        let ahead_us = |clock: &Clock| (clock.offset_s * 1e6 + clock.drift_ppm * now.s()).round() as i64;
        Time::from_us(now.us() + self.clock.as_ref().map_or(0, ahead_us))
    }
}
