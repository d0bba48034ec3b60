//! What was said, by instant, whenever it came; and who holds what of it.
//!
//! Instants are numbers of periods since [`Time::START`]. A report or a cue is an entry of one instant: it is kept until the
//! horizon has passed, so that it can be said again to who lacks it.

mod peer;
pub(crate) mod repair;
mod runs;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use crate::log::runs::{Runs, first_of, instant_of, last_of, number_of_cue};
use crate::message::{Cue, Held, Knowledge, Message, Report, Speaker};
use crate::row::{Put, Row, Said, TEAM_MAX};
use crate::step::{Refused, count};
use crate::team::TeamParams;
use crate::time::{Duration, Time};
use crate::uav::UavId;

pub use peer::Presence;
pub(crate) use peer::{NEVER, Peer};

/// More runs than this in one report are not believed: gaps have a bound.
pub(crate) const HELD_MAX: usize = 1024;

/// So many seconds after a word was missing, words are taken to go missing still.
const CALM_AFTER_S: f64 = 10.0;

/// So many instants before what is committed are still listed as held: who hears a report may have missed those before.
pub(crate) const LISTED_BEFORE: i64 = 40;

/// An agent's log.
#[derive(Debug, Clone)]
pub(crate) struct Log {
    pub(crate) period: Duration,
    /// In periods, as the lease.
    horizon: i64,
    lease: i64,
    calm_after: i64,
    own: UavId,
    /// The instant of the first row.
    first: i64,
    rows: VecDeque<Row>,
    spare: Vec<Row>,
    /// Everyone ever heard, by ascending UAV, until the horizon has passed.
    peers: Vec<Peer>,
    /// What is held of each speaker, by speaker.
    held: Vec<(Speaker, Runs)>,
    /// How many of the reports heard of late came so many periods late, the last one that or more.
    delays: [u32; 8],
    /// By how many periods reports are late: most of them, so that what is lost now and then does not count.
    usual_delay: i64,
    /// By how many the latest of them are late.
    longest_delay: i64,
    /// When one was late the last time.
    late_at: i64,
    /// The earliest instant of which something was heard since the pictures were made.
    pub(crate) changed_from: i64,
    /// The last instant of which something was missing, here or elsewhere.
    pub(crate) disturbed_at: i64,
    pub(crate) refused: Refused,
}

impl Log {
    pub(crate) fn new(own: UavId, params: &TeamParams) -> Self {
        let period = Duration::from_s(params.log.period_s);
        let periods = |s: f64| (Duration::from_s(s).us() + period.us() - 1) / period.us();
        Self {
            period,
            horizon: periods(params.log.horizon_s).clamp(1, 1200),
            lease: periods(params.teammate_timeout_s).max(1),
            calm_after: periods(CALM_AFTER_S),
            own,
            first: 0,
            rows: VecDeque::new(),
            spare: Vec::new(),
            peers: Vec::new(),
            held: Vec::new(),
            delays: [0; 8],
            usual_delay: 0,
            longest_delay: 0,
            late_at: NEVER,
            changed_from: i64::MAX,
            disturbed_at: NEVER,
            refused: Refused::default(),
        }
    }

    /// Forgets everything but what was refused, and begins at an instant.
    pub(crate) fn begin(&mut self, first: i64) {
        self.spare.extend(self.rows.drain(..));
        self.peers.clear();
        self.held.clear();
        (self.first, self.changed_from, self.disturbed_at, self.late_at) = (first, i64::MAX, NEVER, NEVER);
    }

    /// The instant whose stamp a time is: within a tenth of a period.
    pub(crate) fn instant(&self, time: Time) -> Option<i64> {
        let (us, period) = (time.us(), self.period.us());
        let nearest = us.saturating_add(period / 2).div_euclid(period);
        let off = us.saturating_sub(nearest.saturating_mul(period));
        (off.abs() <= period / 10).then_some(nearest)
    }

