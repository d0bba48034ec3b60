//! The orbit that a set of targets would require.

use crate::coordination::memberships::Known;
use crate::coordination::spread::{furthest_from, margin_m, spread_of};
use crate::estimation::group_centre::{mean_position_covariance, mean_state, relative_covariance};
use crate::frame::Position;
use crate::guidance::heading::Orbit;
use crate::guidance::standoff_distance::{Ramp, StandoffDistance};
use crate::target::TargetState;
use crate::team::GroupParams;

/// The orbit that a set of targets would require, by their centroid. With the printed margin (16) none is taken: it jumps
/// with every change of members.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RequiredOrbit {
    members: u32,
    centroid: TargetState,
    /// The place of the target furthest from the centroid.
    pub(crate) furthest: usize,
    /// The standoff distance.
    pub(crate) standoff: StandoffDistance,
}

impl RequiredOrbit {
    /// `None` for no targets.
    pub(crate) fn of(
        known: &[Known],
        places: impl Iterator<Item = usize> + Clone,
        params: &GroupParams,
    ) -> Option<Self> {
        let estimate = |index: usize| known[index].estimate();
        let (centroid, members) = mean_state(places.clone().map(estimate))?;
        let centre = centroid.position();
        let furthest = furthest_from(centre, known, places.clone())?;
        let relative_m2 = || {
            let centroid_m2 = mean_position_covariance(places.map(estimate), members);
            relative_covariance(estimate(furthest), &centroid_m2, members)
        };
        let margin_m = margin_m(params.margin, 0.0, relative_m2, known[furthest].position() - centre);
        let standoff = params.standoff.distance(spread_of(&estimate(furthest).state, &centroid), margin_m);
        Some(Self { members, centroid, furthest, standoff })
    }

    /// The centroid.
    pub(crate) fn centre(&self) -> Position {
        self.centroid.position()
    }

    pub(crate) fn members(&self) -> u32 {
        self.members
    }

    /// The orbit has room to spare, and the UAVs can follow it (half the limit of the discard by convergence).
    pub(crate) fn leaves_room(&self, params: &GroupParams) -> bool {
        let growth_m2_s = self.standoff.distance_m * self.standoff.rate_m_s;
        self.standoff.unclamped_m <= params.take_back_fraction * params.standoff.radius_max_m
            && growth_m2_s <= 0.5 * params.convergence_limit_m2_s
    }

    /// The orbit.
    pub(crate) fn orbit(&self) -> Orbit {
        Orbit::about(&self.centroid, &self.standoff, Ramp::from(&self.standoff))
    }
}
