//! Best placement of one disc over points: branch and bound over squares of centres.

use standoff::{Displacement, Position};

/// Resolution of centres, as a fraction of the radius.
const FINENESS: f64 = 1.0 / 64.0;
/// Maximum number of squares of a search. The hundreds of vehicles of a town quarter take 400; without a limit the
/// search would not end if floating-point numbers are too coarse for the radius.
const SQUARES_MAX: u32 = 50_000;
/// Number of steps that move a disc towards the furthest point that it covers, each step smaller than the one before.
const CENTRINGS: u32 = 40;
/// Ratio of the half diagonal of a square to half its side.
const DIAGONAL: f64 = std::f64::consts::SQRT_2;

/// Returns whether a disc covers a point. No disc covers a point that is not finite.
pub(super) fn covers(centre: Position, radius_m: f64, point: Position) -> bool {
    centre.squared_distance_m2(point) <= radius_m * radius_m
}

/// Returns the centre of the disc of the highest value: the number of points that it covers, times `worth` of the
/// distance between its centre and `from`. `worth` must not increase with the distance. The disc is then centred on the
/// points that it covers. `None` if the value would be zero.
///
/// The search covers the bounding box of the points. At a resolution of 1/64 of the radius, no other centre in it has a
/// higher value: a square of centres is skipped only if all points that any of its centres could cover, at the distance
/// of the nearest, have no higher value than the best disc found.
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

/// A square of centres, and the points that a disc about one of them may cover.
struct Square {
    centre: Position,
    half_m: f64,
    /// Number of points that are covered from every centre.
    sure: usize,
    /// Points that are covered from some centres, as indices of a list.
    open: std::ops::Range<usize>,
}

struct Search<F> {
    radius_m: f64,
    from: Position,
    worth: F,
    /// Number of squares examined.
    squares: u32,
    most: f64,
    best: Position,
}

impl<F: Fn(f64) -> f64> Search<F> {
    /// Searches a square for a better disc; `open` has the same length afterwards as before.
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

    /// Returns a quarter of a square; appends its undecided points to the list.
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

    /// Upper bound of the value of a disc with its centre in a square.
    fn most_of(&self, square: &Square) -> f64 {
        let nearest_m = (square.centre.distance_m(self.from) - DIAGONAL * square.half_m).max(0.0);
        (square.sure + square.open.len()) as f64 * (self.worth)(nearest_m)
    }
}

/// Moves a disc so that it covers the same points closer to its middle; on the rim they would be lost immediately.
fn centred(best: Position, radius_m: f64, points: &[Position]) -> Position {
    let covered: Vec<Position> = points.iter().copied().filter(|point| covers(best, radius_m, *point)).collect();
    // Badoiu and Clarkson (2003): steps of decreasing size towards the furthest point converge to the minimum enclosing
    // circle.
    let mut centre = best;
    for number in 0..CENTRINGS {
        let furthest =
            covered.iter().max_by(|a, b| centre.squared_distance_m2(**a).total_cmp(&centre.squared_distance_m2(**b)));
        let Some(furthest) = furthest else { return best };
        let off = *furthest - centre;
        let part = 1.0 / f64::from(number + 2);
        centre = centre + Displacement::from_m(part * off.x_m(), part * off.y_m());
    }
    if covered.iter().all(|point| covers(centre, radius_m, *point)) { centre } else { best }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Draws, Stream};

    /// Largest number of points that any disc covers: such a disc can be moved until one or two points are on its rim.
    fn most(points: &[Position], radius_m: f64) -> usize {
        let rims = points.iter().flat_map(|a| points.iter().map(move |b| (*a, *b))).filter_map(|(a, b)| {
            let (off, half_m) = (b - a, 0.5 * a.distance_m(b));
            let aside = (radius_m * radius_m - half_m * half_m).sqrt() / (2.0 * half_m).max(1e-9);
            let centre = Displacement::from_m(0.5 * off.x_m() - aside * off.y_m(), 0.5 * off.y_m() + aside * off.x_m());
            (half_m <= radius_m).then(|| a + centre)
        });
        // Points on the rim count despite rounding.
        let count = |centre: Position| points.iter().filter(|point| covers(centre, radius_m + 1e-6, **point)).count();
        rims.map(count).max().unwrap_or(0).max(1)
    }

    /// No disc covers more than the best one, and a disc that is smaller by half the diagonal of the finest square
    /// covers no more than the one found.
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

    /// A disc of 100 m is centred between two points 150 m apart, so that neither is on its rim.
    #[test]
    fn a_disc_is_centred_on_the_points_it_covers() {
        let points = [Position::from_m(0.0, 40.0), Position::from_m(150.0, 40.0)];
        let best = best_disc(&points, 100.0, Position::ORIGIN, |_| 1.0).unwrap();
        assert!(best.distance_m(Position::from_m(75.0, 40.0)) < 4.0, "{best:?}");
    }

    /// No point, one point, many in one place, points at the limits, and NaNs.
    #[test]
    fn extreme_points_have_a_best_disc_or_none() {
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
