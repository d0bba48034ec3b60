//! Radio model: which UAV receives which messages, and when.
//!
//! An ideal radio delivers every message to every other UAV in the same time step. A radio with faults (`[radio]` of
//! the scenario) applies these steps to each message and receiver, in this order:
//!
//! - bandwidth of the sender: messages that exceed the bytes of a time step wait for the next one; at most one second's
//!   worth waits;
//! - link, at the time of sending: in range, on the same side of every partition, not lost;
//! - latency: below a tenth of the period, the message is received in the time step in which it was sent, because
//!   agents wait that long; otherwise in the first time step at or after its arrival. A duplicated message arrives
//!   twice, each time with its own latency.
//!
//! Position reports of aircraft outside the team are treated like cues: they can be lost, late and duplicated, but they
//! are received everywhere.
//!
//! The messages of a time step are received in a fixed order: by sender, with cues last, then by time of sending, then
//! by number. Random draws are keyed by sender, receiver, time step and the number of the message among those of its
//! sender, so that a further UAV or fault does not change the fate of other messages.

use std::collections::VecDeque;
use std::sync::Arc;

use standoff::{Message, Position, Time, UavId};

use crate::random::{Draws, Stream};
use crate::scenario::{self, Scenario, uav_of};

/// Messages that a UAV has sent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SentCounts {
    /// Number of messages.
    pub messages: u64,
    /// Total size, bytes.
    pub bytes: u64,
}

/// Radio state of a UAV at one time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RadioNode {
    pub(crate) position: Position,
    /// True if the transmitter is on.
    pub(crate) transmits: bool,
    /// True if the computer is on, so that the UAV receives.
    pub(crate) receives: bool,
}

/// Sender id of cues and of reports of other aircraft; no UAV of the team has it.
const OUTSIDE: UavId = UavId(0xffff);

/// First message number of aircraft reports; target ids are below it.
const TRAFFIC: u32 = 1 << 31;

/// Carries the messages of a mission; its buffers are reused.
pub(crate) struct Radio {
    /// By UAV.
    nodes: Vec<RadioNode>,
    sent: Vec<SentCounts>,
    /// Only the first `sent_now` entries belong to this time step.
    messages: Vec<(UavId, Message)>,
    sent_now: usize,
    /// Messages from outside the team, each with a number that is unique within the time step: a target id, or
    /// [`TRAFFIC`] and above.
    cues: Vec<(u32, Message)>,
    /// Radio faults; `None` if the radio is ideal.
    faulty: Option<FaultyRadio>,
}

impl Radio {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        Self {
            nodes: Vec::new(),
            sent: Vec::new(),
            messages: Vec::new(),
            sent_now: 0,
            cues: Vec::new(),
            faulty: scenario.radio.as_ref().map(|radio| FaultyRadio::new(radio, scenario)),
        }
    }

    /// Messages that each UAV has sent in this time step, by id.
    pub(crate) fn sent(&self) -> &[SentCounts] {
        &self.sent
    }

    /// Starts a new time step.
    pub(crate) fn open(&mut self) {
        self.nodes.clear();
        self.sent.clear();
        self.sent_now = 0;
        self.cues.clear();
    }

    /// Adds the next UAV, in the order of ids.
    pub(crate) fn join(&mut self, node: RadioNode) {
        self.nodes.push(node);
        self.sent.push(SentCounts::default());
    }

    /// Sends a message of a UAV.
    pub(crate) fn send(&mut self, from: UavId, message: &Message) {
        match self.messages.get_mut(self.sent_now) {
            Some((sender, old)) => {
                *sender = from;
                old.clone_from(message);
            }
            None => self.messages.push((from, message.clone())),
        }
        self.sent_now += 1;
    }

    /// Adds a cue from outside the team.
    pub(crate) fn cue(&mut self, number: u32, message: Message) {
        self.cues.push((number, message));
    }

    /// Adds a position report of an aircraft outside the team.
    pub(crate) fn traffic(&mut self, aircraft: u32, message: Message) {
        self.cues.push((TRAFFIC + aircraft, message));
    }

    /// Delivers the messages that are due in time step `tick` (counted in periods) to every UAV whose computer is on.
    pub(crate) fn carry(&mut self, tick: i64, now: Time, mut hear: impl FnMut(UavId, &Message)) {
        let Self { nodes, sent, messages, sent_now, cues, faulty } = self;
        let messages = &messages[..*sent_now];
        if let Some(faulty) = faulty {
            faulty.carry(&TimeStep { tick, now, nodes, messages, cues }, sent, &mut hear);
            return;
        }
        for (sender, message) in messages {
            if let Some(sent) = sent.get_mut(sender.0 as usize) {
                sent.count(message);
            }
            others(nodes, *sender).filter(|uav| receives(nodes, *uav)).for_each(|uav| hear(uav, message));
        }
        for (_, cue) in &*cues {
            others(nodes, OUTSIDE).filter(|uav| receives(nodes, *uav)).for_each(|uav| hear(uav, cue));
        }
    }
}

