//! The best place of one disc among points: branch and bound over squares of centres.

use standoff::{Displacement, Position};

/// Centres are told apart to this share of the radius.
const FINENESS: f64 = 1.0 / 64.0;
/// Squares are halved no more often, however far apart the points are.
const HALVINGS_MAX: u32 = 64;
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
    let mut search = Search { radius_m, from, worth, most: 0.0, best: None };
    search.within(&square, HALVINGS_MAX, &mut open);
    search.best.map(|best| centred(best, radius_m, points))
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
    most: f64,
    best: Option<Position>,
}

impl<F: Fn(f64) -> f64> Search<F> {
    /// Looks for a better disc in a square; `open` is as long afterwards as before.
    fn within(&mut self, square: &Square, halvings: u32, open: &mut Vec<Position>) {
        let Square { centre, half_m, sure, .. } = *square;
        let covered = open[square.open.clone()].iter().filter(|point| covers(centre, self.radius_m, **point)).count();
        let worth = (sure + covered) as f64 * (self.worth)(centre.distance_m(self.from));
        if worth > self.most {
            (self.most, self.best) = (worth, Some(centre));
        }
        if halvings == 0 || half_m <= FINENESS * self.radius_m {
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
                self.within(&quarter, halvings - 1, open);
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
