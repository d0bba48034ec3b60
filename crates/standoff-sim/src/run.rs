//! One mission: world, sensors, radio, brain, commands, tick by tick; what happens goes out as frames.
//!
//! ```text
//! truth -> scans (each along the boresight its UAV asked for) -> brain <-> radio -> commands -> truth
//! ```

use standoff::{
    Aircraft, Angle, Command, Detection, Duration, LookAt, Message, ParamError, Position, Response, Scan, Step, Time,
    UavId, UavState, Velocity,
};

use crate::brain::{self, Beliefs, Brain};
use crate::computer::Computer;
use crate::draws::Draws;
use crate::frame::{Frame, Reported};
use crate::intruders::Intruders;
use crate::radio::{Radio, Sent, Station};
use crate::rows;
use crate::scenario::{Minds, Outage, Scenario, Settings};
use crate::score::{Choice, Metrics, Rules, Scorer};
use crate::sensors;
use crate::world::{Truth, World};

/// A mission in progress.
///
/// ```
/// use standoff_sim::run::Mission;
/// use standoff_sim::scenario::{Edits, Scenario};
///
/// let scenario = Scenario::load("tour/01-one-uav", &Edits::default(), 1)?;
/// let mut mission = Mission::new(&scenario).expect("a loaded scenario can be flown");
/// let mut last_s = 0.0;
/// while let Some(frame) = mission.frame() {
///     assert_eq!((frame.uavs.len(), frame.truth.len()), (1, 1));
///     last_s = frame.time_us as f64 / 1e6;
/// }
/// assert_eq!(last_s, scenario.settings.duration.s());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Mission<B = Box<dyn Brain + Send>> {
    settings: Settings,
    outages: Vec<Outage>,
    world: World,
    draws: Draws,
    uavs: Vec<Uav>,
    intruders: Intruders,
    /// How they answer commands that are held for a period.
    response: Response,
    brain: B,
    /// The brain is not the product.
    is_foreign: bool,
    radio: Radio,
    /// Who has been cued, by target: their ids are places in a list.
    cued: Vec<bool>,
    tick: i64,
    /// How far this instant has come.
    stage: Stage,
    truth: Vec<Truth>,
    frame: Frame,
}

/// Who keeps away from the same UAV again after no longer than this still does.
const ONE_AVOIDANCE: Duration = Duration::from_us(5_000_000);

/// How far an instant has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// Nobody has looked yet.
    Ahead,
    /// Sensors have spoken, the brain has heard.
    Observed,
    /// The brain has said what it wants, and the frame tells it.
    Proposed,
}

/// Flies a whole mission and scores it, with no record written.
pub fn fly(scenario: &Scenario, choice: Choice) -> Result<Metrics, Vec<ParamError>> {
    fly_while(scenario, choice, || true)
}

/// Flies a mission for as long as `go_on`, asked before every instant, says yes, and scores what was flown.
pub fn fly_while(scenario: &Scenario, choice: Choice, go_on: impl Fn() -> bool) -> Result<Metrics, Vec<ParamError>> {
    Ok(Mission::scored_by(scenario, choice)?.scored_while(choice, go_on))
}

/// A UAV in the world: what it does, what its brain believes and wants, and what its sensor says.
struct Uav {
    id: UavId,
    /// Where it is.
    truth: UavState,
    /// Where its brain believes it to be: navigation is perfect.
    belief: UavState,
    look_at: Option<LookAt>,
    /// It neither sees nor speaks.
    is_out: bool,
    computer: Computer,
    /// Its computer is off.
    is_off: bool,
    boresight: Option<Angle>,
    detections: Vec<Detection>,
    command: Command,
    /// Altitude asked for, m.
    altitude_m: Option<f64>,
    /// Whom it kept away from last, and when.
    avoided: Option<(Aircraft, Time)>,
}

impl Mission {
    /// A mission at its start, flown by the product; all that is out of range, also at this period, is reported at once.
    pub fn new(scenario: &Scenario) -> Result<Self, Vec<ParamError>> {
        Self::scored_by(scenario, Choice::standard())
    }

