//! One mission: world, sensors, radio, controller and commands, one time step after the other; the results are frames.
//!
//! ```text
//! truth -> scans (each along the commanded boresight) -> controller <-> radio -> commands -> truth
//! ```

use standoff::grid::Grid;
use standoff::uav::AutopilotModel;
use standoff::{
    AgentOutput, AirVelocity, Angle, Command, Cue, DesiredPath, Message, ParamError, PointingTarget, Position, Scan,
    Time, UavId, UavState, Velocity, Wind,
};
use standoff_record::agent_rows::{self, AirState, AvoidanceEvents, RetransmissionEvents};
use standoff_record::{Frame, ReportedTables};
use standoff_score::matching::Identities;
use standoff_score::{MetricSelection, Metrics, ScoreConfig, Scorer};

use crate::bank::{BankMotion, HeldCommand};
use crate::controller::{self, Controller, ReportedState};
use crate::gusts::Gusts;
use crate::intruders::Intruders;
use crate::navigation::NavigationError;
use crate::onboard_computer::OnboardComputer;
use crate::radio::{Radio, RadioNode, SentCounts};
use crate::random::Draws;
use crate::scenario::{Outage, Scenario, Settings, uav_of};
use crate::sensors::{self, Detections, SensorScan};
use crate::truth_rows;
use crate::wind::{AirMotion, height_m};
use crate::world::{Truth, World};

/// A mission in progress.
///
/// ```
/// use standoff_sim::run::Mission;
/// use standoff_sim::scenario::{Overrides, Scenario};
///
/// let scenario = Scenario::load("tour/01-one-uav", &Overrides::default(), 1)?;
/// let mut mission = Mission::new(&scenario).expect("a loaded scenario can be flown");
/// let mut last_s = 0.0;
/// while let Some(frame) = mission.frame() {
///     assert_eq!((frame.uavs.len(), frame.truth.len()), (1, 1));
///     last_s = frame.time_us as f64 / 1e6;
/// }
/// assert_eq!(last_s, scenario.settings.duration.s());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Mission<B = Box<dyn Controller + Send>> {
    settings: Settings,
    outages: Vec<Outage>,
    world: World,
    draws: Draws,
    uavs: Vec<Uav>,
    intruders: Intruders,
    /// Response of the UAVs to commands that are constant for a period.
    response: AutopilotModel,
    controller: B,
    /// True if the controller is not the built-in one.
    is_third_party: bool,
    radio: Radio,
    /// Whether each target has been cued, indexed by target id.
    cued: Vec<bool>,
    tick: i64,
    /// Progress of the current time step.
    stage: Stage,
    truth: Vec<Truth>,
    /// Index of the targets' positions.
    places: Grid,
    /// Finds the targets of tracks, if sensors report no identities.
    identities: Option<Identities>,
    frame: Frame,
}

/// Progress of a time step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// The sensors have not measured yet.
    Ahead,
    /// The sensors have measured, and the controller has received all messages.
    Observed,
    /// The controller has decided, and the frame holds its commands.
    Proposed,
}

/// Flies a whole mission and scores it without writing a record.
pub fn fly(scenario: &Scenario, choice: MetricSelection) -> Result<Metrics, Vec<ParamError>> {
    fly_while(scenario, choice, || true)
}

/// Flies a mission as long as `go_on` returns `true` before each time step, and scores the time steps flown.
pub fn fly_while(
    scenario: &Scenario,
    choice: MetricSelection,
    go_on: impl Fn() -> bool,
) -> Result<Metrics, Vec<ParamError>> {
    Ok(Mission::new(scenario)?.score_while(choice, go_on))
}

