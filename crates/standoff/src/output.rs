//! Result of a time step: the command of a UAV and its diagnostics.

use crate::angle::Angle;
use crate::frame::{Displacement, Position, Velocity};
use crate::group_id::GroupId;
use crate::guidance::heading::{DesiredPath, Steering};
use crate::message::{Detection, Manoeuvre};
use crate::safety::separation::Avoidance;
use crate::team_state::TeamState;
use crate::time::{Duration, Time};
use crate::uav::{Command, UavId, UavState};

/// Proof that an agent has observed a UAV's state at a time step. Only `observe` creates one, and `receive` and
/// `decide` require it, so that no time step is processed without an observation.
#[must_use = "pass the observation to `decide`"]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    pub(crate) uav: UavId,
    pub(crate) time: Time,
    pub(crate) own: UavState,
}

impl Observation {
    /// Id of the UAV.
    pub fn uav(&self) -> UavId {
        self.uav
    }

    /// Time of the observation.
    pub fn time(&self) -> Time {
        self.time
    }
}

/// Moving point at which the sensor points until the next time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointingTarget {
    /// Position of the point now.
    pub position: Position,
    /// Velocity of the point.
    pub velocity: Velocity,
}

impl PointingTarget {
    /// Returns the direction from `uav` to the point, `later` from now.
    pub fn boresight(&self, uav: Position, later: Duration) -> Angle {
        let [boresight] = Self::boresight_batch([(*self, uav)], later);
        boresight
    }

    /// [Boresights](Self::boresight) of several UAVs: the same values as one by one, computed faster.
    #[inline]
    pub fn boresight_batch<const N: usize>(looks: [(Self, Position); N], later: Duration) -> [Angle; N] {
        Displacement::direction_batch(looks.map(|(look, uav)| look.position + look.velocity * later.s() - uav))
    }
}

/// Result of a decision: what a UAV does until the next time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgentOutput {
    /// Command for the autopilot, within the limits.
    pub command: Command,
    /// Path that the command leads onto, for the inner loop of an aircraft that banks; `None` if the UAV avoids an
    /// aircraft or a zone, turns at its limit, or has no orbit. The inner loop then flies the command.
    pub path: Option<DesiredPath>,
    /// Commanded altitude above the plane, m: that of the group's orbit; `None` if the UAV is not assigned to a group.
    pub altitude_m: Option<f64>,
    /// Where the sensor points; `None` if no target is known.
    pub pointing_target: Option<PointingTarget>,
    /// Quality of the result.
    pub diagnostics: Diagnostics,
}

impl AgentOutput {
    /// Manoeuvre for the next report; with `is_always`, also that of a UAV that avoids no aircraft.
    pub(crate) fn manoeuvre(&self, is_always: bool) -> Option<Manoeuvre> {
        let (avoiding, command) = (self.diagnostics.avoiding, self.command);
        let is_left = avoiding.map_or(command.turn_rate_rad_s >= 0.0, |avoidance| avoidance.is_left);
        let avoids = avoiding.map(|avoidance| avoidance.aircraft);
        (is_always || avoids.is_some()).then_some(Manoeuvre { avoids, command, is_left })
    }

    /// A command without altitude, pointing target and group.
    pub fn command_only(command: Command) -> Self {
        Self { command, path: None, altitude_m: None, pointing_target: None, diagnostics: Diagnostics::default() }
    }
}

/// Diagnostics of a time step: quality of the result, and how it was computed. By default: no group, nothing
/// limited, nothing rejected.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Diagnostics {
    /// Assigned group of this UAV; `None` if it has no group.
    pub group: Option<GroupId>,
    /// Zero-based creation index of the group ([`TeamState::group_number`](crate::TeamState::group_number)).
    pub group_number: Option<u32>,
    /// How the UAV steers onto the group's orbit.
    pub steering: Option<Steering>,
    /// True if the guidance law requested more speed change than the limit allows.
    pub speed_limited: bool,
    /// True if the guidance law requested more turn rate than the limit allows.
    pub turn_rate_limited: bool,
    /// True if no orbit around the group satisfies every constraint; `false` without a group.
    pub orbit_is_infeasible: bool,
    /// Phase error: how far the UAV lags behind its desired phase on the orbit, rad.
    pub phase_error_rad: f64,
    /// Distance to the nearest other UAV of the same group, m.
    pub nearest_groupmate_m: Option<f64>,
    /// Number of tracks that are not lost and in no group.
    pub ungrouped_targets: u32,
    /// Messages and observations rejected since the start.
    pub rejected: Rejected,
    /// True if the UAV's own state was not finite: it keeps its course.
    pub own_state_invalid: bool,
    /// Aircraft that the UAV avoids by not flying the command of its orbit; `None` if it flies that command.
    pub avoiding: Option<Avoidance>,
    /// Index of the zone that changes the UAV's command; `None` if the command is the same as without zones.
    pub limiting_zone: Option<u32>,
    /// Wind that the UAV assumes. The command is then airspeed and heading rate. `None`: the UAV assumes calm air.
    pub wind: Option<Velocity>,
}

/// Counters of what was rejected since the start, by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Rejected {
    /// Own observations with a time that is off the team's grid, before the last one, or more than 10 s after
    /// it. If the counter keeps growing although the clock is correct, call [`Agent::reset`](crate::Agent::reset).
    pub bad_time: u32,
    /// Messages received too late to count.
    pub late: u32,
    /// Messages of a time step too far ahead or off the team's grid: the clock of the sender or of this UAV is wrong.
    pub off_grid: u32,
    /// Superseded or malformed messages: NaNs, oversized lists, snapshot parts that fail the digest.
    pub malformed: u32,
    /// Reports of UAVs whose position is not reachable from their last one; and targets beyond the 16,384 that a
    /// team tracks, lost ones included.
    pub implausible: u32,
    /// Detections beyond the range of the sensor.
    pub out_of_range: u32,
    /// Detections with label that are too far from the prediction of their track.
    pub gated: u32,
}

impl Rejected {
    /// Adds what the last time step of a team state rejected.
    pub(crate) fn with(self, newest: &TeamState) -> Self {
        let [implausible, gated] = [(self.implausible, newest.implausible), (self.gated, newest.gated)]
            .map(|(before, now)| before.saturating_add(now));
        Self { implausible, gated, ..self }
    }

    /// Counts the detections of a scan with a range above `range_max_m`.
    pub(crate) fn count_beyond(&mut self, detections: &[Detection], range_max_m: f64) {
        let beyond = detections.iter().filter(|detection| detection.is_beyond(range_max_m)).count();
        self.out_of_range = self.out_of_range.saturating_add(beyond as u32);
    }

    /// Number of rejected messages of all kinds.
    pub fn messages(&self) -> u32 {
        [self.off_grid, self.malformed, self.implausible].into_iter().fold(self.late, u32::saturating_add)
    }
}

/// Increments a counter without overflow.
pub(crate) fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
