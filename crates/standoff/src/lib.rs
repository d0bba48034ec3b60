//! Coordinated standoff tracking of moving target groups by several UAVs.
//!
//! A few fixed-wing UAVs keep groups of moving ground vehicles in view. Each UAV measures range and bearing, fuses the
//! measurements of all UAVs, and flies an orbit around its group. The radius of the orbit follows the spread of the
//! group. The method is that of H. Oh, S. Kim, H.-S. Shin and A. Tsourdos, *Coordinated Standoff Tracking of Moving
//! Target Groups Using Multiple UAVs*, IEEE Transactions on Aerospace and Electronic Systems 51(2), 2015; `Eq. (n)` is
//! an equation of that paper.
//!
//! The library is pure: it uses no clock, file, thread, random number or output. The caller passes time, measurements
//! and messages as arguments and receives commands as values. [`Agent`] combines all parts; each part can also be used
//! alone.
//!
//! Frame: x east, y north, metres. Angles: radians, anticlockwise from east, in (-pi, pi]. Units are SI; the unit is
//! the last part of a name.

pub mod agent;
pub mod angle;
pub mod coordination;
pub mod covariance;
mod digest;
pub mod frame;
pub mod group_id;
pub mod guidance;
mod intruders;
pub mod math;
pub mod message;
mod message_log;
mod state_update;
pub mod team_agent;

mod command_law;
pub mod enclosing_circle;
pub mod output;
pub mod params;
pub mod sensor;
mod step_messages;
pub mod target;
pub mod team_state;
pub mod time;
pub mod tracking;
pub mod uav;
pub mod validation;
pub mod wire;

pub use agent::Agent;
pub use angle::Angle;
pub use coordination::assignment::{Assignment, AssignmentLaw, AvailableUav, CandidateGroup};
pub use coordination::dwell::Handoff;
pub use coordination::event::{Event, EventKind, GroupRetiredReason};
pub use coordination::group::Group;
pub use coordination::lost_target_search::SearchAssignment;
pub use coordination::memberships::{GroupedTrack, Membership};
pub use coordination::teammate::Teammate;
pub use covariance::Covariance;
pub use enclosing_circle::{CircleMotion, EnclosingCircle};
pub use frame::{Displacement, Position, Velocity};
pub use group_id::GroupId;
pub use guidance::avoidance::Avoidance;
pub use guidance::geofence::{Geofence, GeofenceError, Zone, ZoneKind};
pub use guidance::heading::{Orbit, Steering};
pub use guidance::orbit_motion::OrbitMotion;
pub use guidance::standoff_distance::{Spread, StandoffDistance};
pub use guidance::vector_field::VectorField;
pub use message::{
    CommitDigest, Cue, Detection, LogStatus, Message, MessageSource, ReceivedRange, Report, Scan, SnapshotPart,
    SnapshotRequest, TargetLabel, TrafficReport,
};
pub use message_log::TeammateStatus;
pub use output::{AgentOutput, Diagnostics, Observation, PointingTarget, Rejected};
pub use params::{
    AltitudePolicy, CentreEstimate, CentreJump, ClimbParams, Feedforward, GroupCount, GroupingParams, GuidanceParams,
    Integrator, Lead, LinkModel, LogParams, Margin, MotionParams, Objective, OrbitDirection, ParamInfo, ParamKind,
    ParamValue, Pointing, RemovalRule, SensorParams, SeparationParams, SpeedReference, StandoffParams, TargetParams,
    TeamParams, TrackParams, UavParams, Word,
};
pub use sensor::RangeBearingMeasurement;
pub use target::{TargetState, Transition};
pub use team_agent::TeamAgent;
pub use team_state::TeamState;
pub use time::{Duration, Time};
pub use tracking::information_filter::{Contribution, Estimate, InformationFilter};
pub use tracking::track::{LossReason, Track, TrackId, TrackStatus};
pub use uav::{Aircraft, AutopilotModel, Command, LimitedCommand, UavId, UavState, Vertical};
pub use validation::{Allowed, ParamError};
