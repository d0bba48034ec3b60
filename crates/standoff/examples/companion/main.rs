//! The agent on a companion computer, with the library alone: one process for each UAV of a team that keeps three vehicles
//! in view and talks by UDP. `docs/embedding.md` walks through it.
//!
//! ```text
//! cargo run -p standoff --example companion -- --uav 0 --team 2 --port 47000 --seconds 60 --lose 20
//! ```

pub(crate) mod arguments;
pub(crate) mod udp;
pub(crate) mod wire;

use std::process::ExitCode;

use standoff::*;

use arguments::Arguments;

/// All UAVs scan, and decide, at the same instants, so far apart.
pub(crate) const PERIOD: Duration = Duration::from_us(500_000);

/// One UAV: its agent, and stand-ins for what your aircraft has.
pub(crate) struct Companion {
    pub(crate) agent: Agent,
    /// Your navigation filter's answer; here a model of the autopilot keeps it, which holds the last command until another
    /// one comes.
    pub(crate) own: UavState,
    autopilot: Response,
    pub(crate) command: Command,
    /// Where your gimbal points.
    look_at: Option<LookAt>,
    /// The instant of all these.
    now: Time,
    /// Somebody beside this computer searches, and hands vehicles over to it.
    pub(crate) searches: bool,
    /// How many instants were refused, in all and one after the other.
    refused: u32,
    refused_in_a_row: u32,
    /// Messages that were damaged, or were none.
    pub(crate) damaged: u32,
    /// How good the last command is.
    diagnostics: Diagnostics,
}

/// The same on every aircraft of a team: pictures made with other parameters are other pictures.
fn team_params() -> TeamParams {
    TeamParams { radio: Radio::Fallible, ..TeamParams::table_1() }
}

/// Where the UAVs of a team begin: in a row, flying north.
pub(crate) fn start(id: u32, team: u32) -> UavState {
    let x_m = 600.0 * (f64::from(id) - 0.5 * f64::from(team - 1));
    let (position, heading) = (Position::from_m(x_m, -600.0), Angle::from_deg(90.0));
    UavState::straight(position, heading, 40.0)
}

impl Companion {
    pub(crate) fn new(id: u32, epoch: u32, own: UavState) -> Result<Self, Vec<ParamError>> {
        let params = team_params();
        Ok(Self {
            agent: Agent::new(UavId(id), params)?.with_epoch(epoch),
            own,
            autopilot: params.uav.response(PERIOD),
            command: Command { speed_m_s: own.speed_m_s, turn_rate_rad_s: 0.0 },
            look_at: None,
            now: Time::START,
            searches: id == 0,
            refused: 0,
            refused_in_a_row: 0,
            damaged: 0,
            diagnostics: Diagnostics::NONE,
        })
    }

    /// The aircraft flies on to an instant.
    fn fly_on(&mut self, now: Time) {
        let periods = (now - self.now).us() / PERIOD.us();
        // No more than an hour, whatever the clock does.
        for _ in 0..periods.min(7200) {
            self.own = self.autopilot.step(&self.own, self.command);
        }
    }

    /// Your sensor: where it points at this instant, and what it sees there.
    fn look(&self, now: Time) -> (Option<Angle>, Vec<Detection>) {
        let boresight = self.look_at.map(|look| look.boresight(self.own.position, now - self.now));
        let sensor = team_params().track.sensor;
        let seen = vehicles(now).filter_map(|(label, position, _)| {
            Some(Detection { label, measurement: sensor.look(self.own.position, boresight?, position)? })
        });
        (boresight, seen.collect())
    }

    /// First half of an instant: take in the own scan, and compose what to say.
    pub(crate) fn observe(&mut self, now: Time) -> (Observation, Vec<Vec<u8>>) {
        self.fly_on(now);
        let (boresight, detections) = self.look(now);
        self.now = now;
        let scan = Scan { boresight, detections: &detections };
        let observation = self.agent.observe(now, &self.own, Some(scan));
        let mut said: Vec<_> = self.agent.outbox(&observation).iter().map(wire::encode).collect();
        // Who searches hands a vehicle over until the team knows it, to this computer and to all others.
        for vehicle in vehicles(now).filter(|_| self.searches) {
            if self.agent.picture().find_label(vehicle.0).is_none() {
                let cue = cue(now, vehicle);
                self.agent.hear(&observation, &cue);
                said.push(wire::encode(&cue));
            }
        }
        (observation, said)
    }

    /// Takes in what has come, until the next instant is observed.
    pub(crate) fn hear(&mut self, observation: &Observation, bytes: &[u8]) {
        match wire::decode(bytes) {
            Some(message) => self.agent.hear(observation, &message),
            None => self.damaged += 1,
        }
    }

