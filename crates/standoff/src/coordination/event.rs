//! Events: what can happen to targets, groups and UAVs, and why.

use crate::group_id::GroupId;
use crate::safety::geofence::ZoneKind;
use crate::tracking::track::{LossReason, TrackId};
use crate::uav::UavId;

/// A change of the team state.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Event {
    /// Kind of event.
    pub kind: EventKind,
    /// Track of the target concerned.
    pub track: Option<TrackId>,
    /// Group concerned; the old one in a handoff or reassignment.
    pub group: Option<GroupId>,
    /// New group in a handoff or reassignment.
    pub to_group: Option<GroupId>,
    /// UAV concerned; `None` if all UAVs of the groups are.
    pub uav: Option<UavId>,
}

impl Event {
    /// Event of a target; `group` is the target's group.
    pub(crate) fn of_track(kind: EventKind, track: TrackId, group: Option<GroupId>) -> Self {
        Self { kind, track: Some(track), group, to_group: None, uav: None }
    }

    /// Event of a group as a whole.
    pub(crate) fn of_group(kind: EventKind, group: GroupId) -> Self {
        Self { kind, track: None, group: Some(group), to_group: None, uav: None }
    }
}

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum EventKind {
    /// A cue source reported a target.
    Cued,
    /// A target was measured for the first time.
    Acquired,
    /// A track was lost.
    Lost(LossReason),
    /// A lost target was measured.
    Reacquired,
    /// A group was created.
    GroupCreated {
        /// Number of its first members.
        members: u32,
        /// Reason for the creation.
        reason: GroupCreatedReason,
    },
    /// A group was retired.
    GroupRetired(GroupRetiredReason),
    /// A target was admitted to a group in flight.
    Admitted,
    /// A group was split, and the target belongs to the new group.
    Regrouped,
    /// A group was merged into a neighbour, and the target belongs to that one.
    Merged,
    /// A handoff started because clustering assigns the target to another group; for the dwell, it belongs to both
    /// (34).
    HandoffStarted {
        /// Dwell time T_hd, s.
        dwell_s: f64,
    },
    /// A handoff was completed: the target belongs to the receiving group alone.
    HandoffCompleted(HandoffCompletedReason),
    /// A handoff was cancelled: the target stays in the passing group.
    HandoffCancelled(HandoffCancelledReason),
    /// A target was removed from its group, because the orbit that includes it would be too large.
    Removed {
        /// Required radius, m.
        required_radius_m: f64,
        /// Allowed radius, m.
        allowed_radius_m: f64,
    },
    /// A target was removed from its group, because the orbit that includes it changes faster than the UAVs can follow
    /// (Lemma 3.1).
    RemovedDiverging {
        /// xi_th of the UAV that follows best, m2/s.
        threshold_m2_s: f64,
        /// Limit -xi_d, m2/s.
        limit_m2_s: f64,
    },
    /// The fastest target was removed from a group whose centre is faster than the UAVs can fly.
    RemovedTooFast {
        /// Speed of the target, m/s.
        speed_m_s: f64,
        /// Maximum speed of the UAVs, m/s.
        limit_m_s: f64,
    },
    /// A removed target was readmitted.
    Readmitted,
    /// An admission was cancelled, or a group was retired and its member is now in no group.
    NotAdmitted(HandoffCancelledReason),
    /// A UAV is assigned to another group than before.
    Reassigned(ReassignmentReason),
    /// A UAV leaves its group, if it has one, to search for a lost target.
    SearchStarted,
    /// A UAV stopped searching.
    SearchEnded(SearchEndReason),
    /// A UAV left the team: it was silent for longer than the teammate timeout, or announced that it leaves.
    UavTimeout,
    /// A UAV joined or rejoined the team.
    UavJoined,
    /// No orbit satisfies every constraint any more.
    OrbitInfeasible {
        /// Smallest radius that field of view, turn rate and bounds allow, m.
        radius_min_m: f64,
        /// Largest radius that bounds and sensing range allow, m.
        radius_max_m: f64,
    },
    /// Some orbit satisfies every constraint again.
    OrbitFeasible,
    /// Zones block part of a group's orbit; the rest of it is flown.
    OrbitPartlyBlocked {
        /// Fraction of the circle of radius r_d around the centre at which UAVs may fly, 0 to 1.
        clear_fraction: f64,
        /// Index of the zone; one of them if there are several.
        zone: u32,
        /// Kind of the zone.
        kind: ZoneKind,
    },
    /// Zones block all or almost all of a group's orbit; the UAVs fly a wider one, or as near to it as they can.
    OrbitBlocked {
        /// Index of the zone; one of them if there are several.
        zone: u32,
        /// Kind of the zone.
        kind: ZoneKind,
    },
    /// No zone blocks the orbit any more.
    OrbitUnblocked,
    /// Two UAVs of a group came closer than the proximity alert allows.
    ProximityAlert {
        /// Distance between them, m.
        distance_m: f64,
    },
    /// The UAVs have cleared the proximity alert.
    ProximityCleared,
}

