//! The best place of one disc among points: branch and bound over squares of centres.

use standoff::{Displacement, Position};

/// Centres are told apart to this share of the radius.
const FINENESS: f64 = 1.0 / 64.0;
/// A search ends after so many squares. Over the hundreds of vehicles of a town quarter it takes 400; it is without an end
/// where numbers are too coarse for the radius.
const SQUARES_MAX: u32 = 50_000;
/// So often a disc is moved towards the furthest point that it covers, each time by less.
const CENTRINGS: u32 = 40;
/// Half the diagonal of a square over half its side.
const DIAGONAL: f64 = std::f64::consts::SQRT_2;

/// Whether a disc covers a point. What is no place is covered by none.
pub(super) fn covers(centre: Position, radius_m: f64, point: Position) -> bool {
    centre.squared_distance_m2(point) <= radius_m * radius_m
}

/// The centre of the disc that is worth most: the number of points that it covers, times what `worth` says of a centre so
/// far from `from`, which must not rise with the distance. Then the same points are put into its middle. `None` where it
/// would be worth nothing.
///
/// The search goes through the box about the points. To a 64th of the radius no other centre in it is worth more: a square
/// of centres is passed over only if all that any of them could cover, at the distance of the nearest, is worth no more
/// than what was found.
pub(super) fn best_disc(
    points: &[Position],
    radius_m: f64,
    from: Position,
    worth: impl Fn(f64) -> f64,
) -> Option<Position> {
    let mut open: Vec<Position> = points.iter().copied().filter(|point| point.is_finite()).collect();
    let (first, rest) = open.split_first()?;
    let (low, high) = rest.iter().fold((*first, *first), |(low, high), point| {
        let (x_m, y_m) = (point.x_m(), point.y_m());
        let low = Position::from_m(low.x_m().min(x_m), low.y_m().min(y_m));
        (low, Position::from_m(high.x_m().max(x_m), high.y_m().max(y_m)))
    });
    let (width_m, height_m) = (high.x_m() - low.x_m(), high.y_m() - low.y_m());
    let square = Square {
        centre: low + Displacement::from_m(0.5 * width_m, 0.5 * height_m),
        half_m: 0.5 * width_m.max(height_m),
        sure: 0,
        open: 0..open.len(),
    };
    let mut search = Search { radius_m, from, worth, squares: 0, most: 0.0, best: *first };
    search.most = (search.worth)(first.distance_m(from));
    search.within(&square, &mut open);
    (search.most > 0.0).then(|| centred(search.best, radius_m, points))
}

/// Centres, and the points that a disc about one of them may cover.
struct Square {
    centre: Position,
    half_m: f64,
    /// So many are covered from all of them.
    sure: usize,
    /// These from some, as places in a list.
    open: std::ops::Range<usize>,
}

struct Search<F> {
    radius_m: f64,
    from: Position,
    worth: F,
    /// So many were looked at.
    squares: u32,
    most: f64,
    best: Position,
}

impl<F: Fn(f64) -> f64> Search<F> {
    /// Looks for a better disc in a square; `open` is as long afterwards as before.
    fn within(&mut self, square: &Square, open: &mut Vec<Position>) {
        let Square { centre, half_m, sure, .. } = *square;
        let covered = open[square.open.clone()].iter().filter(|point| covers(centre, self.radius_m, **point)).count();
        let worth = (sure + covered) as f64 * (self.worth)(centre.distance_m(self.from));
        if worth > self.most {
            (self.most, self.best) = (worth, centre);
        }
        self.squares += 1;
        if self.squares > SQUARES_MAX || half_m <= FINENESS * self.radius_m {
            return;
        }
        let (length, half_m) = (open.len(), 0.5 * half_m);
        let mut quarters = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(east, north)| {
            let quarter = self.quarter(square, Displacement::from_m(east * half_m, north * half_m), open);
            (self.most_of(&quarter), quarter)
        });
        quarters.sort_by(|(one, _), (other, _)| other.total_cmp(one));
        for (most, quarter) in quarters {
            if most > self.most {
                self.within(&quarter, open);
            }
        }
        open.truncate(length);
    }

    /// A quarter of a square; what it leaves open is put behind what is in the list.
    fn quarter(&self, square: &Square, off: Displacement, open: &mut Vec<Position>) -> Square {
        let (centre, half_m) = (square.centre + off, 0.5 * square.half_m);
        let (near_m, far_m) = (self.radius_m - DIAGONAL * half_m, self.radius_m + DIAGONAL * half_m);
        let (mut sure, begin) = (square.sure, open.len());
        for index in square.open.clone() {
            let point = open[index];
            if near_m >= 0.0 && covers(centre, near_m, point) {
                sure += 1;
            } else if covers(centre, far_m, point) {
                open.push(point);
            }
        }
        Square { centre, half_m, sure, open: begin..open.len() }
    }

    /// What no disc about a centre in a square is worth more than.
    fn most_of(&self, square: &Square) -> f64 {
        let nearest_m = (square.centre.distance_m(self.from) - DIAGONAL * square.half_m).max(0.0);
        (square.sure + square.open.len()) as f64 * (self.worth)(nearest_m)
    }
}

