//! The `--map` option.

use std::path::PathBuf;

use clap::Args;
use standoff_sim::scenario::Overrides;

/// Background maps that replace those of the scenario.
#[derive(Args, Clone, Default)]
pub(crate) struct Maps {
    /// Show this background map: a SUMO net (.net.xml) or GeoJSON, plain or .gz; may be given several times [default:
    /// the map of the scenario or of the record].
    #[arg(long, value_name = "FILE")]
    map: Vec<PathBuf>,
}

impl Maps {
    /// Adds the maps to the changes of a scenario.
    pub(crate) fn with(&self, overrides: Overrides) -> Overrides {
        Overrides { maps: self.map.clone(), ..overrides }
    }

    /// Converts the option to the type that loads the maps.
    pub(crate) fn named(&self) -> standoff_app::Maps {
        standoff_app::Maps(self.map.clone())
    }
}
