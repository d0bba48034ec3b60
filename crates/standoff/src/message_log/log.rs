//! Message log: all messages by time step, in whatever order they arrived, and which agent has received which of them.
//!
//! Time steps are numbers of periods since [`Time::EPOCH`]. A report or cue is an entry of one time step. It is kept
//! until the retention time has passed, so that it can be retransmitted to agents that lack it.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use super::link_monitor::LinkMonitor;
use super::ranges::{Ranges, first_of, last_of, number_of_cue, step_of};
use crate::message::{Cue, LogStatus, Message, MessageSource, ReceivedRange, Report};
use crate::output::{Rejected, count};
use crate::params::TeamParams;
use crate::step_messages::{Insert, ReportView, StepMessages};
use crate::time::{Duration, Time, TimeGrid};
use crate::uav::UavId;

use super::teammates::{NEVER, TeammateLog};

/// Maximum number of UAVs of a log, which keeps their reports for the retention time; and of cue sources.
pub(super) const TEAMMATES_MAX: usize = 256;

/// Maximum number of ranges accepted in one report: the number of gaps has a bound.
pub(crate) const RECEIVED_RANGES_MAX: usize = 1024;

/// Number of time steps before the last commit for which received entries are still listed, because receivers may have
/// missed the earlier reports.
pub(crate) const LISTED_BEFORE: i64 = 40;

/// Message log of an agent.
#[derive(Debug, Clone)]
pub(crate) struct MessageLog {
    pub(crate) grid: TimeGrid,
    /// Retention time, in periods, like `teammate_timeout`.
    horizon: i64,
    teammate_timeout: i64,
    pub(super) own: UavId,
    /// Maximum range that a sensor can report, m.
    range_max_m: f64,
    /// Time step of the first row.
    pub(super) first: i64,
    time_steps: VecDeque<StepMessages>,
    spare: Vec<StepMessages>,
    /// All UAVs with a known report, by ascending UAV, until the retention time has passed.
    pub(super) teammates: Vec<TeammateLog>,
    /// Received entries of each source, sorted by source.
    pub(super) received: Vec<(MessageSource, Ranges)>,
    pub(crate) link: LinkMonitor,
    /// Earliest time step with a message that arrived after its team state was computed.
    pub(crate) changed_from: i64,
    pub(crate) rejected: Rejected,
}

impl MessageLog {
    pub(crate) fn new(own: UavId, params: &TeamParams) -> Self {
        let grid = TimeGrid { period: Duration::from_s(params.log.period_s) };
        let periods = |s: f64| grid.periods(Duration::from_s(s));
        Self {
            grid,
            horizon: periods(params.log.message_retention_s).clamp(1, 1200),
            teammate_timeout: periods(params.teammate_timeout_s).max(1),
            own,
            range_max_m: params.track.sensor.reported_range_max_m(),
            first: 0,
            time_steps: VecDeque::new(),
            spare: Vec::new(),
            teammates: Vec::new(),
            received: Vec::new(),
            link: LinkMonitor::new(grid),
            changed_from: i64::MAX,
            rejected: Rejected::default(),
        }
    }

    /// Clears everything except the counters of rejected messages, and restarts at time step `first`.
    pub(crate) fn begin(&mut self, first: i64) {
        self.spare.extend(self.time_steps.drain(..));
        self.teammates.clear();
        self.received.clear();
        (self.first, self.changed_from) = (first, i64::MAX);
        self.link.restart();
    }

    /// Time step of a time: the nearest one, if it is within a tenth of a period.
    pub(crate) fn step(&self, time: Time) -> Option<i64> {
        self.grid.step(time)
    }

    pub(crate) fn time(&self, step: i64) -> Time {
        self.grid.time(step)
    }

    pub(crate) fn horizon(&self) -> i64 {
        self.horizon
    }

    pub(crate) fn teammate_timeout(&self) -> i64 {
        self.teammate_timeout
    }

    /// Returns the messages of a time step, if it is within the log.
    pub(crate) fn messages(&self, step: i64) -> Option<&StepMessages> {
        self.time_steps.get(usize::try_from(step - self.first).ok()?)
    }

    /// Time step of the last row.
    fn last(&self) -> i64 {
        self.first + self.time_steps.len() as i64 - 1
    }

    /// Returns the messages of a time step and adds an empty row if needed; `None` before the first row.
    fn messages_mut(&mut self, step: i64) -> Option<&mut StepMessages> {
        let index = usize::try_from(step.checked_sub(self.first)?).ok()?;
        if self.time_steps.len() <= index {
            self.open_up_to(index);
        }
        self.time_steps.get_mut(index)
    }