/// Where a disc covers the same points and has them nearer to its middle: on the rim they would be lost at once.
fn centred(best: Position, radius_m: f64, points: &[Position]) -> Position {
    let held: Vec<Position> = points.iter().copied().filter(|point| covers(best, radius_m, *point)).collect();
    // Badoiu and Clarkson (2003): towards the furthest, by a part that falls, comes to the smallest enclosing circle.
    let mut centre = best;
    for number in 0..CENTRINGS {
        let furthest =
            held.iter().max_by(|a, b| centre.squared_distance_m2(**a).total_cmp(&centre.squared_distance_m2(**b)));
        let Some(furthest) = furthest else { return best };
        let off = *furthest - centre;
        let part = 1.0 / f64::from(number + 2);
        centre = centre + Displacement::from_m(part * off.x_m(), part * off.y_m());
    }
    if held.iter().all(|point| covers(centre, radius_m, *point)) { centre } else { best }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::{Draws, Stream};

    /// The most that any disc covers: one that does can be moved until two points, or one, are on its rim.
    fn most(points: &[Position], radius_m: f64) -> usize {
        let rims = points.iter().flat_map(|a| points.iter().map(move |b| (*a, *b))).filter_map(|(a, b)| {
            let (off, half_m) = (b - a, 0.5 * a.distance_m(b));
            let aside = (radius_m * radius_m - half_m * half_m).sqrt() / (2.0 * half_m).max(1e-9);
            let centre = Displacement::from_m(0.5 * off.x_m() - aside * off.y_m(), 0.5 * off.y_m() + aside * off.x_m());
            (half_m <= radius_m).then(|| a + centre)
        });
        // What is on the rim counts, whatever the rounding.
        let count = |centre: Position| points.iter().filter(|point| covers(centre, radius_m + 1e-6, **point)).count();
        rims.map(count).max().unwrap_or(0).max(1)
    }

    /// No disc covers more than the best, and one that is smaller by half the diagonal of the finest square covers no more
    /// than what is found.
    #[test]
    fn the_best_disc_covers_as_many_as_any() {
        for draw in 0..60 {
            let count = 1 + draw as usize % 40;
            let place = |index: usize| {
                let [x, y]: [f64; 2] = Draws::new(draw).at(Stream::TargetMotion, index as u64, 0).normals();
                Position::from_m(500.0 * x, 300.0 * y - 7000.0)
            };
            let points: Vec<Position> = (0..count).map(place).collect();
            let best = best_disc(&points, 300.0, Position::ORIGIN, |_| 1.0).unwrap();
            let found = points.iter().filter(|point| covers(best, 300.0, **point)).count();
            let smaller_m = 300.0 * (1.0 - DIAGONAL * FINENESS);
            assert!(found <= most(&points, 300.0) && found >= most(&points, smaller_m), "draw {draw}: {found}");
        }
    }

    /// Of two points 150 m apart a disc of 100 m is set down between, not so that one is on its rim.
    #[test]
    fn what_a_disc_covers_is_in_its_middle() {
        let points = [Position::from_m(0.0, 40.0), Position::from_m(150.0, 40.0)];
        let best = best_disc(&points, 100.0, Position::ORIGIN, |_| 1.0).unwrap();
        assert!(best.distance_m(Position::from_m(75.0, 40.0)) < 4.0, "{best:?}");
    }

    /// Whatever there is: nothing, one point, many in one place, the ends of the world, no numbers.
    #[test]
    fn points_of_any_kind_have_a_best_disc_or_none() {
        let at = Position::from_m;
        let best = |points: &[Position]| best_disc(points, 300.0, Position::ORIGIN, |_| 1.0);
        assert_eq!(best(&[]), None);
        assert_eq!(best(&[at(f64::NAN, 0.0), at(0.0, f64::INFINITY)]), None);
        assert_eq!(best(&[at(5.0, -7.0)]), Some(at(5.0, -7.0)));
        assert_eq!(best(&[at(5.0, -7.0), at(f64::NAN, 0.0)]), Some(at(5.0, -7.0)));
        assert_eq!(best(&[at(5.0, -7.0); 1000]), Some(at(5.0, -7.0)));
        let far = [at(0.0, 0.0), at(1e6, 0.0), at(1e6, 1.0), at(-1e6, 0.0)];
        assert!(best(&far).is_some_and(|best| covers(best, 300.0, far[1]) && covers(best, 300.0, far[2])));
        for end_m in [1e30, 1e300] {
            let ends = [at(-end_m, end_m), at(end_m, -end_m)];
            assert_eq!(best(&ends), Some(ends[0]), "{end_m}");
        }
        let fine = [at(1e6, 0.0), at(-1e6, 0.0)];
        assert_eq!(best_disc(&fine, 1e-12, Position::ORIGIN, |_| 1.0), Some(fine[0]));
    }
}
