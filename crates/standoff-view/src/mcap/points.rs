//! UAVs, targets and tracks as point clouds with ids, for viewers that do not support scenes, such as Rerun.

use foxglove::messages::{PackedElementField, PointCloud, packed_element_field::NumericType};

use super::pose::{WORLD, pose, timestamp, vector};

/// Makes a point cloud with ids. Positions are east, north and up, m, in single precision.
pub(super) fn cloud(time_us: i64, id: &str, points: impl Iterator<Item = (u32, [f64; 3])>) -> PointCloud {
    let of_type = |r#type: NumericType| {
        move |(name, offset): (&str, u32)| PackedElementField { name: name.to_owned(), offset, r#type: r#type.into() }
    };
    let place = [("x", 0), ("y", 4), ("z", 8)].map(of_type(NumericType::Float32));
    let packed = |(id, place): (u32, [f64; 3])| {
        let [x, y, z] = place.map(|metres| (metres as f32).to_le_bytes());
        [x, y, z, id.to_le_bytes()].concat()
    };
    PointCloud {
        timestamp: Some(timestamp(time_us)),
        frame_id: WORLD.to_owned(),
        pose: Some(pose(vector(0.0, 0.0, 0.0), 0.0)),
        point_stride: 16,
        fields: place.into_iter().chain([of_type(NumericType::Uint32)((id, 12))]).collect(),
        data: points.flat_map(packed).collect::<Vec<u8>>().into(),
    }
}