/// A UAV in the world: its state, its controller's outputs and its sensor's measurements.
struct Uav {
    id: UavId,
    /// True state.
    truth: UavState,
    /// Its motion relative to the air; `None` without wind.
    air: Option<AirMotion>,
    /// Its bank; `None` if it does not bank.
    bank: Option<BankMotion>,
    /// Gusts around it; `None` in steady wind.
    gusts: Option<Gusts>,
    /// State that its controller assumes.
    believed_state: UavState,
    /// Its difference from the true one; `None` if the navigation is exact.
    navigation_error: Option<NavigationError>,
    pointing_target: Option<PointingTarget>,
    /// During an outage: it neither measures nor sends.
    is_out: bool,
    computer: OnboardComputer,
    /// True if its computer is off.
    is_off: bool,
    /// Direction of the sensor, assumed by its controller.
    boresight: Option<Angle>,
    detections: Detections,
    command: Command,
    /// Path that the command leads onto.
    path: Option<DesiredPath>,
    /// Wind that its controller assumes.
    assumed_wind: Wind,
    /// Commanded altitude, m.
    altitude_m: Option<f64>,
    avoidance: AvoidanceEvents,
    retransmission: RetransmissionEvents,
}

impl Uav {
    fn heading_error(&self) -> Option<Angle> {
        self.navigation_error.as_ref().map(NavigationError::heading)
    }

    /// Air velocity that the UAV measures, with its heading error; `None` without wind.
    fn air_data(&self) -> Option<AirVelocity> {
        let AirVelocity { heading, airspeed_m_s } = self.air?.velocity();
        let heading = self.heading_error().map_or(heading, |error| heading + error);
        Some(AirVelocity { heading, airspeed_m_s })
    }

    /// Where the sensor points: the UAV turns it relative to the heading that it assumes.
    fn true_boresight(&self) -> Option<Angle> {
        self.boresight.map(|assumed| self.heading_error().map_or(assumed, |error| assumed - error))
    }
}

impl Mission {
    /// Creates a mission at its start, flown by the built-in agents. Returns all parameters that are out of range,
    /// including those out of range at this period.
    pub fn new(scenario: &Scenario) -> Result<Self, Vec<ParamError>> {
        let (Settings { agents, team, geofence, priorities, .. }, uavs) = (&scenario.settings, scenario.uavs.len());
        let areas = priorities.areas.clone();
        let controller = controller::team_controller(*agents, *team, geofence.clone(), areas, uavs)?;
        Ok(Self { is_third_party: false, ..Self::with_controller(scenario, controller)? })
    }
}

impl<B: Controller> Mission<B> {
    /// Like [`Self::new`], flown by the given controller.
    pub fn with_controller(scenario: &Scenario, controller: B) -> Result<Self, Vec<ParamError>> {
        let settings = scenario.settings.clone();
        let errors = settings.team.errors_for_period(settings.period);
        if !errors.is_empty() {
            return Err(errors);
        }
        let (draws, navigation) = (Draws::new(scenario.seed), settings.navigation);
        let uavs = scenario.uavs.iter().zip((0..).map(UavId)).map(|(state, id)| {
            let gusts = settings.wind.and_then(|wind| wind.gusts).map(|_| Gusts::new(id, draws));
            let wind = settings.wind.map(|wind| wind.around(height_m(state, None, &settings.team, id), gusts.as_ref()));
            let (air, state) = AirMotion::start(state, wind);
            let error = (!navigation.is_exact()).then(|| NavigationError::new(&navigation, id, draws));
            Uav {
                id,
                truth: state,
                air,
                bank: settings.team.uav.bank.as_ref().map(BankMotion::level),
                gusts,
                believed_state: error.as_ref().map_or(state, |error| error.believed(&state)),
                navigation_error: error,
                pointing_target: None,
                is_out: false,
                computer: OnboardComputer::new(id, scenario),
                is_off: false,
                boresight: None,
                detections: Detections::default(),
                command: Command { speed_m_s: state.speed_m_s, turn_rate_rad_s: 0.0 },
                path: None,
                assumed_wind: Wind::default(),
                altitude_m: None,
                avoidance: AvoidanceEvents::default(),
                retransmission: RetransmissionEvents::default(),
            }
        });
        Ok(Self {
            outages: scenario.outages.clone(),
            world: World::new(scenario),
            draws,
            uavs: uavs.collect(),
            intruders: Intruders::new(scenario),
            response: settings.team.uav.response(settings.period),
            controller,
            is_third_party: true,
            radio: Radio::new(scenario),
            cued: Vec::new(),
            tick: 0,
            stage: Stage::Ahead,
            truth: Vec::new(),
            places: Grid::default(),
            identities: (!settings.sensor.has_labels).then(Identities::default),
            frame: Frame::default(),
            settings,
        })
    }

