//! `standoff report`: recomputes and prints the results of a recorded run.

use std::path::Path;

use standoff_app::{Failure, Maps, OutcomeOptions, Report, of_record, report_run};
use standoff_io::atomic_file;
use standoff_io::display_text;
use standoff_record::{MAP_FILE, Record};
use standoff_score::MetricSelection;

use crate::terminal::{note, print_outcome};

/// Prints the results of the run in `dir`, and writes its summary and figures again. For an unfinished run, the results
/// cover the part that was recorded. Maps given by the user replace the map in the record.
pub(crate) fn show(dir: &Path, choice: MetricSelection, maps: &Maps, json: bool) -> Result<(), Failure> {
    if !maps.0.is_empty() {
        let record = Record::open(dir).map_err(of_record)?;
        if let Some(map) = maps.of_record(&record, &note)? {
            let path = dir.join(MAP_FILE);
            atomic_file::save_quickly(&path, &map).map_err(|reason| {
                Failure::running(format!("cannot write {}: {reason}; check the disk", display_text::path(&path)))
            })?;
        }
    }
    let Report { outcome, written } = report_run(dir, dir, choice, &note)?;
    print_outcome(&outcome, json, dir, OutcomeOptions { per_target: true, ..OutcomeOptions::default() })?;
    written
}
