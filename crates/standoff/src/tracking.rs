//! Tracking: one track per target, updated with the detections of all UAVs.

pub(crate) mod association;
pub(crate) mod exchange;
pub(crate) mod gaussian;
pub(crate) mod information_filter;
pub(crate) mod input;
pub(crate) mod joint_association;
pub(crate) mod motion_modes;
pub(crate) mod near_update;
pub(crate) mod pose_error;
pub(crate) mod scan_model;
pub(crate) mod track;
pub(crate) mod track_table;
pub(crate) mod tracker;
pub(crate) mod unlabelled;
