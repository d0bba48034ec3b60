//! Team state at one time step: all known targets, the groups and their orbits (a common operating picture).
//!
//! A team state is a function of the previous one and of the messages in between. All agents that compute it get
//! bitwise equal results.

use crate::by_group::ByGroup;
use crate::coordination::assignment::Assignment;
use crate::coordination::event::Event;
use crate::coordination::group::Group;
use crate::coordination::grouping::GroupingState;
use crate::coordination::lost_target_search::SearchAssignment;
use crate::coordination::memberships::{GroupedTrack, Memberships};
use crate::coordination::reported_places::ReportedPlaces;
use crate::coordination::teammate::Teammate;
use crate::digest::digest;
use crate::group_id::GroupId;
use crate::guidance::heading::OrbitRelativeState;
use crate::message::{TARGETS_MAX, TEAM_MAX, TargetLabel, WRONG_MAX_S};
use crate::params::TeamParams;
use crate::time::{Duration, Time};
use crate::tracking::existence::UnlabelledTracks;
use crate::tracking::track::{Track, TrackId};
use crate::uav::UavId;

#[cfg(test)]
mod tests;

/// Knowledge and intent of a team at one time step.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TeamState {
    /// Time of the time step.
    pub time: Time,
    /// Groups, by ascending id.
    pub groups: Vec<Group>,
    /// Assignment of UAVs to groups, by ascending UAV. It contains every UAV received within the teammate timeout that
    /// does not search, while there are groups.
    pub assignments: Vec<Assignment>,
    /// UAVs that search for lost targets, by ascending UAV.
    pub search_assignments: Vec<SearchAssignment>,
    /// Number of tracks that are not lost and in no group.
    pub ungrouped_count: u32,
    /// Events of this time step.
    #[serde(skip)]
    pub events: Vec<Event>,
    /// UAVs whose reports were received within the teammate timeout, by ascending id, with their groups.
    pub teammates: Vec<Teammate>,
    pub(crate) memberships: Memberships,
    /// Tracks of detections without label. Serialised apart, and only if there are any.
    #[serde(skip)]
    pub(crate) unlabelled: UnlabelledTracks,
    /// Place of each UAV on its group's orbit; empty while there are no groups.
    #[serde(skip)]
    pub(crate) on_orbit: Vec<OrbitRelativeState>,
    /// UAVs of each group; empty while there are no groups.
    #[serde(skip)]
    pub(crate) group_uavs: ByGroup<GroupId>,
    /// Index of the UAVs by their last reports.
    #[serde(skip)]
    pub(crate) reported_places: ReportedPlaces,
    pub(crate) had_team: bool,
    pub(crate) grouping_state: GroupingState,
    /// Number of implausible reports of this time step, with a position that the UAV cannot have reached, and of
    /// targets beyond the maximum.
    #[serde(skip)]
    pub(crate) implausible: u32,
    /// Number of detections of this time step that are too far from the prediction of their track.
    #[serde(skip)]
    pub(crate) gated: u32,
}

impl TeamState {
    /// All known targets, by ascending track.
    pub fn tracks(&self) -> &[GroupedTrack] {
        self.memberships.tracks()
    }

    /// Tentative tracks of detections without label, by ascending id.
    pub fn tentative_tracks(&self) -> impl Iterator<Item = crate::tracking::existence::TentativeTrack> {
        self.unlabelled.tentative()
    }

    /// Members of a group, including those in handoff to or from it.
    pub(crate) fn members_of(&self, group: GroupId) -> impl Iterator<Item = &GroupedTrack> + Clone {
        self.memberships.of(group).map(|track_index| &self.tracks()[track_index])
    }

    /// Returns the target with a track id.
    pub fn track(&self, track: TrackId) -> Option<&GroupedTrack> {
        self.memberships.track_index(track).ok().map(|track_index| &self.tracks()[track_index])
    }

    /// Returns the target with a sensor-reported identity.
    pub fn track_by_label(&self, label: TargetLabel) -> Option<&GroupedTrack> {
        self.track(label.into())
    }

    /// Returns the assigned group of a UAV.
    pub fn group_of(&self, uav: UavId) -> Option<&Group> {
        let assignment = self
            .assignments
            .binary_search_by_key(&uav, |assignment| assignment.uav)
            .ok()
            .map(|index| &self.assignments[index])?;
        self.group(assignment.group)
    }