    #[cold]
    fn open_up_to(&mut self, index: usize) {
        while self.time_steps.len() <= index {
            let time = self.time(self.first + self.time_steps.len() as i64);
            let mut row = self.spare.pop().unwrap_or_default();
            row.open(time);
            self.time_steps.push_back(row);
        }
    }

    /// Adds a row for the current time step, and removes those that are older than the retention time and that no team
    /// state needs.
    pub(crate) fn turn_to(&mut self, now: i64, needed_from: i64) {
        self.messages_mut(now);
        self.link.turn_to(now);
        while self.first < (now - self.horizon).min(needed_from) {
            if let Some(row) = self.time_steps.pop_front() {
                self.spare.push(row);
            }
            self.first += 1;
        }
        let first = self.first;
        self.received.retain_mut(|(source, runs)| {
            runs.forget_before(*source, first);
            !runs.is_empty()
        });
        self.teammates.retain(|peer| peer.newest >= first || peer.uav == self.own);
    }

    /// Extends the log back to time step `first`, so that messages since then are accepted. Existing rows stay.
    pub(crate) fn reach_back(&mut self, first: i64) {
        while self.first > first {
            let mut row = self.spare.pop().unwrap_or_default();
            row.open(self.time(self.first - 1));
            self.time_steps.push_front(row);
            self.first -= 1;
        }
        // Entries before the first row were ignored in the log status of the teammates.
        self.teammates.iter_mut().for_each(|peer| peer.log_matches = false);
        let statuses: Vec<(i64, LogStatus)> =
            self.teammates.iter().map(|peer| (peer.log_status_at, peer.log_status.clone())).collect();
        statuses.iter().for_each(|(step, log_status)| self.learn_of_teammates(log_status, *step));
    }

    /// Adds the report of this UAV; its delay does not count.
    pub(crate) fn append_own(&mut self, step: i64, report_view: ReportView) -> Insert {
        self.put_report(step, report_view, None)
    }

    /// Processes a report received at time step `now`; time steps up to `committed` cannot change any more.
    pub(crate) fn receive_report(&mut self, report: &Report, now: i64, committed: i64) {
        let Some(step) = self.step(report.time).filter(|step| *step <= now + self.early()) else {
            return count(&mut self.rejected.off_grid);
        };
        let is_alike =
            report.log_status.as_deref().is_some_and(|status| self.has_reported_messages(status, report.uav, step));
        if !is_alike && !report.log_status.as_deref().is_none_or(is_valid) {
            return count(&mut self.rejected.malformed);
        }
        if step <= committed.max(self.first - 1) {
            // Known messages may arrive any number of times.
            let is_known = self.holds(MessageSource::Uav(report.uav), step);
            // No sender could know that this agent needs messages of such an old time step.
            let is_old = step < self.first;
            if !is_known && !is_old {
                count(&mut self.rejected.late);
            }
            return self.update_log_status(report, step, is_alike);
        }
        match self.put_report(step, ReportView::of(report), Some((report, is_alike))) {
            Insert::Rejected => count(&mut self.rejected.malformed),
            Insert::Added => self.link.note_delay(step, now),
            Insert::Duplicate | Insert::Replaced => {}
        }
    }

    fn put_report(&mut self, step: i64, report_view: ReportView, report: Option<(&Report, bool)>) -> Insert {
        let uav = report_view.uav;
        if !self.has_room_for(uav) {
            return Insert::Rejected;
        }
        let range_max_m = self.range_max_m;
        let Some(row) = self.messages_mut(step) else { return Insert::Rejected };
        let put = row.put(report_view, range_max_m);
        if matches!(put, Insert::Added | Insert::Replaced) {
            self.changed_from = self.changed_from.min(step);
            self.rejected.count_beyond(report_view.scan.detections, range_max_m);
        }
        if put != Insert::Rejected {
            self.note(MessageSource::Uav(uav), step);
            match report {
                Some((report, is_alike)) => self.update_log_status(report, step, is_alike),
                None => self.teammate_mut(uav, step).receive(step, report_view.is_leaving),
            }
        }
        put
    }

