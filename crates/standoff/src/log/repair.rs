//! What is said again, and to whom it is left.
//!
//! A report tells what its sender held when it spoke. What it lacked then is said again: by whose entry it is, if that one
//! is there and heard; else by those who hold it in turn. Nothing is said again that is late as all is, or before an answer
//! can have come, and no more than the budget allows; in turn the newest first, which steers, and the oldest, which holds
//! up what is committed.

use std::collections::BTreeMap;

use crate::log::Log;
use crate::log::peer::Peer;
use crate::log::runs::{first_of, instant_of, last_of, number_of_cue};
use crate::message::{Cue, Held, Message, Report, Speaker};

/// After so many periods whoever holds an entry says it: the one whose turn it was is not heard.
const OTHERS_AFTER: i64 = 4;

/// No more entries are noted as said again at a time: what comes beyond may be said twice.
const SENT_MAX: usize = 1 << 14;

/// What an agent says again.
#[derive(Debug, Clone, Default)]
pub(crate) struct Repair {
    /// When each entry was said again, by whomever.
    sent: BTreeMap<(Speaker, i64), i64>,
    /// Instant, speaker and number of what is missing somewhere.
    wanted: Vec<(i64, Speaker, i64)>,
    /// What may be sent, bytes; below 0, what was sent in advance.
    budget_bytes: f64,
    /// Half of what may be saved.
    half_bytes: f64,
}

impl Repair {
    /// Another period has begun.
    pub(crate) fn earn(&mut self, bytes_per_s: f64, period_s: f64) {
        // A second's worth at most is saved, or a period's where that is longer.
        let most = bytes_per_s * period_s.max(1.0);
        self.budget_bytes = (self.budget_bytes + bytes_per_s * period_s).min(most);
        self.half_bytes = 0.5 * most;
    }

    pub(crate) fn spend(&mut self, bytes: usize) {
        self.budget_bytes -= bytes as f64;
    }

    pub(crate) fn is_spent(&self) -> bool {
        self.budget_bytes <= 0.0
    }

    /// Forgets what was said, not what may be.
    pub(crate) fn reset(&mut self) {
        self.sent.clear();
    }

    /// An entry was said again at an instant, here or by others: whoever lacks it may have heard it now.
    pub(crate) fn note(&mut self, speaker: Speaker, number: i64, at: i64) {
        if self.sent.len() < SENT_MAX {
            self.sent.insert((speaker, number), at);
        }
    }

    /// Says what others lack, at an instant.
    pub(crate) fn say(&mut self, log: &Log, now: i64, mut tell: impl FnMut(Again)) -> bool {
        self.sent.retain(|_, at| now - *at <= log.lease());
        self.wanted.clear();
        let delay = log.usual_delay;
        // While there is enough, two say it: one may not have heard the question, or not be heard.
        let voices = if self.budget_bytes > self.half_bytes { 2 } else { 1 };
        // Whose turn it is, is asked of everyone for every entry.
        let tellers = log.telling(now).count().max(1);
        let most = (LOOKED_MAX / (tellers * tellers)).max(16);
        for peer in log.telling(now).filter(|peer| !peer.is_alike) {
            let mut looked = 0;
            let committed = log.instant_at(peer.knowledge.committed);
            let (from, to) = (committed.saturating_add(1).max(log.first), peer.knows_at - 1 - delay);
            let mut others = &peer.knowledge.held[..];
            for (speaker, runs) in &log.held {
                if looked >= most {
                    break;
                }
                let (first, last) = (first_of(*speaker, from), last_of(*speaker, to));
                let its = next_of(&mut others, *speaker);
                runs.without(its, (first, last), |number| {
                    let entry = (instant_of(*speaker, number), *speaker, number);
                    // One that was said again may be on its way, or was lost: the next report tells.
                    let sent = self.sent.get(&(*speaker, number));
                    let is_answered = sent.is_none_or(|at| peer.knows_at > at + delay);
                    if is_answered && looked < most {
                        looked += 1;
                        self.wanted.extend(log.is_mine_to_say(entry, peer, (now, voices)).then_some(entry));
                    }
                });
            }
        }
        let is_wanted = !self.wanted.is_empty();
        self.wanted.sort_unstable();
        self.wanted.dedup();
        if now % 2 == 0 {
            self.wanted.reverse();
        }
        for place in 0..self.wanted.len() {
            let (instant, speaker, number) = self.wanted[place];
            if self.is_spent() {
                break;
            }
            let Some(row) = log.row(instant) else { continue };
            let said = match speaker {
                Speaker::Uav(uav) => row.report_of(uav).map(Again::Report),
                Speaker::Searcher(searcher) => {
                    let is_it = |cue: &&Cue| cue.searcher == searcher && number_of_cue(instant, cue.number) == number;
                    row.cues().iter().find(is_it).map(Again::Cue)
                }
            };
            let Some(said) = said else { continue };
            self.spend(said.size_bytes());
            self.note(speaker, number, now);
            tell(said);
        }
        is_wanted
    }
}

/// No more than so many answers are looked at in a period, to whose turn it is to say an entry again; the same part of them
/// for each peer that lacks some. A team of sixteen that has missed a minute needs no more; a hostile one could ask for ever.
const LOOKED_MAX: usize = 1 << 18;

/// An entry that is said again.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Again<'a> {
    Report(&'a Report),
    Cue(&'a Cue),
}

/// What is held of a speaker, of what is listed by speaker; those before it are passed.
fn next_of<'a>(held: &mut &'a [Held], speaker: Speaker) -> &'a [Held] {
    let before = held.iter().take_while(|run| run.speaker < speaker).count();
    let of_it = held[before..].iter().take_while(|run| run.speaker == speaker).count();
    let (its, rest) = held[before..].split_at(of_it);
    *held = rest;
    its
}

impl Again<'_> {
    fn size_bytes(self) -> usize {
        match self {
            // What its speaker has told of itself is not told again.
            Self::Report(report) => Message::report_size_bytes(report, None),
            Self::Cue(_) => Message::CUE_SIZE_BYTES,
        }
    }
}

impl Log {
    /// Whether this agent is the one to say an entry again that a peer lacks.
    fn is_mine_to_say(
        &self,
        (instant, speaker, number): (i64, Speaker, i64),
        peer: &Peer,
        (now, voices): (i64, usize),
    ) -> bool {
        let own = Speaker::Uav(self.own);
        if speaker == own {
            return true;
        }
        let is_there = |other: &&Peer| other.uav == self.own || other.tells(now, 2);
        let mut others = voices;
        if let Speaker::Uav(uav) = speaker {
            // Whose it is says it, if that one is there and the peer hears it; of long ago others do, too, while there is enough.
            let is_heard = peer.held(speaker).last().is_some_and(|run| run.to >= peer.knows_at - OTHERS_AFTER);
            let is_its = is_heard && self.peers.iter().filter(is_there).any(|other| other.uav == uav);
            if is_its && (voices == 1 || now - instant <= OTHERS_AFTER) {
                others -= 1;
            }
        }
        // Those who hold it take turns.
        let holds = |other: &&Peer| {
            other.uav == self.own
                || other.knowledge.committed >= self.time(instant)
                || other.held(speaker).iter().any(|run| run.from <= number && number <= run.to)
        };
        let is_asked = |other: &&Peer| other.uav != peer.uav && Speaker::Uav(other.uav) != speaker;
        let holders = || self.peers.iter().filter(is_asked).filter(is_there).filter(holds);
        let turn = (now + number).rem_euclid(holders().count().max(1) as i64);
        holders().cycle().skip(turn as usize).take(others).any(|other| other.uav == self.own)
    }
}
