//! A small simulated world for tests: targets on straight lines, sensors without noise, an ideal radio.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::allow_attributes,
    clippy::unwrap_used,
    reason = "a module shared by test binaries"
)]

pub mod radio;

use standoff::*;

/// Random number generator for numbers in [-1, 1) (xorshift).
#[derive(Clone)]
pub struct Draw(pub u64);

impl Draw {
    /// Returns the next random number.
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Position and velocity of a target at a time; `None` if the target does not exist at that time.
pub type Motion = fn(u32, Time) -> Option<(Position, Velocity)>;

/// A team of UAVs and its targets.
#[derive(Clone)]
pub struct Team {
    /// The agents, one per UAV.
    pub agents: Vec<Agent>,
    /// States of the UAVs.
    pub states: Vec<UavState>,
    pointing_target: Vec<Option<PointingTarget>>,
    commands: Vec<Command>,
    targets: u32,
    cued: Vec<bool>,
    motion: Motion,
    /// UAVs whose sensors and transmitters are off.
    pub silent: Vec<UavId>,
    /// Indices of UAVs whose computers are off.
    pub off: Vec<usize>,
    /// Clock offset of each UAV; only used with a radio.
    pub clock_ahead: Vec<Duration>,
    /// Makes noisy scans without label; `None`: labels, and no noise.
    pub unlabelled: Option<Unlabelled>,
}

/// Sensor without identities.
#[derive(Clone, Copy)]
pub struct Unlabelled {
    /// Probability that a target in view is detected.
    pub detection_probability: f64,
    /// Number of false alarms of every scan.
    pub false_alarms: u32,
}

impl Unlabelled {
    /// Removes the labels and some detections, and adds noise and false alarms.
    fn change(&self, detections: &mut Vec<Detection>, boresight: Angle, mut draw: Draw) {
        let sensor = TeamParams::paper().track.sensor;
        // The sum of three uniform numbers is almost normal, with unit variance.
        let normal = |draw: &mut Draw| (0..3).map(|_| draw.next()).sum::<f64>();
        detections.retain(|_| 0.5 * (draw.next() + 1.0) < self.detection_probability);
        for detection in &mut *detections {
            detection.label = None;
            detection.measurement.range_m += sensor.range_sd_m * normal(&mut draw);
            let bearing = detection.measurement.bearing;
            detection.measurement.bearing = bearing + Angle::from_rad(sensor.bearing_sd_rad * normal(&mut draw));
        }
        for _ in 0..self.false_alarms {
            // Uniform over the area.
            let range_m = sensor.sensing_range_m * (0.5 * (draw.next() + 1.0)).sqrt();
            let bearing = boresight + Angle::from_rad(0.5 * sensor.field_of_view_rad * draw.next());
            let measurement = RangeBearingMeasurement { range_m, bearing };
            detections.push(Detection { label: None, measurement, range_rate_m_s: None });
        }
        for index in (1..detections.len()).rev() {
            detections.swap(index, (0.5 * (draw.next() + 1.0) * (index + 1) as f64) as usize);
        }
    }
}

/// Seed of the noise of a scan.
fn scan_seed(tick: i64, uav: u32) -> u64 {
    let mixed = (tick as u64 * 1000 + u64::from(uav) + 1).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
    (mixed ^ mixed >> 32).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1
}

/// A sensor scan: boresight and detections.
pub type OwnedScan = (Option<Angle>, Vec<Detection>);

/// Borrows a scan for the agent.
pub fn scan_of(scan: &OwnedScan) -> Scan<'_> {
    Scan { boresight: scan.0, detections: &scan.1 }
}

/// Runs one time step of an agent: observe, receive, decide.
pub fn step(agent: &mut Agent, now: Time, own: &UavState, scan: Scan, inbox: &[Message]) -> AgentOutput {
    let observation = agent.observe(now, own, Some(scan));
    inbox.iter().for_each(|message| agent.receive(&observation, message));
    agent.decide(&observation)
}

/// Messages that an agent would send after a scan.
pub fn outgoing(agent: &Agent, now: Time, own: &UavState, scan: Scan) -> Vec<Message> {
    let mut agent = agent.clone();
    let observation = agent.observe(now, own, Some(scan));
    agent.outbox(&observation).to_vec()
}

/// The agent's own report after a scan.
pub fn report(agent: &Agent, now: Time, own: &UavState, scan: Scan) -> Option<Report> {
    match outgoing(agent, now, own, scan).into_iter().next() {
        Some(Message::Report(report)) => Some(report),
        _ => None,
    }
}

/// Passes the states and scans of all UAVs, by ascending id, and the cues to a fleet.
pub fn observe_all(
    fleet: &mut TeamAgent,
    now: Time,
    states: &[UavState],
    scans: &[OwnedScan],
    cues: &[Message],
) -> Vec<Observation> {
    let observe = |((id, state), scan)| fleet.observe(now, UavId(id), state, Some(scan_of(scan)));
    let observed: Vec<_> = (0..).zip(states).zip(scans).map(observe).collect();
    for cue in cues.iter().filter(|message| matches!(message, Message::Cue(_))) {
        fleet.receive(&observed[0], cue);
    }
    observed
}

impl Team {
    /// UAVs on a ring of 450 m around the initial position of the targets, with the parameters of Table I.
    pub fn new(uavs: u32, targets: u32) -> Self {
        Self::of(uavs, targets, TeamParams::paper())
    }

