//! From the agents' types to the record's rows.

use standoff::{
    Agent, Aircraft, Angle, Avoidance, Detection, DissolutionReason, Duty, Event, EventKind, GroupId, Known,
    Membership, Picture, Step, Time, TrackStatus as Status, UavId, UavState,
};

use crate::frame::{
    AgentEventRow, AgentRow, Agents, Beliefs, DetectionRow, EventRow, Frame, GroupRow, IntruderRow, OfAgent, Place,
    TeamRow, TrackRow, TrackStatus, TruthRow, UavRow,
};
use crate::intruders::Intruder;
use crate::world::Truth;

/// Makes a frame one that holds the truth of an instant and nothing else yet.
pub(crate) fn begin(now: Time, truth: &[Truth], frame: &mut Frame) {
    let Frame { time_us, uavs, truth: rows, tracks, groups, detections, events, intruders, agents } = frame;
    *time_us = now.us();
    uavs.clear();
    rows.clear();
    tracks.clear();
    groups.clear();
    detections.clear();
    events.clear();
    intruders.clear();
    agents.clear();
    rows.extend(truth.iter().map(|target| {
        let (position, velocity) = (target.state.position(), target.state.velocity());
        let [ax, ay] = target.state.acceleration_m_s2();
        TruthRow {
            target: target.target.0,
            x_m: position.x_m(),
            y_m: position.y_m(),
            vx_m_s: velocity.x_m_s(),
            vy_m_s: velocity.y_m_s(),
            ax_m_s2: target.knows_acceleration.then_some(ax),
            ay_m_s2: target.knows_acceleration.then_some(ay),
        }
    }));
}

pub(crate) fn uav(uav: UavId, state: &UavState, boresight: Option<Angle>, step: &Step) -> UavRow {
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
        steered_distance_m: steering.map(|steering| steering.steered_distance_m),
        desired_heading_rad: steering.map(|steering| steering.desired_heading.rad()),
        feedforward_rad_s: steering.map(|steering| steering.feedforward_rad_s),
        convergence_threshold_m2_s: steering.map(|steering| steering.convergence_threshold_m2_s),
        centre_too_fast: steering.is_some_and(|steering| steering.centre_too_fast),
        altitude_m: step.altitude_m,
        flown_altitude_m: state.vertical.map(|vertical| vertical.altitude_m),
        climb_rate_m_s: state.vertical.map(|vertical| vertical.climb_rate_m_s),
        avoids: step.diagnostics.avoids.and_then(|avoids| uav_of(avoids.from)),
        avoids_intruder: step.diagnostics.avoids.and_then(|avoids| intruder_of(avoids.from)),
        foretold_m: step.diagnostics.avoids.map(|avoids| avoids.foretold_m).filter(|metres| metres.is_finite()),
        border: step.diagnostics.border,
    }
}

fn uav_of(aircraft: Aircraft) -> Option<u32> {
    if let Aircraft::Uav(uav) = aircraft { Some(uav.0) } else { None }
}

fn intruder_of(aircraft: Aircraft) -> Option<u32> {
    if let Aircraft::Intruder(intruder) = aircraft { Some(intruder) } else { None }
}

pub(crate) fn intruder(number: u32, intruder: &Intruder, now: Time) -> IntruderRow {
    let state = &intruder.truth;
    IntruderRow {
        intruder: number,
        x_m: state.position.x_m(),
        y_m: state.position.y_m(),
        heading_rad: state.heading.rad(),
        speed_m_s: state.speed_m_s,
        altitude_m: state.vertical.map(|vertical| vertical.altitude_m),
        told: intruder.tells(now),
    }
}

pub(crate) fn detection(uav: UavId, detection: &Detection) -> DetectionRow {
    DetectionRow {
        uav: uav.0,
        target: detection.label.0,
        range_m: detection.measurement.range_m,
        bearing_rad: detection.measurement.bearing.rad(),
    }
}

