//! An unstable view of the internals, for studies, simulators, tests and the Python package. Any release may change it.
//!
//! With the feature `research`, types of the crate root have more public fields and methods: all parameters, contents of
//! messages, intermediate values. The extension point of studies is [`AssignmentLaw`], a custom assignment law of a
//! [`TeamAgent`](crate::TeamAgent).

pub use crate::atmosphere::{GRAVITY_M_S2, density_ratio};
pub use crate::by_group::ByGroup;
pub use crate::coordination::assignment::{Assignment, AssignmentLaw, AvailableUav, CandidateGroup, assign};
pub use crate::coordination::clustering::{KMeans, group_count};
pub use crate::coordination::group_centre::{Centroid, GroupCentre, mahalanobis_squared};
pub use crate::enclosing_circle::EnclosingCircle;
pub use crate::grid::Grid;
pub use crate::guidance::heading::{Orbit, ground_speed_m_s, steer};
pub use crate::guidance::inner_loop::InnerLoopGains;
pub use crate::guidance::orbit_motion::OrbitMotion;
pub use crate::guidance::pair_information::{
    equal_accuracy_range_m, optimal_phase_difference_rad, pair_information_1_m4, pair_information_at_1_m4,
};
pub use crate::guidance::standoff_distance::{Ramp, Spread, StandoffDistance, moving_centre_limit_m, turn_limit_m};
pub use crate::guidance::vector_field::{VectorField, lyapunov_m4, lyapunov_rate_m4_s};
pub use crate::message::{CommitDigest, LogStatus, Manoeuvre, MessageSource, ReceivedRange, SnapshotRequest};
pub use crate::params::{
    AltitudePolicy, CentreEstimate, CentreJump, Feedforward, GroupCount, Integrator, Margin, MotionParams, Objective,
    ParamKind, Pointing, RemovalRule, WindBelief, Word,
};
pub use crate::safety::geofence::{ZONE_ALTITUDE_MAX_M, ZONES_MAX};
pub use crate::safety::motion::Motion;
pub use crate::safety::predicted_trajectory::least_length;
pub use crate::sensor::{FALSE_ALARM_SPEED_MAX_M_S, jacobian, measure};
pub use crate::target::Transition;
pub use crate::tracking::information_filter::{Contribution, InformationFilter};
pub use crate::tracking::scan_model::GATE;
pub use crate::tracking::unlabelled::TentativeTrack;
pub use crate::uav::{AutopilotModel, LimitedCommand};
pub use crate::validation::Allowed;

/// Elementary functions from one portable source, so that results do not depend on the platform or the build.
pub mod math {
    pub use crate::math::{PI, TAU, atan2, atan2_batch, cos, exp, hypot, ln, sin, sin_cos, sin_cos_batch};
}
