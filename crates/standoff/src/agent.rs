//! One UAV's brain: from its own state, its own scan and its teammates' messages to a command.
//!
//! ```text
//! scan + teammates' scans -> tracks -> groups -> orbit -> desired heading and speed -> limited command
//! ```
//!
//! Everything up to the orbit is the team's [`Picture`], which every agent computes alike from its log of what was said;
//! the rest is this UAV's own.
//!
//! ```text
//! committed      |  may still change        |  now
//! ...  k-4  k-3  |  k-2      k-1            |  k        instants, each a row of reports and cues
//!                   ^ a report is heard late: the pictures from here on are made again
//! ```
//!
//! An instant is *committed*, and nothing more is taken in of it, once everyone who was to has reported it and spoken again,
//! by which they have told what else was said of it and nobody holds anything that is missing; or once the horizon has
//! passed. While words go missing, groups and duties are those of a lag ago, by when teammates have come to know the same.
//!
//! Whose picture counts, where two do not agree and the log does not tell: of the UAVs that are there the one whose picture
//! began first, of equals that of lowest id. The others see by the digest in its reports that theirs is another one, and
//! take a snapshot of it. Whose picture is asked for and not given counts no more for a while.

use crate::fold::Fold;
use crate::guidance::airspace::Airspace;
use crate::history::History;
use crate::intruders::Intruders;
use crate::log::repair::{Again, Repair};
use crate::log::{LISTED_BEFORE, Log, Peer, Presence};
use crate::message::{Ask, Message, Report, Scan, SnapshotPart, Speaker, Stamp};
use crate::param::ParamError;
use crate::picture::Picture;
use crate::pilot::Pilot;
use crate::row::{Put, Said};
use crate::snapshot::{Offer, Taken, Taking};
use crate::step::{Observation, Refused, Step, count};
use crate::team::TeamParams;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};

/// A committed picture of so many periods ago is too old to be taken over: too much has been said since.
const OLD: i64 = 20;

/// A stamp that should be ours and is not yet, for so many periods: it never will be.
const PATIENCE: i64 = 10;

/// One UAV's brain.
///
/// Each instant has two halves. [`Self::observe`] takes the own state and scan in; then [`Self::outbox`] is what to say,
/// and [`Self::hear`] takes in what teammates say. When no more is waited for, [`Self::decide`] gives the command.
///
/// Instants are those of the team's grid, whole periods ([`LogParams::period_s`](crate::team::LogParams)) after
/// [`Time::START`]. What is heard late counts for its own instant all the same: all after it is worked out again. So agents
/// that have heard the same, in whatever order, know the same, to the bit. What went missing is said again: the outbox
/// holds that, too.
///
/// ```
/// # use standoff::*;
/// # fn main() -> Result<(), Vec<ParamError>> {
/// let mut agent = Agent::new(UavId(0), TeamParams::table_1())?;
/// let own = UavState::straight(Position::from_m(400.0, 0.0), Angle::from_deg(90.0), 40.0);
/// // A search aircraft hands a target over; the agent turns onto an orbit about it.
/// let cue = Message::Cue(Cue {
///     searcher: 0,
///     said: Time::START,
///     number: 0,
///     label: TargetLabel(0),
///     time: Time::START,
///     position: Position::from_m(0.0, 0.0),
///     velocity: Velocity::from_m_s(5.0, 0.0),
///     position_sd_m: 20.0,
///     velocity_sd_m_s: 2.0,
/// });
/// let observation = agent.observe(Time::START, &own, Some(Scan::default()));
/// assert_eq!(agent.outbox(&observation).len(), 1);
/// agent.hear(&observation, &cue);
/// let step = agent.decide(&observation);
/// assert!(step.command.turn_rate_rad_s.abs() <= 0.3);
/// assert_eq!(step.diagnostics.group, agent.picture().groups.first().map(|group| group.id));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Agent {
    id: UavId,
    epoch: u32,
    /// Counts the instants of this epoch.
    sequence: u32,
    log: Log,
    history: History,
    repair: Repair,
    offer: Offer,
    taking: Taking,
    /// Who else flies there, as this UAV has heard itself.
    intruders: Intruders,
    /// Of these the first `said` are to be said.
    outbox: Vec<Message>,
    said: usize,
    /// The first instant of this agent, and the last one observed.
    began: i64,
    now: Option<i64>,
    /// The own state is known, and the sensor has looked: there is a report.
    has_spoken: bool,
    is_leaving: bool,
    /// Since when whose picture counts has told of one that is not ours.
    doubted_since: Option<i64>,
    /// Since when it asks for another picture.
    asks_since: Option<i64>,
    is_stale: bool,
}