    /// The same; what metrics of a choice need that takes long is worked out beside it: `double_count`.
    pub fn scored_by(scenario: &Scenario, choice: Choice) -> Result<Self, Vec<ParamError>> {
        let (Settings { minds, team, airspace, .. }, uavs) = (&scenario.settings, scenario.uavs.len());
        let brain: Box<dyn Brain + Send> = match minds {
            Minds::Each if choice.wants_audit() => Box::new(brain::audited(*team, airspace.clone(), uavs)?),
            _ => brain::of_team(*minds, *team, airspace.clone(), uavs)?,
        };
        Ok(Self { is_foreign: false, ..Self::with_brain(scenario, brain)? })
    }
}

impl<B: Brain> Mission<B> {
    /// The same, flown by a brain of your own.
    pub fn with_brain(scenario: &Scenario, brain: B) -> Result<Self, Vec<ParamError>> {
        let settings = scenario.settings.clone();
        let errors = settings.team.errors_over(settings.period);
        if !errors.is_empty() {
            return Err(errors);
        }
        let uavs = scenario.uavs.iter().zip(0..).map(|(state, id)| Uav {
            id: UavId(id),
            truth: *state,
            belief: *state,
            look_at: None,
            is_out: false,
            computer: Computer::new(UavId(id), scenario),
            is_off: false,
            boresight: None,
            detections: Vec::new(),
            command: Command { speed_m_s: state.speed_m_s, turn_rate_rad_s: 0.0 },
            altitude_m: None,
            avoided: None,
        });
        Ok(Self {
            outages: scenario.outages.clone(),
            world: World::new(scenario),
            draws: Draws::new(scenario.seed),
            uavs: uavs.collect(),
            intruders: Intruders::new(scenario),
            response: settings.team.uav.response(settings.period),
            brain,
            is_foreign: true,
            radio: Radio::new(scenario),
            cued: Vec::new(),
            tick: 0,
            stage: Stage::Ahead,
            truth: Vec::new(),
            frame: Frame::default(),
            settings,
        })
    }

    /// What its brain tells of what it believes and intends.
    pub fn reported(&self) -> Reported {
        self.brain.reported()
    }

    /// The rules by which it is scored: what its brain does not tell is not.
    pub fn rules(&self) -> Rules {
        Rules { reported: self.reported(), ..Rules::of(&self.settings) }
    }

    /// Number of frames of the whole mission.
    pub fn frames(&self) -> u64 {
        self.last_tick() as u64 + 1
    }

    /// Plays one instant and moves on to the next; `None` when the mission is over.
    pub fn frame(&mut self) -> Option<&Frame> {
        self.observe();
        self.decide()
    }

    /// Plays on for as long as `go_on`, asked before every instant, says yes, and scores what was played.
    pub fn scored_while(&mut self, choice: Choice, go_on: impl Fn() -> bool) -> Metrics {
        let mut scorer = Scorer::new(self.rules(), choice);
        while go_on() {
            let Some(frame) = self.frame() else { break };
            scorer.frame(frame);
        }
        scorer.metrics()
    }

    /// The first half of an instant: sensors speak, the brain observes and hears. Until it is decided, it stays this one.
    /// `false`: the mission is over.
    pub fn observe(&mut self) -> bool {
        let goes_on = self.tick <= self.last_tick();
        if goes_on && self.stage == Stage::Ahead {
            let now = self.now();
            self.world.look(now, &mut self.truth);
            self.scan(now);
            self.say(now);
            self.stage = Stage::Observed;
        }
        goes_on
    }

    /// What the brain would have its UAVs do at the instant that is observed: its frame, as [`Self::decide`] will give it
    /// unless somebody [`order`](Self::order)s otherwise. `None` if nothing was observed.
    pub fn propose(&mut self) -> Option<&Frame> {
        if self.stage == Stage::Observed {
            self.command(self.now());
            self.stage = Stage::Proposed;
        }
        (self.stage == Stage::Proposed).then_some(&self.frame)
    }

