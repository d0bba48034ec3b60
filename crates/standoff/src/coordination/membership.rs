//! Who belongs to which group: founding, taking in, handoff and discard (section IV).
//!
//! Groups are founded by clustering (30); from then on clustering only proposes. Where it wants a target in another
//! group, a handoff is requested: the target belongs to both groups for the dwell (34). The furthest target is
//! discarded while no orbit holds it (section IV.B.2, by range), or where the orbit with it runs away from the UAVs (by
//! convergence, Lemma 3.1). A target outside all groups keeps its track; the nearest group takes it in when its orbit
//! has room to spare, so that a target on the limit does not come and go. The paper leaves it lost.

use crate::angle::Angle;
use crate::coordination::Roster;
use crate::coordination::clustering::{Clusters, group_count};
use crate::coordination::event::{
    CompletionReason, DissolutionReason, Event, EventKind, FoundingReason, WithdrawalReason,
};
use crate::coordination::group::{Group, GroupId};
use crate::coordination::handoff::{Handoff, dwell_s};
use crate::coordination::need::Need;
use crate::estimation::group_centre::Centroid;
use crate::estimation::track::Track;
use crate::frame::Position;
use crate::team::TeamParams;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};

/// A target's place in the team's work.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Membership {
    /// In no group: new, its track was lost, or nobody can cover it.
    #[default]
    Unassigned,
    /// Member of a group.
    Member(GroupId),
    /// On its way into a group that makes room for it: from another group, to which it belongs too, or from none.
    Dwell(Handoff),
    /// Removed from its group, still predicted.
    Discarded,
}

/// A track and its place in the team's work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// The track.
    pub track: Track,
    /// Its place.
    pub membership: Membership,
}

impl Known {
    /// A new target: in no group yet.
    pub(crate) fn unassigned(track: Track) -> Self {
        Self { track, membership: Membership::Unassigned }
    }

    /// The group whose duty it is to keep the target in view: in dwell, the passing one.
    pub fn group(&self) -> Option<GroupId> {
        match self.membership {
            Membership::Member(group) => Some(group),
            Membership::Dwell(handoff) => handoff.from,
            Membership::Unassigned | Membership::Discarded => None,
        }
    }

    /// In dwell, the receiving group.
    pub fn receiving_group(&self) -> Option<GroupId> {
        match self.membership {
            Membership::Dwell(handoff) => Some(handoff.to),
            _ => None,
        }
    }

    /// All groups it belongs to.
    pub fn groups(&self) -> impl Iterator<Item = GroupId> {
        [self.group(), self.receiving_group()].into_iter().flatten()
    }

    /// Where clustering has put it last: in dwell, the receiving group.
    fn home(&self) -> Option<GroupId> {
        self.receiving_group().or(self.group())
    }

    /// It can be watched, and nobody means to.
    pub(crate) fn is_outside(&self) -> bool {
        !self.track.is_lost() && self.home().is_none()
    }

    fn position(&self) -> Position {
        self.track.estimate().state.position()
    }
}

/// A UAV of the team as it was last heard, and the group it served until now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OnDuty {
    pub(crate) uav: UavId,
    pub(crate) group: Option<GroupId>,
    pub(crate) state: UavState,
    pub(crate) boresight: Option<Angle>,
}

/// Buffers that live on.
#[derive(Debug, Clone, Default)]
pub(crate) struct Buffers {
    pub(crate) roster: Roster,
    clusters: Clusters,
    places: Vec<usize>,
    positions: Vec<Position>,
    groups: Vec<GroupId>,
    centroids: Vec<(GroupId, Centroid)>,
    candidates: Vec<(f64, usize, GroupId)>,
}

/// So often it is asked whether UAVs could watch more targets elsewhere.
const REVIEW_PERIOD: Duration = Duration::from_us(10_000_000);

/// One instant's settling of who belongs where.
pub(crate) struct Settling<'a> {
    pub(crate) now: Time,
    /// Of this instant, memberships of the last; by ascending target.
    pub(crate) known: &'a mut [Known],
    /// The groups of the last instant.
    pub(crate) previous: &'a [Group],
    /// The team, by ascending UAV.
    pub(crate) on_duty: &'a [OnDuty],
    pub(crate) params: &'a TeamParams,
    /// The id of the next group that is founded.
    pub(crate) next_group: &'a mut u32,
    /// When it is next asked whether UAVs could watch more elsewhere.
    pub(crate) next_review: &'a mut Time,
    pub(crate) events: &'a mut Vec<Event>,
    pub(crate) buffers: &'a mut Buffers,
}

