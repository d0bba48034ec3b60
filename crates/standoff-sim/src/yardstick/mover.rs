//! The causal mover: discs that go after targets at the speed of a ground vehicle, and know where all are now.

use standoff::{Displacement, Position};

use super::disc::{best_disc, covers};

/// How fast a disc moves at most, m/s.
pub const SPEED_M_S: f64 = 20.0;
/// Time on the way at which what is there counts half, s.
pub const HALF_WORTH_S: f64 = 30.0;

/// Discs on their way.
pub(super) struct Mover {
    pub(super) discs: Vec<Position>,
    goals: Vec<Position>,
    radius_m: f64,
    free: Vec<Position>,
}

impl Mover {
    /// Discs that are set down in turn, each where it covers most of what those before leave, no further than `reach_m`
    /// from its own start; where that is nothing, at its start.
    pub(super) fn new(starts: &[Position], reach_m: f64, radius_m: f64, points: &[Position]) -> Self {
        let mut mover = Self { discs: Vec::new(), goals: Vec::new(), radius_m, free: Vec::new() };
        for start in starts {
            mover.leave_free(points, usize::MAX);
            let within = |distance_m: f64| f64::from(distance_m <= reach_m);
            mover.goals.push(best_disc(&mover.free, radius_m, *start, within).unwrap_or(*start));
        }
        mover.discs.clone_from(&mover.goals);
        mover
    }

    /// Moves every disc towards its goal.
    pub(super) fn go(&mut self, dt_s: f64) {
        for (disc, goal) in self.discs.iter_mut().zip(&self.goals) {
            let (off, distance_m) = (*goal - *disc, disc.distance_m(*goal));
            let part = SPEED_M_S * dt_s / distance_m;
            *disc =
                if part < 1.0 { *disc + Displacement::from_m(part * off.x_m(), part * off.y_m()) } else { *goal };
        }
    }

    /// Gives every disc in turn a new goal: the one worth most of what no other disc covers at its own goal. A disc is
    /// worth what it covers, half as much if it is [`HALF_WORTH_S`] away, a third at twice that.
    pub(super) fn decide(&mut self, points: &[Position]) {
        for index in 0..self.discs.len() {
            self.leave_free(points, index);
            let worth = |distance_m: f64| 1.0 / (1.0 + distance_m / (SPEED_M_S * HALF_WORTH_S));
            let goal = best_disc(&self.free, self.radius_m, self.discs[index], worth);
            self.goals[index] = goal.unwrap_or(self.discs[index]);
        }
    }

    /// The points that no disc but the one of this place covers at its goal.
    fn leave_free(&mut self, points: &[Position], but: usize) {
        let Self { goals, radius_m, free, .. } = self;
        let is_other = |place: usize| place != but;
        let is_taken = |point: &Position| {
            let mut others = goals.iter().enumerate().filter(|(place, _)| is_other(*place));
            others.any(|(_, goal)| covers(*goal, *radius_m, *point))
        };
        free.clear();
        free.extend(points.iter().filter(|point| !is_taken(point)));
    }
}
