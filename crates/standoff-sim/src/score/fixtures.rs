//! Rows for tests.

use crate::frame::{GroupRow, MembershipState, TrackRow, TrackStatus, TruthRow, UavRow};

/// A UAV at the origin that looks east, in group 0.
pub(super) fn uav_row(uav: u32) -> UavRow {
    UavRow {
        uav,
        group: Some(0),
        x_m: 0.0,
        y_m: 0.0,
        heading_rad: 0.0,
        speed_m_s: 40.0,
        turn_rate_rad_s: 0.0,
        boresight_rad: Some(0.0),
        speed_command_m_s: 40.0,
        turn_rate_command_rad_s: 0.0,
        speed_limited: false,
        turn_rate_limited: false,
        centre_distance_m: None,
        phase_rad: None,
        steered_radius_m: None,
        desired_heading_rad: None,
        feedforward_rad_s: None,
        convergence_threshold_m2_s: None,
        centre_too_fast: false,
        commanded_altitude_m: None,
        altitude_m: None,
        climb_rate_m_s: None,
        avoided_uav: None,
        avoided_intruder: None,
        predicted_distance_m: None,
        limiting_zone: None,
    }
}

/// A stationary target.
pub(super) fn truth_row(target: u32, x_m: f64, y_m: f64) -> TruthRow {
    TruthRow { target, x_m, y_m, vx_m_s: 0.0, vy_m_s: 0.0, ax_m_s2: None, ay_m_s2: None }
}

/// A track at the origin.
pub(super) fn track_row(target: u32, group: Option<u32>) -> TrackRow {
    TrackRow {
        target,
        track: target,
        status: TrackStatus::Updated,
        membership: MembershipState::Member,
        group,
        receiving_group: None,
        state: [0.0; 6],
        covariance: [0.0; 21],
    }
}

/// A group centred on the origin.
pub(super) fn group_row(group: u32) -> GroupRow {
    GroupRow {
        group,
        members: 1,
        x_m: 0.0,
        y_m: 0.0,
        vx_m_s: 0.0,
        vy_m_s: 0.0,
        spread_m: 0.0,
        margin_m: 0.0,
        standoff_unclamped_m: 300.0,
        standoff_distance_m: 300.0,
        standoff_rate_m_s: 0.0,
        turn_limit_m: None,
        feasible: true,
        convergence_threshold_m2_s: None,
        altitude_m: 0.0,
        nearest_groupmate_m: None,
        group_uid: None,
    }
}
