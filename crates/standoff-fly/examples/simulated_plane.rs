//! An aircraft, its sensor and a target for trials of `standoff fly` without an autopilot: the double of the tests, in
//! real time, over UDP on this machine.
//!
//! ```text
//! cargo run -p standoff-fly --example simulated_plane -- 127.0.0.1:14550 127.0.0.1:47800 120
//! ```

#![expect(clippy::unwrap_used, dead_code, reason = "helpers of tests")]

#[path = "../tests/common/identified_aircraft.rs"]
mod identified_aircraft;
#[path = "../tests/common/live.rs"]
mod live;
#[path = "../tests/common/plane.rs"]
mod plane;

use std::process::ExitCode;

use standoff_io::geodesy::LocalPlane;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [link, feed, seconds] = &arguments[..] else {
        eprintln!("usage: simulated_plane LINK_HOST:PORT FEED_HOST:PORT SECONDS");
        return ExitCode::from(2);
    };
    let Some(seconds) = seconds.parse().ok().filter(|seconds| (1.0..=86_400.0).contains(seconds)) else {
        eprintln!("error: {seconds}: must be a number of seconds between 1 and 86400");
        return ExitCode::from(2);
    };
    let plane = LocalPlane::about(47.4, 8.5).unwrap();
    let mut vehicle = plane::Plane::new(plane, None);
    let seen = live::fly(&mut vehicle, &plane, link, feed, seconds);
    let settled = &seen.ranges_m[seen.ranges_m.len() / 2..];
    let squares = settled.iter().map(|range_m| (range_m - 250.0) * (range_m - 250.0)).sum::<f64>();
    println!(
        "distance from the target in the second half: 250 m, rms error {:.2} m",
        (squares / settled.len() as f64).sqrt()
    );
    println!("commands in another mode than GUIDED: {}", vehicle.violations.len());
    ExitCode::SUCCESS
}
