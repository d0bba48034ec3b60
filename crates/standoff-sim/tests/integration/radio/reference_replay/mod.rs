//! Reference replay: recomputes the team state of an agent from the messages that its UAV has sent and received, each
//! counted once.
//!
//! The agent keeps a message log, inserts late messages and replays its team states. The reference keeps plain lists,
//! and computes each time step once, when the agent has committed it.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use standoff::{
    Agent, AgentOutput, Angle, AreaOfInterest, Cue, Detection, Displacement, Duration, Geofence, Message, Observation,
    Position, RangeBearingMeasurement, Report, Scan, TargetLabel, TeamAgent, TeamParams, TeamState, Time, UavId,
    UavState, Velocity,
};
use standoff_sim::controller::Controller;
use standoff_sim::run::Mission;
use standoff_sim::scenario::Scenario;

/// Relative tolerance below which a smaller covariance does not count as more information.
const COVARIANCE_TOLERANCE: f64 = 1e-9;

/// Flies a mission with one agent per UAV and compares each committed state with the reference; the UAVs fly as those of
/// the built-in controller.
pub(super) fn compare_while_flying(scenario: &Scenario) -> Comparison {
    let (team, geofence) = (scenario.settings.team, scenario.settings.geofence.clone());
    let areas = scenario.settings.priorities.areas.clone();
    let agent = |uav| (new_agent(uav, team, &geofence, &areas), None);
    let mut controller = ComparedAgents {
        agents: (0..).map(UavId).take(scenario.uavs.len()).map(agent).collect(),
        references: scenario.uavs.iter().map(|_| ReferenceReplay::new(team, geofence.clone(), areas.clone())).collect(),
        comparison: Comparison::default(),
    };
    let mut built_in = Mission::new(scenario).unwrap();
    let mut mission = Mission::with_controller(scenario, &mut controller).unwrap();
    while let Some(frame) = mission.frame() {
        assert_eq!(Some(&frame.uavs), built_in.frame().map(|frame| &frame.uavs));
    }
    controller.comparison
}

fn new_agent(uav: UavId, team: TeamParams, geofence: &Geofence, areas: &[AreaOfInterest]) -> Agent {
    let agent = Agent::new(uav, team).and_then(|agent| agent.with_geofence(geofence.clone()));
    agent.and_then(|agent| agent.with_areas_of_interest(areas.to_vec())).unwrap()
}

/// Numbers of compared states, of those that differ from the reference in at least one bit, and of those that contain
/// more information.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Comparison {
    pub(super) compared: u64,
    pub(super) differ: u64,
    pub(super) double_counted: u64,
}

/// Controller with one agent per UAV and its reference, each by id.
struct ComparedAgents {
    /// Agents with their last observation.
    agents: Vec<(Agent, Option<Observation>)>,
    references: Vec<ReferenceReplay>,
    comparison: Comparison,
}

impl Controller for &mut ComparedAgents {
    fn restart(&mut self, uav: UavId, restart_count: u32) {
        let index = uav.0 as usize;
        let ReferenceReplay { team, geofence, areas, .. } = &self.references[index];
        let new = ReferenceReplay::new(*team, geofence.clone(), areas.clone());
        let agent = new_agent(uav, *team, geofence, areas);
        (self.agents[index], self.references[index]) = ((agent.with_restart_count(restart_count), None), new);
    }

    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        let index = uav.0 as usize;
        let (agent, last) = &mut self.agents[index];
        let observation = last.insert(agent.observe(now, own, scan));
        self.references[index].observe(agent, observation);
    }

    fn outbox(&self, uav: UavId) -> &[Message] {
        let (agent, last) = &self.agents[uav.0 as usize];
        last.as_ref().map_or(&[], |observation| agent.outbox(observation))
    }

    fn receive(&mut self, uav: UavId, message: &Message) {
        let index = uav.0 as usize;
        let (agent, Some(observation)) = &mut self.agents[index] else { return };
        let before = Before::of(agent, message);
        agent.receive(observation, message);
        self.references[index].receive(agent, &before, message);
    }

    fn decide(&mut self, uav: UavId) -> AgentOutput {
        let index = uav.0 as usize;
        let (agent, last) = &mut self.agents[index];
        let output = agent.decide(last.as_ref().unwrap());
        let mut reference = self.references.remove(index);
        reference.compare(agent, &self.references, &mut self.comparison);
        self.references.insert(index, reference);
        output
    }
}

/// Reference replay of one agent.
struct ReferenceReplay {
    team: TeamParams,
    geofence: Geofence,
    areas: Vec<AreaOfInterest>,
    period: Duration,
    /// Number of periods for which an agent keeps messages.
    kept: i64,
    /// Number of periods ahead of its own time for which an agent accepts messages.
    early: i64,
    fleet: TeamAgent,
    /// First time step of the agent, and the last one that it observed.
    began: Option<i64>,
    now: Option<i64>,
    /// Time step of the reference state; `None` before the first one.
    replayed_until: Option<i64>,
    /// True if the agent has adopted a snapshot that no reference replay has reached yet.
    is_lost: bool,
    /// Messages by time step.
    sent: BTreeMap<i64, Row>,
}

