//! Retransmission: which entries are sent again, and which agent sends them.
//!
//! A report lists which entries its sender had received. The entries that it lacked are retransmitted: by their source,
//! if it is live and receivable; otherwise by the agents that have them, in turn. No entry is retransmitted while it
//! may still be delayed as usual or while the answer to an earlier retransmission cannot have arrived, and the budget
//! limits the total. The order alternates between newest first, because new entries affect guidance, and oldest first,
//! because these delay commits.

use std::collections::BTreeMap;

use crate::message::{Cue, Message, MessageSource, ReceivedRange, Report};
use crate::message_log::log::MessageLog;
use crate::message_log::ranges::{first_of, last_of, number_of_cue, step_of};
use crate::message_log::teammates::TeammateLog;

/// Number of time steps after which any agent that has an entry retransmits it, because the agent whose turn it was may
/// not be received.
const OTHERS_AFTER: i64 = 4;

/// Maximum number of recorded retransmissions; entries beyond it may be sent twice.
const SENT_MAX: usize = 1 << 14;

/// Retransmission state of an agent.
#[derive(Debug, Clone, Default)]
pub(crate) struct Retransmission {
    /// Time step at which each entry was last retransmitted, by any agent.
    sent: BTreeMap<(MessageSource, i64), i64>,
    /// Time step, source and number of the entries that teammates lack.
    missing: Vec<(i64, MessageSource, i64)>,
    /// Remaining budget, bytes; negative if the last message exceeded the remaining budget.
    budget_bytes: f64,
    /// Half of the maximum budget, bytes.
    half_bytes: f64,
}

impl Retransmission {
    /// Adds the budget of one period.
    pub(crate) fn add_budget(&mut self, bytes_per_s: f64, period_s: f64) {
        // At most the budget of one second accumulates, or of one period if that is longer.
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

    /// Clears the recorded retransmissions, but not the budget.
    pub(crate) fn reset(&mut self) {
        self.sent.clear();
    }

    /// Records that an entry was retransmitted at a time step, here or by another agent: agents that lacked it may have
    /// received it.
    pub(crate) fn record_sent(&mut self, source: MessageSource, number: i64, at: i64) {
        if self.sent.len() < SENT_MAX {
            self.sent.insert((source, number), at);
        }
    }

    /// Passes the entries that teammates lack to `emit`; returns true if any were missing.
    pub(crate) fn next_messages(&mut self, log: &MessageLog, now: i64, mut emit: impl FnMut(Resend)) -> bool {
        self.sent.retain(|_, at| now - *at <= log.teammate_timeout());
        self.missing.clear();
        let delay = log.typical_delay;
        // With enough budget, two agents retransmit: one of them may not have received the list, or may not be
        // received.
        let sender_count = if self.budget_bytes > self.half_bytes { 2 } else { 1 };
        // Each entry requires a check of every teammate.
        let teammates = log.teammates_with_status(now).count().max(1);
        let most = (TEAMMATE_CHECKS_MAX / (teammates * teammates)).max(16);
        for peer in log.teammates_with_status(now).filter(|peer| !peer.log_matches) {
            let mut looked = 0;
            let committed = log.step_at(peer.log_status.committed_until);
            let (from, to) = (committed.saturating_add(1).max(log.first), peer.log_status_at - 1 - delay);
            let mut others = &peer.log_status.received[..];
            for (source, runs) in &log.received {
                if looked >= most {
                    break;
                }
                let (first, last) = (first_of(*source, from), last_of(*source, to));
                let its = next_of(&mut others, *source);
                runs.without(its, (first, last), |number| {
                    let entry = (step_of(*source, number), *source, number);
                    // A retransmitted entry may be on its way or lost: the next report shows which.
                    let sent = self.sent.get(&(*source, number));
                    let is_answered = sent.is_none_or(|at| peer.log_status_at > at + delay);
                    if is_answered && looked < most {
                        looked += 1;
                        self.missing.extend(log.is_mine_to_send(entry, peer, (now, sender_count)).then_some(entry));
                    }
                });
            }
        }
        let is_missing = !self.missing.is_empty();
        self.missing.sort_unstable();
        self.missing.dedup();
        if now % 2 == 0 {
            self.missing.reverse();
        }
        for place in 0..self.missing.len() {
            let (step, source, number) = self.missing[place];
            if self.is_spent() {
                break;
            }
            let Some(row) = log.messages(step) else { continue };
            let message = match source {
                MessageSource::Uav(uav) => row.report_of(uav).map(Resend::Report),
                MessageSource::CueSource(searcher) => {
                    let matches = |cue: &&Cue| cue.source == searcher && number_of_cue(step, cue.sequence) == number;
                    row.cues().iter().find(matches).map(Resend::Cue)
                }
            };
            let Some(message) = message else { continue };
            self.spend(message.size_bytes());
            self.record_sent(source, number, now);
            emit(message);
        }
        is_missing
    }
}

/// Maximum number of teammate checks per period that decide which agent retransmits an entry. Each teammate that lacks
/// entries gets an equal share. The value is enough for a team of sixteen that missed one minute; without a limit, a
/// hostile teammate could cause unlimited work.
const TEAMMATE_CHECKS_MAX: usize = 1 << 18;

/// Entry to retransmit.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Resend<'a> {
    Report(&'a Report),
    Cue(&'a Cue),
}

/// Splits off the ranges of a source from a list sorted by source, and skips the sources before it.
fn next_of<'a>(held: &mut &'a [ReceivedRange], source: MessageSource) -> &'a [ReceivedRange] {
    let before = held.iter().take_while(|run| run.source < source).count();
    let count = held[before..].iter().take_while(|run| run.source == source).count();
    let (its, rest) = held[before..].split_at(count);
    *held = rest;
    its
}

