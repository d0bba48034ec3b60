//! A small world for tests: targets on straight lines, sensors without noise, a perfect radio.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::allow_attributes,
    clippy::unwrap_used,
    reason = "a module shared by test binaries"
)]

pub mod radio;

use standoff::*;

/// Numbers in [-1, 1) without a pattern: xorshift.
#[derive(Clone)]
pub struct Draw(pub u64);

impl Draw {
    /// The next one.
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Where a target is at a time, and how it moves; `None`: it is not there.
pub type Motion = fn(u32, Time) -> Option<(Position, Velocity)>;

/// A team of UAVs and the targets below it.
#[derive(Clone)]
pub struct Team {
    /// The brains.
    pub agents: Vec<Agent>,
    /// The UAVs.
    pub states: Vec<UavState>,
    look_at: Vec<Option<LookAt>>,
    commands: Vec<Command>,
    targets: u32,
    cued: Vec<bool>,
    motion: Motion,
    /// UAVs that are silent: their sensors and transmitters are off.
    pub silent: Vec<UavId>,
    /// The places of UAVs whose computers are off.
    pub off: Vec<usize>,
    /// By how much the clock of each is wrong, where words go over a radio.
    pub clock_ahead: Vec<Duration>,
}

/// What one sensor said: boresight and detections.
pub type OwnedScan = (Option<Angle>, Vec<Detection>);

/// Borrows a scan for the agent.
pub fn scan_of(scan: &OwnedScan) -> Scan<'_> {
    Scan { boresight: scan.0, detections: &scan.1 }
}

/// A whole instant of an agent: observed, heard, decided.
pub fn step(agent: &mut Agent, now: Time, own: &UavState, scan: Scan, inbox: &[Message]) -> Step {
    let observation = agent.observe(now, own, Some(scan));
    inbox.iter().for_each(|message| agent.hear(&observation, message));
    agent.decide(&observation)
}

/// All that an agent would say of a scan.
pub fn said(agent: &Agent, now: Time, own: &UavState, scan: Scan) -> Vec<Message> {
    let mut agent = agent.clone();
    let observation = agent.observe(now, own, Some(scan));
    agent.outbox(&observation).to_vec()
}

/// The agent's own report of a scan.
pub fn report(agent: &Agent, now: Time, own: &UavState, scan: Scan) -> Option<Report> {
    match said(agent, now, own, scan).into_iter().next() {
        Some(Message::Report(report)) => Some(report),
        _ => None,
    }
}

/// A fleet takes in where all UAVs are, by ascending id, and what they and others say.
pub fn observe_all(
    fleet: &mut Fleet,
    now: Time,
    states: &[UavState],
    scans: &[OwnedScan],
    cues: &[Message],
) -> Vec<Observation> {
    let observe = |((id, state), scan)| fleet.observe(now, UavId(id), state, Some(scan_of(scan)));
    let observed: Vec<_> = (0..).zip(states).zip(scans).map(observe).collect();
    for cue in cues.iter().filter(|message| matches!(message, Message::Cue(_))) {
        fleet.hear(&observed[0], cue);
    }
    observed
}

impl Team {
    /// UAVs on a ring of 450 m about the targets' start.
    pub fn new(uavs: u32, targets: u32) -> Self {
        Self::of(uavs, targets, TeamParams::table_1())
    }

    /// The same, of other parameters.
    pub fn of(uavs: u32, targets: u32, params: TeamParams) -> Self {
        let states = (0..uavs).map(|id| {
            let phase = Angle::from_deg(75.0 * f64::from(id));
            UavState::straight(
                Position::ORIGIN + Displacement::from_polar(450.0, phase),
                phase + Angle::from_deg(90.0),
                40.0,
            )
        });
        Self {
            agents: (0..uavs).map(|id| Agent::new(UavId(id), params).unwrap()).collect(),
            states: states.collect(),
            look_at: vec![None; uavs as usize],
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
        }
    }

    /// The same with targets that move otherwise.
    pub fn with_motion(self, motion: Motion) -> Self {
        Self { motion, ..self }
    }

    /// The instant, every sensor's scan, and everything said: cues of targets that appear, then what all UAVs say.
    pub fn speak(&mut self, tick: i64) -> (Time, Vec<OwnedScan>, Vec<Message>) {
        let (now, mut inbox, scans) = self.look(tick);
        for ((agent, state), scan) in self.agents.iter().zip(&self.states).zip(&scans) {
            if !self.silent.contains(&agent.id()) {
                inbox.extend(said(agent, now, state, scan_of(scan)));
            }
        }
        (now, scans, inbox)
    }

    /// The instant, cues of targets that appear, and every sensor's scan.
    fn look(&mut self, tick: i64) -> (Time, Vec<Message>, Vec<OwnedScan>) {
        let now = Time::from_us(tick * 500_000);
        let sensor = TeamParams::table_1().track.sensor;
        let mut cues = Vec::new();
        for id in 0..self.targets {
            let Some((position, velocity)) = (self.motion)(id, now).filter(|_| !self.cued[id as usize]) else {
                continue;
            };
            let (position_sd_m, velocity_sd_m_s) = (20.0, 2.0);
            let label = TargetLabel(id);
            cues.push(Message::Cue(Cue {
                searcher: 0,
                said: now,
                number: label.0 as u16,
                label,
                time: now,
                position,
                velocity,
                position_sd_m,
                velocity_sd_m_s,
            }));
            self.cued[id as usize] = true;
        }
        let scan = |(state, look_at): (&UavState, &Option<LookAt>)| {
            let boresight = look_at.map(|look| look.boresight(state.position, Duration::from_s(0.5)));
            let mut detections = Vec::new();
            for id in 0..self.targets {
                let Some((position, _)) = (self.motion)(id, now) else { continue };
                if boresight.is_some_and(|boresight| sensor.in_view(state.position, boresight, position)) {
                    let measurement = sensor::measure(state.position, position);
                    detections.push(Detection { label: TargetLabel(id), measurement });
                }
            }
            (boresight, detections)
        };
        (now, cues, self.states.iter().zip(&self.look_at).map(scan).collect())
    }

    /// Carries the UAVs on by one period under the commands of the last step.
    pub fn fly(&mut self, _now: Time) {
        let uav = TeamParams::table_1().uav;
        for (state, command) in self.states.iter_mut().zip(&self.commands) {
            *state = uav.response(Duration::from_s(0.5)).step(state, *command);
        }
    }

    /// One whole tick.
    pub fn tick(&mut self, tick: i64) {
        let (now, scans, inbox) = self.speak(tick);
        self.decide(now, &scans, &inbox);
    }

    /// What follows once all have spoken: every agent decides, and its UAV flies.
    pub fn decide(&mut self, now: Time, scans: &[OwnedScan], inbox: &[Message]) {
        self.decide_each(now, scans, |_| inbox.to_vec());
    }

    /// The same where each hears what it hears.
    pub fn decide_each(&mut self, now: Time, scans: &[OwnedScan], mut inbox_of: impl FnMut(usize) -> Vec<Message>) {
        for (index, agent) in self.agents.iter_mut().enumerate() {
            let is_silent = self.silent.contains(&agent.id());
            let scan = Some(scan_of(&scans[index])).filter(|_| !is_silent);
            let observation = agent.observe(now, &self.states[index], scan);
            inbox_of(index).iter().for_each(|message| agent.hear(&observation, message));
            let step = agent.decide(&observation);
            self.commands[index] = step.command;
            self.look_at[index] = step.look_at;
        }
        self.fly(now);
    }
}
