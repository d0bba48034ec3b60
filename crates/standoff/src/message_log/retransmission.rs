//! Retransmission: which entries are sent again, and which agent sends them.
//!
//! A report lists which entries its sender had received. The entries that it lacked are retransmitted: by their source,
//! if it is live and receivable; otherwise by the agents that have them, in turn. No report is retransmitted while it
//! may still be delayed as usual or while the answer to an earlier retransmission cannot have arrived. New cues do not
//! wait for this, nor does the last report of a sender if messages are late and a teammate probably lacks it. A budget
//! limits the total: it follows the size of the reports, the team and the measured loss, within the radio's bandwidth.
//! The order alternates between newest first, because new entries affect guidance, and oldest first, because these
//! delay commits.

use std::collections::BTreeMap;

use crate::message::{Cue, Message, MessageSource, ReceivedRange, Report};
use crate::message_log::log::MessageLog;
use crate::message_log::ranges::{first_of, last_of, number_of_cue, step_of};
use crate::message_log::teammates::TeammateLog;

/// Number of time steps after which any agent that has an entry retransmits it, because the agent whose turn it was may
/// not be received.
const OTHERS_AFTER: i64 = 4;

/// Maximum age of a cue that is repeated without an answer, time steps. Its source sends it only once, and the groups
/// of the agents differ while one of them lacks it.
const REPEAT_CUES_FOR: i64 = 8;

/// Maximum number of recorded retransmissions; entries beyond it may be sent twice.
const SENT_MAX: usize = 1 << 14;

/// Budget of an agent, relative to the expected transmissions of a report: enough for retransmissions by several agents,
/// and to catch up after an interruption in a quarter of its duration.
const BUDGET_FACTOR: f64 = 4.0;

/// Largest measured loss that the budget allows for.
const LOSS_MAX: f64 = 0.9;

/// Load of the radio that determines the budget.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RadioLoad {
    pub(crate) period_s: f64,
    /// Size of this agent's report, bytes.
    pub(crate) own_report_bytes: usize,
    /// Mean size of the reports that this agent may have to retransmit, bytes.
    pub(crate) mean_report_bytes: f64,
    pub(crate) teammates: usize,
    /// Fraction of the entries that teammates lack at first.
    pub(crate) loss: f64,
    pub(crate) bandwidth_bytes_per_s: Option<f64>,
}

impl RadioLoad {
    /// Budget of one period, which is negative if the report exceeds the bandwidth, and limits of what accumulates, bytes.
    fn budget_bytes(&self) -> (f64, [f64; 2]) {
        let transmissions = transmissions_per_report(self.teammates, self.loss);
        let own_report_bytes = self.own_report_bytes as f64;
        let per_period = BUDGET_FACTOR * transmissions * self.mean_report_bytes.max(own_report_bytes);
        // The budget of one second accumulates, or of one period if that is longer.
        let per_s = per_period * (1.0 / self.period_s).max(1.0);
        // A transmitter saves no bandwidth for later.
        let room = self.bandwidth_bytes_per_s.map_or(f64::INFINITY, |rate| rate * self.period_s - own_report_bytes);
        (per_period.min(room), [-per_s, per_s.min(room.max(0.0))])
    }
}

/// Mean number of transmissions of a report until all teammates have received it, if each loses each transmission with
/// probability `loss`.
fn transmissions_per_report(teammates: usize, loss: f64) -> f64 {
    let loss = loss.clamp(0.0, LOSS_MAX);
    let (mut transmissions, mut lost) = (0.0, 1.0);
    loop {
        let is_missing = 1.0 - probability_that_all_have(teammates.max(1), lost);
        if is_missing < 0.01 {
            return transmissions;
        }
        (transmissions, lost) = (transmissions + is_missing, lost * loss);
    }
}

