//! Converts the types of the agents to rows of the record. Truth has no place here: the simulator adds it.

use standoff::coordination::assignment::Assignment;
use standoff::tracking::existence::TentativeTrack;
use standoff::{
    Agent, AgentOutput, AirVelocity, Aircraft, Angle, Avoidance, Detection, Duration, Estimate, Event, EventKind,
    GroupId, GroupRetiredReason, GroupedTrack, Membership, TeamState, Time, TrackId, TrackStatus as Status, UavId,
    UavState, Velocity,
};

use crate::frame::{
    AgentEventRow, AgentRow, ByAgent, DetectionRow, EventRow, GroupRow, MembershipState, NO_TARGET, PerAgentTables,
    ReportedState, TeammateRow, TentativeRow, TrackRow, TrackStatus, UavRow,
};

/// Motion of a UAV relative to the air, and the wind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirState {
    /// Velocity relative to the air.
    pub velocity: AirVelocity,
    /// Velocity of the wind.
    pub wind: Velocity,
}

/// Row of a UAV: its true state, the state that it assumes if that differs, its motion relative to the air if there is
/// wind, and the true direction of its sensor. The bank is missing.
pub fn uav(
    uav: UavId,
    (state, believed, air): (&UavState, Option<&UavState>, Option<&AirState>),
    boresight: Option<Angle>,
    step: &AgentOutput,
) -> UavRow {
    let steering = step.diagnostics.steering.as_ref();
    UavRow {
        uav: uav.0,
        group: step.diagnostics.group_number,
        x_m: state.position.x_m(),
        y_m: state.position.y_m(),
        heading_rad: state.heading.rad(),
        speed_m_s: state.speed_m_s,
        turn_rate_rad_s: state.turn_rate_rad_s,
        boresight_rad: boresight.map(Angle::rad),
        speed_command_m_s: step.command.speed_m_s,
        turn_rate_command_rad_s: step.command.turn_rate_rad_s,
        speed_limited: step.diagnostics.speed_limited,
        turn_rate_limited: step.diagnostics.turn_rate_limited,
        centre_distance_m: steering.map(|steering| steering.centre_distance_m),
        phase_rad: steering.map(|steering| steering.phase.rad()),
        steered_radius_m: steering.map(|steering| steering.steered_radius_m),
        desired_heading_rad: steering.map(|steering| steering.desired_heading.rad()),
        feedforward_rad_s: steering.map(|steering| steering.feedforward_rad_s),
        convergence_threshold_m2_s: steering.map(|steering| steering.convergence_threshold_m2_s),
        centre_too_fast: steering.is_some_and(|steering| steering.centre_too_fast),
        commanded_altitude_m: step.altitude_m,
        altitude_m: state.vertical.map(|vertical| vertical.altitude_m),
        climb_rate_m_s: state.vertical.map(|vertical| vertical.climb_rate_m_s),
        avoided_uav: step.diagnostics.avoiding.and_then(|avoids| uav_of(avoids.aircraft)),
        avoided_intruder: step.diagnostics.avoiding.and_then(|avoids| intruder_of(avoids.aircraft)),
        predicted_distance_m: step
            .diagnostics
            .avoiding
            .map(|avoids| avoids.predicted_distance_m)
            .filter(|metres| metres.is_finite()),
        limiting_zone: step.diagnostics.limiting_zone,
        believed_x_m: believed.map(|state| state.position.x_m()),
        believed_y_m: believed.map(|state| state.position.y_m()),
        believed_heading_rad: believed.map(|state| state.heading.rad()),
        separation_given_up: step.diagnostics.avoiding.is_some_and(|avoids| avoids.is_given_up),
        airspeed_m_s: air.map(|air| air.velocity.airspeed_m_s),
        air_heading_rad: air.map(|air| air.velocity.heading.rad()),
        wind_x_m_s: air.map(|air| air.wind.x_m_s()),
        wind_y_m_s: air.map(|air| air.wind.y_m_s()),
        believed_wind_x_m_s: step.diagnostics.wind.map(|wind| wind.x_m_s()),
        believed_wind_y_m_s: step.diagnostics.wind.map(|wind| wind.y_m_s()),
        bank_rad: None,
        bank_command_rad: None,
    }
}

fn uav_of(aircraft: Aircraft) -> Option<u32> {
    if let Aircraft::Uav(uav) = aircraft { Some(uav.0) } else { None }
}

fn intruder_of(aircraft: Aircraft) -> Option<u32> {
    if let Aircraft::Intruder(intruder) = aircraft { Some(intruder) } else { None }
}

