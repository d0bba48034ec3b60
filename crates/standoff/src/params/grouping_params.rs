//! Parameters of the groups and of the assignment of UAVs to them.

use crate::guidance::orbit_motion::MotionParams;
use crate::guidance::standoff_distance::StandoffParams;
use crate::sensor::SensorParams;
use crate::validation::{Allowed, ParamError, errors_of};

/// Objective that the assignment maximises.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Objective {
    /// Sum over groups and their targets of the logarithm of the determinant of the target's information.
    #[default]
    LogDet,
    /// Determinant of the sum of all information, Eq. (32) as published; for up to
    /// [`PAPER_OBJECTIVE_UAVS_MAX`](crate::coordination::assignment::PAPER_OBJECTIVE_UAVS_MAX) UAVs and groups.
    Paper,
}

/// Margin that is added to the spread before the standoff distance is computed (16).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Margin {
    /// Eq. (16) as published: a squared Mahalanobis distance, dimensionless, added to metres.
    Mahalanobis,
    /// Number of standard deviations of the furthest member's position relative to the centre, along the line between
    /// them, from the fused covariances of the members; the margin is in metres. 1.645 is the one-sided 95 % quantile.
    StandardDeviations(f64),
}

impl Margin {
    /// True if the margin depends on the covariances of the members.
    pub(crate) fn takes_covariance(self) -> bool {
        matches!(self, Self::StandardDeviations(sds) if sds > 0.0)
    }
}

/// How the centre of a group is estimated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum CentreEstimate {
    /// A separate filter follows the centroid of the members' estimates (section II.C). It filters values that are
    /// filtered already.
    #[default]
    Filtered,
    /// Centroid of the members' estimates, positions and velocities.
    Centroid,
    /// Centre of the minimum enclosing circle of the members' estimated positions: no orbit that contains them all is
    /// smaller.
    EnclosingCircle,
}

/// Which member a group removes if its orbit cannot contain all members.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum RemovalRule {
    /// The member furthest from the centre (section IV.B.2).
    #[default]
    FurthestFromCentre,
    /// The member whose removal makes the orbit smallest, out of the furthest member and those on the minimum enclosing
    /// circle. If it makes no difference, the furthest.
    LargestRadiusReduction,
}

/// Where the UAVs of a group point their sensors.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Pointing {
    /// The centre of the group.
    #[default]
    GroupCentre,
    /// The middle of the angular extent of the members as the UAV sees them, which minimises the largest off-boresight
    /// angle. Targets in handoff to the group count as soon as all members fit into the field of view. A UAV among the
    /// members points at the centre.
    AngularMidpoint,
}

/// How the centre reacts when the members of a group change and the centroid jumps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum CentreJump {
    /// The centre is shifted by the jump, which is known exactly.
    #[default]
    ShiftState,
    /// The filter treats the jump as an innovation, as in the paper.
    Innovation,
}

/// Number of groups that a team forms.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum GroupCount {
    /// Half the number of UAVs (Algorithm 1), independent of the targets.
    #[default]
    HalfOfUavs,
    /// As many as the targets need: one UAV is enough for a group, and no more groups are created than necessary.
    AsNeeded,
}

/// Which UAVs share an altitude.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AltitudePolicy {
    /// Each group has its own altitude: the lowest free one at the group's creation, for its lifetime. With a lossy
    /// link, agents may not know the same groups; the policy then works like `PerUav`.
    #[default]
    PerGroup,
    /// Each UAV has its own altitude, given by its id, independent of its assignment.
    PerUav,
    /// All UAVs fly at the lowest altitude.
    Common,
}

/// Parameters of groups.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupingParams {
    /// Bounds of the orbit radius, and the margin of the field of view.
    pub standoff: StandoffParams,
    /// Rule for the number of groups.
    pub count: GroupCount,
    /// True if UAVs that no group needs search for lost targets.
    pub search_lost_targets: bool,
    /// Margin d_m.
    #[doc(alias = "d_m")]
    pub margin: Margin,
    /// How the centre is estimated.
    pub centre: CentreEstimate,
    /// Where the UAVs of a group point their sensors.
    pub pointing: Pointing,
    /// Which member is removed if an orbit cannot contain all.
    pub removal: RemovalRule,
    /// Time constant with which the commanded radius follows r_d, s; at least 0. With 0, as in the paper, it follows
    /// immediately.
    pub radius_time_constant_s: f64,
    /// Limits on the motion of centre and radius.
    pub motion: MotionParams,
    /// How the centre reacts to a change of members.
    pub centre_jump: CentreJump,
    /// A target outside is readmitted if the orbit that includes it needs at most this fraction of the largest radius;
    /// above 0, at most 1.
    pub readmission_radius_fraction: f64,
    /// Limit xi_d of the removal by convergence, m2/s; above 0. A group whose UAVs all have xi_th below -xi_d removes
    /// its furthest target.
    #[doc(alias = "xi_d")]
    pub divergence_limit_m2_s: f64,
    /// Minimum duration of xi_th below -xi_d before a removal, s; at least 0.
    pub divergence_time_s: f64,
    /// Minimum difference of distance for a handoff, m; at least 0: a target is handed off if another group's centroid
    /// is nearer by more than this. The paper has no such margin.
    pub handoff_margin_m: f64,
    /// Minimum dwell time T_hd of a handoff, s; at least 0.
    pub dwell_min_s: f64,
    /// Maximum dwell time, s; at least `dwell_min_s`. 0 disables the dwell.
    pub dwell_max_s: f64,
    /// Period of the check whether a group's UAVs could cover more targets by forming another group, s; at least 0. 0
    /// disables the check, as in the paper.
    pub regrouping_period_s: f64,
    /// Maximum time in which a UAV must be able to bring a target within sensing range to be sent to it, s; at least 0.
    pub assignment_reach_s: f64,
    /// Objective of the assignment of UAVs to groups.
    pub objective: Objective,
    /// Switching cost of a UAV under the default objective, in ln det per target of its current group; at least 0. UAVs
    /// in flight are reassigned only for a larger gain. For comparison, a UAV twice as far away contributes 1.4 less.
    pub assignment_switching_cost: f64,
    /// Altitude of the lowest orbit above the plane, m; 1 to 20,000.
    pub altitude_lowest_m: f64,
    /// Step between altitudes, m; 1 to 20,000.
    pub altitude_step_m: f64,
    /// Which UAVs share an altitude.
    pub altitude_policy: AltitudePolicy,
    /// Distance below which two UAVs of a group raise a proximity alert, m; at least 0.
    pub proximity_alert_m: f64,
}