/// The UAVs of an event are those of its groups where it names none.
fn event(event: &Event, picture: &Picture) -> EventRow {
    let is_concerned = |duty: &&Duty| Some(duty.group) == event.group || Some(duty.group) == event.to;
    let crew = || picture.crew.iter().filter(is_concerned).map(|duty| duty.uav.0).collect();
    let number = |group: GroupId| picture.number(group);
    let mut row = EventRow {
        kind: event.kind.name().to_owned(),
        target: event.track.and_then(|track| picture.find(track)).map(|known| known.track.label.0),
        track: event.track.map(|track| track.0),
        group: event.group.and_then(number),
        to_group: event.to.and_then(number),
        group_id: event.group.map(|group| group.0),
        to_group_id: event.to.map(|group| group.0),
        uavs: event.uav.map_or_else(crew, |uav| vec![uav.0]),
        cause: event.kind.cause().map(str::to_owned),
        ..EventRow::default()
    };
    let known = |value: f64| Some(value).filter(|value| value.is_finite());
    match event.kind {
        EventKind::GroupFounded { members, .. } => row.members = Some(members),
        EventKind::GroupDissolved(DissolutionReason::Merged { into, together }) => {
            (row.into_group, row.together) = (number(into), Some(together));
        }
        EventKind::GroupDissolved(DissolutionReason::Outnumbered { together }) => row.together = Some(together),
        EventKind::HandoffRequested { dwell_s } => row.dwell_s = known(dwell_s),
        EventKind::Discarded { needed_m, allowed_m }
        | EventKind::OrbitInfeasible { smallest_m: needed_m, largest_m: allowed_m } => {
            (row.needed_m, row.allowed_m) = (known(needed_m), known(allowed_m));
        }
        EventKind::DiscardedDiverging { threshold_m2_s, limit_m2_s } => {
            (row.threshold_m2_s, row.limit_m2_s) = (known(threshold_m2_s), known(limit_m2_s));
        }
        EventKind::DiscardedTooFast { speed_m_s, limit_m_s } => {
            (row.speed_m_s, row.limit_m_s) = (known(speed_m_s), known(limit_m_s));
        }
        EventKind::OrbitCut { clear_fraction, zone, .. } => {
            (row.clear_fraction, row.zone) = (known(clear_fraction), Some(zone));
        }
        EventKind::OrbitBarred { zone, .. } => row.zone = Some(zone),
        EventKind::UavsClose { distance_m } => row.distance_m = known(distance_m),
        _ => {}
    }
    row.reason = row.why();
    row
}

/// A UAV begins to keep away from another one, or from an intruder.
pub(crate) fn avoidance(uav: UavId, avoidance: &Avoidance) -> EventRow {
    let distance_m = Some(avoidance.foretold_m).filter(|metres| metres.is_finite());
    let uavs = std::iter::once(uav.0).chain(uav_of(avoidance.from)).collect();
    let (kind, intruder) = ("avoidance".to_owned(), intruder_of(avoidance.from));
    let mut row = EventRow { kind, uavs, intruder, distance_m, ..EventRow::default() };
    row.reason = row.why();
    row
}

/// Adds what an agent believes and intends, and what happened: for brains in which the product keeps the picture.
pub fn picture(picture: &Picture, beliefs: &mut Beliefs) {
    events(picture, beliefs);
    state(picture, beliefs);
}

/// Adds what an agent believes and intends, and what it tells.
pub fn agent(agent: &Agent, beliefs: &mut Beliefs) {
    agent.told().for_each(|(picture, _)| events(picture, beliefs));
    state(agent.picture(), beliefs);
}