/// Reason for the creation of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum GroupCreatedReason {
    /// There were no groups.
    First,
    /// There were targets in no group.
    Ungrouped,
    /// There were targets in no group, and there are fewer than two UAVs for each group, so that some groups have one.
    UavShortage,
    /// There are enough UAVs for another group, so that a group was split.
    Split,
}

/// Reason for the retirement of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum GroupRetiredReason {
    /// Its last member left or was lost.
    Empty,
    /// There are fewer UAVs or targets than this number of groups needs.
    TooManyGroups,
    /// Other groups contain all of its members, and its UAVs are needed elsewhere.
    Redundant,
    /// Another group can contain its targets, too, so that its UAVs can cover others.
    Merged {
        /// The other group.
        into: GroupId,
        /// Number of other targets that can be covered together.
        coverable_targets: u32,
    },
    /// Its UAVs can cover far more targets elsewhere or slightly to the side.
    BetterCoverage {
        /// Number of targets that can be covered together there.
        together: u32,
    },
}

/// Reason for the completion of a handoff.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum HandoffCompletedReason {
    /// The dwell is over, and a receiving UAV has the target in view.
    Received,
    /// The passing group can no longer contain the target.
    PassingGroupCannotCover,
    /// The passing group was retired.
    PassingGroupRetired,
    /// The dwell is disabled.
    NoDwell,
}

/// Reason for the cancellation of a handoff.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum HandoffCancelledReason {
    /// At the end of the dwell, clustering assigns the target to another group.
    ReassignedByClustering,
    /// The receiving group cannot contain the target.
    ReceivingGroupCannotCover,
    /// No receiving UAV got the target into view within the maximum dwell.
    NotInView,
    /// One of the two groups was retired, or would be without the target.
    GroupRetired,
    /// The track of the target was lost.
    TargetLost,
}

/// Reason for the end of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SearchEndReason {
    /// The target was measured.
    Found,
    /// The search area became too large, or the track was removed.
    GivenUp,
    /// A group needs the UAV.
    Recalled,
}

/// Reason for a new assignment of UAVs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReassignmentReason {
    /// A group was created.
    GroupCreated,
    /// A group was retired.
    GroupRetired,
    /// A UAV joined.
    UavJoined,
    /// A UAV has timed out.
    UavLost,
    /// A UAV returned from a search.
    SearchEnded,
    /// A group has at least twice or at most half as many targets as at the last assignment.
    GroupChanged,
    /// Only with groups as needed: targets would be in no group, so that the UAV covers the new group alone.
    Untracked,
    /// Only with groups as needed: a group was retired, so that its UAV joins the single UAV of another.
    Pair,
    /// A custom assignment law decided so.
    CustomLaw,
}

impl ReassignmentReason {
    /// Refines the reason for a UAV that becomes one of `assigned_uavs` UAVs of a group, with groups as needed.
    pub(crate) fn by_need(self, assigned_uavs: usize) -> Self {
        match self {
            Self::GroupCreated if assigned_uavs < 2 => Self::Untracked,
            Self::GroupRetired if assigned_uavs > 1 => Self::Pair,
            other => other,
        }
    }
}

