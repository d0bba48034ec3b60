//! Sets of targets that one orbit might contain.

use crate::frame::Position;
use crate::grid::Grid;

/// Targets with the total priority of the targets near each of them.
pub(super) struct Neighbourhoods {
    reach_m: f64,
    /// Indices of the targets, ascending.
    track_indices: Vec<usize>,
    positions: Vec<Position>,
    /// Priorities of the remaining targets; 0 for a target that was removed.
    priorities: Vec<f64>,
    grid: Grid,
    /// Sum of the priorities within reach of each target, its own included.
    sums: Vec<f64>,
}

impl Neighbourhoods {
    /// Sums the priorities of the neighbours of these targets within `reach_m`.
    pub(super) fn new(track_indices: Vec<usize>, positions: Vec<Position>, priorities: Vec<f64>, reach_m: f64) -> Self {
        let grid = Grid::of(positions.iter().copied(), 0.5 * reach_m);
        let mut neighbourhoods = Self { reach_m, track_indices, positions, priorities, grid, sums: Vec::new() };
        let all = 0..neighbourhoods.positions.len();
        neighbourhoods.sums = all.map(|index| neighbourhoods.sum(index)).collect();
        neighbourhoods
    }

    fn sum(&self, index: usize) -> f64 {
        self.near(index).map(|other| self.priorities[other]).sum()
    }

    /// Positions within reach of a target, its own included, in no particular order.
    fn near(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let centre = self.positions[index];
        let is_near =
            move |other: &usize| self.positions[*other].squared_distance_m2(centre) <= self.reach_m * self.reach_m;
        self.grid.near(centre, self.reach_m).filter(is_near)
    }

    /// Indices of the targets within reach of the one with the highest sum, of ties the first; ascending.
    pub(super) fn largest(&self) -> Vec<usize> {
        let mut best = None;
        for (index, sum) in self.sums.iter().enumerate().filter(|(index, _)| self.priorities[*index] > 0.0) {
            if best.is_none_or(|(_, highest)| *sum > highest) {
                best = Some((index, *sum));
            }
        }
        let Some((centre, _)) = best else { return Vec::new() };
        let near = self.near(centre).filter(|index| self.priorities[*index] > 0.0);
        let mut largest: Vec<usize> = near.map(|index| self.track_indices[index]).collect();
        largest.sort_unstable();
        largest
    }

    /// Removes a target.
    pub(super) fn remove(&mut self, track_index: usize) {
        let Ok(index) = self.track_indices.binary_search(&track_index) else { return };
        if core::mem::take(&mut self.priorities[index]) > 0.0 {
            // Differences of sums would accumulate rounding errors.
            let near: Vec<usize> = self.near(index).collect();
            near.into_iter().for_each(|other| self.sums[other] = self.sum(other));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordination::clustering::Draw;

    /// Whatever is removed, the largest set is that of new neighbourhoods of the remaining targets.
    #[test]
    fn removal_equals_new_neighbourhoods() {
        let mut draw = Draw(5);
        let mut positions = Vec::new();
        for _ in 0..150 {
            let [x_m, y_m] = [0; 2].map(|_| draw.below(2000) as f64);
            positions.push(Position::from_m(x_m, y_m));
        }
        let mut left: Vec<usize> = (0..150).collect();
        let new = |left: &[usize]| {
            let at = |index: &usize| positions[*index];
            let priorities = left.iter().map(|index| if index % 7 == 0 { 3.0 } else { 1.0 }).collect();
            Neighbourhoods::new(left.to_vec(), left.iter().map(at).collect(), priorities, 300.0)
        };
        let mut neighbourhoods = new(&left);
        while !left.is_empty() {
            let largest = neighbourhoods.largest();
            assert_eq!(largest, new(&left).largest());
            let removed = if draw.below(2) == 0 { largest } else { vec![left[draw.below(left.len())]] };
            removed.iter().for_each(|track_index| neighbourhoods.remove(*track_index));
            left.retain(|track_index| !removed.contains(track_index));
        }
        assert!(neighbourhoods.largest().is_empty());
    }
}
