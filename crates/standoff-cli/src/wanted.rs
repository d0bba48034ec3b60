//! Metrics that are named on the command line.

use clap::Args;
use standoff_sim::score::Choice;

/// Which metrics are told.
#[derive(Args)]
pub(crate) struct Wanted {
    /// Metrics to work out, with commas between: names of docs/metrics.md, and the sets standard, limits (how close the
    /// estimates come to their bound; takes a little longer), table-2 and all.
    #[arg(id = "metrics", long = "metrics", value_name = "LIST", default_value = "standard", value_parser = Choice::parse)]
    pub(crate) choice: Choice,
}
