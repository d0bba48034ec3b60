//! Groups and their orbits.

use super::StepInput;
use crate::coordination::event::Event;
use crate::coordination::group::Group;
use crate::coordination::memberships::GroupIndex;
use crate::coordination::teammate::{Teammate, groups_of};
use crate::guidance::heading::OrbitRelativeState;
use crate::params::{AltitudePolicy, TeamParams};
use crate::safety::geofence::{Geofence, ZoneSet};
use crate::team_state::TeamState;

impl TeamState {
    pub(super) fn form_groups(
        &mut self,
        previous: &TeamState,
        input: &StepInput,
        params: &TeamParams,
        before: &GroupIndex,
    ) {
        self.groups.clear();
        for &id in self.memberships.groups() {
            let known = self.memberships.tracks();
            let Some(old) = previous.group(id) else {
                let group = Group::create(id, known, self.memberships.of(id), params);
                if let Some(group) = group {
                    let altitude_m = free_altitude_m(&self.groups, &group, params);
                    self.groups.push(Group { altitude_m, ..group });
                }
                continue;
            };
            // Copied in place, because a group is a large struct.
            self.groups.extend_from_slice(core::slice::from_ref(old));
            let advanced = self.groups.last_mut().and_then(|group| {
                group.advance(known, before.of(id), self.memberships.of(id), input.transition, params)
            });
            if advanced.is_none() {
                self.groups.pop();
            }
        }
    }

    /// Evaluates how the UAVs of each group follow its orbit; emits alerts for infeasible orbits and for UAVs that are
    /// too close.
    pub(super) fn check_groups(&mut self, previous: &TeamState, params: &TeamParams, geofence: Option<&Geofence>) {
        let mut assigned_uavs = self.assignments.iter().peekable();
        for teammate in &mut self.teammates {
            // A kept assignment may contain UAVs that have left.
            while assigned_uavs.next_if(|assignment| assignment.uav < teammate.uav).is_some() {}
            teammate.group =
                assigned_uavs.next_if(|assignment| assignment.uav == teammate.uav).map(|assignment| assignment.group);
        }
        self.place_on_orbits(params);
        for group in &mut self.groups {
            let id = group.id;
            let assigned_uavs = self.group_uavs.of(id).map(|index| (&self.teammates[index], &self.on_orbit[index]));
            let binding = geofence.map(|geofence| {
                let binding = |(teammate, _): (&Teammate, _)| {
                    geofence.binding(params.altitudes_m(teammate.uav, teammate.state.vertical))
                };
                let of_uavs = assigned_uavs.clone().map(binding).reduce(ZoneSet::union);
                (geofence, of_uavs.unwrap_or_else(|| geofence.binding([params.limit_altitude_m(group.altitude_m); 2])))
            });
            let assigned_uavs = assigned_uavs.map(|(teammate, on_orbit)| (teammate.state.position, on_orbit));
            group.check(assigned_uavs, self.time - previous.time, params);
            let kinds = group.alarm(&params.group, binding);
            self.events.extend(kinds.into_iter().flatten().map(|kind| Event::of_group(kind, id)));
        }
    }

    /// Computes the place of each UAV on its group's orbit.
    fn place_on_orbits(&mut self, params: &TeamParams) {
        let mut on_orbit = core::mem::take(&mut self.on_orbit);
        on_orbit.clear();
        self.group_uavs.fill([]);
        if let Some(first) = self.groups.first() {
            self.group_uavs.fill(groups_of(&self.teammates));
            let track_index = |teammate: &Teammate| {
                // The place of a searching UAV is not used.
                let group = teammate.group.and_then(|group| self.group(group)).unwrap_or(first);
                (teammate.state.position, group.orbit())
            };
            // In batches of two (SIMD); a single last UAV is processed twice.
            for pair in self.teammates.chunks(2) {
                let both =
                    OrbitRelativeState::each(&params.guidance, [&pair[0], &pair[pair.len() - 1]].map(track_index));
                on_orbit.extend(both.into_iter().take(pair.len()));
            }
        }
        self.on_orbit = on_orbit;
    }
}

