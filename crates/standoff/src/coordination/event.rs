//! What can happen to targets, groups and UAVs, and why.

use crate::estimation::track::{LossReason, TrackId};
use crate::group_id::GroupId;
use crate::guidance::airspace::ZoneKind;
use crate::uav::UavId;

/// Something that changed in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// What happened.
    pub kind: EventKind,
    /// The track of the target it happened to.
    pub track: Option<TrackId>,
    /// The group concerned; of a handoff or a re-assignment, the old one.
    pub group: Option<GroupId>,
    /// Of a handoff or a re-assignment, the new group.
    pub to: Option<GroupId>,
    /// The UAV it happened to; `None`: all UAVs of the groups are concerned.
    pub uav: Option<UavId>,
}

impl Event {
    /// Something that happened to a target; `group` is where it belongs.
    pub(crate) fn of_track(kind: EventKind, track: TrackId, group: Option<GroupId>) -> Self {
        Self { kind, track: Some(track), group, to: None, uav: None }
    }

    /// Something that happened to a group as a whole.
    pub(crate) fn of_group(kind: EventKind, group: GroupId) -> Self {
        Self { kind, track: None, group: Some(group), to: None, uav: None }
    }
}

/// What can happen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EventKind {
    /// A target was handed over by somebody who searches.
    Cued,
    /// A target was measured for the first time.
    Acquired,
    /// A track was given up.
    Lost(LossReason),
    /// A lost target was measured.
    Reacquired,
    /// A group came into being.
    GroupFounded {
        /// Number of its first members.
        members: u32,
        /// Why.
        reason: FoundingReason,
    },
    /// A group ended.
    GroupDissolved(DissolutionReason),
    /// A target joined a group in flight.
    Joined,
    /// A target's group was split, and it belongs to the new one.
    Regrouped,
    /// A target's group has ended in favour of a neighbour, to which it belongs now.
    Merged,
    /// Clustering wants a target in another group: it belongs to both for a while (34).
    HandoffRequested {
        /// T_hd, s.
        dwell_s: f64,
    },
    /// A target belongs to the receiving group alone.
    HandoffCompleted(CompletionReason),
    /// A target stays in the passing group.
    HandoffWithdrawn(WithdrawalReason),
    /// A target was removed from its group: the orbit with it would need this radius.
    Discarded {
        /// Radius needed, m.
        needed_m: f64,
        /// Radius allowed, m.
        allowed_m: f64,
    },
    /// A target was removed from its group: the orbit with it changes faster than the UAVs can follow (Lemma 3.1).
    DiscardedDiverging {
        /// xi_th of the UAV that follows best, m2/s.
        threshold_m2_s: f64,
        /// -xi_d, m2/s.
        limit_m2_s: f64,
    },
    /// A target was removed from its group, whose centre is faster than the UAVs can be: it was the fastest.
    DiscardedTooFast {
        /// Its speed, m/s.
        speed_m_s: f64,
        /// The UAVs' largest speed, m/s.
        limit_m_s: f64,
    },
    /// A discarded target was taken back.
    TakenBack,
    /// A target that was to be taken in or back stays outside, or its group has ended.
    LeftOut(WithdrawalReason),
    /// A UAV serves another group than before.
    Reassigned(AssignmentReason),
    /// A UAV leaves its group, if it has one, to search for a lost target.
    SearchStarted,
    /// It is called back.
    SearchEnded(SearchEnd),
    /// A UAV was not heard for too long: the team goes on without it.
    UavLost,
    /// A UAV came in, or came back.
    UavJoined,
    /// No orbit satisfies every constraint any more.
    OrbitInfeasible {
        /// Smallest radius that view, turn rate and bounds allow, m.
        smallest_m: f64,
        /// Largest radius that bounds and sensing range allow, m.
        largest_m: f64,
    },
    /// Some orbit satisfies every constraint again.
    OrbitFeasible,
    /// A zone cuts the orbit of a group: it is flown in part.
    OrbitCut {
        /// Share of the circle of r_d about the centre where UAVs may be, 0 to 1.
        clear_fraction: f64,
        /// Which zone, by its place in the airspace; of several one.
        zone: u32,
        /// Of which kind that is.
        by: ZoneKind,
    },
    /// Nothing, or next to nothing, of the orbit of a group is where UAVs may be: they fly a wider one, or as near as they can.
    OrbitBarred {
        /// Which zone, by its place in the airspace; of several one.
        zone: u32,
        /// Of which kind that is.
        by: ZoneKind,
    },
    /// No zone cuts the orbit any more.
    OrbitClear,
    /// Two UAVs of a group came closer than wanted.
    UavsClose {
        /// Their distance, m.
        distance_m: f64,
    },
    /// They are apart again.
    UavsApart,
}

