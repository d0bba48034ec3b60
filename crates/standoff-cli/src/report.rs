//! `standoff report`: recomputes and prints the results of a recorded run.

use std::path::Path;

use standoff_app::{Failure, Maps, OutcomeOptions, Report, report_run};
use standoff_score::MetricSelection;

use crate::terminal::{note, print_outcome};

/// Prints the results of the run in `dir`, and writes its summary and figures again. For an unfinished run, the results
/// cover the part that was recorded. Maps given by the user replace the map in the record.
pub(crate) fn show(dir: &Path, choice: MetricSelection, maps: &Maps, json: bool) -> Result<(), Failure> {
    maps.replace_in_record(dir, &note)?;
    let Report { outcome, written } = report_run(dir, dir, choice, &note)?;
    print_outcome(&outcome, json, dir, OutcomeOptions { per_target: true, ..OutcomeOptions::default() })?;
    written
}