/// Lowest altitude that no group uses. Ids ascend, so that existing groups precede new ones. If the altitudes within the
/// limits do not suffice, several groups share one: the new group gets the altitude at which the nearest group is farthest away.
fn free_altitude_m(groups: &[Group], new: &Group, params: &TeamParams) -> f64 {
    let altitude_m = |step: usize| params.group.altitude_lowest_m + step as f64 * params.group.altitude_step_m;
    if params.group.altitude_policy == AltitudePolicy::Common {
        return altitude_m(0);
    }
    let centre = |group: &Group| group.centre.estimate().state.position();
    // With more groups than steps, one of the steps is free.
    let mut nearest_m2 = vec![f64::INFINITY; groups.len() + 1];
    for group in groups {
        let step = ((group.altitude_m - altitude_m(0)) / params.group.altitude_step_m).round();
        if step >= 0.0
            && let Some(squared_m2) = nearest_m2.get_mut(step as usize)
            && altitude_m(step as usize) == group.altitude_m
        {
            *squared_m2 = squared_m2.min(centre(group).squared_distance_m2(centre(new)));
        }
    }
    let free = nearest_m2.iter().position(|squared_m2| squared_m2.is_infinite()).unwrap_or_default();
    if params.limit_altitude_m(altitude_m(free)) == altitude_m(free) {
        return altitude_m(free);
    }
    let (mut farthest, mut most_m2) = (free, 0.0);
    for (step, squared_m2) in nearest_m2[..free].iter().enumerate() {
        if *squared_m2 > most_m2 && params.limit_altitude_m(altitude_m(step)) == altitude_m(step) {
            (farthest, most_m2) = (step, *squared_m2);
        }
    }
    altitude_m(farthest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordination::memberships::Memberships;
    use crate::frame::Position;
    use crate::group_id::GroupId;
    use crate::message::Cue;
    use crate::params::ClimbParams;
    use crate::time::Time;
    use crate::tracking::track::Track;

    /// Group of one target at `x_m`.
    fn group(x_m: f64, altitude_m: f64, params: &TeamParams) -> Group {
        let cue = Cue::at(0, Position::from_m(x_m, 0.0));
        let mut memberships = Memberships::default();
        memberships.start(Track::from_cue(&cue, &params.track, Time::EPOCH).unwrap());
        let group = Group::create(GroupId(1), memberships.tracks(), [0].into_iter(), params).unwrap();
        Group { altitude_m, ..group }
    }

    /// Three altitudes, of 300 m, 350 m and 400 m.
    #[test]
    fn a_group_gets_a_free_altitude_or_that_of_distant_groups() {
        let mut params = TeamParams::recommended();
        params.uav.climb = Some(ClimbParams { altitude_max_m: 400.0, ..ClimbParams::default() });
        let altitude_m = |groups: &[(f64, f64)], x_m: f64| {
            let groups: Vec<_> = groups.iter().map(|(x_m, altitude_m)| group(*x_m, *altitude_m, &params)).collect();
            free_altitude_m(&groups, &group(x_m, 0.0, &params), &params)
        };
        assert_eq!(altitude_m(&[], 0.0), 300.0);
        assert_eq!(altitude_m(&[(0.0, 300.0), (0.0, 400.0)], 0.0), 350.0);
        let mut groups = vec![(0.0, 300.0), (5000.0, 350.0), (9000.0, 400.0)];
        assert_eq!(altitude_m(&groups, 100.0), 400.0);
        assert_eq!(altitude_m(&groups, 8000.0), 300.0);
        // A second group at an altitude is nearer.
        groups.push((7000.0, 300.0));
        assert_eq!(altitude_m(&groups, 8000.0), 350.0);
    }

    /// Without a limit, no two groups share an altitude.
    #[test]
    fn altitudes_without_limit_are_not_shared() {
        let mut params = TeamParams::recommended();
        params.uav.climb = None;
        let groups: Vec<_> = (0..90).map(|n| group(0.0, 300.0 + 50.0 * f64::from(n), &params)).collect();
        assert_eq!(free_altitude_m(&groups, &groups[0], &params), 4800.0);
    }
}
