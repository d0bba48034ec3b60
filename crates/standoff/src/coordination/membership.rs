//! Who belongs to which group: founding, taking in, handoff and discard (section IV).
//!
//! Groups are founded by clustering (30); from then on clustering only proposes. Where it wants a target in another
//! group, a handoff is requested: the target belongs to both groups for the dwell (34). The furthest target is
//! discarded while no orbit holds it (section IV.B.2, by range), or where the orbit with it runs away from the UAVs (by
//! convergence, Lemma 3.1). A target outside all groups keeps its track; the nearest group takes it in when its orbit
//! has room to spare, so that a target on the limit does not come and go. The paper leaves it lost.

mod founding;
mod handing_over;
#[cfg(test)]
mod tests;

use crate::angle::Angle;
use crate::coordination::Roster;
use crate::coordination::clustering::{Clusters, group_count};
use crate::coordination::event::{CompletionReason, DissolutionReason, Event, EventKind, WithdrawalReason};
use crate::coordination::group::{Group, GroupId};
use crate::coordination::handoff::Handoff;
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
    /// A group that it is not to be handed to before a time: a handoff to it was withdrawn.
    barred: Option<(GroupId, Time)>,
}

impl Known {
    /// A new target: in no group yet.
    pub(crate) fn unassigned(track: Track) -> Self {
        Self { track, membership: Membership::Unassigned, barred: None }
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

    /// The group is one of them.
    pub(crate) fn belongs_to(&self, group: GroupId) -> bool {
        match self.membership {
            Membership::Member(own) => own == group,
            Membership::Dwell(handoff) => handoff.from == Some(group) || handoff.to == group,
            Membership::Unassigned | Membership::Discarded => false,
        }
    }

    /// Where clustering has put it last: in dwell, the receiving group.
    fn home(&self) -> Option<GroupId> {
        self.receiving_group().or(self.group())
    }

    /// It can be watched, and nobody means to.
    pub(crate) fn is_outside(&self) -> bool {
        !self.track.is_lost() && self.home().is_none()
    }

    pub(crate) fn position(&self) -> Position {
        self.track.estimate().state.position()
    }

    fn speed_m_s(&self) -> f64 {
        self.track.estimate().state.velocity().speed_m_s()
    }

    fn is_barred_from(&self, group: GroupId, now: Time) -> bool {
        self.barred.is_some_and(|(barred, until)| barred == group && now < until)
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
    wanted: Vec<(usize, GroupId)>,
}

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
    /// With the roster of the memberships of the last instant.
    pub(crate) buffers: &'a mut Buffers,
}

impl Settling<'_> {
    /// Settles who belongs where; `buffers.roster` tells it by group.
    pub(crate) fn settle(&mut self) {
        self.release_lost();
        if self.on_duty.is_empty() {
            // Nobody is there to watch: all stays as it is.
            return self.tell_of_emptied_groups();
        }
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
            // Nothing passes between groups where there is one.
            if self.group_ids() > 1 || self.known.iter().any(|known| known.receiving_group().is_some()) {
                self.hand_over();
            }
        }
        self.discard();
        self.tell_of_emptied_groups();
    }

    /// A lost track belongs nowhere.
    fn release_lost(&mut self) {
        let mut is_changed = false;
        for index in 0..self.known.len() {
            let Known { track, membership, .. } = &self.known[index];
            if track.is_lost() && *membership != Membership::Unassigned {
                self.withdraw(index, WithdrawalReason::TargetLost);
                self.known[index].membership = Membership::Unassigned;
                is_changed = true;
            }
        }
        if is_changed {
            self.fill_roster();
        } else {
            self.list_groups();
        }
    }

    fn fill_roster(&mut self) {
        self.buffers.roster.fill(self.known);
        self.list_groups();
    }

    fn list_groups(&mut self) {
        self.buffers.groups.clear();
        self.buffers.groups.extend(self.buffers.roster.groups());
    }

    /// Makes `buffers.positions` those of `buffers.places`.
    fn locate(&mut self) {
        let buffers = &mut *self.buffers;
        buffers.positions.clear();
        buffers.positions.extend(buffers.places.iter().map(|index| self.known[*index].position()));
    }

    /// Number of groups with members.
    fn group_ids(&self) -> usize {
        self.buffers.groups.len()
    }

    /// Every target outside joins the nearest group whose orbit has room to spare; one that only fits once another has
    /// joined waits for the next instant.
    ///
    /// Implements section IV.B.2, beyond the paper: discarded targets are taken back.
    fn take_in(&mut self) {
        if !self.known.iter().any(Known::is_outside) {
            return;
        }
        let buffers = &mut *self.buffers;
        buffers.centroids.clear();
        for id in &buffers.groups {
            let members = buffers.roster.of(*id).map(|index| self.known[index].track.estimate());
            buffers.centroids.extend(Centroid::of(members).map(|centroid| (*id, centroid)));
        }
        let (reach_m, limit_m_s) = (self.params.group.reach_m(), self.params.uav.speed_max_m_s());
        buffers.candidates.clear();
        for (index, target) in self.known.iter().enumerate().filter(|(_, target)| target.is_outside()) {
            if target.speed_m_s() > limit_m_s {
                continue;
            }
            for (id, centroid) in &buffers.centroids {
                let n = f64::from(centroid.members);
                // With it, the centroid moves towards it by one part in n + 1.
                let reach_m = reach_m * (n + 1.0) / n;
                let squared_m2 = target.position().squared_distance_m2(centroid.mean.state.position());
                if squared_m2 <= reach_m * reach_m && !target.is_barred_from(*id, self.now) {
                    buffers.candidates.push((squared_m2, index, *id));
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
                self.receive(index, id);
                self.fill_roster();
            }
        }
    }

    /// A group takes a target in that nobody passes to it. A member is in view; until then the orbit only makes room for
    /// it, if there is a dwell.
    fn receive(&mut self, index: usize, id: GroupId) {
        let at_once = self.params.group.dwell_max_s <= 0.0 || self.is_seen_by_all(index, id);
        self.known[index].membership = match at_once {
            true => Membership::Member(id),
            false => {
                let (requested_at, dwell) = (self.now, Duration::ZERO);
                Membership::Dwell(Handoff { from: None, to: id, requested_at, dwell })
            }
        };
    }

    /// What the group's orbit needs with a further target, if it has room for it to spare.
    fn has_room(&self, id: GroupId, further: usize) -> Option<Need> {
        let members = self.buffers.roster.of(id).chain([further]);
        Need::of(self.known, members, &self.params.group).filter(|need| need.leaves_room(&self.params.group))
    }

    /// Removes the furthest target of every group whose orbit runs away, and of every group until its orbit fits.
    ///
    /// Implements section IV.B.2 and section IV.B.2, convergence rule.
    fn discard(&mut self) {
        // Only groups of several let one go, so that the list of groups stays as it is.
        for place in 0..self.group_ids() {
            let id = self.buffers.groups[place];
            let limit_m2_s = -self.params.group.convergence_limit_m2_s;
            let diverging = self.last(id).and_then(|group| {
                let threshold_m2_s = group.threshold_m2_s?;
                let need =
                    (group.diverging.s() > self.params.group.convergence_patience_s).then(|| self.need(id))??;
                (need.members() > 1).then_some((threshold_m2_s, need.furthest))
            });
            if let Some((threshold_m2_s, furthest)) = diverging {
                self.let_go(id, furthest, EventKind::DiscardedDiverging { threshold_m2_s, limit_m2_s });
            }
            self.discard_fastest(id);
            let allowed_m = self.params.group.standoff.radius_max_m;
            while let Some(need) = self.need(id).filter(|need| need.members() > 1) {
                let needed_m = need.standoff.unclamped_m;
                if needed_m <= allowed_m {
                    break;
                }
                self.let_go(id, need.furthest, EventKind::Discarded { needed_m, allowed_m });
            }
        }
    }

    /// Removes the fastest target of a group that has outrun the UAVs for too long: the others may be kept.
    ///
    /// Beyond section IV.B.2.
    fn discard_fastest(&mut self, id: GroupId) {
        let outrun = self.last(id).map_or(Duration::ZERO, |group| group.outrun);
        if outrun.s() <= self.params.group.convergence_patience_s || self.members(id).count() < 2 {
            return;
        }
        let speed_m_s = |index: &usize| self.known[*index].speed_m_s();
        let fastest = self.members(id).max_by(|a, b| speed_m_s(a).total_cmp(&speed_m_s(b)));
        if let Some(fastest) = fastest {
            let (speed_m_s, limit_m_s) = (speed_m_s(&fastest), self.params.uav.speed_max_m_s());
            self.let_go(id, fastest, EventKind::DiscardedTooFast { speed_m_s, limit_m_s });
        }
    }

    /// The group as it was at the last instant.
    fn last(&self, id: GroupId) -> Option<&Group> {
        self.previous.binary_search_by_key(&id, |group| group.id).ok().map(|index| &self.previous[index])
    }

    /// What a group's orbit needs.
    fn need(&self, id: GroupId) -> Option<Need> {
        Need::of(self.known, self.members(id), &self.params.group)
    }

    /// The places of a group's members.
    fn members(&self, id: GroupId) -> impl Iterator<Item = usize> + Clone {
        self.buffers.roster.of(id)
    }

    /// The group's orbit cannot hold a target. One that is only just being received goes first, if the orbit is smaller
    /// without it; one that is being passed on is passed at once.
    fn let_go(&mut self, id: GroupId, furthest: usize, kind: EventKind) {
        let needed_m = self.need(id).map_or(0.0, |need| need.standoff.unclamped_m);
        let widens = |index: &usize| {
            let others = self.members(id).filter(|other| other != index);
            Need::of(self.known, others, &self.params.group).is_none_or(|need| need.standoff.unclamped_m < needed_m)
        };
        let is_incoming = |index: &usize| self.known[*index].receiving_group() == Some(id);
        let incoming = self.members(id).filter(is_incoming).find(widens);
        if let Some(incoming) = incoming.or(Some(furthest).filter(is_incoming)) {
            self.withdraw(incoming, WithdrawalReason::ReceivingCannotHold);
        } else if self.known[furthest].receiving_group().is_some() {
            self.complete(furthest, CompletionReason::PassingCannotHold);
        } else {
            self.events.push(Event::of_target(kind, self.known[furthest].track.target, Some(id)));
            self.known[furthest].membership = Membership::Discarded;
        }
        self.fill_roster();
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
