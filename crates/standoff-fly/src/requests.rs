//! Heartbeat, and requests of the messages and parameters that are missing.

use std::collections::BTreeMap;

use mavlink::dialects::ardupilotmega::MavMessage;
use standoff::{Duration, Time};

use crate::authority::STALE;
use crate::command;
use crate::parameters::Parameters;
use crate::period::is_due;
use crate::vehicle::Vehicle;

/// Period of the heartbeat and of requests.
const PERIOD: Duration = Duration::from_us(1_000_000);

/// Maximum number of parameters requested in a period, so that a slow radio is not flooded.
const PARAMETERS: usize = 6;

/// Number of times that a parameter is requested; the autopilot may not have it.
pub(crate) const ATTEMPTS: u32 = 3;

/// Period after which the message intervals are requested again, because the autopilot may have restarted.
const INTERVALS_PERIOD: Duration = Duration::from_us(30_000_000);

/// When what was requested last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Requests {
    at: Option<Time>,
    intervals_at: Option<Time>,
    /// Number of requests of each parameter.
    attempts: BTreeMap<&'static str, u32>,
    /// Last mode of the vehicle.
    mode: Option<u32>,
}

impl Requests {
    /// Appends the messages that are due.
    pub(crate) fn append(&mut self, now: Time, vehicle: &mut Vehicle, to: &mut Vec<MavMessage>) {
        let (system_id, has_items) = (vehicle.system_id(), vehicle.parameters.has_fence_items());
        if vehicle.heartbeat.is_some() {
            vehicle.fence.append_requests(now, system_id, has_items, to);
        }
        if !is_due(self.at, now, PERIOD) {
            return;
        }
        self.at = Some(now);
        to.push(command::heartbeat());
        // Requests need a vehicle that answers.
        if vehicle.heartbeat.is_none() {
            return;
        }
        let is_stale = vehicle.telemetry_at().is_none_or(|at| now - at > STALE);
        let age_max = if is_stale { Duration::from_us(3_000_000) } else { INTERVALS_PERIOD };
        if is_due(self.intervals_at, now, age_max) {
            self.intervals_at = Some(now);
            to.extend(command::INTERVALS.map(|(id, period_us)| command::message_interval(system_id, id, period_us)));
        }
        // Answers can be lost on the radio: another mode, selected by the pilot, starts again.
        let mode = vehicle.heartbeat.map(|heartbeat| heartbeat.mode);
        if mode != self.mode {
            self.mode = mode;
            self.attempts.clear();
        }
        let mut missing: Vec<_> = vehicle.parameters.missing().filter(|name| !self.is_given_up(name)).collect();
        missing.sort_by_key(|name| self.attempts.get(name).copied());
        for name in missing.into_iter().take(PARAMETERS) {
            *self.attempts.entry(name).or_default() += 1;
            to.push(command::read_parameter(system_id, name));
        }
    }

    /// True if a parameter is not requested any more.
    fn is_given_up(&self, name: &str) -> bool {
        self.attempts.get(name).is_some_and(|attempts| *attempts >= ATTEMPTS)
    }

    /// Parameters that the autopilot did not send, however often they were requested.
    pub(crate) fn given_up<'a>(&'a self, parameters: &'a Parameters) -> impl Iterator<Item = &'static str> + 'a {
        parameters.missing().filter(|name| self.is_given_up(name))
    }
}
