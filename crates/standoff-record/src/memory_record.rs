//! A record in memory, for programs without a file system.

use crate::directory::SCENARIO;
use crate::error::RecordError;
use crate::frame::Frame;
use crate::frame_tables::{DerivedColumns, FrameTables, write_targets};
use crate::manifest::{MANIFEST, Manifest};

/// Makes the files of a record in memory. They have the same bytes as those that a [`Writer`](crate::Writer) publishes.
pub struct MemoryRecord {
    tables: FrameTables,
    manifest: Manifest,
    /// Names and bytes of the files that do not grow.
    files: Vec<(String, Vec<u8>)>,
}

impl MemoryRecord {
    /// Starts a record with the targets' names by id, and with columns that `derive` computes from each frame.
    pub fn create(
        manifest: &Manifest,
        scenario_toml: &str,
        target_names: &[String],
        derive: impl FnMut(&Frame) -> DerivedColumns + Send + 'static,
    ) -> Result<Self, RecordError> {
        let manifest = manifest.begun();
        let mut tables = FrameTables::create(None, &manifest, target_names.len())?;
        tables.derive = Some(Box::new(derive));
        let scenario = (SCENARIO.to_owned(), scenario_toml.into());
        let files = [scenario].into_iter().chain(write_targets(None, target_names)?).collect();
        Ok(Self { tables, manifest, files })
    }

    /// Adds a time step, as [`Writer::frame`](crate::Writer::frame) does.
    pub fn frame(&mut self, frame: &Frame) -> Result<(), RecordError> {
        self.tables.frame(frame)
    }

    /// Completes the record; returns the names and bytes of its files.
    pub fn finish(mut self) -> Result<Vec<(String, Vec<u8>)>, RecordError> {
        self.tables.finish()?;
        let manifest = self.tables.completed(&self.manifest).to_json()?;
        self.files.push((MANIFEST.to_owned(), manifest.into()));
        self.files.extend(self.tables.into_files());
        Ok(self.files)
    }
}
