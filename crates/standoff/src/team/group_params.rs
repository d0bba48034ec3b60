//! Parameters of groups and of who serves them.

use crate::guidance::orbit_motion::MotionParams;
use crate::guidance::standoff_distance::StandoffParams;
use crate::param::{Allowed, ParamError, errors_of};

/// What the assignment maximises.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Objective {
    /// Sum over groups and their targets of the logarithm of the determinant of the target's information.
    #[default]
    LogDet,
    /// Determinant of the sum of all information, Eq. (32) as printed; up to [`PRINTED_MAX`](crate::coordination::assignment::PRINTED_MAX) UAVs and groups.
    Printed,
}

/// What is added to the spread before the standoff distance is taken from it (16).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Margin {
    /// Eq. (16) as printed: a squared Mahalanobis distance, dimensionless, added to metres.
    Mahalanobis,
    /// So many standard deviations of the furthest member's position relative to the centre, along the line between
    /// them, from the members' fused covariances; metres. 1.645 is the one-sided 95 % quantile.
    StandardDeviations(f64),
}

impl Margin {
    /// It depends on how well the members are known.
    pub(crate) fn takes_covariance(self) -> bool {
        matches!(self, Self::StandardDeviations(sds) if sds > 0.0)
    }
}

/// Where a group's centre is taken to be.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum CentreEstimate {
    /// A filter of its own follows the centroid of the members' estimates (section II.C): it filters what is filtered
    /// already.
    #[default]
    Filtered,
    /// The centroid of the members' estimates itself, positions and velocities.
    Centroid,
    /// The centre of the smallest circle about the members' estimated positions: no orbit that holds them all is smaller.
    SmallestCircle,
}

/// Whom a group lets go of whose orbit cannot hold all.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Discard {
    /// The member furthest from the centre (section IV.B.2).
    #[default]
    Furthest,
    /// The one without whom the orbit is smallest: of the furthest and those that hold the smallest circle about the
    /// members. Where it makes no difference, the furthest.
    Widening,
}

/// What the UAVs of a group point their sensors at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Aim {
    /// The group's centre.
    #[default]
    Centre,
    /// The middle of the members' angular extent as the UAV sees them: so the worst of them is least far off the boresight.
    /// Those on their way into the group count once all fit into the field of view. The centre for a UAV among them.
    Middle,
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

/// How many groups a team forms.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum GroupCount {
    /// Half as many as UAVs (Algorithm 1), whatever the targets are like.
    #[default]
    Half,
    /// As many as the targets need: one UAV is enough for a group, and there are no more groups than it takes.
    Needed,
}

/// What UAVs do that no group needs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Search {
    /// They watch with the others of their group.
    #[default]
    None,
    /// They search for lost targets, by where these can be by now.
    Lost,
}

/// Who shares an altitude.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Altitudes {
    /// Each group has its own: the lowest that is free when it is founded, for as long as there is the group. Where the radio
    /// may fail, not all know of the same groups: then as `ByUav`.
    #[default]
    ByGroup,
    /// Each UAV has its own, by its id, whatever it serves.
    ByUav,
    /// All fly at the lowest.
    One,
}

/// Parameters of groups.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupParams {
    /// Bounds of the orbit.
    pub standoff: StandoffParams,
    /// How many groups there are.
    pub count: GroupCount,
    /// What UAVs do that no group needs.
    pub search: Search,
    /// Margin d_m.
    #[doc(alias = "d_m")]
    pub margin: Margin,
    /// Where the centre is.
    pub centre: CentreEstimate,
    /// Where its UAVs look.
    pub aim: Aim,
    /// Who goes where an orbit cannot hold all.
    pub discard: Discard,
    /// Time constant with which the radius steered for follows r_d, s; at least 0; 0, as in the paper: at once.
    pub smoothing_s: f64,
    /// How quick centre and radius may be.
    pub motion: MotionParams,
    /// What a change of members does to the centre.
    pub on_membership_change: OnMembershipChange,
    /// A target outside is taken in when the orbit with it needs at most this fraction of the largest radius; above 0,
    /// at most 1.
    pub take_back_fraction: f64,
    /// Limit xi_d of the discard by convergence, m2/s: a group whose UAVs' xi_th all stay below -xi_d loses its furthest
    /// target; above 0.
    #[doc(alias = "xi_d")]
    pub convergence_limit_m2_s: f64,
    /// For how long they must stay below it, s; at least 0.
    pub convergence_patience_s: f64,
    /// A target is handed over when another group's centroid is nearer by more than this, m; at least 0. The paper has
    /// none.
    pub handoff_margin_m: f64,
    /// Shortest dwell T_hd of a handoff, s; at least 0.
    pub dwell_min_s: f64,
    /// Longest dwell, s; at least `dwell_min_s`; 0 switches the dwell off.
    pub dwell_max_s: f64,
    /// So often it is asked whether a group's UAVs could watch more targets by forming another, s; at least 0; 0
    /// switches it off, as in the paper.
    pub review_period_s: f64,
    /// UAVs are not sent to targets that they cannot have within sensing range after this time, s; at least 0.
    pub reach_ahead_s: f64,
    /// What the assignment of UAVs to groups maximises.
    pub objective: Objective,
    /// What staying where it is counts for a UAV under the default objective, in ln det per target of its group: nobody
    /// is moved in flight for less; at least 0. A UAV twice as far away tells 1.4 less.
    pub assignment_inertia: f64,
    /// Altitude of the lowest orbit above the plane, m; 1 to 20,000.
    pub altitude_lowest_m: f64,
    /// From one altitude to the next, m; 1 to 20,000.
    pub altitude_step_m: f64,
    /// Who shares an altitude.
    pub altitudes: Altitudes,
    /// Two UAVs of a group closer than this are reported, m; at least 0.
    pub separation_alarm_m: f64,
}

