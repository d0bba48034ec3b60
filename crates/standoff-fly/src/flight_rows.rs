//! Rows of a time step for the record of a flight: what this aircraft knows. There is no truth.

use std::collections::BTreeMap;

use standoff::{Agent, AgentOutput, Angle, Command, Detection, Time, UavId, UavState};
use standoff_record::agent_rows::{self, AvoidanceEvents, RetransmissionEvents};
use standoff_record::{EventRow, Frame, NO_TARGET, ReportedState, TrackRow, UavRow};

use crate::authority::State;

/// Number of time steps after which a track that has ended is forgotten. Events of a track follow its end by less.
const KEPT_STEPS: u64 = 2_000;

/// A track over time: true and its id without label, or false and its label.
type TrackKey = (bool, u64);

/// What is remembered from one time step to the next.
#[derive(Debug, Clone, Default)]
pub(crate) struct FlightRows {
    /// Key in the record, and last time step, of each track.
    keys: BTreeMap<TrackKey, (u32, u64)>,
    /// Number of tracks so far.
    count: u32,
    /// Number of time steps so far.
    steps: u64,
    avoidance: AvoidanceEvents,
    retransmission: RetransmissionEvents,
    is_engaged: bool,
}

/// What this aircraft observed in a time step.
#[derive(Debug, Clone)]
pub(crate) struct Observed {
    /// The team's time.
    pub(crate) at: Time,
    pub(crate) own: UavState,
    pub(crate) boresight: Option<Angle>,
    pub(crate) detections: Vec<Detection>,
}

impl FlightRows {
    /// Returns the rows of a time step after the decision. The time is that of the team.
    pub(crate) fn frame(&mut self, seen: &Observed, agent: &Agent, output: &AgentOutput, state: State) -> Frame {
        self.steps += 1;
        let mut frame = Frame { time_us: seen.at.us(), ..Frame::default() };
        frame.uavs.push(agent_rows::uav(agent.id(), (&seen.own, None, None), seen.boresight, output));
        let team_state = agent.team_state();
        let others = team_state.teammates.iter().filter(|teammate| teammate.uav != agent.id());
        frame.uavs.extend(others.map(|teammate| {
            let group = teammate.group.and_then(|group| team_state.group_number(group));
            UavRow { group, ..teammate_row(teammate.uav, &teammate.state, teammate.boresight) }
        }));
        frame.uavs.sort_by_key(|row| row.uav);
        let Frame { tracks, tentative, groups, events, .. } = &mut frame;
        agent_rows::agent(agent, &mut ReportedState { tracks, tentative, groups, events });
        self.name(&mut frame);
        let detected = seen.detections.iter().map(|detection| {
            let key = detection.label.map(|label| (false, u64::from(label.0)));
            let target = key.and_then(|key| self.keys.get(&key)).map(|(key, _)| *key);
            agent_rows::detection(agent.id(), detection, target)
        });
        frame.detections.extend(detected);
        self.add_own_events(&mut frame, seen.at, (agent, output), state);
        frame
    }

    /// Gives all tracks and events the keys of tracks of no target. `track` keeps the label.
    fn name(&mut self, frame: &mut Frame) {
        for row in &mut frame.tracks {
            row.target = self.key(key_of(row));
            if row.track_uid.is_some() {
                row.track = row.target;
            }
        }
        frame.tracks.sort_by_key(|row| row.target);
        for event in &mut frame.events {
            let key = match (event.track_uid, event.track) {
                (Some(uid), _) => (true, uid),
                (None, Some(label)) => (false, label.into()),
                (None, None) => continue,
            };
            let key = self.key(key);
            event.target = event.target.and(Some(key));
            if event.track_uid.is_some() {
                event.track = Some(key);
            }
        }
        let steps = self.steps;
        self.keys.retain(|_, (_, step)| *step + KEPT_STEPS > steps);
    }

    fn key(&mut self, track: TrackKey) -> u32 {
        let Self { keys, count, steps, .. } = self;
        let (key, step) = keys.entry(track).or_insert_with(|| {
            let key = NO_TARGET + (*count).min(NO_TARGET - 1);
            *count = count.saturating_add(1);
            (key, *steps)
        });
        *step = *steps;
        *key
    }

    /// Adds the events of the avoidance and the retransmission, and those of the start and the end of the commands.
    fn add_own_events(&mut self, frame: &mut Frame, now: Time, (agent, output): (&Agent, &AgentOutput), state: State) {
        let uav = agent.id();
        self.retransmission.add(now, uav, agent.is_retransmission_limited(), &mut frame.events);
        self.avoidance.add(now, uav, output.diagnostics.avoiding.as_ref(), &mut frame.events);
        let is_engaged = state == State::Engaged;
        if is_engaged != self.is_engaged {
            self.is_engaged = is_engaged;
            let (kind, reason) = match state {
                State::Engaged => ("commands-started", "the autopilot has accepted the first command".to_owned()),
                State::Stopped { reason, .. } => ("commands-ended", reason.to_string()),
                _ => ("commands-ended", "the pilot or the autopilot has taken over".to_owned()),
            };
            frame.events.push(EventRow { kind: kind.to_owned(), reason, uavs: vec![uav.0], ..EventRow::default() });
        }
    }
}

/// Row of a teammate. Its commands are not known; those of its last motion take their place.
fn teammate_row(uav: UavId, state: &UavState, boresight: Option<Angle>) -> UavRow {
    let command = Command { speed_m_s: state.speed_m_s, turn_rate_rad_s: state.turn_rate_rad_s };
    agent_rows::uav(uav, (state, None, None), boresight, &AgentOutput::command_only(command))
}

fn key_of(row: &TrackRow) -> TrackKey {
    row.track_uid.map_or((false, row.track.into()), |uid| (true, uid))
}