    /// Tables that its controller reports.
    pub fn reported_tables(&self) -> ReportedTables {
        self.controller.reported()
    }

    /// Scoring configuration of the mission; what its controller does not report is not scored.
    pub fn score_config(&self) -> ScoreConfig {
        ScoreConfig { reported: self.reported_tables(), ..self.settings.score_config() }
    }

    /// Number of frames of the whole mission.
    pub fn frames(&self) -> u64 {
        self.last_tick() as u64 + 1
    }

    /// Simulates one time step and returns its frame; `None` after the end of the mission.
    pub fn frame(&mut self) -> Option<&Frame> {
        self.observe();
        self.decide()
    }

    /// Simulates time steps as long as `go_on` returns `true` before each, and scores them.
    pub fn score_while(&mut self, choice: MetricSelection, go_on: impl Fn() -> bool) -> Metrics {
        let mut scorer = Scorer::new(self.score_config(), choice);
        while go_on() {
            let Some(frame) = self.frame() else { break };
            scorer.frame(frame);
        }
        scorer.metrics()
    }

    /// First half of a time step: the sensors measure, and the controller observes and receives messages. Repeated
    /// calls have no effect until [`Self::decide`]. Returns `false` after the end of the mission.
    pub fn observe(&mut self) -> bool {
        let goes_on = self.tick <= self.last_tick();
        if goes_on && self.stage == Stage::Ahead {
            let now = self.now();
            self.world.truth(now, &mut self.truth);
            self.scan(now);
            self.send(now);
            self.stage = Stage::Observed;
        }
        goes_on
    }

    /// Computes the commands of the observed time step and returns its frame, which [`Self::decide`] then returns
    /// unless [`override_command`](Self::override_command) overrides a command. `None` if nothing was observed.
    pub fn propose(&mut self) -> Option<&Frame> {
        if self.stage == Stage::Observed {
            self.command(self.now());
            self.stage = Stage::Proposed;
        }
        (self.stage == Stage::Proposed).then_some(&self.frame)
    }

    /// Overrides the command that the controller has [`propose`](Self::propose)d for a UAV, for this time step and
    /// within the limits; the controller still points the sensor. Returns `false` if nothing was proposed or the UAV
    /// does not exist.
    pub fn override_command(&mut self, uav: UavId, command: Command) -> bool {
        let index = uav.0 as usize;
        let (Some(uav), Some(row)) = (self.uavs.get_mut(index), self.frame.uavs.get_mut(index)) else { return false };
        if self.stage != Stage::Proposed {
            return false;
        }
        let limited = self.settings.team.uav.limit(command);
        (uav.command, uav.path) = (limited.command, None);
        row.speed_command_m_s = limited.command.speed_m_s;
        row.turn_rate_command_rad_s = limited.command.turn_rate_rad_s;
        (row.speed_limited, row.turn_rate_limited) = (limited.speed_limited, limited.turn_rate_limited);
        true
    }

    /// Second half of a time step: the controller decides, unless it has already proposed, and the world advances to
    /// the next time step. `None` if nothing was observed.
    pub fn decide(&mut self) -> Option<&Frame> {
        self.propose()?;
        self.fly();
        self.world.step();
        self.tick += 1;
        self.stage = Stage::Ahead;
        Some(&self.frame)
    }

    /// Messages that each UAV has sent in the last observed time step, by id.
    pub fn sent(&self) -> &[SentCounts] {
        self.radio.sent()
    }

    /// Time of the time step that is next or being simulated.
    pub fn now(&self) -> Time {
        Time::from_us(self.tick * self.settings.period.us())
    }

    /// Returns whether that time step is the last one of the mission.
    pub fn is_last(&self) -> bool {
        self.tick >= self.last_tick()
    }

    /// Index of the last time step: the first is 0, then one per whole period.
    fn last_tick(&self) -> i64 {
        let Settings { duration, period, .. } = self.settings;
        duration.us() / period.us().max(1)
    }

