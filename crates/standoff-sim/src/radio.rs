//! The radio: what is said at an instant, and who hears it when.
//!
//! A perfect one carries all to all at once. One of a scenario's `[radio]` asks, message by message and receiver by
//! receiver, in this order:
//!
//! - the sender's transmitter: what an instant's bytes do not hold waits for the next one, up to one second's worth;
//! - the way, when it is sent: within range, on one side of a partition, not lost;
//! - the delay: below a tenth of the period it is heard at the instant at which it was sent, for agents wait that long; else
//!   at the first instant at or after its arrival. Some are heard twice, each time with a delay of its own.
//!
//! Aircraft that are not of the team are heard as cues are: lost, late and double alike, and from everywhere.
//!
//! What is heard at an instant is heard in one order: by speaker, cues last, then by when it was said, then by its number.
//! Draws have the speaker, the receiver, the instant and the number of the message among what the speaker said as their
//! key: no further UAV or fault changes what becomes of other messages.

use std::collections::VecDeque;
use std::sync::Arc;

use standoff::{Message, Position, Time, UavId};

use crate::draws::{Draws, Stream};
use crate::scenario::{self, Link, Scenario};

/// What a UAV has sent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sent {
    /// How many messages.
    pub messages: u64,
    /// How many bytes they take.
    pub bytes: u64,
}

/// A UAV as the radio finds it at an instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Station {
    pub(crate) position: Position,
    /// Its transmitter is on.
    pub(crate) speaks: bool,
    /// Its computer is on.
    pub(crate) hears: bool,
}

/// The speaker of cues: nobody of the team.
const OUTSIDE: UavId = UavId(0xffff);

/// Numbers of targets are below this.
const TRAFFIC: u32 = 1 << 31;

/// What carries messages, in room that lives on.
pub(crate) struct Radio {
    /// By UAV.
    stations: Vec<Station>,
    sent: Vec<Sent>,
    /// Of these the first `said` count.
    messages: Vec<(UavId, Message)>,
    said: usize,
    /// What comes from outside, each with a number of its own at an instant: the target's, or one above those.
    cues: Vec<(u32, Message)>,
    /// `None`: it is perfect.
    air: Option<Air>,
}

impl Radio {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        Self {
            stations: Vec::new(),
            sent: Vec::new(),
            messages: Vec::new(),
            said: 0,
            cues: Vec::new(),
            air: scenario.radio.as_ref().map(|radio| Air::new(radio, scenario)),
        }
    }

    /// What each UAV has sent at this instant, by id.
    pub(crate) fn sent(&self) -> &[Sent] {
        &self.sent
    }

    /// Begins an instant.
    pub(crate) fn open(&mut self) {
        self.stations.clear();
        self.sent.clear();
        self.said = 0;
        self.cues.clear();
    }

    /// The next UAV, by id.
    pub(crate) fn join(&mut self, station: Station) {
        self.stations.push(station);
        self.sent.push(Sent::default());
    }

    /// A UAV speaks.
    pub(crate) fn say(&mut self, from: UavId, message: &Message) {
        match self.messages.get_mut(self.said) {
            Some((speaker, old)) => {
                *speaker = from;
                old.clone_from(message);
            }
            None => self.messages.push((from, message.clone())),
        }
        self.said += 1;
    }

    /// A cue comes from outside.
    pub(crate) fn cue(&mut self, number: u32, message: Message) {
        self.cues.push((number, message));
    }

    /// An aircraft that is not of the team tells where it is.
    pub(crate) fn traffic(&mut self, aircraft: u32, message: Message) {
        self.cues.push((TRAFFIC + aircraft, message));
    }

    /// Tells each UAV that hears what it hears at the instant of a number, of those that are a period apart.
    pub(crate) fn carry(&mut self, tick: i64, now: Time, mut hear: impl FnMut(UavId, &Message)) {
        let Self { stations, sent, messages, said, cues, air } = self;
        let messages = &messages[..*said];
        if let Some(air) = air {
            air.carry(&Instant { tick, now, stations, messages, cues }, sent, &mut hear);
            return;
        }
        for (speaker, message) in messages {
            if let Some(sent) = sent.get_mut(speaker.0 as usize) {
                sent.count(message);
            }
            others(stations, *speaker).filter(|uav| hears(stations, *uav)).for_each(|uav| hear(uav, message));
        }
        for (_, cue) in &*cues {
            others(stations, OUTSIDE).filter(|uav| hears(stations, *uav)).for_each(|uav| hear(uav, cue));
        }
    }
}

