//! Flight of the companion's program with the double of the vehicle, in simulated time.

use std::collections::VecDeque;

use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};
use standoff::{Duration, Geofence, PointingTarget, TeamParams, Time, UavId};
use standoff_fly::codec::{Codec, SigningKey};
use standoff_fly::companion::Companion;
use standoff_fly::config::{Config, Steer};
use standoff_io::geodesy::LocalPlane;
use standoff_record::Frame;

use super::identified_aircraft::Noise;
use super::offline_flight::{Target, straight};
use super::plane::{GUIDED, LOITER, Plane, STEP_S, cue_line};

/// Start of the flights in the team's time.
const START_US: i64 = 1_000_000_000_000;

pub(crate) fn local_plane() -> LocalPlane {
    LocalPlane::about(47.4, 8.5).unwrap()
}

pub(crate) fn params() -> TeamParams {
    let mut params = TeamParams::recommended();
    params.uav.speed_m_s = 23.0;
    params.uav.speed_change_max_m_s = 6.0;
    params.uav.turn_rate_lag_s = 0.6;
    params.uav.speed_lag_s = 3.0;
    params
}

pub(crate) fn config() -> Config {
    Config {
        params: params(),
        geofence: Geofence::default(),
        areas: Vec::new(),
        uav: UavId(0),
        restart_count: 0,
        system_id: 1,
        plane: local_plane(),
        teammates: Vec::new(),
        altitude_m: [60.0, 300.0],
        steer: Steer::Roll,
        // The double begins in GUIDED.
        engages_after_restart: true,
    }
}

pub(crate) struct Flight {
    pub(crate) companion: Companion,
    codec: Codec,
    pub(crate) vehicle: Plane,
    pub(crate) target: Target,
    /// Pointing target of the simulated gimbal and its time.
    pointing: Option<(Time, PointingTarget)>,
    pub(crate) has_feed: bool,
    /// Rows for the record so far.
    pub(crate) frames: Vec<Frame>,
    /// Datagrams to teammates that were not taken yet.
    pub(crate) to_teammates: Vec<Vec<u8>>,
    /// Time for which the vehicle was held, s.
    held_s: f64,
    /// Times at which a circle was requested, s.
    pub(crate) circle_requests_s: Vec<f64>,
    /// Share of the messages that are lost in each direction.
    pub(crate) loss: f64,
    /// Time by which the clock of the computer was set, s.
    pub(crate) clock_step_s: f64,
    /// False while messages from the autopilot are lost.
    pub(crate) has_downlink: bool,
    /// Time that a message from the autopilot needs.
    pub(crate) delay_s: f64,
    /// Messages from the autopilot that are on the way: time of arrival, s, and datagram.
    on_the_way: VecDeque<(f64, Vec<u8>)>,
    /// Standard deviations of range (m) and bearing (rad) of the simulated sensor.
    pub(crate) noise: [f64; 2],
    random: Noise,
}

impl Flight {
    pub(crate) fn new(config: Config, key: Option<&SigningKey>) -> Self {
        Self {
            companion: Companion::new(config).unwrap(),
            codec: Codec::new(1, key),
            vehicle: Plane::new(local_plane(), key),
            target: Target::new(straight),
            pointing: None,
            has_feed: true,
            frames: Vec::new(),
            to_teammates: Vec::new(),
            held_s: 0.0,
            circle_requests_s: Vec::new(),
            loss: 0.0,
            clock_step_s: 0.0,
            has_downlink: true,
            delay_s: 0.0,
            on_the_way: VecDeque::new(),
            noise: [0.0; 2],
            random: Noise::new(1),
        }
    }

    pub(crate) fn now(&self) -> Time {
        Time::from_us(START_US + ((self.vehicle.time_s() + self.held_s) * 1e6).round() as i64)
    }

    /// Status line.
    pub(crate) fn line(&self) -> String {
        standoff_fly::status::line(self.now(), &self.companion)
    }

    /// The pilot selects another mode, and then GUIDED.
    pub(crate) fn select_guided_again(&mut self) {
        self.vehicle.mode = LOITER;
        self.fly(2.0);
        self.vehicle.mode = GUIDED;
    }

    /// Holds the vehicle, but not the program, for a multiple of 0.1 s.
    pub(crate) fn hold(&mut self, seconds: f64) {
        for _ in 0..(seconds * 10.0).round() as u32 {
            self.held_s += 0.1;
            self.look();
            self.decide();
        }
    }

