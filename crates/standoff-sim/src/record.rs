//! Record of a run: a folder of Parquet tables, written during the run and read back time step by time step.
//!
//! A record contains `run.json` (scenario name, seed and version), `scenario.toml` (the resolved scenario) and the
//! tables `uavs`, `truth`, `tracks`, `groups`, `detections`, `events`, `targets` and `in_view`, each as
//! `<name>.parquet`. Runs with intruders add `intruders`. Runs with several agents add their estimates (`agents`,
//! `agent_tracks`, `agent_groups`, `agent_events`, `agent_teammates`). The folder may also contain figures and
//! summaries. The same frames give the same bytes: a record contains no time, place or user name of its creation.
//!
//! Until it is complete, a record is written to a temporary folder next to its destination. It is marked as unfinished
//! and can be read up to its last checkpoint.

pub(crate) mod checkpoint;
pub(crate) mod column;
pub(crate) mod directory;
#[cfg(test)]
mod docs;
mod error;
mod event_quota;
#[cfg(test)]
mod fuzz;
mod limits;
pub(crate) mod manifest;
mod reader;
pub(crate) mod schema;
pub(crate) mod table;
mod writer;

pub use crate::frame::{
    AgentEventRow, AgentRow, ByAgent, DetectionRow, EventRow, Frame, GroupRow, IntruderRow, MembershipState,
    PerAgentTables, TeammateRow, TrackRow, TrackStatus, TruthRow, UavRow, ViewRow,
};
pub use column::PageColumns;
pub use directory::{MAP_FILE, Occupancy, conflicting_files, occupancy};
pub use error::RecordError;
pub use event_quota::EventQuota;
pub use limits::MAX_ROWS;
pub use manifest::{Counts, FORMAT, Manifest};
pub use reader::{Frames, Record};
pub use writer::{FinishedRecord, PartialRecord, Writer};
