//! Rows for the tests of this crate and of the crates that build on it.

#![allow(dead_code, unreachable_pub, clippy::allow_attributes, reason = "a module shared by test binaries")]

use standoff_record::{GroupRow, MembershipState, TrackRow, TrackStatus, TruthRow, UavRow};

/// A UAV at the origin that looks east, in group 0.
pub fn uav_row(uav: u32) -> UavRow {
    let (speed_m_s, speed_command_m_s) = (40.0, 40.0);
    UavRow { uav, group: Some(0), boresight_rad: Some(0.0), speed_m_s, speed_command_m_s, ..UavRow::default() }
}

/// A stationary target.
pub fn truth_row(target: u32, x_m: f64, y_m: f64) -> TruthRow {
    TruthRow { target, x_m, y_m, ..TruthRow::default() }
}

/// A track at the origin, measured in this time step.
pub fn track_row(target: u32, group: Option<u32>) -> TrackRow {
    let membership = if group.is_some() { MembershipState::Member } else { MembershipState::Ungrouped };
    TrackRow { target, track: target, status: TrackStatus::Updated, membership, group, ..TrackRow::default() }
}

/// A group centred on the origin, with a feasible orbit of 300 m.
pub fn group_row(group: u32) -> GroupRow {
    let (standoff_unclamped_m, standoff_distance_m) = (300.0, 300.0);
    GroupRow { group, members: 1, standoff_unclamped_m, standoff_distance_m, feasible: true, ..GroupRow::default() }
}
