//! How groups come into being and end.

use crate::coordination::event::{
    CompletionReason, DissolutionReason, Event, EventKind, FoundingReason, WithdrawalReason,
};
use crate::coordination::group::GroupId;
use crate::coordination::membership::{Known, Membership, Settling};
use crate::coordination::need::Need;
use crate::frame::Position;
use crate::time::Duration;

/// UAVs are not sent to targets that they cannot have within sensing range after this time, s.
const SOON_S: f64 = 30.0;

impl Settling<'_> {
    /// Where there were no groups, all targets are clustered.
    ///
    /// Implements Algorithm 1's place in the mission.
    pub(super) fn found_first(&mut self, wanted: usize) {
        self.buffers.places.clear();
        self.buffers.places.extend((0..self.known.len()).filter(|index| !self.known[*index].track.is_lost()));
        self.locate();
        let buffers = &mut *self.buffers;
        buffers.clusters.found(&buffers.positions, wanted);
        // Groups are numbered by their first target.
        let mut ids: Vec<(usize, GroupId)> = Vec::new();
        for (cluster, index) in buffers.clusters.of.iter().zip(&buffers.places) {
            let id = match ids.iter().find(|(known, _)| known == cluster) {
                Some((_, id)) => *id,
                None => {
                    let id = new_id(self.next_group);
                    ids.push((*cluster, id));
                    id
                }
            };
            self.known[*index].membership = Membership::Member(id);
        }
        self.fill_roster();
        for (_, id) in ids {
            self.tell_of_founding(id, FoundingReason::First);
        }
        *self.next_review = self.now + Duration::from_s(self.params.group.review_period_s);
    }

    fn tell_of_founding(&mut self, id: GroupId, reason: FoundingReason) {
        let members = self.buffers.roster.of(id).count() as u32;
        self.events.push(Event::of_group(EventKind::GroupFounded { members, reason }, id));
    }

    /// Ends the group with the fewest members; of equals the youngest.
    pub(super) fn dissolve_smallest(&mut self) {
        let size = |id: &GroupId| self.buffers.roster.of(*id).count();
        if let Some(id) = self.buffers.groups.iter().rev().min_by_key(|id| size(id)).copied() {
            self.dissolve(id, DissolutionReason::TooMany);
        }
    }

    fn dissolve(&mut self, id: GroupId, reason: DissolutionReason) {
        self.events.push(Event::of_group(EventKind::GroupDissolved(reason), id));
        for index in 0..self.known.len() {
            match self.known[index].membership {
                Membership::Member(group) if group == id => {
                    let target = self.known[index].track.target;
                    if let DissolutionReason::Merged { into, .. } = reason {
                        self.receive(index, into);
                        let event = Event::of_target(EventKind::Merged, target, Some(id));
                        self.events.push(Event { to: Some(into), ..event });
                    } else {
                        self.known[index].membership = Membership::Unassigned;
                        let kind = EventKind::LeftOut(WithdrawalReason::GroupEnds);
                        self.events.push(Event::of_target(kind, target, Some(id)));
                    }
                }
                Membership::Dwell(handoff) if handoff.to == id => self.withdraw(index, WithdrawalReason::GroupEnds),
                Membership::Dwell(handoff) if handoff.from == Some(id) => {
                    self.complete(index, CompletionReason::PassingEnds);
                }
                _ => {}
            }
        }
        self.fill_roster();
    }

    /// From time to time: a group ends if its UAVs could watch half as many targets again, and two more at least, by
    /// forming a group of its own targets and those outside; or any at all, if a neighbour's orbit can hold its own
    /// targets too. Only targets count that its UAVs can have within sensing range soon.
    pub(super) fn review(&mut self, wanted: usize) {
        let period_s = self.params.group.review_period_s;
        let is_due = period_s > 0.0 && self.now >= *self.next_review && self.group_ids() >= wanted;
        if !is_due || !self.known.iter().any(Known::is_outside) {
            return;
        }
        *self.next_review = self.now + Duration::from_s(period_s);
        let mut best: Option<(usize, GroupId, Position, DissolutionReason)> = None;
        for place in 0..self.group_ids() {
            let id = self.buffers.groups[place];
            let Some(from) = self.need(id).map(|need| need.centre()) else { continue };
            let members = self.members(id).count();
            let into = self.who_could_hold(id);
            let together = self.gather(|known, settling| {
                let is_own = into.is_none() && known.membership == Membership::Member(id);
                is_own || (known.is_outside() && settling.is_soon_seen(known, from))
            });
            let (gain, reason) = match into {
                Some(into) => (together, DissolutionReason::Merged { into, together: together as u32 }),
                None => {
                    let gain = together.saturating_sub(members);
                    let is_worth_it = gain >= 2 && 2 * gain >= members;
                    (if is_worth_it { gain } else { 0 }, DissolutionReason::Outnumbered { together: together as u32 })
                }
            };
            if gain > best.map_or(0, |(most, ..)| most) {
                best = Some((gain, id, from, reason));
            }
        }
        if let Some((_, id, from, reason)) = best {
            self.dissolve(id, reason);
            if self.gather(|known, settling| known.is_outside() && settling.is_soon_seen(known, from)) > 0 {
                self.found();
            }
        }
    }

    /// Within sensing range of UAVs about `from` after a while, even if it drives away.
    fn is_soon_seen(&self, known: &Known, from: Position) -> bool {
        let closing_m_s = (self.params.uav.speed_m_s - known.speed_m_s()).max(0.0);
        let reach_m = self.params.track.sensor.sensing_range_m + SOON_S * closing_m_s;
        known.position().squared_distance_m2(from) <= reach_m * reach_m
    }

    /// The first other group whose orbit has room for all members of a group.
    fn who_could_hold(&self, id: GroupId) -> Option<GroupId> {
        let group = &self.params.group;
        self.buffers.groups.iter().copied().filter(|other| *other != id).find(|other| {
            let of_other = self.members(*other).filter(|index| !self.known[*index].belongs_to(id));
            let both = of_other.chain(self.members(id));
            Need::of(self.known, both, group).is_some_and(|need| need.leaves_room(group))
        })
    }

    /// Gathers in `buffers.places` the largest number of targets that count which one orbit about one of them could
    /// hold; gives their number. Targets faster than the UAVs do not count.
    fn gather(&mut self, counts: impl Fn(&Known, &Self) -> bool) -> usize {
        let (reach_m, limit_m_s) = (self.params.group.reach_m(), self.params.uav.speed_max_m_s());
        let is_near = |a: Position, b: Position| a.squared_distance_m2(b) <= reach_m * reach_m;
        let mut places = core::mem::take(&mut self.buffers.places);
        places.clear();
        let counts = |known: &Known| known.speed_m_s() <= limit_m_s && counts(known, self);
        places.extend((0..self.known.len()).filter(|index| counts(&self.known[*index])));
        self.buffers.places = places;
        self.locate();
        let buffers = &mut *self.buffers;
        let mut best: Option<(usize, Position)> = None;
        for about in &buffers.positions {
            let near = buffers.positions.iter().filter(|position| is_near(**position, *about)).count();
            if best.is_none_or(|(most, _)| near > most) {
                best = Some((near, *about));
            }
        }
        buffers.places.retain(|index| best.is_some_and(|(_, about)| is_near(self.known[*index].position(), about)));
        let group = &self.params.group;
        while let Some(need) = Need::of(self.known, self.buffers.places.iter().copied(), group) {
            if need.leaves_room(group) || self.buffers.places.len() == 1 {
                break;
            }
            self.buffers.places.retain(|index| *index != need.furthest);
        }
        self.buffers.places.len()
    }

    /// Founds one more group: of targets outside, or else by splitting the most scattered one. `false`: of nothing.
    pub(super) fn found_another(&mut self) -> bool {
        // Where nobody is slow enough, whoever there is.
        if self.gather(|known, _| known.is_outside()) > 0 || self.gather_one() > 0 {
            self.found();
            return true;
        }
        self.split()
    }

    /// Founds a group of the targets in `buffers.places`.
    fn found(&mut self) {
        let id = new_id(self.next_group);
        for index in &self.buffers.places {
            self.known[*index].membership = Membership::Member(id);
            self.events.push(Event::of_target(EventKind::Joined, self.known[*index].track.target, Some(id)));
        }
        self.fill_roster();
        self.tell_of_founding(id, FoundingReason::Outsiders);
    }

    /// Gathers in `buffers.places` the first target outside; gives their number.
    fn gather_one(&mut self) -> usize {
        self.buffers.places.clear();
        self.buffers.places.extend(self.known.iter().position(Known::is_outside));
        self.buffers.places.len()
    }

    /// Splits the group with the largest sum of squares in two; the part with more members stays itself.
    fn split(&mut self) -> bool {
        let mut widest: Option<(f64, GroupId)> = None;
        for place in 0..self.group_ids() {
            let id = self.buffers.groups[place];
            let n = self.gather_members(id);
            self.buffers.clusters.of.clear();
            self.buffers.clusters.of.resize(n, 0);
            let sum_m2 = self.buffers.clusters.cost_m2(&self.buffers.positions) * n as f64;
            if n > 1 && widest.is_none_or(|(most_m2, _)| sum_m2 > most_m2) {
                widest = Some((sum_m2, id));
            }
        }
        let Some((_, id)) = widest else { return false };
        let n = self.gather_members(id);
        let buffers = &mut *self.buffers;
        buffers.clusters.found(&buffers.positions, 2);
        let of_second = buffers.clusters.of.iter().filter(|cluster| **cluster == 1).count();
        let leaves = usize::from(2 * of_second <= n);
        let new = new_id(self.next_group);
        for (index, cluster) in buffers.places.iter().zip(&buffers.clusters.of) {
            if *cluster == leaves {
                self.known[*index].membership = Membership::Member(new);
                let event = Event::of_target(EventKind::Regrouped, self.known[*index].track.target, Some(id));
                self.events.push(Event { to: Some(new), ..event });
            }
        }
        self.fill_roster();
        self.tell_of_founding(new, FoundingReason::Split);
        true
    }

    /// Gathers places and positions of a group's members that are in no dwell; gives their number.
    fn gather_members(&mut self, id: GroupId) -> usize {
        let buffers = &mut *self.buffers;
        buffers.places.clear();
        let is_member = |index: &usize| self.known[*index].membership == Membership::Member(id);
        buffers.places.extend(buffers.roster.of(id).filter(is_member));
        self.locate();
        self.buffers.places.len()
    }
}

fn new_id(next: &mut u32) -> GroupId {
    let id = GroupId(*next);
    *next = next.saturating_add(1);
    id
}
