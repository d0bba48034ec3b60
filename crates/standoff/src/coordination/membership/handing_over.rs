//! How a target passes from one group to another.

use crate::coordination::event::{CompletionReason, Event, EventKind, WithdrawalReason};
use crate::coordination::group::GroupId;
use crate::coordination::handoff::{Handoff, dwell_s};
use crate::coordination::membership::{Membership, Settling};
use crate::time::Duration;

impl Settling<'_> {
    /// Clusters anew from the last clustering, requests handoffs, and ends those whose dwell is over.
    ///
    /// Implements section IV.B.1.
    pub(super) fn hand_over(&mut self) {
        self.keep_every_group_a_home();
        let buffers = &mut *self.buffers;
        buffers.places.clear();
        buffers.positions.clear();
        buffers.clusters.of.clear();
        for (index, known) in self.known.iter().enumerate() {
            let Some(cluster) = known.home().and_then(|home| buffers.groups.binary_search(&home).ok()) else {
                continue;
            };
            buffers.places.push(index);
            buffers.positions.push(known.position());
            buffers.clusters.of.push(cluster);
        }
        buffers.clusters.refine(&buffers.positions, buffers.groups.len(), self.params.group.handoff_margin_m);
        // By their ids: a group may end on the way.
        buffers.wanted.clear();
        let ids = buffers.clusters.of.iter().map(|cluster| buffers.groups[*cluster]);
        buffers.wanted.extend(buffers.places.iter().copied().zip(ids));
        for place in 0..self.buffers.wanted.len() {
            let (index, wanted) = self.buffers.wanted[place];
            match self.known[index].membership {
                Membership::Member(group) if group != wanted => self.request(index, group, wanted),
                Membership::Dwell(handoff) => self.end_dwell(index, handoff, wanted),
                _ => {}
            }
        }
    }

    /// A group all of whose members are on their way to others keeps the first of them.
    fn keep_every_group_a_home(&mut self) {
        let mut is_changed = false;
        for place in 0..self.group_ids() {
            let id = self.buffers.groups[place];
            let has_home = self.buffers.roster.of(id).any(|index| self.known[index].home() == Some(id));
            let first = self.buffers.roster.of(id).next();
            if let Some(first) = first.filter(|_| !has_home) {
                self.withdraw(first, WithdrawalReason::GroupEnds);
                is_changed = true;
            }
        }
        if is_changed {
            self.fill_roster();
        }
    }

    /// Requests a handoff, if the receiving group has room.
    ///
    /// Implements section IV.B.1, with the dwell (34).
    fn request(&mut self, index: usize, from: GroupId, to: GroupId) {
        if self.known[index].is_barred_from(to, self.now) {
            return;
        }
        let Some(need) = self.has_room(to, index) else { return };
        let (group, guidance) = (&self.params.group, &self.params.guidance);
        let uavs = self.on_duty.iter().filter(|duty| duty.group == Some(to)).map(|duty| duty.state.position);
        let (orbit, speed_m_s) = (need.orbit(), self.params.uav.speed_m_s);
        let dwell_s = dwell_s(uavs, &orbit, guidance.radial_gain, speed_m_s, (group.dwell_min_s, group.dwell_max_s));
        let handoff = Handoff { from: Some(from), to, requested_at: self.now, dwell: Duration::from_s(dwell_s) };
        self.known[index].membership = Membership::Dwell(handoff);
        self.tell_of_handoff(index, EventKind::HandoffRequested { dwell_s }, handoff);
        if group.dwell_max_s <= 0.0 {
            self.complete(index, CompletionReason::Undelayed);
        }
        self.fill_roster();
    }

    /// Completes or withdraws a handoff whose dwell is over, but not before all receiving UAVs have the target in view,
    /// unless that takes longer than the longest dwell: then one is enough.
    fn end_dwell(&mut self, index: usize, handoff: Handoff, wanted: GroupId) {
        let elapsed = self.now - handoff.requested_at;
        if elapsed < handoff.dwell {
            return;
        }
        let is_last = elapsed.s() >= self.params.group.dwell_max_s;
        if handoff.from.is_some() && wanted != handoff.to {
            self.withdraw(index, WithdrawalReason::WantedElsewhere);
        } else if self.is_seen_by_all(index, handoff.to) || (is_last && self.views(index, handoff.to).any(|seen| seen))
        {
            self.complete(index, CompletionReason::Received);
        } else if is_last {
            self.withdraw(index, WithdrawalReason::NotSeen);
        }
        self.fill_roster();
    }

    /// Whether each UAV of a group has the target in view, by its estimate and with one standard deviation to spare.
    fn views(&self, index: usize, group: GroupId) -> impl Iterator<Item = bool> {
        let sensor = &self.params.track.sensor;
        let estimate = self.known[index].track.estimate();
        let (at, clearance_m) = (estimate.state.position(), estimate.position_sd_max_m());
        self.on_duty.iter().filter(move |duty| duty.group == Some(group)).map(move |duty| {
            let from = duty.state.position;
            duty.boresight.is_some_and(|boresight| sensor.well_in_view(from, boresight, at, clearance_m))
        })
    }

    /// Every UAV of the group sees it, and there is one.
    pub(super) fn is_seen_by_all(&self, index: usize, group: GroupId) -> bool {
        let mut views = self.views(index, group);
        views.next().is_some_and(|first| first && views.all(|seen| seen))
    }

    pub(super) fn complete(&mut self, index: usize, reason: CompletionReason) {
        let Membership::Dwell(handoff) = self.known[index].membership else { return };
        self.known[index].membership = Membership::Member(handoff.to);
        self.tell_of_handoff(index, EventKind::HandoffCompleted(reason), handoff);
    }

    pub(super) fn withdraw(&mut self, index: usize, reason: WithdrawalReason) {
        let Membership::Dwell(handoff) = self.known[index].membership else { return };
        self.known[index].membership = handoff.from.map_or(Membership::Discarded, Membership::Member);
        let dwell = handoff.dwell.max(Duration::from_s(self.params.group.dwell_min_s));
        self.known[index].barred = Some((handoff.to, self.now + dwell));
        self.tell_of_handoff(index, EventKind::HandoffWithdrawn(reason), handoff);
    }

    /// Of a target that comes from no group, it was told when it was taken in; here only if that fails.
    fn tell_of_handoff(&mut self, index: usize, kind: EventKind, handoff: Handoff) {
        let target = self.known[index].track.target;
        match (handoff.from, kind) {
            (Some(from), _) => {
                let event = Event::of_target(kind, target, Some(from));
                self.events.push(Event { to: Some(handoff.to), ..event });
            }
            (None, EventKind::HandoffWithdrawn(reason)) if reason != WithdrawalReason::TargetLost => {
                self.events.push(Event::of_target(EventKind::LeftOut(reason), target, Some(handoff.to)));
            }
            _ => {}
        }
    }
}
