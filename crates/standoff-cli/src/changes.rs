//! What the command line changes about a scenario: the same for every command that flies one.

use std::path::{Path, PathBuf};

use clap::Args;
use standoff_sim::scenario::Edits;

/// Changes of a scenario.
#[derive(Args, Default)]
pub(crate) struct Changes {
    /// Fly over this traffic file: SUMO floating-car data or CSV tracks, plain or .gz.
    #[arg(long, value_name = "FILE")]
    traffic: Option<PathBuf>,
    /// Number of UAVs, started on an orbit about the first targets.
    #[arg(long, value_name = "N")]
    uavs: Option<u32>,
    /// Change a value of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// How a traffic file is flown if no scenario is named.
const DEFAULT_FOR_TRAFFIC: &str = "traffic/convoy";

impl Changes {
    /// They change nothing.
    pub(crate) fn is_empty(&self) -> bool {
        self.traffic.is_none() && self.uavs.is_none() && self.set.is_empty()
    }

    /// The traffic file, if they change nothing else; `None` if they do.
    pub(crate) fn only_traffic(&self) -> Option<Option<&Path>> {
        (self.uavs.is_none() && self.set.is_empty()).then_some(self.traffic.as_deref())
    }

    /// As the simulator takes them.
    pub(crate) fn edits(&self) -> Edits {
        Edits { set: self.set.clone(), traffic: self.traffic.clone(), uavs: self.uavs }
    }

    /// These, and then `more` values.
    pub(crate) fn edits_and(&self, more: &[String]) -> Edits {
        let mut edits = self.edits();
        edits.set.extend_from_slice(more);
        edits
    }

    /// The scenario to change: that which is named, or one for traffic, or `default`.
    pub(crate) fn scenario<'a>(&self, named: Option<&'a str>, default: &'a str) -> &'a str {
        named.unwrap_or(if self.traffic.is_some() { DEFAULT_FOR_TRAFFIC } else { default })
    }
}
