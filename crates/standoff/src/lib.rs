//! Coordinated standoff tracking of moving target groups by several UAVs.
//!
//! A few fixed-wing UAVs keep groups of moving ground vehicles in view: each measures range and bearing, fuses what all
//! have measured, and flies an orbit about its group whose radius follows the group's spread. The method is that of
//! H. Oh, S. Kim, H.-S. Shin and A. Tsourdos, *Coordinated Standoff Tracking of Moving Target Groups Using Multiple
//! UAVs*, IEEE Transactions on Aerospace and Electronic Systems 51(2), 2015; `Eq. (n)` is an equation of that paper.
//!
//! The library is pure: no clock, file, thread, random number or printing. Time, measurements and messages come in as
//! arguments, commands go out as values. [`Agent`] joins everything; every part is usable by itself.
//!
//! Frame: x east, y north, metres. Angles: radians, anticlockwise from east, in (-pi, pi]. SI units; the unit is the
//! last part of a name.

pub mod agent;
pub mod angle;
pub mod coordination;
pub mod covariance;
mod digest;
pub mod estimation;
pub mod fleet;
mod fold;
pub mod frame;
pub mod group_id;
pub mod guidance;
mod history;
mod intruders;
mod log;
pub mod math;
pub mod message;

pub mod param;
pub mod picture;
mod pilot;
mod row;
pub mod sensor;
pub mod smallest_circle;
mod snapshot;
pub mod step;
pub mod target;
pub mod team;
pub mod time;
pub mod uav;

pub use agent::Agent;
pub use angle::Angle;
pub use coordination::assignment::{AssignmentLaw, AvailableUav, Duty, Site};
pub use coordination::event::{DissolutionReason, Event, EventKind};
pub use coordination::group::Group;
pub use coordination::handoff::Handoff;
pub use coordination::memberships::{Known, Membership};
pub use coordination::search::SearchDuty;
pub use coordination::teammate::Teammate;
pub use covariance::Covariance;
pub use estimation::information_filter::{Contribution, Estimate, InformationFilter};
pub use estimation::track::{LossReason, Track, TrackId, TrackParams, TrackStatus};
pub use fleet::Fleet;
pub use frame::{Displacement, Position, Velocity};
pub use group_id::GroupId;
pub use guidance::airspace::{Airspace, AirspaceError, Zone, ZoneKind};
pub use guidance::heading::{Feedforward, GuidanceParams, Lead, Orbit, SpeedReference, Steering};
pub use guidance::orbit_motion::{MotionParams, OrbitMotion};
pub use guidance::separation::{Avoidance, SeparationParams};
pub use guidance::standoff_distance::{Spread, StandoffDistance, StandoffParams};
pub use guidance::vector_field::{Sense, VectorField};
pub use log::Presence;
pub use message::{
    Ask, Cue, Detection, Held, Knowledge, Message, Report, Scan, SnapshotPart, Speaker, Stamp, TargetLabel, Traffic,
};
pub use param::{Allowed, ParamError};
pub use picture::Picture;
pub use sensor::{RangeBearing, SensorParams};
pub use smallest_circle::{CircleMotion, SmallestCircle};
pub use step::{Diagnostics, LookAt, Observation, Refused, Step};
pub use target::{TargetParams, TargetState, Transition};
pub use team::{
    Aim, Altitudes, CentreEstimate, Discard, GroupCount, GroupParams, LogParams, Margin, Objective, OnMembershipChange,
    Radio, Search, TeamParams,
};
pub use time::{Duration, Time};
pub use uav::{
    Aircraft, ClimbParams, Command, Integrator, LimitedCommand, Response, UavId, UavParams, UavState, Vertical,
};
