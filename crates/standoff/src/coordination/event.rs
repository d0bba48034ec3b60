//! What can happen to targets, groups and UAVs, and why, in words.

use core::fmt;

use crate::coordination::group::GroupId;
use crate::estimation::track::LossReason;
use crate::target::TargetId;
use crate::uav::UavId;

/// Something that changed in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// What happened.
    pub kind: EventKind,
    /// The target it happened to.
    pub target: Option<TargetId>,
    /// The group concerned; of a handoff or a re-assignment, the old one.
    pub group: Option<GroupId>,
    /// Of a handoff or a re-assignment, the new group.
    pub to: Option<GroupId>,
    /// The UAV it happened to; `None`: all UAVs of the groups are concerned.
    pub uav: Option<UavId>,
}

impl Event {
    /// Something that happened to a target; `group` is where it belongs.
    pub(crate) fn of_target(kind: EventKind, target: TargetId, group: Option<GroupId>) -> Self {
        Self { kind, target: Some(target), group, to: None, uav: None }
    }

    /// Something that happened to a group as a whole.
    pub(crate) fn of_group(kind: EventKind, group: GroupId) -> Self {
        Self { kind, target: None, group: Some(group), to: None, uav: None }
    }
}

/// What can happen; displays as the reason, in words.
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
    Outsiders,
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
    /// A group has twice, or half, as many targets as when UAVs were last assigned.
    GroupChanged,
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
            Self::UavLost => "uav-lost",
            Self::UavJoined => "uav-joined",
            Self::OrbitInfeasible { .. } => "orbit-infeasible",
            Self::OrbitFeasible => "orbit-feasible",
            Self::UavsClose { .. } => "uavs-close",
            Self::UavsApart => "uavs-apart",
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
            Self::GroupFounded { members, reason } => {
                let of = if *members == 1 { "1 target".to_owned() } else { format!("{members} targets") };
                match reason {
                    FoundingReason::First if *members == 1 => write!(f, "{of} by itself"),
                    FoundingReason::First => write!(f, "{of} near one another"),
                    FoundingReason::Outsiders if *members == 1 => write!(f, "{of} that was in no group"),
                    FoundingReason::Outsiders => write!(f, "{of} that were in no group"),
                    FoundingReason::Split => write!(f, "{of} split off: there are UAVs for another group"),
                }
            }
            Self::GroupDissolved(DissolutionReason::Empty) => f.write_str("its last member is gone"),
            Self::GroupDissolved(DissolutionReason::TooMany) => {
                f.write_str("the smallest, and fewer groups can be served now")
            }
            Self::GroupDissolved(DissolutionReason::Outnumbered { together }) => {
                write!(f, "its UAVs can watch more: {together} targets, its own and unassigned ones, fit on one orbit")
            }
            Self::GroupDissolved(DissolutionReason::Merged { into, together }) => {
                let others = if *together == 1 {
                    "1 unassigned target".to_owned()
                } else {
                    format!("{together} unassigned targets")
                };
                write!(f, "its UAVs can watch {others}, and group {} can hold its own", into.0)
            }
            Self::Joined => f.write_str("an orbit with it keeps the whole group in view"),
            Self::Regrouped => f.write_str("its group was split: there are UAVs for another one"),
            Self::HandoffRequested { dwell_s } => write!(
                f,
                "nearer to the new group; in both for {dwell_s:.1} s, in which the new group's UAVs reach the orbit with it"
            ),
            Self::HandoffCompleted(CompletionReason::Received) => f.write_str("the new group has it in view"),
            Self::HandoffCompleted(CompletionReason::PassingCannotHold) => {
                f.write_str("the old group's orbit can hold it no longer")
            }
            Self::HandoffCompleted(CompletionReason::PassingEnds) => f.write_str("the old group ends"),
            Self::HandoffCompleted(CompletionReason::Undelayed) => f.write_str("at once: the dwell is switched off"),
            Self::HandoffWithdrawn(reason) | Self::LeftOut(reason) => f.write_str(match reason {
                WithdrawalReason::WantedElsewhere => "at the end of the dwell it is nearer to another group",
                WithdrawalReason::ReceivingCannotHold => "the new group's orbit cannot hold it",
                WithdrawalReason::NotSeen => "no UAV of the new group got it into view in time",
                WithdrawalReason::GroupEnds => "its old or its new group ends",
                WithdrawalReason::TargetLost => "its track was lost",
            }),
            Self::Discarded { needed_m, allowed_m } => {
                let [needed, allowed] = told_apart(*needed_m, *allowed_m);
                write!(
                    f,
                    "furthest from the centre; keeping it needs an orbit of {needed} m, the largest is {allowed} m"
                )
            }
            Self::DiscardedDiverging { threshold_m2_s, limit_m2_s } => {
                let [threshold, limit] = told_apart(*threshold_m2_s, *limit_m2_s);
                write!(
                    f,
                    "furthest from the centre, and its orbit runs away from the UAVs: xi_th {threshold} m2/s, below \
                     {limit} m2/s for too long"
                )
            }
            Self::Merged => f.write_str("its group ends, and a neighbour's orbit holds it too"),
            Self::DiscardedTooFast { speed_m_s, limit_m_s } => write!(
                f,
                "the fastest, at {speed_m_s:.0} m/s, of a group that outruns the UAVs, which fly {limit_m_s:.0} m/s at most"
            ),
            Self::TakenBack => f.write_str("an orbit with it keeps the whole group in view again"),
            Self::Reassigned(AssignmentReason::GroupFounded) => f.write_str("a group was founded"),
            Self::Reassigned(AssignmentReason::GroupDissolved) => f.write_str("a group has ended"),
            Self::Reassigned(AssignmentReason::GroupChanged) => {
                f.write_str("a group has twice, or half, as many targets as when UAVs were last assigned")
            }
            Self::Reassigned(AssignmentReason::UavJoined) => f.write_str("a UAV has joined the team"),
            Self::Reassigned(AssignmentReason::UavLost) => f.write_str("a UAV has been silent for too long"),
            Self::UavLost => f.write_str("not heard for too long; the team goes on without it"),
            Self::UavJoined => f.write_str("heard for the first time, or again"),
            Self::OrbitInfeasible { smallest_m, largest_m } if smallest_m.is_finite() => {
                let [smallest, largest] = told_apart(*smallest_m, *largest_m);
                write!(
                    f,
                    "view, turn rate and r_d,min need an orbit of at least {smallest} m, \
                     r_d,max and the sensing range allow at most {largest} m"
                )
            }
            Self::OrbitInfeasible { .. } => f.write_str("the group's centre is as fast as the UAVs can be"),
            Self::OrbitFeasible => f.write_str("an orbit satisfies every constraint again"),
            Self::UavsClose { distance_m } => write!(f, "two UAVs at its altitude are {distance_m:.0} m apart"),
            Self::UavsApart => f.write_str("no two UAVs at its altitude are too close any more"),
        }
    }
}

