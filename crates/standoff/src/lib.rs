//! Coordinated standoff tracking of moving target groups by several UAVs.
//!
//! A few fixed-wing UAVs keep groups of moving ground vehicles in view. Each UAV measures range and bearing, fuses the
//! measurements of all UAVs, and flies an orbit around its group. The radius of the orbit follows the spread of the
//! group. The method is that of H. Oh, S. Kim, H.-S. Shin and A. Tsourdos, *Coordinated Standoff Tracking of Moving
//! Target Groups Using Multiple UAVs*, IEEE Transactions on Aerospace and Electronic Systems 51(2), 2015; `Eq. (n)` is
//! an equation of that paper.
//!
//! The library is pure: it uses no clock, file, thread, random number or output. The caller passes time, measurements
//! and messages as arguments and receives commands as values. [`Agent`] combines all parts, and [`TeamAgent`] is a whole
//! team with an ideal radio. [`wire`] encodes messages.
//!
//! The items of this page, outside the modules, are what an integrator uses: they change only between versions. The
//! modules are the method, piece by piece, for studies, simulators and tests; any version may change them.
//!
//! Frame: x east, y north, metres. Angles: radians, anticlockwise from east, in (-pi, pi]. Units are SI; the unit is
//! the last part of a name.

pub mod agent;
pub mod angle;
pub mod atmosphere;
mod bank;
pub mod by_group;
mod command_law;
pub mod coordination;
pub mod covariance;
mod digest;
pub mod enclosing_circle;
pub mod frame;
pub mod grid;
pub mod group_id;
pub mod guidance;
mod intruders;
pub mod math;
pub mod message;
pub mod message_log;
pub mod output;
pub mod params;
mod pilot;
pub mod priority;
pub mod safety;
pub mod sensor;
mod state_update;
mod step_clock;
mod step_messages;
pub mod target;
pub mod team_agent;
pub mod team_state;
pub mod time;
pub mod tracking;
pub mod uav;
pub mod validation;
pub mod wind;
pub mod wire;

pub use agent::Agent;
pub use angle::Angle;
pub use coordination::dwell::Handoff;
pub use coordination::event::{
    Event, EventKind, GroupCreatedReason, GroupRetiredReason, HandoffCancelledReason, HandoffCompletedReason,
    ReassignmentReason, SearchEndReason,
};
pub use coordination::group::Group;
pub use coordination::lost_target_search::SearchAssignment;
pub use coordination::memberships::{GroupedTrack, Membership};
pub use coordination::teammate::Teammate;
pub use covariance::Covariance;
pub use frame::{Displacement, Position, Velocity};
pub use group_id::GroupId;
pub use guidance::followed::Guidance;
pub use guidance::heading::{DesiredPath, Steering};
pub use guidance::inner_loop::{Demand, InnerLoop, InnerLoopInputs};
pub use message::{Cue, Detection, Message, Report, Scan, SnapshotPart, TargetLabel, TrafficReport};
pub use message_log::TeammateStatus;
pub use output::{AgentOutput, Diagnostics, Observation, PointingTarget, Rejected};
pub use params::{
    BankParams, ClimbParams, GroupingParams, GuidanceParams, Law, LinkModel, LogParams, OrbitDirection, ParamInfo,
    ParamValue, SensorParams, SeparationParams, StandoffParams, TargetParams, TeamParams, TrackParams, UavParams,
    WindParams,
};
pub use priority::AreaOfInterest;
pub use safety::geofence::{Geofence, GeofenceError, Zone, ZoneKind};
pub use safety::separation::Avoidance;
pub use sensor::RangeBearingMeasurement;
pub use target::TargetState;
pub use team_agent::TeamAgent;
pub use team_state::TeamState;
pub use time::{Duration, Time};
pub use tracking::estimate::Estimate;
pub use tracking::track::{LossReason, Track, TrackId, TrackStatus};
pub use uav::{Aircraft, Command, UavId, UavState, Vertical};
pub use validation::ParamError;
pub use wind::{AirVelocity, Wind};