    /// Processes a cue received at time step `now`.
    pub(crate) fn receive_cue(&mut self, cue: &Cue, now: i64, committed: i64) {
        let Some(step) = self.step(cue.issued_at).filter(|step| *step <= now + self.early()) else {
            return count(&mut self.rejected.off_grid);
        };
        let (source, number) = (MessageSource::CueSource(cue.source), number_of_cue(step, cue.sequence));
        if step <= committed || step < self.first {
            if !self.holds(source, number) && step >= self.first {
                count(&mut self.rejected.late);
            }
            return;
        }
        if !self.has_room_for_cues_of(source) {
            return count(&mut self.rejected.malformed);
        }
        let Some(row) = self.messages_mut(step) else { return };
        let put = row.put_cue(cue);
        let is_dropped = put == Insert::Rejected && row.is_full();
        match put {
            Insert::Rejected => count(&mut self.rejected.malformed),
            Insert::Duplicate => {}
            Insert::Added | Insert::Replaced => self.changed_from = self.changed_from.min(step),
        }
        // A cue beyond the maximum number need not be retransmitted.
        if is_dropped || matches!(put, Insert::Added | Insert::Replaced) {
            self.note(source, number);
        }
    }

    /// Returns source and number of the message's entry if it is older than the teammate timeout; otherwise `None`.
    /// Several agents may retransmit a more recent entry.
    pub(crate) fn retransmitted_entry(&self, message: &Message, now: i64) -> Option<(MessageSource, i64)> {
        let recent = self.time(now - self.teammate_timeout);
        let long_ago = |time| Some(time).filter(|time| *time < recent).and_then(|time| self.step(time));
        Some(match message {
            Message::Report(report) => (MessageSource::Uav(report.uav), long_ago(report.time)?),
            Message::Cue(cue) => {
                (MessageSource::CueSource(cue.source), number_of_cue(long_ago(cue.issued_at)?, cue.sequence))
            }
            Message::Snapshot(_) | Message::Traffic(_) => return None,
        })
    }

    /// Number of periods that a message may be ahead of this agent's time: clocks differ, and a message may arrive
    /// before its time step is observed.
    fn early(&self) -> i64 {
        self.teammate_timeout
    }

    /// True if a UAV can be added: a sender may replace a UAV that is known only from the lists of others, and the own
    /// UAV always has a place.
    fn has_room_for(&self, uav: UavId) -> bool {
        self.teammates.len() + 1 < TEAMMATES_MAX
            || uav == self.own
            || self.room() > 0
            || self.teammate(uav).is_some()
            || self.teammates.iter().any(|peer| !peer.has_reported)
    }

    /// Number of UAVs that can still be added, in addition to this one.
    fn room(&self) -> usize {
        TEAMMATES_MAX.saturating_sub(self.teammates.len() + usize::from(self.teammate(self.own).is_none()))
    }

    /// True if a cue source can be added: the same maximum holds as for UAVs.
    fn has_room_for_cues_of(&self, source: MessageSource) -> bool {
        let uavs = self.received.partition_point(|(source, _)| matches!(source, MessageSource::Uav(_)));
        self.received.len() - uavs < TEAMMATES_MAX || self.runs(source).is_some()
    }

    /// Index of a teammate, or the index at which to insert it.
    fn index(&self, uav: UavId) -> Result<usize, usize> {
        self.teammates.binary_search_by_key(&uav, |peer| peer.uav)
    }

    /// Returns a UAV with a known report, until the retention time has passed.
    pub(crate) fn teammate(&self, uav: UavId) -> Option<&TeammateLog> {
        self.index(uav).ok().map(|index| &self.teammates[index])
    }

    fn teammate_mut(&mut self, uav: UavId, step: i64) -> &mut TeammateLog {
        let index = match self.index(uav) {
            Ok(index) => index,
            Err(_) => self.add_teammate(uav, step),
        };
        &mut self.teammates[index]
    }

    /// Adds a teammate; if the list is full, it replaces a UAV that is known only from the lists of others.
    #[cold]
    fn add_teammate(&mut self, uav: UavId, step: i64) -> usize {
        if uav != self.own && self.room() == 0 {
            let not_received = self.teammates.iter().rposition(|peer| !peer.has_reported);
            not_received.map(|index| self.teammates.remove(index));
        }
        let index = self.teammates.partition_point(|peer| peer.uav < uav);
        self.teammates.insert(index, TeammateLog::new(uav, step));
        index
    }

    /// Excludes a teammate as reference agent until a time step.
    pub(crate) fn skip_reference(&mut self, uav: UavId, until: i64) {
        if let Ok(index) = self.index(uav) {
            self.teammates[index].skipped_until = until;
        }
    }

