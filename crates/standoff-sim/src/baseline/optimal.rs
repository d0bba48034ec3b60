//! Placement baseline: discs without transit, placed again in every time step.

use standoff::Position;

use super::coverage::Cover;

/// Maximum number of rounds in which every disc is placed again.
const ROUNDS_MAX: usize = 4;

/// Adds discs up to `count`, each where it covers the most of the remaining points. Then places each disc again for the
/// points that the others leave, as long as that increases the coverage. Fewer discs are added if these cover all
/// points.
pub(super) fn place(discs: &mut Vec<Position>, count: usize, radius_m: f64, points: &[Position]) {
    let mut cover = Cover::of(discs.iter().copied(), radius_m, points);
    let best = |cover: &mut Cover| cover.best(Position::ORIGIN, |_| 1.0);
    while discs.len() < count {
        let Some(disc) = best(&mut cover) else { return };
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
            let other = best(&mut cover).unwrap_or(*disc);
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

#[cfg(test)]
mod tests {
    use super::super::coverage::covered;
    use super::*;

    /// Points on a line, discs of 100 m. The first disc covers the seven points from 192 to 380 m. The second covers
    /// the most of the rest, the three from 395 m on, and reaches back to 360 m. The first is then better placed over
    /// the six points from 10 to 192 m, so that all twelve points are covered instead of ten.
    #[test]
    fn greedily_placed_discs_are_placed_again() {
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