impl GroupParams {
    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = errors_of([("standoff", self.standoff.errors()), ("motion", self.motion.errors())]);
        if self.centre == CentreEstimate::Filtered && self.motion.response_s > 0.0 {
            Allowed::exactly(0.0)
                .because(
                    "a filtered centre has its own motion; with another, centre is the centroid or the smallest circle",
                )
                .check("motion.response_s", self.motion.response_s, &mut errors);
        }
        if let Margin::StandardDeviations(sds) = self.margin {
            Allowed::at_least(0.0).at_most(100.0).check("margin_sds", sds, &mut errors);
        }
        let fraction = Allowed::above(0.0).at_most(1.0);
        fraction.check("take_back_fraction", self.take_back_fraction, &mut errors);
        Allowed::above(0.0).at_most(1e9).check("convergence_limit_m2_s", self.convergence_limit_m2_s, &mut errors);
        Allowed::at_least(0.0).at_most(1e5).check("handoff_margin_m", self.handoff_margin_m, &mut errors);
        let seconds = Allowed::at_least(0.0).at_most(3600.0);
        seconds.check("convergence_patience_s", self.convergence_patience_s, &mut errors);
        seconds.check("dwell_min_s", self.dwell_min_s, &mut errors);
        Allowed::at_least(self.dwell_min_s).at_most(3600.0).because("not shorter than dwell_min_s").check(
            "dwell_max_s",
            self.dwell_max_s,
            &mut errors,
        );
        seconds.check("smoothing_s", self.smoothing_s, &mut errors);
        seconds.check("review_period_s", self.review_period_s, &mut errors);
        seconds.check("reach_ahead_s", self.reach_ahead_s, &mut errors);
        Allowed::at_least(0.0).at_most(100.0).check("assignment_inertia", self.assignment_inertia, &mut errors);
        let altitude = Allowed::at_least(1.0).at_most(2e4);
        altitude.check("altitude_lowest_m", self.altitude_lowest_m, &mut errors);
        altitude.check("altitude_step_m", self.altitude_step_m, &mut errors);
        Allowed::at_least(0.0).at_most(1e4).check("separation_alarm_m", self.separation_alarm_m, &mut errors);
        errors
    }

    /// Largest distance from the centre, without any margin, of a target that a group with room to spare holds, m.
    pub(crate) fn reach_m(&self) -> f64 {
        self.take_back_fraction * self.standoff.radius_max_m / self.standoff.radius_per_spread()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::team::TeamParams;

    /// The filter would carry on from where the motion has put the centre: neither would be what it says.
    #[test]
    fn a_filtered_centre_has_no_other_motion() {
        let mut params = TeamParams::table_1().group;
        params.motion.response_s = 1.5;
        let told: Vec<String> = params.errors().iter().map(ToString::to_string).collect();
        assert_eq!(
            told,
            ["motion.response_s = 1.5: must be exactly 0 (a filtered centre has its own motion; with another, centre \
                 is the centroid or the smallest circle)"]
        );
        for centre in [CentreEstimate::Centroid, CentreEstimate::SmallestCircle] {
            assert!(GroupParams { centre, ..params }.errors().is_empty());
        }
        params.motion = MotionParams { response_s: 61.0, ..params.motion };
        assert_eq!(GroupParams { centre: CentreEstimate::Centroid, ..params }.errors()[0].path, "motion.response_s");
    }
}
