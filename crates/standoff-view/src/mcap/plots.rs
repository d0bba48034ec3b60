//! Plot data of each UAV and each group, with units in the field names. Missing values are left out.

#![expect(clippy::disallowed_types, reason = "derived code only tests membership in a HashSet")]

use foxglove::Encode;
use standoff_record::{GroupRow, UavRow};
use standoff_score::geometry::own_estimate_error_m;

/// Defines a message type, each field with its value. Types are given as tokens in brackets, because `Encode` looks for
/// the token `Option`.
macro_rules! message {
    ($(#[$doc:meta])* $name:ident($($of:ident: $type:ty),*) { $($field:ident: [$($kind:tt)+] = $value:expr,)+ }) => {
        $(#[$doc])*
        #[derive(Encode)]
        pub(super) struct $name { $($field: $($kind)+,)+ }

        impl $name {
            pub(super) fn new($($of: $type),*) -> Self {
                Self { $($field: $value,)+ }
            }
        }
    };
}

message! {
    /// State of a UAV: the fields of [`UavRow`] and three derived ones. `assigned`: its group.
    UavState(row: &UavRow, assigned: Option<&GroupRow>, angle_rad: Option<f64>) {
        group: [Option<u32>] = row.group,
        speed_m_s: [f64] = row.speed_m_s,
        speed_command_m_s: [f64] = row.speed_command_m_s,
        turn_rate_rad_s: [f64] = row.turn_rate_rad_s,
        turn_rate_command_rad_s: [f64] = row.turn_rate_command_rad_s,
        speed_limited: [bool] = row.speed_limited,
        turn_rate_limited: [bool] = row.turn_rate_limited,
        heading_rad: [f64] = row.heading_rad,
        desired_heading_rad: [Option<f64>] = row.desired_heading_rad,
        boresight_rad: [Option<f64>] = row.boresight_rad,
        off_boresight_rad: [Option<f64>] = angle_rad,
        centre_distance_m: [Option<f64>] = row.centre_distance_m,
        steered_radius_m: [Option<f64>] = row.steered_radius_m,
        standoff_distance_m: [Option<f64>] = assigned.map(|group| group.standoff_distance_m),
        standoff_error_own_estimate_m: [Option<f64>] = assigned.map(|group| own_estimate_error_m(row, group)),
        phase_rad: [Option<f64>] = row.phase_rad,
        feedforward_rad_s: [Option<f64>] = row.feedforward_rad_s,
        convergence_threshold_m2_s: [Option<f64>] = row.convergence_threshold_m2_s,
        centre_too_fast: [bool] = row.centre_too_fast,
        commanded_altitude_m: [Option<f64>] = row.commanded_altitude_m,
        altitude_m: [Option<f64>] = row.altitude_m,
        climb_rate_m_s: [Option<f64>] = row.climb_rate_m_s,
        avoided_uav: [Option<u32>] = row.avoided_uav,
        predicted_distance_m: [Option<f64>] = row.predicted_distance_m,
        limiting_zone: [Option<u32>] = row.limiting_zone,
    }
}

message! {
    /// State of a group and its orbit: the fields of [`GroupRow`].
    GroupOrbit(row: &GroupRow) {
        members: [u32] = row.members,
        x_m: [f64] = row.x_m,
        y_m: [f64] = row.y_m,
        vx_m_s: [f64] = row.vx_m_s,
        vy_m_s: [f64] = row.vy_m_s,
        spread_m: [f64] = row.spread_m,
        margin_m: [f64] = row.margin_m,
        standoff_unclamped_m: [f64] = row.standoff_unclamped_m,
        standoff_distance_m: [f64] = row.standoff_distance_m,
        standoff_rate_m_s: [f64] = row.standoff_rate_m_s,
        turn_limit_m: [Option<f64>] = row.turn_limit_m,
        feasible: [bool] = row.feasible,
        convergence_threshold_m2_s: [Option<f64>] = row.convergence_threshold_m2_s,
        altitude_m: [f64] = row.altitude_m,
        nearest_groupmate_m: [Option<f64>] = row.nearest_groupmate_m,
    }
}
