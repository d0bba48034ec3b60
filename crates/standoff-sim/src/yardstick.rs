//! A yardstick: how much discs that know where every target is would watch. It is no bound: UAVs may do better.
//!
//! A disc is what an orbit of the largest radius keeps in view: its radius is r_d,max sin((alpha_f - eps_m)/2), (15) the
//! other way round. One disc stands for a group, so that half as many as UAVs are what pairs would watch, and as many as
//! UAVs what UAVs would alone.

mod disc;
mod mover;
mod placed;

use serde::Serialize;
use standoff::{Position, Time};

use crate::scenario::Scenario;
use crate::world::World;
use mover::Mover;
pub use mover::{HALF_WORTH_S, SPEED_M_S};
use placed::{covered, place};

/// Time after which the mover decides anew, us.
const DECISION_US: i64 = 1_000_000;

/// What so many discs would watch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Watched {
    /// How many there are.
    pub discs: usize,
    /// Share of the time of existing targets in a disc, where discs move at [`SPEED_M_S`] at most and are sent anew each
    /// second by where the targets are then; `None` without targets.
    pub mover_fraction: Option<f64>,
    /// The same, where they are placed anew at every instant; not less.
    pub best_fraction: Option<f64>,
}

/// What discs would watch of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Yardstick {
    /// Radius of a disc, m.
    pub disc_radius_m: f64,
    /// Half as many discs as UAVs, rounded up: the number of groups of the paper.
    pub half: Watched,
    /// As many discs as UAVs.
    pub all: Watched,
}

/// The yardstick of a scenario: of its true targets, whatever is flown.
///
/// ```
/// use standoff_sim::scenario::{Edits, Scenario};
/// use standoff_sim::yardstick::yardstick;
///
/// let scenario = Scenario::load("tour/01-one-uav", &Edits::default(), 1)?;
/// let of_one = yardstick(&scenario).all;
/// assert_eq!((of_one.discs, of_one.mover_fraction), (1, Some(1.0)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn yardstick(scenario: &Scenario) -> Yardstick {
    let settings = &scenario.settings;
    let standoff = settings.team.group.standoff;
    let disc_radius_m = standoff.radius_max_m / standoff.radius_per_spread();
    let starts: Vec<Position> = scenario.uavs.iter().map(|uav| uav.position).collect();
    // Who is listed one after the other may be of one crew.
    let every_other: Vec<Position> = starts.iter().step_by(2).copied().collect();
    let mut teams = [every_other, starts].map(|starts| Team::new(starts, standoff.radius_max_m, disc_radius_m));

    let period = settings.period;
    let (mut world, mut truth) = (World::new(scenario), Vec::new());
    let (mut known, mut points) = (Vec::new(), Vec::new());
    for tick in 0..=settings.duration.us() / period.us().max(1) {
        let now = Time::from_us(tick * period.us());
        world.look(now, &mut truth);
        world.step();
        points.clear();
        for target in &truth {
            let id = target.target.0 as usize;
            if id >= known.len() {
                known.resize(id + 1, false);
            }
            // At its first instant a target does not count: it is only being cued.
            if std::mem::replace(&mut known[id], true) {
                points.push(target.state.position());
            }
        }
        let mut placed = Vec::new();
        for team in &mut teams {
            team.instant(now, period.s(), &points, &mut placed);
        }
    }
    let [half, all] = teams.map(|team| team.watched());
    Yardstick { disc_radius_m, half, all }
}

/// So many discs, moved and placed, and what they have covered.
struct Team {
    starts: Vec<Position>,
    reach_m: f64,
    radius_m: f64,
    mover: Option<Mover>,
    decided: Time,
    moved: u64,
    placed: u64,
    of: u64,
}

impl Team {
    fn new(starts: Vec<Position>, reach_m: f64, radius_m: f64) -> Self {
        Self { starts, reach_m, radius_m, mover: None, decided: Time::from_us(0), moved: 0, placed: 0, of: 0 }
    }

    /// Lets an instant pass; `placed` are the best discs of a smaller team, and become those of this one.
    fn instant(&mut self, now: Time, dt_s: f64, points: &[Position], placed: &mut Vec<Position>) {
        if let Some(mover) = &mut self.mover {
            mover.go(dt_s);
            if (now - self.decided).us() >= DECISION_US {
                mover.decide(points);
                self.decided = now;
            }
        } else if !points.is_empty() {
            self.mover = Some(Mover::new(&self.starts, self.reach_m, self.radius_m, points));
            self.decided = now;
        }
        let moved = self.mover.as_ref().map_or(0, |mover| covered(&mover.discs, self.radius_m, points));
        place(placed, self.starts.len(), self.radius_m, points);
        self.moved += moved as u64;
        // Greedy discs are not always the best there are: the mover's own may cover more.
        self.placed += moved.max(covered(placed, self.radius_m, points)) as u64;
        self.of += points.len() as u64;
    }

    fn watched(&self) -> Watched {
        let share = |covered: u64| (self.of > 0).then(|| covered as f64 / self.of as f64);
        Watched { discs: self.starts.len(), mover_fraction: share(self.moved), best_fraction: share(self.placed) }
    }
}
