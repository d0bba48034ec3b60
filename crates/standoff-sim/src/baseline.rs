//! Coverage baseline: the coverage of sensor footprints ("discs") that are placed with perfect knowledge of all
//! targets. It is not an upper bound: UAVs may do better.
//!
//! A disc is the area that an orbit of the largest radius keeps in view: its radius is r_d,max sin((alpha_f -
//! eps_m)/2), the inverse of (15). One disc corresponds to a group. Half as many discs as UAVs are comparable to pairs
//! of UAVs, as many discs as UAVs to single UAVs.

mod causal;
mod coverage;
mod disc_placement;
mod optimal;

use serde::Serialize;
use standoff::{Position, Time};

use crate::scenario::Scenario;
use crate::world::World;
use causal::CausalDiscs;
pub use causal::{HALVING_S, SPEED_M_S};
use coverage::covered;
use optimal::place;

/// Interval at which the moving discs get new goals, us.
const DECISION_US: i64 = 1_000_000;

/// Coverage by a number of discs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CoverageShare {
    /// Number of discs.
    pub discs: usize,
    /// Share of the targets' time that moving discs cover, 0 to 1. The discs move at [`SPEED_M_S`] at most, and get new
    /// goals each second from the current positions of the targets. `None` without targets.
    pub mover_fraction: Option<f64>,
    /// The same share for discs that are placed again in every time step, without transit; it is never smaller.
    pub best_fraction: Option<f64>,
}

/// Coverage baseline of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CoverageBaseline {
    /// Radius of a disc, m.
    pub disc_radius_m: f64,
    /// Coverage by half as many discs as UAVs, rounded up: the number of groups in the paper.
    pub half_of_uavs: CoverageShare,
    /// Coverage by as many discs as UAVs.
    pub all_uavs: CoverageShare,
}

/// Computes the coverage baseline of a scenario. It depends on the true targets only, not on the controller.
///
/// ```
/// use standoff_sim::scenario::{Overrides, Scenario};
/// use standoff_sim::baseline::baseline;
///
/// let scenario = Scenario::load("tour/01-one-uav", &Overrides::default(), 1)?;
/// let one_disc = baseline(&scenario).all_uavs;
/// assert_eq!((one_disc.discs, one_disc.mover_fraction), (1, Some(1.0)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn baseline(scenario: &Scenario) -> CoverageBaseline {
    let settings = &scenario.settings;
    let (standoff, sensor) = (&settings.team.group.standoff, &settings.team.track.sensor);
    let disc_radius_m = standoff.radius_max_m / standoff.radius_per_spread(sensor);
    let uavs = scenario.uavs.len();
    let mut teams = [uavs.div_ceil(2), uavs].map(|discs| Team::new(discs, disc_radius_m));

    let period = settings.period;
    let (mut world, mut truth) = (World::new(scenario), Vec::new());
    let (mut known, mut points) = (Vec::new(), Vec::new());
    for tick in 0..=settings.duration.us() / period.us().max(1) {
        let now = Time::from_us(tick * period.us());
        world.truth(now, &mut truth);
        world.step();
        points.clear();
        for target in &truth {
            let id = target.target.0 as usize;
            if id >= known.len() {
                known.resize(id + 1, false);
            }
            // A target does not count in its first time step, in which it is only cued.
            if std::mem::replace(&mut known[id], true) {
                points.push(target.state.position());
            }
        }
        let mut placed = Vec::new();
        for team in &mut teams {
            team.step(now, period.s(), &points, &mut placed);
        }
    }
    let [half, all] = teams.map(|team| team.share());
    CoverageBaseline { disc_radius_m, half_of_uavs: half, all_uavs: all }
}

/// A number of discs, moving and placed, and their coverage.
struct Team {
    discs: usize,
    radius_m: f64,
    mover: Option<CausalDiscs>,
    decided: Time,
    moved: u64,
    placed: u64,
    of: u64,
}

impl Team {
    fn new(discs: usize, radius_m: f64) -> Self {
        Self { discs, radius_m, mover: None, decided: Time::from_us(0), moved: 0, placed: 0, of: 0 }
    }

