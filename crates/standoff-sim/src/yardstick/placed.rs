//! Best discs without transit: placed anew at every instant.

use standoff::Position;

use super::disc::{best_disc, covers};

/// Rounds in which every disc is placed once more.
const ROUNDS_MAX: usize = 4;

/// How many points some disc covers.
pub(super) fn covered(discs: &[Position], radius_m: f64, points: &[Position]) -> usize {
    points.iter().filter(|point| discs.iter().any(|disc| covers(*disc, radius_m, **point))).count()
}

/// Adds discs up to `count`, each where it covers most of what is left. Then each is placed once more about what the
/// others leave, as long as that covers more. Fewer remain where fewer cover all.
pub(super) fn place(discs: &mut Vec<Position>, count: usize, radius_m: f64, points: &[Position]) {
    let mut cover = Cover { radius_m, points, times: vec![0; points.len()], free: Vec::new() };
    discs.iter().for_each(|disc| cover.add(*disc));
    while discs.len() < count {
        let Some(disc) = cover.best() else { return };
        cover.add(disc);
        discs.push(disc);
    }
    for _ in 0..ROUNDS_MAX {
        let before = cover.covered();
        for disc in discs.iter_mut() {
            let most = cover.covered();
            if most == points.len() {
                return;
            }
            cover.remove(*disc);
            let other = cover.best().unwrap_or(*disc);
            cover.add(other);
            if cover.covered() > most {
                *disc = other;
            } else {
                cover.remove(other);
                cover.add(*disc);
            }
        }
        if cover.covered() == before {
            return;
        }
    }
}

/// By how many discs each point is covered.
struct Cover<'a> {
    radius_m: f64,
    points: &'a [Position],
    times: Vec<u32>,
    /// Room that lives on.
    free: Vec<Position>,
}

impl Cover<'_> {
    fn add(&mut self, disc: Position) {
        self.of(disc, |times| times + 1);
    }

    fn remove(&mut self, disc: Position) {
        self.of(disc, |times| times - 1);
    }

    fn of(&mut self, disc: Position, change: impl Fn(u32) -> u32) {
        for (times, _) in self.times.iter_mut().zip(self.points).filter(|(_, at)| covers(disc, self.radius_m, **at)) {
            *times = change(*times);
        }
    }

    fn covered(&self) -> usize {
        self.times.iter().filter(|times| **times > 0).count()
    }

    /// Where a disc covers most of what none does.
    fn best(&mut self) -> Option<Position> {
        self.free.clear();
        self.free.extend(self.times.iter().zip(self.points).filter(|(times, _)| **times == 0).map(|(_, at)| *at));
        best_disc(&self.free, self.radius_m, Position::ORIGIN, |_| 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a line, discs of 100 m. The first takes the seven from 192 to 380 m, the second what is left of most, the three
    /// from 395 m on, and reaches back to 360 m: so the first is better placed about the six from 10 to 192 m, and all
    /// twelve are covered, not ten.
    #[test]
    fn discs_that_were_placed_greedily_are_placed_once_more() {
        let line_m = [10.0, 10.0, 192.0, 192.0, 192.0, 192.0, 360.0, 360.0, 380.0, 395.0, 450.0, 500.0];
        let points = line_m.map(|x_m| Position::from_m(x_m, 0.0));
        let mut discs = Vec::new();
        place(&mut discs, 1, 100.0, &points);
        assert_eq!((discs.len(), covered(&discs, 100.0, &points)), (1, 7));
        place(&mut discs, 2, 100.0, &points);
        assert_eq!((discs.len(), covered(&discs, 100.0, &points)), (2, 12));
        place(&mut discs, 9, 100.0, &points);
        assert_eq!(discs.len(), 2, "two cover all");
    }
}
