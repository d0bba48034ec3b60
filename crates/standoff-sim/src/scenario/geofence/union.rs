//! Union of polygons: the outlines of a zone with several parts.
//!
//! All sides are divided where they meet. A piece is an outline of the union if it is inside no other polygon and no
//! other one has it in the opposite direction. The pieces are then joined to closed outlines.

use std::collections::BTreeSet;

use standoff::Position;

use super::super::polygons::Rings;

/// Distance within which points coincide, m: files round degrees to seven decimals, 1.1 cm.
pub(super) const SAME_M: f64 = 0.05;

/// Maximum number of points at which outlines meet: more than the zones of a scenario may have.
const POINTS_MAX: usize = 2_000;

type Point = [f64; 2];

/// A part of an outline, from a point to another, by index.
type Piece = (usize, usize);

/// Returns the outlines of the union of polygons, each an outline with holes, in metres: the outer ones anticlockwise,
/// then those of holes clockwise. `None` if the polygons meet at too many points, or if rounding errors leave an outline
/// open.
pub(super) fn union(polygons: &[Rings]) -> Option<Rings> {
    let polygons: Vec<Rings> = polygons.iter().map(oriented).collect();
    let mut points = Points(Vec::new());
    let mut divided: Vec<Vec<Vec<usize>>> = Vec::new();
    for rings in &polygons {
        let rings: Option<Vec<Vec<usize>>> = rings.iter().map(|ring| points.divide(ring, &polygons)).collect();
        divided.push(rings?);
    }
    let pieces: Vec<BTreeSet<Piece>> =
        divided.iter().map(|rings| rings.iter().flat_map(|ring| sides(ring)).collect()).collect();
    let mut kept = BTreeSet::new();
    for (index, own) in pieces.iter().enumerate() {
        for piece in own {
            let [from, to] = [points.0[piece.0], points.0[piece.1]];
            let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
            let is_free_of = |other: usize| {
                let reverse = (piece.1, piece.0);
                let is_shared = pieces[other].contains(piece);
                let is_between = pieces[other].contains(&reverse);
                other == index || is_shared || !(is_between || points.contains(&divided[other], middle))
            };
            if (0..pieces.len()).all(is_free_of) {
                kept.insert(*piece);
            }
        }
    }
    let mut outlines = points.join(kept)?;
    outlines.retain(|ring| ring.len() >= 3);
    outlines.sort_by_key(|ring| twice_area_m2(ring) < 0.0);
    Some(outlines)
}

/// Points at which outlines start, meet and turn. Points within [`SAME_M`] are one.
struct Points(Vec<Point>);

impl Points {
    fn index(&mut self, at: Point) -> Option<usize> {
        let known = self.0.iter().position(|known| distance_m(*known, at) <= SAME_M);
        if known.is_none() {
            self.0.push(at);
        }
        Some(known.unwrap_or(self.0.len() - 1)).filter(|index| *index < POINTS_MAX)
    }

    /// Divides a ring at the vertices of all polygons on it, and where their sides cross it.
    fn divide(&mut self, ring: &[Point], polygons: &[Rings]) -> Option<Vec<usize>> {
        let mut divided = Vec::new();
        for (from, to) in sides_of(ring) {
            let mut cuts = vec![from, to];
            for (other_from, other_to) in polygons.iter().flatten().flat_map(|ring| sides_of(ring)) {
                if distance_to_side_m(other_from, from, to) <= SAME_M {
                    cuts.push(other_from);
                }
                cuts.extend(crossing((from, to), (other_from, other_to)));
            }
            let along = |at: &Point| (at[0] - from[0]) * (to[0] - from[0]) + (at[1] - from[1]) * (to[1] - from[1]);
            cuts.sort_by(|a, b| along(a).total_cmp(&along(b)));
            for cut in cuts {
                divided.push(self.index(cut)?);
            }
        }
        divided.dedup();
        while divided.len() > 1 && divided.first() == divided.last() {
            divided.pop();
        }
        Some(divided)
    }

    /// True if a polygon with these rings contains a position: a ray to the east crosses it an odd number of times.
    fn contains(&self, rings: &[Vec<usize>], at: Point) -> bool {
        let crosses = |(from, to): &Piece| {
            let [from, to] = [self.0[*from], self.0[*to]];
            (from[1] > at[1]) != (to[1] > at[1])
                && at[0] < from[0] + (at[1] - from[1]) / (to[1] - from[1]) * (to[0] - from[0])
        };
        rings.iter().flat_map(|ring| sides(ring)).filter(crosses).count() % 2 == 1
    }