/// Messages of one time step.
#[derive(Default)]
struct Row {
    /// The report of each UAV; of several, the one that was sent first.
    reports: BTreeMap<UavId, Report>,
    cues: Vec<Cue>,
}

/// State of an agent before it received a message.
#[derive(PartialEq)]
struct Before {
    committed: Option<Time>,
    /// Digest of the committed state, if the message can change that state.
    digest: Option<u64>,
}

impl Before {
    fn of(agent: &Agent, message: &Message) -> Self {
        let is_snapshot = matches!(message, Message::Snapshot(_));
        let digest = agent.committed().filter(|_| is_snapshot).map(TeamState::digest);
        Self { committed: agent.committed_at(), digest }
    }
}

impl ReferenceReplay {
    fn new(team: TeamParams, geofence: Geofence, areas: Vec<AreaOfInterest>) -> Self {
        let period = Duration::from_s(team.log.period_s);
        let periods = |s: f64| (s / team.log.period_s).ceil() as i64;
        Self {
            team,
            period,
            kept: periods(team.log.message_retention_s) + 2,
            early: periods(team.teammate_timeout_s),
            fleet: TeamAgent::new(team)
                .and_then(|fleet| fleet.with_geofence(geofence.clone())?.with_areas_of_interest(areas.clone()))
                .unwrap(),
            geofence,
            areas,
            began: None,
            now: None,
            replayed_until: None,
            is_lost: false,
            sent: BTreeMap::new(),
        }
    }

    /// Records that the agent has observed a time step.
    fn observe(&mut self, agent: &Agent, observation: &Observation) {
        let Some(step) = self.step(observation.time()) else { return };
        let ahead = |now: i64| step.saturating_sub(now);
        let jumps =
            |now: i64| ahead(now) < 0 || ahead(now).saturating_mul(self.period.us()) > Agent::TIME_JUMP_MAX.us();
        if self.now.is_some_and(jumps) {
            return;
        }
        self.began.get_or_insert(step);
        self.now = Some(step);
        let own = agent.outbox(observation).first();
        if let Some(Message::Report(report)) = own.filter(|_| observation.uav() == agent.id()) {
            self.put(step, report);
        }
        let oldest = step - self.kept;
        self.sent.retain(|step, _| *step >= oldest);
    }

    /// Records that the agent has received a message.
    fn receive(&mut self, agent: &Agent, before: &Before, message: &Message) {
        let (Some(began), Some(now)) = (self.began, self.now) else { return };
        let after = before.committed.and_then(|time| self.step(time)).unwrap_or(began - 1);
        let is_open = |step: &i64| *step > after && *step <= now + self.early;
        match message {
            Message::Report(report) => {
                let Some(step) = self.step(report.time).filter(is_open) else { return };
                // `observe` has stored the agent's own reports since its start.
                if report.uav != agent.id() || step < began {
                    self.put(step, report);
                }
            }
            Message::Cue(cue) => {
                let Some(step) = self.step(cue.issued_at).filter(is_open) else { return };
                let cues = &mut self.sent.entry(step).or_default().cues;
                if !cues.contains(cue) {
                    cues.push(*cue);
                }
            }
            // No other message changes the committed state when it is received.
            Message::Snapshot(_) => self.is_lost |= Before::of(agent, message) != *before,
            // Not part of the team state.
            Message::Traffic(_) => {}
        }
    }

    /// Advances the reference to the agent's committed state, if it has one, and compares the two.
    fn compare(&mut self, agent: &Agent, others: &[Self], comparison: &mut Comparison) {
        let Some((committed, began)) = agent.committed().zip(self.began) else { return };
        let Some(step) = self.step(committed.time) else { return };
        if self.is_lost || self.replayed_until.is_some_and(|replayed| replayed > step) {
            let is_same = |other: &&Self| {
                let team_state = other.fleet.team_state();
                !other.is_lost && team_state.time == committed.time && team_state.digest() == committed.digest()
            };
            let Some(same) = others.iter().find(is_same) else { return };
            (self.fleet, self.replayed_until, self.is_lost) = (same.fleet.clone(), Some(step), false);
        }
        for next in self.replayed_until.map_or(began, |replayed| replayed + 1)..=step {
            self.replay(agent.id(), next);
        }
        self.replayed_until = Some(step);
        let reference = self.fleet.team_state();
        comparison.compared += 1;
        comparison.differ += u64::from(reference.digest() != committed.digest());
        comparison.double_counted += u64::from(holds_more(committed, reference));
    }

