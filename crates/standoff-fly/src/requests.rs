//! Heartbeat, and requests of the messages and parameters that are missing.

use mavlink::dialects::ardupilotmega::MavMessage;
use standoff::{Duration, Time};

use crate::authority::STALE;
use crate::command;
use crate::period::is_due;
use crate::vehicle::Vehicle;

/// Period of the heartbeat and of requests.
const PERIOD: Duration = Duration::from_us(1_000_000);

/// Maximum number of parameters requested in a period, so that a slow radio is not flooded.
const PARAMETERS: usize = 6;

/// Period after which the message intervals are requested again, because the autopilot may have restarted.
const INTERVALS_PERIOD: Duration = Duration::from_us(30_000_000);

/// When what was requested last.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Requests {
    at: Option<Time>,
    intervals_at: Option<Time>,
    /// Number of parameters requested so far.
    parameters: usize,
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
        let missing: Vec<_> = vehicle.parameters.missing().collect();
        for index in 0..PARAMETERS.min(missing.len()) {
            to.push(command::read_parameter(system_id, missing[(self.parameters + index) % missing.len()]));
        }
        self.parameters = self.parameters.wrapping_add(PARAMETERS);
    }
}
