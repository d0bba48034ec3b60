//! Best discs without transit: placed anew at every instant.

use standoff::Position;

use super::disc::{best_disc, covers};

/// Rounds in which every disc is placed once more.
const ROUNDS_MAX: usize = 4;

/// Which discs cover how many points, in room that lives on.
#[derive(Default)]
struct Cover {
    /// By how many discs each point is covered.
    times: Vec<u32>,
    free: Vec<Position>,
}

impl Cover {
    fn of(&mut self, discs: &[Position], radius_m: f64, points: &[Position]) -> &mut Self {
        self.times.clear();
        let times = |point: &Position| discs.iter().filter(|disc| covers(**disc, radius_m, *point)).count() as u32;
        self.times.extend(points.iter().map(times));
        self
    }

    fn change(&mut self, disc: Position, radius_m: f64, points: &[Position], comes: bool) -> &mut Self {
        for (times, _) in self.times.iter_mut().zip(points).filter(|(_, point)| covers(disc, radius_m, **point)) {
            *times = if comes { *times + 1 } else { times.saturating_sub(1) };
        }
        self
    }

    fn covered(&self) -> usize {
        self.times.iter().filter(|times| **times > 0).count()
    }

    /// Where a disc covers most of what no other does.
    fn best(&mut self, radius_m: f64, points: &[Position]) -> Option<Position> {
        self.free.clear();
        self.free.extend(self.times.iter().zip(points).filter(|(times, _)| **times == 0).map(|(_, point)| *point));
        best_disc(&self.free, radius_m, Position::ORIGIN, |_| 1.0)
    }
}

/// How many points some disc covers.
pub(super) fn covered(discs: &[Position], radius_m: f64, points: &[Position]) -> usize {
    points.iter().filter(|point| discs.iter().any(|disc| covers(*disc, radius_m, **point))).count()
}

/// Adds discs up to `count`, each where it covers most of what is left, and then places each of them once more about what
/// the others leave, as long as that covers more.
pub(super) fn place(discs: &mut Vec<Position>, count: usize, radius_m: f64, points: &[Position]) {
    let mut cover = Cover::default();
    cover.of(discs, radius_m, points);
    while discs.len() < count {
        let Some(disc) = cover.best(radius_m, points) else { return };
        cover.change(disc, radius_m, points, true);
        discs.push(disc);
    }
    for _ in 0..ROUNDS_MAX {
        let before = cover.covered();
        for disc in discs.iter_mut() {
            let with = cover.covered();
            if with == points.len() {
                return;
            }
            cover.change(*disc, radius_m, points, false);
            let other = cover.best(radius_m, points).unwrap_or(*disc);
            let moved = cover.change(other, radius_m, points, true).covered();
            if moved > with {
                *disc = other;
            } else {
                cover.change(other, radius_m, points, false).change(*disc, radius_m, points, true);
            }
        }
        if cover.covered() == before {
            return;
        }
    }
}
