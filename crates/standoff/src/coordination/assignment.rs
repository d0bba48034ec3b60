//! Assignment of UAVs to groups, based on the information that each UAV would gain there.
//!
//! ```text
//! paper      max  det( sum over groups, targets and UAVs of F )          every group assigned       Eq. (32, 33)
//! default    max  sum over groups and their targets of p ln det( sum over the group's UAVs of F )
//! F = H' R^-1 H, the information of one UAV about one target                                        Eq. (31)
//! p: priority of the target
//! ```
//!
//! Restated: information about different targets must not be summed, so the default adds logarithms of determinants,
//! one for each target. Furthermore, (33) as published assigns one UAV to two groups, although it flies one orbit. Here
//! every UAV is assigned to exactly one group. If N UAVs suffice for G groups, every group gets at least one UAV and at
//! most max(2, ceil(N / G)). Otherwise, N groups get one UAV each: of all such choices those that cover the highest
//! total priority, and of these the one that the objective prefers (ln det is negative in general, so that it cannot decide
//! whether a group is worth a UAV at all).
//!
//! The score of a group, ln det or the sum of them, is rounded to millionths, so that sums do not depend on the order
//! and ties are exact. Of tied assignments, the first group gets the UAVs with the lower ids, then the second group,
//! and so on: at the first group that differs between two assignments, the assignment that gives it the lowest
//! differing UAV wins.

mod local_search;
mod neighbourhood_search;
mod problem;
#[cfg(test)]
mod tests;

use core::fmt;

use crate::group_id::GroupId;
use crate::params::{Objective, SensorParams};
use crate::time::Time;
use crate::uav::UavId;
pub use problem::{AvailableUav, CandidateGroup};
use problem::{Problem, UavSet};

/// Maximum number of UAVs with an exact assignment and the tie-breaking described above; for more UAVs, see [`assign`].
pub(crate) const EXACT_UAVS_MAX: usize = 12;

/// Maximum number of UAVs and of groups that [`Objective::Paper`] enumerates; for more, the default objective
/// replaces it.
pub(crate) const PAPER_OBJECTIVE_UAVS_MAX: usize = 8;

/// Custom replacement for the built-in assignment law (33), which is called at every time step with groups.
pub trait AssignmentLaw: fmt::Debug + Send + Sync {
    /// Returns the new assignment; `None` uses the built-in law. UAVs and groups are in ascending order of ids. A UAV
    /// without an entry, or with a group that is not in `sites`, is assigned to no group; of two entries for a UAV, the
    /// first counts.
    fn assign(&self, now: Time, uavs: &[AvailableUav], sites: &[CandidateGroup<'_>]) -> Option<Vec<Assignment>>;
}

/// Makes the result of a custom law valid: existing UAVs and groups only, by ascending UAV, each at most once.
pub(crate) fn sound(
    mut assignments: Vec<Assignment>,
    uavs: &[AvailableUav],
    sites: &[CandidateGroup<'_>],
) -> Vec<Assignment> {
    let exists = |assignment: &Assignment| {
        uavs.iter().any(|uav| uav.uav == assignment.uav) && sites.iter().any(|site| site.group == assignment.group)
    };
    assignments.retain(exists);
    assignments.sort_by_key(|assignment| assignment.uav);
    assignments.dedup_by_key(|assignment| assignment.uav);
    assignments
}

/// Assignment of a UAV to a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Assignment {
    /// Id of the UAV.
    pub uav: UavId,
    /// Assigned group.
    pub group: GroupId,
}

/// Assigns every UAV to a group; in the order of `uavs`, empty without UAVs or groups. UAVs and groups must be in
/// ascending order of ids.
///
/// Implements Eq. (32), (33), as restated above.
///
/// The result is exact for up to `EXACT_UAVS_MAX` UAVs. Otherwise, it comes from a search of bounded length that starts
/// from the current groups of the UAVs, and breaks ties arbitrarily but identically in every run.
///
/// `switching_cost` is the switching cost of a UAV under the default objective, in ln det per target of its current group;
/// a target counts by its priority.
pub fn assign(
    uavs: &[AvailableUav],
    sites: &[CandidateGroup<'_>],
    sensor: &SensorParams,
    objective: Objective,
    switching_cost: f64,
) -> Vec<Assignment> {
    assign_changed(uavs, sites, &|_| true, sensor, objective, switching_cost)
}

/// Like [`assign`], but of more UAVs than `EXACT_UAVS_MAX`, only those near a change are reconsidered: near groups that
/// have appeared or have lost a UAV, and near those that `has_changed` selects by their index in `sites`.
pub(crate) fn assign_changed(
    uavs: &[AvailableUav],
    sites: &[CandidateGroup<'_>],
    has_changed: &dyn Fn(usize) -> bool,
    sensor: &SensorParams,
    objective: Objective,
    switching_cost: f64,
) -> Vec<Assignment> {
    if uavs.is_empty() || sites.is_empty() {
        return Vec::new();
    }
    let sets_of = |problem: &Problem, uav_sets: Vec<UavSet>| -> Vec<(GroupId, UavSet)> {
        problem.groups.iter().map(|choice| choice.group).zip(uav_sets).collect()
    };
    let uav_sets = if uavs.len() > EXACT_UAVS_MAX {
        let uav_sets = neighbourhood_search::search(uavs, sites, has_changed, sensor, switching_cost);
        sites.iter().map(|site| site.group).zip(uav_sets).collect()
    } else {
        let problem = Problem::new(uavs, sites, sensor, switching_cost);
        if objective == Objective::Paper && uavs.len().max(sites.len()) <= PAPER_OBJECTIVE_UAVS_MAX {
            sets_of(&problem, problem.paper_objective())
        } else {
            sets_of(&problem, problem.exact())
        }
    };
    let assigned = uav_sets.iter().flat_map(|(group, uav_set)| uav_set.iter().map(|uav| (*uav, *group)));
    let mut assigned: Vec<(usize, GroupId)> = assigned.collect();
    assigned.sort_unstable();
    assigned.into_iter().map(|(uav, group)| Assignment { uav: uavs[uav].uav, group }).collect()
}
