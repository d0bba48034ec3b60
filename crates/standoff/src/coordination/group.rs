//! A group of targets: its estimated centre and the orbit from which all of it is seen.

use nalgebra::Vector6;

use crate::coordination::membership::Known;
use crate::estimation::group_centre::{Centroid, GroupCentre};
use crate::estimation::information_filter::Estimate;
use crate::frame::Position;
use crate::guidance::heading::Orbit;
use crate::guidance::spacing::speed_floor_m_s;
use crate::guidance::standoff_distance::{
    Spread, StandoffDistance, StandoffParams, moving_centre_limit_m, turn_limit_m,
};
use crate::param::{Allowed, ParamError};
use crate::target::{TargetId, TargetState, Transition};
use crate::team::TeamParams;

/// Identifies a group for as long as it lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct GroupId(pub u32);

/// What is added to the spread before the standoff distance is taken from it (16).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Margin {
    /// Eq. (16) as printed: a squared Mahalanobis distance, dimensionless, added to metres.
    Mahalanobis,
    /// So many standard deviations of the furthest member's position relative to the centre, along the line between
    /// them, from the members' fused covariances; metres. 1.645 is the one-sided 95 % quantile.
    StandardDeviations(f64),
}

/// What happens to the centre when a group's members change and the centroid jumps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum OnMembershipChange {
    /// The centre moves by the jump, which is known exactly.
    #[default]
    Shift,
    /// The filter takes the jump for an innovation, as the paper does.
    Filter,
}

/// Parameters of groups.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupParams {
    /// Bounds of the orbit.
    pub standoff: StandoffParams,
    /// Margin d_m.
    #[doc(alias = "d_m")]
    pub margin: Margin,
    /// What a change of members does to the centre.
    pub on_membership_change: OnMembershipChange,
    /// A target outside is taken in when the orbit with it needs at most this fraction of the largest radius; above 0,
    /// at most 1.
    pub take_back_fraction: f64,
}

impl GroupParams {
    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = self.standoff.errors();
        if let Margin::StandardDeviations(sds) = self.margin {
            Allowed::at_least(0.0).at_most(100.0).check("margin_sds", sds, &mut errors);
        }
        let fraction = Allowed::above(0.0).at_most(1.0);
        fraction.check("take_back_fraction", self.take_back_fraction, &mut errors);
        errors
    }
}

/// A group and its orbit at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Group {
    /// Which group.
    pub id: GroupId,
    /// Number of members.
    pub members: u32,
    /// The filtered centre.
    pub centre: GroupCentre,
    /// The member furthest from the centre.
    pub furthest: TargetId,
    /// How far that is.
    pub spread: Spread,
    /// Margin d_m added to it, m.
    pub margin_m: f64,
    /// The standoff distance.
    pub standoff: StandoffDistance,
    /// Smallest radius at which a UAV can turn about this centre, m; infinite if the centre is as fast as a UAV can be.
    pub turn_limit_m: f64,
    /// Smallest radius that field of view, turn rate and r_d,min allow, m; infinite if the centre is as fast.
    pub smallest_m: f64,
    /// Largest radius that r_d,max and the sensing range allow, m.
    pub largest_m: f64,
}

