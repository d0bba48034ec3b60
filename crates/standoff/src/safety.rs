//! Safety: UAVs stay inside their geofence and keep the minimum distance to other aircraft.
//!
//! ```text
//! desired command -> candidates -> predicted motion -> zones, separation -> nearest command that keeps both
//! ```
//!
//! **Motion.** Commands are relative to the air: true airspeed and heading rate. [`motion`] predicts the airframe that
//! flies them, in air that moves with the wind. Positions are over ground. This is what the aircraft flies: no command is
//! converted after it was selected.
//!
//! **Fallback.** A UAV can circle forever ([`fallback`]). A command is admissible if, after one period of it, a circle to
//! the left or to the right stays clear of all outlines ([`zones`]) and of the circles of the other UAVs ([`separation`]).
//!
//! **Selection.** If the desired command is not admissible, the UAV flies the [candidate](candidates) with the lowest
//! cost. If none is admissible, it flies the circle that it has planned last.

pub(crate) mod altitude;
pub(crate) mod candidates;
pub(crate) mod detour;
pub(crate) mod fallback;
pub(crate) mod flown;
pub mod geofence;
pub(crate) mod joint_plan;
pub mod motion;
pub(crate) mod other_aircraft;
pub mod predicted_trajectory;
pub(crate) mod pursuer;
pub(crate) mod room;
pub(crate) mod selection;
pub mod separation;
pub(crate) mod team_geofence;
pub(crate) mod zones;
