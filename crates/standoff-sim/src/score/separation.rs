//! How far apart UAVs are, from one another and from intruders, and for how long they keep away from one another.

use std::collections::BTreeSet;

use standoff::{Aircraft, Position, SeparationParams, UavId};

use crate::frame::{Frame, IntruderRow, UavRow};
use crate::geometry::at;

/// All UAVs so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Separations {
    pub(super) min_m: Option<f64>,
    pub(super) min_layer_m: Option<f64>,
    /// Times that two, of which one is a UAV, came nearer than both minima.
    pub(super) violations: u64,
    /// Instants of UAVs that keep away from another one.
    pub(super) avoiding: u64,
    /// Two or more have flown, one of them a UAV.
    pub(super) has_pairs: bool,
    /// Pairs that are too near now.
    near: BTreeSet<(u32, Aircraft)>,
}

impl Separations {
    /// Takes in the next frame.
    pub(super) fn frame(&mut self, minima: &SeparationParams, frame: &Frame) {
        let avoids = |uav: &&UavRow| uav.avoids.is_some() || uav.avoids_intruder.is_some();
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

    /// Takes in how far apart two are.
    fn pair(&mut self, minima: &SeparationParams, pair: (u32, Aircraft), distance_m: f64, is_one_layer: bool) {
        self.has_pairs = true;
        take_least(&mut self.min_m, distance_m);
        if is_one_layer {
            take_least(&mut self.min_layer_m, distance_m);
        }
        if !(is_one_layer && distance_m < minima.minimum_m) {
            self.near.remove(&pair);
        } else if self.near.insert(pair) {
            self.violations += 1;
        }
    }
}

/// Two are nearer in height than they may be; where altitudes are not flown, they are asked for one altitude. Those of which
/// nobody knows share one.
fn shares_altitude(minima: &SeparationParams, uav: &UavRow, other: &UavRow) -> bool {
    match (uav.flown_altitude_m.zip(other.flown_altitude_m), uav.altitude_m.zip(other.altitude_m)) {
        (Some((one_m, other_m)), _) => (one_m - other_m).abs() < minima.vertical_m,
        (None, Some((one_m, other_m))) => one_m == other_m,
        (None, None) => true,
    }
}

/// The same of a UAV and an intruder, whose altitude is flown or not known.
fn shares_altitude_with_intruder(minima: &SeparationParams, uav: &UavRow, intruder: &IntruderRow) -> bool {
    let both_m = uav.flown_altitude_m.zip(intruder.altitude_m);
    both_m.is_none_or(|(one_m, other_m)| (one_m - other_m).abs() < minima.vertical_m)
}

/// Keeps the smaller one.
pub(super) fn take_least(least: &mut Option<f64>, value: f64) {
    *least = Some(least.map_or(value, |least| least.min(value)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::fixtures::uav_row;

    /// Two UAVs at these distances and differences of height, one instant each.
    fn flown(instants: &[(f64, Option<f64>)]) -> Separations {
        let mut separations = Separations::default();
        for (x_m, up_m) in instants {
            let height = |up_m: f64| up_m.is_finite().then_some(300.0 + up_m);
            let rows = [(0, 0.0, 0.0), (1, *x_m, up_m.unwrap_or_default())].map(|(uav, x_m, up)| UavRow {
                x_m,
                flown_altitude_m: up_m.and(height(up)),
                ..uav_row(uav)
            });
            separations.frame(&SeparationParams::default(), &Frame { uavs: rows.to_vec(), ..Frame::default() });
        }
        separations
    }

    /// 49 m apart twice, at 29 m of height and at none, with 51 m or 30 m of height between: two times that both minima
    /// are broken. Who is near for longer has come near once.
    #[test]
    fn two_are_too_near_only_if_they_are_in_both_ways() {
        let near = [(49.0, Some(29.0)), (48.0, Some(0.0)), (49.0, Some(30.0)), (51.0, Some(0.0)), (49.9, Some(0.0))];
        let separations = flown(&near);
        assert_eq!((separations.violations, separations.min_m, separations.min_layer_m), (2, Some(48.0), Some(48.0)));
        let apart = flown(&[(0.0, Some(30.0)), (50.0, Some(0.0)), (70.0, Some(29.9))]);
        assert_eq!((apart.violations, apart.min_m, apart.min_layer_m), (0, Some(0.0), Some(50.0)));
        // Of whose altitude nobody knows, it is taken to be the same.
        assert_eq!(flown(&[(49.0, None)]).violations, 1);
        assert!(!flown(&[]).has_pairs);
    }

    /// One UAV, and an intruder at 49 m: once at 29 m of height, once at 30 m.
    #[test]
    fn an_intruder_counts_as_another_uav_does() {
        let mut separations = Separations::default();
        for altitude_m in [329.0, 330.0] {
            let uavs = vec![UavRow { x_m: 0.0, y_m: 0.0, flown_altitude_m: Some(300.0), ..uav_row(0) }];
            let intruder = IntruderRow {
                intruder: 0,
                x_m: 49.0,
                y_m: 0.0,
                heading_rad: 0.0,
                speed_m_s: 40.0,
                altitude_m: Some(altitude_m),
                told: false,
            };
            let frame = Frame { uavs, intruders: vec![intruder], ..Frame::default() };
            separations.frame(&SeparationParams::default(), &frame);
        }
        let Separations { min_m, min_layer_m, violations, has_pairs, .. } = separations;
        assert_eq!((min_m, min_layer_m, violations, has_pairs), (Some(49.0), Some(49.0), 1, true));
    }

    #[test]
    fn who_keeps_away_is_counted_at_every_instant() {
        let mut separations = Separations::default();
        let rows = [Some(1), None, Some(0)].map(|avoids| UavRow { avoids, ..uav_row(0) });
        separations.frame(&SeparationParams::default(), &Frame { uavs: rows.to_vec(), ..Frame::default() });
        assert_eq!(separations.avoiding, 2);
    }
}
