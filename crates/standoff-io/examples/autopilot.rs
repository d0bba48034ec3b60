//! Converts an autopilot's positions in degrees to positions of the library, relative to the take-off point, and back.
//!
//! `cargo run -p standoff-io --example autopilot`

use standoff::Position;
use standoff_io::geodesy::{GeodesyError, LocalPlane};

fn main() -> Result<(), GeodesyError> {
    // MAVLink's GLOBAL_POSITION_INT uses units of 1e-7 degrees.
    let (home, now) = ([474_000_000, 85_000_000], [474_012_345, 84_987_654]);
    let degrees = |mavlink: i32| f64::from(mavlink) * 1e-7;
    let plane = LocalPlane::about(degrees(home[0]), degrees(home[1]))?;
    let uav = plane.position(degrees(now[0]), degrees(now[1]))?;
    println!("the UAV is {:.1} m east and {:.1} m north of its home", uav.x_m(), uav.y_m());

    let centre = Position::from_m(300.0, 400.0);
    let [latitude_deg, longitude_deg] = plane.degrees_at(centre)?;
    println!("the point 300 m east and 400 m north of it is at {latitude_deg:.7}, {longitude_deg:.7}");
    Ok(())
}
