//! The smallest circle about a set of places (E. Welzl, *Smallest enclosing disks (balls and ellipsoids)*, 1991).
//!
//! It is held by two or three of the places, which lie on its rim, and no other circle about them is as small. It is
//! found without drawing an order and without room of its own, by what B. Gaertner, *Fast and robust smallest enclosing
//! balls*, 1999, calls pivoting: from a circle about few of the places to that about these and the furthest outside,
//! until none is outside. The radius grows each time, so this ends; a handful of passes over hundreds of places.

use crate::frame::{Displacement, Position, Velocity};

/// The smallest circle about a set of places.
///
/// ```
/// use standoff::{Position, SmallestCircle};
///
/// let places = [(0.0, 0.0), (8.0, 0.0), (3.0, 1.0), (0.0, 6.0)].map(|(x_m, y_m)| Position::from_m(x_m, y_m));
/// let circle = SmallestCircle::of(places.into_iter()).unwrap();
/// assert_eq!((circle.centre, circle.radius_m), (Position::from_m(4.0, 3.0), 5.0));
/// // The second and the last hold it.
/// assert!(circle.rim().eq([3, 1]));
/// ```
#[doc(alias = "smallest enclosing circle")]
#[doc(alias = "minimum bounding circle")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmallestCircle {
    /// Its centre.
    pub centre: Position,
    /// Its radius, m: the distance from the centre to the furthest place.
    pub radius_m: f64,
    rim: Rim,
}

/// How a circle moves while the same places hold it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleMotion {
    /// Velocity of the centre.
    pub centre_velocity: Velocity,
    /// Rate of the radius, m/s: never more than the fastest place's speed.
    pub radius_rate_m_s: f64,
}

/// One to three places, with their numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Rim {
    places: [(usize, Position); 3],
    count: usize,
}

impl Rim {
    fn of(places: &[(usize, Position)]) -> Self {
        let mut rim = Self { count: places.len(), ..Self::default() };
        rim.places[..places.len()].copy_from_slice(places);
        rim
    }

    fn places(&self) -> &[(usize, Position)] {
        &self.places[..self.count]
    }
}

/// A place further from the origin than this along an axis is none, m: beyond, squares overflow.
const FURTHEST_M: f64 = 1e100;

/// Equal but for rounding: of two circles as small, that with fewer places on its rim is it.
const EQUAL: f64 = 1.0 + 1e-12;

impl SmallestCircle {
    /// The smallest circle about places; `None` without places. Those without finite coordinates are left out.
    pub fn of(places: impl Iterator<Item = Position> + Clone) -> Option<Self> {
        let is_place = |at: Position| at.x_m().abs() <= FURTHEST_M && at.y_m().abs() <= FURTHEST_M;
        let places = places.enumerate().filter(|(_, at)| is_place(*at));
        let first = places.clone().next()?;
        let mut circle = Self { centre: first.1, radius_m: 0.0, rim: Rim::of(&[first]) };
        loop {
            let mut furthest = (0.0, first);
            for place in places.clone() {
                let squared_m2 = place.1.squared_distance_m2(circle.centre);
                if squared_m2 > furthest.0 {
                    furthest = (squared_m2, place);
                }
            }
            let (distance_m, place) = (furthest.0.sqrt(), furthest.1);
            let is_outside = distance_m > circle.radius_m * EQUAL;
            match is_outside.then(|| circle.widened(place)) {
                Some(wider) if wider.radius_m > circle.radius_m => circle = wider,
                _ => return Some(Self { radius_m: distance_m, ..circle }),
            }
        }
    }

    /// Which places hold it: one, two or three of them, by their numbers in the order given; with fewer it would be smaller.
    pub fn rim(&self) -> impl Iterator<Item = usize> {
        self.rim.places().iter().map(|(number, _)| *number)
    }

    /// The smallest circle about the places on the rim and one outside, which lies on its rim: of all circles through it
    /// and one or two of the others that which reaches least far about all of them.
    fn widened(&self, outside: (usize, Position)) -> Self {
        let rim = self.rim.places();
        let about = |centre: Position, of: Rim| {
            let squares = rim.iter().map(|place| place.1.squared_distance_m2(centre));
            let squared_m2 = squares.fold(outside.1.squared_distance_m2(centre), f64::max);
            Self { centre, radius_m: squared_m2.sqrt(), rim: of }
        };
        let mut least = Self { radius_m: f64::INFINITY, ..*self };
        let mut consider = |circle: Self| {
            if circle.radius_m * EQUAL < least.radius_m {
                least = circle;
            }
        };
        for &one in rim {
            consider(about(between(outside.1, one.1), Rim::of(&[outside, one])));
        }
        for (index, &one) in rim.iter().enumerate() {
            for &other in &rim[index + 1..] {
                if let Some(centre) = equally_far(outside.1, one.1, other.1) {
                    consider(about(centre, Rim::of(&[outside, one, other])));
                }
            }
        }
        least
    }