/// Why a group came into being.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FoundingReason {
    /// Nothing was watched yet.
    First,
    /// Targets in no group.
    Unassigned,
    /// Targets in no group, and there are not two UAVs for each group any more: some groups have one.
    Scarce,
    /// There are UAVs for another group: this one was split off.
    Split,
}

/// Why a group ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DissolutionReason {
    /// Its last member left or was lost.
    Empty,
    /// There are fewer UAVs, or targets, than so many groups need.
    TooMany,
    /// Others hold all that it held, and its UAVs are needed elsewhere.
    NotNeeded,
    /// Another group can hold its targets too, and its UAVs can watch others.
    Merged {
        /// The other group.
        into: GroupId,
        /// How many others can be watched together.
        together: u32,
    },
    /// Its UAVs can watch far more targets elsewhere, or a little to the side.
    Outnumbered {
        /// How many can be watched together there.
        together: u32,
    },
}

/// Why a handoff was completed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CompletionReason {
    /// The dwell is over, and a receiving UAV has the target in view.
    Received,
    /// The passing group can hold the target no longer.
    PassingCannotHold,
    /// The passing group has ended.
    PassingEnds,
    /// The dwell is switched off.
    Undelayed,
}

/// Why a handoff was withdrawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WithdrawalReason {
    /// At the end of the dwell, clustering wants the target elsewhere.
    WantedElsewhere,
    /// The receiving group cannot hold the target.
    ReceivingCannotHold,
    /// In the longest dwell, no receiving UAV got the target into view.
    NotSeen,
    /// One of the two groups has ended, or would without the target.
    GroupEnds,
    /// The target's track was given up.
    TargetLost,
}

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchEnd {
    /// The target was measured.
    Found,
    /// It can be anywhere by now, or is forgotten.
    GivenUp,
    /// A group needs the UAV.
    Needed,
}

/// Why the UAVs were assigned anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AssignmentReason {
    /// A group came into being.
    GroupFounded,
    /// A group ended.
    GroupDissolved,
    /// A UAV came in.
    UavJoined,
    /// A UAV is silent.
    UavLost,
    /// A UAV is back from a search.
    SearchEnded,
    /// A group has twice, or half, as many targets as when UAVs were last assigned.
    GroupChanged,
    /// Targets would be in no group: the UAV serves the new one alone. Where groups are formed by need.
    Unwatched,
    /// A group has ended: the UAV makes a pair. Where groups are formed by need.
    Pair,
    /// An assignment law of one's own wants it so.
    OwnLaw,
}

impl AssignmentReason {
    /// What it is for a UAV that becomes one of `crew` that serve the group, where groups are formed by need.
    pub(crate) fn by_need(self, crew: usize) -> Self {
        match self {
            Self::GroupFounded if crew < 2 => Self::Unwatched,
            Self::GroupDissolved if crew > 1 => Self::Pair,
            other => other,
        }
    }
}

