//! Background maps of runs: given by the user, or named by the scenario.

use std::path::{Path, PathBuf};

use standoff_io::bounded_input::advice;
use standoff_io::{atomic_file, display_text};
use standoff_map::{Bounds, MapError, Packed, Place, pack};
use standoff_record::{MAP_FILE, Record};
use standoff_sim::scenario::{MAPS_MAX, MapFile, Scenario, Targets};
use standoff_view::Bytes;

use crate::error::{Failure, of_record};
use crate::warnings::Warnings;

/// Background maps that replace those of the scenario: SUMO nets (.net.xml) or GeoJSON, plain or .gz. If empty, the
/// scenario's own maps are used.
#[derive(Debug, Clone, Default)]
pub struct Maps(pub Vec<PathBuf>);

impl Maps {
    /// Returns the map for a run of this scenario, packed for the page; `None` if it has no map.
    pub fn of_scenario(&self, scenario: &Scenario, on_warning: Warnings) -> Result<Option<Bytes>, Failure> {
        let files = if self.0.is_empty() { scenario.map.clone() } else { self.files()? };
        packed(&files, scenario.origin(), || Ok(bounds(scenario)), on_warning)
    }

    /// Returns the map for a recorded run: the map in the record, unless the user gave maps.
    pub fn of_record(&self, record: &Record, on_warning: Warnings) -> Result<Option<Bytes>, Failure> {
        if self.0.is_empty() {
            return Ok(standoff_map::of_record(record.dir())
                .unwrap_or_else(|what| {
                    on_warning(&format!("warning: {what}; the page shows no map; to use another one, give --map FILE"));
                    None
                })
                .map(|packed| packed.gz.into()));
        }
        packed(
            &self.files()?,
            record.manifest().origin,
            || {
                let mut bounds = None;
                record.each_uav(|row| bounds = Bounds::around(bounds, [row.x_m, row.y_m])).map_err(of_record)?;
                Ok(bounds)
            },
            on_warning,
        )
    }

    /// Replaces the map in the record in `dir`, if the user gave maps.
    pub fn replace_in_record(&self, dir: &Path, on_warning: Warnings) -> Result<(), Failure> {
        if self.0.is_empty() {
            return Ok(());
        }
        let record = Record::open(dir).map_err(of_record)?;
        let Some(map) = self.of_record(&record, on_warning)? else { return Ok(()) };
        let path = dir.join(MAP_FILE);
        atomic_file::save_quickly(&path, &map).map_err(|reason| {
            let advice = advice(&reason, "check the disk");
            Failure::running(format!("cannot write {}: {reason}; {advice}", display_text::path(&path)))
        })
    }

    fn files(&self) -> Result<Vec<MapFile>, Failure> {
        if self.0.len() > MAPS_MAX {
            return Err(Failure::Input(format!("{} maps were given; at most {MAPS_MAX}", self.0.len())));
        }
        Ok(self.0.iter().cloned().map(MapFile::OnDisk).collect())
    }
}

fn packed(
    files: &[MapFile],
    origin: Option<standoff_io::geodesy::Origin>,
    bounds: impl FnOnce() -> Result<Option<Bounds>, Failure>,
    on_warning: Warnings,
) -> Result<Option<Bytes>, Failure> {
    if files.is_empty() {
        return Ok(None);
    }
    let Some(bounds) = bounds()? else { return Ok(None) };
    let Packed { gz, note: left_out } = pack(files, &Place { origin, bounds }).map_err(of_map)?;
    left_out.iter().for_each(|what| on_warning(&format!("note: {what}")));
    Ok(Some(gz.into()))
}

/// Converts an error of a map; an invalid map counts as wrong input.
fn of_map(error: MapError) -> Failure {
    if error.is_io_error { Failure::running(error) } else { Failure::input(error) }
}

/// Returns the bounds of the initial UAV positions and of the target positions.
fn bounds(scenario: &Scenario) -> Option<Bounds> {
    let mut bounds = None;
    let mut add = |point| bounds = Bounds::around(bounds, point);
    scenario.uavs.iter().for_each(|uav| add([uav.position.x_m(), uav.position.y_m()]));
    match &scenario.targets {
        Targets::Traffic(traffic) => traffic.places().for_each(add),
        Targets::Random { start, .. } => {
            let duration_s = scenario.settings.duration.s();
            for state in start {
                let (at, velocity) = (state.position(), state.velocity());
                let by = |place_m: f64, speed_m_s: f64| place_m + speed_m_s * duration_s;
                add([at.x_m(), at.y_m()]);
                add([by(at.x_m(), velocity.x_m_s()), by(at.y_m(), velocity.y_m_s())]);
            }
        }
    }
    bounds
}
