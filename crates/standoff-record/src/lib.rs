//! Record of a run: a folder of Parquet tables, written during the run and read back time step by time step.
//!
//! A record contains `run.json` (scenario name, seed and version), `scenario.toml` (the resolved scenario) and the
//! tables `uavs`, `truth`, `tracks`, `groups`, `detections`, `events`, `targets` and `in_view`, each as
//! `<name>.parquet`. Runs with intruders add `intruders`, runs with tentative tracks `tentative`. Runs with several agents
//! add their estimates (`agents`, `agent_tracks`, `agent_groups`, `agent_events`, `agent_teammates`). The folder may
//! also contain figures and summaries. The same frames give the same bytes: a record contains no time, place or user
//! name of its creation.
//!
//! Until it is complete, a record is written to a temporary folder next to its destination. It is marked as unfinished
//! and can be read up to its last checkpoint.

// The fixtures that tests of several crates share use the same paths here as there.
#[cfg(test)]
extern crate self as standoff_record;

pub mod agent_rows;
mod checkpoint;
pub mod column;
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;
mod directory;
#[cfg(test)]
mod docs;
mod earth;
mod error;
mod event_quota;
mod event_text;
mod frame;
mod frame_tables;
#[cfg(test)]
mod fuzz;
#[cfg(test)]
#[path = "../../standoff-io/fuzz/harness.rs"]
mod fuzz_harness;
mod limits;
mod manifest;
mod memory_record;
mod reader;
mod schema;
pub mod table;
mod writer;

pub use column::PageColumns;
pub use directory::{MAP_FILE, NO_FOLDER, Occupancy, conflicting_files, first_in, occupancy};
pub use error::RecordError;
pub use event_quota::EventQuota;
pub use event_text::target_name;
pub use frame::{
    AgentEventRow, AgentRow, ByAgent, DetectionRow, EventRow, Frame, GroupRow, IntruderRow, MembershipState, NO_TARGET,
    PerAgentTables, ReportedState, ReportedTables, TeammateRow, TentativeRow, TrackRow, TrackStatus, TruthRow, UavRow,
    ViewRow,
};
pub use frame_tables::DerivedColumns;
pub use limits::MAX_ROWS;
pub use manifest::{Counts, FORMAT, MAX_NAME, MAX_VERSION, Manifest, check_length};
pub use memory_record::MemoryRecord;
pub use reader::{Frames, Record, SCENARIO_MAX};
pub use writer::{FinishedRecord, PartialRecord, Writer};