    /// Returns the lost track that a UAV searches for.
    pub(crate) fn search_target_of(&self, uav: UavId) -> Option<&Track> {
        let assignment = self
            .search_assignments
            .binary_search_by_key(&uav, |assignment| assignment.uav)
            .ok()
            .map(|index| &self.search_assignments[index])?;
        self.track(assignment.track).map(|known| &known.track)
    }

    /// 64-bit digest of the state. States with equal digests evolve equally.
    pub fn digest(&self) -> u64 {
        let priorities = self.memberships.own_priorities();
        match (self.unlabelled.is_empty(), priorities.is_empty()) {
            (true, true) => digest(self),
            (false, true) => digest(&(self, &self.unlabelled)),
            (_, false) => digest(&(self, &self.unlabelled, priorities)),
        }
    }

    /// Validates a state received from another agent and restores the fields that are not serialised. Returns `false`
    /// for an invalid state: unordered or oversized lists, times in the future, or NaNs.
    pub(crate) fn rebuild_index(&mut self, params: &TeamParams) -> bool {
        self.reported_places.rebuild(&self.teammates);
        self.memberships.rebuild_index(self.time, Duration::from_s(params.group.dwell_max_s))
            && self.unlabelled.is_valid(self.time)
            && self.grouping_state.is_valid(self.time, params)
            && self.tracks().len() <= TARGETS_MAX
            && self.teammates.len() <= TEAM_MAX
            && is_ascending(self.groups.iter().map(|group| group.id.0))
            && self.groups.iter().map(|group| group.id).eq(self.memberships.groups().iter().copied())
            && self.groups.iter().all(Group::is_valid)
            && is_ascending(self.assignments.iter().map(|assignment| u64::from(assignment.uav.0)))
            && self.assignments.iter().all(|assignment| self.group(assignment.group).is_some())
            && is_ascending(self.search_assignments.iter().map(|assignment| u64::from(assignment.uav.0)))
            && self.search_assignments.iter().all(|assignment| self.track(assignment.track).is_some())
            && is_ascending(self.teammates.iter().map(|teammate| u64::from(teammate.uav.0)))
            && self.teammates.iter().all(|teammate| {
                teammate.state.is_finite()
                    && teammate.last_report.is_valid()
                    && teammate.last_report_at <= self.time
                    && teammate.starts_tracks_from <= self.time + Duration::from_s(WRONG_MAX_S)
            })
    }

    /// True if group members, assignments or searches differ from those of the previous state.
    pub(crate) fn is_rearranged_since(&self, previous: &TeamState) -> bool {
        self.assignments != previous.assignments
            || self.search_assignments != previous.search_assignments
            || self.memberships.index() != previous.memberships.index()
    }

    /// Zero-based creation index of a group, which records and users see; it is the same for all agents if all messages
    /// arrive. `None` for groups that exist neither now nor at the previous time step.
    pub fn group_number(&self, group: GroupId) -> Option<u32> {
        self.memberships.number(group)
    }

    /// Returns the group with an id.
    pub fn group(&self, id: GroupId) -> Option<&Group> {
        self.groups.binary_search_by_key(&id, |group| group.id).ok().map(|index| &self.groups[index])
    }

    /// Returns a UAV of the team.
    pub fn teammate(&self, uav: UavId) -> Option<&Teammate> {
        self.teammates.binary_search_by_key(&uav, |teammate| teammate.uav).ok().map(|index| &self.teammates[index])
    }

    /// UAVs of a group, and their places on its orbit.
    pub(crate) fn on_orbit_of(&self, group: GroupId) -> impl Iterator<Item = (&Teammate, &OrbitRelativeState)> + Clone {
        self.group_uavs.of(group).map(|index| (&self.teammates[index], &self.on_orbit[index]))
    }

    /// Returns the id of a UAV's assigned group.
    pub(crate) fn assignment_of(&self, uav: UavId) -> Option<GroupId> {
        self.assignments
            .binary_search_by_key(&uav, |assignment| assignment.uav)
            .ok()
            .map(|index| self.assignments[index].group)
    }
}

fn is_ascending<T: PartialOrd>(ids: impl Iterator<Item = T>) -> bool {
    ids.is_sorted_by(|a, b| a < b)
}
