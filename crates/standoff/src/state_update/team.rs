//! Team of a time step: the UAVs received within the teammate timeout.

use super::StepInput;
use crate::coordination::event::{Event, EventKind};
use crate::coordination::teammate::Teammate;
use crate::frame::Position;
use crate::message::{TEAM_AREA_M, TEAM_MAX, WRONG_MAX_S};
use crate::params::TeamParams;
use crate::team_state::TeamState;
use crate::time::Duration;
use crate::uav::UavId;

/// Maximum position jump that is accepted as a correction by a UAV's navigation filter, m.
const JUMP_M: f64 = 100.0;

impl TeamState {
    /// Computes the team: all UAVs received within the teammate timeout, with their previous groups. The report of a
    /// UAV whose position is not reachable from its last one is ignored; if the UAV stays there, it counts as new once
    /// the old state has timed out. A new UAV must be within [`TEAM_AREA_M`] of a UAV of the team or, if the team is empty,
    /// of half of the UAVs that report.
    pub(super) fn gather_team(
        &mut self,
        previous: &TeamState,
        input: &StepInput,
        params: &TeamParams,
        implausible: &mut Vec<UavId>,
    ) {
        implausible.clear();
        self.teammates.clear();
        let (lease, speed_m_s) = (params.teammate_timeout(), 2.0 * params.uav.speed_max_m_s());
        let could_be_at = |teammate: &Teammate, position: Position| {
            let reach_m = speed_m_s * (input.now - teammate.last_report_at).s() + JUMP_M;
            position.squared_distance_m2(teammate.last_report.position) <= reach_m * reach_m
        };
        let reports = input.messages.reports();
        let is_near = |one: Position, other: Position| one.squared_distance_m2(other) <= TEAM_AREA_M * TEAM_AREA_M;
        let could_join = |position: Position| match &previous.teammates[..] {
            [] => {
                let near = reports.iter().filter(|report| is_near(position, report.state.position)).count();
                2 * near >= reports.len()
            }
            team => team.iter().any(|teammate| is_near(position, teammate.state.position)),
        };
        let mut room = TEAM_MAX - reports.len();
        let carry_on = |teammates: &[Teammate], team: &mut Vec<Teammate>, room: &mut usize| {
            for teammate in teammates.iter().filter(|teammate| teammate.is_recent(input.now, lease)).take(*room) {
                *room -= 1;
                team.push(teammate.extrapolated(input.now, params.link));
            }
        };
        let mut teammates = &previous.teammates[..];
        for report in reports {
            // Usually no UAV is silent.
            if teammates.first().is_some_and(|teammate| teammate.uav < report.uav) {
                let (silent, others) =
                    teammates.split_at(teammates.partition_point(|teammate| teammate.uav < report.uav));
                carry_on(silent, &mut self.teammates, &mut room);
                teammates = others;
            }
            let last_state = teammates.first().filter(|teammate| teammate.uav == report.uav);
            let is_plausible = match last_state.filter(|teammate| teammate.is_recent(input.now, lease)) {
                Some(teammate) => could_be_at(teammate, report.state.position),
                None => could_join(report.state.position),
            };
            if !is_plausible {
                implausible.push(report.uav);
                room += 1;
                continue;
            }
            teammates = &teammates[usize::from(last_state.is_some())..];
            let starts_tracks_from = match last_state {
                Some(teammate) => teammate.starts_tracks_from,
                None if previous.teammates.is_empty() => input.now,
                None => input.now + Duration::from_s(WRONG_MAX_S),
            };
            let group = last_state.and_then(|teammate| teammate.group);
            self.teammates.push(Teammate::from_report(report, group, starts_tracks_from));
        }
        carry_on(teammates, &mut self.teammates, &mut room);
    }

    /// Emits events for UAVs that left or joined the team, except for the first team.
    pub(super) fn emit_uav_events(&mut self, previous: &TeamState) {
        self.had_team = previous.had_team || !self.teammates.is_empty();
        if self.teammates.iter().map(|teammate| teammate.uav).eq(previous.teammates.iter().map(|teammate| teammate.uav))
        {
            return;
        }
        let event = |kind, group, uav| Event { kind, track: None, group, to_group: None, uav: Some(uav) };
        for Teammate { uav, .. } in &previous.teammates {
            if self.teammate(*uav).is_none() {
                self.events.push(event(EventKind::UavTimeout, previous.assignment_of(*uav), *uav));
            }
        }
        for Teammate { uav, .. } in &self.teammates {
            if previous.had_team && previous.teammate(*uav).is_none() {
                self.events.push(event(EventKind::UavJoined, self.assignment_of(*uav), *uav));
            }
        }
    }
}
