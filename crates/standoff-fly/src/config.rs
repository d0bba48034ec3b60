//! Settings of one companion computer.

use standoff::{AreaOfInterest, Geofence, TeamParams, UavId};
use standoff_io::geodesy::LocalPlane;

/// How the aircraft is steered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Steer {
    /// Roll targets, which the autopilot releases 3 s after the last one.
    #[default]
    Roll,
    /// Courses over ground, which the autopilot keeps for ever.
    Course,
}

/// Settings of one companion computer.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Parameters of the team, the same on every aircraft.
    pub params: TeamParams,
    /// Zones of the team, the same on every aircraft.
    pub geofence: Geofence,
    /// Areas of interest, the same on every aircraft.
    pub areas: Vec<AreaOfInterest>,
    /// Id of this UAV in the team.
    pub uav: UavId,
    /// Restart count of this program.
    pub restart_count: u32,
    /// MAVLink system id of the autopilot.
    pub system_id: u8,
    /// The team's local plane.
    pub plane: LocalPlane,
    /// Ids of the teammates whose reports are required.
    pub teammates: Vec<UavId>,
    /// Lowest and highest altitude above home that is commanded, m; in addition to the fence.
    pub altitude_m: [f64; 2],
    /// How the aircraft is steered.
    pub steer: Steer,
    /// GUIDED in the first heartbeat counts as the pilot's selection, so a program that restarts in flight engages again.
    pub engages_after_restart: bool,
}
