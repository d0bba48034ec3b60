//! The pictures of the instants that may still change, and the one that cannot: what was heard late is put in its place, and
//! all after it is worked out again.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use crate::fold::Fold;
use crate::guidance::airspace::Airspace;
use crate::log::Log;
use crate::message::Stamp;
use crate::picture::Picture;
use crate::time::Duration;

/// Of so many committed instants one is stamped; all agents stamp the same.
const STAMP_EVERY: i64 = 16;

/// So many stamps are kept: those that teammates whose log lags by the horizon tell of.
const STAMPS_KEPT: usize = 80;

/// So many instants before now each have a picture of their own; further back they thin out.
const DENSE: i64 = 8;

/// An agent's pictures.
#[derive(Debug, Clone)]
pub(crate) struct History {
    pub(crate) fold: Fold,
    /// The first instant of this history; who took another's over has that one's.
    pub(crate) since: i64,
    /// Nothing up to this instant can change any more.
    pub(crate) committed: i64,
    /// Pictures by ascending instant; the first is committed, acted on and told.
    pictures: VecDeque<(i64, Box<Picture>)>,
    #[expect(clippy::vec_box, reason = "whole boxes go there and come back")]
    spare: Vec<Box<Picture>>,
    /// Instants and digests of committed pictures, ascending.
    stamps: VecDeque<(i64, u64)>,
    lag: i64,
    /// The instant of which groups and duties are, and what that was when this instant began.
    acted: i64,
    acted_before: i64,
    /// The instant up to which events are told; before this instant.
    told: i64,
    told_before: i64,
    /// What is known now with the groups and duties of then; and room for it.
    held_back: [Picture; 2],
    is_held_back: bool,
}

impl History {
    pub(crate) fn new(fold: Fold) -> Self {
        let (lag_s, period_s) = (fold.params.log.decision_lag_s, fold.params.log.period_s);
        let mut history = Self {
            fold,
            since: 0,
            committed: -1,
            pictures: VecDeque::new(),
            spare: Vec::new(),
            stamps: VecDeque::with_capacity(STAMPS_KEPT + 1),
            lag: (lag_s / period_s).round() as i64,
            acted: -1,
            acted_before: -1,
            told: -1,
            told_before: -1,
            held_back: [Picture::default(), Picture::default()],
            is_held_back: false,
        };
        history.begin(0);
        history
    }

    pub(crate) fn within(self, airspace: Airspace) -> Self {
        Self { fold: self.fold.within(airspace), ..self }
    }

    /// Begins with nothing before an instant.
    pub(crate) fn begin(&mut self, first: i64) {
        self.take_over(first, first - 1, Picture::default());
        self.since = first;
    }

    /// Takes over what another knows as of an instant: it is committed.
    pub(crate) fn take_over(&mut self, since: i64, instant: i64, picture: Picture) {
        (self.since, self.committed) = (since, instant);
        (self.acted, self.acted_before) = (instant, instant);
        (self.told, self.told_before) = (instant, instant);
        self.spare.extend(self.pictures.drain(..).map(|(_, picture)| picture));
        self.stamps.clear();
        self.pictures.push_back((instant, Box::new(picture)));
        self.is_held_back = false;
    }

    /// Another instant begins.
    pub(crate) fn turn_over(&mut self) {
        (self.acted_before, self.told_before) = (self.acted, self.told);
    }

    /// The pictures whose events are told at this instant.
    pub(crate) fn told(&self) -> impl Iterator<Item = (i64, &Picture)> {
        let is_new = |instant: &i64| self.told_before < *instant && *instant <= self.told;
        self.pictures
            .iter()
            .map(|(instant, picture)| (*instant, &**picture))
            .filter(move |(instant, _)| is_new(instant))
    }

    /// The newest picture there is.
    pub(crate) fn newest(&self) -> &Picture {
        &self.pictures[self.pictures.len() - 1].1
    }

    /// What is decided from.
    pub(crate) fn head(&self) -> &Picture {
        if self.is_held_back { &self.held_back[0] } else { self.newest() }
    }

    /// The newest that is kept of the pictures that cannot change any more.
    pub(crate) fn base(&self) -> &Picture {
        &self.pictures[self.place_up_to(self.committed)].1
    }

    /// The newest instant up to one of which the picture is kept.
    pub(crate) fn kept_up_to(&self, to: i64) -> i64 {
        self.pictures[self.place_up_to(to)].0.min(to)
    }

    /// Where the newest picture up to an instant stands; before all, the first.
    fn place_up_to(&self, to: i64) -> usize {
        self.pictures.partition_point(|(instant, _)| *instant <= to).saturating_sub(1)
    }

    /// The instant after which rows are needed.
    pub(crate) fn kept_from(&self) -> i64 {
        self.pictures[0].0
    }

    /// The picture of an instant, if it is kept.
    pub(crate) fn at(&self, instant: i64) -> Option<&Picture> {
        let place = self.pictures.binary_search_by_key(&instant, |(instant, _)| *instant).ok()?;
        // Of the instant before the first one there is none.
        Some(&*self.pictures[place].1).filter(|_| instant >= self.since)
    }

