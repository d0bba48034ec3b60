//! Tracking: one track per target, updated with the detections of all UAVs.

pub mod association;
pub(crate) mod candidate;
pub(crate) mod confirmation;
pub(crate) mod deletion;
pub(crate) mod duplicates;
pub mod estimate;
pub(crate) mod exchange;
pub mod existence;
pub mod information_filter;
pub(crate) mod initiation;
pub(crate) mod input;
pub(crate) mod motion_modes;
pub(crate) mod near_update;
pub(crate) mod pose_error;
pub mod track;
pub(crate) mod track_table;
pub(crate) mod tracker;
pub(crate) mod unlabelled;
