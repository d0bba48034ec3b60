//! How a target passes from one group to another.

use crate::coordination::event::{CompletionReason, Event, EventKind, WithdrawalReason};
use crate::coordination::handoff::{Handoff, dwell_s};
use crate::coordination::memberships::Membership;
use crate::coordination::settling::{Room, Settling};
use crate::group_id::GroupId;
use crate::math;
use crate::time::Duration;

impl Settling<'_> {
    /// Clusters anew from the last clustering, requests handoffs, and ends those whose dwell is over.
    ///
    /// Implements section IV.B.1.
    pub(super) fn hand_over(&mut self) {
        self.keep_every_group_a_home();
        let wanted = self.wanted_groups();
        for &(place, group) in &wanted {
            match self.known()[place].membership {
                Membership::Member(own) if own != group => self.request(place, own, group),
                Membership::Dwell(handoff) => self.end_dwell(place, handoff, group),
                _ => {}
            }
        }
        self.room.wanted = wanted;
    }

    /// The group in which clustering wants each target that has one; from the last clustering.
    fn wanted_groups(&mut self) -> Vec<(usize, GroupId)> {
        let (memberships, winding_up) = (&*self.memberships, self.agenda.winding_up);
        let Room { clusters, places, positions, wanted, groups, .. } = &mut *self.room;
        groups.clear();
        groups.extend(memberships.groups().iter().filter(|id| winding_up != Some(**id)));
        places.clear();
        positions.clear();
        clusters.of.clear();
        for (place, known) in memberships.known().iter().enumerate() {
            let Some(cluster) = known.home().and_then(|home| groups.binary_search(&home).ok()) else {
                continue;
            };
            places.push(place);
            positions.push(known.position());
            clusters.of.push(cluster);
        }
        clusters.refine(positions, groups.len(), self.params.group.handoff_margin_m);
        let mut wanted = core::mem::take(wanted);
        wanted.clear();
        wanted.extend(places.iter().copied().zip(clusters.of.iter().map(|cluster| groups[*cluster])));
        wanted
    }

    /// A group all of whose members are on their way to others keeps the first of them.
    fn keep_every_group_a_home(&mut self) {
        let groups = self.groups_now();
        for &id in &groups {
            let has_home = self.members(id).any(|place| self.known()[place].home() == Some(id));
            let first = self.members(id).next();
            if let Some(first) = first.filter(|_| !has_home && self.agenda.winding_up != Some(id)) {
                self.withdraw(first, WithdrawalReason::GroupEnds);
            }
        }
        self.room.groups = groups;
    }

    /// Requests a handoff, if the receiving group has room.
    ///
    /// Implements section IV.B.1, with the dwell (34).
    pub(super) fn request(&mut self, place: usize, from: GroupId, to: GroupId) {
        if self.known()[place].is_barred_from(to, self.now) {
            return;
        }
        let Some(required) = self.has_room(to, place) else { return };
        let (group, guidance) = (&self.params.group, &self.params.guidance);
        let uavs = self.team.iter().filter(|mate| mate.group == Some(to)).map(|mate| mate.state.position);
        let (orbit, speed_m_s) = (required.orbit(), self.params.uav.speed_m_s);
        let dwell_s = dwell_s(uavs, &orbit, guidance.radial_gain, speed_m_s, (group.dwell_min_s, group.dwell_max_s));
        let handoff = Handoff { from: Some(from), to, requested_at: self.now, dwell: Duration::from_s(dwell_s) };
        self.memberships.set(place, Membership::Dwell(handoff));
        self.tell_of_handoff(place, EventKind::HandoffRequested { dwell_s }, handoff);
        if group.dwell_max_s <= 0.0 {
            self.complete(place, CompletionReason::Undelayed);
        }
    }

    /// Completes or withdraws a handoff whose dwell is over, but not before all receiving UAVs have the target in view,
    /// unless that takes longer than the longest dwell: then one is enough.
    fn end_dwell(&mut self, place: usize, handoff: Handoff, wanted: GroupId) {
        let elapsed = self.now - handoff.requested_at;
        if elapsed < handoff.dwell {
            return;
        }
        let is_last = elapsed.s() >= self.params.group.dwell_max_s;
        let is_wound_up = handoff.from.is_some_and(|from| self.agenda.winding_up == Some(from));
        if handoff.from.is_some() && wanted != handoff.to && !is_wound_up {
            self.withdraw(place, WithdrawalReason::WantedElsewhere);
        } else if self.is_held_by(place, handoff.to) || (is_last && self.views(place, handoff.to).any(|seen| seen)) {
            self.complete(place, CompletionReason::Received);
        } else if is_last {
            self.withdraw(place, WithdrawalReason::NotSeen);
        }
    }

    /// Whether each UAV of a group has the target in view, by its estimate and with one standard deviation to spare.
    fn views(&self, place: usize, group: GroupId) -> impl Iterator<Item = bool> {
        let sensor = &self.params.track.sensor;
        let estimate = self.known()[place].estimate();
        let (at, clearance_m) = (estimate.state.position(), estimate.position_sd_max_m());
        self.team.iter().filter(move |mate| mate.group == Some(group)).map(move |mate| {
            let from = mate.state.position;
            mate.boresight.is_some_and(|boresight| sensor.well_in_view(from, boresight, at, clearance_m))
        })
    }

    /// Every UAV of the group sees it, and there is one; and where the orbit takes its time, it has made room for it: the
    /// target is where the orbit as it is flown keeps targets in view, and no UAV has still to turn towards it.
    pub(super) fn is_held_by(&self, place: usize, group: GroupId) -> bool {
        let mut views = self.views(place, group);
        let is_seen = views.next().is_some_and(|first| first && views.all(|seen| seen));
        is_seen && (self.params.group.motion.is_at_once() || (self.is_inside(place, group) && self.is_near(group)))
    }

    /// Each UAV of a group is about as near as its orbit, or stays within sensing range of the centre even if it turns away
    /// first, by a circle's width.
    fn is_near(&self, group: GroupId) -> bool {
        let (uav, sensor) = (&self.params.uav, &self.params.track.sensor);
        let turn_m = uav.speed_m_s / uav.turn_rate_max_rad_s;
        self.last(group).is_none_or(|group| {
            let near_m = (sensor.sensing_range_m - 2.0 * turn_m).max(group.standoff.distance_m + turn_m);
            let centre = group.centre.estimate().state.position();
            let mut crew = self.team.iter().filter(|mate| mate.group == Some(group.id));
            crew.all(|mate| mate.state.position.distance_m(centre) <= near_m)
        })
    }

    /// From the group's orbit as it was flown last, a target is within the field of view wherever on it a UAV is.
    fn is_inside(&self, place: usize, group: GroupId) -> bool {
        let half_rad = 0.5 * self.params.track.sensor.field_of_view_rad;
        self.last(group).is_none_or(|group| {
            let held_m = group.standoff.distance_m * math::sin(half_rad.min(0.5 * math::PI));
            self.known()[place].position().distance_m(group.centre.estimate().state.position()) <= held_m
        })
    }

    pub(super) fn complete(&mut self, place: usize, reason: CompletionReason) {
        let Membership::Dwell(handoff) = self.known()[place].membership else { return };
        self.memberships.set(place, Membership::Member(handoff.to));
        self.tell_of_handoff(place, EventKind::HandoffCompleted(reason), handoff);
    }

    pub(super) fn withdraw(&mut self, place: usize, reason: WithdrawalReason) {
        let Membership::Dwell(handoff) = self.known()[place].membership else { return };
        self.memberships.set(place, handoff.from.map_or(Membership::Discarded, Membership::Member));
        let dwell = handoff.dwell.max(Duration::from_s(self.params.group.dwell_min_s));
        self.memberships.bar(place, handoff.to, self.now + dwell);
        self.tell_of_handoff(place, EventKind::HandoffWithdrawn(reason), handoff);
    }

    /// Of a target that comes from no group, it was told when it was taken in; here only if that fails.
    fn tell_of_handoff(&mut self, place: usize, kind: EventKind, handoff: Handoff) {
        let track = self.track(place);
        match (handoff.from, kind) {
            (Some(from), _) => {
                let event = Event::of_track(kind, track, Some(from));
                self.events.push(Event { to: Some(handoff.to), ..event });
            }
            (None, EventKind::HandoffWithdrawn(reason)) if reason != WithdrawalReason::TargetLost => {
                self.events.push(Event::of_track(EventKind::LeftOut(reason), track, Some(handoff.to)));
            }
            _ => {}
        }
    }
}
