//! The minimum enclosing circle of a set of points (E. Welzl, *Smallest enclosing disks (balls and ellipsoids)*, 1991).
//!
//! The circle is unique and is determined by two or three support points, which lie on it. The algorithm needs neither
//! a random order nor memory. It uses pivoting (B. Gaertner, *Fast and robust smallest enclosing balls*, 1999): it
//! starts with a circle around a few points and repeatedly adds the furthest point outside until no point is outside.
//! The radius grows each time, so the loop terminates, after a few passes even over hundreds of points.

use crate::frame::{Displacement, Position, Velocity};

/// The minimum enclosing circle of a set of points.
///
/// ```
/// use standoff::{Position, enclosing_circle::EnclosingCircle};
///
/// let points = [(0.0, 0.0), (8.0, 0.0), (3.0, 1.0), (0.0, 6.0)].map(|(x_m, y_m)| Position::from_m(x_m, y_m));
/// let circle = EnclosingCircle::of(points.into_iter()).unwrap();
/// assert_eq!((circle.centre, circle.radius_m), (Position::from_m(4.0, 3.0), 5.0));
/// // Points 1 and 3 are the support points.
/// assert!(circle.support_points().eq([3, 1]));
/// ```
#[doc(alias = "smallest enclosing circle")]
#[doc(alias = "minimum bounding circle")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnclosingCircle {
    /// Centre of the circle.
    pub centre: Position,
    /// Radius, m: distance from the centre to the furthest point.
    pub radius_m: f64,
    support: Support,
}

/// Motion of a circle while its support points stay the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleMotion {
    /// Velocity of the centre.
    pub centre_velocity: Velocity,
    /// Rate of the radius, m/s; never more than the speed of the fastest point.
    pub radius_rate_m_s: f64,
}

/// One to three support points, with their indices.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Support {
    places: [(usize, Position); 3],
    count: usize,
}

impl Support {
    fn of(places: &[(usize, Position)]) -> Self {
        let mut rim = Self { count: places.len(), ..Self::default() };
        rim.places[..places.len()].copy_from_slice(places);
        rim
    }

    fn places(&self) -> &[(usize, Position)] {
        &self.places[..self.count]
    }
}

/// Maximum coordinate of a point, m. Points beyond it are ignored because their squares overflow.
const FURTHEST_M: f64 = 1e100;

/// Factor within which two radii count as equal. If two circles are equal, the one with fewer support points is used.
const EQUAL: f64 = 1.0 + 1e-12;

impl EnclosingCircle {
    /// Computes the minimum enclosing circle of `points`; `None` if there are no points. Points with coordinates that
    /// are not finite are ignored.
    pub fn of(points: impl Iterator<Item = Position> + Clone) -> Option<Self> {
        let is_valid = |at: Position| at.x_m().abs() <= FURTHEST_M && at.y_m().abs() <= FURTHEST_M;
        let points = points.enumerate().filter(|(_, at)| is_valid(*at));
        let first = points.clone().next()?;
        let mut circle = Self { centre: first.1, radius_m: 0.0, support: Support::of(&[first]) };
        loop {
            let mut furthest = (0.0, first);
            for point in points.clone() {
                let squared_m2 = point.1.squared_distance_m2(circle.centre);
                if squared_m2 > furthest.0 {
                    furthest = (squared_m2, point);
                }
            }
            let (distance_m, point) = (furthest.0.sqrt(), furthest.1);
            let is_outside = distance_m > circle.radius_m * EQUAL;
            match is_outside.then(|| circle.widened(point)) {
                Some(wider) if wider.radius_m > circle.radius_m => circle = wider,
                _ => return Some(Self { radius_m: distance_m, ..circle }),
            }
        }
    }

    /// Indices of the one, two or three support points, in the order of the input. Without any of them the circle would
    /// be smaller.
    pub fn support_points(&self) -> impl Iterator<Item = usize> {
        self.support.places().iter().map(|(number, _)| *number)
    }

    /// Minimum enclosing circle of the support points and one point outside, which becomes a support point. Tries all
    /// circles through that point and one or two of the others and returns the smallest that encloses all of them.
    fn widened(&self, outside: (usize, Position)) -> Self {
        let support = self.support.places();
        let enclosing = |centre: Position, rim: Support| {
            let squares = support.iter().map(|point| point.1.squared_distance_m2(centre));
            let squared_m2 = squares.fold(outside.1.squared_distance_m2(centre), f64::max);
            Self { centre, radius_m: squared_m2.sqrt(), support: rim }
        };
        let mut least = Self { radius_m: f64::INFINITY, ..*self };
        let mut consider = |circle: Self| {
            if circle.radius_m * EQUAL < least.radius_m {
                least = circle;
            }
        };
        for &one in support {
            consider(enclosing(outside.1.midpoint(one.1), Support::of(&[outside, one])));
        }
        for (index, &one) in support.iter().enumerate() {
            for &other in &support[index + 1..] {
                if let Some(centre) = circumcentre(outside.1, one.1, other.1) {
                    consider(enclosing(centre, Support::of(&[outside, one, other])));
                }
            }
        }
        least
    }

