//! Who is there: every short sequence of faults, each followed by calm. In the end all agree; and at every instant what each
//! believes of the others is what a little model says of when they were heard.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::collections::BTreeMap;

use common::Team;
use common::radio::{Radio, Words};
use proptest::prelude::*;
use standoff::*;

/// In periods: Table I's lease of 3 s, and a horizon of 15 s that the calm outlasts.
const LEASE: i64 = 6;
const HORIZON: i64 = 30;

/// Before the first fault, from one to the next, and after the last.
const BEFORE: i64 = 9;
const BETWEEN: i64 = 4;
const CALM: i64 = 80;

/// What befalls a UAV, or all.
#[derive(Debug, Clone, Copy)]
enum Fault {
    /// Its transmitter is off for so many periods.
    Silent(usize, i64),
    /// Its computer starts anew.
    Restart(usize),
    /// It leaves; or it joins, if it has left.
    LeaveOrJoin(usize),
    /// The next one does not hear what it says now.
    LostWord(usize),
    /// The first and the others hear one another no more; or again.
    PartOrMeet,
}

fn all_faults(uavs: usize) -> Vec<Fault> {
    let of = |uav| {
        let silences = [1, 4, 8].map(|periods| Fault::Silent(uav, periods));
        silences.into_iter().chain([Fault::Restart(uav), Fault::LeaveOrJoin(uav), Fault::LostWord(uav)])
    };
    (0..uavs).flat_map(of).chain([Fault::PartOrMeet]).collect()
}

/// What one UAV was heard to say, or told to have said.
#[derive(Debug, Clone, Copy)]
struct Heard {
    newest: i64,
    /// The last instant of which it said that it leaves.
    left: Option<i64>,
}

/// What an agent has heard since it began.
#[derive(Debug, Clone, Default)]
struct Ear {
    began: i64,
    of: BTreeMap<UavId, Heard>,
    /// The instant of the newest report of each that told what it holds.
    told_at: BTreeMap<UavId, i64>,
}

fn instant(time: Time) -> i64 {
    time.us() / common::radio::PERIOD.us()
}

impl Ear {
    fn spoke(&mut self, uav: UavId, at: i64) -> &mut Heard {
        let heard = self.of.entry(uav).or_insert(Heard { newest: at, left: None });
        heard.newest = heard.newest.max(at);
        heard
    }

    fn hear(&mut self, report: &Report) {
        let at = instant(report.time);
        let heard = self.spoke(report.uav, at);
        heard.left = heard.left.max(report.leaves.then_some(at));
        let told_at = self.told_at.get(&report.uav).is_some_and(|told_at| *told_at >= at);
        let Some(knowledge) = report.knowledge.as_deref().filter(|_| !told_at) else { return };
        self.told_at.insert(report.uav, at);
        for run in &knowledge.held {
            if let Speaker::Uav(uav) = run.speaker {
                self.spoke(uav, run.to);
            }
        }
    }

    /// Whether this may be believed of a UAV now.
    fn allows(&self, uav: UavId, now: i64, presence: Option<Presence>) -> bool {
        let Some(Heard { newest, left }) = self.of.get(&uav).copied() else { return presence.is_none() };
        let expected = match now - newest {
            _ if left == Some(newest) => Presence::Left,
            ..=1 => Presence::Live,
            2..=LEASE => Presence::Silent,
            _ => Presence::Gone,
        };
        // What is so old may be forgotten, and that it left; of the time before it began an agent need not know all.
        let may_be = |presence| match presence {
            None | Some(Presence::Gone) => newest < self.began || now - newest >= HORIZON,
            Some(Presence::Silent) => newest < self.began,
            // It hears again that it left, and not that it came back and is silent since.
            Some(Presence::Left) => left.is_some() && newest < self.began,
            Some(Presence::Live) => false,
        };
        presence == Some(expected) || may_be(presence)
    }
}

/// A team on its way through a sequence.
#[derive(Clone)]
struct Flight {
    team: Team,
    radio: Radio,
    ears: Vec<Ear>,
    epochs: Vec<u32>,
    silent_until: Vec<i64>,
    is_parted: bool,
    loss: f64,
    tick: i64,
    faults: Vec<Fault>,
}

fn params() -> TeamParams {
    let mut params = TeamParams::table_1();
    params.log.horizon_s = 15.0;
    params
}

impl Flight {
    fn new(uavs: usize) -> Self {
        let team = Team::of(uavs as u32, 2, params());
        let (ears, epochs, silent_until) = (vec![Ear::default(); uavs], vec![0; uavs], vec![0; uavs]);
        let (radio, is_parted, loss, tick, faults) = (Radio::new(1), false, 0.0, 0, Vec::new());
        Self { team, radio, ears, epochs, silent_until, is_parted, loss, tick, faults }
    }

    fn start_anew(&mut self, uav: usize) {
        self.epochs[uav] += 1;
        self.team.agents[uav] = Agent::new(UavId(uav as u32), params()).unwrap().with_epoch(self.epochs[uav]);
        self.ears[uav] = Ear { began: self.tick, ..Ear::default() };
    }

