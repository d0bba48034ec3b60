//! Separation of UAVs from each other and from intruders, and time spent on collision avoidance.

use std::collections::BTreeSet;

use standoff::{Aircraft, Position, SeparationParams, UavId};
use standoff_record::{Frame, IntruderRow, UavRow};

use crate::geometry::at;

/// Separation statistics of all UAVs so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Separations {
    pub(crate) min_m: Option<f64>,
    pub(crate) min_same_altitude_m: Option<f64>,
    /// Number of times that a UAV and another aircraft violated both minima.
    pub(crate) violations: u64,
    /// UAV time steps on collision avoidance.
    pub(crate) avoiding: u64,
    /// True if a UAV and at least one other aircraft have flown.
    pub(crate) has_pairs: bool,
    /// Pairs that violate the minima now.
    near: BTreeSet<(u32, Aircraft)>,
}

impl Separations {
    /// Adds the next frame.
    pub(crate) fn frame(&mut self, minima: &SeparationParams, frame: &Frame) {
        let avoids = |uav: &&UavRow| uav.avoided_uav.is_some() || uav.avoided_intruder.is_some();
        self.avoiding += frame.uavs.iter().filter(avoids).count() as u64;
        for (index, uav) in frame.uavs.iter().enumerate() {
            for other in &frame.uavs[index + 1..] {
                let pair = (uav.uav, Aircraft::Uav(UavId(other.uav)));
                self.pair(minima, pair, at(uav).distance_m(at(other)), shares_altitude(minima, uav, other));
            }
            for intruder in &frame.intruders {
                let pair = (uav.uav, Aircraft::Intruder(intruder.intruder));
                let distance_m = at(uav).distance_m(Position::from_m(intruder.x_m, intruder.y_m));
                self.pair(minima, pair, distance_m, shares_altitude_with_intruder(minima, uav, intruder));
            }
        }
    }

    /// Adds the distance of one pair.
    fn pair(&mut self, minima: &SeparationParams, pair: (u32, Aircraft), distance_m: f64, is_one_layer: bool) {
        self.has_pairs = true;
        take_least(&mut self.min_m, distance_m);
        if is_one_layer {
            take_least(&mut self.min_same_altitude_m, distance_m);
        }
        if !(is_one_layer && distance_m < minima.horizontal_min_m) {
            self.near.remove(&pair);
        } else if self.near.insert(pair) {
            self.violations += 1;
        }
    }
}

/// True if the vertical distance is below the minimum or, if altitudes are not simulated, if both commanded altitudes
/// are equal. UAVs without altitudes share one.
fn shares_altitude(minima: &SeparationParams, uav: &UavRow, other: &UavRow) -> bool {
    match (uav.altitude_m.zip(other.altitude_m), uav.commanded_altitude_m.zip(other.commanded_altitude_m)) {
        (Some((one_m, other_m)), _) => (one_m - other_m).abs() < minima.vertical_min_m,
        (None, Some((one_m, other_m))) => one_m == other_m,
        (None, None) => true,
    }
}

/// True if the vertical distance of a UAV and an intruder is below the minimum, or is unknown.
fn shares_altitude_with_intruder(minima: &SeparationParams, uav: &UavRow, intruder: &IntruderRow) -> bool {
    let both_m = uav.altitude_m.zip(intruder.altitude_m);
    both_m.is_none_or(|(one_m, other_m)| (one_m - other_m).abs() < minima.vertical_min_m)
}

/// Replaces `least` by `value` if that is smaller.
pub(crate) fn take_least(least: &mut Option<f64>, value: f64) {
    *least = Some(least.map_or(value, |least| least.min(value)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row_fixtures::uav_row;

    /// Two UAVs with these horizontal distances and differences in altitude, one time step each.
    fn flown(steps: &[(f64, Option<f64>)]) -> Separations {
        let mut separations = Separations::default();
        for (x_m, up_m) in steps {
            let height = |up_m: f64| up_m.is_finite().then_some(300.0 + up_m);
            let rows = [(0, 0.0, 0.0), (1, *x_m, up_m.unwrap_or_default())].map(|(uav, x_m, up)| UavRow {
                x_m,
                altitude_m: up_m.and(height(up)),
                ..uav_row(uav)
            });
            separations.frame(&SeparationParams::default(), &Frame { uavs: rows.to_vec(), ..Frame::default() });
        }
        separations
    }

    /// Two UAVs are closer than 50 m at vertical distances of 29 m and 0 m, and farther apart in one dimension in
    /// between: both minima are violated twice. Consecutive time steps in violation count once.
    #[test]
    fn violation_requires_horizontal_and_vertical_proximity() {
        let near = [(49.0, Some(29.0)), (48.0, Some(0.0)), (49.0, Some(30.0)), (51.0, Some(0.0)), (49.9, Some(0.0))];
        let separations = flown(&near);
        assert_eq!(
            (separations.violations, separations.min_m, separations.min_same_altitude_m),
            (2, Some(48.0), Some(48.0))
        );
        let apart = flown(&[(0.0, Some(30.0)), (50.0, Some(0.0)), (70.0, Some(29.9))]);
        assert_eq!((apart.violations, apart.min_m, apart.min_same_altitude_m), (0, Some(0.0), Some(50.0)));
        // UAVs with unknown altitudes count as being at the same altitude.
        assert_eq!(flown(&[(49.0, None)]).violations, 1);
        assert!(!flown(&[]).has_pairs);
    }

    /// One UAV, and an intruder at a distance of 49 m: 29 m above it, then 30 m above it.
    #[test]
    fn intruders_count_like_uavs() {
        let mut separations = Separations::default();
        for altitude_m in [329.0, 330.0] {
            let uavs = vec![UavRow { altitude_m: Some(300.0), ..uav_row(0) }];
            let intruder = IntruderRow { x_m: 49.0, altitude_m: Some(altitude_m), ..IntruderRow::default() };
            let frame = Frame { uavs, intruders: vec![intruder], ..Frame::default() };
            separations.frame(&SeparationParams::default(), &frame);
        }
        let Separations { min_m, min_same_altitude_m: min_layer_m, violations, has_pairs, .. } = separations;
        assert_eq!((min_m, min_layer_m, violations, has_pairs), (Some(49.0), Some(49.0), 1, true));
    }

    #[test]
    fn avoiding_uavs_are_counted_at_every_time_step() {
        let mut separations = Separations::default();
        let rows = [Some(1), None, Some(0)].map(|avoids| UavRow { avoided_uav: avoids, ..uav_row(0) });
        separations.frame(&SeparationParams::default(), &Frame { uavs: rows.to_vec(), ..Frame::default() });
        assert_eq!(separations.avoiding, 2);
    }
}