    /// How long after the one before it an instant is: before the first there is none.
    fn dt(&self, log: &Log, instant: i64) -> Duration {
        if instant <= self.since { Duration::ZERO } else { log.period }
    }

    /// Works out the pictures up to now, from the first instant of which something new was heard.
    pub(crate) fn follow(&mut self, log: &mut Log, now: i64) {
        let changed = log.changed_from.max(self.committed.min(self.pictures[self.pictures.len() - 1].0) + 1);
        log.changed_from = i64::MAX;
        while self.pictures.back().is_some_and(|(instant, _)| *instant >= changed) {
            self.spare.extend(self.pictures.pop_back().map(|(_, picture)| picture));
        }
        let mut last = self.pictures[self.pictures.len() - 1].0;
        while last < now {
            last += 1;
            let Some(row) = log.row(last) else { break };
            let (mut next, dt) = (self.spare.pop().unwrap_or_default(), self.dt(log, last));
            let (_, newest) = &self.pictures[self.pictures.len() - 1];
            self.fold.follow(newest, dt, row, &mut next);
            self.pictures.push_back((last, next));
        }
        self.thin_out(now);
    }

    /// Keeps pictures from which any instant is worked out in a few steps: the further back, the further apart.
    fn thin_out(&mut self, now: i64) {
        let dense = DENSE + self.lag;
        // The first and those of late are always kept, and about as many as there are doublings between.
        if self.pictures.len() as i64 <= dense + 2 {
            return;
        }
        let is_kept = |instant: i64| {
            let apart = ((now - instant) / dense).max(1) as u64;
            // Those that are stamped stay.
            now - instant <= dense || instant % (apart.next_power_of_two().min(STAMP_EVERY as u64) as i64) == 0
        };
        let mut place = 1;
        while place < self.pictures.len() {
            if is_kept(self.pictures[place].0) {
                place += 1;
            } else if let Some((_, picture)) = self.pictures.remove(place) {
                self.spare.push(picture);
            }
        }
    }

    /// Nothing up to this instant changes any more.
    pub(crate) fn commit(&mut self, to: i64) {
        let before = self.committed;
        self.committed = before.max(to);
        let is_stamped = |instant: i64| before < instant && instant <= to && instant % STAMP_EVERY == 0;
        for (instant, picture) in self.pictures.iter().filter(|(instant, _)| is_stamped(*instant)) {
            self.stamps.push_back((*instant, picture.digest()));
        }
        let needed = self.committed.min(self.acted_before).min(self.told_before);
        while self.pictures.len() > 1 && self.pictures[1].0 <= needed {
            let Some((_, old)) = self.pictures.pop_front() else { break };
            self.spare.push(old);
        }
        while self.stamps.len() > STAMPS_KEPT {
            self.stamps.pop_front();
        }
    }

    /// Commits the picture of an instant and stamps it.
    pub(crate) fn commit_stamped(&mut self, instant: i64, digest: u64) {
        self.commit(instant);
        if self.stamps.back().is_none_or(|(last, _)| *last < instant) {
            self.stamps.push_back((instant, digest));
        }
    }

    /// What the picture of an instant was, if it was stamped.
    pub(crate) fn digest_at(&self, instant: i64) -> Option<u64> {
        self.stamps.binary_search_by_key(&instant, |(instant, _)| *instant).ok().map(|place| self.stamps[place].1)
    }

    /// The newest stamp.
    pub(crate) fn stamp(&self, log: &Log) -> Stamp {
        self.stamps
            .back()
            .map_or(Stamp::default(), |(instant, digest)| Stamp { time: log.time(*instant), digest: *digest })
    }

    /// Settles what is decided from: groups and duties of now; or, where words go missing, those of the lag ago, by when
    /// teammates have heard the same.
    pub(crate) fn settle_on(&mut self, log: &Log, now: i64, is_disturbed: bool) {
        let wanted = if is_disturbed { now - self.lag } else { now };
        // Never back: what was acted on stays.
        self.acted = self.acted_before.max(wanted).min(now);
        // What may still change is told when that has become unlikely.
        let likely = self.committed.max(now - self.lag - DENSE);
        self.told = if is_disturbed { self.acted.min(likely).max(self.told_before) } else { self.acted };
        let (acted_at, then) = &self.pictures[self.place_up_to(self.acted)];
        self.is_held_back = self.acted < now && *acted_at == self.acted && self.newest().is_rearranged_since(then);
        if !self.is_held_back {
            return;
        }
        self.held_back[0].clone_from(then);
        for instant in self.acted + 1..=now {
            let Some(row) = log.row(instant) else { break };
            let dt = self.dt(log, instant);
            let [first, second] = &mut self.held_back;
            self.fold.carry_on(first, dt, row, second);
            core::mem::swap(first, second);
        }
    }
}