    /// Joins pieces to closed outlines; `None` if one stays open.
    fn join(&self, mut pieces: BTreeSet<Piece>) -> Option<Rings> {
        let mut outlines = Vec::new();
        while let Some((start, mut at)) = pieces.pop_first() {
            let (mut outline, mut before) = (vec![start], start);
            while at != start {
                outline.push(at);
                let into = self.direction((before, at));
                // Where outlines touch, the sharpest turn to the left stays on the same one.
                let left_rad = |piece: &Piece| (self.direction(*piece) - into).rad();
                let ahead = pieces.range((at, 0)..=(at, usize::MAX));
                let next = *ahead.max_by(|a, b| left_rad(a).total_cmp(&left_rad(b)))?;
                pieces.remove(&next);
                (before, at) = next;
            }
            outlines.push(self.corners(&outline));
        }
        Some(outlines)
    }

    fn direction(&self, (from, to): Piece) -> standoff::Angle {
        let [from, to] = [from, to].map(|index| Position::from_m(self.0[index][0], self.0[index][1]));
        (to - from).direction()
    }

    /// Points of a ring without those on a straight line between their neighbours.
    fn corners(&self, ring: &[usize]) -> Vec<Point> {
        let mut corners: Vec<Point> = ring.iter().map(|index| self.0[*index]).collect();
        let mut index = 0;
        while corners.len() > 2 && index < corners.len() {
            let (before, after) = ((index + corners.len() - 1) % corners.len(), (index + 1) % corners.len());
            if distance_to_side_m(corners[index], corners[before], corners[after]) <= SAME_M {
                corners.remove(index);
            } else {
                index += 1;
            }
        }
        corners
    }
}

/// Rings without repeated points, the outline anticlockwise and the holes clockwise.
fn oriented(rings: &Rings) -> Rings {
    let ring = |(place, ring): (usize, &Vec<Point>)| {
        let mut ring = ring.clone();
        ring.dedup();
        if ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        if (twice_area_m2(&ring) > 0.0) != (place == 0) {
            ring.reverse();
        }
        ring
    };
    rings.iter().enumerate().map(ring).collect()
}

fn sides_of(ring: &[Point]) -> impl Iterator<Item = (Point, Point)> {
    ring.iter().copied().zip(ring.iter().copied().cycle().skip(1))
}

fn sides(ring: &[usize]) -> impl Iterator<Item = Piece> {
    ring.iter().copied().zip(ring.iter().copied().cycle().skip(1))
}

/// Twice the signed area of a ring, m2; positive if it is anticlockwise.
pub(super) fn twice_area_m2(ring: &[Point]) -> f64 {
    let origin = ring.first().copied().unwrap_or_default();
    let cross =
        |(a, b): (Point, Point)| (a[0] - origin[0]) * (b[1] - origin[1]) - (a[1] - origin[1]) * (b[0] - origin[0]);
    sides_of(ring).map(cross).sum()
}

fn position([x_m, y_m]: Point) -> Position {
    Position::from_m(x_m, y_m)
}

fn distance_m(one: Point, other: Point) -> f64 {
    position(one).distance_m(position(other))
}

fn distance_to_side_m(at: Point, from: Point, to: Point) -> f64 {
    let at = position(at);
    at.distance_m(at.nearest_on_line(position(from), position(to)))
}

