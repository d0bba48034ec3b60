//! A yardstick: how much discs that know where every target is would watch. It is no bound: UAVs may do better.
//!
//! A disc is what an orbit of the largest radius keeps in view: its radius is r_d,max sin((alpha_f - eps_m)/2), (15) the
//! other way round. One disc stands for a group, so that half as many as UAVs are what pairs would watch, and as many as
//! UAVs what UAVs would alone.

mod cover;
mod disc;
mod mover;
mod placed;

use serde::Serialize;
use standoff::{Position, Time};

use crate::scenario::Scenario;
use crate::world::World;
use cover::covered;
use mover::Mover;
pub use mover::{HALVING_S, SPEED_M_S};
use placed::place;

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
    let uavs = scenario.uavs.len();
    let mut teams = [uavs.div_ceil(2), uavs].map(|discs| Team::new(discs, disc_radius_m));

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
            // At its first instant it does not count: it is only being cued.
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
    discs: usize,
    radius_m: f64,
    mover: Option<Mover>,
    decided: Time,
    moved: u64,
    placed: u64,
    of: u64,
}

impl Team {
    fn new(discs: usize, radius_m: f64) -> Self {
        Self { discs, radius_m, mover: None, decided: Time::from_us(0), moved: 0, placed: 0, of: 0 }
    }

    /// Lets an instant pass: moves and places the discs, counts what they cover, and sends them anew if it is time.
    /// `placed` are the discs placed for a smaller team, and become those of this one.
    fn instant(&mut self, now: Time, dt_s: f64, points: &[Position], placed: &mut Vec<Position>) {
        if points.is_empty() && self.mover.is_none() {
            return;
        }
        place(placed, self.discs, self.radius_m, points);
        let mover = self.mover.get_or_insert_with(|| {
            self.decided = now;
            let mut discs = placed.clone();
            // Where fewer cover all, the others begin beside the first.
            discs.resize(self.discs, placed.first().copied().unwrap_or(Position::ORIGIN));
            Mover::new(discs, self.radius_m)
        });
        mover.go(dt_s);
        let moved = covered(&mover.discs, self.radius_m, points);
        // Greedy discs are not always the best: the mover's own may cover more.
        if moved > covered(placed, self.radius_m, points) {
            placed.clone_from(&mover.discs);
        }
        self.moved += moved as u64;
        self.placed += covered(placed, self.radius_m, points) as u64;
        self.of += points.len() as u64;
        if (now - self.decided).us() >= DECISION_US {
            mover.decide(points);
            self.decided = now;
        }
    }