    /// Puts a command, as far as its limits allow, in the place of what the brain has [`propose`](Self::propose)d for a
    /// UAV; where its sensor looks stays the brain's to say. `false`: nothing was proposed, or there is no such UAV.
    pub fn order(&mut self, uav: UavId, command: Command) -> bool {
        let place = uav.0 as usize;
        let (Some(uav), Some(row)) = (self.uavs.get_mut(place), self.frame.uavs.get_mut(place)) else { return false };
        if self.stage != Stage::Proposed {
            return false;
        }
        let limited = self.settings.team.uav.limit(command);
        uav.command = limited.command;
        row.speed_command_m_s = limited.command.speed_m_s;
        row.turn_rate_command_rad_s = limited.command.turn_rate_rad_s;
        (row.speed_limited, row.turn_rate_limited) = (limited.speed_limited, limited.turn_rate_limited);
        true
    }

    /// The second half: the brain decides, if it has not proposed already, and the world moves on to the next instant;
    /// `None` if nothing was observed.
    pub fn decide(&mut self) -> Option<&Frame> {
        self.propose()?;
        self.fly();
        self.world.step();
        self.tick += 1;
        self.stage = Stage::Ahead;
        Some(&self.frame)
    }

    /// What each UAV has sent at the instant that was observed last, by id.
    pub fn sent(&self) -> &[Sent] {
        self.radio.sent()
    }

    /// The instant that is played next, or is observed.
    pub fn now(&self) -> Time {
        Time::from_us(self.tick * self.settings.period.us())
    }

    /// That instant is the mission's last one.
    pub fn is_last(&self) -> bool {
        self.tick >= self.last_tick()
    }

    /// The first instant is tick 0; then one per whole period.
    fn last_tick(&self) -> i64 {
        let Settings { duration, period, .. } = self.settings;
        duration.us() / period.us().max(1)
    }

    /// Every sensor looks where its UAV asked it to, by where it believes itself to be.
    fn scan(&mut self, now: Time) {
        let Settings { period, noise, team, .. } = &self.settings;
        // By twos, whose boresights are worked out side by side; a last one alone beside itself.
        for pair in self.uavs.chunks_mut(2) {
            for uav in &mut *pair {
                let mut own = self.outages.iter().filter(|outage| outage.uav == uav.id);
                uav.is_off = !uav.computer.is_on(now);
                uav.is_out = uav.is_off || own.any(|outage| (outage.from_s..outage.until_s).contains(&now.s()));
            }
            let nowhere = LookAt { position: Position::ORIGIN, velocity: Velocity::ZERO };
            let looks =
                [&pair[0], &pair[pair.len() - 1]].map(|uav| (uav.look_at.unwrap_or(nowhere), uav.belief.position));
            for (uav, boresight) in pair.iter_mut().zip(LookAt::boresight_each(looks, *period)) {
                uav.boresight = (uav.look_at.is_some() && !uav.is_out).then_some(boresight);
            }
        }
        for uav in &mut self.uavs {
            uav.detections.clear();
            if let Some(boresight) = uav.boresight {
                let (from, sensor) = ((uav.id, uav.truth.position), &team.track.sensor);
                let draws = (self.draws, self.tick as u64);
                sensors::scan(from, boresight, &self.truth, sensor, *noise, draws, &mut uav.detections);
            }
        }
    }

    /// Every UAV whose computer is on observes, and hears what the radio carries: what the others say, and the cues of
    /// targets that have just appeared, or are there when the first computer is on.
    fn say(&mut self, now: Time) {
        let Self { uavs, brain, radio, cued, intruders, .. } = self;
        radio.open();
        for uav in &mut *uavs {
            radio.join(Station { position: uav.truth.position, speaks: !uav.is_out, hears: !uav.is_off });
            if uav.is_off {
                continue;
            }
            if let Some(epoch) = uav.computer.started_again(now) {
                brain.restart(uav.id, epoch);
            }
            let scan = Scan { boresight: uav.boresight, detections: &uav.detections };
            brain.observe(uav.computer.time(now), uav.id, &uav.belief, (!uav.is_out).then_some(scan));
            if !uav.is_out {
                brain.outbox(uav.id).iter().for_each(|message| radio.say(uav.id, message));
            }
        }
        // Nobody is told anything while there is nobody to tell.
        let told = if uavs.iter().all(|uav| uav.is_off) { &[] } else { &self.truth[..] };
        for target in told {
            let place = target.target.0 as usize;
            if place >= cued.len() {
                cued.resize(place + 1, false);
            }
            if !std::mem::replace(&mut cued[place], true) {
                let cue = Message::Cue(sensors::cue(target, now, self.settings.cue, self.draws));
                radio.cue(target.target.0, cue);
            }
        }
        intruders.told(now).for_each(|(aircraft, message)| radio.traffic(aircraft, message));
        radio.carry(self.tick, now, |uav, message| brain.hear(uav, message));
    }