    /// Like [`Self::new`] with other parameters.
    pub fn of(uavs: u32, targets: u32, params: TeamParams) -> Self {
        let states = (0..uavs).map(|id| {
            let phase = Angle::from_deg(75.0 * f64::from(id));
            UavState::level_flight(
                Position::ORIGIN + Displacement::from_polar(450.0, phase),
                phase + Angle::from_deg(90.0),
                40.0,
            )
        });
        Self {
            agents: (0..uavs).map(|id| Agent::new(UavId(id), params).unwrap()).collect(),
            states: states.collect(),
            pointing_target: vec![None; uavs as usize],
            commands: vec![Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 }; uavs as usize],
            targets,
            cued: vec![false; targets as usize],
            motion: |id, now| {
                let start = Displacement::from_polar(40.0, Angle::from_rad(1.3 * f64::from(id)));
                let velocity = Velocity::from_m_s(6.0 + 0.1 * f64::from(id), 2.0);
                Some((Position::ORIGIN + start + velocity * now.s(), velocity))
            },
            silent: Vec::new(),
            off: Vec::new(),
            clock_ahead: vec![Duration::ZERO; uavs as usize],
            unlabelled: None,
        }
    }

    /// Replaces the motion of the targets.
    pub fn with_motion(self, motion: Motion) -> Self {
        Self { motion, ..self }
    }

    /// Returns the time, all sensor scans, and all messages: cues of targets that appear, then the messages of all
    /// UAVs.
    pub fn speak(&mut self, tick: i64) -> (Time, Vec<OwnedScan>, Vec<Message>) {
        let (now, mut inbox, scans) = self.look(tick);
        for ((agent, state), scan) in self.agents.iter().zip(&self.states).zip(&scans) {
            if !self.silent.contains(&agent.id()) {
                inbox.extend(outgoing(agent, now, state, scan_of(scan)));
            }
        }
        (now, scans, inbox)
    }

    /// Returns the time, the cues of targets that appear, and all sensor scans.
    fn look(&mut self, tick: i64) -> (Time, Vec<Message>, Vec<OwnedScan>) {
        let now = Time::from_us(tick * 500_000);
        let sensor = TeamParams::paper().track.sensor;
        let mut cues = Vec::new();
        for id in 0..self.targets {
            let Some((position, velocity)) = (self.motion)(id, now).filter(|_| !self.cued[id as usize]) else {
                continue;
            };
            let (position_sd_m, velocity_sd_m_s) = (20.0, 2.0);
            let label = TargetLabel(id);
            cues.push(Message::Cue(Cue {
                source: 0,
                issued_at: now,
                sequence: label.0 as u16,
                label: Some(label).filter(|_| self.unlabelled.is_none()),
                time: now,
                position,
                velocity,
                position_sd_m,
                velocity_sd_m_s,
                priority: None,
            }));
            self.cued[id as usize] = true;
        }
        let scan = |((uav, state), pointing_target): ((u32, &UavState), &Option<PointingTarget>)| {
            let boresight = pointing_target.map(|look| look.boresight(state.position, Duration::from_s(0.5)));
            let mut detections = Vec::new();
            for id in 0..self.targets {
                let Some((position, _)) = (self.motion)(id, now) else { continue };
                if boresight.is_some_and(|boresight| sensor.in_view(state.position, boresight, position)) {
                    let measurement = standoff::sensor::measure(state.position, position);
                    detections.push(Detection { label: Some(TargetLabel(id)), measurement, range_rate_m_s: None });
                }
            }
            if let Some((unlabelled, boresight)) = self.unlabelled.zip(boresight) {
                unlabelled.change(&mut detections, boresight, Draw(scan_seed(tick, uav)));
            }
            (boresight, detections)
        };
        (now, cues, (0..).zip(&self.states).zip(&self.pointing_target).map(scan).collect())
    }

    /// Flies the results of a time step.
    pub fn apply(&mut self, steps: &[AgentOutput], now: Time) {
        for (index, step) in steps.iter().enumerate() {
            (self.commands[index], self.pointing_target[index]) = (step.command, step.pointing_target);
        }
        self.fly(now);
    }

    /// Moves the UAVs by one period under the commands of the last step.
    pub fn fly(&mut self, _now: Time) {
        let uav = TeamParams::paper().uav;
        for (state, command) in self.states.iter_mut().zip(&self.commands) {
            *state = uav.response(Duration::from_s(0.5)).step(state, *command);
        }
    }

    /// Runs one complete time step with an ideal radio.
    pub fn tick(&mut self, tick: i64) {
        let (now, scans, inbox) = self.speak(tick);
        self.decide(now, &scans, &inbox);
    }

    /// Second half of a time step: every agent receives `inbox` and decides, and its UAV flies.
    pub fn decide(&mut self, now: Time, scans: &[OwnedScan], inbox: &[Message]) {
        self.decide_each(now, scans, |_| inbox.to_vec());
    }

    /// Like [`Self::decide`] with a separate inbox for each agent.
    pub fn decide_each(&mut self, now: Time, scans: &[OwnedScan], mut inbox_of: impl FnMut(usize) -> Vec<Message>) {
        for (index, agent) in self.agents.iter_mut().enumerate() {
            let is_silent = self.silent.contains(&agent.id());
            let scan = Some(scan_of(&scans[index])).filter(|_| !is_silent);
            let observation = agent.observe(now, &self.states[index], scan);
            inbox_of(index).iter().for_each(|message| agent.receive(&observation, message));
            let step = agent.decide(&observation);
            self.commands[index] = step.command;
            self.pointing_target[index] = step.pointing_target;
        }
        self.fly(now);
    }
}