impl Agent {
    /// An instant that comes later than this after the one before is taken for a clock that has jumped. Believed, one
    /// wrong time would be waited for until it comes, and everything known would be lost on the way there. This is the
    /// longest period that the simulator flies.
    pub const GAP_MAX: Duration = Duration::from_us(10_000_000);

    /// An agent of a team; all that is out of range is reported at once, and so are parameters that contradict one
    /// another: the orbits' field of view must be the sensor's ([`TeamParams::errors`]).
    pub fn new(id: UavId, params: TeamParams) -> Result<Self, Vec<ParamError>> {
        Ok(Self {
            id,
            epoch: 0,
            sequence: 0,
            log: Log::new(id, &params),
            history: History::new(Fold::new(params)?),
            repair: Repair::default(),
            offer: Offer::default(),
            taking: Taking::default(),
            intruders: Intruders::default(),
            outbox: Vec::new(),
            said: 0,
            began: 0,
            now: None,
            has_spoken: false,
            is_leaving: false,
            doubted_since: None,
            asks_since: None,
            is_stale: false,
        })
    }

    /// The same agent after a restart: should it speak again at the instant at which it went down, all teammates believe
    /// what it said before. Each restart counts one up.
    #[must_use]
    pub fn with_epoch(self, epoch: u32) -> Self {
        Self { epoch, ..self }
    }

    /// The same with zones that the UAV keeps out of, and in: for all agents of a team the same ones, for whose orbit they cut
    /// is part of the picture. For before the first instant.
    #[must_use]
    pub fn with_airspace(self, airspace: Airspace) -> Self {
        Self { history: self.history.within(airspace), ..self }
    }

    /// Forgets all that it knows and has heard, and takes whatever time comes next: for a clock that was set, or a pause
    /// of more than [`Self::GAP_MAX`]. The counts of the diagnostics stay. As after a restart, teammates that know more tell
    /// it; where there are none, targets have to be cued again.
    pub fn reset(&mut self) {
        self.now = None;
        self.said = 0;
        self.begin(0);
    }

    /// From the next instant on nobody is to count on this UAV: it says so.
    pub fn leave(&mut self) {
        self.is_leaving = true;
    }

    /// This agent's UAV.
    pub fn id(&self) -> UavId {
        self.id
    }

    /// What the team knows and intends, as of the last decision. Of instants after [`Self::committed_at`] it may still
    /// change.
    pub fn picture(&self) -> &Picture {
        self.history.head()
    }

    /// The pictures whose events are told with the last decision, and whether each is provisional: it may still change. With
    /// nothing missing, that is the picture of now; while words go missing, events are told when they are certain, or likely.
    pub fn told(&self) -> impl Iterator<Item = (&Picture, bool)> {
        let is_disturbed = self.is_disturbed();
        self.history.told().map(move |(instant, picture)| (picture, is_disturbed && instant > self.history.committed))
    }

    /// The instant up to which nothing can change any more; `None` before the first.
    pub fn committed_at(&self) -> Option<Time> {
        (self.history.committed >= self.history.since).then(|| self.log.time(self.history.committed))
    }

    /// What the team knew and intended at a committed instant: the newest that is kept, which is that of
    /// [`Self::committed_at`] unless somebody has been silent for long.
    pub fn committed(&self) -> Option<&Picture> {
        self.committed_at().map(|_| self.history.base())
    }

    /// Who has been heard, or told of, within the horizon, by ascending UAV.
    pub fn presence(&self) -> impl Iterator<Item = (UavId, Presence)> {
        let now = self.now.unwrap_or_default();
        self.log.peers().iter().map(move |peer| (peer.uav, peer.presence(now, self.log.lease())))
    }

    /// The instant of the newest report of a UAV that was heard, or told of, within the horizon.
    pub fn heard_at(&self, uav: UavId) -> Option<Time> {
        self.log.peer(uav).map(|peer| self.log.time(peer.newest))
    }

    /// Words have gone missing of late, here or elsewhere: groups and duties are those of the decision lag ago.
    pub fn is_disturbed(&self) -> bool {
        self.now.is_some_and(|now| self.log.is_disturbed(now))
    }