    /// How it moves if its places have these velocities, by their numbers, as long as the same hold it: all of them stay
    /// at one distance r from the centre c, so that `(x_i - c) . (v_i - c') = r r'` for each.
    pub fn motion(&self, velocity: impl Fn(usize) -> Velocity) -> CircleMotion {
        // Outwards; the velocity; the speed outwards, m/s.
        let on_rim = |(number, at): (usize, Position)| {
            let (outwards, v) = ((at - self.centre).vector() / self.radius_m, velocity(number).vector());
            (outwards, v, outwards.dot(&v))
        };
        match *self.rim.places() {
            [a, b] => {
                let ((_, a_v, a_m_s), (_, b_v, b_m_s)) = (on_rim(a), on_rim(b));
                let centre_velocity = Velocity::from((a_v + b_v) * 0.5);
                CircleMotion { centre_velocity, radius_rate_m_s: 0.5 * (a_m_s + b_m_s) }
            }
            [a, b, c] => {
                let ((a, _, a_m_s), (b, _, b_m_s), (c, _, c_m_s)) = (on_rim(a), on_rim(b), on_rim(c));
                // The centre is the mean of the three with the weights of the triangles opposite.
                let weights = [b.perp(&c), c.perp(&a), a.perp(&b)];
                let sum = weights[0] + weights[1] + weights[2];
                let radius_rate_m_s = (weights[0] * a_m_s + weights[1] * b_m_s + weights[2] * c_m_s) / sum;
                // r' drops out of what the constraints differ in: two equations for c'.
                let (ab, ac, ab_m_s, ac_m_s) = (b - a, c - a, b_m_s - a_m_s, c_m_s - a_m_s);
                let (x, y) = (ab_m_s * ac.y - ac_m_s * ab.y, ab.x * ac_m_s - ac.x * ab_m_s);
                CircleMotion { centre_velocity: Velocity::from_m_s(x / sum, y / sum), radius_rate_m_s }
            }
            _ => CircleMotion {
                centre_velocity: self.rim().next().map_or(Velocity::ZERO, velocity),
                radius_rate_m_s: 0.0,
            },
        }
    }
}

/// Half-way.
fn between(a: Position, b: Position) -> Position {
    Position::from_m(0.5 * (a.x_m() + b.x_m()), 0.5 * (a.y_m() + b.y_m()))
}

