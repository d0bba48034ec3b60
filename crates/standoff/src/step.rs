//! What a UAV is to do, and how good that is.

use crate::angle::Angle;
use crate::frame::{Displacement, Position, Velocity};
use crate::group_id::GroupId;
use crate::guidance::heading::Steering;
use crate::guidance::separation::Avoidance;
use crate::time::{Duration, Time};
use crate::uav::{Command, UavId, UavState};

/// A UAV at an instant, as its agent has taken it in. Only `observe` makes one, and `hear` and `decide` ask for it: nothing
/// is heard or decided of an instant that was not observed.
#[must_use = "an instant that was observed is to be decided"]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    pub(crate) uav: UavId,
    pub(crate) time: Time,
    pub(crate) own: UavState,
}

impl Observation {
    /// Which UAV.
    pub fn uav(&self) -> UavId {
        self.uav
    }

    /// The instant.
    pub fn time(&self) -> Time {
        self.time
    }
}

/// Where the sensor is to point until the next instant: a point that moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookAt {
    /// The point now.
    pub position: Position,
    /// How it moves.
    pub velocity: Velocity,
}

impl LookAt {
    /// Direction from `uav` to the point, `later` from now.
    pub fn boresight(&self, uav: Position, later: Duration) -> Angle {
        let [boresight] = Self::boresight_each([(*self, uav)], later);
        boresight
    }

    /// [Boresights](Self::boresight) of several UAVs: the same as one by one, in less time.
    #[inline]
    pub fn boresight_each<const N: usize>(looks: [(Self, Position); N], later: Duration) -> [Angle; N] {
        Displacement::direction_each(looks.map(|(look, uav)| look.position + look.velocity * later.s() - uav))
    }
}

/// What a UAV is to do until the next instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// What to ask of the autopilot, inside the limits.
    pub command: Command,
    /// Altitude to fly at above the plane, m: that of the group's orbit; `None`: it serves no group.
    pub altitude_m: Option<f64>,
    /// Where to point the sensor; `None`: nothing is known to look at.
    pub look_at: Option<LookAt>,
    /// How good the answer is.
    pub diagnostics: Diagnostics,
}

impl Step {
    /// A command alone: no altitude, nothing to look at, no group.
    pub const fn of(command: Command) -> Self {
        Self { command, altitude_m: None, look_at: None, diagnostics: Diagnostics::NONE }
    }
}

/// How good a step's answer is, and how it came about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Diagnostics {
    /// The group this UAV serves; `None`: it holds a circle where it is.
    pub group: Option<GroupId>,
    /// The how many'th group that is ([`Picture::number`](crate::Picture::number)).
    pub group_number: Option<u32>,
    /// How it steered onto the group's orbit.
    pub steering: Option<Steering>,
    /// The law asked for more speed change than the limit allows.
    pub speed_limited: bool,
    /// The law asked for more turn rate than the limit allows.
    pub turn_rate_limited: bool,
    /// No orbit about the group satisfies every constraint; `false` without a group.
    pub orbit_is_infeasible: bool,
    /// How far it lags behind its place on the orbit, rad.
    pub spacing_error_rad: f64,
    /// Distance to the nearest other UAV of its group, m.
    pub separation_m: Option<f64>,
    /// Targets that are known, not lost, and in no group.
    pub unassigned_targets: u32,
    /// What was refused since the start.
    pub refused: Refused,
    /// The UAV's own state was not finite: it holds its course.
    pub own_state_invalid: bool,
    /// Whom it keeps away from, by flying something else than what its orbit wants.
    pub avoids: Option<Avoidance>,
    /// The zone that it keeps out of, or in, by flying something else than what it would fly without; by its place in the
    /// airspace.
    pub border: Option<u32>,
}

/// What was refused since the start, counted by why.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Refused {
    /// Own instants: off the team's grid, before the last one, or more than [`Agent::GAP_MAX`](crate::Agent::GAP_MAX) after
    /// it. If this goes on growing though your clock is right, [`Agent::reset`](crate::Agent::reset).
    pub instants: u32,
    /// Messages that were heard too late to count.
    pub late: u32,
    /// Messages of an instant too far ahead, or of none of the team's: a clock that is wrong, theirs or the own one.
    pub off_grid: u32,
    /// Messages of which another one counts, or that make no sense: numbers that are none, lists beyond their bounds, parts
    /// of a snapshot that is not what was told of it.
    pub nonsense: u32,
    /// Reports of UAVs that are where they could not have come to since they were heard last; and targets that are more than
    /// the 8,000 of which a team keeps track, lost ones included.
    pub impossible: u32,
}

impl Refused {
    /// Nothing.
    pub const NONE: Self = Self { instants: 0, late: 0, off_grid: 0, nonsense: 0, impossible: 0 };

    /// All messages.
    pub fn messages(&self) -> u32 {
        [self.off_grid, self.nonsense, self.impossible].into_iter().fold(self.late, u32::saturating_add)
    }
}

/// One more of what was refused.
pub(crate) fn count(what: &mut u32) {
    *what = what.saturating_add(1);
}

impl Diagnostics {
    /// Nothing to tell: no group, nothing limited, nothing refused.
    pub const NONE: Self = Self {
        group: None,
        group_number: None,
        steering: None,
        speed_limited: false,
        turn_rate_limited: false,
        orbit_is_infeasible: false,
        spacing_error_rad: 0.0,
        separation_m: None,
        unassigned_targets: 0,
        refused: Refused::NONE,
        own_state_invalid: false,
        avoids: None,
        border: None,
    };
}