/// Row of a detection, and the target that it is of, if that is known.
pub fn detection(uav: UavId, detection: &Detection, target: Option<u32>) -> DetectionRow {
    DetectionRow {
        uav: uav.0,
        target,
        range_m: detection.measurement.range_m,
        bearing_rad: detection.measurement.bearing.rad(),
        range_rate_m_s: detection.range_rate_m_s,
    }
}

/// Converts an event. If it names no UAV, its UAVs are those assigned to its groups.
fn event(event: &Event, team_state: &TeamState) -> EventRow {
    let is_concerned =
        |assignment: &&Assignment| Some(assignment.group) == event.group || Some(assignment.group) == event.to_group;
    let assigned = || team_state.assignments.iter().filter(is_concerned).map(|assignment| assignment.uav.0).collect();
    let number = |group: GroupId| team_state.group_number(group);
    let mut row = EventRow {
        kind: event.kind.name().to_owned(),
        target: event.track.filter(|track| team_state.track(*track).is_some()).map(number_of),
        track: event.track.map(number_of),
        track_uid: event.track.and_then(uid_of),
        group: event.group.and_then(number),
        to_group: event.to_group.and_then(number),
        group_id: event.group.map(group_uid_of),
        to_group_id: event.to_group.map(group_uid_of),
        uavs: event.uav.map_or_else(assigned, |uav| vec![uav.0]),
        cause: event.kind.cause().map(str::to_owned),
        ..EventRow::default()
    };
    let finite = |value: f64| Some(value).filter(|value| value.is_finite());
    match event.kind {
        EventKind::GroupCreated { members, .. } => row.members = Some(members),
        EventKind::GroupRetired(GroupRetiredReason::Merged { into, coverable_targets: together }) => {
            (row.into_group, row.coverable_targets) = (number(into), Some(together));
        }
        EventKind::GroupRetired(GroupRetiredReason::BetterCoverage { together }) => {
            row.coverable_targets = Some(together)
        }
        EventKind::HandoffStarted { dwell_s } => row.dwell_s = finite(dwell_s),
        EventKind::Removed { required_radius_m, allowed_radius_m }
        | EventKind::OrbitInfeasible { radius_min_m: required_radius_m, radius_max_m: allowed_radius_m } => {
            (row.required_radius_m, row.allowed_radius_m) = (finite(required_radius_m), finite(allowed_radius_m));
        }
        EventKind::RemovedDiverging { threshold_m2_s, limit_m2_s } => {
            (row.threshold_m2_s, row.limit_m2_s) = (finite(threshold_m2_s), finite(limit_m2_s));
        }
        EventKind::RemovedTooFast { speed_m_s, limit_m_s } => {
            (row.speed_m_s, row.limit_m_s) = (finite(speed_m_s), finite(limit_m_s));
        }
        EventKind::OrbitPartlyBlocked { clear_fraction, zone, .. } => {
            (row.clear_fraction, row.zone) = (finite(clear_fraction), Some(zone));
        }
        EventKind::OrbitBlocked { zone, .. } => row.zone = Some(zone),
        EventKind::ProximityAlert { distance_m } => row.distance_m = finite(distance_m),
        _ => {}
    }
    row.reason = row.reason_text();
    row
}

/// Longest pause within one event: what begins again after a shorter pause, such as the avoidance of the same aircraft, is
/// no new event.
const ONE_EVENT: Duration = Duration::from_us(5_000_000);

/// Creates the events of the avoidance of a UAV.
#[derive(Debug, Clone, Copy, Default)]
pub struct AvoidanceEvents {
    /// Aircraft that the UAV avoided last, and when.
    last: Option<(Aircraft, Time)>,
    has_given_up: bool,
}

impl AvoidanceEvents {
    /// Adds an event if the UAV starts to avoid another UAV or an intruder (`avoidance`), and one if it gives up the
    /// minimum separation from it (`separation-given-up`).
    pub fn add(&mut self, now: Time, uav: UavId, avoiding: Option<&Avoidance>, events: &mut Vec<EventRow>) {
        if let Some(avoiding) = avoiding {
            let goes_on = |(from, at): (Aircraft, Time)| from == avoiding.aircraft && now - at <= ONE_EVENT;
            if !self.last.is_some_and(goes_on) {
                events.push(avoidance("avoidance", uav, avoiding));
            }
            if avoiding.is_given_up && !self.has_given_up {
                events.push(avoidance("separation-given-up", uav, avoiding));
            }
            self.last = Some((avoiding.aircraft, now));
        }
        self.has_given_up = avoiding.is_some_and(|avoiding| avoiding.is_given_up);
    }
}