    /// Computes the motion of the circle from the velocities of its points, given by index, while the support points
    /// stay the same. They keep the same distance r from the centre c, so `(x_i - c) . (v_i - c') = r r'` for each.
    pub fn motion(&self, velocity: impl Fn(usize) -> Velocity) -> CircleMotion {
        // Outward unit vector, velocity and outward speed (m/s) of a support point.
        let on_rim = |(number, at): (usize, Position)| {
            let (outwards, v) = ((at - self.centre).vector() / self.radius_m, velocity(number).vector());
            (outwards, v, outwards.dot(&v))
        };
        match *self.support.places() {
            [a, b] => {
                let ((_, a_v, a_m_s), (_, b_v, b_m_s)) = (on_rim(a), on_rim(b));
                let centre_velocity = Velocity::from((a_v + b_v) * 0.5);
                CircleMotion { centre_velocity, radius_rate_m_s: 0.5 * (a_m_s + b_m_s) }
            }
            [a, b, c] => {
                let ((a, _, a_m_s), (b, _, b_m_s), (c, _, c_m_s)) = (on_rim(a), on_rim(b), on_rim(c));
                // The centre is the mean of the three points, weighted with the areas of the opposite triangles.
                let weights = [b.perp(&c), c.perp(&a), a.perp(&b)];
                let sum = weights[0] + weights[1] + weights[2];
                let radius_rate_m_s = (weights[0] * a_m_s + weights[1] * b_m_s + weights[2] * c_m_s) / sum;
                // Subtracting the constraints from each other eliminates r' and leaves two equations for c'.
                let (ab, ac, ab_m_s, ac_m_s) = (b - a, c - a, b_m_s - a_m_s, c_m_s - a_m_s);
                let (x, y) = (ab_m_s * ac.y - ac_m_s * ab.y, ab.x * ac_m_s - ac.x * ab_m_s);
                CircleMotion { centre_velocity: Velocity::from_m_s(x / sum, y / sum), radius_rate_m_s }
            }
            _ => CircleMotion {
                centre_velocity: self.support_points().next().map_or(Velocity::ZERO, velocity),
                radius_rate_m_s: 0.0,
            },
        }
    }
}

