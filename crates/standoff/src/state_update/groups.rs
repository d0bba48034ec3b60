//! Groups and their orbits.

use super::StepInput;
use crate::coordination::event::Event;
use crate::coordination::group::Group;
use crate::coordination::memberships::GroupIndex;
use crate::coordination::teammate::Teammate;
use crate::guidance::geofence::{Geofence, ZoneSet};
use crate::guidance::heading::OrbitRelativeState;
use crate::params::{AltitudePolicy, TeamParams};
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
                let altitude_m = free_altitude_m(&self.groups, params);
                let group = Group::create(id, known, self.memberships.of(id), params);
                self.groups.extend(group.map(|group| Group { altitude_m, ..group }));
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
            let assigned_uavs =
                self.teammates.iter().zip(&self.on_orbit).filter(|(teammate, _)| teammate.group == Some(id));
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
        if let Some(first) = self.groups.first() {
            let track_index = |teammate: &Teammate| {
                // The place of a searching UAV is not used.
                let group = teammate.group.and_then(|group| self.group(group)).unwrap_or(first);
                (teammate.state.position, group.orbit(params))
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

/// Lowest altitude that no group uses. Ids ascend, so that existing groups precede new ones.
fn free_altitude_m(groups: &[Group], params: &TeamParams) -> f64 {
    let altitude_m = |step: usize| params.group.altitude_lowest_m + step as f64 * params.group.altitude_step_m;
    if params.group.altitude_policy == AltitudePolicy::Common {
        return altitude_m(0);
    }
    let is_free = |step: &usize| {
        groups.iter().all(|group| group.altitude_m < altitude_m(*step) || group.altitude_m > altitude_m(*step))
    };
    altitude_m((0..).find(is_free).unwrap_or_default())
}
