//! Poses of UAVs in the formats that viewers support.

use foxglove::messages::{
    FrameTransform, FrameTransforms, LocationFix, Pose, PoseInFrame, Quaternion, Timestamp, Vector3,
};
use standoff::research::math::{cos, sin};
use standoff::{Angle, Position};
use standoff_io::geodesy::LocalPlane;
use standoff_record::{Frame, UavRow};
use std::f64::consts::FRAC_PI_2;

/// Id of the world frame: x east, y north, z up.
pub(super) const WORLD: &str = "world";

/// Converts mission time to a time stamp; the start of the mission is time 0.
pub(super) fn timestamp(time_us: i64) -> Timestamp {
    let time_us = u64::try_from(time_us).unwrap_or(0);
    let nanoseconds = (time_us % 1_000_000) as u32 * 1000;
    Timestamp::new(u32::try_from(time_us / 1_000_000).unwrap_or(u32::MAX), nanoseconds)
}

/// Makes a vector, east, north and up, m.
pub(super) fn vector(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

/// Makes a horizontal pose; `heading_rad` is anticlockwise from east.
pub(super) fn pose(position: Vector3, heading_rad: f64) -> Pose {
    let half = heading_rad / 2.0;
    Pose { position: Some(position), orientation: Some(Quaternion { x: 0.0, y: 0.0, z: sin(half), w: cos(half) }) }
}

/// Altitude of a UAV, m. If the scenario has no altitude dynamics, the commanded altitude, or 0 before a group sets
/// one.
pub(super) fn altitude_m(row: &UavRow) -> f64 {
    row.altitude_m.or(row.commanded_altitude_m).unwrap_or(0.0)
}

/// Position of a UAV, east, north and up, m.
pub(super) fn position(row: &UavRow) -> Vector3 {
    vector(row.x_m, row.y_m, altitude_m(row))
}

/// Id of the frame of a UAV.
fn frame_id(uav: u32) -> String {
    format!("uav-{uav}")
}

/// Transforms from the world frame to the frame of every UAV.
pub(super) fn transforms(frame: &Frame) -> FrameTransforms {
    let transform = |row: &UavRow| {
        let Pose { position, orientation } = pose(position(row), row.heading_rad);
        FrameTransform {
            timestamp: Some(timestamp(frame.time_us)),
            parent_frame_id: WORLD.to_owned(),
            child_frame_id: frame_id(row.uav),
            translation: position,
            rotation: orientation,
        }
    };
    FrameTransforms { transforms: frame.uavs.iter().map(transform).collect() }
}

/// Pose of a UAV in the world frame.
pub(super) fn in_world(time_us: i64, row: &UavRow) -> PoseInFrame {
    PoseInFrame {
        timestamp: Some(timestamp(time_us)),
        frame_id: WORLD.to_owned(),
        pose: Some(pose(position(row), row.heading_rad)),
    }
}

/// Geodetic location of a UAV. The altitude is relative to the local plane; the heading is clockwise from north, as the
/// schema requires. `None` if the position is outside the range of the map projection.
pub(super) fn location(time_us: i64, row: &UavRow, plane: &LocalPlane) -> Option<LocationFix> {
    let [latitude, longitude] = plane.degrees_at(Position::from_m(row.x_m, row.y_m)).ok()?;
    let heading = row.heading_rad;
    Some(LocationFix {
        timestamp: Some(timestamp(time_us)),
        frame_id: frame_id(row.uav),
        latitude,
        longitude,
        altitude: altitude_m(row),
        heading: Some(Angle::from_rad(FRAC_PI_2 - heading).rad()),
        velocity: Some(vector(
            row.speed_m_s * cos(heading),
            row.speed_m_s * sin(heading),
            row.climb_rate_m_s.unwrap_or(0.0),
        )),
        ..LocationFix::default()
    })
}
