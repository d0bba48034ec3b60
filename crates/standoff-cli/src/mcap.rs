//! The mission as an MCAP file beside the record.

use std::path::{Path, absolute};

use standoff_results::Failure;
use standoff_sim::record::Frame;
use standoff_sim::scenario::Scenario;
use standoff_sim::text;
use standoff_view::mcap::{McapError, Writer};

use crate::speech::note;

/// The file while it is written. If that fails, the mission flies on, and [`Mcap::close`] tells.
pub(crate) struct Mcap {
    writer: Result<Writer, McapError>,
    has_frames: bool,
}

impl Mcap {
    /// Begins the file of a run whose record goes to `out`.
    pub(crate) fn create(file: &Path, scenario: &Scenario, out: &Path) -> Result<Self, Failure> {
        let [inside, folder] = [file, out].map(|path| absolute(path).map_err(Failure::input));
        if inside?.starts_with(folder?) {
            let what = "lies in the folder of the run, which holds its record alone; name a file outside it";
            return Err(Failure::Input(format!("{}: {what}", text::path(file))));
        }
        let resolved = scenario.resolved().map_err(Failure::Scenario)?;
        let is_there = file.exists();
        let writer = Writer::create(file, scenario, &resolved).map_err(Failure::input)?;
        if is_there {
            note(&format!("note: replacing the older file {}", text::path(file)));
        }
        Ok(Self { writer: Ok(writer), has_frames: false })
    }

    /// Adds an instant.
    pub(crate) fn frame(&mut self, frame: &Frame) {
        self.has_frames = true;
        if let Ok(writer) = &mut self.writer
            && let Err(error) = writer.frame(frame)
        {
            self.writer = Err(error);
        }
    }

    /// Ends the file of a run that was ended early, and tells where it is; what went wrong with it is told, too. One
    /// without an instant is removed.
    pub(crate) fn stop(self) {
        if !self.has_frames {
            return;
        }
        match self.writer.and_then(Writer::stop) {
            Ok(kept) => note(&format!("note: the MCAP file ends with the run and stays in {}", text::path(&kept))),
            Err(error) => note(&format!("warning: {error}")),
        }
    }

    /// Completes the file, or tells why it could not be written.
    pub(crate) fn close(self) -> Result<(), Failure> {
        self.writer.and_then(Writer::finish).map_err(Failure::running)
    }
}