impl GroupingParams {
    /// Returns every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = errors_of([("standoff", self.standoff.errors()), ("motion", self.motion.errors())]);
        if self.centre == CentreEstimate::Filtered && self.motion.time_constant_s > 0.0 {
            Allowed::exactly(0.0)
                .with_reason(
                    "a filtered centre has its own motion model; to use this one, choose the centroid or the enclosing circle",
                )
                .check("motion.time_constant_s", self.motion.time_constant_s, &mut errors);
        }
        if let Margin::StandardDeviations(sds) = self.margin {
            Allowed::at_least(0.0).at_most(100.0).check("margin_sds", sds, &mut errors);
        }
        let fraction = Allowed::above(0.0).at_most(1.0);
        fraction.check("readmission_radius_fraction", self.readmission_radius_fraction, &mut errors);
        Allowed::above(0.0).at_most(1e9).check("divergence_limit_m2_s", self.divergence_limit_m2_s, &mut errors);
        Allowed::at_least(0.0).at_most(1e5).check("handoff_margin_m", self.handoff_margin_m, &mut errors);
        let seconds = Allowed::at_least(0.0).at_most(3600.0);
        seconds.check("divergence_time_s", self.divergence_time_s, &mut errors);
        seconds.check("dwell_min_s", self.dwell_min_s, &mut errors);
        Allowed::at_least(self.dwell_min_s).at_most(3600.0).with_reason("not shorter than dwell_min_s").check(
            "dwell_max_s",
            self.dwell_max_s,
            &mut errors,
        );
        seconds.check("radius_time_constant_s", self.radius_time_constant_s, &mut errors);
        seconds.check("regrouping_period_s", self.regrouping_period_s, &mut errors);
        seconds.check("assignment_reach_s", self.assignment_reach_s, &mut errors);
        Allowed::at_least(0.0).at_most(100.0).check(
            "assignment_switching_cost",
            self.assignment_switching_cost,
            &mut errors,
        );
        let altitude = Allowed::at_least(1.0).at_most(2e4);
        altitude.check("altitude_lowest_m", self.altitude_lowest_m, &mut errors);
        altitude.check("altitude_step_m", self.altitude_step_m, &mut errors);
        Allowed::at_least(0.0).at_most(1e4).check("proximity_alert_m", self.proximity_alert_m, &mut errors);
        errors
    }

    /// Maximum distance from the centre, without margin, of a target that a group can readmit, m.
    pub(crate) fn reach_m(&self, sensor: &SensorParams) -> f64 {
        self.readmission_radius_fraction * self.standoff.radius_max_m / self.standoff.radius_per_spread(sensor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::TeamParams;

    /// The filter would continue from the centre that the motion model has moved, so that neither would behave as
    /// documented.
    #[test]
    fn a_filtered_centre_excludes_the_motion_model() {
        let mut params = TeamParams::table_1().group;
        params.motion.time_constant_s = 1.5;
        let messages: Vec<String> = params.errors().iter().map(ToString::to_string).collect();
        assert_eq!(
            messages,
            ["motion.time_constant_s = 1.5: must be exactly 0 (a filtered centre has its own motion \
                 model; to use this one, choose the centroid or the enclosing circle)"]
        );
        for centre in [CentreEstimate::Centroid, CentreEstimate::EnclosingCircle] {
            assert!(GroupingParams { centre, ..params }.errors().is_empty());
        }
        params.motion = MotionParams { time_constant_s: 61.0, ..params.motion };
        assert_eq!(
            GroupingParams { centre: CentreEstimate::Centroid, ..params }.errors()[0].path,
            "motion.time_constant_s"
        );
    }
}