    /// First half of an instant: takes in where the UAV is and what its sensor measured, both of `now`. Without a scan
    /// the UAV neither looks nor speaks.
    ///
    /// Of an instant the first observation with a scan counts. A time that is more than a tenth of a period off the team's
    /// grid, runs backward, or jumps ahead by more than [`Self::GAP_MAX`], is refused and counted: nothing is heard or said,
    /// the command is from what was known, and the next instant may be right again. [`Self::reset`] makes the agent follow a
    /// time that stays elsewhere.
    pub fn observe(&mut self, now: Time, own: &UavState, scan: Option<Scan>) -> Observation {
        let Some(instant) = self.log.instant(now).filter(|instant| self.is_next(*instant)) else {
            count(&mut self.log.refused.instants);
            return Observation { uav: self.id, time: now, own: *own };
        };
        if self.now != Some(instant) {
            self.open(instant);
        }
        // Who does not know where it is has nothing to say.
        if let Some(scan) = scan.filter(|_| own.is_finite() && !self.has_spoken) {
            self.speak(instant, own, scan);
        }
        let known = self.log.row(instant).and_then(|row| row.report_of(self.id)).filter(|_| self.has_spoken);
        Observation { uav: self.id, time: self.log.time(instant), own: known.map_or(*own, |report| report.state) }
    }

    /// What to say to the teammates: the own report, then what they lack. Nothing of an instant that was refused or is over,
    /// without a scan, or while the own state is not finite.
    pub fn outbox(&self, observation: &Observation) -> &[Message] {
        if self.is_of_now(observation) { &self.outbox[..self.said] } else { &[] }
    }

    /// Takes a message in, whoever says it, whatever instant it is of; what makes no sense, or comes too late, is refused and
    /// counted ([`Diagnostics::refused`](crate::Diagnostics::refused)). Order and repetition do not matter. With an
    /// observation of an instant that is over, or of another agent's, nothing is heard.
    pub fn hear(&mut self, observation: &Observation, message: &Message) {
        let Some(now) = self.now.filter(|_| self.is_of_now(observation)) else { return };
        let committed = self.history.committed;
        if let Some((speaker, number)) = self.log.said_again(message, now) {
            self.repair.note(speaker, number, now);
        }
        match message {
            // What it has said since it began it knows itself.
            Message::Report(report) if report.uav == self.id && self.is_own(report) => {}
            Message::Report(report) => self.log.hear_report(report, now, committed),
            Message::Cue(cue) => self.log.hear_cue(cue, now, committed),
            Message::Snapshot(part) => self.take(part, now),
            // No matter of the picture.
            Message::Traffic(traffic) => {
                return self.intruders.hear(traffic, observation.time, &mut self.log.refused);
            }
        }
        self.is_stale = true;
    }

    /// Second half: the command to fly from the observed instant on, with all that was heard by now. Asked again after
    /// more was heard, it answers as if all had come at once.
    ///
    /// Total: whatever comes in, the command is inside the limits.
    pub fn decide(&mut self, observation: &Observation) -> Step {
        if let Some(now) = self.now.filter(|_| self.is_stale) {
            self.history.follow(&mut self.log, now);
            self.history.settle_on(&self.log, now, self.log.is_disturbed(now));
            self.is_stale = false;
        }
        let impossible = self.history.newest().impossible;
        let refused =
            Refused { impossible: self.log.refused.impossible.saturating_add(impossible), ..self.log.refused };
        let Fold { params, borders, .. } = &self.history.fold;
        let (picture, borders) = (self.history.head(), borders.as_deref());
        Pilot { params, picture, borders, intruders: &self.intruders }.decide(observation, refused)
    }

    fn is_of_now(&self, observation: &Observation) -> bool {
        observation.uav == self.id && self.now.is_some_and(|now| self.log.time(now) == observation.time)
    }

    /// The instant it is at, or one that can follow it.
    fn is_next(&self, instant: i64) -> bool {
        self.now.is_none_or(|now| {
            let ahead = instant.saturating_sub(now);
            ahead >= 0 && ahead.saturating_mul(self.log.period.us()) <= Self::GAP_MAX.us()
        })
    }

    /// A report of this epoch: from an instant at which this agent was there.
    fn is_own(&self, report: &Report) -> bool {
        self.log.instant(report.time).is_none_or(|instant| instant >= self.began)
    }

