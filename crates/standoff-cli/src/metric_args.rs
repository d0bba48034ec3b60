//! The `--metrics` option.

use clap::Args;
use standoff_sim::score::MetricSelection;

/// Selection of the metrics that are computed and printed.
#[derive(Args)]
pub(crate) struct MetricArgs {
    /// Comma-separated list of metrics to compute: names from docs/metrics.md, or the sets standard, limits (estimation
    /// errors relative to their bound; takes slightly longer), table-2 and all.
    #[arg(id = "metrics", long = "metrics", value_name = "LIST", default_value = "standard", value_parser = MetricSelection::parse)]
    pub(crate) choice: MetricSelection,
}