impl Settling<'_> {
    /// Settles who belongs where; `buffers.roster` tells it by group.
    pub(crate) fn settle(&mut self) {
        self.release_lost();
        self.fill_roster();
        let live = self.known.iter().filter(|known| !known.track.is_lost()).count();
        let wanted = group_count(self.on_duty.len(), live);
        if self.group_ids() == 0 {
            self.found_first(wanted);
        } else {
            while self.group_ids() > wanted.max(1) {
                self.dissolve_smallest();
            }
            self.take_in();
            self.review(wanted);
            while self.group_ids() < wanted && self.found_another() {}
            self.hand_over();
        }
        self.discard();
        self.tell_of_emptied_groups();
    }

    /// A lost track belongs nowhere.
    fn release_lost(&mut self) {
        for index in 0..self.known.len() {
            if self.known[index].track.is_lost() {
                self.withdraw(index, WithdrawalReason::TargetLost);
                self.known[index].membership = Membership::Unassigned;
            }
        }
    }

    fn fill_roster(&mut self) {
        self.buffers.roster.fill(self.known);
        self.buffers.groups.clear();
        self.buffers.groups.extend(self.buffers.roster.groups());
    }

    /// Number of groups with members.
    fn group_ids(&self) -> usize {
        self.buffers.groups.len()
    }

    /// The nothing before is clustered into groups.
    ///
    /// Implements section IV.A.
    fn found_first(&mut self, wanted: usize) {
        let buffers = &mut *self.buffers;
        buffers.places.clear();
        buffers.places.extend((0..self.known.len()).filter(|index| !self.known[*index].track.is_lost()));
        buffers.positions.clear();
        buffers.positions.extend(buffers.places.iter().map(|index| self.known[*index].position()));
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
    }

    fn tell_of_founding(&mut self, id: GroupId, reason: FoundingReason) {
        let members = self.buffers.roster.of(id).count() as u32;
        self.events.push(Event::of_group(EventKind::GroupFounded { members, reason }, id));
    }

    /// Ends the group with the fewest members; of equals the youngest.
    fn dissolve_smallest(&mut self) {
        let size = |id: &GroupId| self.buffers.roster.of(*id).count();
        if let Some(id) = self.buffers.groups.iter().rev().min_by_key(|id| size(id)).copied() {
            self.dissolve(id, DissolutionReason::TooMany);
        }
    }

    fn dissolve(&mut self, id: GroupId, reason: DissolutionReason) {
        self.events.push(Event::of_group(EventKind::GroupDissolved(reason), id));
        for index in 0..self.known.len() {
            match self.known[index].membership {
                Membership::Member(group) if group == id => self.known[index].membership = Membership::Unassigned,
                Membership::Dwell(handoff) if handoff.to == id => self.withdraw(index, WithdrawalReason::GroupEnds),
                Membership::Dwell(handoff) if handoff.from == Some(id) => {
                    self.complete(index, CompletionReason::PassingCannotHold);
                }
                _ => {}
            }
        }
        self.fill_roster();
    }

    /// Every target outside joins the nearest group whose orbit has room to spare.
    ///
    /// Implements section IV.B.2, beyond the paper: discarded targets are taken back.
    fn take_in(&mut self) {
        let buffers = &mut *self.buffers;
        buffers.centroids.clear();
        for id in &buffers.groups {
            let members = buffers.roster.of(*id).map(|index| self.known[index].track.estimate());
            buffers.centroids.extend(Centroid::of(members).map(|centroid| (*id, centroid)));
        }
        let reach_m = self.params.group.reach_m();
        buffers.candidates.clear();
        for (index, target) in self.known.iter().enumerate().filter(|(_, target)| target.is_outside()) {
            for (id, centroid) in &buffers.centroids {
                let n = f64::from(centroid.members);
                let distance_m = target.position().distance_m(centroid.mean.state.position());
                // With it, the centroid moves towards it by one part in n + 1.
                if distance_m * n / (n + 1.0) <= reach_m {
                    buffers.candidates.push((distance_m, index, *id));
                }
            }
        }
        buffers.candidates.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for place in 0..self.buffers.candidates.len() {
            let (_, index, id) = self.buffers.candidates[place];
            if self.known[index].is_outside() && self.has_room(id, index).is_some() {
                let kind = match self.known[index].membership {
                    Membership::Discarded => EventKind::TakenBack,
                    _ => EventKind::Joined,
                };
                self.events.push(Event::of_target(kind, self.known[index].track.target, Some(id)));
                // A member is in view; until then the orbit only makes room for it.
                self.known[index].membership = match self.is_seen_by_all(index, id) {
                    true => Membership::Member(id),
                    false => {
                        let (requested_at, dwell) = (self.now, Duration::ZERO);
                        Membership::Dwell(Handoff { from: None, to: id, requested_at, dwell })
                    }
                };
                self.fill_roster();
            }
        }
    }

    /// What the group's orbit needs with a further target, if it has room for it to spare.
    fn has_room(&self, id: GroupId, further: usize) -> Option<Need> {
        let members = self.buffers.roster.of(id).chain([further]);
        Need::of(self.known, members, &self.params.group).filter(|need| need.leaves_room(&self.params.group))
    }

    /// From time to time: a group ends if its UAVs could watch half as many targets again, and two more at least, by
    /// forming a group of its own targets and those outside.
    fn review(&mut self, wanted: usize) {
        if self.now < *self.next_review || self.group_ids() < wanted || !self.known.iter().any(Known::is_outside) {
            return;
        }
        *self.next_review = self.now + REVIEW_PERIOD;
        let mut most: Option<(usize, usize, GroupId)> = None;
        for place in 0..self.group_ids() {
            let id = self.buffers.groups[place];
            let members = self.buffers.roster.of(id).count();
            let together = self.gather(Some(id));
            let gain = together.saturating_sub(members);
            if gain >= 2 && 2 * gain >= members && most.is_none_or(|(best, ..)| gain > best) {
                most = Some((gain, together, id));
            }
        }
        if let Some((_, together, id)) = most {
            self.dissolve(id, DissolutionReason::Outnumbered { together: together as u32 });
        }
    }

    /// Gathers in `buffers.places` the largest number of targets, outside or of that group, that one orbit about one of
    /// them could hold; gives their number.
    fn gather(&mut self, with: Option<GroupId>) -> usize {
        let reach_m = self.params.group.reach_m();
        let counts =
            |known: &Known| known.is_outside() || with.is_some_and(|id| known.membership == Membership::Member(id));
        let buffers = &mut *self.buffers;
        buffers.places.clear();
        buffers.places.extend((0..self.known.len()).filter(|index| counts(&self.known[*index])));
        buffers.positions.clear();
        buffers.positions.extend(buffers.places.iter().map(|index| self.known[*index].position()));
        let mut best: Option<(usize, Position)> = None;
        for about in &buffers.positions {
            let near = buffers.positions.iter().filter(|position| position.distance_m(*about) <= reach_m).count();
            if best.is_none_or(|(most, _)| near > most) {
                best = Some((near, *about));
            }
        }
        buffers
            .places
            .retain(|index| best.is_some_and(|(_, about)| self.known[*index].position().distance_m(about) <= reach_m));
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
    fn found_another(&mut self) -> bool {
        if self.gather(None) > 0 {
            let id = new_id(self.next_group);
            for index in &self.buffers.places {
                self.known[*index].membership = Membership::Member(id);
            }
            self.fill_roster();
            self.tell_of_founding(id, FoundingReason::Outsiders);
            return true;
        }
        self.split()
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
        buffers.positions.clear();
        buffers.positions.extend(buffers.places.iter().map(|index| self.known[*index].position()));
        buffers.places.len()
    }

    /// Clusters anew from the last clustering, requests handoffs, and ends those whose dwell is over.
    ///
    /// Implements section IV.B.1.
    fn hand_over(&mut self) {
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
        for place in 0..self.buffers.places.len() {
            let index = self.buffers.places[place];
            let wanted = self.buffers.groups[self.buffers.clusters.of[place]];
            match self.known[index].membership {
                Membership::Member(group) if group != wanted => self.request(index, group, wanted),
                Membership::Dwell(handoff) => self.end_dwell(index, handoff, wanted),
                _ => {}
            }
        }
        self.fill_roster();
    }

    /// A group all of whose members are on their way to others keeps the first of them.
    fn keep_every_group_a_home(&mut self) {
        for place in 0..self.group_ids() {
            let id = self.buffers.groups[place];
            let has_home = self.buffers.roster.of(id).any(|index| self.known[index].home() == Some(id));
            let first = self.buffers.roster.of(id).next();
            if let Some(first) = first.filter(|_| !has_home) {
                self.withdraw(first, WithdrawalReason::GroupEnds);
            }
        }
        self.fill_roster();
    }

    /// Requests a handoff, if the receiving group has room.
    ///
    /// Implements section IV.B.1 with the dwell (34).
    fn request(&mut self, index: usize, from: GroupId, to: GroupId) {
        let Some(need) = self.has_room(to, index) else { return };
        let (group, guidance) = (&self.params.group, &self.params.guidance);
        let uavs = self.on_duty.iter().filter(|duty| duty.group == Some(to)).map(|duty| duty.state.position);
        let (orbit, speed_m_s) = (need.orbit(group), self.params.uav.speed_m_s);
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

    fn is_seen_by_all(&self, index: usize, group: GroupId) -> bool {
        self.views(index, group).all(|seen| seen)
    }

    fn complete(&mut self, index: usize, reason: CompletionReason) {
        let Membership::Dwell(handoff) = self.known[index].membership else { return };
        self.known[index].membership = Membership::Member(handoff.to);
        self.tell_of_handoff(index, EventKind::HandoffCompleted(reason), handoff);
    }

    fn withdraw(&mut self, index: usize, reason: WithdrawalReason) {
        let Membership::Dwell(handoff) = self.known[index].membership else { return };
        self.known[index].membership = handoff.from.map_or(Membership::Discarded, Membership::Member);
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

    /// Removes the furthest target of every group whose orbit runs away, and of every group until its orbit fits.
    ///
    /// Implements section IV.B.2.
    fn discard(&mut self) {
        for place in 0..self.group_ids() {
            let id = self.buffers.groups[place];
            let limit_m2_s = -self.params.group.convergence_limit_m2_s;
            let diverging = self.previous.iter().find(|group| group.id == id).and_then(|group| {
                (group.diverging.s() > self.params.group.convergence_patience_s).then_some(group.threshold_m2_s?)
            });
            if let Some(threshold_m2_s) = diverging {
                let furthest = self.need(id).filter(|need| need.members() > 1).map(|need| need.furthest);
                furthest
                    .map(|index| self.let_go(id, index, EventKind::DiscardedDiverging { threshold_m2_s, limit_m2_s }));
            }
            let allowed_m = self.params.group.standoff.radius_max_m;
            while let Some(need) = self.need(id).filter(|need| need.members() > 1) {
                let needed_m = need.standoff.unclamped_m;
                if needed_m <= allowed_m {
                    break;
                }
                self.let_go(id, need.furthest, EventKind::Discarded { needed_m, allowed_m });
            }
        }
        self.fill_roster();
    }

    /// What a group's orbit needs as its members are now.
    fn need(&self, id: GroupId) -> Option<Need> {
        let belongs = |index: &usize| self.known[*index].groups().any(|group| group == id);
        Need::of(self.known, self.buffers.roster.of(id).filter(belongs), &self.params.group)
    }

    /// The group's orbit cannot hold its furthest target. A target that is only just being received goes first; one that
    /// is being passed on is passed at once.
    fn let_go(&mut self, id: GroupId, furthest: usize, kind: EventKind) {
        let incoming = self.buffers.roster.of(id).find(|index| self.known[*index].receiving_group() == Some(id));
        if let Some(incoming) = incoming {
            self.withdraw(incoming, WithdrawalReason::ReceivingCannotHold);
        } else if self.known[furthest].receiving_group().is_some() {
            self.complete(furthest, CompletionReason::PassingCannotHold);
        } else {
            self.events.push(Event::of_target(kind, self.known[furthest].track.target, Some(id)));
            self.known[furthest].membership = Membership::Discarded;
        }
    }

    fn tell_of_emptied_groups(&mut self) {
        for group in self.previous {
            let told =
                |event: &Event| event.group == Some(group.id) && matches!(event.kind, EventKind::GroupDissolved(_));
            if self.buffers.groups.binary_search(&group.id).is_err() && !self.events.iter().any(told) {
                self.events.push(Event::of_group(EventKind::GroupDissolved(DissolutionReason::Empty), group.id));
            }
        }
    }
}

fn new_id(next: &mut u32) -> GroupId {
    let id = GroupId(*next);
    *next = next.saturating_add(1);
    id
}