impl Sent {
    fn count(&mut self, message: &Message) {
        self.messages += 1;
        self.bytes += message.size_bytes() as u64;
    }
}

/// All but a speaker.
fn others(stations: &[Station], speaker: UavId) -> impl Iterator<Item = UavId> {
    (0..).take(stations.len()).map(UavId).filter(move |uav| *uav != speaker)
}

/// A UAV's computer is on.
fn hears(stations: &[Station], uav: UavId) -> bool {
    stations.get(uav.0 as usize).is_some_and(|station| station.hears)
}

/// What there is to carry at an instant.
struct Instant<'a> {
    tick: i64,
    now: Time,
    stations: &'a [Station],
    messages: &'a [(UavId, Message)],
    cues: &'a [(u32, Message)],
}

/// What a message is known by: who said it, at which instant, as the how manieth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    speaker: UavId,
    tick: i64,
    number: u32,
}

/// A message that waits or is under way, in room that is shared by all copies.
struct Said {
    key: Key,
    message: Arc<Message>,
}

/// A message under way to one of its receivers.
struct UnderWay {
    due: i64,
    to: UavId,
    key: Key,
    message: Arc<Message>,
}

/// A transmitter that sends so many bytes a second.
#[derive(Default)]
struct Transmitter {
    waiting: VecDeque<Said>,
    waiting_bytes: f64,
    /// What may be sent at this instant.
    credit_bytes: f64,
}

/// A radio that is not perfect.
struct Air {
    radio: scenario::Radio,
    draws: Draws,
    period_us: i64,
    /// By UAV.
    transmitters: Vec<Transmitter>,
    under_way: Vec<UnderWay>,
    arrived: Vec<UnderWay>,
}

impl Air {
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

    fn carry(&mut self, instant: &Instant, sent: &mut [Sent], hear: &mut impl FnMut(UavId, &Message)) {
        let Instant { tick, stations, messages, cues, .. } = *instant;
        for ((station, id), sent) in stations.iter().zip(0..).zip(sent) {
            let speaker = UavId(id);
            let own = messages.iter().filter(|(by, _)| *by == speaker).zip(0..);
            let said = own.map(|((_, message), number)| Said {
                key: Key { speaker, tick, number },
                message: Arc::new(message.clone()),
            });
            let budget_bytes_per_s = self.radio.bytes_per_s.filter(|_| !self.is_perfect(instant.now));
            let per_instant = budget_bytes_per_s.map(|rate| (rate * self.period_us as f64 / 1e6, rate));
            let Some(transmitter) = self.transmitters.get_mut(id as usize) else { continue };
            for said in transmitter.send(station.speaks, per_instant, said) {
                sent.count(&said.message);
                others(stations, speaker).for_each(|to| self.send(instant, &said, to));
            }
        }
        for (number, cue) in cues {
            let key = Key { speaker: OUTSIDE, tick, number: *number };
            let said = Said { key, message: Arc::new(cue.clone()) };
            others(stations, OUTSIDE).for_each(|to| self.send(instant, &said, to));
        }
        self.arrived.clear();
        self.arrived.extend(self.under_way.extract_if(.., |message| message.due <= tick));
        self.arrived.sort_by_key(|message| (message.to, message.key));
        for UnderWay { to, message, .. } in &self.arrived {
            if hears(stations, *to) {
                hear(*to, message);
            }
        }
    }

    /// Faults of the radio itself are over.
    fn is_perfect(&self, now: Time) -> bool {
        self.radio.until_s.is_some_and(|until_s| now.s() >= until_s)
    }

    /// Sends a message on its way to one of those who may hear it.
    fn send(&mut self, instant: &Instant, said: &Said, to: UavId) {
        let Instant { tick, now, stations, .. } = *instant;
        let speaker = said.key.speaker;
        let is_perfect = self.is_perfect(now);
        if speaker != OUTSIDE && self.is_cut(now, speaker, to) || !is_perfect && self.is_far(stations, speaker, to) {
            return;
        }
        let draws = self.draws;
        let object = u64::from(speaker.0) << 48 | u64::from(to.0) << 32 | u64::from(said.key.number);
        let draw = |stream| draws.at(stream, object, said.key.tick as u64);
        let link = self.radio.links.iter().find(|link| (link.from, link.to) == (speaker, to));
        let (loss, delay_s) =
            link.map_or((self.radio.loss, self.radio.delay_s), |Link { loss, delay_s, .. }| (*loss, *delay_s));
        let mut lost = draw(Stream::RadioLoss);
        if !is_perfect && loss.draw(&mut lost) > lost.uniform() {
            return;
        }
        let is_double = !is_perfect && self.radio.duplicate > draw(Stream::RadioDuplicate).uniform();
        let mut late = draw(Stream::RadioDelay);
        for _ in 0..1 + usize::from(is_double) {
            let delay_s = if is_perfect { 0.0 } else { delay_s.draw(&mut late) };
            let due = tick + self.instants_late(delay_s);
            self.under_way.push(UnderWay { due, to, key: said.key, message: Arc::clone(&said.message) });
        }
    }