    fn begin(&mut self, first: i64) {
        self.log.begin(first);
        self.history.begin(first);
        self.repair.reset();
        self.intruders.clear();
        (self.offer, self.taking) = (Offer::default(), Taking::default());
        (self.began, self.has_spoken, self.is_stale) = (first, false, false);
        (self.doubted_since, self.asks_since) = (None, None);
    }

    /// Turns to a new instant.
    fn open(&mut self, now: i64) {
        match self.now {
            None => self.begin(now),
            Some(last) => {
                let changed_from = self.log.changed_from;
                // An instant of which nobody asked for a decision is part of the past all the same.
                if self.is_stale {
                    self.history.follow(&mut self.log, last);
                }
                if changed_from < last {
                    self.log.disturbed_at = last;
                }
                self.log.refused.impossible =
                    self.log.refused.impossible.saturating_add(self.history.newest().impossible);
            }
        }
        let needed_from = self.history.kept_from() + 1;
        self.log.turn_to(now, needed_from);
        self.commit(now);
        self.history.turn_over();
        (self.now, self.has_spoken, self.is_stale, self.said) = (Some(now), false, true, 0);
        self.sequence = self.sequence.wrapping_add(1);
        let params = &self.history.fold.params.log;
        self.repair.earn(params.repair_bytes_per_s, self.log.period.s());
    }

    /// Commits what cannot change any more.
    fn commit(&mut self, now: i64) {
        // At first nobody knows who is there; who has heard nobody waits for those who are heard late.
        let patience = if self.log.has_heard() { self.log.lease() } else { self.log.horizon() };
        let knows_who_is_there = now - self.began > patience;
        let mut committed = self.history.committed;
        while knows_who_is_there && committed + 1 < now && self.log.is_complete(committed + 1) {
            committed += 1;
        }
        committed = committed.max(now - 1 - self.log.horizon());
        if committed > self.history.committed {
            self.history.commit(committed);
        }
        self.commit_as_others(now);
    }

    /// What a teammate has committed is committed here, too, where it is the same to the bit: teammates that are far ahead do
    /// not list any more what was said of an instant so long ago.
    fn commit_as_others(&mut self, now: i64) {
        let Self { log, history, .. } = self;
        let since = log.time(history.since);
        let stamps =
            log.telling(now).map(|peer| &peer.knowledge).filter(|told| told.since == since).map(|told| told.stamp);
        let (committed, present) = (log.time(history.committed), log.time(now));
        let ahead = stamps.filter(|stamp| committed < stamp.time && stamp.time < present);
        let ahead = ahead.map(|stamp| (log.instant_at(stamp.time), stamp.digest));
        let same = |(instant, digest): &(i64, u64)| history.at(*instant).is_some_and(|own| own.digest() == *digest);
        if let Some((instant, digest)) = ahead.filter(same).max() {
            history.commit_stamped(instant, digest);
        }
    }

    /// Takes the own scan in, and composes what to say.
    fn speak(&mut self, now: i64, own: &UavState, scan: Scan) {
        let (uav, stamp, leaves) = (self.id, (self.epoch, self.sequence), self.is_leaving);
        let duty = self.history.head().duty_of(uav);
        let put = self.log.say(now, Said { uav, stamp, state: own, scan, duty, leaves });
        self.has_spoken = put != Put::Refused;
        self.is_stale = true;
        if !self.has_spoken {
            return count(&mut self.log.refused.nonsense);
        }
        let asks = self.doubt(now);
        let Self { id, epoch, sequence, log, history, outbox, .. } = self;
        if !matches!(outbox.first(), Some(Message::Report(_))) {
            outbox.insert(0, Message::Report(Report::of(*id, Time::START, *own)));
        }
        if let (Some(Message::Report(report)), Some(said)) =
            (outbox.first_mut(), log.row(now).and_then(|row| row.report_of(uav)))
        {
            (report.uav, report.epoch, report.sequence) = (uav, *epoch, *sequence);
            (report.time, report.state, report.boresight) = (said.time, *own, scan.boresight);
            (report.duty, report.leaves) = (duty, leaves);
            report.detections.clone_from(&said.detections);
            let knowledge = report.knowledge.get_or_insert_default();
            knowledge.since = log.time(history.since);
            knowledge.committed = log.time(history.committed);
            knowledge.stamp = history.stamp(log);
            knowledge.disturbed = log.time(log.disturbed_at);
            knowledge.asks = asks;
            log.list(history.committed, knowledge);
        }
        self.said = 1;
        self.offer_snapshot(now);
        let (outbox, said) = (&mut self.outbox, &mut self.said);
        let is_wanted = self.repair.say(&self.log, now, |again| {
            let message = room(outbox, *said);
            match (again, &mut *message) {
                (Again::Report(report), Message::Report(old)) => old.clone_from(report),
                (Again::Report(report), _) => *message = Message::Report(report.clone()),
                (Again::Cue(cue), _) => *message = Message::Cue(*cue),
            }
            *said += 1;
        });
        if is_wanted {
            self.log.disturbed_at = now;
        }
    }