    /// Updates the log status of the sender if the report is newer than the last one.
    fn update_log_status(&mut self, report: &Report, step: i64, is_alike: bool) {
        if !self.has_room_for(report.uav) {
            return;
        }
        let is_own = report.uav == self.own;
        let peer = self.teammate_mut(report.uav, step);
        peer.receive(step, report.is_leaving);
        let is_newer = !is_own && step > peer.log_status_at;
        let Some(log_status) = report.log_status.as_deref().filter(|_| is_newer) else { return };
        (peer.log_status_at, peer.log_matches) = (step, is_alike);
        peer.log_status.clone_from(log_status);
        // The time step of the report bounds a wrong value.
        self.link.note_degraded(self.grid.step_at(log_status.degraded_at).min(step));
        self.link.measure_loss(log_status, report.uav, (step, is_alike), &self.received);
        if !is_alike {
            self.learn_of_teammates(log_status, step);
        }
    }

    /// Mean size of the reports of the newest time step that has usually arrived, as retransmitted, bytes; 0 if there are
    /// none.
    pub(crate) fn mean_report_bytes(&self, now: i64) -> f64 {
        let row = self.messages(now - 1 - self.link.typical_delay);
        let sizes =
            row.into_iter().flat_map(StepMessages::reports).map(|report| Message::report_size_bytes(report, None));
        let (count, bytes) = sizes.fold((0, 0), |(count, bytes), size| (count + 1, bytes + size));
        bytes as f64 / f64::from(count.max(1))
    }

    /// True if the sender's list of received entries, together with this report, equals the entries received here, as
    /// far as the sender could know them. This is the usual case.
    fn has_reported_messages(&self, status: &LogStatus, uav: UavId, step: i64) -> bool {
        let (from, to) = (self.grid.step_at(status.committed_until).saturating_add(1).max(self.first), step - 1);
        let mut listed = status.received.iter();
        let mut next = listed.next();
        for (source, runs) in &self.received {
            let (first, last) = (first_of(*source, from), last_of(*source, to));
            if let (Some(run), &[(start, mut end)]) = (next, runs.runs())
                && run.source == *source
            {
                end += i64::from(*source == MessageSource::Uav(uav) && end == to);
                let is_within = start <= run.from && run.from <= run.to && run.to <= end;
                if !(is_within && run.from <= start.max(first) && end.min(last) <= run.to) {
                    return false;
                }
                next = listed.next();
            } else if runs.runs().iter().any(|run| first <= run.1 && run.0 <= last) {
                return false;
            }
        }
        next.is_none()
    }

    /// Adds the UAVs whose reports teammates have received.
    fn learn_of_teammates(&mut self, log_status: &LogStatus, step: i64) {
        let mut index = 0;
        for run in &log_status.received {
            let MessageSource::Uav(uav) = run.source else { break };
            if run.to < self.first || run.to > step {
                continue;
            }
            // Both lists are sorted by UAV.
            while self.teammates.get(index).is_some_and(|peer| peer.uav < uav) {
                index += 1;
            }
            let from = run.from.max(self.first);
            if self.teammates.get(index).is_none_or(|peer| peer.uav != uav) {
                if self.room() == 0 {
                    continue;
                }
                self.teammates.insert(index, TeammateLog::new(uav, from));
            }
            let peer = &mut self.teammates[index];
            if from < peer.first || peer.newest < run.to {
                peer.reported(from);
                peer.reported(run.to);
            }
        }
    }

    fn note(&mut self, source: MessageSource, number: i64) {
        let step = step_of(source, number);
        // Reports since then may have listed this entry as missing.
        if step < self.last() {
            self.teammates
                .iter_mut()
                .filter(|peer| step < peer.log_status_at)
                .for_each(|peer| peer.log_matches = false);
        }
        let index = match self.received.binary_search_by_key(&source, |(source, _)| *source) {
            Ok(index) => index,
            Err(index) => {
                self.received.insert(index, (source, Ranges::default()));
                index
            }
        };
        self.received[index].1.add(number);
    }

    fn runs(&self, source: MessageSource) -> Option<&Ranges> {
        self.received.binary_search_by_key(&source, |(source, _)| *source).ok().map(|index| &self.received[index].1)
    }

    fn holds(&self, source: MessageSource, number: i64) -> bool {
        self.runs(source).is_some_and(|runs| runs.holds(number))
    }

    /// True if a report of another UAV was received within the retention time.
    pub(crate) fn has_received(&self) -> bool {
        self.teammates.iter().any(|peer| peer.has_reported && peer.uav != self.own)
    }

    /// All UAVs with a known report, including this one, by ascending UAV, until the retention time has
    /// passed.
    pub(crate) fn teammates(&self) -> &[TeammateLog] {
        &self.teammates
    }

    /// Teammates that have sent their log status within the teammate timeout, by ascending UAV. An agent does not
    /// receive its own reports.
    pub(crate) fn teammates_with_status(&self, now: i64) -> impl Iterator<Item = &TeammateLog> + Clone {
        self.teammates.iter().filter(move |peer| peer.has_sent_status(now, self.teammate_timeout))
    }