    pub(crate) fn time(&self, instant: i64) -> Time {
        Time::from_us(instant.saturating_mul(self.period.us()))
    }

    pub(crate) fn horizon(&self) -> i64 {
        self.horizon
    }

    pub(crate) fn lease(&self) -> i64 {
        self.lease
    }

    /// Words have gone missing of late, here or elsewhere.
    pub(crate) fn is_disturbed(&self, now: i64) -> bool {
        now - self.disturbed_at <= self.calm_after
    }

    /// The row of an instant, if it is within the log.
    pub(crate) fn row(&self, instant: i64) -> Option<&Row> {
        self.rows.get(usize::try_from(instant - self.first).ok()?)
    }

    /// The instant of the last row.
    fn last(&self) -> i64 {
        self.first + self.rows.len() as i64 - 1
    }

    /// The row of an instant, made where it is not there; `None` before the first.
    fn row_mut(&mut self, instant: i64) -> Option<&mut Row> {
        let place = usize::try_from(instant.checked_sub(self.first)?).ok()?;
        if self.rows.len() <= place {
            self.open_up_to(place);
        }
        self.rows.get_mut(place)
    }

    #[cold]
    fn open_up_to(&mut self, place: usize) {
        while self.rows.len() <= place {
            let time = self.time(self.first + self.rows.len() as i64);
            let mut row = self.spare.pop().unwrap_or_default();
            row.open(time);
            self.rows.push_back(row);
        }
    }

    /// Makes room for the present, and forgets what the horizon has passed and no picture needs.
    pub(crate) fn turn_to(&mut self, now: i64, needed_from: i64) {
        self.row_mut(now);
        if !self.is_disturbed(now) {
            // Whatever seems to be missing is asked for at once.
            self.usual_delay = 0;
        }
        if now - self.late_at > self.calm_after {
            (self.delays, self.longest_delay) = ([0; 8], 0);
        }
        while self.first < (now - self.horizon).min(needed_from) {
            if let Some(row) = self.rows.pop_front() {
                self.spare.push(row);
            }
            self.first += 1;
        }
        let first = self.first;
        self.held.retain_mut(|(speaker, runs)| {
            runs.forget_before(*speaker, first);
            !runs.is_empty()
        });
        self.peers.retain(|peer| peer.newest >= first || peer.uav == self.own);
    }

    /// The log goes back to an instant: what was said since can still be heard. Rows that are there stay.
    pub(crate) fn reach_back(&mut self, first: i64) {
        while self.first > first {
            let mut row = self.spare.pop().unwrap_or_default();
            row.open(self.time(self.first - 1));
            self.rows.push_front(row);
            self.first -= 1;
        }
        // What was no matter of this agent's was not learnt.
        self.peers.iter_mut().for_each(|peer| peer.is_alike = false);
        let told: Vec<(i64, Knowledge)> =
            self.peers.iter().map(|peer| (peer.knows_at, peer.knowledge.clone())).collect();
        told.iter().for_each(|(instant, knowledge)| self.learn_of_others(knowledge, *instant));
    }

    /// Takes the own report in: nobody else need know how late.
    pub(crate) fn say(&mut self, instant: i64, said: Said) -> Put {
        self.put_report(instant, said, None)
    }

    /// Takes in what was heard at an instant `now`; `committed` cannot change any more.
    pub(crate) fn hear_report(&mut self, report: &Report, now: i64, committed: i64) {
        let Some(instant) = self.instant(report.time).filter(|instant| *instant <= now + self.early()) else {
            return count(&mut self.refused.off_grid);
        };
        let is_alike = report.knowledge.as_deref().is_some_and(|told| self.holds_as_told(told, report.uav, instant));
        if !is_alike && !report.knowledge.as_deref().is_none_or(is_sound) {
            return count(&mut self.refused.nonsense);
        }
        if instant <= committed.max(self.first - 1) {
            // What is known already may come as often as it likes.
            let is_known = self.holds(Speaker::Uav(report.uav), instant);
            // Of an instant that nobody could have known this agent to need.
            let is_old = instant < self.first;
            if !is_known && !is_old {
                count(&mut self.refused.late);
            }
            return self.learn(report, instant, is_alike);
        }
        match self.put_report(instant, Said::of(report), Some((report, is_alike))) {
            Put::Refused => count(&mut self.refused.nonsense),
            Put::New => self.note_delay(instant, now),
            Put::Known | Put::Instead => {}
        }
    }