    /// Says parts of the picture that somebody has asked this agent for.
    fn offer_snapshot(&mut self, now: i64) {
        let asks = self.log.telling(now).filter_map(|peer| Some((peer.knows_at, peer.asks(self.id)?)));
        let asks: Vec<(i64, Ask)> = asks.collect();
        if asks.is_empty() {
            return;
        }
        let is_taken = asks.iter().any(|(_, ask)| ask.stamp == Some(self.offer.stamp));
        // One that nobody has begun to take was for another one, who has it.
        let kept_for = if is_taken { self.log.horizon() / 3 } else { self.log.lease() };
        if !self.offer.is_fresh(now, kept_for) {
            let instant = self.history.kept_up_to(self.offered_instant(now));
            let Some(offer) = self.history.at(instant).and_then(|picture| Offer::of(picture, now)) else { return };
            self.offer = offer;
            self.history.commit_stamped(instant, self.offer.stamp.digest);
        }
        let Self { id, log, history, offer, outbox, said, repair, .. } = self;
        let since = log.time(history.since);
        for (asked_at, ask) in asks {
            let mut from = 0;
            while let Some(index) = offer.lacking(&ask, asked_at, from) {
                if repair.is_spent() {
                    return;
                }
                let slot = room(outbox, *said);
                let mut part = match slot {
                    Message::Snapshot(part) => core::mem::take(part),
                    _ => SnapshotPart::default(),
                };
                offer.part(*id, since, index, now, &mut part);
                *slot = Message::Snapshot(part);
                repair.spend(slot.size_bytes());
                *said += 1;
                from = index + 1;
            }
        }
    }

    /// The instant whose picture is told to who asks: that which is committed, or while somebody's silence holds that up, the
    /// last of which all is known that those who are there know; from then on it is committed.
    fn offered_instant(&self, now: i64) -> i64 {
        let committed = self.history.committed;
        // What is taken over may be no older than the horizon.
        let old = OLD.min(self.log.horizon() / 6);
        if now - committed <= old || self.counting(now).is_some() {
            return committed;
        }
        let follows_ours = |peer: &Peer| {
            let stamp = peer.knowledge.stamp;
            let ours = self.history.digest_at(self.log.instant_at(stamp.time));
            peer.knowledge.since == self.log.time(self.history.since)
                && ours.is_none_or(|digest| digest == stamp.digest)
        };
        let peers = || self.log.telling(now).filter(|peer| follows_ours(peer));
        let known = (committed + 1..now).take_while(|instant| peers().all(|peer| self.log.is_told_by(peer, *instant)));
        known.last().unwrap_or(committed).max(now - 2 * old).min(now - 1)
    }

    /// Whose picture counts before ours.
    fn counting(&self, now: i64) -> Option<&Peer> {
        let ours = (self.log.time(self.history.since), self.id);
        let first = |peer: &&Peer| (peer.knowledge.since, peer.uav);
        let telling = self.log.telling(now).filter(|peer| peer.passed_over_until <= now);
        telling.min_by_key(first).filter(|peer| first(peer) < ours)
    }