impl SentCounts {
    fn count(&mut self, message: &Message) {
        self.messages += 1;
        self.bytes += message.size_bytes() as u64;
    }
}

/// Returns all UAVs except the sender.
fn others(nodes: &[RadioNode], sender: UavId) -> impl Iterator<Item = UavId> {
    (0..).take(nodes.len()).map(UavId).filter(move |uav| *uav != sender)
}

/// Returns whether the computer of a UAV is on.
fn receives(nodes: &[RadioNode], uav: UavId) -> bool {
    nodes.get(uav.0 as usize).is_some_and(|node| node.receives)
}

/// Everything that is sent in one time step.
struct TimeStep<'a> {
    tick: i64,
    now: Time,
    nodes: &'a [RadioNode],
    messages: &'a [(UavId, Message)],
    cues: &'a [(u32, Message)],
}

/// Identity of a message: sender, time step of sending, and number among the sender's messages of that step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    sender: UavId,
    tick: i64,
    number: u32,
}

/// A message that waits or is under way; all copies share it.
struct SentMessage {
    key: Key,
    message: Arc<Message>,
}

/// A message under way to one receiver.
struct InTransit {
    due: i64,
    to: UavId,
    key: Key,
    message: Arc<Message>,
}

/// A transmitter of limited bandwidth.
#[derive(Default)]
struct Transmitter {
    waiting: VecDeque<SentMessage>,
    waiting_bytes: f64,
    /// Bytes that may still be sent in this time step.
    credit_bytes: f64,
}

/// A radio with faults.
struct FaultyRadio {
    radio: scenario::Radio,
    draws: Draws,
    period_us: i64,
    /// By UAV.
    transmitters: Vec<Transmitter>,
    under_way: Vec<InTransit>,
    arrived: Vec<InTransit>,
}

impl FaultyRadio {
    fn new(radio: &scenario::Radio, scenario: &Scenario) -> Self {
        Self {
            radio: radio.clone(),
            draws: Draws::new(scenario.seed),
            period_us: scenario.settings.period.us().max(1),
            transmitters: scenario.uavs.iter().map(|_| Transmitter::default()).collect(),
            under_way: Vec::new(),
            arrived: Vec::new(),
        }
    }

    fn carry(&mut self, step: &TimeStep, sent: &mut [SentCounts], hear: &mut impl FnMut(UavId, &Message)) {
        let TimeStep { tick, nodes, messages, cues, .. } = *step;
        for ((node, id), sent) in nodes.iter().zip(0..).zip(sent) {
            let sender = UavId(id);
            let own = messages.iter().filter(|(by, _)| *by == sender).zip(0..);
            let sent_message = own.map(|((_, message), number)| SentMessage {
                key: Key { sender, tick, number },
                message: Arc::new(message.clone()),
            });
            let budget_bytes_per_s = self.radio.bandwidth_bytes_per_s.filter(|_| !self.is_perfect(step.now));
            let per_instant = budget_bytes_per_s.map(|rate| (rate * self.period_us as f64 / 1e6, rate));
            let Some(transmitter) = self.transmitters.get_mut(id as usize) else { continue };
            for sent_message in transmitter.send(node.transmits, per_instant, sent_message) {
                sent.count(&sent_message.message);
                others(nodes, sender).for_each(|to| self.send(step, &sent_message, to));
            }
        }
        for (number, cue) in cues {
            let key = Key { sender: OUTSIDE, tick, number: *number };
            let sent_message = SentMessage { key, message: Arc::new(cue.clone()) };
            others(nodes, OUTSIDE).for_each(|to| self.send(step, &sent_message, to));
        }
        self.arrived.clear();
        self.arrived.extend(self.under_way.extract_if(.., |message| message.due <= tick));
        self.arrived.sort_by_key(|message| (message.to, message.key));
        for InTransit { to, message, .. } in &self.arrived {
            if receives(nodes, *to) {
                hear(*to, message);
            }
        }
    }

    /// Returns whether the faults of the radio itself have ended.
    fn is_perfect(&self, now: Time) -> bool {
        self.radio.fault_until_s.is_some_and(|until_s| now.s() >= until_s)
    }

    /// Sends a message to one receiver, unless the link drops it.
    fn send(&mut self, step: &TimeStep, sent_message: &SentMessage, to: UavId) {
        let TimeStep { tick, now, nodes, .. } = *step;
        let sender = sent_message.key.sender;
        let is_perfect = self.is_perfect(now);
        if sender != OUTSIDE && self.is_partitioned(now, sender, to)
            || !is_perfect && self.is_out_of_range(nodes, sender, to)
        {
            return;
        }
        let draws = self.draws;
        let object = u64::from(sender.0) << 48 | u64::from(to.0) << 32 | u64::from(sent_message.key.number);
        let draw = |stream| draws.at(stream, object, sent_message.key.tick as u64);
        let link = self.radio.link.iter().find(|link| (uav_of(link.from), uav_of(link.to)) == (sender, to));
        let loss = link.and_then(|link| link.packet_loss).or(self.radio.packet_loss).unwrap_or_default();
        let delay_s = link.and_then(|link| link.latency_s).or(self.radio.latency_s).unwrap_or_default();
        let mut lost = draw(Stream::RadioLoss);
        if !is_perfect && loss.draw(&mut lost) > lost.uniform() {
            return;
        }
        let is_double = !is_perfect && self.radio.duplication > draw(Stream::RadioDuplicate).uniform();
        let mut late = draw(Stream::RadioDelay);
        for _ in 0..1 + usize::from(is_double) {
            let delay_s = if is_perfect { 0.0 } else { delay_s.draw(&mut late) };
            let due = tick + self.steps_late(delay_s);
            self.under_way.push(InTransit {
                due,
                to,
                key: sent_message.key,
                message: Arc::clone(&sent_message.message),
            });
        }
    }

