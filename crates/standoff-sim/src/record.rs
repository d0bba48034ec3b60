//! The record of a run: a folder of Parquet tables, written while the run goes and read back in step.
//!
//! A record holds `run.json` (what was run, by which version), `scenario.toml` (the resolved
//! scenario) and the tables `uavs`, `truth`, `tracks`, `groups`, `detections`, `events` and
//! `targets`, each as `<name>.parquet`. Figures and summaries may lie beside them. The same frames
//! give the same bytes: nothing in a record tells when, where or by whom it was written.

pub(crate) mod column;
mod error;
mod folder;
mod frame;
mod manifest;
mod reader;
mod rows;
pub(crate) mod table;
mod writer;

pub use error::RecordError;
pub use folder::{Occupancy, occupancy};
pub use frame::{DetectionRow, EventRow, Frame, GroupRow, Place, TrackRow, TrackStatus, TruthRow, UavRow};
pub use manifest::{FORMAT, Manifest};
pub use reader::{Frames, Record};
pub use writer::{Closed, Writer};