    fn note_delay(&mut self, instant: i64, now: i64) {
        let periods = now - instant;
        self.late_at = if periods > 0 { now } else { self.late_at };
        // Mostly none is late.
        if periods <= 0 && self.longest_delay == 0 {
            self.delays[0] += 1;
            self.delays[0] >>= u32::from(self.delays[0] > 64);
            return;
        }
        self.delays[periods.clamp(0, 7) as usize] += 1;
        // What was long ago counts less and less.
        if self.delays.iter().sum::<u32>() > 64 {
            self.delays.iter_mut().for_each(|count| *count /= 2);
        }
        let half = self.delays.iter().sum::<u32>() / 2;
        let mut sum = 0;
        let place = self.delays.iter().position(|count| {
            sum += count;
            sum > half
        });
        self.usual_delay = place.unwrap_or_default() as i64;
        self.longest_delay = self.delays.iter().rposition(|count| *count > 0).unwrap_or_default() as i64;
    }

    fn put_report(&mut self, instant: i64, said: Said, report: Option<(&Report, bool)>) -> Put {
        let uav = said.uav;
        if !self.has_room_for(uav) {
            return Put::Refused;
        }
        let Some(row) = self.row_mut(instant) else { return Put::Refused };
        let put = row.put(said);
        if matches!(put, Put::New | Put::Instead) {
            self.changed_from = self.changed_from.min(instant);
        }
        if put != Put::Refused {
            self.note(Speaker::Uav(uav), instant);
            match report {
                Some((report, is_alike)) => self.learn(report, instant, is_alike),
                None => self.peer_mut(uav, instant).hear(instant, said.leaves),
            }
        }
        put
    }

    /// Takes a cue in, heard at an instant `now`.
    pub(crate) fn hear_cue(&mut self, cue: &Cue, now: i64, committed: i64) {
        let Some(instant) = self.instant(cue.said).filter(|instant| *instant <= now + self.early()) else {
            return count(&mut self.refused.off_grid);
        };
        let (speaker, number) = (Speaker::Searcher(cue.searcher), number_of_cue(instant, cue.number));
        if instant <= committed || instant < self.first {
            if !self.holds(speaker, number) && instant >= self.first {
                count(&mut self.refused.late);
            }
            return;
        }
        if !self.has_room_for_cues_of(speaker) {
            return count(&mut self.refused.nonsense);
        }
        let Some(row) = self.row_mut(instant) else { return };
        let put = row.put_cue(cue);
        let is_dropped = put == Put::Refused && row.is_full();
        match put {
            Put::Refused => count(&mut self.refused.nonsense),
            Put::Known => {}
            Put::New | Put::Instead => self.changed_from = self.changed_from.min(instant),
        }
        // One of too many need not be said again.
        if is_dropped || matches!(put, Put::New | Put::Instead) {
            self.note(speaker, number);
        }
    }

    /// The entry of long ago that a message says again: its number. What was lost a moment ago may be said by several.
    pub(crate) fn said_again(&self, message: &Message, now: i64) -> Option<(Speaker, i64)> {
        let recent = self.time(now - self.lease);
        let long_ago = |time| Some(time).filter(|time| *time < recent).and_then(|time| self.instant(time));
        Some(match message {
            Message::Report(report) => (Speaker::Uav(report.uav), long_ago(report.time)?),
            Message::Cue(cue) => (Speaker::Searcher(cue.searcher), number_of_cue(long_ago(cue.said)?, cue.number)),
            Message::Snapshot(_) | Message::Traffic(_) => return None,
        })
    }