    fn watched(&self) -> Watched {
        let share = |covered: u64| (self.of > 0).then(|| covered as f64 / self.of as f64);
        Watched { discs: self.discs, mover_fraction: share(self.moved), best_fraction: share(self.placed) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Edits;

    fn of(name: &str, set: &[&str]) -> Yardstick {
        let set = set.iter().map(|value| (*value).to_owned()).collect();
        yardstick(&Scenario::load(name, &Edits { set, ..Edits::default() }, 1).unwrap())
    }

    /// What one UAV alone would watch of vehicles, told by rows of a CSV file.
    fn of_traffic(rows: impl Iterator<Item = String>) -> Watched {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("vehicles.csv");
        std::fs::write(&file, "t_s,vehicle,x_m,y_m\n".to_owned() + &rows.collect::<String>()).unwrap();
        let edits = Edits { traffic: Some(file), uavs: Some(1), ..Edits::default() };
        yardstick(&Scenario::load("traffic/convoy", &edits, 1).unwrap()).all
    }

    const CLUSTERS: &str = "targets={ acceleration_sd_m_s2 = 0.0, at = [{ x_m = 0.0 }, { x_m = 30.0 }, { x_m = 60.0 }, \
        { x_m = 2000.0 }, { x_m = 2040.0 }, { x_m = 2080.0 }] }";

    /// A disc is what Table I's largest orbit keeps in view: 700 m sin((70 - 10)/2 degrees). Of three vehicles and three
    /// others 2 km away one disc holds half, two hold all.
    #[test]
    fn one_disc_holds_one_of_two_clusters_and_two_hold_both() {
        let one = Watched { discs: 1, mover_fraction: Some(0.5), best_fraction: Some(0.5) };
        let two = Watched { discs: 2, mover_fraction: Some(1.0), best_fraction: Some(1.0) };
        let told = of("tour/01-one-uav", &[CLUSTERS, "uavs.count=2"]);
        assert!((told.disc_radius_m - 350.0).abs() < 1e-9, "{told:?}");
        assert_eq!((told.half, told.all), (one, two));
        assert_eq!(of("tour/01-one-uav", &[CLUSTERS]).all, one);
        let told = of("tour/01-one-uav", &[CLUSTERS, "uavs.count=3"]);
        assert_eq!((told.half, told.all.discs, told.all.mover_fraction), (two, 3, Some(1.0)));
    }

    /// One vehicle leaves at 20 s, another comes at 100 s, 2 km away, and stays to 300 s. The mover learns of it at its
    /// second instant and is asked within a second; (2000 - 350) / 20 = 82.5 s later it has it. Best discs have it at once.
    #[test]
    fn a_mover_is_late_where_vehicles_come_and_go() {
        let first = (0..=20).map(|t| format!("{t},first,0,0\n"));
        let second = (100..=300).map(|t| format!("{t},second,2000,0\n"));
        let watched = of_traffic(first.chain(second));
        assert_eq!(watched.best_fraction, Some(1.0));
        let missed_s = (1.0 - watched.mover_fraction.unwrap()) * 220.0;
        assert!((82.5..=84.0).contains(&missed_s), "{missed_s}");
    }

    /// More discs hold no less, discs that are placed anew no less than discs that move, and none more than all.
    #[test]
    fn discs_that_are_placed_anew_hold_no_less_than_the_mover_and_more_no_less_than_few() {
        let cities =
            ["uavs.count=1", "uavs.count=2", "uavs.count=3", "uavs.count=4"].map(|uavs| ("traffic/city", uavs));
        let others = [
            ("traffic/convoy", "uavs.count=2"),
            ("paper/figure-9", "duration_s=300"),
            ("paper/figure-8", "duration_s=100"),
        ];
        for (name, set) in cities.into_iter().chain(others) {
            let Yardstick { half, all, .. } = of(name, &[set]);
            for watched in [half, all] {
                let (mover, best) = (watched.mover_fraction.unwrap(), watched.best_fraction.unwrap());
                assert!(0.0 < mover && mover <= best && best <= 1.0, "{name}, {set}: {watched:?}");
            }
            assert!(half.best_fraction <= all.best_fraction, "{name}, {set}");
            assert!(half.mover_fraction <= all.mover_fraction, "{name}, {set}");
        }
    }

    /// Two vehicles of one instant each, that of the cue, at which no target counts.
    #[test]
    fn without_time_of_targets_there_is_no_share() {
        let watched = of_traffic(["0,first,0,0\n", "10,second,0,0\n"].map(str::to_owned).into_iter());
        assert_eq!(watched, Watched { discs: 1, mover_fraction: None, best_fraction: None });
    }

    /// A thousand vehicles in one place, and some at the ends of what may be typed.
    #[test]
    fn hostile_targets_have_a_share_all_the_same() {
        let many = "targets={ scatter = { count = 1000, x_m = 0.0, y_m = 0.0, vx_m_s = 0.0, vy_m_s = 0.0 } }";
        let Watched { mover_fraction, best_fraction, .. } = of("tour/01-one-uav", &[many, "duration_s=5"]).all;
        assert_eq!((mover_fraction, best_fraction), (Some(1.0), Some(1.0)));
        let far = "targets={ at = [{ x_m = 1e6, y_m = -1e6 }, { x_m = -1e6, y_m = 1e6 }, { x_m = 0.0 }] }";
        let Watched { best_fraction, .. } = of("tour/01-one-uav", &[far, "duration_s=5", "orbit.radius_min_m=1"]).all;
        assert!(best_fraction.is_some_and(|share| (share - 1.0 / 3.0).abs() < 1e-12), "{best_fraction:?}");
    }
}