impl EventKind {
    /// Name of the kind in records, kebab-case.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cued => "cued",
            Self::Acquired => "acquired",
            Self::Lost(_) => "lost",
            Self::Reacquired => "reacquired",
            Self::GroupCreated { .. } => "group-created",
            Self::GroupRetired(_) => "group-retired",
            Self::Admitted => "admitted",
            Self::Regrouped | Self::Merged => "regrouped",
            Self::HandoffStarted { .. } => "handoff-started",
            Self::HandoffCompleted(_) => "handoff-completed",
            Self::HandoffCancelled(_) => "handoff-cancelled",
            Self::Removed { .. } | Self::RemovedDiverging { .. } | Self::RemovedTooFast { .. } => "removed",
            Self::Readmitted => "readmitted",
            Self::NotAdmitted(_) => "not-admitted",
            Self::Reassigned(_) => "reassigned",
            Self::SearchStarted => "search-started",
            Self::SearchEnded(_) => "search-ended",
            Self::UavTimeout => "uav-timeout",
            Self::UavJoined => "uav-joined",
            Self::OrbitInfeasible { .. } => "orbit-infeasible",
            Self::OrbitFeasible => "orbit-feasible",
            Self::OrbitPartlyBlocked { .. } => "orbit-partly-blocked",
            Self::OrbitBlocked { .. } => "orbit-blocked",
            Self::OrbitUnblocked => "orbit-unblocked",
            Self::ProximityAlert { .. } => "proximity-alert",
            Self::ProximityCleared => "proximity-cleared",
        }
    }

    /// Cause in records, kebab-case; `None` if the kind has only one.
    pub fn cause(&self) -> Option<&'static str> {
        Some(match self {
            Self::Lost(LossReason::TooUncertain) => "too-uncertain",
            Self::Lost(LossReason::UnseenInView) => "unseen-in-view",
            Self::Lost(LossReason::Diverged) => "diverged",
            Self::GroupCreated { reason: GroupCreatedReason::First, .. } => "first",
            Self::GroupCreated { reason: GroupCreatedReason::Ungrouped, .. } => "ungrouped",
            Self::GroupCreated { reason: GroupCreatedReason::UavShortage, .. } => "uav-shortage",
            Self::GroupCreated { reason: GroupCreatedReason::Split, .. } | Self::Regrouped => "split",
            Self::GroupRetired(GroupRetiredReason::Empty) => "empty",
            Self::GroupRetired(GroupRetiredReason::TooManyGroups) => "too-many",
            Self::GroupRetired(GroupRetiredReason::Redundant) => "redundant",
            Self::GroupRetired(GroupRetiredReason::Merged { .. }) | Self::Merged => "merged",
            Self::GroupRetired(GroupRetiredReason::BetterCoverage { .. }) => "better-coverage",
            Self::HandoffCompleted(HandoffCompletedReason::Received) => "received",
            Self::HandoffCompleted(HandoffCompletedReason::PassingGroupCannotCover) => "passing-group-cannot-cover",
            Self::HandoffCompleted(HandoffCompletedReason::PassingGroupRetired) => "passing-group-retired",
            Self::HandoffCompleted(HandoffCompletedReason::NoDwell) => "no-dwell",
            Self::HandoffCancelled(reason) | Self::NotAdmitted(reason) => match reason {
                HandoffCancelledReason::ReassignedByClustering => "reassigned-by-clustering",
                HandoffCancelledReason::ReceivingGroupCannotCover => "receiving-group-cannot-cover",
                HandoffCancelledReason::NotInView => "not-in-view",
                HandoffCancelledReason::GroupRetired => "group-retired",
                HandoffCancelledReason::TargetLost => "target-lost",
            },
            Self::Removed { .. } => "radius-exceeded",
            Self::RemovedDiverging { .. } => "diverging",
            Self::RemovedTooFast { .. } => "too-fast",
            Self::Reassigned(ReassignmentReason::GroupCreated) => "group-created",
            Self::Reassigned(ReassignmentReason::GroupRetired) => "group-retired",
            Self::Reassigned(ReassignmentReason::GroupChanged) => "group-changed",
            Self::Reassigned(ReassignmentReason::Untracked) => "untracked",
            Self::Reassigned(ReassignmentReason::Pair) => "pair",
            Self::Reassigned(ReassignmentReason::UavJoined) => "uav-joined",
            Self::Reassigned(ReassignmentReason::UavLost) => "uav-timeout",
            Self::Reassigned(ReassignmentReason::SearchEnded) => "search-ended",
            Self::Reassigned(ReassignmentReason::CustomLaw) => "custom-law",
            Self::SearchEnded(SearchEndReason::Found) => "found",
            Self::SearchEnded(SearchEndReason::GivenUp) => "given-up",
            Self::SearchEnded(SearchEndReason::Recalled) => "recalled",
            Self::OrbitInfeasible { radius_min_m: smallest_m, .. } if smallest_m.is_finite() => "radius-exceeded",
            Self::OrbitInfeasible { .. } => "too-fast",
            Self::OrbitPartlyBlocked { kind, .. } | Self::OrbitBlocked { kind, .. } => kind.name(),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A UAV alone in a new group, or the second UAV of an old group, has a more specific reason than the creation or
    /// retirement of groups.
    #[test]
    fn reassignment_reasons_distinguish_single_uavs_and_pairs() {
        let cause =
            |reason: ReassignmentReason, assigned_uavs| EventKind::Reassigned(reason.by_need(assigned_uavs)).cause();
        let [created, retired] = [ReassignmentReason::GroupCreated, ReassignmentReason::GroupRetired];
        assert_eq!(
            [1, 2].map(|assigned_uavs| cause(created, assigned_uavs)),
            [Some("untracked"), Some("group-created")]
        );
        assert_eq!([1, 2].map(|assigned_uavs| cause(retired, assigned_uavs)), [Some("group-retired"), Some("pair")]);
        assert_eq!(cause(ReassignmentReason::UavLost, 2), Some("uav-timeout"));
    }
}