impl EventKind {
    /// The kind's name in records, kebab-case.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cued => "cued",
            Self::Acquired => "acquired",
            Self::Lost(_) => "lost",
            Self::Reacquired => "reacquired",
            Self::GroupFounded { .. } => "group-founded",
            Self::GroupDissolved(_) => "group-dissolved",
            Self::Joined => "joined",
            Self::Regrouped | Self::Merged => "regrouped",
            Self::HandoffRequested { .. } => "handoff-requested",
            Self::HandoffCompleted(_) => "handoff-completed",
            Self::HandoffWithdrawn(_) => "handoff-withdrawn",
            Self::Discarded { .. } | Self::DiscardedDiverging { .. } | Self::DiscardedTooFast { .. } => "discarded",
            Self::TakenBack => "taken-back",
            Self::LeftOut(_) => "left-out",
            Self::Reassigned(_) => "reassigned",
            Self::SearchStarted => "search-started",
            Self::SearchEnded(_) => "search-ended",
            Self::UavLost => "uav-lost",
            Self::UavJoined => "uav-joined",
            Self::OrbitInfeasible { .. } => "orbit-infeasible",
            Self::OrbitFeasible => "orbit-feasible",
            Self::OrbitCut { .. } => "orbit-cut",
            Self::OrbitBarred { .. } => "orbit-barred",
            Self::OrbitClear => "orbit-clear",
            Self::UavsClose { .. } => "uavs-close",
            Self::UavsApart => "uavs-apart",
        }
    }

    /// Why it happened, kebab-case, where the kind alone does not tell.
    pub fn cause(&self) -> Option<&'static str> {
        Some(match self {
            Self::Lost(LossReason::Widened) => "widened",
            Self::Lost(LossReason::Vanished) => "vanished",
            Self::Lost(LossReason::Diverged) => "diverged",
            Self::GroupFounded { reason: FoundingReason::First, .. } => "first",
            Self::GroupFounded { reason: FoundingReason::Unassigned, .. } => "unassigned",
            Self::GroupFounded { reason: FoundingReason::Scarce, .. } => "scarce",
            Self::GroupFounded { reason: FoundingReason::Split, .. } | Self::Regrouped => "split",
            Self::GroupDissolved(DissolutionReason::Empty) => "empty",
            Self::GroupDissolved(DissolutionReason::TooMany) => "too-many",
            Self::GroupDissolved(DissolutionReason::NotNeeded) => "not-needed",
            Self::GroupDissolved(DissolutionReason::Merged { .. }) | Self::Merged => "merged",
            Self::GroupDissolved(DissolutionReason::Outnumbered { .. }) => "outnumbered",
            Self::HandoffCompleted(CompletionReason::Received) => "received",
            Self::HandoffCompleted(CompletionReason::PassingCannotHold) => "passing-cannot-hold",
            Self::HandoffCompleted(CompletionReason::PassingEnds) => "passing-ends",
            Self::HandoffCompleted(CompletionReason::Undelayed) => "undelayed",
            Self::HandoffWithdrawn(reason) | Self::LeftOut(reason) => match reason {
                WithdrawalReason::WantedElsewhere => "wanted-elsewhere",
                WithdrawalReason::ReceivingCannotHold => "receiving-cannot-hold",
                WithdrawalReason::NotSeen => "not-seen",
                WithdrawalReason::GroupEnds => "group-ends",
                WithdrawalReason::TargetLost => "target-lost",
            },
            Self::Discarded { .. } => "too-wide",
            Self::DiscardedDiverging { .. } => "diverging",
            Self::DiscardedTooFast { .. } => "too-fast",
            Self::Reassigned(AssignmentReason::GroupFounded) => "group-founded",
            Self::Reassigned(AssignmentReason::GroupDissolved) => "group-dissolved",
            Self::Reassigned(AssignmentReason::GroupChanged) => "group-changed",
            Self::Reassigned(AssignmentReason::Unwatched) => "unwatched",
            Self::Reassigned(AssignmentReason::Pair) => "pair",
            Self::Reassigned(AssignmentReason::UavJoined) => "uav-joined",
            Self::Reassigned(AssignmentReason::UavLost) => "uav-lost",
            Self::Reassigned(AssignmentReason::SearchEnded) => "search-ended",
            Self::Reassigned(AssignmentReason::OwnLaw) => "own-law",
            Self::SearchEnded(SearchEnd::Found) => "found",
            Self::SearchEnded(SearchEnd::GivenUp) => "given-up",
            Self::SearchEnded(SearchEnd::Needed) => "needed",
            Self::OrbitInfeasible { smallest_m, .. } if smallest_m.is_finite() => "too-wide",
            Self::OrbitInfeasible { .. } => "too-fast",
            Self::OrbitCut { by, .. } | Self::OrbitBarred { by, .. } => by.name(),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Alone to a new group, or to another one as a second: only that tells more than that groups have come or gone.
    #[test]
    fn a_uav_is_reassigned_alone_or_as_a_second() {
        let cause = |reason: AssignmentReason, crew| EventKind::Reassigned(reason.by_need(crew)).cause();
        let [founded, dissolved] = [AssignmentReason::GroupFounded, AssignmentReason::GroupDissolved];
        assert_eq!([1, 2].map(|crew| cause(founded, crew)), [Some("unwatched"), Some("group-founded")]);
        assert_eq!([1, 2].map(|crew| cause(dissolved, crew)), [Some("group-dissolved"), Some("pair")]);
        assert_eq!(cause(AssignmentReason::UavLost, 2), Some("uav-lost"));
    }
}
