//! Beside an agent, what it should know: a fold of its own of what its UAV has said and heard, each once.
//!
//! The agent has a log, in which what is late is put in its place, and works its pictures out again. This has lists, and
//! works each instant out once, when the agent has committed it.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use standoff::{
    Agent, Airspace, Angle, Cue, Duration, Fleet, Message, Observation, ParamError, Picture, Position, Report,
    TeamParams, Time, UavId, UavState,
};

/// Where two pictures come to other numbers, this share more counts as more information.
const MORE: f64 = 1e-9;

/// The audit of one agent.
pub(crate) struct Audit {
    team: TeamParams,
    airspace: Airspace,
    period: Duration,
    /// Periods for which an agent remembers what was said.
    kept: i64,
    /// Periods ahead of its own time that an agent listens to.
    early: i64,
    fleet: Fleet,
    /// The first instant of the agent, and the last one that it observed.
    began: Option<i64>,
    now: Option<i64>,
    /// The instant of the fold's picture; `None`: of the one before the first.
    folded: Option<i64>,
    /// The agent has taken over a picture that no fold of ours has come to yet.
    is_lost: bool,
    /// By instant.
    said: BTreeMap<i64, Row>,
    /// The agent's committed picture at the last instant at which it was looked at, if it was: it holds more than the fold's.
    pub(crate) holds_more: Option<bool>,
    /// How many were looked at, and how many of them were not as the fold's to the bit.
    pub(crate) looked_at: u64,
    pub(crate) differed: u64,
}

/// What was said of an instant.
#[derive(Default)]
struct Row {
    /// Of several of one UAV that which was said first.
    reports: BTreeMap<UavId, Report>,
    cues: Vec<Cue>,
}

/// What an agent knew before it heard a message.
#[derive(PartialEq)]
pub(crate) struct Before {
    committed: Option<Time>,
    /// Where the message may change it.
    digest: Option<u64>,
}

impl Before {
    pub(crate) fn of(agent: &Agent, message: &Message) -> Self {
        let is_picture = matches!(message, Message::Snapshot(_));
        let digest = agent.committed().filter(|_| is_picture).map(Picture::digest);
        Self { committed: agent.committed_at(), digest }
    }
}

impl Audit {
    pub(crate) fn new(team: TeamParams, airspace: Airspace) -> Result<Self, Vec<ParamError>> {
        let period = Duration::from_s(team.log.period_s);
        let periods = |s: f64| (s / team.log.period_s).ceil() as i64;
        Ok(Self {
            team,
            period,
            kept: periods(team.log.horizon_s) + 2,
            early: periods(team.teammate_timeout_s),
            fleet: Fleet::new(team)?.with_airspace(airspace.clone()),
            airspace,
            began: None,
            now: None,
            folded: None,
            is_lost: false,
            said: BTreeMap::new(),
            holds_more: None,
            looked_at: 0,
            differed: 0,
        })
    }

    /// The agent begins anew, with nothing.
    pub(crate) fn restart(&mut self) {
        if let Ok(new) = Self::new(self.team, self.airspace.clone()) {
            *self = Self { looked_at: self.looked_at, differed: self.differed, ..new };
        }
    }

    /// The agent has observed an instant.
    pub(crate) fn observe(&mut self, agent: &Agent, observation: &Observation) {
        let Some(instant) = self.instant(observation.time()) else { return };
        let ahead = |now: i64| instant.saturating_sub(now);
        let jumps = |now: i64| ahead(now) < 0 || ahead(now).saturating_mul(self.period.us()) > Agent::GAP_MAX.us();
        if self.now.is_some_and(jumps) {
            return;
        }
        self.began.get_or_insert(instant);
        self.now = Some(instant);
        let own = agent.outbox(observation).first();
        if let Some(Message::Report(report)) = own.filter(|_| observation.uav() == agent.id()) {
            self.put(instant, report);
        }
        let oldest = instant - self.kept;
        self.said.retain(|instant, _| *instant >= oldest);
    }

    /// The agent has heard a message.
    pub(crate) fn hear(&mut self, agent: &Agent, before: &Before, message: &Message) {
        let (Some(began), Some(now)) = (self.began, self.now) else { return };
        let after = before.committed.and_then(|time| self.instant(time)).unwrap_or(began - 1);
        let is_open = |instant: &i64| *instant > after && *instant <= now + self.early;
        match message {
            Message::Report(report) => {
                let Some(instant) = self.instant(report.time).filter(is_open) else { return };
                // What it has said since it began it knows itself.
                if report.uav != agent.id() || instant < began {
                    self.put(instant, report);
                }
            }
            Message::Cue(cue) => {
                let Some(instant) = self.instant(cue.said).filter(is_open) else { return };
                let cues = &mut self.said.entry(instant).or_default().cues;
                if !cues.contains(cue) {
                    cues.push(*cue);
                }
            }
            // Nothing else changes what is committed while an agent hears.
            Message::Snapshot(_) => self.is_lost |= Before::of(agent, message) != *before,
            // No matter of the picture.
            Message::Traffic(_) => {}
        }
    }

