//! Orbit that a set of targets requires.

use crate::coordination::desired_centre::DesiredCentre;
use crate::coordination::group_centre::{mean_position_covariance, relative_covariance};
use crate::coordination::memberships::GroupedTrack;
use crate::coordination::spread::margin_m;
use crate::frame::Position;
use crate::guidance::heading::Orbit;
use crate::guidance::standoff_distance::{Ramp, StandoffDistance};
use crate::params::{GroupingParams, TeamParams};
use crate::target::TargetState;

/// Orbit that a set of targets requires, around their centroid or the centre of their minimum enclosing circle. It does
/// not use the published margin (16), which jumps with every change of members.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RequiredOrbit {
    members: u32,
    centre: TargetState,
    /// Index of the target furthest from the centre.
    pub(crate) furthest: usize,
    /// Standoff distance and its rate.
    pub(crate) standoff: StandoffDistance,
}

impl RequiredOrbit {
    /// Computes the orbit; `None` without targets.
    pub(crate) fn of(
        known: &[GroupedTrack],
        places: impl Iterator<Item = usize> + Clone,
        team: &TeamParams,
    ) -> Option<Self> {
        let params = &team.group;
        let estimate = |index: usize| known[index].estimate();
        let desired = DesiredCentre::of(params.centre, known, places.clone())?;
        let (centre, members) = (desired.state, desired.members);
        let furthest = desired.furthest(known, places.clone())?;
        let relative_m2 = || {
            let centroid_m2 = mean_position_covariance(places.map(estimate), members);
            relative_covariance(estimate(furthest), &centroid_m2, members)
        };
        let margin_m = margin_m(params, 0.0, relative_m2, known[furthest].position() - centre.position());
        let spread = desired.spread(&estimate(furthest).state, &centre);
        let bounds = team.orbit_bounds(team.turn_limit_about_m(centre.velocity().speed_m_s()));
        let standoff = bounds.distance(spread, margin_m, &team.track.sensor);
        Some(Self { members, centre, furthest, standoff })
    }

    /// Centre of the orbit.
    pub(crate) fn centre(&self) -> Position {
        self.centre.position()
    }

    pub(crate) fn members(&self) -> u32 {
        self.members
    }

    /// True if the radius leaves room for readmission and the UAVs can follow the orbit (half the limit of removal by
    /// convergence).
    pub(crate) fn has_room(&self, params: &GroupingParams) -> bool {
        let growth_m2_s = self.standoff.distance_m * self.standoff.rate_m_s;
        self.standoff.unclamped_m <= params.readmission_radius_fraction * params.standoff.radius_max_m
            && growth_m2_s <= 0.5 * params.divergence_limit_m2_s
    }

    /// Returns the orbit.
    pub(crate) fn orbit(&self) -> Orbit {
        Orbit::about(&self.centre, &self.standoff, Ramp::from(&self.standoff))
    }
}