/// Creates the events of the retransmission of a UAV.
#[derive(Debug, Clone, Copy, Default)]
pub struct RetransmissionEvents {
    /// Time at which retransmission was limited last.
    last: Option<Time>,
}

impl RetransmissionEvents {
    /// Adds an event if retransmissions of a UAV begin to wait for their budget (`retransmission-limited`).
    pub fn add(&mut self, now: Time, uav: UavId, is_limited: bool, events: &mut Vec<EventRow>) {
        if !is_limited {
            return;
        }
        if self.last.is_none_or(|last| now - last > ONE_EVENT) {
            let mut row = EventRow { kind: "retransmission-limited".to_owned(), ..EventRow::default() };
            (row.uavs, row.reason) = (vec![uav.0], row.reason_text());
            events.push(row);
        }
        self.last = Some(now);
    }
}

fn avoidance(kind: &str, uav: UavId, avoidance: &Avoidance) -> EventRow {
    let distance_m = Some(avoidance.predicted_distance_m).filter(|metres| metres.is_finite());
    let uavs = std::iter::once(uav.0).chain(uav_of(avoidance.aircraft)).collect();
    let (kind, intruder) = (kind.to_owned(), intruder_of(avoidance.aircraft));
    let mut row = EventRow { kind, uavs, intruder, distance_m, ..EventRow::default() };
    row.reason = row.reason_text();
    row
}

/// Adds the tracks, groups and events of a team state; for controllers that keep the built-in team state.
pub fn team_state(team_state: &TeamState, beliefs: &mut ReportedState) {
    events(team_state, beliefs);
    state(team_state, beliefs);
}

/// Adds the tracks and groups of an agent's team state, and the events that it publishes.
pub fn agent(agent: &Agent, beliefs: &mut ReportedState) {
    agent.published_states().for_each(|(team_state, _)| events(team_state, beliefs));
    state(agent.team_state(), beliefs);
}

/// Adds the rows of one agent of several. The radio fills in the numbers of sent messages.
pub fn own_rows(agent: &Agent, agents: &mut PerAgentTables) {
    let (by, team_state) = (agent.id().0, agent.team_state());
    agents.all.push(AgentRow {
        agent: by,
        committed_us: agent.committed_at().map(Time::us),
        link_degraded: agent.link_is_degraded(),
        sent_messages: 0,
        sent_bytes: 0,
        retransmission_limited: Some(agent.is_retransmission_limited()),
    });
    tracks(team_state, |row| agents.tracks.push(ByAgent { agent: by, row }));
    groups(team_state, |row| agents.groups.push(ByAgent { agent: by, row }));
    for (team_state, provisional) in agent.published_states() {
        let event_time_us = team_state.time.us();
        let row = |of| AgentEventRow { agent: by, event_time_us, provisional, event: event(of, team_state) };
        let rows = team_state.events.iter().map(row);
        agents.events.extend(rows);
    }
    let row = |uav: UavId, status| {
        let group = team_state.group_of(uav).map(|group| group.id);
        TeammateRow {
            agent: by,
            uav: uav.0,
            status,
            last_report_us: agent.last_report_at(uav).map(Time::us),
            group: group.and_then(|group| team_state.group_number(group)),
            group_id: group.map(group_uid_of),
        }
    };
    agents.teammates.extend(agent.teammate_status().map(|(uav, status)| row(uav, Some(status))));
    let never_reported = |assignment: &&Assignment| agent.last_report_at(assignment.uav).is_none();
    agents
        .teammates
        .extend(team_state.assignments.iter().filter(never_reported).map(|assignment| row(assignment.uav, None)));
}

fn events(team_state: &TeamState, beliefs: &mut ReportedState) {
    beliefs.events.extend(team_state.events.iter().map(|of| event(of, team_state)));
}

fn state(team_state: &TeamState, beliefs: &mut ReportedState) {
    tracks(team_state, |row| beliefs.tracks.push(row));
    groups(team_state, |row| beliefs.groups.push(row));
    beliefs.tentative.extend(team_state.tentative_tracks().map(tentative));
    // The low bits of the ids have another order than the ids.
    beliefs.tentative.sort_by_key(|row| row.track_uid);
    beliefs.tentative.dedup_by_key(|row| row.track_uid);
}