/// Point at which two sides cross; `None` if they do not, or are parallel.
fn crossing(one: (Point, Point), other: (Point, Point)) -> Option<Point> {
    let [along, across] = [one, other].map(|(from, to)| [to[0] - from[0], to[1] - from[1]]);
    let between = [other.0[0] - one.0[0], other.0[1] - one.0[1]];
    let cross = |a: Point, b: Point| a[0] * b[1] - a[1] * b[0];
    let sine = cross(along, across);
    let shares = [cross(between, across) / sine, cross(between, along) / sine];
    let is_crossing = sine != 0.0 && shares.iter().all(|share| (0.0..=1.0).contains(share));
    is_crossing.then(|| [one.0[0] + shares[0] * along[0], one.0[1] + shares[0] * along[1]])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle([west, south, east, north]: [f64; 4]) -> Vec<Point> {
        vec![[west, south], [east, south], [east, north], [west, north], [west, south]]
    }

    /// Signed areas of the union's outlines, m2, and their numbers of corners.
    fn areas(polygons: &[Rings]) -> Vec<(f64, usize)> {
        let outlines = union(polygons).unwrap();
        outlines.iter().map(|ring| ((5.0 * twice_area_m2(ring)).round() / 10.0, ring.len())).collect()
    }

    #[test]
    fn rectangles_are_joined_where_they_touch_or_overlap() {
        let of = |all: &[[f64; 4]]| {
            let polygons: Vec<Rings> = all.iter().map(|one| vec![rectangle(*one)]).collect();
            let reversed: Vec<Rings> = polygons.iter().rev().cloned().collect();
            let found = areas(&polygons);
            let sum = |all: &[(f64, usize)]| (all.iter().map(|of| of.0).sum::<f64>(), all.len());
            assert_eq!(sum(&found), sum(&areas(&reversed)));
            found
        };
        // A common side, also if rounding has left a gap or an overlap of a centimetre.
        for error_m in [0.0, 0.01, -0.01] {
            let found = of(&[[0.0, 0.0, 100.0, 50.0], [100.0 + error_m, 0.0, 300.0, 50.0]]);
            assert!(found.len() == 1 && found[0].1 == 4 && (found[0].0 - 15_000.0).abs() < 1.0, "{found:?}");
        }
        // Part of a side in common, and an overlap: an L.
        assert_eq!(of(&[[0.0, 0.0, 100.0, 50.0], [0.0, 50.0, 50.0, 90.0]]), [(7_000.0, 6)]);
        assert_eq!(of(&[[0.0, 0.0, 100.0, 50.0], [0.0, 20.0, 50.0, 90.0]]), [(7_000.0, 6)]);
        // A cross, equal rectangles, one inside of the other, and two apart.
        assert_eq!(of(&[[-50.0, -10.0, 50.0, 10.0], [-10.0, -50.0, 10.0, 50.0]]), [(3_600.0, 12)]);
        assert_eq!(of(&[[0.0, 0.0, 10.0, 10.0], [0.0, 0.0, 10.0, 10.0]]), [(100.0, 4)]);
        assert_eq!(of(&[[0.0, 0.0, 100.0, 100.0], [20.0, 20.0, 50.0, 50.0]]), [(10_000.0, 4)]);
        assert_eq!(of(&[[0.0, 0.0, 10.0, 10.0], [20.0, 0.0, 30.0, 10.0]]), [(100.0, 4), (100.0, 4)]);
        // Two that touch at a corner stay apart.
        assert_eq!(of(&[[0.0, 0.0, 10.0, 10.0], [10.0, 10.0, 20.0, 20.0]]), [(100.0, 4), (100.0, 4)]);
        // Four around a hole, which is clockwise.
        let ring = [[0.0, 0.0, 30.0, 10.0], [0.0, 20.0, 30.0, 30.0], [0.0, 10.0, 10.0, 20.0], [20.0, 10.0, 30.0, 20.0]];
        assert_eq!(of(&ring), [(900.0, 4), (-100.0, 4)]);
    }

    #[test]
    fn a_hole_stays_where_no_other_polygon_covers_it() {
        let with_hole = vec![rectangle([0.0, 0.0, 100.0, 100.0]), rectangle([20.0, 20.0, 60.0, 60.0])];
        let over = |other| areas(&[with_hole.clone(), vec![rectangle(other)]]);
        assert_eq!(over([200.0, 0.0, 210.0, 10.0]), [(10_000.0, 4), (100.0, 4), (-1_600.0, 4)]);
        assert_eq!(over([10.0, 10.0, 70.0, 70.0]), [(10_000.0, 4)]);
        assert_eq!(over([40.0, 10.0, 70.0, 70.0]), [(10_000.0, 4), (-800.0, 4)]);
    }

    /// Compares membership in the union with that in any of the polygons, for random triangles.
    #[test]
    fn a_position_is_in_the_union_exactly_if_it_is_in_a_polygon() {
        let mut seed = 7_u64;
        let mut draw = |below: f64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 * below
        };
        for _ in 0..300 {
            let triangles: Vec<Rings> =
                (0..4).map(|_| vec![(0..3).map(|_| [draw(1_000.0), draw(1_000.0)]).collect()]).collect();
            let outlines = union(&triangles).unwrap();
            let contains = |rings: &Rings, at: Point| {
                let points = Points(rings.iter().flatten().copied().collect());
                let mut first = 0;
                let rings: Vec<Vec<usize>> = rings
                    .iter()
                    .map(|ring| {
                        first += ring.len();
                        (first - ring.len()..first).collect()
                    })
                    .collect();
                points.contains(&rings, at)
            };
            for _ in 0..200 {
                let at = [draw(1_000.0), draw(1_000.0)];
                let all = triangles.iter().flatten().flat_map(|ring| sides_of(ring));
                if all.map(|(from, to)| distance_to_side_m(at, from, to)).all(|distance_m| distance_m > 0.2) {
                    let expected = triangles.iter().any(|triangle| contains(triangle, at));
                    assert_eq!(contains(&outlines, at), expected, "{triangles:?} {at:?}");
                }
            }
        }
    }
}
