//! Altitudes: aircraft that are separated by altitude need no other distance, and do not lose it by a climb.

use crate::safety::other_aircraft::{OtherAircraft, altitudes_m};
use crate::safety::separation::{AHEAD_S, CLIMB_CLEAR_MINIMA, CollisionAvoidance};

/// Buffer added to the minimum altitude difference for a UAV that waits for another aircraft to clear its altitude, m.
const SPARE_VERTICAL_M: f64 = 1.0;

impl CollisionAvoidance<'_> {
    /// Returns the altitude to command on the way to a desired altitude, m. The UAV does not climb or descend past a
    /// nearby aircraft that is separated from it by altitude only.
    pub(crate) fn altitude_m(&self, desired_m: f64, others: impl Iterator<Item = OtherAircraft>) -> f64 {
        let Some(own) = self.own.state.vertical else { return desired_m };
        // Altitudes between these two are clear of all nearby aircraft.
        let [mut low_m, mut high_m] = [f64::NEG_INFINITY, f64::INFINITY];
        for other in others {
            let Some((vertical, [other_low_m, other_high_m])) =
                other.motion.state.vertical.zip(other.levels_m(AHEAD_S))
            else {
                continue;
            };
            let clear_m = CLIMB_CLEAR_MINIMA * self.separation.horizontal_min_m
                + 2.0 * self.fallbacks.airframe.uav.speed_max_m_s() * other.age_s;
            let is_clear = self.own.state.position.squared_distance_m2(other.motion.state.position) > clear_m * clear_m;
            let over_m = own.altitude_m - vertical.altitude_m;
            // If the altitudes already overlap, waiting does not help.
            if is_clear || over_m.abs() < self.separation.vertical_min_m {
                continue;
            }
            if over_m > 0.0 {
                low_m = low_m.max(other_high_m + self.separation.vertical_min_m);
            } else {
                high_m = high_m.min(other_low_m - self.separation.vertical_min_m);
            }
        }
        let waiting_m = if desired_m > high_m {
            (high_m - SPARE_VERTICAL_M).max(low_m)
        } else if desired_m < low_m {
            (low_m + SPARE_VERTICAL_M).min(high_m)
        } else {
            return desired_m;
        };
        // The UAV keeps its altitude if it is blocked from both sides, or if it would move away from the desired
        // altitude.
        let is_backwards = (waiting_m - own.altitude_m) * (desired_m - own.altitude_m) <= 0.0;
        if low_m > high_m || is_backwards { own.altitude_m } else { waiting_m }
    }

    /// Lowest and highest altitude that the UAV will have on the way to `altitude_m`, m; `None` if unknown.
    pub(crate) fn levels_m(&self, altitude_m: Option<f64>) -> Option<[f64; 2]> {
        let own = self.own.state.vertical?;
        Some(altitudes_m(own, altitude_m.unwrap_or(own.altitude_m), 2.0))
    }

    /// Returns true if both are separated by altitude for the whole prediction horizon.
    pub(crate) fn is_separated(&self, levels: Option<[f64; 2]>, other_levels: Option<[f64; 2]>) -> bool {
        levels.zip(other_levels).is_some_and(|([low_m, high_m], [other_low_m, other_high_m])| {
            other_low_m - high_m >= self.separation.vertical_min_m
                || low_m - other_high_m >= self.separation.vertical_min_m
        })
    }
}
