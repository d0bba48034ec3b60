//! Spread of a group: the distance of its members from the centre, and the margin for the furthest member.

use nalgebra::Matrix2;

use crate::coordination::memberships::GroupedTrack;
use crate::frame::{Displacement, Position};
use crate::params::{GroupingParams, Margin, SensorParams};

/// Margin d_m: as published (16), interpreted as metres, or in metres from the covariance of the furthest member's
/// position relative to the centroid, m2.
///
/// Implements Eq. (16).
pub(crate) fn margin_m(
    params: &GroupingParams,
    innovation_distance: f64,
    relative_m2: impl FnOnce() -> Matrix2<f64>,
    furthest_rel_centre: Displacement,
) -> f64 {
    match params.margin {
        Margin::Mahalanobis => innovation_distance,
        Margin::StandardDeviations => {
            let distance_m = furthest_rel_centre.length_m();
            if distance_m <= 0.0 || params.margin_sds <= 0.0 {
                return 0.0;
            }
            let towards = furthest_rel_centre.vector() / distance_m;
            let variance = towards.dot(&(relative_m2() * towards));
            params.margin_sds * variance.max(0.0).sqrt()
        }
    }
}

impl GroupingParams {
    /// True if the margin depends on the covariances of the members.
    pub(crate) fn margin_takes_covariance(&self) -> bool {
        self.margin == Margin::StandardDeviations && self.margin_sds > 0.0
    }

    /// Maximum distance from the centre, without margin, of a target that a group can readmit, m.
    pub(crate) fn reach_m(&self, sensor: &SensorParams) -> f64 {
        self.readmission_radius_fraction * self.standoff.radius_max_m / self.standoff.radius_per_spread(sensor)
    }
}

/// Index of the target furthest from a centre; the last of equally far ones.
///
/// Distances that differ only by rounding count as equal: the two members of a pair are equally far from their
/// centroid, and the direction of their line must not decide between them.
pub(crate) fn furthest_from(
    centre: Position,
    known: &[GroupedTrack],
    places: impl Iterator<Item = usize>,
) -> Option<usize> {
    let squared = places.map(|index| (known[index].position().squared_distance_m2(centre), index));
    let furthest = squared.reduce(|(most_m2, furthest), (squared_m2, index)| {
        let is_as_far = squared_m2 >= most_m2 * (1.0 - 1e-9);
        (most_m2.max(squared_m2), if is_as_far { index } else { furthest })
    });
    furthest.map(|(_, index)| index)
}
