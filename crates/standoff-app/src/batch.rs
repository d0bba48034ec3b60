//! The HTML page of a batch.

use std::slice;

use standoff_sim::monte_carlo::Results;
use standoff_view::batch::Batch;
use standoff_view::page;

use crate::error::{Failure, of_batch};

/// File name of a batch's page, next to its results.
pub const REPORT: &str = "report.html";

/// Renders the page of a complete batch; returns `None` if the folder has it already.
pub fn batch_page(results: &Results) -> Result<Option<String>, Failure> {
    if results.dir().join(REPORT).is_file() {
        return Ok(None);
    }
    let shown = Batch::of(slice::from_ref(results)).map_err(of_batch)?;
    page::batch_report(&shown).map(Some).map_err(Failure::running)
}
