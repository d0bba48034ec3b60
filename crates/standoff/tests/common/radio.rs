//! A lossy radio for tests: messages are lost, delayed, duplicated and reordered at random, from a seed. Also a
//! reference fleet that receives all messages immediately.

use standoff::*;

use super::{Draw, Team, scan_of};

/// A radio that carries the messages of a team.
#[derive(Clone)]
pub struct Radio {
    draw: Draw,
    /// Packet loss, independent for each receiver; 0 to 1.
    pub loss: f64,
    /// Maximum latency, periods.
    pub late_max: i64,
    /// Fraction of messages that are received twice.
    pub twice: f64,
    /// Blocked links: sender, receiver.
    pub deaf: Vec<(usize, usize)>,
    /// UAVs that receive no cues.
    pub uncued: Vec<usize>,
    /// Messages in transit: time step of arrival, receiver, message.
    in_transit: Vec<(i64, usize, Message)>,
}

impl Radio {
    /// An ideal radio.
    pub fn new(seed: u64) -> Self {
        let draw = Draw(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        Self { draw, loss: 0.0, late_max: 0, twice: 0.0, deaf: Vec::new(), uncued: Vec::new(), in_transit: Vec::new() }
    }

    /// Makes the radio ideal from now on. Messages in transit still arrive.
    pub fn heal(&mut self) {
        (self.loss, self.late_max, self.twice) = (0.0, 0, 0.0);
        self.deaf.clear();
        self.uncued.clear();
    }

    /// Blocks all links between two sides.
    pub fn part(&mut self, one: &[usize], other: &[usize]) {
        let both = one.iter().flat_map(|a| other.iter().flat_map(|b| [(*a, *b), (*b, *a)]));
        self.deaf.extend(both);
    }

    /// Injects a message that no team member has sent.
    pub fn deliver(&mut self, tick: i64, to: usize, message: Message) {
        self.in_transit.push((tick, to, message));
    }

    fn send(&mut self, tick: i64, (from, to): (Option<usize>, usize), message: &Message, is_reliable: bool) {
        let is_blocked = from.is_some_and(|from| self.deaf.contains(&(from, to)));
        if !is_reliable && (is_blocked || self.chance(self.loss)) {
            return;
        }
        for _ in 0..1 + u32::from(self.chance(self.twice)) {
            let latency = if is_reliable { 0 } else { self.pick(self.late_max + 1) };
            self.in_transit.push((tick + latency, to, message.clone()));
        }
    }

    /// Messages that a UAV receives at a time step, in random order.
    fn received(&mut self, tick: i64, by: usize) -> Vec<Message> {
        let arrived = self.in_transit.extract_if(.., |(at, to, _)| *at <= tick && *to == by);
        let mut received: Vec<Message> = arrived.map(|(.., message)| message).collect();
        for index in (1..received.len()).rev() {
            let other = self.pick(index as i64 + 1) as usize;
            received.swap(index, other);
        }
        received
    }

    fn chance(&mut self, probability: f64) -> bool {
        self.draw.next() < 2.0 * probability - 1.0
    }

    /// Random integer from 0 to `below` - 1.
    fn pick(&mut self, below: i64) -> i64 {
        (0.5 * (self.draw.next() + 1.0) * below as f64) as i64
    }
}

impl Team {
    /// Runs one complete time step over a radio, and returns the messages sent and received. Every cue is received
    /// immediately by at least one UAV that is on, because a cue that no UAV receives has no effect. A UAV whose
    /// computer is off flies on with its last command, without sensor and radio.
    pub fn tick_over(&mut self, tick: i64, radio: &mut Radio) -> TickMessages {
        let (now, cues, scans) = self.look(tick);
        let on: Vec<usize> = (0..self.agents.len()).filter(|index| !self.off.contains(index)).collect();
        let mut observed = Vec::new();
        let (mut sent, mut delivered, mut steps) = (Vec::new(), Vec::new(), Vec::new());
        for &index in &on {
            let agent = &mut self.agents[index];
            let scan = Some(scan_of(&scans[index])).filter(|_| !self.silent.contains(&agent.id()));
            let observation = agent.observe(now + self.clock_ahead[index], &self.states[index], scan);
            observed.push((index, observation));
            for message in agent.outbox(&observation) {
                sent.push((Some(index), message.clone()));
                for &to in on.iter().filter(|to| **to != index) {
                    radio.send(tick, (Some(index), to), message, false);
                }
            }
        }
        let cued: Vec<usize> = on.into_iter().filter(|index| !radio.uncued.contains(index)).collect();
        for (number, cue) in cues.iter().enumerate() {
            sent.push((None, cue.clone()));
            cued.iter().for_each(|to| radio.send(tick, (None, *to), cue, *to == cued[number % cued.len()]));
        }
        for (index, observation) in observed {
            for message in radio.received(tick, index) {
                self.agents[index].receive(&observation, &message);
                delivered.push((index, message));
            }
            let step = self.agents[index].decide(&observation);
            (self.commands[index], self.pointing_target[index]) = (step.command, step.pointing_target);
            steps.push((index, step));
        }
        self.fly(now);
        TickMessages { sent, delivered, steps }
    }
}

/// Messages and decisions of one time step.
pub struct TickMessages {
    /// Messages sent, with the index of the sender; `None` for cue sources.
    pub sent: Vec<(Option<usize>, Message)>,
    /// Messages received, with the index of the receiver.
    pub delivered: Vec<(usize, Message)>,
    /// Decisions, with the index of the UAV.
    pub steps: Vec<(usize, AgentOutput)>,
}

/// Reference: the team state of a fleet that receives every message immediately.
pub struct Truth {
    fleet: TeamAgent,
    /// Digest of the team state at each time step.
    digests: Vec<u64>,
}

impl Truth {
    /// Creates the reference for a team with these parameters.
    pub fn new(params: TeamParams) -> Self {
        Self { fleet: TeamAgent::new(params).unwrap(), digests: Vec::new() }
    }

    /// Processes the messages sent at the next time step that belong to that time step.
    pub fn hear(&mut self, now: Time, sent: &[(Option<usize>, Message)]) {
        let any_state = Team::new(1, 0).states[0];
        let observed = self.fleet.observe(now, UavId(0), &any_state, None);
        for (_, message) in sent {
            match message {
                Message::Report(report) if report.time == now => self.fleet.receive(&observed, message),
                Message::Cue(cue) if cue.issued_at == now => self.fleet.receive(&observed, message),
                _ => {}
            }
        }
        let _ = self.fleet.decide(&observed);
        self.digests.push(self.fleet.team_state().digest());
    }

    /// Returns true if a team state equals the reference of its time step, bit for bit.
    pub fn is(&self, team_state: &TeamState) -> bool {
        self.digests[(team_state.time.us() / PERIOD.us()) as usize] == team_state.digest()
    }
}

/// Period of Table I.
pub const PERIOD: Duration = Duration::from_us(500_000);