/// Two values that differ, whole if that tells them apart, else with the decimals it takes.
fn told_apart(a: f64, b: f64) -> [String; 2] {
    let rounded = |digits: usize| [a, b].map(|value| format!("{value:.digits$}"));
    (0..=12).map(rounded).find(|[a, b]| a != b).unwrap_or_else(|| rounded(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_needed_never_reads_like_what_is_allowed() {
        for (needed_m, words) in [
            (896.2, "an orbit of 896 m, the largest is 700 m"),
            (700.3, "an orbit of 700.3 m, the largest is 700.0 m"),
            (700.0004, "an orbit of 700.0004 m, the largest is 700.0000 m"),
        ] {
            let reason = EventKind::Discarded { needed_m, allowed_m: 700.0 }.to_string();
            assert!(reason.ends_with(words), "{reason}");
        }
        let reason = EventKind::OrbitInfeasible { smallest_m: 499.8, largest_m: 499.6 }.to_string();
        assert!(reason.contains("at least 499.8 m") && reason.contains("at most 499.6 m"), "{reason}");
        let reason = EventKind::DiscardedDiverging { threshold_m2_s: -6000.4, limit_m2_s: -6000.0 }.to_string();
        assert!(reason.contains("xi_th -6000.4 m2/s, below -6000.0 m2/s"), "{reason}");
    }

    #[test]
    fn one_target_is_not_near_another() {
        let reason = |members| EventKind::GroupFounded { members, reason: FoundingReason::First }.to_string();
        assert_eq!([reason(1), reason(3)], ["1 target by itself", "3 targets near one another"]);
    }
}
