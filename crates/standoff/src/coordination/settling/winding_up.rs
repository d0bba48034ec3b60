//! How a group ends that is not needed: its members pass to others, each in a dwell.

use crate::coordination::event::{Event, EventKind, WithdrawalReason};
use crate::coordination::required_orbit::RequiredOrbit;
use crate::coordination::settling::Settling;
use crate::group_id::GroupId;
use crate::time::Duration;

/// What part of the largest radius others' orbits may need to hold a group that ends for it: less than what they may
/// need to take a target in, so that the group is not founded again soon.
const FILLED: f64 = 0.85;

impl Settling<'_> {
    /// Begins to wind up a group all of whose members others could hold: that which is nearest to somebody unwatched. It
    /// keeps its duty until they do, and takes nobody in meanwhile.
    pub(super) fn wind_up_one(&mut self) -> bool {
        let away_m2 = |id: &GroupId| {
            self.last(*id)
                .map_or(f64::INFINITY, |group| self.away_from_unwatched_m2(group.centre.estimate().state.position()))
        };
        let mut groups: Vec<(f64, GroupId)> = self.memberships.groups().iter().map(|id| (away_m2(id), *id)).collect();
        groups.sort_by(|one, other| one.0.total_cmp(&other.0).then(other.1.cmp(&one.1)));
        let plan = groups.iter().map(|(_, id)| id).find_map(|id| Some((*id, self.who_could_hold_each(*id)?)));
        let Some((id, receivers)) = plan else { return false };
        self.agenda.winding_up = Some(id);
        for place in 0..self.known().len() {
            if self.known()[place].receiving_group() == Some(id) && self.known()[place].group().is_some() {
                self.withdraw(place, WithdrawalReason::GroupEnds);
            }
        }
        for (place, to) in receivers {
            if self.known()[place].group() == Some(id) {
                self.request(place, id, to);
            } else {
                // No member yet: nobody has a duty that could be passed on.
                self.receive(place, to);
                let event = Event::of_track(EventKind::Merged, self.track(place), Some(id));
                self.events.push(Event { to: Some(to), ..event });
            }
        }
        true
    }

    /// A group that could not pass all of its members on stays, at least until the next review.
    pub(super) fn go_on_winding_up(&mut self) {
        if let Some(id) = self.agenda.winding_up {
            let goes_on = self.members(id).next().is_some()
                && self.members(id).all(|place| self.known()[place].home() != Some(id));
            if !goes_on {
                self.agenda.winding_up = None;
                self.agenda.next_review = self.now + Duration::from_s(self.params.group.review_period_s);
            }
        }
    }

    /// Which other group could hold each member that is at home in this one, all together; `None`: not all of them.
    fn who_could_hold_each(&self, id: GroupId) -> Option<Vec<(usize, GroupId)>> {
        let others = self.memberships.groups().iter().filter(|other| **other != id);
        let mut filled: Vec<(GroupId, Vec<usize>)> =
            others.map(|other| (*other, self.members(*other).collect())).collect();
        let mut receivers = Vec::new();
        // Who is on its way here from another group can stay there.
        let has_to_go = |place: &usize| {
            let known = &self.known()[*place];
            known.home() == Some(id) && known.group().is_none_or(|group| group == id)
        };
        for place in self.members(id).filter(has_to_go) {
            let mut best: Option<(f64, usize)> = None;
            for (index, (other, held)) in filled.iter().enumerate() {
                let required = self.required(held.iter().copied().chain([place]));
                let roomy = required.filter(|required| self.is_roomy(required));
                let Some(needed_m) = roomy.map(|required| required.standoff.unclamped_m) else { continue };
                let is_barred = self.known()[place].is_barred_from(*other, self.now);
                if !is_barred && best.is_none_or(|(least_m, _)| needed_m < least_m) {
                    best = Some((needed_m, index));
                }
            }
            let (_, index) = best?;
            filled[index].1.push(place);
            receivers.push((place, filled[index].0));
        }
        Some(receivers)
    }

    fn is_roomy(&self, required: &RequiredOrbit) -> bool {
        let group = &self.params.group;
        required.leaves_room(group) && required.standoff.unclamped_m <= FILLED * group.standoff.radius_max_m
    }
}
