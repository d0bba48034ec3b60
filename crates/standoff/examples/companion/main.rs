//! The agent on a companion computer, with the library alone: two UAVs, each with an agent of its own, keep three
//! vehicles in view and talk over a radio that loses messages. `docs/embedding.md` walks through it.
//!
//! ```text
//! cargo run -p standoff --example companion -- SECONDS LOSE_EVERY
//! ```

pub(crate) mod wire;

use std::env;
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, Sender, channel};

use standoff::*;

/// All UAVs scan, and decide, at the same instants, so far apart.
const PERIOD: Duration = Duration::from_us(500_000);

/// One UAV: its agent, and stand-ins for what your aircraft has.
pub(crate) struct Companion {
    agent: Agent,
    /// Your navigation filter's answer; here a model of the autopilot keeps it.
    pub(crate) own: UavState,
    autopilot: Response,
    /// Where your gimbal points.
    look_at: Option<LookAt>,
    /// Your radio.
    to_teammate: Sender<Vec<u8>>,
    from_teammate: Receiver<Vec<u8>>,
    sent: u32,
}

impl Companion {
    fn new(id: u32, x_m: f64, radio: (Sender<Vec<u8>>, Receiver<Vec<u8>>)) -> Result<Self, Vec<ParamError>> {
        // The same on every aircraft of a team: pictures made with other parameters are other pictures.
        let params = TeamParams::table_1();
        let (position, heading) = (Position::from_m(x_m, -600.0), Angle::from_deg(90.0));
        Ok(Self {
            agent: Agent::new(UavId(id), params)?,
            own: UavState { position, heading, speed_m_s: 40.0, turn_rate_rad_s: 0.0 },
            autopilot: params.uav.response(PERIOD),
            look_at: None,
            to_teammate: radio.0,
            from_teammate: radio.1,
            sent: 0,
        })
    }

    /// Your sensor: where it points at this instant, and what it sees there.
    fn look(&self, now: Time) -> (Option<Angle>, Vec<Detection>) {
        let boresight = self.look_at.map(|look| look.boresight(self.own.position, PERIOD));
        let sensor = TeamParams::table_1().track.sensor;
        let seen = vehicles(now).filter_map(|(label, position, _)| {
            Some(Detection { label, measurement: sensor.look(self.own.position, boresight?, position)? })
        });
        (boresight, seen.collect())
    }

    /// First half of an instant: take in the own scan, and say what it was.
    fn observe(&mut self, now: Time, lose_every: u32) -> Observation {
        let (boresight, detections) = self.look(now);
        let scan = Scan { boresight, detections: &detections };
        let observation = self.agent.observe(now, &self.own, Some(scan));
        for message in self.agent.outbox(&observation) {
            self.sent += 1;
            let is_lost = lose_every > 0 && self.sent.is_multiple_of(lose_every);
            if !is_lost {
                // Whether anybody hears it, the agent need not know.
                let _ = self.to_teammate.send(wire::encode(message));
            }
        }
        observation
    }

    /// Second half, when no more messages are waited for: take in what has come, decide, and act.
    fn decide(&mut self, observation: &Observation, cues: &[Message]) -> Diagnostics {
        let heard = self.from_teammate.try_iter().filter_map(|bytes| wire::decode(&bytes));
        for message in cues.iter().cloned().chain(heard) {
            self.agent.hear(observation, &message);
        }
        let step = self.agent.decide(observation);
        // To your gimbal and your autopilot; `step.altitude_m` belongs there, too.
        self.look_at = step.look_at;
        self.own = self.autopilot.step(&self.own, step.command);
        step.diagnostics
    }
}

/// Flies two UAVs, each of whose radios loses every so many-th message (0: none); `tell` hears of the first once a second.
pub(crate) fn fly(
    seconds: u32,
    lose_every: u32,
    mut tell: impl FnMut(Time, &Diagnostics, &Picture),
) -> Result<[Companion; 2], Vec<ParamError>> {
    let ((to_first, at_first), (to_second, at_second)) = (channel(), channel());
    let first = Companion::new(0, -300.0, (to_second, at_first))?;
    let second = Companion::new(1, 300.0, (to_first, at_second))?;
    let mut team = [first, second];
    for tick in 0..=2 * i64::from(seconds) {
        let now = Time::from_us(tick * PERIOD.us());
        // Somebody who searches hands the vehicles over, again and again: a cue of what is known changes nothing.
        let cues: Vec<Message> = vehicles(now).map(|vehicle| cue(now, vehicle)).collect();
        let observed = team.each_mut().map(|uav| uav.observe(now, lose_every));
        let [diagnostics, _] = [0, 1].map(|index: usize| team[index].decide(&observed[index], &cues));
        if tick % 2 == 0 {
            tell(now, &diagnostics, team[0].agent.picture());
        }
    }
    Ok(team)
}

/// The world: where three vehicles drive, apart from one another.
pub(crate) fn vehicles(now: Time) -> impl Iterator<Item = (TargetLabel, Position, Velocity)> {
    let motions = [([0.0, 0.0], [8.0, 3.0]), ([60.0, 30.0], [9.0, 3.5]), ([-40.0, 50.0], [7.5, 4.0])];
    (0..).zip(motions).map(move |(id, ([x_m, y_m], [vx_m_s, vy_m_s]))| {
        let velocity = Velocity::from_m_s(vx_m_s, vy_m_s);
        (TargetLabel(id), Position::from_m(x_m, y_m) + velocity * now.s(), velocity)
    })
}

fn cue(time: Time, (label, position, velocity): (TargetLabel, Position, Velocity)) -> Message {
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

/// What is printed of an instant.
pub(crate) fn line(now: Time, diagnostics: &Diagnostics, picture: &Picture) -> String {
    let r_m = diagnostics.steering.map_or(0.0, |steering| steering.centre_distance_m);
    let r_d_m = picture.group_of(UavId(0)).map_or(0.0, |group| group.standoff.distance_m);
    let held = picture.known().iter().filter(|known| known.track.status == TrackStatus::Held).count();
    let teammate = diagnostics.separation_m.map_or("unheard".to_owned(), |apart_m| format!("{apart_m:.0} m away"));
    let t_s = now.s();
    format!("{t_s:4} s  {r_m:.0} m from the centre, orbit {r_d_m:.0} m, {held} vehicles measured, teammate {teammate}")
}

fn main() -> ExitCode {
    let numbers: Option<Vec<u32>> = env::args().skip(1).map(|argument| argument.parse().ok()).collect();
    let Some([seconds, lose_every]) = numbers.as_deref() else {
        eprintln!("usage: companion SECONDS LOSE_EVERY; 60 5 flies a minute and loses every fifth message, 60 0 none");
        return ExitCode::from(2);
    };
    let told = |now, diagnostics: &Diagnostics, picture: &Picture| println!("{}", line(now, diagnostics, picture));
    match fly(*seconds, *lose_every, told) {
        Ok(_) => ExitCode::SUCCESS,
        Err(errors) => {
            errors.iter().for_each(|error| eprintln!("error: {error}"));
            ExitCode::from(2)
        }
    }
}