/// The centre of the circle through three places; `None` for places on a line.
fn equally_far(a: Position, b: Position, c: Position) -> Option<Position> {
    let (b, c) = ((b - a).vector(), (c - a).vector());
    let (area, b_m2, c_m2) = (2.0 * b.perp(&c), b.norm_squared(), c.norm_squared());
    let centre = a + Displacement::from_m((c.y * b_m2 - b.y * c_m2) / area, (b.x * c_m2 - c.x * b_m2) / area);
    centre.is_finite().then_some(centre)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn circle(places: &[Position]) -> SmallestCircle {
        SmallestCircle::of(places.iter().copied()).unwrap()
    }

    fn place((x_m, y_m): (f64, f64)) -> Position {
        Position::from_m(x_m, y_m)
    }

    /// How far a circle about this centre must reach.
    fn reach_m(places: &[Position], centre: Position) -> f64 {
        places.iter().map(|at| at.distance_m(centre)).fold(0.0, f64::max)
    }

    /// Of the circles through two places as a diameter, and through three, that which reaches least far; the centre of
    /// the latter where two bisectors meet.
    fn by_trying_all(places: &[Position]) -> f64 {
        let mut least_m = f64::INFINITY;
        for (i, a) in places.iter().enumerate() {
            for (j, b) in places.iter().enumerate().skip(i) {
                least_m = least_m.min(reach_m(places, between(*a, *b)));
                for c in &places[j..] {
                    let rows =
                        nalgebra::Matrix2::from_rows(&[(*b - *a).vector().transpose(), (*c - *a).vector().transpose()]);
                    let halves =
                        nalgebra::Vector2::new((*b - *a).vector().norm_squared(), (*c - *a).vector().norm_squared());
                    if let Some(inverse) = rows.try_inverse() {
                        least_m = least_m.min(reach_m(places, Position::from(a.vector() + inverse * halves * 0.5)));
                    }
                }
            }
        }
        least_m
    }

    /// A pair holds it as a diameter, an acute triangle by its three corners; who lies inside does not count.
    #[test]
    fn two_or_three_hold_it() {
        // 3-4-5 triangles about (1, 2).
        let three = circle(&[(6.0, 2.0), (-2.0, 6.0), (2.0, 3.0), (-2.0, -2.0)].map(place));
        assert!(three.centre.distance_m(place((1.0, 2.0))) < 1e-12 && (three.radius_m - 5.0).abs() < 1e-12);
        let mut rim: Vec<usize> = three.rim().collect();
        rim.sort_unstable();
        assert_eq!(rim, [0, 1, 3]);
        let two = circle(&[(0.0, 0.0), (4.0, 1.0), (10.0, 0.0)].map(place));
        assert_eq!((two.centre, two.radius_m, two.rim().count()), (place((5.0, 0.0)), 5.0, 2));
    }

    #[test]
    fn places_that_are_none_are_left_out() {
        assert_eq!(SmallestCircle::of([].into_iter()), None);
        assert_eq!(SmallestCircle::of([(f64::NAN, 0.0), (0.0, f64::INFINITY)].map(place).into_iter()), None);
        let rest = circle(&[(f64::NAN, 0.0), (1.0, 0.0), (1e200, 0.0), (3.0, 0.0)].map(place));
        assert_eq!((rest.centre, rest.radius_m), (place((2.0, 0.0)), 1.0));
        assert!(rest.rim().eq([3, 1]));
    }

    /// All at one place, all on one line, all on one circle: it ends, and is right.
    #[test]
    fn what_is_degenerate_has_a_circle_too() {
        let one = circle(&[place((7.0, -3.0)); 5]);
        assert_eq!((one.centre, one.radius_m, one.rim().count()), (place((7.0, -3.0)), 0.0, 1));
        let line: Vec<Position> = (0..50).map(|i| place((f64::from(i), 3.0 * f64::from(i)))).collect();
        assert!((circle(&line).radius_m - 0.5 * line[0].distance_m(line[49])).abs() < 1e-12);
        let ring: Vec<Position> = (0..360)
            .map(|i| place((1e6, -1e6)) + Displacement::from_polar(100.0, crate::angle::Angle::from_rad(f64::from(i))))
            .collect();
        assert!((circle(&ring).radius_m - 100.0).abs() < 1e-3);
    }

    fn cloud() -> impl Strategy<Value = Vec<Position>> {
        // On a coarse grid many lie on one line, on one circle or at one place.
        let coordinate = prop_oneof![(-4..5i32).prop_map(|x| 25.0 * f64::from(x)), -300.0..300.0f64];
        prop::collection::vec((coordinate.clone(), coordinate).prop_map(place), 1..12)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn it_is_the_smallest_of_all_through_two_or_three(places in cloud()) {
            let circle = circle(&places);
            prop_assert_eq!(circle.radius_m, reach_m(&places, circle.centre));
            prop_assert!((circle.radius_m - by_trying_all(&places)).abs() <= 1e-9, "{circle:?}");
            for on_rim in circle.rim() {
                prop_assert!((places[on_rim].distance_m(circle.centre) - circle.radius_m).abs() < 1e-7);
            }
            // Those on the rim need it all by themselves.
            let alone: Vec<Position> = circle.rim().map(|number| places[number]).collect();
            prop_assert!((by_trying_all(&alone) - circle.radius_m).abs() < 1e-7);
        }

        /// Shifted, turned, in another order: shifted and turned.
        #[test]
        fn it_goes_with_its_places(places in cloud(), x in -1e4..1e4f64, y in -1e4..1e4f64, turn in -3.0..3.0f64) {
            let turned = |at: Position| {
                let (sin, cos) = crate::math::sin_cos(turn);
                place((x + cos * at.x_m() - sin * at.y_m(), y + sin * at.x_m() + cos * at.y_m()))
            };
            let moved: Vec<Position> = places.iter().rev().map(|at| turned(*at)).collect();
            let (before, after) = (circle(&places), circle(&moved));
            prop_assert!((before.radius_m - after.radius_m).abs() < 1e-7);
            prop_assert!(turned(before.centre).distance_m(after.centre) < 1e-4);
        }

        /// Against where it is a moment before and after, where the same hold it.
        #[test]
        fn it_moves_as_its_rim_does(
            places in prop::collection::vec((-300.0..300.0f64, -300.0..300.0f64), 2..8),
            velocities in prop::collection::vec((-15.0..15.0f64, -15.0..15.0f64), 8),
        ) {
            let places: Vec<Position> = places.into_iter().map(place).collect();
            let velocity = |number: usize| Velocity::from_m_s(velocities[number].0, velocities[number].1);
            let at = |s: f64| {
                let places: Vec<_> = places.iter().enumerate().map(|(i, at)| *at + velocity(i) * s).collect();
                circle(&places)
            };
            let (before, now, after) = (at(-1e-4), at(0.0), at(1e-4));
            let who = |circle: &SmallestCircle| {
                let mut rim: Vec<usize> = circle.rim().collect();
                rim.sort_unstable();
                rim
            };
            prop_assume!(who(&before) == who(&now) && who(&after) == who(&now));
            let motion = now.motion(velocity);
            let rate_m_s = (after.radius_m - before.radius_m) / 2e-4;
            let moved = (after.centre - before.centre).vector() / 2e-4;
            // Where two of three are close, little is needed to move it much: its second derivative is large.
            let speed_m_s = moved.norm();
            prop_assume!(speed_m_s < 1e3);
            prop_assert!((motion.radius_rate_m_s - rate_m_s).abs() < 1e-3, "{motion:?} {rate_m_s}");
            prop_assert!((motion.centre_velocity.vector() - moved).norm() < 1e-2 * (1.0 + speed_m_s), "{motion:?} {moved}");
        }
    }
}
