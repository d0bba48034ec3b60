//! Association: which detections are of which tracks.
//!
//! A detection with a label is of the track of its label for certain. Of the others, all pairs of a detection and a track
//! have a probability.

pub(crate) mod joint;
pub(crate) mod joint_events;
pub(crate) mod label;
pub mod scan_model;