fn tracks(team_state: &TeamState, mut put: impl FnMut(TrackRow)) {
    // Not `extend` with a filtered iterator, which would copy the long rows once more.
    for known in team_state.tracks() {
        if let Some(status) = live_status(known) {
            put(track(known, status, team_state));
        }
    }
}

fn tentative(track: TentativeTrack) -> TentativeRow {
    let Estimate { state, covariance } = &track.estimate;
    let (position, velocity, covariance) = (state.position(), state.velocity(), covariance.position());
    TentativeRow {
        track_uid: uid_of(track.id).unwrap_or_default(),
        existence: track.existence,
        x_m: position.x_m(),
        y_m: position.y_m(),
        vx_m_s: velocity.x_m_s(),
        vy_m_s: velocity.y_m_s(),
        var_x_m2: covariance[(0, 0)],
        cov_x_y_m2: covariance[(0, 1)],
        var_y_m2: covariance[(1, 1)],
    }
}

fn groups(team_state: &TeamState, mut put: impl FnMut(GroupRow)) {
    for group in &team_state.groups {
        let centre = group.centre().state;
        put(GroupRow {
            group: team_state.group_number(group.id).unwrap_or_default(),
            members: group.members,
            x_m: centre.position().x_m(),
            y_m: centre.position().y_m(),
            vx_m_s: centre.velocity().x_m_s(),
            vy_m_s: centre.velocity().y_m_s(),
            spread_m: group.spread().distance_m,
            margin_m: group.margin_m(),
            standoff_unclamped_m: group.standoff.unclamped_m,
            standoff_distance_m: group.standoff.distance_m,
            standoff_rate_m_s: group.standoff.rate_m_s,
            turn_limit_m: group.turn_limit_m().is_finite().then_some(group.turn_limit_m()),
            feasible: group.has_feasible_orbit(),
            convergence_threshold_m2_s: group.threshold_m2_s(),
            altitude_m: group.altitude_m,
            nearest_groupmate_m: group.nearest_groupmate_m,
            group_uid: Some(group_uid_of(group.id)),
        });
    }
}

/// Number of a track in the record. Those without label are numbered, and their targets found, later.
fn number_of(track: TrackId) -> u32 {
    track.label().map_or(NO_TARGET, |label| label.0)
}

/// Bits of an id that the record contains. A double holds them exactly: pandas reads integers with nulls as doubles.
const ID_BITS: u64 = (1 << f64::MANTISSA_DIGITS) - 1;

/// Low bits of the id of a track without label.
fn uid_of(track: TrackId) -> Option<u64> {
    track.label().is_none().then_some(track.0 & ID_BITS)
}

/// Low bits of the id of a group. Groups that share them were created at least 38 hours apart.
fn group_uid_of(group: GroupId) -> u64 {
    group.0 & ID_BITS
}

fn live_status(known: &GroupedTrack) -> Option<TrackStatus> {
    match known.track.status {
        Status::Cued => Some(TrackStatus::Cued),
        Status::Updated => Some(TrackStatus::Updated),
        Status::Coasting => Some(TrackStatus::Coasting),
        Status::Lost(_) => None,
    }
}

fn track(known: &GroupedTrack, status: TrackStatus, team_state: &TeamState) -> TrackRow {
    let number = |group: GroupId| team_state.group_number(group);
    let estimate = known.track.estimate();
    TrackRow {
        target: number_of(known.track.id),
        track: number_of(known.track.id),
        track_uid: uid_of(known.track.id),
        status,
        membership: match known.membership {
            Membership::Ungrouped => MembershipState::Ungrouped,
            Membership::Member(_) => MembershipState::Member,
            Membership::InHandoff(_) => MembershipState::InHandoff,
            Membership::Removed => MembershipState::Removed,
        },
        group: known.membership.group().and_then(number),
        receiving_group: known.membership.receiving_group().and_then(number),
        state: estimate.state.0.into(),
        covariance: estimate.covariance.upper_triangle(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubles_hold_the_ids_of_the_record_exactly() {
        for id in [1, u64::MAX, 0x8123_4567_89AB_CDEF, (1 << 53) + 1] {
            let uids = [uid_of(TrackId(id | 1 << 63)).unwrap(), group_uid_of(GroupId(id))];
            assert!(uids.iter().all(|&uid| uid as f64 as u64 == uid && uid % (1 << 16) == id % (1 << 16)), "{id}");
            // The next double is another id.
            assert!(uids.iter().all(|&uid| (uid + 1) as f64 > uid as f64));
        }
        assert_eq!(uid_of(TrackId(7)), None);
    }
}
