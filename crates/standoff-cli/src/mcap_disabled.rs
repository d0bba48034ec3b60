//! Replacement for `mcap.rs` in builds without the feature `mcap`: fails with advice to build with it.

use std::path::Path;

use standoff_app::Failure;
use standoff_record::Frame;
use standoff_sim::scenario::Scenario;

/// MCAP writer that cannot exist in this build.
pub(crate) enum Mcap {}

impl Mcap {
    pub(crate) fn create(_file: &Path, _scenario: &Scenario, _out: &Path) -> Result<Self, Failure> {
        let what = "this build cannot write MCAP files; rebuild with: cargo build --release --features mcap";
        Err(Failure::Input(what.to_owned()))
    }

    pub(crate) fn frame(&mut self, _frame: &Frame) {
        match *self {}
    }

    pub(crate) fn stop(self) {
        match self {}
    }

    pub(crate) fn close(self) -> Result<(), Failure> {
        match self {}
    }
}
