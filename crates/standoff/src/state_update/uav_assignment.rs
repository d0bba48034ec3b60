//! Assignment of UAVs to searches and groups.

use super::StepInput;
use crate::coordination::assignment::{AvailableUav, CandidateGroup, assign_changed, sound};
use crate::coordination::event::{Event, EventKind, ReassignmentReason};
use crate::coordination::group::Group;
use crate::coordination::lost_target_search::{SearchAssignment, SearchAssignmentUpdate};
use crate::coordination::teammate::Teammate;
use crate::frame::Position;
use crate::group_id::GroupId;
use crate::params::{GroupCount, GroupingParams, TeamParams};
use crate::team_state::TeamState;
use crate::uav::UavId;

impl TeamState {
    /// Updates the search assignments; the other UAVs are assigned to groups.
    pub(super) fn update_searches(&mut self, params: &TeamParams) {
        if params.group.search_lost_targets {
            let (memberships, team) = (&self.memberships, &mut self.teammates[..]);
            SearchAssignmentUpdate {
                memberships,
                team,
                params,
                assignments: &mut self.search_assignments,
                events: &mut self.events,
            }
            .update();
        }
    }

    /// Keeps the assignment; recomputes it if groups or UAVs have appeared or disappeared.
    pub(super) fn assign_uavs(&mut self, previous: &TeamState, input: &StepInput, params: &TeamParams) {
        self.assignments.clear();
        if self.groups.is_empty() {
            self.teammates.iter_mut().for_each(|teammate| teammate.group = None);
            return;
        }
        let reason = self.reason_to_assign(previous);
        if reason.is_none() && input.assignment.is_none() {
            return self.keep_assignments(previous);
        }
        // The reported assignment of a UAV counts, not the one that its teammates computed.
        let serves = |teammate: &Teammate| {
            teammate.reported_group.filter(|group| self.group(*group).is_some()).or(teammate.group)
        };
        let available = |teammate: &Teammate| AvailableUav {
            uav: teammate.uav,
            position: teammate.state.position,
            current_group: serves(teammate),
        };
        let not_searching =
            || self.teammates.iter().filter(|teammate| !is_searching(&self.search_assignments, teammate.uav));
        let uavs: Vec<AvailableUav> = not_searching().map(available).collect();
        let positions = |id: GroupId| self.memberships.of(id).map(|track_index| self.tracks()[track_index].position());
        let members: Vec<(GroupId, Vec<Position>)> =
            self.groups.iter().map(|group| (group.id, positions(group.id).collect())).collect();
        let priorities = |group: &Group| -> Vec<f64> {
            let all = || self.members_of(group.id).map(|known| known.priority);
            if all().all(|priority| priority == 1.0) { Vec::new() } else { all().collect() }
        };
        let priorities: Vec<Vec<f64>> = self.groups.iter().map(priorities).collect();
        let sites: Vec<_> = members
            .iter()
            .zip(&priorities)
            .map(|((group, members), priorities)| CandidateGroup { group: *group, members, priorities })
            .collect();
        let GroupingParams { objective, assignment_switching_cost, .. } = params.group;
        let custom = input.assignment.and_then(|law| law.assign(self.time, &uavs, &sites));
        let reason = match (custom, reason) {
            (Some(assignments), _) => {
                self.assignments = sound(assignments, &uavs, &sites);
                ReassignmentReason::CustomLaw
            }
            (None, Some(reason)) => {
                let (sensor, has_changed) = (&params.track.sensor, |site: usize| self.groups[site].has_changed());
                self.assignments =
                    assign_changed(&uavs, &sites, &has_changed, sensor, objective, assignment_switching_cost);
                reason
            }
            (None, None) => return self.keep_assignments(previous),
        };
        for group in &mut self.groups {
            group.members_when_assigned = group.members;
        }
        self.report_reassignments(&uavs, reason, params);
    }

    /// Adds an event for each UAV that changes its group.
    fn report_reassignments(&mut self, uavs: &[AvailableUav], reason: ReassignmentReason, params: &TeamParams) {
        for assignment in &self.assignments {
            let index = uavs.binary_search_by_key(&assignment.uav, |uav| uav.uav);
            let serves = index.ok().and_then(|index| uavs[index].current_group);
            if let Some(old) = serves.filter(|old| *old != assignment.group) {
                let group_size = self.assignments.iter().filter(|other| other.group == assignment.group).count();
                let reason =
                    if params.group.count == GroupCount::AsNeeded { reason.by_need(group_size) } else { reason };
                let event = Event::of_group(EventKind::Reassigned(reason), old);
                self.events.push(Event { to_group: Some(assignment.group), uav: Some(assignment.uav), ..event });
            }
        }
    }

    /// Keeps the assignments of the UAVs that do not search.
    pub(super) fn keep_assignments(&mut self, previous: &TeamState) {
        let Self { assignments: assigned_uavs, search_assignments, .. } = self;
        assigned_uavs
            .extend(previous.assignments.iter().filter(|assignment| !is_searching(search_assignments, assignment.uav)));
    }

    /// Returns the reason for a new assignment, if any.
    fn reason_to_assign(&self, previous: &TeamState) -> Option<ReassignmentReason> {
        if previous.assignments.iter().any(|assignment| self.teammate(assignment.uav).is_none()) {
            Some(ReassignmentReason::UavLost)
        } else if previous.groups.iter().any(|group| self.group(group.id).is_none()) {
            Some(ReassignmentReason::GroupRetired)
        } else if self.groups.iter().any(|group| previous.group(group.id).is_none()) {
            Some(ReassignmentReason::GroupCreated)
        } else {
            let mut idle = self.teammates.iter().filter(|teammate| teammate.group.is_none());
            match idle.find(|teammate| !is_searching(&self.search_assignments, teammate.uav)) {
                Some(teammate) if is_searching(&previous.search_assignments, teammate.uav) => {
                    Some(ReassignmentReason::SearchEnded)
                }
                Some(_) => Some(ReassignmentReason::UavJoined),
                None => self.groups.iter().any(Group::has_changed).then_some(ReassignmentReason::GroupChanged),
            }
        }
    }
}

fn is_searching(search_assignments: &[SearchAssignment], uav: UavId) -> bool {
    search_assignments.binary_search_by_key(&uav, |assignment| assignment.uav).is_ok()
}
