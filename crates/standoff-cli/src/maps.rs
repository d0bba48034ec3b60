//! Maps that are named on the command line.

use std::path::PathBuf;

use clap::Args;

/// Maps to look at, in the place of those that the scenario names.
#[derive(Args, Clone, Default)]
pub(crate) struct Maps {
    /// Show this under the vehicles: a SUMO net (.net.xml) or GeoJSON, plain or .gz; may be given several times [default:
    /// what the scenario names, or the record keeps].
    #[arg(long, value_name = "FILE")]
    map: Vec<PathBuf>,
}

impl Maps {
    /// As whoever shows them takes them.
    pub(crate) fn named(&self) -> standoff_results::Maps {
        standoff_results::Maps(self.map.clone())
    }
}