    /// Points every sensor as its UAV commanded, from the state that the UAV assumes, and measures.
    fn scan(&mut self, now: Time) {
        let Settings { period, sensor, buildings, .. } = &self.settings;
        // In pairs, whose boresights are computed as a batch (SIMD); a single last UAV is paired with itself.
        for pair in self.uavs.chunks_mut(2) {
            for uav in &mut *pair {
                let mut own = self.outages.iter().filter(|outage| uav_of(outage.uav) == uav.id);
                uav.is_off = !uav.computer.is_on(now);
                uav.is_out = uav.is_off || own.any(|outage| (outage.from_s..outage.until_s).contains(&now.s()));
            }
            let nowhere = PointingTarget { position: Position::ORIGIN, velocity: Velocity::ZERO };
            let looks = [&pair[0], &pair[pair.len() - 1]]
                .map(|uav| (uav.pointing_target.unwrap_or(nowhere), uav.believed_state.position));
            for (uav, boresight) in pair.iter_mut().zip(PointingTarget::boresight_batch(looks, *period)) {
                uav.boresight = (uav.pointing_target.is_some() && !uav.is_out).then_some(boresight);
            }
        }
        let positions = self.truth.iter().map(|target| target.state.position());
        self.places.fill(positions, 0.5 * sensor.truth.sensing_range_m);
        for uav in &mut self.uavs {
            let Some(boresight) = uav.true_boresight() else {
                uav.detections.clear();
                continue;
            };
            let draws = (self.draws, self.tick as u64);
            let scan = SensorScan { uav: uav.id, state: &uav.truth, boresight, buildings, draws };
            scan.detect(sensor, &self.truth, &self.places, &mut uav.detections);
            if let Some(error) = uav.heading_error() {
                // Bearings are measured relative to the heading.
                for detection in &mut uav.detections.all {
                    detection.measurement.bearing = detection.measurement.bearing + error;
                }
            }
        }
    }

    /// Every UAV whose computer is on observes, and receives what the radio delivers: the messages of the other UAVs,
    /// and cues of targets that have just appeared or already exist when the first computer is switched on.
    fn send(&mut self, now: Time) {
        let Self { settings, uavs, controller, radio, cued, intruders, .. } = self;
        radio.open();
        for uav in &mut *uavs {
            radio.join(RadioNode { position: uav.truth.position, transmits: !uav.is_out, receives: !uav.is_off });
            if uav.is_off {
                continue;
            }
            if let Some(restart_count) = uav.computer.restarted(now) {
                controller.restart(uav.id, restart_count);
            }
            let scan = Scan { boresight: uav.boresight, detections: &uav.detections.all };
            controller.observe(uav.computer.time(now), uav.id, &uav.believed_state, (!uav.is_out).then_some(scan));
            if let Some(air) = uav.air_data() {
                controller.observe_air(uav.id, &air);
            }
            if !uav.is_out {
                controller.outbox(uav.id).iter().for_each(|message| radio.send(uav.id, message));
            }
        }
        // No cues are sent while all computers are off.
        let visible = if uavs.iter().all(|uav| uav.is_off) { &[] } else { &self.truth[..] };
        for target in visible {
            let index = target.target.0 as usize;
            if index >= cued.len() {
                cued.resize(index + 1, false);
            }
            if !std::mem::replace(&mut cued[index], true) {
                let cue = sensors::cue(target, now, settings.cue, settings.sensor.has_labels, self.draws);
                let priority = settings.priorities.of_target.get(&target.target.0).copied();
                radio.cue(target.target.0, Message::Cue(Cue { priority, ..cue }));
            }
        }
        intruders.reports(now).for_each(|(aircraft, message)| radio.traffic(aircraft, message));
        radio.carry(self.tick, now, |uav, message| controller.receive(uav, message));
    }

