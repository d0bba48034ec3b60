//! UAVs on their orbit, and in transit to it.

use crate::by_id::ById;
use crate::mean::Mean;

/// Distance from an orbit at which a UAV has arrived, as a fraction of the radius.
const ARRIVED_FRACTION: f64 = 0.05;

/// Errors of UAVs on their orbit, and the fraction of time that UAVs are in transit. A UAV is in transit from its
/// assignment to a group until it first comes within [`ARRIVED_FRACTION`] of the true orbit.
#[derive(Debug, Clone, Default)]
pub(crate) struct Transit {
    /// Last group of each UAV, and whether it has arrived on the orbit of that group.
    of: ById<(u32, bool)>,
    /// |r - r_d| of the UAVs that have arrived, m.
    pub(crate) on_orbit_m: Mean,
    pub(crate) fraction: Mean,
}

impl Transit {
    /// Adds a UAV of a group at a distance |r - r_d| from an orbit with this radius.
    pub(crate) fn add(&mut self, uav: u32, group: u32, error_m: f64, radius_m: f64) {
        let (last, has_arrived) = self.of.entry(uav, || (group, false));
        *has_arrived = error_m <= ARRIVED_FRACTION * radius_m || (*has_arrived && *last == group);
        *last = group;
        if *has_arrived {
            self.on_orbit_m.add(error_m);
        }
        self.fraction.add(f64::from(!*has_arrived));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The UAV arrives at 12.5 m, stays on its orbit at 30 m, and is in transit to the next one until it is 10 m off.
    #[test]
    fn a_uav_is_in_transit_until_it_first_reaches_the_orbit_of_its_group() {
        let mut transit = Transit::default();
        for (group, error_m) in [(0, 40.0), (0, 12.6), (0, 12.5), (0, 30.0), (1, 30.0), (1, 10.0), (0, 13.0)] {
            transit.add(3, group, error_m, 250.0);
        }
        assert_eq!((transit.on_orbit_m.sum, transit.on_orbit_m.n), (52.5, 3));
        assert_eq!(transit.fraction.value(), Some(4.0 / 7.0));
    }
}
