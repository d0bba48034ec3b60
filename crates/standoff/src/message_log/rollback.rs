//! Team-state history for rollback and replay: the states of time steps that may still change, after one committed
//! state. If a late message arrives, all states from its time step on are recomputed.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use crate::message::CommitDigest;
use crate::message_log::log::MessageLog;
use crate::safety::geofence::Geofence;
use crate::state_update::TeamStateUpdater;
use crate::team_state::TeamState;
use crate::time::Duration;
use crate::validation::ParamError;

/// Interval at which digests of committed time steps are kept, in time steps; the same for all agents.
const DIGEST_EVERY: i64 = 16;

/// Maximum number of digests kept: enough for teammates whose log lags by the retention time.
const DIGESTS_KEPT_MAX: usize = 80;

/// Number of most recent time steps whose states are all kept; older states are kept at growing intervals.
const DENSE: i64 = 8;

/// Team-state history of an agent.
#[derive(Debug, Clone)]
pub(crate) struct TeamStateHistory {
    pub(crate) updater: TeamStateUpdater,
    /// First time step of this history; an adopted state keeps the start of its sender.
    pub(crate) start: i64,
    /// Last committed time step: nothing up to it can change any more.
    pub(crate) committed: i64,
    /// Team states by ascending time step. The first one is committed, used for decisions and published.
    states: VecDeque<(i64, Box<TeamState>)>,
    #[expect(clippy::vec_box, reason = "boxes are swapped in and out without copying the states")]
    spare: Vec<Box<TeamState>>,
    /// Time steps and digests of committed states, ascending.
    digests: VecDeque<(i64, u64)>,
    lag: i64,
    /// Time step whose groups and assignments are in use, and its value at the start of the current time step.
    decided_at: i64,
    decided_before: i64,
    /// Last time step whose events are published, and its value at the start of the current time step.
    published_at: i64,
    published_before: i64,
    /// Current state with the groups and assignments of time step `decided_at`, and a second buffer.
    lagged_state: [TeamState; 2],
    is_lagged: bool,
}

impl TeamStateHistory {
    pub(crate) fn new(updater: TeamStateUpdater) -> Self {
        let (lag_s, period_s) = (updater.params.log.decision_lag_s, updater.params.log.period_s);
        let mut history = Self {
            updater,
            start: 0,
            committed: -1,
            states: VecDeque::new(),
            spare: Vec::new(),
            digests: VecDeque::with_capacity(DIGESTS_KEPT_MAX + 1),
            lag: (lag_s / period_s).round() as i64,
            decided_at: -1,
            decided_before: -1,
            published_at: -1,
            published_before: -1,
            lagged_state: [TeamState::default(), TeamState::default()],
            is_lagged: false,
        };
        history.begin(0);
        history
    }

    pub(crate) fn with_geofence_zones(self, geofence: Geofence) -> Result<Self, Vec<ParamError>> {
        Ok(Self { updater: self.updater.with_geofence_zones(geofence)?, ..self })
    }

    /// Restarts the history at time step `first`.
    pub(crate) fn begin(&mut self, first: i64) {
        self.adopt(first, first - 1, TeamState::default());
        self.start = first;
    }

    /// Adopts another agent's state of a time step as committed.
    pub(crate) fn adopt(&mut self, since: i64, step: i64, team_state: TeamState) {
        (self.start, self.committed) = (since, step);
        (self.decided_at, self.decided_before) = (step, step);
        (self.published_at, self.published_before) = (step, step);
        self.spare.extend(self.states.drain(..).map(|(_, team_state)| team_state));
        self.digests.clear();
        self.states.push_back((step, Box::new(team_state)));
        self.is_lagged = false;
    }

    /// Starts a new time step.
    pub(crate) fn start_decision(&mut self) {
        (self.decided_before, self.published_before) = (self.decided_at, self.published_at);
    }

    /// Team states whose events are published at this time step.
    pub(crate) fn published(&self) -> impl Iterator<Item = (i64, &TeamState)> {
        let is_new = |step: &i64| self.published_before < *step && *step <= self.published_at;
        self.states.iter().map(|(step, team_state)| (*step, &**team_state)).filter(move |(step, _)| is_new(step))
    }

    /// Newest team state.
    pub(crate) fn newest(&self) -> &TeamState {
        &self.states[self.states.len() - 1].1
    }

    /// Team state that decisions use.
    pub(crate) fn head(&self) -> &TeamState {
        head_of(&self.states, &self.lagged_state, self.is_lagged)
    }

    /// The updater, and the team state that decisions use.
    pub(crate) fn updater_and_head(&mut self) -> (&mut TeamStateUpdater, &TeamState) {
        let Self { updater, states, lagged_state, is_lagged, .. } = self;
        (updater, head_of(states, lagged_state, *is_lagged))
    }

    /// Newest stored state that is committed.
    pub(crate) fn base(&self) -> &TeamState {
        &self.states[self.index_up_to(self.committed)].1
    }

    /// Newest time step up to `to` whose state is stored.
    pub(crate) fn kept_up_to(&self, to: i64) -> i64 {
        self.states[self.index_up_to(to)].0.min(to)
    }

    /// Index of the newest state up to a time step; 0 if all are later.
    fn index_up_to(&self, to: i64) -> usize {
        self.states.partition_point(|(step, _)| *step <= to).saturating_sub(1)
    }

    /// Time step after which messages are needed.
    pub(crate) fn kept_from(&self) -> i64 {
        self.states[0].0
    }

