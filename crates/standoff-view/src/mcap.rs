//! Export of a mission as an MCAP file with Foxglove schemas, written during the mission. `docs/mcap.md` describes the
//! topics.
//!
//! Time stamps are mission time, starting at 0, so the same run gives the same bytes. The file is not compressed.
//! Memory use grows only with the index of the file (a few hundred bytes per megabyte).

mod channels;
mod error;
mod event_log;
mod file;
mod plots;
mod points;
mod pose;
mod scene;
mod shapes;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mcap::Attachment;
use mcap::records::Metadata;
use standoff_io::geodesy::LocalPlane;
use standoff_record::Frame;
use standoff_score::geometry::{Geometry, group_of};
use standoff_sim::scenario::Scenario;
use standoff_sim::world::World;

use channels::Channels;
pub use error::McapError;
use file::Partial;
use plots::{GroupOrbit, UavState};
use scene::Scene;

/// Writes a mission frame by frame.
///
/// The file is written as `FILE.partial`. [`Writer::finish`] renames it to `FILE`, [`Writer::stop`] keeps it under the
/// partial name. Dropping the writer without either call deletes it.
pub struct Writer {
    channels: Channels,
    scene: Scene,
    target_names: Vec<String>,
    plane: Option<LocalPlane>,
    // Last, because fields are dropped in order: the file must be closed before it is deleted.
    partial: Partial,
}

impl Writer {
    /// Creates the file `path` for a mission of `scenario`. `resolved`: text of the scenario with all values, stored in
    /// the file.
    ///
    /// Fails if `path` exists and is not an MCAP file, if another run is writing it, or if it cannot be written.
    pub fn create(path: &Path, scenario: &Scenario, resolved: &str) -> Result<Self, McapError> {
        let (partial, file) = Partial::create(path)?;
        let target_names = World::names(scenario);
        let begin = || -> mcap::McapResult<Channels> {
            let options = mcap::WriteOptions::new().compression(None).library(library());
            let mut writer = options.create(file)?;
            writer.write_metadata(&metadata(scenario))?;
            writer.attach(&Attachment {
                log_time: 0,
                create_time: 0,
                name: "scenario.toml".to_owned(),
                media_type: "application/toml".to_owned(),
                data: Cow::Borrowed(resolved.as_bytes()),
            })?;
            Ok(Channels::new(writer))
        };
        let channels = begin().map_err(|reason| partial.failed(reason))?;
        let plane = scenario.origin().and_then(|origin| origin.plane().ok());
        Ok(Self { channels, scene: Scene::new(scenario), target_names, plane, partial })
    }

    /// Adds a frame, which must be later than the previous one. After an error the file cannot be continued.
    pub fn frame(&mut self, frame: &Frame) -> Result<(), McapError> {
        self.put(frame).map_err(|reason| self.partial.failed(reason))
    }

    fn put(&mut self, frame: &Frame) -> mcap::McapResult<()> {
        let Self { channels, scene, target_names, plane, .. } = self;
        channels.now(frame.time_us);
        channels.put("/tf", &pose::transforms(frame))?;
        let geometry = Geometry::of(frame);
        for row in &frame.uavs {
            let uav = row.uav;
            channels.put(&format!("/uav/{uav}/pose"), &pose::in_world(frame.time_us, row))?;
            if let Some(fix) = plane.as_ref().and_then(|plane| pose::location(frame.time_us, row, plane)) {
                channels.put(&format!("/uav/{uav}/location"), &fix)?;
            }
            let state = UavState::new(row, group_of(frame, row), geometry.off_boresight_rad(row));
            channels.put(&format!("/uav/{uav}/state"), &state)?;
        }
        for row in &frame.groups {
            channels.put(&format!("/group/{}/orbit", row.group), &GroupOrbit::new(row))?;
        }
        let uavs = frame.uavs.iter().map(|row| (row.uav, [row.x_m, row.y_m, pose::altitude_m(row)]));
        let truth = frame.truth.iter().map(|row| (row.target, [row.x_m, row.y_m, 0.0]));
        let tracks = frame.tracks.iter().map(|row| (row.target, [row.state[0], row.state[3], 0.0]));
        channels.put("/points/uavs", &points::cloud(frame.time_us, "uav", uavs))?;
        channels.put("/points/truth", &points::cloud(frame.time_us, "target", truth))?;
        channels.put("/points/tracks", &points::cloud(frame.time_us, "target", tracks))?;
        channels.put("/scene", &scene.update(frame, target_names))?;
        for event in &frame.events {
            channels.put("/log", &event_log::entry(frame.time_us, event, target_names))?;
        }
        Ok(())
    }

    /// Completes the file of a run that was stopped early and keeps it as `FILE.partial`. Returns that path.
    pub fn stop(self) -> Result<PathBuf, McapError> {
        let Self { channels, partial, .. } = self;
        match channels.finish() {
            Ok(file) => partial.leave(file),
            Err(reason) => Err(partial.failed(reason)),
        }
    }

    /// Completes the file and renames it to its final name, replacing an older MCAP file.
    ///
    /// If only renaming fails, the file is kept under its partial name: [`McapError::NotMoved`].
    pub fn finish(self) -> Result<(), McapError> {
        let Self { channels, partial, .. } = self;
        match channels.finish() {
            Ok(file) => partial.publish(file),
            Err(reason) => Err(partial.failed(reason)),
        }
    }
}

/// Name and version of the writing program.
fn library() -> String {
    format!("standoff {}", env!("CARGO_PKG_VERSION"))
}

/// Metadata of the run.
fn metadata(scenario: &Scenario) -> Metadata {
    let settings = &scenario.settings;
    let entries = [
        ("scenario", scenario.name.clone()),
        ("seed", scenario.seed.to_string()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("duration_s", settings.duration.s().to_string()),
        ("period_s", settings.period.s().to_string()),
    ];
    let metadata: BTreeMap<_, _> = entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    Metadata { name: "standoff".to_owned(), metadata }
}
