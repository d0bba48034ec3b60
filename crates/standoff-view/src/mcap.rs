//! A mission as an MCAP file with Foxglove's schemas, written while it is flown; `docs/mcap.md` tells its topics.
//!
//! Its clock is that of the mission, from 0: the same run gives the same bytes. Nothing is compressed, and what is held
//! in memory does not grow with the mission but for the index of the file (some hundred bytes for every megabyte).

mod channels;
mod error;
mod file;
mod log;
mod numbers;
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
use standoff_geodesy::LocalPlane;
use standoff_sim::geometry::{Geometry, group_of};
use standoff_sim::record::Frame;
use standoff_sim::scenario::Scenario;
use standoff_sim::world::World;

use channels::Channels;
pub use error::McapError;
use file::Partial;
use numbers::{GroupOrbit, UavState};
use scene::Scene;

/// Writes a mission, frame by frame.
///
/// The file grows as `FILE.partial`. [`Writer::finish`] moves it to its place, [`Writer::stop`] leaves it there; a writer
/// that is dropped before removes it.
pub struct Writer {
    channels: Channels,
    scene: Scene,
    target_names: Vec<String>,
    plane: Option<LocalPlane>,
    // Last, as fields are dropped in order: the file is closed before it is removed.
    partial: Partial,
}

impl Writer {
    /// Begins the file `path` of a scenario; `resolved` is its text with every value spelt out, which the file keeps.
    ///
    /// Fails if `path` is there and is no MCAP file, if another run is writing it, or if it cannot be written.
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

    /// Adds an instant, later than the one before. After an error the file cannot be continued.
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
            let state = UavState::new(row, group_of(frame, row), geometry.line_of_sight_rad(row));
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
            channels.put("/log", &log::entry(frame.time_us, event, target_names))?;
        }
        Ok(())
    }

    /// Completes the file of a run that was ended early, and leaves it as `FILE.partial`: gives that path.
    pub fn stop(self) -> Result<PathBuf, McapError> {
        let Self { channels, partial, .. } = self;
        match channels.finish() {
            Ok(file) => partial.leave(file),
            Err(reason) => Err(partial.failed(reason)),
        }
    }

    /// Completes the file and moves it to its place; an older MCAP file there is replaced.
    ///
    /// If only the move fails, the file is kept where it is: [`McapError::NotMoved`].
    pub fn finish(self) -> Result<(), McapError> {
        let Self { channels, partial, .. } = self;
        match channels.finish() {
            Ok(file) => partial.publish(file),
            Err(reason) => Err(partial.failed(reason)),
        }
    }
}

/// What wrote the file.
fn library() -> String {
    format!("standoff {}", env!("CARGO_PKG_VERSION"))
}

/// What was flown.
fn metadata(scenario: &Scenario) -> Metadata {
    let settings = &scenario.settings;
    let told = [
        ("scenario", scenario.name.clone()),
        ("seed", scenario.seed.to_string()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("duration_s", settings.duration.s().to_string()),
        ("period_s", settings.period.s().to_string()),
    ];
    let metadata: BTreeMap<_, _> = told.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    Metadata { name: "standoff".to_owned(), metadata }
}