    /// Every UAV decides, and the controller reports its state.
    fn command(&mut self, now: Time) {
        let Self { frame, controller, uavs, settings, radio, intruders, identities, .. } = self;
        truth_rows::begin(now, &self.truth, frame);
        frame.intruders.extend(intruders.all().map(|(number, intruder)| truth_rows::intruder(number, intruder, now)));
        let is_on = uavs.iter().any(|uav| !uav.is_off);
        let mut avoidances = Vec::new();
        for uav in &mut *uavs {
            let mut step = if uav.is_off {
                AgentOutput::command_only(settings.team.fallback_command())
            } else {
                controller.decide(uav.id)
            };
            // Commands of every controller are limited to what a UAV can fly.
            let limited = settings.team.uav.limit(step.command);
            step.command = limited.command;
            step.pointing_target =
                step.pointing_target.filter(|look| look.position.is_finite() && look.velocity.is_finite());
            step.altitude_m = step.altitude_m.filter(|altitude_m| altitude_m.is_finite());
            step.diagnostics.speed_limited |= limited.speed_limited;
            step.diagnostics.turn_rate_limited |= limited.turn_rate_limited;
            let believed_state = uav.navigation_error.map(|_| uav.believed_state);
            let air = uav.air.map(|air| AirState { velocity: air.velocity(), wind: air.wind.velocity });
            let states = (&uav.truth, believed_state.as_ref(), air.as_ref());
            let mut row = agent_rows::uav(uav.id, states, uav.true_boresight(), &step);
            row.bank_rad = uav.bank.as_ref().map(BankMotion::bank_rad);
            row.bank_command_rad = uav.bank.as_ref().map(BankMotion::command_rad);
            frame.uavs.push(row);
            let detected = uav.detections.all.iter().zip(&uav.detections.targets);
            frame
                .detections
                .extend(detected.map(|(detection, of)| agent_rows::detection(uav.id, detection, of.map(|of| of.0))));
            (uav.pointing_target, uav.command, uav.altitude_m) = (step.pointing_target, step.command, step.altitude_m);
            uav.path = step.path;
            uav.assumed_wind = Wind { velocity: step.diagnostics.wind.unwrap_or(Velocity::ZERO) };
            uav.avoidance.add(now, uav.id, step.diagnostics.avoiding.as_ref(), &mut avoidances);
        }
        let Frame { tracks, tentative, groups, events, agents, .. } = &mut *frame;
        let mut beliefs = ReportedState { tracks, tentative, groups, events };
        if is_on {
            controller.report(&mut beliefs);
            controller.report_per_agent(agents);
        }
        if let Some(identities) = identities {
            identities.identify(frame);
        }
        let Frame { tracks, tentative, groups, events, agents, .. } = frame;
        if self.is_third_party {
            ReportedState { tracks, tentative, groups, events }.tidy();
        }
        events.append(&mut avoidances);
        agents.tidy();
        for row in &mut agents.all {
            let sent = radio.sent().get(row.agent as usize).copied().unwrap_or_default();
            (row.sent_messages, row.sent_bytes) = (sent.messages, sent.bytes);
            if let Some(uav) = uavs.get_mut(row.agent as usize) {
                let is_limited = row.retransmission_limited == Some(true);
                uav.retransmission.add(now, uav.id, is_limited, events);
            }
        }
    }