/// Probability that all teammates have a report that each lacks with probability `lost`.
fn probability_that_all_have(teammates: usize, lost: f64) -> f64 {
    (0..teammates).fold(1.0, |all_have, _| all_have * (1.0 - lost))
}

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
    /// True if the budget of this time step was not enough for the missing entries and requested snapshots.
    pub(crate) is_limited: bool,
}

impl Retransmission {
    /// Adds the budget of one period.
    pub(crate) fn add_budget(&mut self, load: &RadioLoad) {
        let (per_period, [least, most]) = load.budget_bytes();
        self.budget_bytes = (self.budget_bytes + per_period).clamp(least, most);
        self.half_bytes = 0.5 * most;
    }

    pub(crate) fn spend(&mut self, bytes: usize) {
        self.budget_bytes -= bytes as f64;
    }

    /// Returns whether something that is to be sent waits because the budget is spent, and keeps it in `is_limited`.
    pub(crate) fn has_to_wait(&mut self) -> bool {
        self.is_limited |= self.budget_bytes <= 0.0;
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
        let is_missing = self.find_missing(log, now);
        if now % 2 == 0 {
            self.missing.reverse();
        }
        for place in 0..self.missing.len() {
            let (step, source, number) = self.missing[place];
            if self.budget_bytes <= 0.0 {
                // Repeated cues have probably arrived.
                self.is_limited |= is_missing;
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

    /// Collects the entries that this agent has to send because teammates do not list them. Returns true if any is
    /// missing, and not just repeated.
    fn find_missing(&mut self, log: &MessageLog, now: i64) -> bool {
        self.sent.retain(|_, at| now - *at <= log.teammate_timeout());
        self.missing.clear();
        let mut is_missing = false;
        let delay = log.link.typical_delay;
        // With enough budget, two agents retransmit: one of them may not have received the list, or may not be
        // received.
        let sender_count = if self.budget_bytes > self.half_bytes { 2 } else { 1 };
        // Each entry requires a check of every teammate.
        let teammates = log.teammates_with_status(now).count().max(1);
        let most = (TEAMMATE_CHECKS_MAX / (teammates * teammates)).max(16);
        for peer in log.teammates_with_status(now) {
            let mut looked = 0;
            let committed = log.grid.step_at(peer.log_status.committed_until);
            let from = committed.saturating_add(1).max(log.first);
            let mut others = &peer.log_status.received[..];
            for (source, runs) in &log.received {
                if looked >= most {
                    break;
                }
                let is_cue = matches!(source, MessageSource::CueSource(_));
                if peer.log_matches && !is_cue {
                    continue;
                }
                // Without delays, the last list contains the cues of the time step before the last.
                let to = if is_cue { now - 2 } else { peer.log_status_at - 1 - delay };
                let (first, last) = (first_of(*source, from), last_of(*source, to));
                let its = next_of(&mut others, *source);
                runs.without(its, (first, last), |number| {
                    let entry = (step_of(*source, number), *source, number);
                    let is_repeated = is_cue && now - entry.0 <= REPEAT_CUES_FOR;
                    // A retransmitted entry may be on its way or lost: the next report shows which.
                    let sent = self.sent.get(&(*source, number));
                    let is_answered = sent.is_none_or(|at| peer.log_status_at > at + delay);
                    if looked == most || !(is_repeated || is_answered) {
                        return;
                    }
                    looked += 1;
                    let is_mine = match is_repeated {
                        true => log.is_mine_to_repeat(number, (now, sender_count)),
                        false => log.is_mine_to_send(entry, peer, (now, sender_count)),
                    };
                    is_missing |= is_mine && !is_repeated;
                    self.missing.extend(is_mine.then_some(entry));
                });
            }
        }
        // If messages are late, so are the answers that list the missing ones. The last report is therefore repeated if
        // a teammate probably lacks it.
        if delay > 0 && probability_that_all_have(teammates, log.link.loss()) < 0.5 {
            self.missing.push((now - 1, MessageSource::Uav(log.own), now - 1));
        }
        self.missing.sort_unstable();
        self.missing.dedup();
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
            Self::Cue(cue) => Message::cue_size_bytes(cue),
        }
    }
}

impl MessageLog {
    /// True for this agent and for teammates whose newest report is as recent as the usual delay permits.
    fn is_live(&self, other: &TeammateLog, now: i64) -> bool {
        other.uav == self.own || other.has_sent_status(now, 2 + self.link.typical_delay)
    }

    /// True if it is this agent's turn to repeat a cue. All live agents take turns, because no list shows yet which of
    /// them have it.
    fn is_mine_to_repeat(&self, number: i64, (now, sender_count): (i64, usize)) -> bool {
        let live = self.teammates.iter().filter(|other| self.is_live(other, now));
        self.is_own_turn(live, now + number, sender_count)
    }

    /// True if this agent is one of the `count` candidates from number `turn` on, counted in a circle.
    fn is_own_turn<'a>(
        &self,
        candidates: impl Iterator<Item = &'a TeammateLog> + Clone,
        turn: i64,
        count: usize,
    ) -> bool {
        let first = turn.rem_euclid(candidates.clone().count().max(1) as i64);
        candidates.cycle().skip(first as usize).take(count).any(|other| other.uav == self.own)
    }

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
        let is_live = |other: &&TeammateLog| self.is_live(other, now);
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
        let holders = self.teammates.iter().filter(is_candidate).filter(is_live).filter(holds);
        self.is_own_turn(holders, now + number, others)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With a loss of 20 %, all three teammates have a report after 1.63 transmissions on average: with probability
    /// 0.8^3 after one, 0.96^3 after two, 0.992^3 after three, 0.9984^3 after four.
    #[test]
    fn transmissions_per_report_are_the_mean_of_the_largest_of_geometric_numbers() {
        for (teammates, loss, expected) in
            [(3, 0.2, 1.63), (15, 0.2, 2.57), (1, 0.5, 2.0), (0, 0.0, 1.0), (7, 0.0, 1.0), (255, 1.0, 58.7)]
        {
            let transmissions = transmissions_per_report(teammates, loss);
            assert!((transmissions / expected - 1.0).abs() < 0.015, "{teammates}, {loss}: {transmissions}");
        }
    }

    /// With a loss of 20 %, a teammate lacks the last report more often than not from five UAVs on.
    #[test]
    fn all_teammates_have_a_report_with_the_product_of_their_probabilities() {
        assert!((probability_that_all_have(3, 0.2) - 0.512).abs() < 1e-12);
        assert!((probability_that_all_have(4, 0.2) - 0.4096).abs() < 1e-12);
        assert_eq!((probability_that_all_have(0, 0.2), probability_that_all_have(7, 0.0)), (1.0, 1.0));
    }

    #[test]
    fn the_budget_follows_the_load_within_the_bandwidth() {
        let load = RadioLoad {
            period_s: 0.5,
            own_report_bytes: 200,
            mean_report_bytes: 400.0,
            teammates: 3,
            loss: 0.0,
            bandwidth_bytes_per_s: None,
        };
        let of = |load: RadioLoad| load.budget_bytes();
        assert_eq!(of(load), (1600.0, [-3200.0, 3200.0]));
        assert_eq!(of(RadioLoad { own_report_bytes: 800, ..load }).0, 3200.0);
        assert!((1.60..1.64).contains(&(of(RadioLoad { loss: 0.2, ..load }).0 / 1600.0)));
        let bounded = |rate: f64| of(RadioLoad { bandwidth_bytes_per_s: Some(rate), ..load });
        assert_eq!(bounded(1000.0), (300.0, [-3200.0, 300.0]));
        // The report alone exceeds the bandwidth.
        assert_eq!(bounded(100.0), (-150.0, [-3200.0, 0.0]));
        assert_eq!(bounded(1e6), of(load));
    }
}
