//! Room within keep-in zones: whether a UAV can circle in what they all allow.
//!
//! The largest free circle is found by dividing squares, as in M. Garcia-Castellanos and U. Lombardo, *Poles of
//! Inaccessibility*, Scottish Geographical Journal 123(3), 2007: the distance to the edge grows by at most the distance
//! from the middle of a square.

use crate::enclosing_circle::EnclosingCircle;
use crate::frame::Displacement;
use crate::safety::geofence::{Geofence, ZoneKind};

/// Maximum number of squares that are examined. Beyond it, a geofence counts as large enough.
const SQUARES_MAX: usize = 50_000;

/// Accuracy of the radius that is found, as a fraction of the required one.
const ACCURACY: f64 = 0.005;

impl Geofence {
    /// Returns the radius of the largest circle that no zone forbids, m, if it is smaller than `required_m`; negative if
    /// no position is inside all keep-in zones. `None` if there is enough room, or no keep-in zone.
    ///
    /// Keep-out zones count if they have all altitudes and are so large that a UAV cannot circle about them.
    pub(crate) fn lacking_room_m(&self, required_m: f64) -> Option<f64> {
        let geofence = self.only(|zone| match zone.kind {
            ZoneKind::KeepIn => true,
            ZoneKind::KeepOut => {
                let is_unlimited = zone.altitude_min_m.is_none() && zone.altitude_max_m.is_none();
                let circle = EnclosingCircle::of(zone.vertices.iter().copied());
                is_unlimited && circle.is_some_and(|circle| circle.radius_m >= required_m)
            }
        });
        let [low, high] = self.keep_in_box()?;
        let diagonal = high - low;
        let half_m = 0.5 * diagonal.x_m().max(diagonal.y_m());
        let middle = low + Displacement::from_m(0.5 * diagonal.x_m(), 0.5 * diagonal.y_m());
        let mut largest_m = geofence.room_at_m(middle);
        let mut squares = vec![(middle, half_m, largest_m)];
        let mut examined = 0;
        while let Some((middle, half_m, room_m)) = squares.pop() {
            if largest_m >= required_m || examined > SQUARES_MAX {
                return None;
            }
            let most_m = room_m + half_m * core::f64::consts::SQRT_2;
            if most_m < required_m && most_m <= largest_m + ACCURACY * required_m {
                continue;
            }
            for (east, north) in [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)] {
                let middle = middle + Displacement::from_m(east * half_m, north * half_m);
                let room_m = geofence.room_at_m(middle);
                largest_m = largest_m.max(room_m);
                squares.push((middle, 0.5 * half_m, room_m));
            }
            examined += 4;
        }
        (largest_m < required_m).then_some(largest_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Position;
    use crate::math;
    use crate::safety::geofence::Zone;

    fn at(x_m: f64, y_m: f64) -> Position {
        Position::from_m(x_m, y_m)
    }

    fn rectangle(kind: ZoneKind, [west, south, east, north]: [f64; 4]) -> Zone {
        let vertices = vec![at(west, south), at(east, south), at(east, north), at(west, north)];
        Zone { kind, vertices, ..Zone::default() }
    }

    fn lacking_m(zones: &[Zone]) -> Option<f64> {
        Geofence::new(zones.to_vec()).unwrap().lacking_room_m(100.0)
    }

    const KEEP_IN: ZoneKind = ZoneKind::KeepIn;

    #[test]
    fn a_circle_fits_between_parallel_outlines_exactly_from_its_diameter_on() {
        for turned_rad in [0.0, 0.4, 0.8] {
            let (sin, cos) = math::sin_cos(turned_rad);
            let corridor = |width_m: f64| {
                let mut zone = rectangle(KEEP_IN, [-3000.0, 0.0, 5000.0, width_m]);
                for vertex in &mut zone.vertices {
                    *vertex = at(vertex.x_m() * cos - vertex.y_m() * sin, vertex.x_m() * sin + vertex.y_m() * cos);
                }
                lacking_m(&[zone])
            };
            assert_eq!(corridor(202.0), None);
            let found_m = corridor(190.0).unwrap();
            assert!((94.0..95.01).contains(&found_m), "{found_m}");
        }
    }

    #[test]
    fn only_the_intersection_of_keep_in_zones_has_room() {
        let (one, other) = ([0.0, 0.0, 1000.0, 1000.0], [1500.0, 0.0, 3000.0, 1000.0]);
        let both = |other| lacking_m(&[one, other].map(|of| rectangle(KEEP_IN, of)));
        assert!(both(other).unwrap() < 0.0);
        assert!((48.0..=50.0).contains(&both([900.0, 0.0, 3000.0, 1000.0]).unwrap()));
        assert_eq!(both([700.0, 0.0, 3000.0, 1000.0]), None);
        // Zones whose boxes meet, but not the zones.
        let triangle = |corner: f64, size: f64| Zone {
            kind: KEEP_IN,
            vertices: vec![at(corner, corner), at(corner + size, corner), at(corner, corner + size)],
            ..Zone::default()
        };
        assert!(lacking_m(&[triangle(0.0, 1000.0), triangle(900.0, -200.0)]).unwrap() < 0.0);
        // The same two rectangles as parts of one zone: each has room.
        let part = Zone { part_of: Some(0), ..rectangle(KEEP_IN, other) };
        assert_eq!(lacking_m(&[rectangle(KEEP_IN, one), part]), None);
    }

    #[test]
    fn large_keep_out_zones_take_room_and_small_ones_are_circled_about() {
        let area = rectangle(KEEP_IN, [0.0, 0.0, 600.0, 600.0]);
        let with = |keep_out| lacking_m(&[area.clone(), keep_out]);
        assert!(with(rectangle(ZoneKind::KeepOut, [150.0, 150.0, 450.0, 450.0])).unwrap() < 100.0);
        assert_eq!(with(rectangle(ZoneKind::KeepOut, [290.0, 290.0, 310.0, 310.0])), None);
        let low = Zone { altitude_max_m: Some(100.0), ..rectangle(ZoneKind::KeepOut, [150.0, 150.0, 450.0, 450.0]) };
        assert_eq!(with(low), None);
        assert_eq!(lacking_m(&[rectangle(ZoneKind::KeepOut, [0.0, 0.0, 1.0, 1.0])]), None);
    }
}
