//! One agent behind one autopilot: MAVLink 2 to an ArduPlane vehicle, with a feed of detections and with teammates.
//!
//! The program watches over and locates targets. It never arms the aircraft, never changes its mode, releases nothing and
//! points nothing. It commands roll, airspeed and altitude, and only while the pilot has selected GUIDED
//! ([`authority`]). `docs/user/fly.md` describes its use.

pub mod address;
pub mod authority;
mod boot_clock;
pub mod codec;
pub mod command;
mod commanded_file;
pub mod companion;
pub mod config;
pub mod cot;
mod directions;
pub mod feed;
pub mod fence;
mod flight_commands;
pub mod flight_record;
mod flight_rows;
pub mod parameters;
mod period;
mod requests;
pub mod run;
mod scan_alignment;
pub mod status;
mod sumo;
mod team_clock;
pub mod time_stamps;
mod traci;
mod transport;
mod uplink;
pub mod vehicle;
