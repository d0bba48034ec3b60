//! The agent on a companion computer, using only the library. Each process flies one UAV of a team that tracks three
//! vehicles and communicates over UDP. `docs/user/embedding.md` explains the program.
//!
//! ```text
//! cargo run -p standoff --example companion -- --uav 0 --team 2 --port 47000 --seconds 60 --lose 20
//! ```

pub(crate) mod arguments;
pub(crate) mod udp;

use std::process::ExitCode;

use standoff::*;

use arguments::Arguments;

/// Period at which all UAVs scan and decide, at the same time steps.
pub(crate) const PERIOD: Duration = Duration::from_us(500_000);

/// One UAV: its agent, and simulated replacements for the devices of your aircraft.
pub(crate) struct Companion {
    pub(crate) agent: Agent,
    /// State of the UAV. On your aircraft it comes from the navigation filter; here from a simple model of an aircraft,
    /// which flies the last command.
    pub(crate) own: UavState,
    pub(crate) command: Command,
    /// Pointing target of your gimbal.
    pointing_target: Option<PointingTarget>,
    /// Time of the state, the command and the pointing target.
    now: Time,
    /// True if this computer also has a cue source.
    pub(crate) searches: bool,
    /// Number of received datagrams that are not valid messages.
    pub(crate) damaged: u32,
    /// Diagnostics of the last command.
    diagnostics: Diagnostics,
}

/// Must be the same on every aircraft of a team: with different parameters, the team states differ.
fn team_params() -> TeamParams {
    let mut params = TeamParams::recommended();
    params.link = LinkModel::Lossy;
    params
}

/// Initial state of a UAV: the team starts in a row, flying north.
pub(crate) fn start(id: u32, team: u32) -> UavState {
    let x_m = 600.0 * (f64::from(id) - 0.5 * f64::from(team - 1));
    let (position, heading) = (Position::from_m(x_m, -600.0), Angle::from_deg(90.0));
    UavState::level_flight(position, heading, 40.0)
}

impl Companion {
    pub(crate) fn new(id: u32, restart_count: u32, own: UavState) -> Result<Self, Vec<ParamError>> {
        let params = team_params();
        Ok(Self {
            agent: Agent::new(UavId(id), params)?.with_restart_count(restart_count),
            own,
            command: Command { speed_m_s: own.speed_m_s, turn_rate_rad_s: 0.0 },
            pointing_target: None,
            now: Time::EPOCH,
            searches: id == 0,
            damaged: 0,
            diagnostics: Diagnostics::default(),
        })
    }

    /// Simulates the flight of the aircraft up to a time.
    fn fly_on(&mut self, now: Time) {
        let periods = (now - self.now).us() / PERIOD.us();
        // At most one hour, in case the clock was set.
        let (own, uav, dt_s) = (&mut self.own, team_params().uav, PERIOD.s());
        let after = |now: f64, command: f64, lag_s: f64| now + (command - now) * dt_s / (lag_s + dt_s);
        for _ in 0..periods.min(7200) {
            own.speed_m_s = after(own.speed_m_s, self.command.speed_m_s, uav.speed_lag_s);
            own.turn_rate_rad_s = after(own.turn_rate_rad_s, self.command.turn_rate_rad_s, uav.turn_rate_lag_s);
            own.heading = own.heading + Angle::from_rad(own.turn_rate_rad_s * dt_s);
            own.position = own.position + own.velocity() * dt_s;
        }
    }

    /// Your sensor: its boresight and detections at this time.
    fn look(&self, now: Time) -> (Option<Angle>, Vec<Detection>) {
        let boresight = self.pointing_target.map(|look| look.boresight(self.own.position, now - self.now));
        let sensor = team_params().track.sensor;
        let seen = vehicles(now).filter_map(|(label, position, _)| {
            let offset = position - self.own.position;
            let (range_m, bearing) = (offset.length_m(), offset.direction());
            let is_in_view = (bearing - boresight?).rad().abs() <= 0.5 * sensor.field_of_view_rad;
            let measurement = RangeBearingMeasurement { range_m, bearing };
            let detection = Detection { label: Some(label), measurement, range_rate_m_s: None };
            (is_in_view && range_m <= sensor.sensing_range_m).then_some(detection)
        });
        (boresight, seen.collect())
    }

    /// First half of a time step: passes the own scan to the agent, and returns the messages to send.
    pub(crate) fn observe(&mut self, now: Time) -> (Observation, Vec<Vec<u8>>) {
        self.fly_on(now);
        let (boresight, detections) = self.look(now);
        self.now = now;
        let scan = Scan { boresight, detections: &detections };
        let observation = self.agent.observe(now, &self.own, Some(scan));
        // Here, ids are so small that every message can be encoded.
        let mut messages: Vec<_> = self.agent.outbox(&observation).iter().flat_map(wire::encode).collect();
        // The cue source sends cues for a vehicle, to this computer and to all others, until the team has its track.
        for vehicle in vehicles(now).filter(|_| self.searches) {
            if self.agent.team_state().track_by_label(vehicle.0).is_none() {
                let cue = cue(now, vehicle);
                self.agent.receive(&observation, &cue);
                messages.extend(wire::encode(&cue));
            }
        }
        (observation, messages)
    }