    /// Second half, when no more messages are waited for: decide, and act.
    pub(crate) fn decide(&mut self, observation: &Observation) {
        let step = self.agent.decide(observation);
        // To your gimbal and your autopilot; `step.altitude_m` belongs there, too.
        self.look_at = step.look_at;
        self.command = step.command;
        self.diagnostics = step.diagnostics;
        // One wrong time is a mistake. After a second one the clock was set, or the program stopped for long.
        let refused = step.diagnostics.refused.instants;
        self.refused_in_a_row = if refused > self.refused { self.refused_in_a_row + 1 } else { 0 };
        self.refused = refused;
        if self.refused_in_a_row > 1 {
            self.agent.reset();
        }
    }

    /// Who serves each group: the same on all UAVs, or on its way to be.
    pub(crate) fn crews(&self) -> String {
        let picture = self.agent.picture();
        let crews = picture.groups.iter().map(|group| {
            let crew = picture.crew.iter().filter(|duty| duty.group == group.id).map(|duty| duty.uav.0.to_string());
            crew.collect::<Vec<_>>().join("+")
        });
        crews.collect::<Vec<_>>().join(" ")
    }

    /// What is printed of an instant.
    pub(crate) fn line(&self) -> String {
        let (picture, own, diagnostics) = (self.agent.picture(), &self.own, &self.diagnostics);
        let [x_m, y_m] = [own.position.x_m(), own.position.y_m()];
        let r_m = diagnostics.steering.map_or(0.0, |steering| steering.centre_distance_m);
        let r_d_m = picture.group_of(self.agent.id()).map_or(0.0, |group| group.standoff.distance_m);
        let held = picture.known().iter().filter(|known| known.track.status == TrackStatus::Held).count();
        let mate = diagnostics.separation_m.map_or("none".to_owned(), |apart_m| format!("{apart_m:.0} m"));
        let crews = self.crews();
        // Nobody's words can change it any more: the same on all UAVs.
        let committed = self
            .agent
            .committed()
            .map_or("none".to_owned(), |picture| format!("{:016x} of {:.1} s", picture.digest(), picture.time.s()));
        let (t_s, heading_deg, damaged) = (self.now.s(), own.heading.deg(), self.damaged);
        format!(
            "{t_s:4} s  at {x_m:.0},{y_m:.0},{heading_deg:.0}  {r_m:.0} m from the centre, orbit {r_d_m:.0} m, \
             nearest UAV {mate}, vehicles {held}, crews {crews}; picture {committed}; damaged {damaged}"
        )
    }
}

/// The world: where three vehicles drive, apart from one another.
pub(crate) fn vehicles(now: Time) -> impl Iterator<Item = (TargetLabel, Position, Velocity)> {
    let motions = [([0.0, 0.0], [8.0, 3.0]), ([60.0, 30.0], [9.0, 3.5]), ([-40.0, 50.0], [7.5, 4.0])];
    (0..).zip(motions).map(move |(id, ([x_m, y_m], [vx_m_s, vy_m_s]))| {
        let velocity = Velocity::from_m_s(vx_m_s, vy_m_s);
        (TargetLabel(id), Position::from_m(x_m, y_m) + velocity * now.s(), velocity)
    })
}

pub(crate) fn cue(time: Time, (label, position, velocity): (TargetLabel, Position, Velocity)) -> Message {
    let (searcher, said, number) = (0, time, label.0 as u16);
    Message::Cue(Cue {
        searcher,
        said,
        number,
        label,
        time,
        position,
        velocity,
        position_sd_m: 20.0,
        velocity_sd_m_s: 2.0,
    })
}

fn main() -> ExitCode {
    let fly = |arguments: Arguments| -> Result<(), Vec<String>> {
        let Arguments { uav, epoch, at, .. } = arguments;
        let own = at.unwrap_or_else(|| start(uav, arguments.team));
        let uav = Companion::new(uav, epoch, own)
            .map_err(|wrong| wrong.iter().map(ParamError::to_string).collect::<Vec<_>>())?;
        udp::fly(uav, &arguments).map_err(|error| vec![format!("port {}: {error}", arguments.port_of(arguments.uav))])
    };
    match Arguments::parse(std::env::args().skip(1)).map_err(|wrong| vec![wrong]).and_then(fly) {
        Ok(()) => ExitCode::SUCCESS,
        Err(errors) => {
            errors.iter().for_each(|error| eprintln!("error: {error}"));
            ExitCode::from(2)
        }
    }
}
