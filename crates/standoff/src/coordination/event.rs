//! What can happen to targets and groups, and why, in words.

use core::fmt;

use crate::coordination::group::GroupId;
use crate::estimation::track::LossReason;
use crate::target::TargetId;

/// Something that changed in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// What happened.
    pub kind: EventKind,
    /// The target it happened to.
    pub target: Option<TargetId>,
    /// The group concerned.
    pub group: Option<GroupId>,
}

/// What can happen; displays as the reason, in words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EventKind {
    /// A target was handed over.
    Cued,
    /// A cued target was measured for the first time.
    Acquired,
    /// A track was given up.
    Lost(LossReason),
    /// A lost or unknown target was measured.
    Reacquired,
    /// A target joined a group in flight.
    Joined,
    /// A target was removed from its group: the orbit with it would need this radius.
    Discarded {
        /// Radius needed, m.
        needed_m: f64,
        /// Radius allowed, m.
        allowed_m: f64,
    },
    /// A discarded target was taken back.
    TakenBack,
    /// No orbit satisfies every constraint any more.
    OrbitInfeasible {
        /// Smallest radius that view, turn rate and bounds allow, m.
        smallest_m: f64,
        /// Largest radius that bounds and sensing range allow, m.
        largest_m: f64,
    },
    /// Some orbit satisfies every constraint again.
    OrbitFeasible,
}

impl EventKind {
    /// The kind's name in records, kebab-case.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cued => "cued",
            Self::Acquired => "acquired",
            Self::Lost(_) => "lost",
            Self::Reacquired => "reacquired",
            Self::Joined => "joined",
            Self::Discarded { .. } => "discarded",
            Self::TakenBack => "taken-back",
            Self::OrbitInfeasible { .. } => "orbit-infeasible",
            Self::OrbitFeasible => "orbit-feasible",
        }
    }
}

impl fmt::Display for EventKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cued => f.write_str("handed over by a search aircraft"),
            Self::Acquired => f.write_str("measured for the first time"),
            Self::Lost(LossReason::Widened) => f.write_str("unseen until its position was too uncertain"),
            Self::Lost(LossReason::Vanished) => f.write_str("unseen where it should be in plain view"),
            Self::Lost(LossReason::Diverged) => f.write_str("its estimate broke down"),
            Self::Reacquired => f.write_str("measured again"),
            Self::Joined => f.write_str("an orbit with it keeps the whole group in view"),
            Self::Discarded { needed_m, allowed_m } => write!(
                f,
                "furthest from the centre; keeping it needs an orbit of {needed_m:.0} m, the largest is {allowed_m:.0} m"
            ),
            Self::TakenBack => f.write_str("an orbit with it keeps the whole group in view again"),
            Self::OrbitInfeasible { smallest_m, largest_m } if smallest_m.is_finite() => write!(
                f,
                "view, turn rate and r_d,min need an orbit of at least {smallest_m:.0} m, \
                 r_d,max and the sensing range allow at most {largest_m:.0} m"
            ),
            Self::OrbitInfeasible { .. } => f.write_str("the group's centre is as fast as the UAVs can be"),
            Self::OrbitFeasible => f.write_str("an orbit satisfies every constraint again"),
        }
    }
}
