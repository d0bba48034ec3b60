//! The record of a run: a folder of Parquet tables, written while the run goes and read back in step.
//!
//! A record holds `run.json` (what was run, by which version), `scenario.toml` (the resolved
//! scenario) and the tables `uavs`, `truth`, `tracks`, `groups`, `detections`, `events`, `targets` and
//! `views`, each as `<name>.parquet`; where there are any, `intruders`; where several minds flew, what each believes, too (`agents`, `agent_tracks`,
//! `agent_groups`, `agent_events`, `agent_team`). Figures and summaries may lie beside them. The same frames
//! give the same bytes: nothing in a record tells when, where or by whom it was written.
//!
//! Until it is whole it lies in a folder beside its place, says that it is unfinished, and can be read up to its last
//! checkpoint.

mod allowance;
mod bounds;
pub(crate) mod checkpoint;
pub(crate) mod column;
mod error;
pub(crate) mod folder;
#[cfg(test)]
mod fuzz;
pub(crate) mod manifest;
mod reader;
mod rows;
pub(crate) mod table;
mod writer;

pub use crate::frame::{
    AgentEventRow, AgentRow, Agents, DetectionRow, EventRow, Frame, GroupRow, IntruderRow, OfAgent, Place, TeamRow,
    TrackRow, TrackStatus, TruthRow, UavRow, ViewRow,
};
pub use allowance::EventAllowance;
pub use error::RecordError;
pub use folder::{MAP_FILE, Occupancy, in_the_way, occupancy};
pub use manifest::{Counts, FORMAT, Manifest};
pub use reader::{Frames, Record};
pub use standoff_parquet::{MAX_ROWS, panic_is_expected};
pub use writer::{Closed, Kept, Writer};