    /// Returns the state of a time step if it is stored.
    pub(crate) fn at(&self, step: i64) -> Option<&TeamState> {
        let place = self.states.binary_search_by_key(&step, |(step, _)| *step).ok()?;
        // The time step before the first one has no state.
        Some(&*self.states[place].1).filter(|_| step >= self.start)
    }

    /// Time since the previous time step; zero for the first.
    fn dt(&self, log: &MessageLog, step: i64) -> Duration {
        if step <= self.start { Duration::ZERO } else { log.grid.period }
    }

    /// Recomputes the states up to now, from the first time step with a new message on.
    pub(crate) fn replay(&mut self, log: &mut MessageLog, now: i64) {
        let changed = log.changed_from.max(self.committed.min(self.states[self.states.len() - 1].0) + 1);
        log.changed_from = i64::MAX;
        while self.states.back().is_some_and(|(step, _)| *step >= changed) {
            self.spare.extend(self.states.pop_back().map(|(_, team_state)| team_state));
        }
        let mut last = self.states[self.states.len() - 1].0;
        while last < now {
            last += 1;
            let Some(row) = log.messages(last) else { break };
            let (mut next, dt) = (self.spare.pop().unwrap_or_default(), self.dt(log, last));
            let (_, newest) = &self.states[self.states.len() - 1];
            self.updater.advance(newest, dt, row, &mut next);
            self.states.push_back((last, next));
        }
        self.thin_out(now);
    }

    /// Keeps enough states to recompute any time step in a few steps: the older, the fewer.
    fn thin_out(&mut self, now: i64) {
        let dense = DENSE + self.lag;
        // The first and the recent states are always kept, plus about one for each doubling of the age.
        if self.states.len() as i64 <= dense + 2 {
            return;
        }
        let is_kept = |step: i64| {
            let apart = ((now - step) / dense).max(1) as u64;
            // States at the digest interval are always kept.
            now - step <= dense || step % (apart.next_power_of_two().min(DIGEST_EVERY as u64) as i64) == 0
        };
        let mut place = 1;
        while place < self.states.len() {
            if is_kept(self.states[place].0) {
                place += 1;
            } else if let Some((_, team_state)) = self.states.remove(place) {
                self.spare.push(team_state);
            }
        }
    }

    /// Commits all time steps up to `to`.
    pub(crate) fn commit(&mut self, to: i64) {
        let before = self.committed;
        self.committed = before.max(to);
        let is_stamped = |step: i64| before < step && step <= to && step % DIGEST_EVERY == 0;
        for (step, team_state) in self.states.iter().filter(|(step, _)| is_stamped(*step)) {
            self.digests.push_back((*step, team_state.digest()));
        }
        let needed = self.committed.min(self.decided_before).min(self.published_before);
        while self.states.len() > 1 && self.states[1].0 <= needed {
            let Some((_, old)) = self.states.pop_front() else { break };
            self.spare.push(old);
        }
        while self.digests.len() > DIGESTS_KEPT_MAX {
            self.digests.pop_front();
        }
    }

    /// Commits a time step and keeps the digest of its state.
    pub(crate) fn commit_with_digest(&mut self, step: i64, digest: u64) {
        self.commit(step);
        if self.digests.back().is_none_or(|(last, _)| *last < step) {
            self.digests.push_back((step, digest));
        }
    }

    /// Returns the digest of a time step if it is kept.
    pub(crate) fn digest_at(&self, step: i64) -> Option<u64> {
        self.digests.binary_search_by_key(&step, |(step, _)| *step).ok().map(|place| self.digests[place].1)
    }

    /// Newest commit digest.
    pub(crate) fn commit_digest(&self, log: &MessageLog) -> CommitDigest {
        self.digests
            .back()
            .map_or(CommitDigest::default(), |(step, digest)| CommitDigest { time: log.time(*step), digest: *digest })
    }

    /// Selects the groups and assignments in use: the current ones or, while messages are missing, those of the
    /// decision lag ago, because teammates have received the same messages by then.
    pub(crate) fn select_published(&mut self, log: &MessageLog, now: i64, link_is_degraded: bool) {
        let target = if link_is_degraded { now - self.lag } else { now };
        // Groups and assignments never go back in time.
        self.decided_at = self.decided_before.max(target).min(now);
        // Events that may still change are published once a change has become unlikely.
        let likely = self.committed.max(now - self.lag - DENSE);
        self.published_at =
            if link_is_degraded { self.decided_at.min(likely).max(self.published_before) } else { self.decided_at };
        let (decided_at, then) = &self.states[self.index_up_to(self.decided_at)];
        self.is_lagged =
            self.decided_at < now && *decided_at == self.decided_at && self.newest().is_rearranged_since(then);
        if !self.is_lagged {
            return;
        }
        self.lagged_state[0].clone_from(then);
        for step in self.decided_at + 1..=now {
            let Some(row) = log.messages(step) else { break };
            let dt = self.dt(log, step);
            let [first, second] = &mut self.lagged_state;
            self.updater.extrapolate(first, dt, row, second);
            core::mem::swap(first, second);
        }
    }
}

/// Team state that decisions use: the lagged one or the newest.
fn head_of<'a>(
    states: &'a VecDeque<(i64, Box<TeamState>)>,
    lagged_state: &'a [TeamState; 2],
    is_lagged: bool,
) -> &'a TeamState {
    if is_lagged { &lagged_state[0] } else { &states[states.len() - 1].1 }
}
