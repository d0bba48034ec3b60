//! Creation and retirement of groups.

use crate::coordination::clustering::{KMeans, group_count};
use crate::coordination::event::{
    Event, EventKind, GroupCreatedReason, GroupRetiredReason, HandoffCancelledReason, HandoffCompletedReason,
};
use crate::coordination::grouping::Grouping;
use crate::coordination::grouping::neighbourhoods::Neighbourhoods;
use crate::coordination::memberships::{GroupedTrack, Membership};
use crate::frame::Position;
use crate::grid::Grid;
use crate::group_id::GroupId;
use crate::params::{GroupCount, LinkModel};
use crate::time::Duration;

impl Grouping<'_> {
    /// Clusters all targets if there are no groups.
    ///
    /// Implements Algorithm 1's place in the mission.
    pub(super) fn create_first_groups(&mut self, desired: usize) {
        self.state.next_regrouping = self.now + Duration::from_s(self.params.group.regrouping_period_s);
        let live: Vec<usize> = self.track_indices(|known| !known.track.is_lost());
        let clusters = self.clustered(&live, group_count(self.team.len(), live.len()));
        if self.params.group.count == GroupCount::AsNeeded && !self.all_are_grouped(&live, &clusters) {
            return self.create_others(desired);
        }
        // Groups are numbered in the order of their first targets.
        let mut ids: Vec<(usize, GroupId)> = Vec::new();
        for (cluster, track_index) in clusters.iter().zip(&live) {
            let id = match ids.iter().find(|(known, _)| known == cluster) {
                Some((_, id)) => *id,
                None => {
                    let members = clusters.iter().zip(&live).filter(|(of, _)| *of == cluster);
                    let id = self.memberships.new_group(self.now, members.map(|(_, track_index)| *track_index));
                    ids.push((*cluster, id));
                    id
                }
            };
            self.memberships.set(*track_index, Membership::Member(id));
        }
        for (_, id) in ids {
            self.emit_group_created(id, GroupCreatedReason::First);
        }
    }

    /// True if one orbit for each cluster contains it with room to spare.
    fn all_are_grouped(&self, track_indices: &[usize], clusters: &[usize]) -> bool {
        let of = |cluster| {
            track_indices
                .iter()
                .zip(clusters)
                .filter(move |(_, of)| **of == cluster)
                .map(|(track_index, _)| *track_index)
        };
        let count = clusters.iter().max().map_or(0, |last| last + 1);
        (0..count).all(|cluster| self.required(of(cluster)).is_none_or(|orbit| orbit.has_room(&self.params.group)))
    }

    fn emit_group_created(&mut self, id: GroupId, reason: GroupCreatedReason) {
        let members = self.members(id).count() as u32;
        self.events.push(Event::of_group(EventKind::GroupCreated { members, reason }, id));
    }

    /// Retires the group with the lowest total priority; of ties the newest. With a lossy link, groups to which no received
    /// UAV is assigned go first: their UAVs may only be out of range and continue with them.
    pub(super) fn retire_smallest(&mut self) {
        let has_uav = |id: &GroupId| self.params.link == LinkModel::Lossy && self.uavs(*id).next().is_some();
        let size = |id: &GroupId| (has_uav(id), self.priority(self.members(*id)));
        let by_size = |a: &GroupId, b: &GroupId| {
            let (a, b) = (size(a), size(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        };
        let smallest = self.memberships.groups().iter().rev().min_by(|a, b| by_size(a, b)).copied();
        if let Some(id) = smallest {
            self.retire(id, GroupRetiredReason::TooManyGroups);
        }
    }

    pub(super) fn retire(&mut self, id: GroupId, reason: GroupRetiredReason) {
        self.events.push(Event::of_group(EventKind::GroupRetired(reason), id));
        for track_index in 0..self.grouped_track().len() {
            match self.grouped_track()[track_index].membership {
                Membership::Member(group) if group == id => {
                    let track = self.track(track_index);
                    if let GroupRetiredReason::Merged { into, .. } = reason {
                        self.admit_into(track_index, into);
                        let event = Event::of_track(EventKind::Merged, track, Some(id));
                        self.events.push(Event { to_group: Some(into), ..event });
                    } else {
                        self.memberships.set(track_index, Membership::Ungrouped);
                        let kind = EventKind::NotAdmitted(HandoffCancelledReason::GroupRetired);
                        self.events.push(Event::of_track(kind, track, Some(id)));
                    }
                }
                Membership::InHandoff(handoff) if handoff.to == id => {
                    self.cancel_handoff(track_index, HandoffCancelledReason::GroupRetired)
                }
                Membership::InHandoff(handoff) if handoff.from == Some(id) => {
                    self.complete_handoff(track_index, HandoffCompletedReason::PassingGroupRetired);
                }
                _ => {}
            }
        }
    }

    /// Periodic regrouping, in which a target counts by its priority. A group is retired if its UAVs could cover at least
    /// 50 % more targets, and at least two more, by forming a group of its own targets and ungrouped ones. It is also retired if its UAVs could cover any
    /// other targets and a neighbour's orbit can contain its own targets, too. Only targets count that its UAVs can
    /// bring within sensing range soon. With groups as needed, the gain must be worth it ([`Self::is_worth_a_group`]),
    /// and the retirement of a group whose members fit into others comes first, because its UAV can then cover others.
    /// Of groups with the same gain, the one nearest to an ungrouped target is retired.
    pub(super) fn regroup(&mut self, desired: usize) {
        let period_s = self.params.group.regrouping_period_s;
        if period_s <= 0.0 || self.now < self.state.next_regrouping || self.state.retiring.is_some() {
            return;
        }
        // With spare UAVs, ungrouped targets get a group in any case.
        if self.groups() < desired || !self.grouped_track().iter().any(GroupedTrack::is_ungrouped) {
            return;
        }
        self.state.next_regrouping = self.now + Duration::from_s(period_s);
        let by_need = self.params.group.count == GroupCount::AsNeeded;
        if by_need
            && (!self.is_worth_a_group(self.priority(self.coverable_together(GroupedTrack::is_ungrouped).into_iter()))
                || self.retire_redundant_group())
        {
            return;
        }
        let mut best: Option<(f64, f64, GroupId, Position, GroupRetiredReason)> = None;
        let (places, ungrouped) = (self.group_places(), self.ungrouped_grid());
        for &id in self.memberships.groups() {
            let Some(from) = self.required_by(id).map(|required| required.centre()) else { continue };
            let members = self.priority(self.members(id));
            let into = self.first_group_with_room(id, &places);
            let together = self.coverable_together(|known| {
                let is_own = into.is_none() && known.membership == Membership::Member(id);
                is_own || (known.is_ungrouped() && self.is_soon_in_view(known, from))
            });
            let (count, together) = (together.len() as u32, self.priority(together.into_iter()));
            let (gain, reason) = match into {
                Some(into) => {
                    let is_worth_it = !by_need || self.is_worth_a_group(together);
                    let reason = GroupRetiredReason::Merged { into, coverable_targets: count };
                    (if is_worth_it { together } else { 0.0 }, reason)
                }
                None => {
                    let gain = together - members;
                    let is_worth_it = gain >= 2.0 && 2.0 * gain >= members;
                    (if is_worth_it { gain } else { 0.0 }, GroupRetiredReason::BetterCoverage { together: count })
                }
            };
            let away_m2 = if by_need { distance_m2(&ungrouped, from) } else { f64::INFINITY };
            let (most, nearest_m2) = best.map_or((0.0, f64::INFINITY), |(most, nearest_m2, ..)| (most, nearest_m2));
            if gain > most || (gain > 0.0 && gain == most && away_m2 < nearest_m2) {
                best = Some((gain, away_m2, id, from, reason));
            }
        }
        if let Some((.., id, from, reason)) = best {
            self.retire(id, reason);
            let together = self.coverable_together(|known| known.is_ungrouped() && self.is_soon_in_view(known, from));
            if !together.is_empty() {
                self.create(&together);
            }
        }
    }

    /// True if ungrouped targets of this total priority on one orbit justify moving a UAV from a group that others can
    /// contain: two, or a tenth of all targets. For one of many targets, the flight took as long as the additional
    /// coverage lasted: with 8 UAVs over 30 cars, nothing was gained and the standoff error grew by half.
    fn is_worth_a_group(&self, together: f64) -> bool {
        together >= 2.0 || 10.0 * together >= self.live() as f64
    }

    /// Index of the ungrouped targets.
    pub(super) fn ungrouped_grid(&self) -> Grid {
        let ungrouped = self.grouped_track().iter().filter(|known| known.is_ungrouped());
        let mut grid = Grid::default();
        grid.fill_evenly(ungrouped.map(GroupedTrack::position));
        grid
    }

    /// Index of the groups by their first members.
    pub(super) fn group_places(&self) -> Grid {
        let firsts = self.memberships.groups().iter().filter_map(|id| self.members(*id).next());
        Grid::of(firsts.map(|first| self.grouped_track()[first].position()), self.orbit_diameter_m())
    }

    /// Distance beyond which one orbit with room to spare cannot contain two targets, m.
    fn orbit_diameter_m(&self) -> f64 {
        // The difference exceeds rounding errors.
        2.0 * self.params.group.reach_m(&self.params.track.sensor) * (1.0 + 1e-6)
    }

    /// Indices of the groups near enough that their orbits might have room for a target, ascending. No other group has
    /// room for it.
    pub(super) fn groups_near<'a>(
        &self,
        places: &Grid,
        track_index: usize,
        buffer: &'a mut Vec<usize>,
    ) -> impl Iterator<Item = usize> + use<'a> {
        places.near_ascending(self.grouped_track()[track_index].position(), self.orbit_diameter_m(), buffer)
    }

    /// True if UAVs around `from` can bring the target within sensing range in time, even if it drives away.
    pub(super) fn is_soon_in_view(&self, known: &GroupedTrack, from: Position) -> bool {
        let closing_m_s = (self.params.uav.speed_m_s - known.speed_m_s()).max(0.0);
        let reach_m = self.params.track.sensor.sensing_range_m + self.params.group.assignment_reach_s * closing_m_s;
        known.position().squared_distance_m2(from) <= reach_m * reach_m
    }

    /// First other group whose orbit has room for all members of a group.
    fn first_group_with_room(&self, id: GroupId, places: &Grid) -> Option<GroupId> {
        let (first, mut buffer) = (self.members(id).next()?, Vec::new());
        let near = self.groups_near(places, first, &mut buffer).map(|index| self.memberships.groups()[index]);
        near.filter(|other| *other != id).find(|other| {
            let belongs =
                |track_index: &usize| self.grouped_track()[*track_index].membership.groups().any(|group| group == id);
            let of_other = self.members(*other).filter(|track_index| !belongs(track_index));
            let both = of_other.chain(self.members(id));
            self.required(both).is_some_and(|required| required.has_room(&self.params.group))
        })
    }

    /// Indices of the set of eligible targets with the highest total priority that one orbit around one of them could
    /// contain. Targets faster than the UAVs are not eligible.
    fn coverable_together(&self, is_eligible: impl Fn(&GroupedTrack) -> bool) -> Vec<usize> {
        self.coverable_of(&self.neighbourhoods(is_eligible))
    }

    /// Eligible targets that are not faster than the UAVs.
    fn neighbourhoods(&self, is_eligible: impl Fn(&GroupedTrack) -> bool) -> Neighbourhoods {
        let reach_m = self.params.group.reach_m(&self.params.track.sensor);
        let limit_m_s = self.params.uav.speed_max_m_s();
        let track_indices = self.track_indices(|known| is_eligible(known) && known.speed_m_s() <= limit_m_s);
        let positions = self.positions(&track_indices);
        let priorities = track_indices.iter().map(|track_index| self.grouped_track()[*track_index].priority).collect();
        Neighbourhoods::new(track_indices, positions, priorities, reach_m)
    }

    /// Indices of the set of these targets with the highest total priority that one orbit around one of them could contain.
    fn coverable_of(&self, neighbourhoods: &Neighbourhoods) -> Vec<usize> {
        let mut track_indices = neighbourhoods.largest();
        while let Some(required) = self.required(track_indices.iter().copied()) {
            if required.has_room(&self.params.group) || track_indices.len() == 1 {
                break;
            }
            let limit_m = self.params.group.readmission_radius_fraction * self.params.group.standoff.radius_max_m;
            let target = self.removal_candidate(track_indices.iter().copied(), &required, limit_m);
            track_indices.retain(|track_index| *track_index != target);
        }
        track_indices
    }

    /// Creates groups until there are as many as desired: each of ungrouped targets, or else by splitting the most
    /// scattered group, as long as either is possible.
    pub(super) fn create_others(&mut self, desired: usize) {
        let mut ungrouped = None;
        while self.groups() < desired {
            let Some(first) = self.grouped_track().iter().position(GroupedTrack::is_ungrouped) else {
                // If all targets are in groups, further groups are only created while each can have two UAVs.
                if self.groups() < group_count(self.team.len(), self.live()) && self.split() {
                    continue;
                }
                return;
            };
            let neighbourhoods = ungrouped.get_or_insert_with(|| self.neighbourhoods(GroupedTrack::is_ungrouped));
            let mut together = self.coverable_of(neighbourhoods);
            if together.is_empty() {
                // If no ungrouped target is slow enough, the first one is used.
                together.push(first);
            }
            self.create(&together);
            together.iter().for_each(|track_index| neighbourhoods.remove(*track_index));
        }
    }

    /// Creates a group of the targets with these indices.
    pub(super) fn create(&mut self, track_indices: &[usize]) {
        let id = self.memberships.new_group(self.now, track_indices.iter().copied());
        for track_index in track_indices {
            // With groups as needed, the UAVs have yet to arrive, so that the targets are not members until then.
            match self.params.group.count {
                GroupCount::HalfOfUavs => self.memberships.set(*track_index, Membership::Member(id)),
                GroupCount::AsNeeded => self.admit_into(*track_index, id),
            }
            self.events.push(Event::of_track(EventKind::Admitted, self.track(*track_index), Some(id)));
        }
        let is_scarce = self.params.group.count == GroupCount::AsNeeded && 2 * self.groups() > self.team.len();
        self.emit_group_created(
            id,
            if is_scarce { GroupCreatedReason::UavShortage } else { GroupCreatedReason::Ungrouped },
        );
    }

    /// Splits the group with the largest sum of squares in two; the part with more members keeps the id.
    fn split(&mut self) -> bool {
        let mut widest: Option<(f64, GroupId, Vec<usize>)> = None;
        for &id in self.memberships.groups() {
            let track_indices = self.settled_members(id);
            let mut together = KMeans::default();
            together.cluster_of.resize(track_indices.len(), 0);
            let sum_m2 = together.cost_m2(&self.positions(&track_indices)) * track_indices.len() as f64;
            if track_indices.len() > 1 && widest.as_ref().is_none_or(|(most_m2, ..)| sum_m2 > *most_m2) {
                widest = Some((sum_m2, id, track_indices));
            }
        }
        let Some((_, id, track_indices)) = widest else { return false };
        let clusters = self.clustered(&track_indices, 2);
        let of_second = clusters.iter().filter(|cluster| **cluster == 1).count();
        let leaves = usize::from(2 * of_second <= track_indices.len());
        let leaving = track_indices.iter().zip(&clusters).filter(|(_, cluster)| **cluster == leaves);
        let new = self.memberships.new_group(self.now, leaving.clone().map(|(track_index, _)| *track_index));
        for (track_index, _) in leaving {
            self.memberships.set(*track_index, Membership::Member(new));
            let event = Event::of_track(EventKind::Regrouped, self.track(*track_index), Some(id));
            self.events.push(Event { to_group: Some(new), ..event });
        }
        self.emit_group_created(new, GroupCreatedReason::Split);
        true
    }

    /// Indices of a group's members that are not in handoff.
    fn settled_members(&self, id: GroupId) -> Vec<usize> {
        self.members(id)
            .filter(|track_index| self.grouped_track()[*track_index].membership == Membership::Member(id))
            .collect()
    }

    /// Indices of the targets that satisfy a condition.
    fn track_indices(&self, condition: impl Fn(&GroupedTrack) -> bool) -> Vec<usize> {
        (0..self.grouped_track().len()).filter(|track_index| condition(&self.grouped_track()[*track_index])).collect()
    }

    fn positions(&self, track_indices: &[usize]) -> Vec<Position> {
        track_indices.iter().map(|track_index| self.grouped_track()[*track_index].position()).collect()
    }

    /// Clusters the targets with these indices from scratch; returns the cluster of each.
    fn clustered(&self, track_indices: &[usize], k: usize) -> Vec<usize> {
        let mut clusters = KMeans::default();
        clusters.seed(&self.positions(track_indices), k);
        clusters.cluster_of
    }
}

/// Squared distance to the nearest point, m2; infinite without one.
pub(super) fn distance_m2(grid: &Grid, from: Position) -> f64 {
    grid.nearest(from, |_| true).map_or(f64::INFINITY, |(squared_m2, _)| squared_m2)
}