    /// True if a time step is complete: every UAV that was due has reported it, or lists that it never did, and has
    /// reported again since; the later report lists which other entries of the time step it has received, and none of
    /// these is missing here.
    pub(crate) fn is_complete(&self, step: i64) -> bool {
        let Some(row) = self.messages(step) else { return false };
        let is_settled = |peer: &TeammateLog| {
            let has_later_report = peer.left_at == Some(step) || peer.newest > step;
            !peer.is_due(step)
                || has_later_report && (row.report_of(peer.uav).is_some() || self.was_never_sent(peer, step))
        };
        self.teammates.iter().all(|peer| is_settled(peer) && self.is_acknowledged_by(peer, step))
    }

    /// True if a teammate's own list does not contain its report of a time step: it is back from a restart, or could
    /// not send.
    fn was_never_sent(&self, peer: &TeammateLog, step: i64) -> bool {
        let own = peer.received(MessageSource::Uav(peer.uav));
        peer.uav == self.own
            || self.has_listed(peer, step)
                && peer.log_status.received.len() < RECEIVED_RANGES_MAX
                && !own.iter().any(|run| run.from <= step && step <= run.to)
    }

    /// True if a teammate has listed its received entries of a time step, and none of these is missing here.
    pub(crate) fn is_acknowledged_by(&self, peer: &TeammateLog, step: i64) -> bool {
        // A UAV that never sends a log status cannot be checked.
        let has_no_status = peer.uav == self.own || peer.left_at.is_some() || peer.log_status_at == NEVER;
        (has_no_status || self.has_listed(peer, step)) && !self.lacks_of(peer, (step, step))
    }

    /// True if a teammate has listed its entries of a time step after the longest delay: a cue may reach all agents
    /// late.
    fn has_listed(&self, peer: &TeammateLog, step: i64) -> bool {
        peer.log_status_at > step + self.link.longest_delay && peer.log_status.listed_after < self.time(step)
    }

    /// True if an entry after time step `after`, up to `to`, is missing here that a live teammate has received.
    pub(crate) fn lacks(&self, after: i64, to: i64, now: i64) -> bool {
        self.teammates_with_status(now).any(|peer| self.lacks_of(peer, (after + 1, to)))
    }

    /// True if an entry of these time steps is missing here that a teammate has received.
    fn lacks_of(&self, peer: &TeammateLog, (from, to): (i64, i64)) -> bool {
        if peer.log_matches {
            return false;
        }
        let mut held = &self.received[..];
        let of = |source| (first_of(source, from), last_of(source, to));
        let (of_uavs, of_searchers) = (of(MessageSource::Uav(self.own)), of(MessageSource::CueSource(0)));
        peer.log_status.received.iter().any(|run| {
            let (from, to) = if matches!(run.source, MessageSource::Uav(_)) { of_uavs } else { of_searchers };
            let (from, to) = (run.from.max(from), run.to.min(to));
            if from > to {
                return false;
            }
            // Both lists are sorted by source.
            while let [(source, _), rest @ ..] = held
                && *source < run.source
            {
                held = rest;
            }
            let runs = held.first().filter(|(source, _)| *source == run.source);
            !runs.is_some_and(|(_, runs)| runs.cover(from, to))
        })
    }

    /// Writes the received entries into the log status of the next report.
    pub(crate) fn list(&self, committed: i64, log_status: &mut LogStatus) {
        // Entries before the first stored time step were removed, so the list marks them as not received.
        let after = committed - LISTED_BEFORE;
        log_status.listed_after = self.time(after);
        log_status.received.clear();
        for (source, runs) in &self.received {
            let from = first_of(*source, after + 1);
            let held = runs.runs().iter().filter(|run| run.1 >= from);
            let held = held.map(|run| ReceivedRange { source: *source, from: run.0.max(from), to: run.1 });
            log_status.received.extend(held.take(RECEIVED_RANGES_MAX - log_status.received.len()));
        }
    }
}

/// True if the list of ranges is within its maximum length and in order.
fn is_valid(log_status: &LogStatus) -> bool {
    let mut last: Option<&ReceivedRange> = None;
    let follows = |run: &ReceivedRange, last: &ReceivedRange| {
        last.source < run.source || last.source == run.source && last.to < run.from
    };
    log_status.received.len() <= RECEIVED_RANGES_MAX
        && log_status
            .received
            .iter()
            .all(|run| run.from <= run.to && last.replace(run).is_none_or(|last| follows(run, last)))
}
