//! Causal baseline: discs that move to targets at the speed of a ground vehicle and know where all targets are now.

use standoff::{Displacement, Position};

use super::coverage::Cover;

/// Maximum speed of a disc, m/s: UAVs that circle at the speeds of Table I can follow a centre that moves this fast.
pub const SPEED_M_S: f64 = 20.0;
/// Travel time that halves the value of the points at its end, s.
pub const HALVING_S: f64 = 60.0;

/// Moving discs.
pub(super) struct CausalDiscs {
    pub(super) discs: Vec<Position>,
    /// Goal of each disc. A disc without a goal stays and does not keep other discs from the points that it covers.
    goals: Vec<Option<Position>>,
    radius_m: f64,
}

impl CausalDiscs {
    /// Creates the discs at their start.
    pub(super) fn new(discs: Vec<Position>, radius_m: f64) -> Self {
        Self { goals: vec![None; discs.len()], discs, radius_m }
    }

    /// Moves every disc towards its goal.
    pub(super) fn go(&mut self, dt_s: f64) {
        for (disc, goal) in self.discs.iter_mut().zip(&self.goals) {
            let Some(goal) = goal else { continue };
            let off = *goal - *disc;
            let part = SPEED_M_S * dt_s / off.length_m();
            *disc = if part < 1.0 { *disc + Displacement::from_m(part * off.x_m(), part * off.y_m()) } else { *goal };
        }
    }

    /// Gives every disc in turn a new goal: where it covers the most points that no other disc covers at its goal. Each
    /// point counts less the longer the way, 1 / (1 + travel time / [`HALVING_S`]).
    pub(super) fn decide(&mut self, points: &[Position]) {
        let worth = |way_m: f64| 1.0 / (1.0 + way_m / (SPEED_M_S * HALVING_S));
        let mut cover = Cover::of(self.goals.iter().copied().flatten(), self.radius_m, points);
        for (disc, goal) in self.discs.iter().zip(&mut self.goals) {
            goal.iter().for_each(|goal| cover.remove(*goal));
            *goal = cover.best(*disc, worth);
            goal.iter().for_each(|goal| cover.add(*goal));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::disc_placement::covers;
    use super::*;

    fn at(x_m: f64) -> Position {
        Position::from_m(x_m, 0.0)
    }

    /// 2,000 m at 20 m/s take 100 s. The rim reaches the target after (2000 - 310) / 20 = 84.5 s, so it is covered from
    /// the 85th second on.
    #[test]
    fn a_disc_moves_at_20_m_s() {
        let mut mover = CausalDiscs::new(vec![at(0.0)], 310.0);
        let target = [at(2000.0)];
        let mut covered = Vec::new();
        for _ in 0..110 {
            mover.decide(&target);
            mover.go(1.0);
            covered.push(covers(mover.discs[0], 310.0, target[0]));
        }
        assert_eq!(covered.iter().position(|covered| *covered), Some(84));
        assert_eq!(mover.discs, target);
    }

    /// Two points that are a minute (1,200 m) away are worth one point nearby: 2 / (1 + 60 s / 60 s) = 1.
    #[test]
    fn a_disc_leaves_one_point_for_two_near_points_but_not_for_two_far_points() {
        for (way_m, gone_m) in [(1150.0, 20.0), (1250.0, 0.0)] {
            let mut mover = CausalDiscs::new(vec![at(0.0)], 10.0);
            mover.decide(&[at(0.0), at(way_m), at(way_m)]);
            mover.go(1.0);
            assert!(mover.discs[0].distance_m(at(gone_m)) < 0.1, "{way_m} m: {:?}", mover.discs);
        }
    }

    /// A disc ignores the points at another disc's goal. A disc without a goal stays and does not block the other.
    #[test]
    fn no_two_discs_have_the_same_goal() {
        let mut mover = CausalDiscs::new(vec![at(0.0), at(0.0)], 50.0);
        for target_m in [40.0, 80.0, 120.0] {
            mover.decide(&[at(target_m)]);
            mover.go(10.0);
            assert_eq!(mover.discs, [at(target_m), at(0.0)]);
        }
    }
}