    /// Every UAV flies its command until the next time step, and the intruders fly on.
    fn fly(&mut self) {
        let Self { settings, uavs, intruders, .. } = self;
        intruders.fly(settings, |uav| uavs.get(uav.0 as usize).map(|uav| &uav.truth));
        let (navigation, period) = (self.settings.navigation, self.settings.period);
        let Settings { team, wind, flies_equivalent_airspeed, .. } = &self.settings;
        for uav in &mut self.uavs {
            let Uav { id, command, altitude_m, .. } = *uav;
            let bank = uav.bank.as_mut().zip(team.uav.bank);
            let (path, assumed_wind, navigation_error) = (uav.path, uav.assumed_wind, uav.navigation_error);
            let air = uav.air.map_or(Velocity::ZERO, |air| air.wind.velocity);
            let flown = |before: &UavState| match bank {
                Some((bank, model)) => {
                    let height_m = height_m(before, altitude_m, team, id);
                    let flies_equivalent_airspeed = *flies_equivalent_airspeed;
                    let held = HeldCommand {
                        command,
                        path,
                        assumed_wind,
                        navigation_error,
                        air,
                        altitude_m,
                        height_m,
                        period,
                        flies_equivalent_airspeed,
                    };
                    bank.fly(&model, &team.uav, before, &held)
                }
                None => {
                    let mut after = self.response.step(before, command);
                    if let (Some(vertical), Some(climb)) = (&mut after.vertical, &team.uav.climb) {
                        *vertical = climb.step(vertical, altitude_m, period);
                    }
                    after
                }
            };
            uav.truth = match (&mut uav.air, wind) {
                (Some(air), Some(wind)) => {
                    let wind_of = |state: &UavState| {
                        let height_m = height_m(state, altitude_m, team, id);
                        if let (Some(gusts), Some(model)) = (&mut uav.gusts, &wind.gusts) {
                            gusts.step(model, height_m, period, id, (self.draws, self.tick as u64 + 1));
                        }
                        wind.around(height_m, uav.gusts.as_ref())
                    };
                    air.fly(&uav.truth, period, flown, wind_of)
                }
                _ => flown(&uav.truth),
            };
            uav.believed_state = match &mut uav.navigation_error {
                None => uav.truth,
                Some(error) => {
                    error.step(&navigation, period, uav.id, (self.draws, self.tick as u64 + 1));
                    error.believed(&uav.truth)
                }
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use super::*;
    use crate::common::{frames, load};
    use crate::target_id::TargetId;
    use standoff::{AgentOutput, Displacement, TargetState};
    use standoff_record::NO_TARGET;

    /// Agents have no access to the truth: moving every target after the scan changes no command and no estimate.
    #[test]
    fn changing_the_truth_after_the_scan_changes_no_command() {
        for name in ["paper/table-2-pair", "traffic/convoy"] {
            let scenario = load(name, &[], 3);
            let mut original = Mission::new(&scenario).unwrap();
            let mut altered = Mission::new(&scenario).unwrap();
            for _ in 0..100 {
                let mut frames = Vec::new();
                for (mission, alters) in [(&mut original, false), (&mut altered, true)] {
                    let now = Time::from_us(mission.tick * scenario.settings.period.us());
                    mission.world.truth(now, &mut mission.truth);
                    mission.scan(now);
                    mission.send(now);
                    if alters {
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

    /// Unlabelled detections: if the targets have other ids, the record differs in these only.
    #[test]
    fn renaming_the_targets_renames_them_in_the_record_and_changes_nothing_else() {
        let renamed = |target: u32| if target < NO_TARGET { 6 - target } else { target };
        for set in [&["team.agents=shared"], &["team.agents=per-uav"]] {
            let scenario = load("tour/10-unlabelled-detections", set, 4);
            let [mut original, mut other] = [0; 2].map(|_| Mission::new(&scenario).unwrap());
            while original.observe() {
                other.observe();
                other.truth.iter_mut().for_each(|target| target.target = TargetId(renamed(target.target.0)));
                other.truth.sort_by_key(|target| target.target);
                for target in other.uavs.iter_mut().flat_map(|uav| &mut uav.detections.targets).flatten() {
                    *target = TargetId(renamed(target.0));
                }
                let mut expected = original.decide().unwrap().clone();
                let Frame { truth, tracks, detections, events, agents, .. } = &mut expected;
                truth.iter_mut().for_each(|row| row.target = renamed(row.target));
                truth.sort_by_key(|row| row.target);
                let rows = tracks.iter_mut().chain(agents.tracks.iter_mut().map(|of| &mut of.row));
                rows.for_each(|row| row.target = renamed(row.target));
                tracks.sort_by_key(|row| row.target);
                agents.tracks.sort_by_key(|of| (of.agent, of.row.target));
                detections.iter_mut().for_each(|row| row.target = row.target.map(renamed));
                let events = events.iter_mut().chain(agents.events.iter_mut().map(|row| &mut row.event));
                events.for_each(|event| event.target = event.target.map(renamed));
                assert!(*other.decide().unwrap() == expected, "{} s", expected.time_us / 1_000_000);
            }
        }
    }

    /// Stores the states that its UAVs assume.
    struct Listener(Rc<RefCell<Vec<UavState>>>);

    impl Controller for Listener {
        fn observe(&mut self, _: Time, _: UavId, own: &UavState, _: Option<Scan>) {
            self.0.borrow_mut().push(*own);
        }
        fn receive(&mut self, _: UavId, _: &Message) {}
        fn decide(&mut self, _: UavId) -> AgentOutput {
            AgentOutput::command_only(Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 })
        }
    }

    /// The controller gets the state that the UAV assumes; the record gets the true one.
    #[test]
    fn a_controller_gets_the_assumed_state_and_the_record_the_true_one() {
        let scenario = load("tour/01-one-uav", &[], 1);
        let observed = Rc::default();
        let mut mission = Mission::with_controller(&scenario, Box::new(Listener(Rc::clone(&observed)))).unwrap();
        let truth = mission.uavs[0].truth;
        let belief = UavState { position: truth.position + Displacement::from_m(30.0, -4.0), ..truth };
        mission.uavs[0].believed_state = belief;
        let row = mission.frame().unwrap().uavs[0];
        assert_eq!(*observed.borrow(), [belief]);
        assert_eq!((row.x_m, row.y_m), (truth.position.x_m(), truth.position.y_m()));
        assert_eq!(mission.uavs[0].believed_state, mission.uavs[0].truth, "navigation is perfect");
    }

    /// Calling `observe` twice has no further effect, and a time step is decided once.
    #[test]
    fn observe_and_decide_together_equal_frame() {
        let scenario = load("tour/02-two-uavs", &[], 2);
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

    /// An override replaces the command of one UAV and nothing else, within its limits, in one time step.
    #[test]
    fn an_override_replaces_one_command_for_one_time_step() {
        let scenario = load("tour/02-two-uavs", &[], 2);
        let [mut free, mut ordered] = [0; 2].map(|_| Mission::new(&scenario).unwrap());
        let order = Command { speed_m_s: 1000.0, turn_rate_rad_s: -0.125 };
        assert!(ordered.propose().is_none() && !ordered.override_command(UavId(1), order), "nothing was observed");
        assert!(ordered.observe() && !ordered.override_command(UavId(1), order), "nothing was proposed");
        let proposed = free.frame().unwrap().clone();
        assert_eq!(ordered.propose(), Some(&proposed));
        assert!(!ordered.override_command(UavId(2), order), "there are two UAVs");
        assert!(ordered.override_command(UavId(1), order));
        let fastest_m_s = scenario.settings.team.uav.speed_max_m_s();
        let mut expected = proposed.clone();
        let row = &mut expected.uavs[1];
        (row.speed_command_m_s, row.speed_limited) = (fastest_m_s, true);
        (row.turn_rate_command_rad_s, row.turn_rate_limited) = (-0.125, false);
        assert_eq!(ordered.decide(), Some(&expected));
        let commands =
            |mission: &Mission| mission.uavs.iter().map(|uav| (uav.command, uav.pointing_target)).collect::<Vec<_>>();
        let (other, [mine, theirs]) = (commands(&free)[1], [commands(&ordered), commands(&free)]);
        assert_eq!((mine[0], mine[1].1), (theirs[0], other.1));
        assert_eq!(mine[1].0, Command { speed_m_s: fastest_m_s, ..order });
        assert!(ordered.uavs[1].truth.speed_m_s > free.uavs[1].truth.speed_m_s);
        assert_eq!(ordered.uavs[0].truth, free.uavs[0].truth);
        // Overriding with the proposed command changes no bit.
        let [mut free, mut ordered] = [0; 2].map(|_| Mission::new(&scenario).unwrap());
        while ordered.observe() {
            assert_eq!(ordered.is_last(), ordered.now().s() == scenario.settings.duration.s());
            let rows = ordered.propose().unwrap().uavs.clone();
            for row in rows {
                let command =
                    Command { speed_m_s: row.speed_command_m_s, turn_rate_rad_s: row.turn_rate_command_rad_s };
                assert!(ordered.override_command(UavId(row.uav), command));
            }
            let (ordered, free) = (ordered.decide().unwrap(), free.frame().unwrap());
            assert_eq!((&ordered.truth, &ordered.tracks), (&free.truth, &free.tracks));
            let places = |frame: &Frame| frame.uavs.iter().map(|uav| (uav.x_m, uav.y_m)).collect::<Vec<_>>();
            assert_eq!(places(ordered), places(free));
        }
    }

    #[test]
    fn a_mission_has_one_frame_per_period_and_one_more() {
        let scenario = load("paper/table-2-single", &[], 1);
        let frames = frames(&scenario);
        assert_eq!((frames.len(), Mission::new(&scenario).unwrap().frames()), (201, 201));
        assert_eq!(frames[200].time_us, 100_000_000);
    }
}