    /// Passes a received datagram to the agent; allowed until the next time step is observed.
    pub(crate) fn hear(&mut self, observation: &Observation, bytes: &[u8]) {
        match wire::decode(bytes) {
            Ok(message) => self.agent.receive(observation, &message),
            Err(_) => self.damaged += 1,
        }
    }

    /// Second half of a time step, after the wait for messages: decides and acts.
    pub(crate) fn decide(&mut self, observation: &Observation) {
        let step = self.agent.decide(observation);
        // Send these to your gimbal and your autopilot, together with `step.altitude_m`.
        self.pointing_target = step.pointing_target;
        self.command = step.command;
        self.diagnostics = step.diagnostics;
        // The clock was set, or the program was paused for long.
        if self.agent.is_time_jump() {
            self.agent.reset();
        }
    }

    /// UAVs assigned to each group, as text. All UAVs agree on it, immediately or soon.
    pub(crate) fn assigned_uavs_by_group(&self) -> String {
        let team_state = self.agent.team_state();
        let assigned_uavs_by_group = team_state.groups.iter().map(|group| {
            let assigned_uavs = team_state
                .teammates
                .iter()
                .filter(|teammate| teammate.group == Some(group.id))
                .map(|teammate| teammate.uav.0.to_string());
            assigned_uavs.collect::<Vec<_>>().join("+")
        });
        assigned_uavs_by_group.collect::<Vec<_>>().join(" ")
    }

    /// The line printed for a time step.
    pub(crate) fn line(&self) -> String {
        let (team_state, own, diagnostics) = (self.agent.team_state(), &self.own, &self.diagnostics);
        let [x_m, y_m] = [own.position.x_m(), own.position.y_m()];
        let r_m = diagnostics.steering.map_or(0.0, |steering| steering.centre_distance_m);
        let r_d_m = team_state.group_of(self.agent.id()).map_or(0.0, |group| group.orbit_radius_m());
        let measured = team_state.tracks().iter().filter(|known| known.track.status == TrackStatus::Updated).count();
        let nearest =
            diagnostics.nearest_groupmate_m.map_or("none".to_owned(), |distance_m| format!("{distance_m:.0} m"));
        let assigned = self.assigned_uavs_by_group();
        // The committed team state cannot change any more and is the same on all UAVs.
        let committed = self.agent.committed().map_or("none".to_owned(), |team_state| {
            format!("{:016x} at {:.1} s", team_state.digest(), team_state.time.s())
        });
        let (t_s, heading_deg, damaged) = (self.now.s(), own.heading.deg(), self.damaged);
        format!(
            "{t_s:4} s  at {x_m:.0},{y_m:.0},{heading_deg:.0}  {r_m:.0} m from the centre, orbit {r_d_m:.0} m, \
             nearest UAV {nearest}, vehicles {measured}, assigned {assigned}; committed {committed}; damaged {damaged}"
        )
    }
}

/// The simulated world: labels, positions and velocities of three vehicles that diverge.
pub(crate) fn vehicles(now: Time) -> impl Iterator<Item = (TargetLabel, Position, Velocity)> {
    let motions = [([0.0, 0.0], [8.0, 3.0]), ([60.0, 30.0], [9.0, 3.5]), ([-40.0, 50.0], [7.5, 4.0])];
    (0..).zip(motions).map(move |(id, ([x_m, y_m], [vx_m_s, vy_m_s]))| {
        let velocity = Velocity::from_m_s(vx_m_s, vy_m_s);
        (TargetLabel(id), Position::from_m(x_m, y_m) + velocity * now.s(), velocity)
    })
}

pub(crate) fn cue(time: Time, (label, position, velocity): (TargetLabel, Position, Velocity)) -> Message {
    Message::Cue(Cue {
        source: 0,
        issued_at: time,
        sequence: label.0 as u16,
        label: Some(label),
        time,
        position,
        velocity,
        position_sd_m: 20.0,
        velocity_sd_m_s: 2.0,
        priority: None,
    })
}

fn main() -> ExitCode {
    let fly = |arguments: Arguments| -> Result<(), Vec<String>> {
        let Arguments { uav, restart_count, at, .. } = arguments;
        let own = at.unwrap_or_else(|| start(uav, arguments.team));
        let uav = Companion::new(uav, restart_count, own)
            .map_err(|errors| errors.iter().map(ParamError::to_string).collect::<Vec<_>>())?;
        udp::fly(uav, &arguments).map_err(|error| vec![format!("port {}: {error}", arguments.port_of(arguments.uav))])
    };
    match Arguments::parse(std::env::args().skip(1)).map_err(|error| vec![error]).and_then(fly) {
        Ok(()) => ExitCode::SUCCESS,
        Err(errors) => {
            errors.iter().for_each(|error| eprintln!("error: {error}"));
            ExitCode::from(2)
        }
    }
}
