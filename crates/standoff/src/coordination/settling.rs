//! Who belongs to which group: founding, taking in, handoff and discard (section IV).
//!
//! Groups are founded by clustering (30); from then on clustering only proposes. Where it wants a target in another
//! group, a handoff is requested: the target belongs to both groups for the dwell (34). The furthest target is
//! discarded while no orbit holds it (section IV.B.2, by range), or where the orbit with it runs away from the UAVs (by
//! convergence, Lemma 3.1). A target outside all groups keeps its track; the nearest group takes it in when its orbit
//! has room to spare, so that a target on the limit does not come and go. The paper leaves it lost.
//!
//! With [`GroupCount::Needed`] the objective is: as many targets in groups as UAVs can watch, one UAV to a group where it
//! takes that; and of what watches the same, the most information, the sum of ln det (`assignment`), which two UAVs on
//! one orbit have more of than one on each of two. So a group is founded at once for whoever is in none, even if a UAV
//! leaves its partner; and while some are unwatched, a group is wound up whose members others hold with room to spare
//! (`winding_up`). Inertia: at most one group at a time ends, one review after the last; and a UAV's staying counts in
//! the assignment (`assignment_inertia`).

mod founding;
mod handing_over;
#[cfg(test)]
mod tests;
mod winding_up;

use crate::coordination::clustering::{Clusters, group_count};
use crate::coordination::event::{CompletionReason, DissolutionReason, Event, EventKind, WithdrawalReason};
use crate::coordination::group::Group;
use crate::coordination::handoff::Handoff;
use crate::coordination::memberships::{Known, Membership, Memberships};
use crate::coordination::required_orbit::RequiredOrbit;
use crate::coordination::teammate::Teammate;
use crate::coordination::wanted_centre::WantedCentre;
use crate::estimation::track::TrackId;
use crate::frame::Position;
use crate::group_id::GroupId;
use crate::guidance::standoff_distance::Spread;
use crate::smallest_circle::SmallestCircle;
use crate::team::{CentreEstimate, Discard, GroupCount, TeamParams};
use crate::time::{Duration, Time};

/// What outlives an instant beside the memberships.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Agenda {
    /// When it is next asked whether UAVs could watch more elsewhere.
    next_review: Time,
    /// The group that passes all of its members to others, to end.
    winding_up: Option<GroupId>,
}

impl Agenda {
    #[cfg(test)]
    pub(crate) fn reviewed_next(next_review: Time) -> Self {
        Self { next_review, ..Self::default() }
    }

    /// It can have come about by an instant.
    pub(crate) fn is_sound(&self, now: Time, params: &TeamParams) -> bool {
        self.next_review <= now.max(Time::START) + Duration::from_s(params.group.review_period_s)
    }
}

/// Room that lives on, so that a step allocates nothing; what is in it means nothing once the step has ended.
#[derive(Debug, Clone, Default)]
pub(crate) struct Room {
    clusters: Clusters,
    places: Vec<usize>,
    positions: Vec<Position>,
    groups: Vec<GroupId>,
    centres: Vec<(GroupId, WantedCentre)>,
    /// Squared distance, m2, place and group.
    candidates: Vec<(f64, usize, GroupId)>,
    wanted: Vec<(usize, GroupId)>,
}

/// One instant's settling of who belongs where.
pub(crate) struct Settling<'a> {
    pub(crate) now: Time,
    /// Targets of this instant, memberships of the last.
    pub(crate) memberships: &'a mut Memberships,
    pub(crate) agenda: &'a mut Agenda,
    /// The groups of the last instant.
    pub(crate) previous: &'a [Group],
    /// By ascending UAV, each with the group that it served until now.
    pub(crate) team: &'a [Teammate],
    pub(crate) params: &'a TeamParams,
    pub(crate) events: &'a mut Vec<Event>,
    pub(crate) room: &'a mut Room,
}