/// Centre of the circle through three points; `None` if they are collinear.
fn circumcentre(a: Position, b: Position, c: Position) -> Option<Position> {
    let (b, c) = ((b - a).vector(), (c - a).vector());
    let (area, b_m2, c_m2) = (2.0 * b.perp(&c), b.norm_squared(), c.norm_squared());
    let centre = a + Displacement::from_m((c.y * b_m2 - b.y * c_m2) / area, (b.x * c_m2 - c.x * b_m2) / area);
    centre.is_finite().then_some(centre)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn circle(points: &[Position]) -> EnclosingCircle {
        EnclosingCircle::of(points.iter().copied()).unwrap()
    }

    fn point((x_m, y_m): (f64, f64)) -> Position {
        Position::from_m(x_m, y_m)
    }

    /// Radius of the smallest circle with this centre that encloses all points.
    fn reach_m(points: &[Position], centre: Position) -> f64 {
        points.iter().map(|at| at.distance_m(centre)).fold(0.0, f64::max)
    }

    /// Radius of the smallest enclosing circle, by trying all diameters between two points and all circles through
    /// three points. The centre of the latter is the intersection of two bisectors.
    fn brute_force_radius_m(points: &[Position]) -> f64 {
        let mut least_m = f64::INFINITY;
        for (i, a) in points.iter().enumerate() {
            for (j, b) in points.iter().enumerate().skip(i) {
                least_m = least_m.min(reach_m(points, a.midpoint(*b)));
                for c in &points[j..] {
                    let rows =
                        nalgebra::Matrix2::from_rows(&[(*b - *a).vector().transpose(), (*c - *a).vector().transpose()]);
                    let halves =
                        nalgebra::Vector2::new((*b - *a).vector().norm_squared(), (*c - *a).vector().norm_squared());
                    if let Some(inverse) = rows.try_inverse() {
                        least_m = least_m.min(reach_m(points, Position::from(a.vector() + inverse * halves * 0.5)));
                    }
                }
            }
        }
        least_m
    }

    /// Two support points span a diameter, three form an acute triangle. Points inside do not count.
    #[test]
    fn two_or_three_support_points_determine_the_circle() {
        // 3-4-5 triangles around (1, 2).
        let three = circle(&[(6.0, 2.0), (-2.0, 6.0), (2.0, 3.0), (-2.0, -2.0)].map(point));
        assert!(three.centre.distance_m(point((1.0, 2.0))) < 1e-12 && (three.radius_m - 5.0).abs() < 1e-12);
        let mut support: Vec<usize> = three.support_points().collect();
        support.sort_unstable();
        assert_eq!(support, [0, 1, 3]);
        let two = circle(&[(0.0, 0.0), (4.0, 1.0), (10.0, 0.0)].map(point));
        assert_eq!((two.centre, two.radius_m, two.support_points().count()), (point((5.0, 0.0)), 5.0, 2));
    }

    #[test]
    fn points_without_finite_coordinates_are_ignored() {
        assert_eq!(EnclosingCircle::of([].into_iter()), None);
        assert_eq!(EnclosingCircle::of([(f64::NAN, 0.0), (0.0, f64::INFINITY)].map(point).into_iter()), None);
        let rest = circle(&[(f64::NAN, 0.0), (1.0, 0.0), (1e200, 0.0), (3.0, 0.0)].map(point));
        assert_eq!((rest.centre, rest.radius_m), (point((2.0, 0.0)), 1.0));
        assert!(rest.support_points().eq([3, 1]));
    }

    /// Coincident, collinear and concyclic points.
    #[test]
    fn degenerate_sets_of_points_have_a_circle() {
        let one = circle(&[point((7.0, -3.0)); 5]);
        assert_eq!((one.centre, one.radius_m, one.support_points().count()), (point((7.0, -3.0)), 0.0, 1));
        let line: Vec<Position> = (0..50).map(|i| point((f64::from(i), 3.0 * f64::from(i)))).collect();
        assert!((circle(&line).radius_m - 0.5 * line[0].distance_m(line[49])).abs() < 1e-12);
        let ring: Vec<Position> = (0..360)
            .map(|i| point((1e6, -1e6)) + Displacement::from_polar(100.0, crate::angle::Angle::from_rad(f64::from(i))))
            .collect();
        assert!((circle(&ring).radius_m - 100.0).abs() < 1e-3);
    }

    fn cloud() -> impl Strategy<Value = Vec<Position>> {
        // On a coarse grid many points are collinear, concyclic or coincident.
        let coordinate = prop_oneof![(-4..5i32).prop_map(|x| 25.0 * f64::from(x)), -300.0..300.0f64];
        prop::collection::vec((coordinate.clone(), coordinate).prop_map(point), 1..12)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn the_circle_is_as_small_as_the_one_found_by_brute_force(points in cloud()) {
            let circle = circle(&points);
            prop_assert_eq!(circle.radius_m, reach_m(&points, circle.centre));
            prop_assert!((circle.radius_m - brute_force_radius_m(&points)).abs() <= 1e-9, "{circle:?}");
            for index in circle.support_points() {
                prop_assert!((points[index].distance_m(circle.centre) - circle.radius_m).abs() < 1e-7);
            }
            // The support points alone have the same circle.
            let support: Vec<Position> = circle.support_points().map(|index| points[index]).collect();
            prop_assert!((brute_force_radius_m(&support) - circle.radius_m).abs() < 1e-7);
        }

        /// Shifting, rotating and reordering the points shifts and rotates the circle.
        #[test]
        fn the_circle_is_shifted_and_rotated_with_its_points(points in cloud(), x in -1e4..1e4f64, y in -1e4..1e4f64, turn in -3.0..3.0f64) {
            let turned = |at: Position| {
                let (sin, cos) = crate::math::sin_cos(turn);
                point((x + cos * at.x_m() - sin * at.y_m(), y + sin * at.x_m() + cos * at.y_m()))
            };
            let moved: Vec<Position> = points.iter().rev().map(|at| turned(*at)).collect();
            let (before, after) = (circle(&points), circle(&moved));
            prop_assert!((before.radius_m - after.radius_m).abs() < 1e-7);
            prop_assert!(turned(before.centre).distance_m(after.centre) < 1e-4);
        }

        /// Compares the motion with central differences, if the support points stay the same.
        #[test]
        fn the_velocity_of_the_circle_matches_central_differences(
            points in prop::collection::vec((-300.0..300.0f64, -300.0..300.0f64), 2..8),
            velocities in prop::collection::vec((-15.0..15.0f64, -15.0..15.0f64), 8),
        ) {
            let points: Vec<Position> = points.into_iter().map(point).collect();
            let velocity = |index: usize| Velocity::from_m_s(velocities[index].0, velocities[index].1);
            let at = |s: f64| {
                let points: Vec<_> = points.iter().enumerate().map(|(i, at)| *at + velocity(i) * s).collect();
                circle(&points)
            };
            let (before, now, after) = (at(-1e-4), at(0.0), at(1e-4));
            let support = |circle: &EnclosingCircle| {
                let mut support: Vec<usize> = circle.support_points().collect();
                support.sort_unstable();
                support
            };
            prop_assume!(support(&before) == support(&now) && support(&after) == support(&now));
            let motion = now.motion(velocity);
            let rate_m_s = (after.radius_m - before.radius_m) / 2e-4;
            let moved = (after.centre - before.centre).vector() / 2e-4;
            // If two of three support points are close, the second derivative is large and differences are inaccurate.
            let speed_m_s = moved.norm();
            prop_assume!(speed_m_s < 1e3);
            prop_assert!((motion.radius_rate_m_s - rate_m_s).abs() < 1e-3, "{motion:?} {rate_m_s}");
            prop_assert!((motion.centre_velocity.vector() - moved).norm() < 1e-2 * (1.0 + speed_m_s), "{motion:?} {moved}");
        }
    }
}
