//! Prints the Cursor-on-Target events that `standoff fly --cot` sends for a UAV and two tracks, one per line.
//! `scripts/check_cot.py` parses them with takproto.

use standoff_fly::cot;
use standoff_io::geodesy::LocalPlane;
use standoff_record::{Frame, NO_TARGET, TrackRow, UavRow};

fn main() {
    let Ok(plane) = LocalPlane::about(47.4, 8.5) else { return };
    let uav = UavRow { uav: 1, x_m: 100.0, heading_rad: 0.5, speed_m_s: 23.5, ..UavRow::default() };
    let mut covariance = [0.0; 21];
    (covariance[0], covariance[15]) = (25.0, 4.0);
    let track = TrackRow { track: 7, state: [0.0, 6.7, 0.0, 200.0, 0.0, 0.0], covariance, ..TrackRow::default() };
    let unlabelled = TrackRow { track: NO_TARGET + 2, track_uid: Some(0xabc), ..track };
    let frame = Frame { uavs: vec![uav], tracks: vec![track, unlabelled], ..Frame::default() };
    for event in cot::events(&frame, &plane, 1_767_225_600_250_000) {
        println!("{event}");
    }
}
