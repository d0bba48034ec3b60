//! The `--metrics` option.

use clap::Args;
use standoff_score::MetricSelection;

/// Selection of the metrics that are computed and printed.
#[derive(Args)]
pub(crate) struct MetricArgs {
    /// Comma-separated list of metrics to compute: names from docs/user/metrics.md, or the sets standard, limits (estimation
    /// errors relative to their bound; takes slightly longer), association (GOSPA, swapped and false tracks), table-2
    /// and all.
    /// [default: standard]
    #[arg(id = "metrics", long = "metrics", value_name = "LIST", value_parser = MetricSelection::parse)]
    typed: Option<MetricSelection>,
}

impl MetricArgs {
    /// True if the option is given.
    pub(crate) fn is_given(&self) -> bool {
        self.typed.is_some()
    }

    /// Returns the metrics to compute.
    pub(crate) fn selection(&self) -> MetricSelection {
        self.typed.unwrap_or(MetricSelection::standard())
    }
}
