//! Displacement: a target of high priority takes the place of others.

use crate::coordination::event::{Event, EventKind, GroupRetiredReason};
use crate::coordination::grouping::Grouping;
use crate::coordination::grouping::retire::FILLED;
use crate::coordination::memberships::Membership;
use crate::group_id::GroupId;

impl Grouping<'_> {
    /// Assigns a UAV to each ungrouped target whose priority exceeds the total priority of the targets that the UAV then
    /// cannot cover any more, those of the highest priority first. If some members of its group stay together with the
    /// target, the group admits it, and removes the others; otherwise a new group replaces the old one.
    pub(super) fn displace(&mut self) {
        let least = self.grouped_track().iter().filter(|known| known.home().is_some()).map(|known| known.priority);
        let least = least.fold(f64::INFINITY, f64::min);
        let mut ungrouped: Vec<usize> = (0..self.grouped_track().len())
            .filter(|index| {
                let known = &self.grouped_track()[*index];
                known.is_ungrouped() && known.priority > least && known.speed_m_s() <= self.params.uav.speed_max_m_s()
            })
            .collect();
        let priority = |index: &usize| self.grouped_track()[*index].priority;
        ungrouped.sort_by(|a, b| priority(b).total_cmp(&priority(a)));
        for target in ungrouped {
            let gains = self.memberships.groups().iter().filter_map(|id| Some((self.gain(*id, target)?, *id)));
            let best = gains.reduce(|best, one| if one.0.0 > best.0.0 { one } else { best });
            if let Some(((_, kept), id)) = best {
                if kept.len() > 1 {
                    self.events.push(Event::of_track(EventKind::Admitted, self.track(target), Some(id)));
                    self.admit_into(target, id);
                } else {
                    self.retire(id, GroupRetiredReason::BetterCoverage { together: 1 });
                    self.create(&[target]);
                }
            }
        }
    }

    /// Hands off a target of high priority before its group has to remove it, because removed targets are in no group
    /// until another orbit has made room for them.
    pub(super) fn relieve(&mut self) {
        let groups = self.groups_now();
        for &id in &groups {
            let is_leaving = |member: usize| self.grouped_track()[member].receiving_group().is_some_and(|to| to != id);
            let Some(target) = self.target_to_pass_on(id).filter(|_| !self.members(id).any(is_leaving)) else {
                continue;
            };
            let others = self.memberships.groups().iter().filter(|to| **to != id && self.state.retiring != Some(**to));
            let gain = |to: &GroupId| match self.has_room(*to, target) {
                Some(_) => Some(f64::INFINITY),
                None => self.gain(*to, target).map(|(gain, _)| gain),
            };
            let best = others.filter_map(|to| Some((gain(to)?, *to))).reduce(|a, b| if b.0 > a.0 { b } else { a });
            if let Some((_, to)) = best.filter(|_| self.grouped_track()[target].membership == Membership::Member(id)) {
                self.start_handoff(target, id, to);
            }
        }
        self.buffers.groups = groups;
    }

    /// Target that a group should pass on: the next to be removed of those with a priority above 1, if they alone nearly
    /// fill the largest orbit.
    pub(super) fn target_to_pass_on(&self, id: GroupId) -> Option<usize> {
        let high = self.members(id).filter(|member| self.grouped_track()[*member].priority > 1.0);
        let required = self.required(high.clone()).filter(|required| required.members() > 1)?;
        let is_filled = required.standoff.unclamped_m > FILLED * self.params.group.standoff.radius_max_m;
        is_filled.then(|| self.removal_candidate(high, &required, required.standoff.unclamped_m * (1.0 - 1e-9)))
    }

    /// Total priority that a group gains if the target displaces members of lower priority, and the targets that it then
    /// covers; `None` without a gain, or if its UAVs cannot bring the target within sensing range soon.
    pub(super) fn gain(&self, id: GroupId, target: usize) -> Option<(f64, Vec<usize>)> {
        let known = &self.grouped_track()[target];
        if self.members(id).all(|member| self.grouped_track()[member].priority >= known.priority) {
            return None;
        }
        let centre = self.required_by(id)?.centre();
        if self.state.retiring == Some(id)
            || known.is_blocked_from(id, self.now)
            || !self.is_soon_in_view(known, centre)
        {
            return None;
        }
        let limit_m = self.params.group.readmission_radius_fraction * self.params.group.standoff.radius_max_m;
        let mut kept: Vec<usize> = self.members(id).chain([target]).collect();
        while kept.len() > 1
            && let Some(required) = self.required(kept.iter().copied())
            && required.standoff.unclamped_m > limit_m
        {
            let removed = self.removal_candidate(kept.iter().copied(), &required, limit_m);
            kept.retain(|index| *index != removed);
        }
        let gain = self.priority(kept.iter().copied()) - self.priority(self.members(id));
        (kept.contains(&target) && gain > 0.0).then_some((gain, kept))
    }
}
