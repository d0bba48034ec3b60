//! A custom controller: every UAV flies towards the nearest vehicle that it has measured, and points its sensor there.
//! It reports no tracks or groups, so only metrics of views and separation are computed. `docs/user/controllers.md` explains
//! it.
//!
//! ```text
//! cargo run --release -p standoff-sim --example follower -- SCENARIO SEED
//! ```

use std::env;
use std::error::Error;

use standoff::{
    AgentOutput, Command, Displacement, Message, PointingTarget, Position, Scan, Time, UavId, UavState, Velocity,
};
use standoff_score::{MetricSelection, Metrics, Scorer};
use standoff_sim::controller::Controller;
use standoff_sim::run::{Mission, fly};
use standoff_sim::scenario::{Overrides, Scenario};

/// State of one UAV's controller.
#[derive(Clone, Copy)]
struct Uav {
    own: UavState,
    /// Last measured position of a vehicle, or the position of a cue.
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
        let measurements = scan.into_iter().flat_map(|scan| scan.detections).map(|detection| detection.measurement);
        if let Some(nearest) = measurements.min_by(|a, b| a.range_m.total_cmp(&b.range_m)) {
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
    let mut mission = Mission::with_controller(scenario, controller).map_err(|errors| errors[0].clone())?;
    let mut scorer = Scorer::new(mission.score_config(), MetricSelection::standard());
    while let Some(frame) = mission.frame() {
        scorer.frame(frame);
    }
    Ok(scorer.metrics())
}

/// Compares the follower with the built-in team in one scenario, with the same random draws. Returns two lines.
pub(crate) fn compared(name: &str, seed: u64) -> Result<Vec<String>, Box<dyn Error>> {
    let scenario = Scenario::load(name, &Overrides::default(), seed)?;
    let ours = fly(&scenario, MetricSelection::standard()).map_err(|errors| errors[0].clone())?;
    let line = |(controller, metrics): (&str, Metrics)| {
        let percent =
            |share: Option<f64>| share.map_or("not reported".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        let (in_view, in_custody) = (percent(metrics["in_view_fraction"]), percent(metrics["custody_fraction"]));
        format!("{controller}: in some UAV's view {in_view} of the time, in custody {in_custody}")
    };
    Ok([("follower", follow(&scenario)?), ("standoff", ours)].map(line).into())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [name, seed] = &arguments[..] else { return Err("usage: follower SCENARIO SEED".into()) };
    compared(name, seed.parse()?)?.iter().for_each(|line| println!("{line}"));
    Ok(())
}
