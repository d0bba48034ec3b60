//! Joint coverage of several discs.

use standoff::Position;

use super::disc_placement::{best_disc, covers};

/// Returns the number of points that at least one disc covers.
pub(super) fn covered(discs: &[Position], radius_m: f64, points: &[Position]) -> usize {
    points.iter().filter(|point| discs.iter().any(|disc| covers(*disc, radius_m, **point))).count()
}

/// Number of discs that cover each point.
pub(super) struct Cover<'a> {
    radius_m: f64,
    points: &'a [Position],
    times: Vec<u32>,
    /// Reused buffer.
    free: Vec<Position>,
}

impl<'a> Cover<'a> {
    pub(super) fn of(discs: impl Iterator<Item = Position>, radius_m: f64, points: &'a [Position]) -> Self {
        let mut cover = Self { radius_m, points, times: vec![0; points.len()], free: Vec::new() };
        discs.for_each(|disc| cover.add(disc));
        cover
    }

    pub(super) fn add(&mut self, disc: Position) {
        self.change(disc, |times| times + 1);
    }

    pub(super) fn remove(&mut self, disc: Position) {
        self.change(disc, |times| times - 1);
    }

    fn change(&mut self, disc: Position, change: impl Fn(u32) -> u32) {
        for (times, _) in self.times.iter_mut().zip(self.points).filter(|(_, at)| covers(disc, self.radius_m, **at)) {
            *times = change(*times);
        }
    }

    pub(super) fn covered(&self) -> usize {
        self.times.iter().filter(|times| **times > 0).count()
    }

    /// Returns the best centre of a disc for the points that no disc covers, as [`best_disc`] does.
    pub(super) fn best(&mut self, from: Position, worth: impl Fn(f64) -> f64) -> Option<Position> {
        self.free.clear();
        self.free.extend(self.times.iter().zip(self.points).filter(|(times, _)| **times == 0).map(|(_, at)| *at));
        best_disc(&self.free, self.radius_m, from, worth)
    }
}
