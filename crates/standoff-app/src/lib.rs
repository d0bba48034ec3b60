//! Flies, records and reports runs, batches and sweeps in folders; shared by the command line and the Python package.
//!
//! ```text
//! scenario -> fly -> record -> report -> outcome (text, JSON), summary.json, figures, report.html
//! ```
//!
//! Nothing here prints: warnings and notes go to a [`Warnings`] callback, and errors are [`Failure`]s with advice for
//! the user.

mod baseline;
mod batch;
mod cancellable;
mod comparison;
mod error;
mod export;
mod fly;
mod maps;
mod metric_table;
mod outcome;
mod report;
mod sweep;
mod warnings;

pub use baseline::BaselineReport;
pub use batch::{REPORT, batch_page, batch_text};
pub use cancellable::{POLL, run_interruptible};
pub use comparison::{Verdict, comparison_text};
pub use error::{Failure, format_errors, of_batch, of_record};
pub use export::{Export, ExportFormat, ExportOptions};
pub use fly::{fly, has_older_run, manifest};
pub use maps::Maps;
pub use outcome::{Outcome, OutcomeOptions, PerTarget, lines};
pub use report::{Report, report_end, report_run, save, settings_of, warn_omitted};
pub use sweep::{Axis, LatinHypercube, POINTS_MAX, SWEEP, SWEEP_TABLE, Sweep, SweepResults};
pub use warnings::{Warnings, warn};