    /// Works the fold out up to the agent's committed picture, and looks at what that holds.
    pub(crate) fn check(&mut self, agent: &Agent, others: &[Self]) {
        self.holds_more = None;
        let Some((committed, began)) = agent.committed().zip(self.began) else { return };
        let Some(instant) = self.instant(committed.time) else { return };
        if self.is_lost || self.folded.is_some_and(|folded| folded > instant) {
            let is_same = |other: &&Self| {
                let picture = other.fleet.picture();
                !other.is_lost && picture.time == committed.time && picture.digest() == committed.digest()
            };
            let Some(same) = others.iter().find(is_same) else { return };
            (self.fleet, self.folded, self.is_lost) = (same.fleet.clone(), Some(instant), false);
        }
        for next in self.folded.map_or(began, |folded| folded + 1)..=instant {
            self.fold(agent.id(), next);
        }
        self.folded = Some(instant);
        let fold = self.fleet.picture();
        self.looked_at += 1;
        self.differed += u64::from(fold.digest() != committed.digest());
        self.holds_more = Some(holds_more(committed, fold));
    }

    fn fold(&mut self, by: UavId, instant: i64) {
        let nowhere = UavState::straight(Position::ORIGIN, Angle::ZERO, 0.0);
        // Without a scan it says nothing.
        let observation = self.fleet.observe(self.time(instant), by, &nowhere, None);
        if let Some(Row { reports, cues }) = self.said.get(&instant) {
            let reports = reports.values().cloned().map(Message::Report);
            let said = reports.chain(cues.iter().copied().map(Message::Cue));
            said.for_each(|message| self.fleet.hear(&observation, &message));
        }
        self.fleet.decide(&observation);
    }

    fn put(&mut self, instant: i64, report: &Report) {
        let report = Report { time: self.time(instant), knowledge: None, ..report.clone() };
        match self.said.entry(instant).or_default().reports.entry(report.uav) {
            Entry::Vacant(place) => drop(place.insert(report)),
            Entry::Occupied(mut known) => {
                let stamp = |report: &Report| (report.epoch, report.sequence);
                if stamp(&report) < stamp(known.get()) {
                    known.insert(report);
                }
            }
        }
    }

    /// The instant of the team's grid that a time is of: within a tenth of a period.
    fn instant(&self, time: Time) -> Option<i64> {
        let period_us = self.period.us().max(1);
        let nearest = (time.us() + period_us / 2).div_euclid(period_us);
        ((time.us() - nearest * period_us).abs() * 10 <= period_us).then_some(nearest)
    }

    fn time(&self, instant: i64) -> Time {
        Time::from_us(instant * self.period.us())
    }
}

/// Of some target it knows more than another picture does: the ellipsoid of its uncertainty is smaller.
fn holds_more(picture: &Picture, other: &Picture) -> bool {
    picture.known().iter().filter(|known| !known.track.is_lost()).any(|known| {
        let Some(other) = other.find(known.track.id) else { return true };
        let [covariance, other] = [known, other].map(|known| known.track.estimate().covariance);
        let volume = |covariance: &standoff::Covariance| covariance.matrix().determinant();
        covariance != other && volume(&covariance) < volume(&other) * (1.0 - MORE)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff::{Detection, Displacement, RangeBearing, Scan, TargetLabel, Velocity};

    /// The first of two agents, which have a target between them, and what was counted beside it: all that it hears, or all
    /// but what the other says at one instant.
    fn looked_at(untold: Option<i64>) -> Vec<Option<bool>> {
        let team = TeamParams::table_1();
        let mut agents = [0, 1].map(|uav| Agent::new(UavId(uav), team).unwrap());
        let mut audit = Audit::new(team, Airspace::default()).unwrap();
        let cue = Message::Cue(Cue {
            searcher: 0,
            said: Time::START,
            number: 0,
            label: TargetLabel(0),
            time: Time::START,
            position: Position::ORIGIN,
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 2.0,
        });
        let look = |instant: i64| {
            let now = audit_time(instant);
            let observed = [0, 1].map(|place| {
                let (x_m, bearing) = [(400.0, 180.0), (-400.0, 0.0)][place];
                let position = Position::ORIGIN + Displacement::from_m(x_m, 0.0);
                let own = UavState::straight(position, Angle::ZERO, 40.0);
                let measurement = RangeBearing { range_m: 400.0, bearing: Angle::from_deg(bearing) };
                let seen = [Detection { label: TargetLabel(0), measurement }];
                let scan = Scan { boresight: Some(measurement.bearing), detections: &seen };
                agents[place].observe(now, &own, Some(scan))
            });
            audit.observe(&agents[0], &observed[0]);
            let said = [0, 1].map(|place| agents[place].outbox(&observed[place]).to_vec());
            for place in [0, 1] {
                let heard = said[1 - place].iter().chain((instant == 0).then_some(&cue));
                for message in heard {
                    let before = Before::of(&agents[place], message);
                    agents[place].hear(&observed[place], message);
                    if place == 0 && untold != Some(instant) {
                        audit.hear(&agents[0], &before, message);
                    }
                }
                agents[place].decide(&observed[place]);
            }
            audit.check(&agents[0], &[]);
            audit.holds_more
        };
        (0..20).map(look).collect()
    }

    fn audit_time(instant: i64) -> Time {
        Time::from_us(instant * 500_000)
    }

    #[test]
    fn what_was_said_once_and_counts_twice_is_noticed() {
        let whole = looked_at(None);
        assert!(whole.ends_with(&[Some(false); 8]), "{whole:?}");
        // One report that the fold does not count is one that the agent counts once too often.
        let one_more = looked_at(Some(5));
        assert!(!one_more[..5].contains(&Some(true)) && one_more.contains(&Some(true)), "{one_more:?}");
    }
}
