//! Handoff of targets between groups.

use crate::coordination::dwell::{Handoff, dwell_s};
use crate::coordination::event::{Event, EventKind, HandoffCancelledReason, HandoffCompletedReason};
use crate::coordination::grouping::{Grouping, GroupingBuffers};
use crate::coordination::memberships::Membership;
use crate::group_id::GroupId;
use crate::math;
use crate::time::Duration;

impl Grouping<'_> {
    /// Refines the last clustering, starts handoffs, and ends those whose dwell is over.
    ///
    /// Implements section IV.B.1.
    pub(super) fn update_handoffs(&mut self) {
        self.keep_groups_nonempty();
        let desired = self.desired_groups();
        for &(track_index, group) in &desired {
            match self.grouped_track()[track_index].membership {
                Membership::Member(own) if own != group => self.start_handoff(track_index, own, group),
                Membership::InHandoff(handoff) => self.end_dwell(track_index, handoff, group),
                _ => {}
            }
        }
        self.buffers.desired_groups = desired;
    }

    /// Group that clustering proposes for each grouped target, starting from the last clustering.
    fn desired_groups(&mut self) -> Vec<(usize, GroupId)> {
        let (memberships, retiring) = (&*self.memberships, self.state.retiring);
        let GroupingBuffers { clusters, track_indices, positions, desired_groups, groups, .. } = &mut *self.buffers;
        groups.clear();
        groups.extend(memberships.groups().iter().filter(|id| retiring != Some(**id)));
        track_indices.clear();
        positions.clear();
        clusters.cluster_of.clear();
        for (track_index, known) in memberships.tracks().iter().enumerate() {
            let Some(cluster) = known.home().and_then(|home| groups.binary_search(&home).ok()) else {
                continue;
            };
            track_indices.push(track_index);
            positions.push(known.position());
            clusters.cluster_of.push(cluster);
        }
        clusters.refine(positions, groups.len(), self.params.group.handoff_margin_m);
        let mut desired = core::mem::take(desired_groups);
        desired.clear();
        desired.extend(track_indices.iter().copied().zip(clusters.cluster_of.iter().map(|cluster| groups[*cluster])));
        desired
    }

    /// If all members of a group are in handoff to others, cancels the handoff of the first one.
    fn keep_groups_nonempty(&mut self) {
        let groups = self.groups_now();
        for &id in &groups {
            let has_home = self.members(id).any(|track_index| self.grouped_track()[track_index].home() == Some(id));
            let first = self.members(id).next();
            if let Some(first) = first.filter(|_| !has_home && self.state.retiring != Some(id)) {
                self.cancel_handoff(first, HandoffCancelledReason::GroupRetired);
            }
        }
        self.buffers.groups = groups;
    }

    /// Starts a handoff, if the receiving group has room, or if the target displaces members of it.
    ///
    /// Implements section IV.B.1, with the dwell (34).
    pub(super) fn start_handoff(&mut self, track_index: usize, from: GroupId, to: GroupId) {
        if self.grouped_track()[track_index].is_blocked_from(to, self.now) {
            return;
        }
        let displaced = || self.required(self.gain(to, track_index)?.1.into_iter());
        let Some(required) = self.has_room(to, track_index).or_else(displaced) else { return };
        let (group, guidance) = (&self.params.group, &self.params.guidance);
        let uavs = self.uavs(to).map(|teammate| teammate.state.position);
        let (orbit, speed_m_s) = (required.orbit(), self.params.uav.speed_m_s);
        let dwell_s = dwell_s(uavs, &orbit, guidance.radial_gain, speed_m_s, (group.dwell_min_s, group.dwell_max_s));
        let handoff = Handoff { from: Some(from), to, requested_at: self.now, dwell: Duration::from_s(dwell_s) };
        self.memberships.set(track_index, Membership::InHandoff(handoff));
        self.emit_handoff(track_index, EventKind::HandoffStarted { dwell_s }, handoff);
        if group.dwell_max_s <= 0.0 {
            self.complete_handoff(track_index, HandoffCompletedReason::NoDwell);
        }
    }

    /// Completes or cancels a handoff whose dwell is over. It is completed when all receiving UAVs have the target in
    /// view. One is enough after the maximum dwell, or for a target of priority above 1 that no group passes.
    fn end_dwell(&mut self, track_index: usize, handoff: Handoff, desired: GroupId) {
        let elapsed = self.now - handoff.requested_at;
        if elapsed < handoff.dwell {
            return;
        }
        let is_last = elapsed.s() >= self.params.group.dwell_max_s;
        let is_needed = |from| self.state.retiring == Some(from) || self.target_to_pass_on(from).is_some();
        if handoff.from.is_some_and(|from| !is_needed(from)) && desired != handoff.to {
            self.cancel_handoff(track_index, HandoffCancelledReason::ReassignedByClustering);
        } else if self.is_in_view_of_group(track_index, handoff.to)
            || (is_last && self.views(track_index, handoff.to).any(|in_view| in_view))
            || (handoff.from.is_none() && self.is_urgent_in_view(track_index, handoff.to))
        {
            self.complete_handoff(track_index, HandoffCompletedReason::Received);
        } else if is_last {
            self.cancel_handoff(track_index, HandoffCancelledReason::NotInView);
        }
    }

    /// For each UAV of a group, whether it has the target in view, by the target's estimate and with a clearance of one
    /// standard deviation.
    fn views(&self, track_index: usize, group: GroupId) -> impl Iterator<Item = bool> {
        let sensor = &self.params.track.sensor;
        let estimate = self.grouped_track()[track_index].estimate();
        let (at, clearance_m) = (estimate.state.position(), estimate.position_sd_max_m());
        self.uavs(group).map(move |teammate| {
            let from = teammate.state.position;
            teammate.boresight.is_some_and(|boresight| sensor.in_view_with_clearance(from, boresight, at, clearance_m))
        })
    }

    /// True if a target of priority above 1 is in view of a UAV of the group.
    pub(super) fn is_urgent_in_view(&self, track_index: usize, group: GroupId) -> bool {
        self.grouped_track()[track_index].priority > 1.0 && self.views(track_index, group).any(|in_view| in_view)
    }

    /// True if all UAVs of the group, at least one, have the target in view. With an orbit motion model, the orbit must
    /// also have made room for it: the current orbit keeps the target in view, and no UAV has yet to turn towards it.
    pub(super) fn is_in_view_of_group(&self, track_index: usize, group: GroupId) -> bool {
        let mut views = self.views(track_index, group);
        let is_in_view = views.next().is_some_and(|first| first && views.all(|in_view| in_view));
        is_in_view
            && (self.params.group.motion.is_instantaneous()
                || (self.is_inside(track_index, group) && self.is_near(group)))
    }

    /// True if each UAV of a group is at most a turn radius outside its orbit, or stays within sensing range of the
    /// centre even if it turns away first, by one turn diameter.
    fn is_near(&self, group: GroupId) -> bool {
        let (uav, sensor) = (&self.params.uav, &self.params.track.sensor);
        let turn_m = uav.speed_m_s / uav.turn_rate_max_rad_s;
        self.last(group).is_none_or(|group| {
            let near_m = (sensor.sensing_range_m - 2.0 * turn_m).max(group.standoff.distance_m + turn_m);
            let centre = group.centre.estimate().state.position();
            self.uavs(group.id).all(|teammate| teammate.state.position.distance_m(centre) <= near_m)
        })
    }

    /// True if the target is within the field of view from every point of the group's last orbit.
    fn is_inside(&self, track_index: usize, group: GroupId) -> bool {
        let half_rad = 0.5 * self.params.track.sensor.field_of_view_rad;
        self.last(group).is_none_or(|group| {
            let held_m = group.standoff.distance_m * math::sin(half_rad.min(0.5 * math::PI));
            self.grouped_track()[track_index].position().distance_m(group.centre.estimate().state.position()) <= held_m
        })
    }

    pub(super) fn complete_handoff(&mut self, track_index: usize, reason: HandoffCompletedReason) {
        let Membership::InHandoff(handoff) = self.grouped_track()[track_index].membership else { return };
        self.memberships.set(track_index, Membership::Member(handoff.to));
        self.emit_handoff(track_index, EventKind::HandoffCompleted(reason), handoff);
    }

    pub(super) fn cancel_handoff(&mut self, track_index: usize, reason: HandoffCancelledReason) {
        let Membership::InHandoff(handoff) = self.grouped_track()[track_index].membership else { return };
        self.memberships.set(track_index, handoff.from.map_or(Membership::Removed, Membership::Member));
        let dwell = handoff.dwell.max(Duration::from_s(self.params.group.dwell_min_s));
        self.memberships.block(track_index, handoff.to, self.now + dwell);
        self.emit_handoff(track_index, EventKind::HandoffCancelled(reason), handoff);
    }

    /// Emits the event of a handoff. The admission of a target from no group was reported when it started, so that only
    /// its failure is reported here.
    fn emit_handoff(&mut self, track_index: usize, kind: EventKind, handoff: Handoff) {
        let track = self.track(track_index);
        match (handoff.from, kind) {
            (Some(from), _) => {
                let event = Event::of_track(kind, track, Some(from));
                self.events.push(Event { to_group: Some(handoff.to), ..event });
            }
            (None, EventKind::HandoffCancelled(reason)) if reason != HandoffCancelledReason::TargetLost => {
                self.events.push(Event::of_track(EventKind::NotAdmitted(reason), track, Some(handoff.to)));
            }
            _ => {}
        }
    }
}
