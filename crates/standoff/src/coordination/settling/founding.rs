//! How groups come into being and end.

use crate::coordination::clustering::{Clusters, group_count};
use crate::coordination::event::{
    CompletionReason, DissolutionReason, Event, EventKind, FoundingReason, WithdrawalReason,
};
use crate::coordination::memberships::{Known, Membership};
use crate::coordination::settling::Settling;
use crate::frame::Position;
use crate::group_id::GroupId;
use crate::team::{GroupCount, Radio};
use crate::time::Duration;

impl Settling<'_> {
    /// Where there were no groups, all targets are clustered.
    ///
    /// Implements Algorithm 1's place in the mission.
    pub(super) fn found_first(&mut self, wanted: usize) {
        self.agenda.next_review = self.now + Duration::from_s(self.params.group.review_period_s);
        let live: Vec<usize> = self.places(|known| !known.track.is_lost());
        let clusters = self.clustered(&live, group_count(self.team.len(), live.len()));
        if self.params.group.count == GroupCount::Needed && !self.all_are_held(&live, &clusters) {
            while self.groups() < wanted && self.found_another() {}
            return;
        }
        // Groups are numbered by their first target.
        let mut ids: Vec<(usize, GroupId)> = Vec::new();
        for (cluster, place) in clusters.iter().zip(&live) {
            let id = match ids.iter().find(|(known, _)| known == cluster) {
                Some((_, id)) => *id,
                None => {
                    let members = clusters.iter().zip(&live).filter(|(of, _)| *of == cluster);
                    let id = self.memberships.new_group(self.now, members.map(|(_, place)| *place));
                    ids.push((*cluster, id));
                    id
                }
            };
            self.memberships.set(*place, Membership::Member(id));
        }
        for (_, id) in ids {
            self.tell_of_founding(id, FoundingReason::First);
        }
    }

    /// One orbit for each cluster has room for all of it.
    fn all_are_held(&self, places: &[usize], clusters: &[usize]) -> bool {
        let of = |cluster| places.iter().zip(clusters).filter(move |(_, of)| **of == cluster).map(|(place, _)| *place);
        let count = clusters.iter().max().map_or(0, |last| last + 1);
        (0..count).all(|cluster| self.required(of(cluster)).is_none_or(|orbit| orbit.leaves_room(&self.params.group)))
    }

    fn tell_of_founding(&mut self, id: GroupId, reason: FoundingReason) {
        let members = self.members(id).count() as u32;
        self.events.push(Event::of_group(EventKind::GroupFounded { members, reason }, id));
    }

    /// Ends the group with the fewest members; of equals the youngest. Where words are lost, those go first that none of
    /// the UAVs that are heard serves: who serves them may only be out of hearing, and keep them.
    pub(super) fn dissolve_smallest(&mut self) {
        let is_kept =
            |id: &GroupId| self.params.radio == Radio::Fallible && self.team.iter().any(|mate| mate.group == Some(*id));
        let size = |id: &&GroupId| (is_kept(id), self.members(**id).count());
        let smallest = self.memberships.groups().iter().rev().min_by_key(size).copied();
        if let Some(id) = smallest {
            self.dissolve(id, DissolutionReason::TooMany);
        }
    }

    fn dissolve(&mut self, id: GroupId, reason: DissolutionReason) {
        self.events.push(Event::of_group(EventKind::GroupDissolved(reason), id));
        for place in 0..self.known().len() {
            match self.known()[place].membership {
                Membership::Member(group) if group == id => {
                    let track = self.track(place);
                    if let DissolutionReason::Merged { into, .. } = reason {
                        self.receive(place, into);
                        let event = Event::of_track(EventKind::Merged, track, Some(id));
                        self.events.push(Event { to: Some(into), ..event });
                    } else {
                        self.memberships.set(place, Membership::Unassigned);
                        let kind = EventKind::LeftOut(WithdrawalReason::GroupEnds);
                        self.events.push(Event::of_track(kind, track, Some(id)));
                    }
                }
                Membership::Dwell(handoff) if handoff.to == id => self.withdraw(place, WithdrawalReason::GroupEnds),
                Membership::Dwell(handoff) if handoff.from == Some(id) => {
                    self.complete(place, CompletionReason::PassingEnds);
                }
                _ => {}
            }
        }
    }

    /// From time to time: a group ends if its UAVs could watch half as many targets again, and two more at least, by
    /// forming a group of its own targets and those unassigned; or any at all, if a neighbour's orbit can hold its own
    /// targets too. Only targets count that its UAVs can have within sensing range soon. Where groups are formed by need,
    /// it must be worth it ([`Self::is_worth_a_group`]); before all that, one that others can hold is wound up: its UAV
    /// watches others; and of groups with the same gain it is the one that is nearest to somebody unwatched.
    pub(super) fn review(&mut self, wanted: usize) {
        let period_s = self.params.group.review_period_s;
        if period_s <= 0.0 || self.now < self.agenda.next_review || self.agenda.winding_up.is_some() {
            return;
        }
        // Where there are UAVs to spare, whoever is unwatched gets them in any case.
        if self.groups() < wanted || !self.known().iter().any(Known::is_unassigned) {
            return;
        }
        self.agenda.next_review = self.now + Duration::from_s(period_s);
        let by_need = self.params.group.count == GroupCount::Needed;
        if by_need && (!self.is_worth_a_group(self.watched_together(Known::is_unassigned).len()) || self.wind_up_one())
        {
            return;
        }
        let mut best: Option<(usize, f64, GroupId, Position, DissolutionReason)> = None;
        for &id in self.memberships.groups() {
            let Some(from) = self.required_by(id).map(|required| required.centre()) else { continue };
            let members = self.members(id).count();
            let into = self.who_could_hold(id);
            let together = self.watched_together(|known| {
                let is_own = into.is_none() && known.membership == Membership::Member(id);
                is_own || (known.is_unassigned() && self.is_soon_seen(known, from))
            });
            let together = together.len();
            let (gain, reason) = match into {
                Some(into) => {
                    let is_worth_it = !by_need || self.is_worth_a_group(together);
                    let reason = DissolutionReason::Merged { into, together: together as u32 };
                    (if is_worth_it { together } else { 0 }, reason)
                }
                None => {
                    let gain = together.saturating_sub(members);
                    let is_worth_it = gain >= 2 && 2 * gain >= members;
                    (if is_worth_it { gain } else { 0 }, DissolutionReason::Outnumbered { together: together as u32 })
                }
            };
            let away_m2 = if by_need { self.away_from_unwatched_m2(from) } else { f64::INFINITY };
            let (most, nearest_m2) = best.map_or((0, f64::INFINITY), |(most, nearest_m2, ..)| (most, nearest_m2));
            if gain > most || (gain > 0 && gain == most && away_m2 < nearest_m2) {
                best = Some((gain, away_m2, id, from, reason));
            }
        }
        if let Some((.., id, from, reason)) = best {
            self.dissolve(id, reason);
            let together = self.watched_together(|known| known.is_unassigned() && self.is_soon_seen(known, from));
            if !together.is_empty() {
                self.found(&together);
            }
        }
    }

    /// So many unwatched targets that one orbit holds are worth a UAV's way from a group that others can hold: two, or a
    /// tenth of all. For one of many a UAV was on its way for as long as it then watched more: with 8 UAVs over 30 cars it
    /// gained nothing and added half to the standoff error.
    fn is_worth_a_group(&self, together: usize) -> bool {
        together >= 2 || 10 * together >= self.live()
    }

    /// How far the nearest target is that is in no group, m2; infinite if there is none.
    pub(super) fn away_from_unwatched_m2(&self, from: Position) -> f64 {
        let unwatched = self.known().iter().filter(|known| known.is_unassigned());
        unwatched.map(|known| known.position().squared_distance_m2(from)).fold(f64::INFINITY, f64::min)
    }

    /// Within sensing range of UAVs about `from` after a while, even if it drives away.
    fn is_soon_seen(&self, known: &Known, from: Position) -> bool {
        let closing_m_s = (self.params.uav.speed_m_s - known.speed_m_s()).max(0.0);
        let reach_m = self.params.track.sensor.sensing_range_m + self.params.group.reach_ahead_s * closing_m_s;
        known.position().squared_distance_m2(from) <= reach_m * reach_m
    }

    /// The first other group whose orbit has room for all members of a group.
    fn who_could_hold(&self, id: GroupId) -> Option<GroupId> {
        self.memberships.groups().iter().copied().filter(|other| *other != id).find(|other| {
            let belongs = |place: &usize| self.known()[*place].membership.groups().any(|group| group == id);
            let of_other = self.members(*other).filter(|place| !belongs(place));
            let both = of_other.chain(self.members(id));
            self.required(both).is_some_and(|required| required.leaves_room(&self.params.group))
        })
    }

    /// The places of the largest number of targets that count which one orbit about one of them could hold. Targets
    /// faster than the UAVs do not count.
    fn watched_together(&self, counts: impl Fn(&Known) -> bool) -> Vec<usize> {
        let (reach_m, limit_m_s) = (self.params.group.reach_m(), self.params.uav.speed_max_m_s());
        let is_near = |a: Position, b: Position| a.squared_distance_m2(b) <= reach_m * reach_m;
        let mut places = self.places(|known| known.speed_m_s() <= limit_m_s && counts(known));
        let positions = self.positions(&places);
        let mut best: Option<(usize, Position)> = None;
        for about in &positions {
            let near = positions.iter().filter(|position| is_near(**position, *about)).count();
            if best.is_none_or(|(most, _)| near > most) {
                best = Some((near, *about));
            }
        }
        places.retain(|place| best.is_some_and(|(_, about)| is_near(self.known()[*place].position(), about)));
        while let Some(required) = self.required(places.iter().copied()) {
            if required.leaves_room(&self.params.group) || places.len() == 1 {
                break;
            }
            let whom = self.whom_to_let_go(places.iter().copied(), &required);
            places.retain(|place| *place != whom);
        }
        places
    }

    /// Founds one more group: of unassigned targets, or else by splitting the most scattered one. `false`: of nothing.
    pub(super) fn found_another(&mut self) -> bool {
        let Some(first) = self.known().iter().position(Known::is_unassigned) else {
            // Where everybody is held, there are as many groups as can have two UAVs each.
            return self.groups() < group_count(self.team.len(), self.live()) && self.split();
        };
        let together = self.watched_together(Known::is_unassigned);
        // Where nobody is slow enough, whoever there is.
        self.found(if together.is_empty() { core::slice::from_ref(&first) } else { &together });
        true
    }

    /// Founds a group of the targets in these places.
    fn found(&mut self, places: &[usize]) {
        let id = self.memberships.new_group(self.now, places.iter().copied());
        for place in places {
            // Where groups are formed by need, their UAVs have yet to come: nobody is watched until then.
            match self.params.group.count {
                GroupCount::Half => self.memberships.set(*place, Membership::Member(id)),
                GroupCount::Needed => self.receive(*place, id),
            }
            self.events.push(Event::of_track(EventKind::Joined, self.track(*place), Some(id)));
        }
        let is_scarce = self.params.group.count == GroupCount::Needed && 2 * self.groups() > self.team.len();
        self.tell_of_founding(id, if is_scarce { FoundingReason::Scarce } else { FoundingReason::Unassigned });
    }

    /// Splits the group with the largest sum of squares in two; the part with more members stays itself.
    fn split(&mut self) -> bool {
        let mut widest: Option<(f64, GroupId, Vec<usize>)> = None;
        for &id in self.memberships.groups() {
            let places = self.settled_members(id);
            let mut together = Clusters::default();
            together.of.resize(places.len(), 0);
            let sum_m2 = together.cost_m2(&self.positions(&places)) * places.len() as f64;
            if places.len() > 1 && widest.as_ref().is_none_or(|(most_m2, ..)| sum_m2 > *most_m2) {
                widest = Some((sum_m2, id, places));
            }
        }
        let Some((_, id, places)) = widest else { return false };
        let clusters = self.clustered(&places, 2);
        let of_second = clusters.iter().filter(|cluster| **cluster == 1).count();
        let leaves = usize::from(2 * of_second <= places.len());
        let leaving = places.iter().zip(&clusters).filter(|(_, cluster)| **cluster == leaves);
        let new = self.memberships.new_group(self.now, leaving.clone().map(|(place, _)| *place));
        for (place, _) in leaving {
            self.memberships.set(*place, Membership::Member(new));
            let event = Event::of_track(EventKind::Regrouped, self.track(*place), Some(id));
            self.events.push(Event { to: Some(new), ..event });
        }
        self.tell_of_founding(new, FoundingReason::Split);
        true
    }

    /// The places of a group's members that are in no dwell.
    fn settled_members(&self, id: GroupId) -> Vec<usize> {
        self.members(id).filter(|place| self.known()[*place].membership == Membership::Member(id)).collect()
    }

    /// The places of the targets for which something holds.
    fn places(&self, holds: impl Fn(&Known) -> bool) -> Vec<usize> {
        (0..self.known().len()).filter(|place| holds(&self.known()[*place])).collect()
    }

    fn positions(&self, places: &[usize]) -> Vec<Position> {
        places.iter().map(|place| self.known()[*place].position()).collect()
    }

    /// Clusters the targets in these places from nothing; the cluster of each.
    fn clustered(&self, places: &[usize], k: usize) -> Vec<usize> {
        let mut clusters = Clusters::default();
        clusters.found(&self.positions(places), k);
        clusters.of
    }
}
