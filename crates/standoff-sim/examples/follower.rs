//! A brain of one's own in the simulator: every UAV flies at the vehicle that it saw nearest, and looks there. It tells
//! nobody anything, so what is scored is what its sensors see and how far apart the UAVs stay. `docs/controllers.md` walks
//! through it.
//!
//! ```text
//! cargo run --release -p standoff-sim --example follower -- SCENARIO SEED
//! ```

use std::env;
use std::error::Error;

use standoff::{
    AgentOutput, Command, Displacement, Message, PointingTarget, Position, Scan, Time, UavId, UavState, Velocity,
};
use standoff_sim::controller::Controller;
use standoff_sim::run::{Mission, fly};
use standoff_sim::scenario::{Overrides, Scenario};
use standoff_sim::score::{MetricSelection, Metrics, Scorer};

/// One UAV's whole mind.
#[derive(Clone, Copy)]
struct Uav {
    own: UavState,
    /// Where it saw a vehicle last, or was told that there is one.
    goal: Option<Position>,
}

pub(crate) struct Follower {
    uavs: Vec<Uav>,
}

impl Follower {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        Self { uavs: scenario.uavs.iter().map(|own| Uav { own: *own, goal: None }).collect() }
    }

    fn uav(&mut self, uav: UavId) -> &mut Uav {
        &mut self.uavs[uav.0 as usize]
    }
}

impl Controller for Follower {
    fn observe(&mut self, _now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        let uav = self.uav(uav);
        uav.own = *own;
        let seen = scan.into_iter().flat_map(|scan| scan.detections).map(|detection| detection.measurement);
        if let Some(nearest) = seen.min_by(|a, b| a.range_m.total_cmp(&b.range_m)) {
            uav.goal = Some(own.position + Displacement::from_polar(nearest.range_m, nearest.bearing));
        }
    }

    fn receive(&mut self, uav: UavId, message: &Message) {
        if let Message::Cue(cue) = message {
            self.uav(uav).goal.get_or_insert(cue.position);
        }
    }

    fn decide(&mut self, uav: UavId) -> AgentOutput {
        let Uav { own, goal } = *self.uav(uav);
        let Some(goal) = goal else {
            return AgentOutput::command_only(Command { speed_m_s: own.speed_m_s, turn_rate_rad_s: 0.0 });
        };
        let off_rad = ((goal - own.position).direction() - own.heading).rad();
        let pointing_target = Some(PointingTarget { position: goal, velocity: Velocity::ZERO });
        AgentOutput {
            pointing_target,
            ..AgentOutput::command_only(Command { speed_m_s: 40.0, turn_rate_rad_s: off_rad })
        }
    }
}

/// Flies a scenario with the follower and scores it.
pub(crate) fn follow(scenario: &Scenario) -> Result<Metrics, Box<dyn Error>> {
    let controller = Box::new(Follower::new(scenario));
    let mut mission = Mission::with_brain(scenario, controller).map_err(|errors| errors[0].clone())?;
    let mut scorer = Scorer::new(mission.score_config(), MetricSelection::standard());
    while let Some(frame) = mission.frame() {
        scorer.frame(frame);
    }
    Ok(scorer.metrics())
}

/// What the follower and the product come to in one scenario, on the same draws.
pub(crate) fn compared(name: &str, seed: u64) -> Result<Vec<String>, Box<dyn Error>> {
    let scenario = Scenario::load(name, &Overrides::default(), seed)?;
    let ours = fly(&scenario, MetricSelection::standard()).map_err(|errors| errors[0].clone())?;
    let line = |(controller, metrics): (&str, Metrics)| {
        let percent =
            |share: Option<f64>| share.map_or("not reported".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        let (seen, watched) = (percent(metrics.in_view_fraction), percent(metrics.custody_fraction));
        format!("{controller}: in some UAV's view {seen} of the time, in custody {watched}")
    };
    Ok([("follower", follow(&scenario)?), ("standoff", ours)].map(line).into())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [name, seed] = &arguments[..] else { return Err("usage: follower SCENARIO SEED".into()) };
    compared(name, seed.parse()?)?.iter().for_each(|line| println!("{line}"));
    Ok(())
}