    /// Every UAV decides, and the brain tells what it believes.
    fn command(&mut self, now: Time) {
        let Self { frame, brain, uavs, settings, radio, intruders, .. } = self;
        rows::begin(now, &self.truth, frame);
        frame.intruders.extend(intruders.all().map(|(number, intruder)| rows::intruder(number, intruder, now)));
        let is_on = uavs.iter().any(|uav| !uav.is_off);
        let mut avoidances = Vec::new();
        for uav in uavs {
            let mut step = if uav.is_off { Step::of(settings.team.smallest_circle()) } else { brain.decide(uav.id) };
            // Whoever's brain it is, no UAV flies what it cannot.
            let limited = settings.team.uav.limit(step.command);
            step.command = limited.command;
            step.look_at = step.look_at.filter(|look| look.position.is_finite() && look.velocity.is_finite());
            step.altitude_m = step.altitude_m.filter(|altitude_m| altitude_m.is_finite());
            step.diagnostics.speed_limited |= limited.speed_limited;
            step.diagnostics.turn_rate_limited |= limited.turn_rate_limited;
            frame.uavs.push(rows::uav(uav.id, &uav.truth, uav.boresight, &step));
            frame.detections.extend(uav.detections.iter().map(|detection| rows::detection(uav.id, detection)));
            (uav.look_at, uav.command, uav.altitude_m) = (step.look_at, step.command, step.altitude_m);
            if let Some(avoidance) = step.diagnostics.avoids {
                let goes_on = |(from, when): (Aircraft, Time)| from == avoidance.from && now - when <= ONE_AVOIDANCE;
                if !uav.avoided.is_some_and(goes_on) {
                    avoidances.push(rows::avoidance(uav.id, &avoidance));
                }
                uav.avoided = Some((avoidance.from, now));
            }
        }
        let Frame { tracks, groups, events, agents, .. } = frame;
        let mut beliefs = Beliefs { tracks, groups, events };
        if is_on {
            brain.report(&mut beliefs);
            brain.report_each(agents);
        }
        if self.is_foreign {
            beliefs.tidy();
        }
        events.append(&mut avoidances);
        agents.tidy();
        for row in &mut agents.all {
            let sent = radio.sent().get(row.agent as usize).copied().unwrap_or_default();
            (row.sent_messages, row.sent_bytes) = (sent.messages, sent.bytes);
        }
    }

