//! The orbit that a set of targets would require.

use crate::coordination::memberships::Known;
use crate::coordination::spread::margin_m;
use crate::coordination::wanted_centre::WantedCentre;
use crate::estimation::group_centre::{mean_position_covariance, relative_covariance};
use crate::frame::Position;
use crate::guidance::heading::Orbit;
use crate::guidance::standoff_distance::{Ramp, StandoffDistance};
use crate::target::TargetState;
use crate::team::GroupParams;

/// The orbit that a set of targets would require, about their centroid itself or the centre of the smallest circle about
/// them. With the printed margin (16) none is taken: it jumps with every change of members.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RequiredOrbit {
    members: u32,
    centre: TargetState,
    /// The place of the target furthest from the centre.
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
        let wanted = WantedCentre::of(params.centre, known, places.clone())?;
        let (centre, members) = (wanted.state, wanted.members);
        let furthest = wanted.furthest(known, places.clone())?;
        let relative_m2 = || {
            let centroid_m2 = mean_position_covariance(places.map(estimate), members);
            relative_covariance(estimate(furthest), &centroid_m2, members)
        };
        let margin_m = margin_m(params.margin, 0.0, relative_m2, known[furthest].position() - centre.position());
        let spread = wanted.spread(&estimate(furthest).state, &centre);
        let standoff = params.standoff.distance(spread, margin_m);
        Some(Self { members, centre, furthest, standoff })
    }

    /// Its centre.
    pub(crate) fn centre(&self) -> Position {
        self.centre.position()
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
        Orbit::about(&self.centre, &self.standoff, Ramp::from(&self.standoff))
    }
}
