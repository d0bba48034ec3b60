//! Numbers to plot: of each UAV and each group, with units in their names. What does not exist is left out.

#![expect(clippy::disallowed_types, reason = "derived code only asks a HashSet what is in it")]

use foxglove::Encode;
use standoff_sim::geometry::tracking_error_m;
use standoff_sim::record::{GroupRow, UavRow};

/// A UAV and how it follows its orbit; the fields are those of [`UavRow`], and three more.
#[derive(Encode)]
pub(super) struct UavState {
    group: Option<u32>,
    speed_m_s: f64,
    speed_command_m_s: f64,
    turn_rate_rad_s: f64,
    turn_rate_command_rad_s: f64,
    speed_limited: bool,
    turn_rate_limited: bool,
    heading_rad: f64,
    desired_heading_rad: Option<f64>,
    boresight_rad: Option<f64>,
    /// Largest angle between the boresight and a member of its group.
    line_of_sight_rad: Option<f64>,
    centre_distance_m: Option<f64>,
    steered_distance_m: Option<f64>,
    /// Standoff distance of its group.
    standoff_distance_m: Option<f64>,
    /// Distance from the centre less the standoff distance.
    standoff_tracking_error_m: Option<f64>,
    phase_rad: Option<f64>,
    feedforward_rad_s: Option<f64>,
    convergence_threshold_m2_s: Option<f64>,
    centre_too_fast: bool,
}

impl UavState {
    /// `group`: the one that it serves.
    pub(super) fn new(row: &UavRow, group: Option<&GroupRow>, line_of_sight_rad: Option<f64>) -> Self {
        Self {
            group: row.group,
            speed_m_s: row.speed_m_s,
            speed_command_m_s: row.speed_command_m_s,
            turn_rate_rad_s: row.turn_rate_rad_s,
            turn_rate_command_rad_s: row.turn_rate_command_rad_s,
            speed_limited: row.speed_limited,
            turn_rate_limited: row.turn_rate_limited,
            heading_rad: row.heading_rad,
            desired_heading_rad: row.desired_heading_rad,
            boresight_rad: row.boresight_rad,
            line_of_sight_rad,
            centre_distance_m: row.centre_distance_m,
            steered_distance_m: row.steered_distance_m,
            standoff_distance_m: group.map(|group| group.standoff_distance_m),
            standoff_tracking_error_m: group.map(|group| tracking_error_m(row, group)),
            phase_rad: row.phase_rad,
            feedforward_rad_s: row.feedforward_rad_s,
            convergence_threshold_m2_s: row.convergence_threshold_m2_s,
            centre_too_fast: row.centre_too_fast,
        }
    }
}

/// A group and its orbit; the fields are those of [`GroupRow`].
#[derive(Encode)]
pub(super) struct GroupOrbit {
    members: u32,
    x_m: f64,
    y_m: f64,
    vx_m_s: f64,
    vy_m_s: f64,
    spread_m: f64,
    margin_m: f64,
    standoff_unclamped_m: f64,
    standoff_distance_m: f64,
    standoff_rate_m_s: f64,
    turn_limit_m: Option<f64>,
    feasible: bool,
    convergence_threshold_m2_s: Option<f64>,
    altitude_m: f64,
    separation_m: Option<f64>,
}

impl GroupOrbit {
    pub(super) fn new(row: &GroupRow) -> Self {
        Self {
            members: row.members,
            x_m: row.x_m,
            y_m: row.y_m,
            vx_m_s: row.vx_m_s,
            vy_m_s: row.vy_m_s,
            spread_m: row.spread_m,
            margin_m: row.margin_m,
            standoff_unclamped_m: row.standoff_unclamped_m,
            standoff_distance_m: row.standoff_distance_m,
            standoff_rate_m_s: row.standoff_rate_m_s,
            turn_limit_m: row.turn_limit_m,
            feasible: row.feasible,
            convergence_threshold_m2_s: row.convergence_threshold_m2_s,
            altitude_m: row.altitude_m,
            separation_m: row.separation_m,
        }
    }
}