    /// Every UAV flies its command until the next instant, and whoever else is there flies on.
    fn fly(&mut self) {
        let Self { uavs, intruders, .. } = self;
        intruders.fly(|uav| uavs.get(uav.0 as usize).map(|uav| &uav.truth));
        for uav in &mut self.uavs {
            uav.truth = self.response.step(&uav.truth, uav.command);
            if let (Some(vertical), Some(climb)) = (&mut uav.truth.vertical, &self.settings.team.uav.climb) {
                *vertical = climb.step(vertical, uav.altitude_m, self.settings.period);
            }
            uav.belief = uav.truth;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use super::*;
    use crate::scenario::Edits;
    use standoff::{Displacement, Step, TargetState};

    /// The agents never see truth: moving every target after the sensors have spoken changes no command and no belief.
    #[test]
    fn another_truth_after_the_sensors_have_spoken_changes_no_command() {
        for name in ["paper/table-2-pair", "traffic/convoy"] {
            let scenario = Scenario::load(name, &Edits::default(), 3).unwrap();
            let mut honest = Mission::new(&scenario).unwrap();
            let mut lied_to = Mission::new(&scenario).unwrap();
            for _ in 0..100 {
                let mut frames = Vec::new();
                for (mission, lies) in [(&mut honest, false), (&mut lied_to, true)] {
                    let now = Time::from_us(mission.tick * scenario.settings.period.us());
                    mission.world.look(now, &mut mission.truth);
                    mission.scan(now);
                    mission.say(now);
                    if lies {
                        for target in &mut mission.truth {
                            target.state = TargetState(target.state.0 * -3.0);
                        }
                    }
                    mission.command(now);
                    mission.fly();
                    frames.push(mission.frame.clone());
                    mission.world.step();
                    mission.tick += 1;
                }
                assert_ne!(frames[0].truth, frames[1].truth);
                assert_eq!(frames[0].uavs, frames[1].uavs);
                assert_eq!(frames[0].tracks, frames[1].tracks);
                assert_eq!(frames[0].groups, frames[1].groups);
            }
        }
    }

    /// Writes down where its UAVs believe themselves to be.
    struct Listener(Rc<RefCell<Vec<UavState>>>);

    impl Brain for Listener {
        fn observe(&mut self, _: Time, _: UavId, own: &UavState, _: Option<Scan>) {
            self.0.borrow_mut().push(*own);
        }
        fn hear(&mut self, _: UavId, _: &Message) {}
        fn decide(&mut self, _: UavId) -> Step {
            Step::of(Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 })
        }
    }

    /// A brain knows where its UAV believes itself to be, the record where it is.
    #[test]
    fn a_brain_sees_the_believed_state_and_the_record_the_true_one() {
        let scenario = Scenario::load("tour/01-one-uav", &Edits::default(), 1).unwrap();
        let heard = Rc::default();
        let mut mission = Mission::with_brain(&scenario, Box::new(Listener(Rc::clone(&heard)))).unwrap();
        let truth = mission.uavs[0].truth;
        let belief = UavState { position: truth.position + Displacement::from_m(30.0, -4.0), ..truth };
        mission.uavs[0].belief = belief;
        let row = mission.frame().unwrap().uavs[0];
        assert_eq!(*heard.borrow(), [belief]);
        assert_eq!((row.x_m, row.y_m), (truth.position.x_m(), truth.position.y_m()));
        assert_eq!(mission.uavs[0].belief, mission.uavs[0].truth, "navigation is perfect");
    }

    /// How many committed pictures an audit has looked at, how many were other ones than its fold's, and the score of it.
    fn audited(name: &str, set: &[&str], seed: u64) -> (u64, u64, Option<u64>) {
        let set = set.iter().map(|key| (*key).to_owned()).collect();
        let scenario = Scenario::load(name, &Edits { set, ..Edits::default() }, seed).unwrap();
        let brain =
            brain::audited(scenario.settings.team, scenario.settings.airspace.clone(), scenario.uavs.len()).unwrap();
        let mut mission = Mission::with_brain(&scenario, brain).unwrap();
        let metrics = mission.scored_while(Choice::parse("double_count").unwrap(), || true);
        let sum = |of: fn(&crate::audit::Audit) -> u64| mission.brain.audits.iter().map(of).sum();
        (sum(|audit| audit.looked_at), sum(|audit| audit.differed), metrics.double_count)
    }

    /// Whatever happens to words, a committed picture is, to the bit, what follows from what was said, each thing once.
    #[test]
    fn no_report_counts_twice_whatever_the_radio_does() {
        let faults = [
            &["radio={}"][..],
            &["radio.loss=0.5"],
            &["radio.delay_s={uniform=[0, 3]}", "radio.duplicate=0.5"],
            &["radio.loss=0.2", "radio.partition=[{from_s=20,until_s=50,sides=[[0,1],[2,3]]}]"],
            &["radio.loss=0.2", "uavs.restart=[{uav=0,at_s=30,down_s=10}, {uav=2,at_s=50.2,down_s=0.1}]"],
            &["uavs.start_late_s={uniform=[0, 20]}", "radio.loss=0.2"],
        ];
        for fault in faults {
            for seed in 1..3 {
                let (looked_at, differed, double_count) = audited("tour/04-two-groups", fault, seed);
                assert_eq!((differed, double_count), (0, Some(0)), "{fault:?}, seed {seed}");
                assert!(looked_at > 900, "{fault:?}, seed {seed}: {looked_at}");
            }
        }
    }

    /// Observed twice or once, an instant is the same, and it is decided once.
    #[test]
    fn an_instant_in_two_halves_is_that_in_one() {
        let scenario = Scenario::load("tour/02-two-uavs", &Edits::default(), 2).unwrap();
        let [mut whole, mut halves] = [0; 2].map(|_| Mission::new(&scenario).unwrap());
        assert!(halves.decide().is_none());
        while let Some(frame) = whole.frame() {
            assert!(halves.observe() && halves.observe());
            assert_eq!(halves.now().us(), frame.time_us);
            assert_eq!(halves.decide(), Some(frame));
            assert!(halves.decide().is_none());
        }
        assert!(!halves.observe());
    }

    /// An order is in the place of the brain's command and of nothing else, within its limits, at this instant alone.
    #[test]
    fn an_order_replaces_one_uav_s_command_at_one_instant() {
        let scenario = Scenario::load("tour/02-two-uavs", &Edits::default(), 2).unwrap();
        let [mut free, mut ordered] = [0; 2].map(|_| Mission::new(&scenario).unwrap());
        let order = Command { speed_m_s: 1000.0, turn_rate_rad_s: -0.125 };
        assert!(ordered.propose().is_none() && !ordered.order(UavId(1), order), "nothing was observed");
        assert!(ordered.observe() && !ordered.order(UavId(1), order), "nothing was proposed");
        let wanted = free.frame().unwrap().clone();
        assert_eq!(ordered.propose(), Some(&wanted));
        assert!(!ordered.order(UavId(2), order), "there are two");
        assert!(ordered.order(UavId(1), order));
        let fastest_m_s = scenario.settings.team.uav.speed_max_m_s();
        let mut told = wanted.clone();
        let row = &mut told.uavs[1];
        (row.speed_command_m_s, row.speed_limited) = (fastest_m_s, true);
        (row.turn_rate_command_rad_s, row.turn_rate_limited) = (-0.125, false);
        assert_eq!(ordered.decide(), Some(&told));
        let commands =
            |mission: &Mission| mission.uavs.iter().map(|uav| (uav.command, uav.look_at)).collect::<Vec<_>>();
        let (other, [mine, theirs]) = (commands(&free)[1], [commands(&ordered), commands(&free)]);
        assert_eq!((mine[0], mine[1].1), (theirs[0], other.1));
        assert_eq!(mine[1].0, Command { speed_m_s: fastest_m_s, ..order });
        assert!(ordered.uavs[1].truth.speed_m_s > free.uavs[1].truth.speed_m_s);
        assert_eq!(ordered.uavs[0].truth, free.uavs[0].truth);
        // Whoever orders what was proposed changes no bit.
        let [mut free, mut ordered] = [0; 2].map(|_| Mission::new(&scenario).unwrap());
        while ordered.observe() {
            assert_eq!(ordered.is_last(), ordered.now().s() == scenario.settings.duration.s());
            let rows = ordered.propose().unwrap().uavs.clone();
            for row in rows {
                let command =
                    Command { speed_m_s: row.speed_command_m_s, turn_rate_rad_s: row.turn_rate_command_rad_s };
                assert!(ordered.order(UavId(row.uav), command));
            }
            let (ordered, free) = (ordered.decide().unwrap(), free.frame().unwrap());
            assert_eq!((&ordered.truth, &ordered.tracks), (&free.truth, &free.tracks));
            let places = |frame: &Frame| frame.uavs.iter().map(|uav| (uav.x_m, uav.y_m)).collect::<Vec<_>>();
            assert_eq!(places(ordered), places(free));
        }
    }

    #[test]
    fn a_mission_has_one_frame_per_period_and_one_more() {
        let scenario = Scenario::load("paper/table-2-single", &Edits::default(), 1).unwrap();
        let mut mission = Mission::new(&scenario).unwrap();
        let frames: Vec<_> = std::iter::from_fn(|| mission.frame().cloned()).collect();
        assert_eq!((frames.len(), mission.frames()), (201, 201));
        assert_eq!(frames[200].time_us, 100_000_000);
    }
}