/// Adds what one agent of several believes, and what it tells; what it sent is the radio's to say.
pub(crate) fn own(agent: &Agent, double_counted: Option<bool>, agents: &mut Agents) {
    let (by, picture) = (agent.id().0, agent.picture());
    agents.all.push(AgentRow {
        agent: by,
        committed_us: agent.committed_at().map(Time::us),
        disturbed: agent.is_disturbed(),
        sent_messages: 0,
        sent_bytes: 0,
        double_counted,
    });
    tracks(picture, |row| agents.tracks.push(OfAgent { agent: by, row }));
    groups(picture, |row| agents.groups.push(OfAgent { agent: by, row }));
    for (picture, provisional) in agent.told() {
        let happened_us = picture.time.us();
        let row = |of| AgentEventRow { agent: by, happened_us, provisional, event: event(of, picture) };
        let rows = picture.events.iter().map(row);
        agents.events.extend(rows);
    }
    let row = |uav: UavId, presence| {
        let group = picture.group_of(uav).map(|group| group.id);
        TeamRow {
            agent: by,
            uav: uav.0,
            presence,
            heard_us: agent.heard_at(uav).map(Time::us),
            group: group.and_then(|group| picture.number(group)),
            group_id: group.map(|group| group.0),
        }
    };
    agents.team.extend(agent.presence().map(|(uav, presence)| row(uav, Some(presence))));
    let unheard = |duty: &&Duty| agent.heard_at(duty.uav).is_none();
    agents.team.extend(picture.crew.iter().filter(unheard).map(|duty| row(duty.uav, None)));
}

fn events(picture: &Picture, beliefs: &mut Beliefs) {
    beliefs.events.extend(picture.events.iter().map(|of| event(of, picture)));
}

fn state(picture: &Picture, beliefs: &mut Beliefs) {
    tracks(picture, |row| beliefs.tracks.push(row));
    groups(picture, |row| beliefs.groups.push(row));
}

fn tracks(picture: &Picture, mut put: impl FnMut(TrackRow)) {
    // Not by extending with what is filtered: long rows would be copied once more.
    for known in picture.known() {
        if let Some(status) = live_status(known) {
            put(track(known, status, picture));
        }
    }
}

fn groups(picture: &Picture, mut put: impl FnMut(GroupRow)) {
    for group in &picture.groups {
        let centre = group.centre.estimate().state;
        put(GroupRow {
            group: picture.number(group.id).unwrap_or_default(),
            members: group.members,
            x_m: centre.position().x_m(),
            y_m: centre.position().y_m(),
            vx_m_s: centre.velocity().x_m_s(),
            vy_m_s: centre.velocity().y_m_s(),
            spread_m: group.spread.distance_m,
            margin_m: group.margin_m,
            standoff_unclamped_m: group.standoff.unclamped_m,
            standoff_distance_m: group.standoff.distance_m,
            standoff_rate_m_s: group.standoff.rate_m_s,
            turn_limit_m: group.turn_limit_m.is_finite().then_some(group.turn_limit_m),
            feasible: group.is_feasible(),
            convergence_threshold_m2_s: group.threshold_m2_s,
            altitude_m: group.altitude_m,
            separation_m: group.separation_m,
            id: Some(group.id.0),
        });
    }
}

fn live_status(known: &Known) -> Option<TrackStatus> {
    match known.track.status {
        Status::Cued => Some(TrackStatus::Cued),
        Status::Held => Some(TrackStatus::Held),
        Status::Coasting => Some(TrackStatus::Coasting),
        Status::Lost(_) => None,
    }
}

fn track(known: &Known, status: TrackStatus, picture: &Picture) -> TrackRow {
    let number = |group: GroupId| picture.number(group);
    let estimate = known.track.estimate();
    TrackRow {
        target: known.track.label.0,
        track: known.track.id.0,
        status,
        place: match known.membership {
            Membership::Unassigned => Place::Unassigned,
            Membership::Member(_) => Place::Member,
            Membership::Dwell(_) => Place::Dwell,
            Membership::Discarded => Place::Discarded,
        },
        group: known.group().and_then(number),
        to_group: known.receiving_group().and_then(number),
        state: estimate.state.0.into(),
        covariance: estimate.covariance.upper_triangle(),
    }
}