    /// Returns whether a partition separates two UAVs: they are on different sides, or one of them is on no side.
    fn is_partitioned(&self, now: Time, from: UavId, to: UavId) -> bool {
        self.radio.partition.iter().any(|partition| {
            let has = |side: &[f64], uav: UavId| side.iter().any(|number| uav_of(*number) == uav);
            let together = || partition.sides.iter().any(|side| has(side, from) && has(side, to));
            (partition.from_s..partition.until_s).contains(&now.s()) && !together()
        })
    }

    /// Returns whether two UAVs are out of range of each other; a sender outside the team never is.
    fn is_out_of_range(&self, nodes: &[RadioNode], from: UavId, to: UavId) -> bool {
        let at = |uav: UavId| nodes.get(uav.0 as usize).map(|node| node.position);
        let Some((range_m, from)) = self.radio.range_m.zip(at(from)) else { return false };
        at(to).is_some_and(|to| from.distance_m(to) > range_m)
    }

    /// Returns the latency in time steps; 0 is the time step in which the message was sent.
    fn steps_late(&self, delay_s: f64) -> i64 {
        let delay_us = (delay_s * 1e6).round() as i64;
        if delay_us * 10 < self.period_us {
            return 0;
        }
        // Both operands are non-negative, so this rounds up.
        delay_us / self.period_us + i64::from(delay_us % self.period_us > 0)
    }
}

impl Transmitter {
    /// Returns the messages to send in a time step. `bytes` holds the bytes that may be sent in this step and the bytes
    /// that may wait; `None` sends everything. A transmitter that is switched off drops the waiting messages.
    fn send(
        &mut self,
        is_on: bool,
        bytes: Option<(f64, f64)>,
        sent_message: impl Iterator<Item = SentMessage>,
    ) -> Vec<SentMessage> {
        if !is_on {
            *self = Self::default();
            return Vec::new();
        }
        let Some((credit_bytes, room_bytes)) = bytes else {
            let waiting = std::mem::take(self).waiting;
            return waiting.into_iter().chain(sent_message).collect();
        };
        // An idle transmitter accumulates no credit.
        let saved_bytes = if self.waiting.is_empty() { 0.0 } else { self.credit_bytes };
        self.credit_bytes = saved_bytes + credit_bytes;
        let mut sent = Vec::new();
        self.send_waiting(&mut sent);
        for sent_message in sent_message {
            let size = sent_message.message.size_bytes() as f64;
            let is_next = self.waiting.is_empty() && size <= self.credit_bytes;
            if is_next || self.waiting_bytes + size <= room_bytes {
                self.waiting_bytes += size;
                self.waiting.push_back(sent_message);
                self.send_waiting(&mut sent);
            }
        }
        sent
    }

    /// Sends waiting messages as long as the credit suffices.
    fn send_waiting(&mut self, sent: &mut Vec<SentMessage>) {
        while let Some(size) = self.waiting.front().map(|sent_message| sent_message.message.size_bytes() as f64)
            && size <= self.credit_bytes
        {
            self.credit_bytes -= size;
            self.waiting_bytes -= size;
            sent.extend(self.waiting.pop_front());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sent_message(number: u32) -> SentMessage {
        let state = standoff::UavState::level_flight(Position::ORIGIN, standoff::Angle::ZERO, 40.0);
        let message = Message::Report(standoff::Report::position_only(UavId(0), Time::EPOCH, state));
        SentMessage { key: Key { sender: UavId(0), tick: 0, number }, message: Arc::new(message) }
    }

    /// A transmitter that was idle for a long time sends no larger burst than any other.
    #[test]
    fn unused_bandwidth_is_not_accumulated() {
        let mut transmitter = Transmitter::default();
        let size = sent_message(0).message.size_bytes() as f64;
        let mut send = |messages: u32| -> Vec<u32> {
            let sent = transmitter.send(true, Some((2.2 * size, 4.4 * size)), (0..messages).map(sent_message));
            sent.iter().map(|sent_message| sent_message.key.number).collect()
        };
        for _ in 0..10 {
            assert_eq!(send(1), [0]);
        }
        // The credit suffices for two messages per step, and the rest of it remains while messages wait.
        assert_eq!(send(4), [0, 1]);
        assert_eq!(send(0), [2, 3]);
        assert_eq!(send(4), [0, 1]);
    }
}