    /// A partition has them on different sides, or one of them on none.
    fn is_cut(&self, now: Time, from: UavId, to: UavId) -> bool {
        self.radio.partitions.iter().any(|partition| {
            let together = || partition.sides.iter().any(|side| side.contains(&from) && side.contains(&to));
            (partition.from_s..partition.until_s).contains(&now.s()) && !together()
        })
    }

    /// They are out of range of each other; nobody is from outside.
    fn is_far(&self, stations: &[Station], from: UavId, to: UavId) -> bool {
        let at = |uav: UavId| stations.get(uav.0 as usize).map(|station| station.position);
        let Some((range_m, from)) = self.radio.range_m.zip(at(from)) else { return false };
        at(to).is_some_and(|to| from.distance_m(to) > range_m)
    }

    /// After how many instants something is heard that is so late: 0 is the one at which it was sent.
    fn instants_late(&self, delay_s: f64) -> i64 {
        let delay_us = (delay_s * 1e6).round() as i64;
        if delay_us * 10 < self.period_us {
            return 0;
        }
        // Neither is negative.
        delay_us / self.period_us + i64::from(delay_us % self.period_us > 0)
    }
}

impl Transmitter {
    /// What is sent at an instant at which it may send so many bytes, and as many wait as it sends in a second; `None`:
    /// everything. Switched off it forgets what waits.
    fn send(&mut self, is_on: bool, bytes: Option<(f64, f64)>, said: impl Iterator<Item = Said>) -> Vec<Said> {
        if !is_on {
            *self = Self::default();
            return Vec::new();
        }
        let Some((credit_bytes, room_bytes)) = bytes else {
            let waiting = std::mem::take(self).waiting;
            return waiting.into_iter().chain(said).collect();
        };
        // Nothing is saved up while nothing waits.
        let saved_bytes = if self.waiting.is_empty() { 0.0 } else { self.credit_bytes };
        self.credit_bytes = saved_bytes + credit_bytes;
        let mut sent = Vec::new();
        self.send_waiting(&mut sent);
        for said in said {
            let size = said.message.size_bytes() as f64;
            let is_next = self.waiting.is_empty() && size <= self.credit_bytes;
            if is_next || self.waiting_bytes + size <= room_bytes {
                self.waiting_bytes += size;
                self.waiting.push_back(said);
                self.send_waiting(&mut sent);
            }
        }
        sent
    }

    /// Sends what waits, for as long as it may.
    fn send_waiting(&mut self, sent: &mut Vec<Said>) {
        while let Some(size) = self.waiting.front().map(|said| said.message.size_bytes() as f64)
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

    fn said(number: u32) -> Said {
        let state = standoff::UavState::straight(Position::ORIGIN, standoff::Angle::ZERO, 40.0);
        let message = Message::Report(standoff::Report::of(UavId(0), Time::START, state));
        Said { key: Key { speaker: UavId(0), tick: 0, number }, message: Arc::new(message) }
    }

    /// Whoever was silent for long sends no more at once than anybody.
    #[test]
    fn what_is_not_sent_is_not_saved_up() {
        let mut transmitter = Transmitter::default();
        let size = said(0).message.size_bytes() as f64;
        let mut send = |messages: u32| -> Vec<u32> {
            let sent = transmitter.send(true, Some((2.2 * size, 4.4 * size)), (0..messages).map(said));
            sent.iter().map(|said| said.key.number).collect()
        };
        for _ in 0..10 {
            assert_eq!(send(1), [0]);
        }
        // Room for two at a time, and what is left counts while something waits.
        assert_eq!(send(4), [0, 1]);
        assert_eq!(send(0), [2, 3]);
        assert_eq!(send(4), [0, 1]);
    }
}