    /// How many periods ahead of the own time something may be: clocks differ, and a message may come before its instant is
    /// observed.
    fn early(&self) -> i64 {
        self.lease
    }

    /// Who speaks takes the place of one that was only heard of; this agent always has one.
    fn has_room_for(&self, uav: UavId) -> bool {
        self.peers.len() + 1 < TEAM_MAX
            || uav == self.own
            || self.room() > 0
            || self.peer(uav).is_some()
            || self.peers.iter().any(|peer| !peer.is_heard)
    }

    /// How many more there may be, beside this agent.
    fn room(&self) -> usize {
        TEAM_MAX.saturating_sub(self.peers.len() + usize::from(self.peer(self.own).is_none()))
    }

    /// As of UAVs, so of those who hand targets over.
    fn has_room_for_cues_of(&self, speaker: Speaker) -> bool {
        let uavs = self.held.partition_point(|(speaker, _)| matches!(speaker, Speaker::Uav(_)));
        self.held.len() - uavs < TEAM_MAX || self.runs(speaker).is_some()
    }

    /// Where a peer stands, or would.
    fn place(&self, uav: UavId) -> Result<usize, usize> {
        self.peers.binary_search_by_key(&uav, |peer| peer.uav)
    }

    /// A UAV ever heard of, until the horizon has passed.
    pub(crate) fn peer(&self, uav: UavId) -> Option<&Peer> {
        self.place(uav).ok().map(|place| &self.peers[place])
    }

    fn peer_mut(&mut self, uav: UavId, instant: i64) -> &mut Peer {
        let place = match self.place(uav) {
            Ok(place) => place,
            Err(_) => self.welcome(uav, instant),
        };
        &mut self.peers[place]
    }

    /// Gives a peer its place, be it that of one who was only heard of.
    #[cold]
    fn welcome(&mut self, uav: UavId, instant: i64) -> usize {
        if uav != self.own && self.room() == 0 {
            let unheard = self.peers.iter().rposition(|peer| !peer.is_heard);
            unheard.map(|place| self.peers.remove(place));
        }
        let place = self.peers.partition_point(|peer| peer.uav < uav);
        self.peers.insert(place, Peer::new(uav, instant));
        place
    }

    /// Until then a peer's picture does not count.
    pub(crate) fn pass_over(&mut self, uav: UavId, until: i64) {
        if let Ok(place) = self.place(uav) {
            self.peers[place].passed_over_until = until;
        }
    }

    /// What a speaker has heard, by the newest report of it that says so.
    fn learn(&mut self, report: &Report, instant: i64, is_alike: bool) {
        if !self.has_room_for(report.uav) {
            return;
        }
        let is_own = report.uav == self.own;
        let peer = self.peer_mut(report.uav, instant);
        peer.hear(instant, report.leaves);
        let is_newer = !is_own && instant > peer.knows_at;
        let Some(knowledge) = report.knowledge.as_deref().filter(|_| is_newer) else { return };
        (peer.knows_at, peer.is_alike) = (instant, is_alike);
        peer.knowledge.clone_from(knowledge);
        // One that is wrong ends with the instants that it names.
        if knowledge.disturbed > self.time(self.disturbed_at) {
            self.disturbed_at = self.instant_at(knowledge.disturbed).min(instant).max(self.disturbed_at);
        }
        if !is_alike {
            self.learn_of_others(knowledge, instant);
        }
    }