    /// Advances one time step: moves and places the discs, counts the covered points, and gives the discs new goals if
    /// it is time. On entry, `placed` holds the discs placed for a smaller team; on return, those of this team.
    fn step(&mut self, now: Time, dt_s: f64, points: &[Position], placed: &mut Vec<Position>) {
        if points.is_empty() && self.mover.is_none() {
            return;
        }
        place(placed, self.discs, self.radius_m, points);
        let mover = self.mover.get_or_insert_with(|| {
            self.decided = now;
            let mut discs = placed.clone();
            // If fewer discs cover all points, the others start at the first one.
            discs.resize(self.discs, placed.first().copied().unwrap_or(Position::ORIGIN));
            CausalDiscs::new(discs, self.radius_m)
        });
        mover.go(dt_s);
        let moved = covered(&mover.discs, self.radius_m, points);
        // Greedy placement is not always the best; the moving discs may cover more.
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

    fn share(&self) -> CoverageShare {
        let share = |covered: u64| (self.of > 0).then(|| covered as f64 / self.of as f64);
        CoverageShare { discs: self.discs, mover_fraction: share(self.moved), best_fraction: share(self.placed) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::load;
    use crate::scenario::Overrides;

    fn of(name: &str, set: &[&str]) -> CoverageBaseline {
        baseline(&load(name, set, 1))
    }

    /// Baseline of one UAV for vehicles given as rows of a CSV file.
    fn of_traffic(rows: impl Iterator<Item = String>) -> CoverageShare {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("vehicles.csv");
        std::fs::write(&file, "t_s,vehicle,x_m,y_m\n".to_owned() + &rows.collect::<String>()).unwrap();
        let overrides = Overrides { traffic: vec![file], uavs: Some(1), ..Overrides::default() };
        baseline(&Scenario::load("traffic/convoy", &overrides, 1).unwrap()).all_uavs
    }

    const CLUSTERS: &str = "targets={ acceleration_sd_m_s2 = 0.0, start = [{ x_m = 0.0 }, { x_m = 30.0 }, { x_m = 60.0 }, \
        { x_m = 2000.0 }, { x_m = 2040.0 }, { x_m = 2080.0 }] }";

    /// The disc radius for Table I is 700 m sin((70 - 10)/2 degrees). Of two clusters of three vehicles, 2 km apart,
    /// one disc covers half of the vehicles, two discs cover all.
    #[test]
    fn one_disc_covers_one_of_two_clusters_and_two_cover_both() {
        let one = CoverageShare { discs: 1, mover_fraction: Some(0.5), best_fraction: Some(0.5) };
        let two = CoverageShare { discs: 2, mover_fraction: Some(1.0), best_fraction: Some(1.0) };
        let pair = of("tour/01-one-uav", &[CLUSTERS, "uavs.count=2"]);
        assert!((pair.disc_radius_m - 350.0).abs() < 1e-9, "{pair:?}");
        assert_eq!((pair.half_of_uavs, pair.all_uavs), (one, two));
        assert_eq!(of("tour/01-one-uav", &[CLUSTERS]).all_uavs, one);
        let three = of("tour/01-one-uav", &[CLUSTERS, "uavs.count=3"]);
        assert_eq!((three.half_of_uavs, three.all_uavs.discs, three.all_uavs.mover_fraction), (two, 3, Some(1.0)));
    }

    /// One vehicle leaves at 20 s; another appears at 100 s, 2 km away, and stays until 300 s. The moving disc uses
    /// it in its second time step and gets a new goal within a second; it covers the vehicle (2000 - 350) / 20 = 82.5 s
    /// later. Placed discs cover it immediately.
    #[test]
    fn moving_discs_lose_time_when_vehicles_come_and_go() {
        let first = (0..=20).map(|t| format!("{t},first,0,0\n"));
        let second = (100..=300).map(|t| format!("{t},second,2000,0\n"));
        let share = of_traffic(first.chain(second));
        assert_eq!(share.best_fraction, Some(1.0));
        let missed_s = (1.0 - share.mover_fraction.unwrap()) * 220.0;
        assert!((82.5..=84.0).contains(&missed_s), "{missed_s}");
    }

    /// More discs cover no less, placed discs cover no less than moving discs, and no share exceeds 1.
    #[test]
    fn coverage_grows_with_discs_and_with_free_placement() {
        let cities =
            ["uavs.count=1", "uavs.count=2", "uavs.count=3", "uavs.count=4"].map(|uavs| ("traffic/city", uavs));
        let others = [
            ("traffic/convoy", "uavs.count=2"),
            ("paper/figure-9", "duration_s=300"),
            ("paper/figure-8", "duration_s=100"),
        ];
        for (name, set) in cities.into_iter().chain(others) {
            let CoverageBaseline { half_of_uavs: half, all_uavs: all, .. } = of(name, &[set]);
            for share in [half, all] {
                let (mover, best) = (share.mover_fraction.unwrap(), share.best_fraction.unwrap());
                assert!(0.0 < mover && mover <= best && best <= 1.0, "{name}, {set}: {share:?}");
            }
            assert!(half.best_fraction <= all.best_fraction, "{name}, {set}");
            assert!(half.mover_fraction <= all.mover_fraction, "{name}, {set}");
        }
    }

    /// Two vehicles that exist for one time step each: that of the cue, which does not count.
    #[test]
    fn coverage_is_none_without_target_time() {
        let share = of_traffic(["0,first,0,0\n", "10,second,0,0\n"].map(str::to_owned).into_iter());
        assert_eq!(share, CoverageShare { discs: 1, mover_fraction: None, best_fraction: None });
    }

    /// A thousand vehicles in one place, and some at the limits of the coordinates.
    #[test]
    fn extreme_targets_still_have_a_coverage() {
        let many = "targets={ random = { count = 1000, x_m = 0.0, y_m = 0.0, vx_m_s = 0.0, vy_m_s = 0.0 } }";
        let CoverageShare { mover_fraction, best_fraction, .. } =
            of("tour/01-one-uav", &[many, "duration_s=5"]).all_uavs;
        assert_eq!((mover_fraction, best_fraction), (Some(1.0), Some(1.0)));
        let far = "targets={ start = [{ x_m = 1e6, y_m = -1e6 }, { x_m = -1e6, y_m = 1e6 }, { x_m = 0.0 }] }";
        let CoverageShare { best_fraction, .. } =
            of("tour/01-one-uav", &[far, "duration_s=5", "orbit.radius_min_m=1"]).all_uavs;
        assert!(best_fraction.is_some_and(|share| (share - 1.0 / 3.0).abs() < 1e-12), "{best_fraction:?}");
    }
}
