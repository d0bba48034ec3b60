//! Retirement of a group that is not needed: its members are handed off to other groups, each in a dwell.

use crate::coordination::event::{Event, EventKind, HandoffCancelledReason};
use crate::coordination::grouping::Grouping;
use crate::coordination::grouping::create::distance_m2;
use crate::coordination::required_orbit::RequiredOrbit;
use crate::grid::Grid;
use crate::group_id::GroupId;
use crate::time::Duration;

/// Maximum orbit radius of the receiving groups when a group is retired, as a fraction of the largest radius. It is
/// lower than the limit for admissions, so that the group is not created again soon.
pub(super) const FILLED: f64 = 0.85;

impl Grouping<'_> {
    /// Starts to retire a group whose members all fit into other groups: the group nearest to an ungrouped target. It
    /// keeps its members until the others have received them, and admits no targets meanwhile.
    pub(super) fn retire_redundant_group(&mut self) -> bool {
        let (places, ungrouped) = (self.group_places(), self.ungrouped_grid());
        let distance_m2 = |id: &GroupId| {
            self.last(*id)
                .map_or(f64::INFINITY, |group| distance_m2(&ungrouped, group.centre.estimate().state.position()))
        };
        let mut groups: Vec<(f64, GroupId)> =
            self.memberships.groups().iter().map(|id| (distance_m2(id), *id)).collect();
        groups.sort_by(|one, other| one.0.total_cmp(&other.0).then(other.1.cmp(&one.1)));
        let plan =
            groups.iter().map(|(_, id)| id).find_map(|id| Some((*id, self.groups_able_to_hold_each(*id, &places)?)));
        let Some((id, receivers)) = plan else { return false };
        self.state.retiring = Some(id);
        for track_index in 0..self.grouped_track().len() {
            if self.grouped_track()[track_index].receiving_group() == Some(id)
                && self.grouped_track()[track_index].group().is_some()
            {
                self.cancel_handoff(track_index, HandoffCancelledReason::GroupRetired);
            }
        }
        for (track_index, to) in receivers {
            if self.grouped_track()[track_index].group() == Some(id) {
                self.start_handoff(track_index, id, to);
            } else {
                // It is not a member yet, so that no handoff is needed.
                self.admit_into(track_index, to);
                let event = Event::of_track(EventKind::Merged, self.track(track_index), Some(id));
                self.events.push(Event { to_group: Some(to), ..event });
            }
        }
        true
    }

    /// Cancels the retirement of a group that cannot hand off all of its members; the next attempt is at the next
    /// regrouping.
    pub(super) fn continue_retirement(&mut self) {
        if let Some(id) = self.state.retiring {
            let continues = self.members(id).next().is_some()
                && self.members(id).all(|track_index| self.grouped_track()[track_index].home() != Some(id));
            if !continues {
                self.state.retiring = None;
                self.state.next_regrouping = self.now + Duration::from_s(self.params.group.regrouping_period_s);
            }
        }
    }

    /// Receiving group for each member of this group; `None` if the other groups cannot contain all of them together.
    fn groups_able_to_hold_each(&self, id: GroupId, places: &Grid) -> Option<Vec<(usize, GroupId)>> {
        // Targets that other groups receive in addition to their members.
        let mut receivers: Vec<(usize, GroupId)> = Vec::new();
        let mut buffer = Vec::new();
        // A target in handoff from another group can stay there.
        let needs_receiver = |track_index: &usize| {
            let known = &self.grouped_track()[*track_index];
            known.home() == Some(id) && known.group().is_none_or(|group| group == id)
        };
        for track_index in self.members(id).filter(needs_receiver) {
            let mut best: Option<(f64, GroupId)> = None;
            let near = self.groups_near(places, track_index, &mut buffer);
            for other in near.map(|index| &self.memberships.groups()[index]).filter(|other| **other != id) {
                let received = receivers.iter().filter(|(_, to)| to == other).map(|(received, _)| *received);
                let required = self.required(self.members(*other).chain(received).chain([track_index]));
                let roomy = required.filter(|required| self.is_roomy(required));
                let Some(required_radius_m) = roomy.map(|required| required.standoff.unclamped_m) else { continue };
                let is_barred = self.grouped_track()[track_index].is_blocked_from(*other, self.now);
                if !is_barred && best.is_none_or(|(least_m, _)| required_radius_m < least_m) {
                    best = Some((required_radius_m, *other));
                }
            }
            receivers.push((track_index, best?.1));
        }
        Some(receivers)
    }

    fn is_roomy(&self, required: &RequiredOrbit) -> bool {
        let group = &self.params.group;
        required.has_room(group) && required.standoff.unclamped_m <= FILLED * group.standoff.radius_max_m
    }
}