    fn replay(&mut self, by: UavId, step: i64) {
        let nowhere = UavState::level_flight(Position::ORIGIN, Angle::ZERO, 0.0);
        // Without a scan, the UAV reports no detections.
        let observation = self.fleet.observe(self.time(step), by, &nowhere, None);
        if let Some(Row { reports, cues }) = self.sent.get(&step) {
            let reports = reports.values().cloned().map(Message::Report);
            let messages = reports.chain(cues.iter().copied().map(Message::Cue));
            messages.for_each(|message| self.fleet.receive(&observation, &message));
        }
        self.fleet.decide(&observation);
    }

    fn put(&mut self, step: i64, report: &Report) {
        let report = Report { time: self.time(step), log_status: None, ..report.clone() };
        match self.sent.entry(step).or_default().reports.entry(report.uav) {
            Entry::Vacant(place) => drop(place.insert(report)),
            Entry::Occupied(mut known) => {
                let order = |report: &Report| (report.restart_count, report.sequence);
                if order(&report) < order(known.get()) {
                    known.insert(report);
                }
            }
        }
    }

    /// Returns the index of the team's time step to which a time belongs: within a tenth of a period.
    fn step(&self, time: Time) -> Option<i64> {
        let period_us = self.period.us().max(1);
        let nearest = (time.us() + period_us / 2).div_euclid(period_us);
        ((time.us() - nearest * period_us).abs() * 10 <= period_us).then_some(nearest)
    }

    fn time(&self, step: i64) -> Time {
        Time::from_us(step * self.period.us())
    }
}

/// Returns whether a team state has more information about some target than another one: a smaller uncertainty
/// ellipsoid.
fn holds_more(team_state: &TeamState, other: &TeamState) -> bool {
    team_state.tracks().iter().filter(|known| !known.track.is_lost()).any(|known| {
        let Some(other) = other.track(known.track.id) else { return true };
        let [covariance, other] = [known, other].map(|known| known.track.estimate().covariance);
        let volume = |covariance: &standoff::Covariance| covariance.matrix().determinant();
        covariance != other && volume(&covariance) < volume(&other) * (1.0 - COVARIANCE_TOLERANCE)
    })
}

/// Runs two agents that track one target, and compares the first with a reference that receives the same messages,
/// except those of time step `withheld`. Returns the comparison up to each time step.
fn compared(withheld: Option<i64>) -> Vec<Comparison> {
    let team = TeamParams::paper();
    let mut agents = [0, 1].map(|uav| Agent::new(UavId(uav), team).unwrap());
    let mut reference = ReferenceReplay::new(team, Geofence::default(), Vec::new());
    let mut comparison = Comparison::default();
    let cue = Message::Cue(Cue {
        source: 0,
        issued_at: Time::EPOCH,
        sequence: 0,
        label: Some(TargetLabel(0)),
        time: Time::EPOCH,
        position: Position::ORIGIN,
        velocity: Velocity::ZERO,
        position_sd_m: 20.0,
        velocity_sd_m_s: 2.0,
        priority: None,
    });
    let look = |step: i64| {
        let now = Time::from_us(step * 500_000);
        let observed = [0, 1].map(|place| {
            let (x_m, bearing) = [(400.0, 180.0), (-400.0, 0.0)][place];
            let position = Position::ORIGIN + Displacement::from_m(x_m, 0.0);
            let own = UavState::level_flight(position, Angle::ZERO, 40.0);
            let measurement = RangeBearingMeasurement { range_m: 400.0, bearing: Angle::from_deg(bearing) };
            let detected = [Detection { label: Some(TargetLabel(0)), measurement, range_rate_m_s: None }];
            let scan = Scan { boresight: Some(measurement.bearing), detections: &detected };
            agents[place].observe(now, &own, Some(scan))
        });
        reference.observe(&agents[0], &observed[0]);
        let sent = [0, 1].map(|place| agents[place].outbox(&observed[place]).to_vec());
        for place in [0, 1] {
            let received = sent[1 - place].iter().chain((step == 0).then_some(&cue));
            for message in received {
                let before = Before::of(&agents[place], message);
                agents[place].receive(&observed[place], message);
                if place == 0 && withheld != Some(step) {
                    reference.receive(&agents[0], &before, message);
                }
            }
            agents[place].decide(&observed[place]);
        }
        reference.compare(&agents[0], &[], &mut comparison);
        comparison
    };
    (0..20).map(look).collect()
}

#[test]
fn a_report_that_counts_twice_is_detected() {
    let whole = compared(None);
    assert!(whole[19].compared >= 8 && whole[19].double_counted == 0, "{whole:?}");
    // If the reference misses one report, the agent counts one report too many.
    let one_more = compared(Some(5));
    assert!(one_more[4].double_counted == 0 && one_more[19].double_counted > 0, "{one_more:?}");
}
