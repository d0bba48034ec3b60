//! Options: enums whose variants have words.

use super::value::{ParamValue, Scalar, Word};

words! {
    /// A named law: guidance, orbits, groups and assignment that belong together. It is the default of all other
    /// parameters.
    enum Law {
        /// This project's law: [`TeamParams::recommended`](super::TeamParams::recommended).
        Standoff = "standoff",
        /// The law of H. Oh, S. Kim, H.-S. Shin and A. Tsourdos as published in 2015, with the values of its Table I:
        /// [`TeamParams::paper`](super::TeamParams::paper).
        Oh2015 = "oh-2015",
    }

    /// Method that integrates (1) over a time step.
    enum Integrator {
        /// Exact solution for a constant command.
        Exact = "exact",
        /// One Euler step (4), as published; both lags must be at least the period.
        Euler = "euler",
    }

    /// Margin d_m that is added to the spread before the standoff distance is computed (16).
    enum Margin {
        /// Standard deviations of the furthest member's position relative to the centre, along the line between them,
        /// from the fused covariances of the members; the margin is in metres.
        StandardDeviations = "standard-deviations",
        /// Eq. (16) as published: a squared Mahalanobis distance, dimensionless, added to metres.
        Mahalanobis = "mahalanobis",
    }

    /// How the centre of a group is estimated.
    enum CentreEstimate {
        /// A separate filter follows the centroid of the members' estimates (section II.C). It filters values that are
        /// filtered already.
        Filtered = "filtered",
        /// Centre of the minimum enclosing circle of the members' estimated positions: no orbit that contains them all
        /// is smaller.
        EnclosingCircle = "enclosing-circle",
    }

    /// Where the UAVs of a group point their sensors.
    enum Pointing {
        /// The centre of the group.
        GroupCentre = "group-centre",
        /// The middle of the angular extent of the members as the UAV sees them, which minimises the largest
        /// off-boresight angle. Targets in handoff to the group count as soon as all members fit into the field of
        /// view. A UAV among the members points at the centre.
        AngularMidpoint = "angular-midpoint",
    }

    /// How the centre reacts when the members of a group change and the centroid jumps.
    enum CentreJump {
        /// The centre is shifted by the jump, which is known exactly.
        ShiftState = "shift-state",
        /// The filter treats the jump as an innovation, as in the paper.
        Innovation = "innovation",
    }

    /// Number of groups that a team forms.
    enum GroupCount {
        /// Half the number of UAVs (Algorithm 1), independent of the targets.
        HalfOfUavs = "half-of-uavs",
        /// As many as the targets need: one UAV is enough for a group, and no more groups are created than necessary.
        AsNeeded = "as-needed",
    }

    /// Objective that the assignment maximises (32).
    enum Objective {
        /// Sum over groups and their targets of the logarithm of the determinant of the target's information.
        LogDet = "log-det",
        /// Determinant of the sum of all information, as published; for up to 8 UAVs and groups.
        Paper = "paper",
    }

    /// Which member a group removes if its orbit cannot contain all members.
    enum RemovalRule {
        /// The member furthest from the centre (section IV.B.2).
        FurthestFromCentre = "furthest-from-centre",
        /// The member whose removal makes the orbit smallest, out of the furthest member and those on the minimum
        /// enclosing circle. If it makes no difference, the furthest.
        LargestRadiusReduction = "largest-radius-reduction",
    }

    /// Which UAVs share an altitude.
    enum AltitudePolicy {
        /// Each group has its own altitude: the lowest free one at the group's creation, for its lifetime. With a lossy
        /// link, agents may not know the same groups; the policy then works like `per-uav`.
        PerGroup = "per-group",
        /// Each UAV has its own altitude, given by its id, independent of its assignment.
        PerUav = "per-uav",
        /// All UAVs fly at the lowest altitude.
        Common = "common",
    }

    /// Derivative of the desired heading that the law `oh-2015` uses as feedforward (25).
    enum Feedforward {
        /// Eq. (25) corrected: the exact derivative along the field (13) around a stationary centre.
        StaticCentre = "static-centre",
        /// Eq. (25) as published.
        Paper = "paper",
    }

    /// Source of the wind that a UAV assumes.
    enum WindBelief {
        /// The UAV estimates the wind from its ground velocity and its air velocity; until it has measured both, it
        /// assumes calm air.
        Estimated = "estimated",
        /// The UAV assumes a constant wind: `believed_speed_m_s` and `believed_from_deg`.
        Given = "given",
    }

    /// Orbit direction, seen from above.
    enum OrbitDirection {
        /// As published in (13).
        Anticlockwise = "anticlockwise",
        /// Mirror image of (13).
        Clockwise = "clockwise",
    }
}

/// Link model: what a team expects of its radio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkModel {
    /// Every message arrives. A briefly silent UAV is extrapolated straight ahead, each group has its own altitude, and
    /// the UAVs of one group keep their phase difference.
    Ideal,
    /// Messages get lost, so that safety does not depend on equal team states. A silent UAV is extrapolated along its
    /// last turn. Each UAV has its own altitude, given by its id, and keeps its phase difference from every UAV that it
    /// receives near its orbit.
    Lossy,
}

impl Law {
    /// The law with a word; `None` if there is no such word.
    pub fn named(word: &str) -> Option<Self> {
        let known = Self::WORDS.iter().find(|known| known.word == word)?;
        let mut law = Self::Standoff;
        law.set(ParamValue::Word(known.word)).then_some(law)
    }
}