impl Settling<'_> {
    /// Settles who belongs where.
    pub(crate) fn settle(&mut self) {
        self.release_lost();
        if self.team.is_empty() {
            // Nobody is there to watch: all stays as it is.
            return self.tell_of_emptied_groups();
        }
        let live = self.live();
        let wanted = match self.params.group.count {
            GroupCount::Half => group_count(self.team.len(), live),
            GroupCount::Needed => self.team.len().min(live),
        };
        if self.groups() == 0 {
            self.found_first(wanted);
        } else {
            while self.groups() > wanted.max(1) {
                self.dissolve_smallest();
            }
            self.go_on_winding_up();
            self.take_in();
            self.review(wanted);
            while self.groups() < wanted && self.found_another() {}
            // Nothing passes between groups where there is one.
            if self.groups() > 1 || self.known().iter().any(|known| known.receiving_group().is_some()) {
                self.hand_over();
            }
        }
        self.discard();
        if self.groups() == 0 && live > 0 && self.params.group.count == GroupCount::Needed {
            // The last that were on their way into a group are given up: somebody is to be watched all the same.
            self.found_first(wanted);
        }
        self.tell_of_emptied_groups();
    }

    /// A lost track belongs nowhere.
    fn release_lost(&mut self) {
        for place in 0..self.known().len() {
            let Known { track, membership, .. } = &self.known()[place];
            if track.is_lost() && *membership != Membership::Unassigned {
                self.withdraw(place, WithdrawalReason::TargetLost);
                self.memberships.set(place, Membership::Unassigned);
            }
        }
    }

    /// Number of targets that are not lost.
    fn live(&self) -> usize {
        self.known().iter().filter(|known| !known.track.is_lost()).count()
    }

    fn known(&self) -> &[Known] {
        self.memberships.known()
    }

    fn track(&self, place: usize) -> TrackId {
        self.known()[place].track.id
    }

    /// Number of groups with members.
    fn groups(&self) -> usize {
        self.memberships.groups().len()
    }

    /// The groups that have members now, by ascending id: for steps in which some come or go.
    fn groups_now(&mut self) -> Vec<GroupId> {
        let mut groups = core::mem::take(&mut self.room.groups);
        groups.clear();
        groups.extend_from_slice(self.memberships.groups());
        groups
    }

    /// Every unassigned target joins the nearest group whose orbit has room to spare; one that only fits once another has
    /// joined waits for the next instant.
    ///
    /// Implements section IV.B.2, beyond the paper: discarded targets are taken back.
    fn take_in(&mut self) {
        if !self.known().iter().any(Known::is_unassigned) {
            return;
        }
        let candidates = self.candidates();
        for (_, place, id) in &candidates {
            if self.known()[*place].is_unassigned() && self.has_room(*id, *place).is_some() {
                let kind = match self.known()[*place].membership {
                    Membership::Discarded => EventKind::TakenBack,
                    _ => EventKind::Joined,
                };
                self.events.push(Event::of_track(kind, self.track(*place), Some(*id)));
                self.receive(*place, *id);
            }
        }
        self.room.candidates = candidates;
    }

    /// Every unassigned target with every group that may reach it, the nearest first.
    fn candidates(&mut self) -> Vec<(f64, usize, GroupId)> {
        let Room { centres, candidates, .. } = &mut *self.room;
        let (memberships, mut candidates) = (&*self.memberships, core::mem::take(candidates));
        centres.clear();
        for id in memberships.groups().iter().filter(|id| self.agenda.winding_up != Some(**id)) {
            let centre = WantedCentre::of(self.params.group.centre, memberships.known(), memberships.of(*id));
            centres.extend(centre.map(|centre| (*id, centre)));
        }
        let (reach_m, limit_m_s) = (self.params.group.reach_m(), self.params.uav.speed_max_m_s());
        candidates.clear();
        for (place, target) in memberships.known().iter().enumerate().filter(|(_, target)| target.is_unassigned()) {
            if target.speed_m_s() > limit_m_s {
                continue;
            }
            for (id, centre) in &*centres {
                let reach_m = centre.reach_m(reach_m);
                let squared_m2 = target.position().squared_distance_m2(centre.state.position());
                if squared_m2 <= reach_m * reach_m && !target.is_barred_from(*id, self.now) {
                    candidates.push((squared_m2, place, *id));
                }
            }
        }
        candidates.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        candidates
    }

    /// A group takes a target in that nobody passes to it. A member is in view; until then the orbit only makes room for
    /// it, if there is a dwell.
    fn receive(&mut self, place: usize, id: GroupId) {
        let at_once = self.params.group.dwell_max_s <= 0.0 || self.is_held_by(place, id);
        let (requested_at, dwell) = (self.now, Duration::ZERO);
        let membership = match at_once {
            true => Membership::Member(id),
            false => Membership::Dwell(Handoff { from: None, to: id, requested_at, dwell }),
        };
        self.memberships.set(place, membership);
    }

    /// What the group's orbit needs with a further target, if it has room for it to spare, or loses nothing by it: the
    /// smallest circle stays as it is if another target is inside.
    fn has_room(&self, id: GroupId, further: usize) -> Option<RequiredOrbit> {
        let params = &self.params.group;
        let required = self.required(self.members(id).chain([further]))?;
        let is_inside = || {
            let now = self.required_by(id).map_or(0.0, |now| now.standoff.unclamped_m);
            params.centre == CentreEstimate::SmallestCircle && required.standoff.unclamped_m <= now * (1.0 + 1e-9)
        };
        (required.leaves_room(params) || is_inside()).then_some(required)
    }

    /// Who goes first of targets that one orbit cannot hold.
    fn whom_to_let_go(&self, places: impl Iterator<Item = usize> + Clone, required: &RequiredOrbit) -> usize {
        let furthest = required.furthest;
        if self.params.group.discard == Discard::Furthest {
            return furthest;
        }
        let needed_m = |without: usize| {
            let rest = self.required(places.clone().filter(|place| *place != without));
            rest.map_or(0.0, |rest| rest.standoff.unclamped_m)
        };
        // Without anybody else the circle stays as it is.
        let circle = SmallestCircle::of(places.clone().map(|place| self.known()[place].position()));
        let on_rim = circle.iter().flat_map(SmallestCircle::rim).filter_map(|number| places.clone().nth(number));
        let tried = on_rim.map(|place| (needed_m(place), place));
        // Less by more than rounding.
        tried
            .fold((needed_m(furthest), furthest), |least, one| if one.0 < least.0 * (1.0 - 1e-9) { one } else { least })
            .1
    }

    /// Removes the furthest target of every group whose orbit runs away, and of every group until its orbit fits.
    ///
    /// Implements section IV.B.2 and section IV.B.2, convergence rule.
    fn discard(&mut self) {
        let groups = self.groups_now();
        for &id in &groups {
            let limit_m2_s = -self.params.group.convergence_limit_m2_s;
            let diverging = self.last(id).and_then(|group| {
                let threshold_m2_s = group.threshold_m2_s?;
                let required = (group.diverging.s() > self.params.group.convergence_patience_s)
                    .then(|| self.required_by(id))??;
                let whom = || self.whom_to_let_go(self.members(id), &required);
                (required.members() > 1).then(|| (threshold_m2_s, whom()))
            });
            if let Some((threshold_m2_s, whom)) = diverging {
                self.let_go(id, whom, EventKind::DiscardedDiverging { threshold_m2_s, limit_m2_s });
            }
            self.discard_fastest(id);
            if self.surely_fits(id) {
                continue;
            }
            let allowed_m = self.params.group.standoff.radius_max_m;
            while let Some(required) = self.required_by(id).filter(|required| required.members() > 1) {
                let needed_m = required.standoff.unclamped_m;
                if needed_m <= allowed_m {
                    break;
                }
                let whom = self.whom_to_let_go(self.members(id), &required);
                self.let_go(id, whom, EventKind::Discarded { needed_m, allowed_m });
            }
        }
        self.room.groups = groups;
    }

    /// The largest orbit about where the centre was last reaches all members: the smallest circle is no wider. `false` says
    /// nothing; what it says is known without that circle.
    fn surely_fits(&self, id: GroupId) -> bool {
        let (group, Some(last)) = (&self.params.group, self.last(id)) else { return false };
        if group.centre != CentreEstimate::SmallestCircle || group.margin.takes_covariance() {
            return false;
        }
        let centre = last.centre.estimate().state.position();
        let squared_m2 = self.members(id).map(|place| self.known()[place].position().squared_distance_m2(centre));
        let spread = Spread { distance_m: squared_m2.fold(0.0, f64::max).sqrt(), rate_m_s: 0.0 };
        group.standoff.distance(spread, 0.0).unclamped_m < group.standoff.radius_max_m
    }

    /// Removes the fastest target of a group that has outrun the UAVs for too long: the others may be kept.
    ///
    /// Beyond section IV.B.2.
    fn discard_fastest(&mut self, id: GroupId) {
        let outrun = self.last(id).map_or(Duration::ZERO, |group| group.outrun);
        if outrun.s() <= self.params.group.convergence_patience_s || self.members(id).count() < 2 {
            return;
        }
        let speed_m_s = |place: &usize| self.known()[*place].speed_m_s();
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

    /// The orbit that targets in these places would require.
    fn required(&self, places: impl Iterator<Item = usize> + Clone) -> Option<RequiredOrbit> {
        RequiredOrbit::of(self.known(), places, &self.params.group)
    }

    /// The orbit that a group requires.
    fn required_by(&self, id: GroupId) -> Option<RequiredOrbit> {
        self.required(self.members(id))
    }

    /// The places of a group's members.
    fn members(&self, id: GroupId) -> impl Iterator<Item = usize> + Clone {
        self.memberships.of(id)
    }

    /// The group's orbit cannot hold a target. One that is only just being received goes first, if the orbit is smaller
    /// without it; one that is being passed on is passed at once, where orbits take their time only if the other one holds
    /// it already: nobody is a member whom its group does not see.
    fn let_go(&mut self, id: GroupId, whom: usize, kind: EventKind) {
        let needed_m = self.required_by(id).map_or(0.0, |required| required.standoff.unclamped_m);
        let widens = |place: &usize| {
            let others = self.members(id).filter(|other| other != place);
            self.required(others).is_none_or(|required| required.standoff.unclamped_m < needed_m)
        };
        let is_incoming = |place: &usize| self.known()[*place].receiving_group() == Some(id);
        let incoming = self.members(id).filter(is_incoming).find(widens);
        let is_received = |to| self.params.group.motion.is_at_once() || self.is_held_by(whom, to);
        if let Some(incoming) = incoming.or(Some(whom).filter(is_incoming)) {
            self.withdraw(incoming, WithdrawalReason::ReceivingCannotHold);
        } else if self.known()[whom].receiving_group().is_some_and(is_received) {
            self.complete(whom, CompletionReason::PassingCannotHold);
        } else {
            self.events.push(Event::of_track(kind, self.track(whom), Some(id)));
            self.memberships.set(whom, Membership::Discarded);
        }
    }

    fn tell_of_emptied_groups(&mut self) {
        for group in self.previous {
            let is_its_end =
                |event: &Event| event.group == Some(group.id) && matches!(event.kind, EventKind::GroupDissolved(_));
            if self.memberships.groups().binary_search(&group.id).is_err() && !self.events.iter().any(is_its_end) {
                let reason = match self.agenda.winding_up == Some(group.id) {
                    true => DissolutionReason::NotNeeded,
                    false => DissolutionReason::Empty,
                };
                self.events.push(Event::of_group(EventKind::GroupDissolved(reason), group.id));
            }
        }
    }
}
