//! Writes the mission as an MCAP file, in addition to the record.

use std::path::{Path, absolute};

use standoff_app::Failure;
use standoff_io::display_text;
use standoff_record::Frame;
use standoff_sim::scenario::Scenario;
use standoff_view::mcap::{McapError, Writer};

use crate::terminal::note;

/// MCAP file that is being written. If writing fails, the mission continues, and [`Mcap::close`] returns the error.
pub(crate) struct Mcap {
    writer: Result<Writer, McapError>,
    has_frames: bool,
}

impl Mcap {
    /// Creates the file for a run whose record is written to `out`.
    pub(crate) fn create(file: &Path, scenario: &Scenario, out: &Path) -> Result<Self, Failure> {
        let [inside, folder] = [file, out].map(|path| absolute(path).map_err(Failure::input));
        if inside?.starts_with(folder?) {
            let what = "lies in the folder of the run, which may contain only its record; name a file outside it";
            return Err(Failure::Input(format!("{}: {what}", display_text::path(file))));
        }
        let resolved = scenario.resolved().map_err(Failure::Scenario)?;
        let replaces_file = file.exists();
        let writer = Writer::create(file, scenario, &resolved).map_err(Failure::input)?;
        if replaces_file {
            note(&format!("note: replacing the older file {}", display_text::path(file)));
        }
        Ok(Self { writer: Ok(writer), has_frames: false })
    }

    /// Writes a time step.
    pub(crate) fn frame(&mut self, frame: &Frame) {
        self.has_frames = true;
        if let Ok(writer) = &mut self.writer
            && let Err(error) = writer.frame(frame)
        {
            self.writer = Err(error);
        }
    }

    /// Ends the file of an interrupted run, and prints its path or what went wrong. A file without time steps is
    /// removed.
    pub(crate) fn stop(self) {
        if !self.has_frames {
            return;
        }
        match self.writer.and_then(Writer::stop) {
            Ok(path) => {
                note(&format!("note: the MCAP file up to the interruption is in {}", display_text::path(&path)))
            }
            Err(error) => note(&format!("warning: {error}")),
        }
    }

    /// Completes the file; fails if any part of it could not be written.
    pub(crate) fn close(self) -> Result<(), Failure> {
        self.writer.and_then(Writer::finish).map_err(Failure::running)
    }
}
