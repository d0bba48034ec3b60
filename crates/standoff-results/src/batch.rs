//! The page of a batch.

use std::slice;

use standoff_sim::monte_carlo::Results;
use standoff_view::batch::Batch;
use standoff_view::page;

use crate::failure::{Failure, of_batch};

/// The page of a batch, beside its results.
pub const REPORT: &str = "report.html";

/// The page of a complete batch; `None` if it is there already.
pub fn report(results: &Results) -> Result<Option<String>, Failure> {
    if results.dir().join(REPORT).is_file() {
        return Ok(None);
    }
    let shown = Batch::of(slice::from_ref(results)).map_err(of_batch)?;
    page::batch_report(&shown).map(Some).map_err(Failure::running)
}
