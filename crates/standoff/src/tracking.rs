//! Tracking: one track per target, updated with the detections of all UAVs.

pub(crate) mod association;
pub mod estimate;
pub(crate) mod exchange;
pub mod information_filter;
pub(crate) mod input;
pub(crate) mod joint_association;
pub(crate) mod motion_modes;
pub(crate) mod near_update;
pub(crate) mod pose_error;
pub mod scan_model;
pub mod track;
pub(crate) mod track_table;
pub(crate) mod tracker;
pub mod unlabelled;
