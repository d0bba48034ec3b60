//! `standoff show`: tells a run again.

use std::path::Path;

use standoff_results::{Failure, Maps, Telling, Told, of_record, tell};
use standoff_sim::disk;
use standoff_sim::record::{MAP_FILE, Record};
use standoff_sim::score::Choice;
use standoff_sim::text;

use crate::speech::{note, print_outcome};

/// Its summary and figures are made anew. Of an unfinished one it tells what there is.
/// Maps that are named take the place of what it has.
pub(crate) fn show(dir: &Path, choice: Choice, maps: &Maps, json: bool) -> Result<(), Failure> {
    if !maps.0.is_empty() {
        let record = Record::open(dir).map_err(of_record)?;
        if let Some(map) = maps.of_record(&record, &note)? {
            let path = dir.join(MAP_FILE);
            disk::save_quickly(&path, &map).map_err(|reason| {
                Failure::running(format!("cannot write {}: {reason}; check the disk", text::path(&path)))
            })?;
        }
    }
    let Told { outcome, written } = tell(dir, dir, choice, &note)?;
    print_outcome(&outcome, json, dir, Telling { per_target: true, ..Telling::default() })?;
    written
}
