//! Runs and batches in folders: flown there, and told from there. The command and the Python package share it.
//!
//! ```text
//! scenario -> fly -> record -> tell -> outcome (a table, JSON), summary.json, figures, report.html
//! ```
//!
//! Nothing here prints: what is odd goes to a [`Say`], what fails is a [`Failure`] that tells what to do.

mod batch;
mod failure;
mod flight;
mod maps;
mod outcome;
mod say;
mod tell;
mod waiting;
mod yardstick;

pub use batch::{REPORT, report};
pub use failure::{Failure, of_batch, of_record, refused};
pub use flight::{fly, has_older_run, manifest};
pub use maps::Maps;
pub use outcome::{Outcome, Telling, count, lines, wrapped};
pub use say::{Say, warn};
pub use tell::{Told, save, settings_of, tell, tell_end, tell_left_out};
pub use waiting::{GLANCE, done_unless};
pub use yardstick::Yardsticked;