    /// Whether the picture that counts is another one than ours: then this is what to ask.
    fn doubt(&mut self, now: i64) -> Option<Ask> {
        let Some(counting) = self.counting(now) else { return self.trust() };
        let (counting, since, stamp) = (counting.uav, counting.knowledge.since, counting.knowledge.stamp);
        let is_alike = if since == self.log.time(self.history.since) { self.agrees(stamp, now) } else { Some(false) };
        // What cannot be told does not end what was begun.
        let is_ours = is_alike.unwrap_or(self.asks_since.is_none());
        if is_ours {
            self.asks_since = None;
            self.taking.reset();
            return None;
        }
        // Who does not answer may not hear us: others who follow the same picture have it, too.
        let asks_since = *self.asks_since.get_or_insert(now);
        let follows =
            |peer: &&Peer| peer.uav == counting || (peer.knowledge.since, peer.knowledge.stamp) == (since, stamp);
        let others = || self.log.telling(now).filter(follows);
        let turn = (now - asks_since) / (2 * self.log.lease());
        if turn >= others().count().max(1) as i64 {
            return self.pass_over(counting, asks_since, now);
        }
        let place = others().position(|peer| peer.uav == counting).unwrap_or_default() + turn as usize;
        let asked = others().cycle().nth(place).map_or(counting, |peer| peer.uav);
        Some(self.taking.ask(asked))
    }

    /// Nobody tells a picture, though asked in turn: it counts no more for a while; for long, if the question was heard.
    fn pass_over(&mut self, counting: UavId, asks_since: i64, now: i64) -> Option<Ask> {
        let heard = self.log.peer(counting).and_then(|peer| peer.held(Speaker::Uav(self.id)).last());
        let is_heard = heard.is_some_and(|run| run.to >= asks_since);
        let pause = if is_heard { self.log.horizon() } else { 2 * self.log.lease() };
        self.log.pass_over(counting, now + pause);
        (self.doubted_since, self.asks_since) = (None, None);
        self.taking.reset();
        self.doubt(now)
    }

    /// Nobody's picture counts but ours.
    fn trust(&mut self) -> Option<Ask> {
        (self.doubted_since, self.asks_since) = (None, None);
        self.taking.reset();
        None
    }

    /// Whether another's committed picture is ours; `None` if that cannot be told yet.
    fn agrees(&mut self, stamp: Stamp, now: i64) -> Option<bool> {
        let (instant, committed) = (self.log.instant_at(stamp.time), self.history.committed);
        if stamp == Stamp::default() {
            return Some(true);
        }
        if instant <= committed {
            self.doubted_since = None;
            return self.history.digest_at(instant).map(|own| own == stamp.digest);
        }
        // So far behind, a picture is told sooner than all that it is made of.
        if instant - committed > LISTED_BEFORE {
            return Some(false);
        }
        // Were it the same as ours, it would be committed here, too.
        if self.log.lacks(committed, instant, now) {
            self.doubted_since = None;
            return None;
        }
        (now - *self.doubted_since.get_or_insert(now) > PATIENCE).then_some(false)
    }

    /// Takes in a part of another's picture; with the last one that picture takes the place of ours.
    fn take(&mut self, part: &SnapshotPart, now: i64) {
        if !self.taking.is_asked(part.uav) {
            return;
        }
        // One of a time that cannot be would keep all others out that are older.
        let is_of_use =
            |(since, instant): &(i64, i64)| (now - self.log.horizon()..now).contains(instant) && since <= instant;
        let times = self.log.instant(part.since).zip(self.log.instant(part.stamp.time));
        let Some((since, instant)) = times.filter(is_of_use) else {
            return count(&mut self.log.refused.nonsense);
        };
        match self.taking.take(part, &self.history.fold.params) {
            // Whoever begins anew for ever gives nothing.
            Taken::Nothing | Taken::First => {}
            // As long as something comes, nobody else is asked: whoever's turn it is, it begins anew.
            Taken::Part => {
                let turn = 2 * self.log.lease();
                self.asks_since = Some(self.asks_since.map_or(now, |since| now - (now - since) / turn * turn));
            }
            Taken::Nonsense => {
                count(&mut self.log.refused.nonsense);
                self.taking.reset();
            }
            Taken::Whole(picture) => {
                let digest = picture.digest();
                self.history.take_over(since, instant, *picture);
                self.history.commit_stamped(instant, digest);
                self.log.reach_back(instant + 1);
                self.log.changed_from = instant + 1;
                (self.doubted_since, self.asks_since, self.offer) = (None, None, Offer::default());
                self.taking.reset();
            }
        }
    }
}

/// The place of the message that is said next.
fn room(outbox: &mut Vec<Message>, said: usize) -> &mut Message {
    if outbox.len() <= said {
        outbox.push(Message::Snapshot(SnapshotPart::default()));
    }
    &mut outbox[said]
}