impl Group {
    /// Forms the group of `id` from its members in `known`, carrying the centre on from `previous`; `None` without
    /// members.
    pub(crate) fn form(
        id: GroupId,
        known: &[Known],
        previous: Option<(&Group, &[Known])>,
        transition: &Transition,
        team: &TeamParams,
    ) -> Option<Self> {
        let (params, uav) = (&team.group, &team.uav);
        let members = || known.iter().filter(|target| target.group() == Some(id));
        let centroid = Centroid::of(members().map(|target| target.track.estimate()))?;
        let carried = previous.and_then(|(group, before)| {
            let shift = match params.on_membership_change {
                OnMembershipChange::Shift => membership_shift(id, known, before, &centroid),
                OnMembershipChange::Filter => Vector6::zeros(),
            };
            group.centre.shifted(&shift).advance(transition, &centroid)
        });
        let centre = carried.or_else(|| GroupCentre::start(&centroid))?;

        let at = centre.estimate().state;
        let distance_m = |target: &Known| target.track.estimate().state.position().distance_m(at.position());
        let furthest = members().max_by(|a, b| distance_m(a).total_cmp(&distance_m(b)))?;
        let spread = spread(&furthest.track.estimate().state, &at);
        let margin_m =
            margin_m(params.margin, centre.innovation_distance, &centroid, furthest.track.estimate(), at.position());
        let standoff = params.standoff.distance(spread, margin_m);
        let centre_speed_m_s = at.velocity().speed_m_s();
        let speed_m_s =
            uav.speed_m_s.max(speed_floor_m_s(centre_speed_m_s)).min(uav.speed_m_s + uav.speed_change_max_m_s);
        let turn_limit_m = turn_limit_m(speed_m_s, standoff.rate_m_s, uav.turn_rate_max_rad_s)
            .max(moving_centre_limit_m(speed_m_s, centre_speed_m_s, uav.turn_rate_max_rad_s));
        Some(Self {
            id,
            members: centroid.members,
            centre,
            furthest: furthest.track.target,
            spread,
            margin_m,
            standoff,
            turn_limit_m,
            smallest_m: standoff.unclamped_m.max(params.standoff.radius_min_m).max(turn_limit_m),
            largest_m: params.standoff.radius_max_m.min(team.track.sensor.sensing_range_m - spread.distance_m),
        })
    }

    /// Some orbit satisfies every constraint: turn rate, field of view, radius bounds, sensing range.
    pub fn is_feasible(&self) -> bool {
        self.smallest_m <= self.largest_m
    }

    /// The orbit about this group.
    pub fn orbit(&self, params: &StandoffParams) -> Orbit {
        let centre = self.centre.estimate().state;
        Orbit {
            centre: centre.position(),
            centre_velocity: centre.velocity(),
            distance_m: self.standoff.distance_m,
            rate_m_s: self.standoff.rate_m_s,
            bounds_m: (params.radius_min_m, params.radius_max_m),
        }
    }
}

/// What the change of members alone moved the centroid, all else as it is now.
fn membership_shift(id: GroupId, known: &[Known], before: &[Known], centroid: &Centroid) -> Vector6<f64> {
    let was_member = |target: &Known| {
        let index = before.binary_search_by_key(&target.track.target, |old| old.track.target);
        index.is_ok_and(|index| before[index].group() == Some(id))
    };
    if known.iter().all(|target| was_member(target) == (target.group() == Some(id))) {
        return Vector6::zeros();
    }
    let old_members = known.iter().filter(|target| was_member(target)).map(|target| target.track.estimate());
    Centroid::of(old_members).map_or(Vector6::zeros(), |old| centroid.mean.state.0 - old.mean.state.0)
}

fn spread(furthest: &TargetState, centre: &TargetState) -> Spread {
    let member_rel_centre = (furthest.position() - centre.position()).vector();
    let velocity_rel_centre = (furthest.velocity() - centre.velocity()).vector();
    let distance_m = (furthest.position() - centre.position()).length_m();
    let rate_m_s = if distance_m > 0.0 { member_rel_centre.dot(&velocity_rel_centre) / distance_m } else { 0.0 };
    Spread { distance_m, rate_m_s }
}

/// The margin d_m: printed (16), taken as if in metres, or metres from the fused covariances.
///
/// Implements Eq. (16).
pub(crate) fn margin_m(
    margin: Margin,
    innovation_distance: f64,
    centroid: &Centroid,
    furthest: &Estimate,
    centre: Position,
) -> f64 {
    match margin {
        Margin::Mahalanobis => innovation_distance,
        Margin::StandardDeviations(sds) => {
            let member_rel_centre = furthest.state.position() - centre;
            let distance_m = member_rel_centre.length_m();
            if distance_m <= 0.0 {
                return 0.0;
            }
            let towards = member_rel_centre.vector() / distance_m;
            let variance = towards.dot(&(centroid.relative_covariance(furthest) * towards));
            sds * variance.max(0.0).sqrt()
        }
    }
}
