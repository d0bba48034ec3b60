//! Sets of targets that one orbit might contain.

use crate::frame::Position;
use crate::grid::Grid;

/// Targets with the number of targets near each of them.
pub(super) struct Neighbourhoods {
    reach_m: f64,
    /// Indices of the targets, ascending.
    track_indices: Vec<usize>,
    positions: Vec<Position>,
    grid: Grid,
    /// Number of remaining targets within reach of each target, itself included; 0 for a target that was removed.
    counts: Vec<usize>,
}

impl Neighbourhoods {
    /// Counts the neighbours of these targets within `reach_m`.
    pub(super) fn new(track_indices: Vec<usize>, positions: Vec<Position>, reach_m: f64) -> Self {
        let grid = Grid::of(positions.iter().copied(), 0.5 * reach_m);
        let mut neighbourhoods = Self { reach_m, track_indices, positions, grid, counts: Vec::new() };
        let all = 0..neighbourhoods.positions.len();
        neighbourhoods.counts = all.map(|index| neighbourhoods.near(index).count()).collect();
        neighbourhoods
    }

    /// Positions within reach of a target, its own included, in no particular order.
    fn near(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let centre = self.positions[index];
        let is_near =
            move |other: &usize| self.positions[*other].squared_distance_m2(centre) <= self.reach_m * self.reach_m;
        self.grid.near(centre, self.reach_m).filter(is_near)
    }

    /// Indices of the targets within reach of the one that has most of them, of ties the first; ascending.
    pub(super) fn largest(&self) -> Vec<usize> {
        let mut best = None;
        for (index, count) in self.counts.iter().enumerate() {
            if *count > best.map_or(0, |(_, most)| most) {
                best = Some((index, *count));
            }
        }
        let Some((centre, _)) = best else { return Vec::new() };
        let near = self.near(centre).filter(|index| self.counts[*index] > 0);
        let mut largest: Vec<usize> = near.map(|index| self.track_indices[index]).collect();
        largest.sort_unstable();
        largest
    }

    /// Removes a target.
    pub(super) fn remove(&mut self, track_index: usize) {
        let Ok(index) = self.track_indices.binary_search(&track_index) else { return };
        if core::mem::take(&mut self.counts[index]) > 0 {
            let near: Vec<usize> = self.near(index).collect();
            near.into_iter().for_each(|other| self.counts[other] = self.counts[other].saturating_sub(1));
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
            Neighbourhoods::new(left.to_vec(), left.iter().map(|index| positions[*index]).collect(), 300.0)
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