    /// What a UAV tells in its report of an instant to hold, that report with it, is what is held here once that is: neither
    /// more nor less, as far as it could know. So it mostly is.
    fn holds_as_told(&self, told: &Knowledge, uav: UavId, instant: i64) -> bool {
        let (from, to) = (self.instant_at(told.committed).saturating_add(1).max(self.first), instant - 1);
        let mut told = told.held.iter();
        let mut next = told.next();
        for (speaker, runs) in &self.held {
            let (first, last) = (first_of(*speaker, from), last_of(*speaker, to));
            if let (Some(run), &[(start, mut end)]) = (next, runs.runs())
                && run.speaker == *speaker
            {
                end += i64::from(*speaker == Speaker::Uav(uav) && end == to);
                let is_within = start <= run.from && run.from <= run.to && run.to <= end;
                if !(is_within && run.from <= start.max(first) && end.min(last) <= run.to) {
                    return false;
                }
                next = told.next();
            } else if runs.runs().iter().any(|run| first <= run.1 && run.0 <= last) {
                return false;
            }
        }
        next.is_none()
    }

    /// Whom others have heard is there, too.
    fn learn_of_others(&mut self, knowledge: &Knowledge, instant: i64) {
        let mut place = 0;
        for run in &knowledge.held {
            let Speaker::Uav(uav) = run.speaker else { break };
            if run.to < self.first || run.to > instant {
                continue;
            }
            // Both are by UAV.
            while self.peers.get(place).is_some_and(|peer| peer.uav < uav) {
                place += 1;
            }
            let from = run.from.max(self.first);
            if self.peers.get(place).is_none_or(|peer| peer.uav != uav) {
                if self.room() == 0 {
                    continue;
                }
                self.peers.insert(place, Peer::new(uav, from));
            }
            let peer = &mut self.peers[place];
            if from < peer.first || peer.newest < run.to {
                peer.spoke(from);
                peer.spoke(run.to);
            }
        }
    }

    fn note(&mut self, speaker: Speaker, number: i64) {
        let instant = instant_of(speaker, number);
        // Who has spoken since may have told that it lacks this one.
        if instant < self.last() {
            self.peers.iter_mut().filter(|peer| instant < peer.knows_at).for_each(|peer| peer.is_alike = false);
        }
        let index = match self.held.binary_search_by_key(&speaker, |(speaker, _)| *speaker) {
            Ok(index) => index,
            Err(index) => {
                self.held.insert(index, (speaker, Runs::default()));
                index
            }
        };
        self.held[index].1.add(number);
    }

    fn runs(&self, speaker: Speaker) -> Option<&Runs> {
        self.held.binary_search_by_key(&speaker, |(speaker, _)| *speaker).ok().map(|index| &self.held[index].1)
    }

    fn holds(&self, speaker: Speaker, number: i64) -> bool {
        self.runs(speaker).is_some_and(|runs| runs.holds(number))
    }

    /// Somebody else was heard, within the horizon.
    pub(crate) fn has_heard(&self) -> bool {
        self.peers.iter().any(|peer| peer.is_heard && peer.uav != self.own)
    }

    /// Everyone ever heard of, until the horizon has passed, by ascending UAV; the own one, too.
    pub(crate) fn peers(&self) -> &[Peer] {
        &self.peers
    }

    /// The others that are there, or were a moment ago, and have told what they know, by ascending UAV. Of itself nobody hears.
    pub(crate) fn telling(&self, now: i64) -> impl Iterator<Item = &Peer> + Clone {
        self.peers.iter().filter(move |peer| peer.tells(now, self.lease))
    }

    /// All is known of an instant that can be known: everyone who was to has reported it, or tells that it never did, and has
    /// spoken again since, by which they have told what else they have heard of it; and none of that is missing here.
    pub(crate) fn is_complete(&self, instant: i64) -> bool {
        let Some(row) = self.row(instant) else { return false };
        let has_reported = |peer: &Peer| {
            let speaks_on = peer.left_at == Some(instant) || peer.newest > instant;
            !peer.is_due(instant) || speaks_on && (row.report_of(peer.uav).is_some() || self.never_said(peer, instant))
        };
        self.peers.iter().all(|peer| has_reported(peer) && self.is_told_by(peer, instant))
    }

