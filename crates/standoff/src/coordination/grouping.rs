//! Grouping: which targets belong to which group; creation of groups, admission, handoff and removal (section IV).
//!
//! Groups are created by clustering (30); afterwards, clustering only proposes changes. If it assigns a target to
//! another group, a handoff starts: the target belongs to both groups for the dwell (34). The furthest target is
//! removed if no orbit contains it (section IV.B.2, by range), or if the orbit that includes it changes faster than the
//! UAVs can follow (by convergence, Lemma 3.1). A target outside all groups keeps its track. The nearest group admits
//! it if its orbit has room to spare, so that a target at the limit does not alternate. In the paper, removed targets
//! stay outside.
//!
//! With [`GroupCount::AsNeeded`] the objective is to have as many targets in groups as the UAVs can cover, with one UAV
//! to a group if necessary. Among equal coverages, the most information wins, the sum of ln det (`assignment`): two
//! UAVs on one orbit provide more of it than one UAV on each of two orbits. Therefore, a group is created immediately
//! for targets that are in none, even if a UAV leaves its partner. While some targets are in no group, a group is
//! retired if other groups contain its members with room to spare (`retire`). To avoid frequent changes, at most
//! one group at a time is retired, with one regrouping period in between, and the assignment has a switching cost
//! (`assignment_switching_cost`).
//!
//! A target of priority p counts as p targets (`displace`).

mod create;
mod displace;
mod handoff;
mod neighbourhoods;
mod retire;
#[cfg(test)]
mod tests;

use core::cmp::Ordering;

use crate::by_group::ByGroup;
use crate::coordination::clustering::{KMeans, group_count};
use crate::coordination::desired_centre::DesiredCentre;
use crate::coordination::dwell::Handoff;
use crate::coordination::event::{
    Event, EventKind, GroupRetiredReason, HandoffCancelledReason, HandoffCompletedReason,
};
use crate::coordination::group::Group;
use crate::coordination::memberships::{GroupedTrack, Membership, Memberships};
use crate::coordination::required_orbit::RequiredOrbit;
use crate::coordination::teammate::{Teammate, groups_of};
use crate::enclosing_circle::EnclosingCircle;
use crate::frame::Position;
use crate::grid::Grid;
use crate::group_id::GroupId;
use crate::guidance::standoff_distance::Spread;
use crate::params::{CentreEstimate, GroupCount, RemovalRule, TeamParams};
use crate::time::{Duration, Time};
use crate::tracking::track::TrackId;

/// Grouping state that persists between time steps in addition to the memberships.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct GroupingState {
    /// Time of the next check whether UAVs could cover more targets elsewhere.
    next_regrouping: Time,
    /// Group that hands off all of its members to others, to be retired.
    retiring: Option<GroupId>,
}

impl GroupingState {
    #[cfg(test)]
    pub(crate) fn next_regrouping(next_review: Time) -> Self {
        Self { next_regrouping: next_review, ..Self::default() }
    }

    /// True if the state is possible at time `now`.
    pub(crate) fn is_valid(&self, now: Time, params: &TeamParams) -> bool {
        self.next_regrouping <= now.max(Time::EPOCH) + Duration::from_s(params.group.regrouping_period_s)
    }
}

/// Reused buffers, so that a step allocates nothing; the contents are valid within one step.
#[derive(Debug, Clone, Default)]
pub(crate) struct GroupingBuffers {
    clusters: KMeans,
    track_indices: Vec<usize>,
    positions: Vec<Position>,
    groups: Vec<GroupId>,
    centres: Vec<(GroupId, DesiredCentre)>,
    /// Squared distance, m2, target index and group.
    candidates: Vec<(f64, usize, GroupId)>,
    desired_groups: Vec<(usize, GroupId)>,
    uavs: ByGroup<GroupId>,
    grid: Grid,
}

/// Update of the memberships at one time step.
pub(crate) struct Grouping<'a> {
    pub(crate) now: Time,
    /// Targets of this time step, with the memberships of the last one.
    pub(crate) memberships: &'a mut Memberships,
    pub(crate) state: &'a mut GroupingState,
    /// Groups of the last time step.
    pub(crate) previous: &'a [Group],
    /// UAVs in ascending order, each with its previous group.
    pub(crate) team: &'a [Teammate],
    pub(crate) params: &'a TeamParams,
    pub(crate) events: &'a mut Vec<Event>,
    pub(crate) buffers: &'a mut GroupingBuffers,
}

