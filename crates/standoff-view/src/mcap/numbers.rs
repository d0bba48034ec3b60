//! Numbers to plot: of each UAV and each group, with units in their names. What does not exist is left out.

#![expect(clippy::disallowed_types, reason = "derived code only asks a HashSet what is in it")]

use foxglove::Encode;
use standoff_sim::geometry::tracking_error_m;
use standoff_sim::record::{GroupRow, UavRow};

/// Defines a message, each field beside what is in it. Types go in brackets, as tokens: `Encode` looks for the word Option.
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
    /// A UAV and how it follows its orbit: the fields are those of [`UavRow`], and three that are worked out. `served` is
    /// the group that it serves.
    UavState(row: &UavRow, served: Option<&GroupRow>, angle_rad: Option<f64>) {
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
        line_of_sight_rad: [Option<f64>] = angle_rad,
        centre_distance_m: [Option<f64>] = row.centre_distance_m,
        steered_distance_m: [Option<f64>] = row.steered_distance_m,
        standoff_distance_m: [Option<f64>] = served.map(|group| group.standoff_distance_m),
        standoff_tracking_error_m: [Option<f64>] = served.map(|group| tracking_error_m(row, group)),
        phase_rad: [Option<f64>] = row.phase_rad,
        feedforward_rad_s: [Option<f64>] = row.feedforward_rad_s,
        convergence_threshold_m2_s: [Option<f64>] = row.convergence_threshold_m2_s,
        centre_too_fast: [bool] = row.centre_too_fast,
        altitude_m: [Option<f64>] = row.altitude_m,
        flown_altitude_m: [Option<f64>] = row.flown_altitude_m,
        climb_rate_m_s: [Option<f64>] = row.climb_rate_m_s,
        avoids: [Option<u32>] = row.avoids,
        foretold_m: [Option<f64>] = row.foretold_m,
        border: [Option<u32>] = row.border,
    }
}

message! {
    /// A group and its orbit; the fields are those of [`GroupRow`].
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
        separation_m: [Option<f64>] = row.separation_m,
    }
}