    /// A peer that is back from a restart, or could not speak, lists what it has said itself: not this.
    fn never_said(&self, peer: &Peer, instant: i64) -> bool {
        let own = peer.held(Speaker::Uav(peer.uav));
        peer.uav == self.own
            || self.lists(peer, instant)
                && peer.knowledge.held.len() < HELD_MAX
                && !own.iter().any(|run| run.from <= instant && instant <= run.to)
    }

    /// A peer has told what it has heard of an instant, and none of that is missing here.
    pub(crate) fn is_told_by(&self, peer: &Peer, instant: i64) -> bool {
        // Who never tells what it has heard is taken at its word.
        let is_mute = peer.uav == self.own || peer.left_at.is_some() || peer.knows_at == NEVER;
        (is_mute || self.lists(peer, instant)) && !self.lacks_of(peer, (instant, instant))
    }

    /// A peer has told what it had heard of an instant when all could have: a cue may come to nobody before.
    fn lists(&self, peer: &Peer, instant: i64) -> bool {
        peer.knows_at > instant + self.longest_delay && peer.knowledge.listed_after < self.time(instant)
    }

    /// Something is missing here that somebody who is there holds, of the instants up to one.
    pub(crate) fn lacks(&self, after: i64, to: i64, now: i64) -> bool {
        self.telling(now).any(|peer| self.lacks_of(peer, (after + 1, to)))
    }

    /// Something is missing here that a peer holds, of these instants.
    fn lacks_of(&self, peer: &Peer, (from, to): (i64, i64)) -> bool {
        if peer.is_alike {
            return false;
        }
        let mut held = &self.held[..];
        let of = |speaker| (first_of(speaker, from), last_of(speaker, to));
        let (of_uavs, of_searchers) = (of(Speaker::Uav(self.own)), of(Speaker::Searcher(0)));
        peer.knowledge.held.iter().any(|run| {
            let (from, to) = if matches!(run.speaker, Speaker::Uav(_)) { of_uavs } else { of_searchers };
            let (from, to) = (run.from.max(from), run.to.min(to));
            if from > to {
                return false;
            }
            // Both are by speaker.
            while let [(speaker, _), rest @ ..] = held
                && *speaker < run.speaker
            {
                held = rest;
            }
            let runs = held.first().filter(|(speaker, _)| *speaker == run.speaker);
            !runs.is_some_and(|(_, runs)| runs.cover(from, to))
        })
    }

    /// What this agent holds, told in the next report.
    pub(crate) fn list(&self, committed: i64, knowledge: &mut Knowledge) {
        // Of what was said before its first row it holds nothing, which is told with it.
        let after = committed - LISTED_BEFORE;
        knowledge.listed_after = self.time(after);
        knowledge.held.clear();
        for (speaker, runs) in &self.held {
            let from = first_of(*speaker, after + 1);
            let held = runs.runs().iter().filter(|run| run.1 >= from);
            let held = held.map(|run| Held { speaker: *speaker, from: run.0.max(from), to: run.1 });
            knowledge.held.extend(held.take(HELD_MAX - knowledge.held.len()));
        }
    }

    /// The instant of a time that may be wrong.
    pub(crate) fn instant_at(&self, time: Time) -> i64 {
        time.us().div_euclid(self.period.us())
    }
}

/// Within its bounds, and in order.
fn is_sound(knowledge: &Knowledge) -> bool {
    let mut last: Option<&Held> = None;
    let follows =
        |run: &Held, last: &Held| last.speaker < run.speaker || last.speaker == run.speaker && last.to < run.from;
    knowledge.held.len() <= HELD_MAX
        && knowledge
            .held
            .iter()
            .all(|run| run.from <= run.to && last.replace(run).is_none_or(|last| follows(run, last)))
}
