//! Where a UAV is, in the forms that viewers know.

use foxglove::messages::{
    FrameTransform, FrameTransforms, LocationFix, Pose, PoseInFrame, Quaternion, Timestamp, Vector3,
};
use standoff::math::{cos, sin};
use standoff::{Angle, Position};
use standoff_geodesy::LocalPlane;
use standoff_sim::record::{Frame, UavRow};
use std::f64::consts::FRAC_PI_2;

/// The frame of reference of everything: east, north, up.
pub(super) const WORLD: &str = "world";

/// A time since the start of the mission, as if that were 1970.
pub(super) fn timestamp(time_us: i64) -> Timestamp {
    let time_us = u64::try_from(time_us).unwrap_or(0);
    let nanoseconds = (time_us % 1_000_000) as u32 * 1000;
    Timestamp::new(u32::try_from(time_us / 1_000_000).unwrap_or(u32::MAX), nanoseconds)
}

/// A place, metres east, north and up.
pub(super) fn vector(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

/// A pose in the plane, turned by `heading_rad` anticlockwise from east.
pub(super) fn pose(position: Vector3, heading_rad: f64) -> Pose {
    let half = heading_rad / 2.0;
    Pose { position: Some(position), orientation: Some(Quaternion { x: 0.0, y: 0.0, z: sin(half), w: cos(half) }) }
}

/// How high a UAV is; where altitudes are not flown, where it is asked to be: in the plane until a group gives it an altitude.
pub(super) fn altitude_m(row: &UavRow) -> f64 {
    row.flown_altitude_m.or(row.altitude_m).unwrap_or(0.0)
}

/// Where a UAV is.
pub(super) fn position(row: &UavRow) -> Vector3 {
    vector(row.x_m, row.y_m, altitude_m(row))
}

/// The frame of a UAV.
fn frame_id(uav: u32) -> String {
    format!("uav-{uav}")
}

/// From the world to every UAV.
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

/// A UAV's pose in the world.
pub(super) fn in_world(time_us: i64, row: &UavRow) -> PoseInFrame {
    PoseInFrame {
        timestamp: Some(timestamp(time_us)),
        frame_id: WORLD.to_owned(),
        pose: Some(pose(position(row), row.heading_rad)),
    }
}

/// A UAV's place on the earth. Its altitude is that above the plane; its heading, as the schema wants it, clockwise
/// from north.
/// Beyond the plane's map of the earth there is none.
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