    /// Distance of the UAV from the target, m.
    pub(crate) fn range_m(&self) -> f64 {
        self.vehicle.aircraft.position.distance_m(self.target.position)
    }

    fn is_lost(&mut self) -> bool {
        self.loss > 0.0 && self.random.uniform() < self.loss
    }

    /// Passes bytes to the companion as a datagram from the vehicle's address.
    pub(crate) fn hear(&mut self, datagram: &[u8]) {
        let now = self.now();
        self.codec.decode_datagram(datagram, |header, message| {
            self.companion.receive(now, &header, &message);
        });
    }

    /// Line of the feed with the scan of the simulated sensor.
    fn feed_line(&mut self, now: Time) -> String {
        let own = self.vehicle.aircraft.position;
        let sensor = params().track.sensor;
        let boresight = self.pointing.map(|(at, pointing)| pointing.boresight(own, now - at));
        let seen = boresight.and_then(|boresight| sensor.measure(own, boresight, self.target.position));
        let detections = seen.map_or(String::new(), |z| {
            let range_m = (z.range_m + self.noise[0] * self.random.next()).max(1.0);
            let bearing_deg = 90.0 - z.bearing.deg() + (self.noise[1] * self.random.next()).to_degrees();
            format!(r#"{{"label": 0, "range_m": {range_m}, "bearing_deg": {bearing_deg}}}"#)
        });
        let boresight = boresight.map_or("null".to_owned(), |boresight| (90.0 - boresight.deg()).to_string());
        format!(r#"{{"scan": {{"boresight_deg": {boresight}, "detections": [{detections}]}}}}"#)
    }

    /// Cue for the target.
    pub(crate) fn cue(&mut self) {
        let now = self.now();
        self.companion.hear_feed(now, &cue_line(&local_plane(), self.target.position)).unwrap();
    }

    /// Flies a step of 0.1 s.
    pub(crate) fn step(&mut self) {
        for _ in 0..(0.1 / STEP_S).round() as u32 {
            self.target.advance(STEP_S);
            let datagrams = self.vehicle.advance();
            self.deliver(datagrams);
        }
        self.look();
        self.decide();
    }

    /// The sensor scans, and the user cues the target, every 0.5 s.
    fn look(&mut self) {
        let now = self.now();
        if self.has_feed && now.us() % 500_000 == 0 {
            let line = self.feed_line(now);
            self.companion.hear_feed(now, &line).unwrap();
            if self.companion.agent().team_state().tracks().is_empty() {
                self.cue();
            }
        }
    }

    /// Runs the companion's program once and passes its messages to the vehicle.
    pub(crate) fn decide(&mut self) {
        let now = self.now();
        self.companion.hear_clock(now, now + Duration::from_s(self.clock_step_s));
        let outgoing = self.companion.step(now);
        self.pointing = self.companion.output.pointing_target.map(|pointing| (now, pointing));
        self.frames.extend(outgoing.frame);
        self.to_teammates.extend(outgoing.teammates);
        for message in outgoing.mavlink {
            if matches!(&message, MavMessage::COMMAND_INT(int) if int.command == MavCmd::MAV_CMD_DO_REPOSITION) {
                self.circle_requests_s.push(self.vehicle.time_s());
            }
            let frame = self.codec.encode(&message);
            if self.is_lost() {
                continue;
            }
            let answers = self.vehicle.receive(&frame);
            self.deliver(answers);
        }
    }

    /// Delivers datagrams of the vehicle after the time that they need.
    fn deliver(&mut self, datagrams: Vec<Vec<u8>>) {
        let now_s = self.vehicle.time_s();
        for datagram in datagrams {
            if self.has_downlink && !self.is_lost() {
                self.on_the_way.push_back((now_s + self.delay_s, datagram));
            }
        }
        while self.on_the_way.front().is_some_and(|(at_s, _)| *at_s <= now_s + 1e-9) {
            let (_, datagram) = self.on_the_way.pop_front().unwrap();
            self.hear(&datagram);
        }
    }

    pub(crate) fn fly(&mut self, seconds: f64) {
        let end_s = self.vehicle.time_s() + seconds;
        while self.vehicle.time_s() < end_s - 1e-9 {
            self.step();
        }
    }
}