    /// A fault, and the instants up to the next one.
    fn suffer(&mut self, fault: Fault) {
        self.faults.push(fault);
        let uavs = self.ears.len();
        let mut is_leaving = None;
        match fault {
            Fault::Silent(uav, periods) => self.silent_until[uav] = self.tick + periods,
            Fault::Restart(uav) if !self.team.off.contains(&uav) => self.start_anew(uav),
            Fault::Restart(_) => {}
            Fault::LeaveOrJoin(uav) if self.team.off.contains(&uav) => {
                self.team.off.retain(|off| *off != uav);
                self.start_anew(uav);
            }
            Fault::LeaveOrJoin(uav) => {
                self.team.agents[uav].leave();
                is_leaving = Some(uav);
            }
            Fault::LostWord(_) => {}
            Fault::PartOrMeet => self.is_parted = !self.is_parted,
        }
        for later in 0..BETWEEN {
            self.radio.heal();
            self.radio.loss = self.loss;
            if self.is_parted {
                self.radio.part(&[0], &(1..uavs).collect::<Vec<_>>());
            }
            if let Fault::LostWord(uav) = fault
                && later == 0
            {
                self.radio.deaf.push((uav, (uav + 1) % uavs));
            }
            self.fly();
            // What it says as it leaves is its last word.
            self.team.off.extend(is_leaving.take());
        }
    }

    fn fly(&mut self) {
        let is_silent = |uav: &u32| self.silent_until[*uav as usize] > self.tick;
        self.team.silent = (0..self.ears.len() as u32).filter(is_silent).map(UavId).collect();
        let Words { said, heard, .. } = self.team.tick_over(self.tick, &mut self.radio);
        for (_, message) in &said {
            if let Message::Report(report) = message
                && instant(report.time) == self.tick
            {
                // What it holds it knows without being told.
                let own = Report { knowledge: None, ..report.clone() };
                self.ears[report.uav.0 as usize].hear(&own);
            }
        }
        for (index, message) in &heard {
            if let Message::Report(report) = message {
                self.ears[*index].hear(report);
            }
        }
        for index in self.on() {
            let agent = &self.team.agents[index];
            let told: BTreeMap<UavId, Presence> = agent.presence().collect();
            for uav in (0..self.ears.len() as u32).map(UavId) {
                let presence = told.get(&uav).copied();
                assert!(
                    self.ears[index].allows(uav, self.tick, presence),
                    "{:?}: at {} UAV {index} believes {presence:?} of {uav:?}, has heard {:?}",
                    self.faults,
                    self.tick,
                    self.ears[index].of.get(&uav)
                );
            }
        }
        self.tick += 1;
    }

    fn on(&self) -> Vec<usize> {
        (0..self.ears.len()).filter(|index| !self.team.off.contains(index)).collect()
    }

    /// Calm, after which all who are there know and do the same.
    fn recover(mut self) {
        self.radio.heal();
        self.silent_until.fill(0);
        (0..CALM).for_each(|_| self.fly());
        let known = |index: usize| {
            let agent = &self.team.agents[index];
            let committed = agent.committed().map(Picture::digest);
            (agent.picture().crew.clone(), agent.committed_at(), committed, agent.picture().digest())
        };
        let on = self.on();
        for index in on.iter().skip(1) {
            assert_eq!(known(*index), known(on[0]), "{:?}: UAV {index} and UAV {}", self.faults, on[0]);
        }
        for index in &on {
            let picture = self.team.agents[*index].picture();
            let crew: Vec<_> = picture.crew.iter().map(|duty| duty.uav.0 as usize).collect();
            // Who has started anew while nobody could tell of them knows of no targets.
            let is_serving = !picture.known().is_empty();
            assert_eq!(crew, if is_serving { &on[..] } else { &[] }, "{:?}: UAV {index}", self.faults);
        }
    }

    /// All that can follow, with so many more faults; how many sequences that were.
    fn try_all(&self, of: &[Fault], more: u32) -> u64 {
        if more == 0 {
            self.clone().recover();
            return 1;
        }
        let next = |fault: &Fault| {
            let mut flight = self.clone();
            flight.suffer(*fault);
            flight.try_all(of, more - 1)
        };
        of.iter().map(next).sum()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(cases()) })]
    /// The same of longer sequences, of up to four UAVs, while words go missing.
    #[test]
    fn after_any_faults_while_words_go_missing_all_agree(
        seed in any::<u64>(),
        uavs in 2..5usize,
        loss in 0.0..0.6f64,
        faults in proptest::collection::vec(any::<proptest::sample::Index>(), 1..10),
    ) {
        let mut flight = Flight::new(uavs);
        (0..BEFORE).for_each(|_| flight.fly());
        (flight.loss, flight.radio) = (loss, Radio::new(seed));
        let all = all_faults(uavs);
        faults.iter().for_each(|fault| flight.suffer(*fault.get(&all)));
        flight.recover();
    }
}

/// 60, or more if `PROPTEST_CASES` says so.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").map_or(60, |cases| cases.parse().unwrap())
}

fn try_all(uavs: usize, of: &[Fault], faults: u32) -> u64 {
    let mut flight = Flight::new(uavs);
    (0..BEFORE).for_each(|_| flight.fly());
    flight.try_all(of, faults)
}

#[test]
fn after_any_two_faults_all_agree_on_who_is_there_and_does_what() {
    assert_eq!(try_all(2, &all_faults(2), 2) + try_all(3, &all_faults(3), 2), 13 * 13 + 19 * 19);
}

#[test]
#[ignore = "long: for .ci/long"]
fn after_any_four_faults_a_pair_agrees_on_who_is_there_and_does_what() {
    assert_eq!(try_all(2, &all_faults(2), 4), 13 * 13 * 13 * 13);
}

/// Of those that are worst, more.
#[test]
#[ignore = "long: for .ci/long"]
fn after_any_six_of_the_worst_faults_all_agree_on_who_is_there_and_does_what() {
    let worst = [Fault::Silent(1, 8), Fault::Restart(0), Fault::LeaveOrJoin(1), Fault::PartOrMeet];
    assert_eq!(try_all(2, &worst, 6) + try_all(3, &worst, 5), 4096 + 1024);
}