impl Resend<'_> {
    fn size_bytes(self) -> usize {
        match self {
            // A retransmission does not contain the log status of the source.
            Self::Report(report) => Message::report_size_bytes(report, None),
            Self::Cue(_) => Message::CUE_SIZE_BYTES,
        }
    }
}

impl MessageLog {
    /// True if it is this agent's turn to retransmit an entry that a teammate lacks.
    fn is_mine_to_send(
        &self,
        (step, source, number): (i64, MessageSource, i64),
        peer: &TeammateLog,
        (now, sender_count): (i64, usize),
    ) -> bool {
        let own = MessageSource::Uav(self.own);
        if source == own {
            return true;
        }
        let is_live = |other: &&TeammateLog| other.uav == self.own || other.has_sent_status(now, 2);
        let mut others = sender_count;
        if let MessageSource::Uav(uav) = source {
            // The source retransmits if it is live and the teammate receives it. With enough budget, other agents
            // retransmit old entries, too.
            let is_received =
                peer.received(source).last().is_some_and(|run| run.to >= peer.log_status_at - OTHERS_AFTER);
            let is_its = is_received && self.teammates.iter().filter(is_live).any(|other| other.uav == uav);
            if is_its && (sender_count == 1 || now - step <= OTHERS_AFTER) {
                others -= 1;
            }
        }
        // The agents that have the entry take turns.
        let holds = |other: &&TeammateLog| {
            other.uav == self.own
                || other.log_status.committed_until >= self.time(step)
                || other.received(source).iter().any(|run| run.from <= number && number <= run.to)
        };
        let is_candidate = |other: &&TeammateLog| other.uav != peer.uav && MessageSource::Uav(other.uav) != source;
        let holders = || self.teammates.iter().filter(is_candidate).filter(is_live).filter(holds);
        let turn = (now + number).rem_euclid(holders().count().max(1) as i64);
        holders().cycle().skip(turn as usize).take(others).any(|other| other.uav == self.own)
    }
}