impl Grouping<'_> {
    /// Updates the memberships.
    pub(crate) fn update(&mut self) {
        self.release_lost();
        self.buffers.uavs.fill(groups_of(self.team));
        if self.team.is_empty() {
            // Without UAVs, all memberships stay unchanged.
            return self.emit_retired_groups();
        }
        let live = self.live();
        let desired = match self.params.group.count {
            GroupCount::HalfOfUavs => group_count(self.team.len(), live),
            GroupCount::AsNeeded => self.team.len().min(live),
        };
        if self.groups() == 0 {
            self.create_first_groups(desired);
        } else {
            while self.groups() > desired.max(1) {
                self.retire_smallest();
            }
            self.continue_retirement();
            self.admit();
            self.regroup(desired);
            self.create_others(desired);
            self.displace();
            self.relieve();
            // Handoffs need at least two groups.
            if self.groups() > 1 || self.grouped_track().iter().any(|known| known.receiving_group().is_some()) {
                self.update_handoffs();
            }
        }
        self.remove_outside();
        if self.groups() == 0 && live > 0 && self.params.group.count == GroupCount::AsNeeded {
            // The last group was given up because its targets were still in handoff: create groups again, so that the
            // UAVs have targets to cover.
            self.create_first_groups(desired);
        }
        self.emit_retired_groups();
    }

    /// Removes lost tracks from their groups.
    fn release_lost(&mut self) {
        for track_index in 0..self.grouped_track().len() {
            let GroupedTrack { track, membership, .. } = &self.grouped_track()[track_index];
            if track.is_lost() && *membership != Membership::Ungrouped {
                self.cancel_handoff(track_index, HandoffCancelledReason::TargetLost);
                self.memberships.set(track_index, Membership::Ungrouped);
            }
        }
    }

    /// Number of targets that are not lost.
    fn live(&self) -> usize {
        self.grouped_track().iter().filter(|known| !known.track.is_lost()).count()
    }

    /// UAVs of a group, ascending.
    fn uavs(&self, group: GroupId) -> impl Iterator<Item = &Teammate> + Clone {
        self.buffers.uavs.of(group).map(|index| &self.team[index])
    }

    fn grouped_track(&self) -> &[GroupedTrack] {
        self.memberships.tracks()
    }

    fn track(&self, track_index: usize) -> TrackId {
        self.grouped_track()[track_index].track.id
    }

    /// Number of groups with members.
    fn groups(&self) -> usize {
        self.memberships.groups().len()
    }

    /// Copy of the list of groups with members, by ascending id, for stages that add or remove groups.
    fn groups_now(&mut self) -> Vec<GroupId> {
        let mut groups = core::mem::take(&mut self.buffers.groups);
        groups.clear();
        groups.extend_from_slice(self.memberships.groups());
        groups
    }

    /// Admits every ungrouped target, those of the highest priority first, to the nearest group whose orbit has room to
    /// spare; a target that only fits after another one was admitted waits for the next time step.
    ///
    /// Implements section IV.B.2, beyond the paper: removed targets are readmitted.
    fn admit(&mut self) {
        if !self.grouped_track().iter().any(GroupedTrack::is_ungrouped) {
            return;
        }
        let candidates = self.candidates();
        for (_, track_index, id) in &candidates {
            if self.grouped_track()[*track_index].is_ungrouped() && self.has_room(*id, *track_index).is_some() {
                let kind = match self.grouped_track()[*track_index].membership {
                    Membership::Removed => EventKind::Readmitted,
                    _ => EventKind::Admitted,
                };
                self.events.push(Event::of_track(kind, self.track(*track_index), Some(*id)));
                self.admit_into(*track_index, *id);
            }
        }
        self.buffers.candidates = candidates;
    }

    /// Pairs of ungrouped targets and groups that may contain them, the nearest first.
    fn candidates(&mut self) -> Vec<(f64, usize, GroupId)> {
        let GroupingBuffers { centres, candidates, grid, .. } = &mut *self.buffers;
        let (memberships, mut candidates) = (&*self.memberships, core::mem::take(candidates));
        centres.clear();
        for id in memberships.groups().iter().filter(|id| self.state.retiring != Some(**id)) {
            let centre = DesiredCentre::of(self.params.group.centre, memberships.tracks(), memberships.of(*id));
            centres.extend(centre.map(|centre| (*id, centre)));
        }
        let reach_m = self.params.group.reach_m(&self.params.track.sensor);
        let limit_m_s = self.params.uav.speed_max_m_s();
        let farthest_m = centres.iter().map(|(_, centre)| centre.reach_m(reach_m)).fold(0.0, f64::max);
        grid.fill(centres.iter().map(|(_, centre)| centre.state.position()), 0.5 * farthest_m);
        candidates.clear();
        for (track_index, target) in memberships.tracks().iter().enumerate().filter(|(_, target)| target.is_ungrouped())
        {
            if target.speed_m_s() > limit_m_s {
                continue;
            }
            for (id, centre) in grid.near(target.position(), farthest_m).map(|index| &centres[index]) {
                let squared_m2 = target.position().squared_distance_m2(centre.state.position());
                let members = memberships.of(*id).map(|member| memberships.tracks()[member].position());
                if centre.may_admit(target.position(), reach_m, members) && !target.is_blocked_from(*id, self.now) {
                    candidates.push((squared_m2, track_index, *id));
                }
            }
        }
        let priority = |of: &(f64, usize, GroupId)| memberships.tracks()[of.1].priority;
        candidates.sort_unstable_by(|a, b| {
            priority(b).total_cmp(&priority(a)).then(a.0.total_cmp(&b.0)).then((a.1, a.2).cmp(&(b.1, b.2)))
        });
        candidates
    }

    /// Admits a target that no group hands off. It becomes a member if it is in view (of one UAV, if its priority is above
    /// 1); otherwise, if there is a dwell, the orbit only makes room for it first.
    fn admit_into(&mut self, track_index: usize, id: GroupId) {
        let immediately = self.params.group.dwell_max_s <= 0.0
            || self.is_in_view_of_group(track_index, id)
            || self.is_urgent_in_view(track_index, id);
        let (requested_at, dwell) = (self.now, Duration::ZERO);
        let membership = match immediately {
            true => Membership::Member(id),
            false => Membership::InHandoff(Handoff { from: None, to: id, requested_at, dwell }),
        };
        self.memberships.set(track_index, membership);
    }

    /// Returns the orbit that the group needs with a further target, if it has room to spare for it, or if the target
    /// is inside the minimum enclosing circle and thus leaves the orbit unchanged.
    fn has_room(&self, id: GroupId, further: usize) -> Option<RequiredOrbit> {
        let params = &self.params.group;
        let required = self.required(self.members(id).chain([further]))?;
        let is_inside = || {
            let current = self.required_by(id).map_or(0.0, |current| current.standoff.unclamped_m);
            params.centre == CentreEstimate::EnclosingCircle && required.standoff.unclamped_m <= current * (1.0 + 1e-9)
        };
        (required.has_room(params) || is_inside()).then_some(required)
    }

    /// Total priority of the targets with these indices.
    fn priority(&self, track_indices: impl Iterator<Item = usize>) -> f64 {
        track_indices.map(|track_index| self.grouped_track()[track_index].priority).sum()
    }

    /// Selects the target to remove if an orbit with a radius of at most `limit_m` cannot contain all targets with these
    /// indices. If they differ in priority, the order of removal counts that keeps the higher total priority: the lowest
    /// priority first, or the largest reduction of the radius first.
    fn removal_candidate(
        &self,
        track_indices: impl Iterator<Item = usize> + Clone,
        required: &RequiredOrbit,
        limit_m: f64,
    ) -> usize {
        let priorities = || track_indices.clone().map(|track_index| self.grouped_track()[track_index].priority);
        if priorities().all(|priority| Some(priority) == priorities().next()) {
            return match self.params.group.removal {
                RemovalRule::FurthestFromCentre => required.furthest,
                RemovalRule::LargestRadiusReduction => self.next_removed(track_indices, required, false),
            };
        }
        let kept = |lowest_first| {
            let mut kept: Vec<usize> = track_indices.clone().collect();
            while kept.len() > 1
                && let Some(required) = self.required(kept.iter().copied())
                && required.standoff.unclamped_m > limit_m
            {
                let removed = self.next_removed(kept.iter().copied(), &required, lowest_first);
                kept.retain(|track_index| *track_index != removed);
            }
            self.priority(kept.into_iter())
        };
        self.next_removed(track_indices.clone(), required, kept(true) >= kept(false))
    }

    /// Selects the target whose removal reduces the radius most or, if set, that of the lowest priority among those
    /// whose removal reduces it.
    fn next_removed(
        &self,
        track_indices: impl Iterator<Item = usize> + Clone,
        required: &RequiredOrbit,
        lowest_first: bool,
    ) -> usize {
        let furthest = required.furthest;
        let required_radius_m = |without: usize| {
            let rest = self.required(track_indices.clone().filter(|track_index| *track_index != without));
            rest.map_or(0.0, |rest| rest.standoff.unclamped_m)
        };
        // The removal of any other target leaves the circle unchanged.
        let circle =
            EnclosingCircle::of(track_indices.clone().map(|track_index| self.grouped_track()[track_index].position()));
        let on_circle = circle
            .iter()
            .flat_map(EnclosingCircle::support_points)
            .filter_map(|number| track_indices.clone().nth(number));
        let tried = on_circle.map(|track_index| (required_radius_m(track_index), track_index));
        let priority = |of: &(f64, usize)| if lowest_first { self.grouped_track()[of.1].priority } else { 1.0 };
        // The difference must exceed rounding errors.
        let is_better = |one: &(f64, usize), other: &(f64, usize)| match priority(one).total_cmp(&priority(other)) {
            Ordering::Equal => one.0 < other.0 * (1.0 - 1e-9),
            order => order.is_lt(),
        };
        let first = (required_radius_m(furthest), furthest);
        tried.fold(first, |least, one| if is_better(&one, &least) { one } else { least }).1
    }

    /// Removes the furthest target of every group whose orbit diverges, and of every group until its orbit fits.
    ///
    /// Implements section IV.B.2 and section IV.B.2, convergence rule.
    fn remove_outside(&mut self) {
        let groups = self.groups_now();
        for &id in &groups {
            let limit_m2_s = -self.params.group.divergence_limit_m2_s;
            let diverging_for = self.last(id).and_then(|group| {
                let threshold_m2_s = group.threshold_m2_s?;
                let required =
                    (group.diverging_for.s() > self.params.group.divergence_time_s).then(|| self.required_by(id))??;
                // One removal is enough.
                let limit_m = required.standoff.unclamped_m * (1.0 - 1e-9);
                let target = || self.removal_candidate(self.members(id), &required, limit_m);
                (required.members() > 1).then(|| (threshold_m2_s, target()))
            });
            if let Some((threshold_m2_s, target)) = diverging_for {
                self.remove(id, target, EventKind::RemovedDiverging { threshold_m2_s, limit_m2_s });
            }
            self.remove_fastest(id);
            if self.surely_fits(id) {
                continue;
            }
            let allowed_radius_m = self.params.group.standoff.radius_max_m;
            while let Some(required) = self.required_by(id).filter(|required| required.members() > 1) {
                let required_radius_m = required.standoff.unclamped_m;
                if required_radius_m <= allowed_radius_m {
                    break;
                }
                let target = self.removal_candidate(self.members(id), &required, allowed_radius_m);
                self.remove(id, target, EventKind::Removed { required_radius_m, allowed_radius_m });
            }
        }
        self.buffers.groups = groups;
    }

    /// Fast sufficient test: true if the largest orbit around the last centre contains all members, because the minimum
    /// enclosing circle is not larger. `false` gives no information.
    fn surely_fits(&self, id: GroupId) -> bool {
        let (group, Some(last)) = (&self.params.group, self.last(id)) else { return false };
        if group.centre != CentreEstimate::EnclosingCircle || group.margin_takes_covariance() {
            return false;
        }
        let centre = last.centre.estimate().state.position();
        let squared_m2 = self
            .members(id)
            .map(|track_index| self.grouped_track()[track_index].position().squared_distance_m2(centre));
        let spread = Spread { distance_m: squared_m2.fold(0.0, f64::max).sqrt(), rate_m_s: 0.0 };
        group.standoff.distance(spread, 0.0, &self.params.track.sensor).unclamped_m < group.standoff.radius_max_m
    }

    /// Removes the fastest target of a group that has been faster than the UAVs for too long: the others may stay.
    ///
    /// Beyond section IV.B.2.
    fn remove_fastest(&mut self, id: GroupId) {
        let outrun_for = self.last(id).map_or(Duration::ZERO, |group| group.outrun_for);
        if outrun_for.s() <= self.params.group.divergence_time_s || self.members(id).count() < 2 {
            return;
        }
        let speed_m_s = |track_index: &usize| self.grouped_track()[*track_index].speed_m_s();
        let fastest = self.members(id).max_by(|a, b| speed_m_s(a).total_cmp(&speed_m_s(b)));
        if let Some(fastest) = fastest {
            let (speed_m_s, limit_m_s) = (speed_m_s(&fastest), self.params.uav.speed_max_m_s());
            self.remove(id, fastest, EventKind::RemovedTooFast { speed_m_s, limit_m_s });
        }
    }

    /// The group at the last time step.
    fn last(&self, id: GroupId) -> Option<&Group> {
        self.previous.binary_search_by_key(&id, |group| group.id).ok().map(|index| &self.previous[index])
    }

    /// Orbit that the targets with these indices require.
    fn required(&self, track_indices: impl Iterator<Item = usize> + Clone) -> Option<RequiredOrbit> {
        RequiredOrbit::of(self.grouped_track(), track_indices, self.params)
    }

    /// Orbit that a group requires.
    fn required_by(&self, id: GroupId) -> Option<RequiredOrbit> {
        self.required(self.members(id))
    }

    /// Indices of a group's members.
    fn members(&self, id: GroupId) -> impl Iterator<Item = usize> + Clone {
        self.memberships.of(id)
    }

    /// Removes a target that the group's orbit cannot contain. A target that the group is still receiving goes first,
    /// if the orbit is smaller without it and its priority is not higher. A target in handoff to another group is handed off immediately; with an
    /// orbit motion model, only if the other group contains it already, because every member must be in view of its
    /// group.
    fn remove(&mut self, id: GroupId, target: usize, kind: EventKind) {
        let required_radius_m = self.required_by(id).map_or(0.0, |required| required.standoff.unclamped_m);
        let widens = |track_index: &usize| {
            let others = self.members(id).filter(|other| other != track_index);
            self.required(others).is_none_or(|required| required.standoff.unclamped_m < required_radius_m)
        };
        let priority = |track_index: usize| self.grouped_track()[track_index].priority;
        let is_incoming = |track_index: &usize| {
            self.grouped_track()[*track_index].receiving_group() == Some(id)
                && priority(*track_index) <= priority(target)
        };
        let incoming = self.members(id).filter(is_incoming).find(widens);
        let is_received = |to| self.params.group.motion.is_instantaneous() || self.is_in_view_of_group(target, to);
        if let Some(incoming) = incoming.or(Some(target).filter(is_incoming)) {
            self.cancel_handoff(incoming, HandoffCancelledReason::ReceivingGroupCannotCover);
        } else if self.grouped_track()[target].receiving_group().is_some_and(is_received) {
            self.complete_handoff(target, HandoffCompletedReason::PassingGroupCannotCover);
        } else {
            self.events.push(Event::of_track(kind, self.track(target), Some(id)));
            self.memberships.set(target, Membership::Removed);
        }
    }

    fn emit_retired_groups(&mut self) {
        for group in self.previous {
            let is_retirement =
                |event: &Event| event.group == Some(group.id) && matches!(event.kind, EventKind::GroupRetired(_));
            if self.memberships.groups().binary_search(&group.id).is_err() && !self.events.iter().any(is_retirement) {
                let reason = match self.state.retiring == Some(group.id) {
                    true => GroupRetiredReason::Redundant,
                    false => GroupRetiredReason::Empty,
                };
                self.events.push(Event::of_group(EventKind::GroupRetired(reason), group.id));
            }
        }
    }
}
