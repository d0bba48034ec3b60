//! What lies under the vehicles: the maps that somebody names, or the scenario.

use std::path::PathBuf;

use standoff_map::{Bounds, MapError, Packed, Place, pack};
use standoff_sim::record::Record;
use standoff_sim::scenario::{MAPS_MAX, MapFile, Scenario, Targets};
use standoff_view::serve::Bytes;

use crate::failure::{Failure, of_record};
use crate::say::Say;

/// Maps to look at, in the place of those that the scenario names: SUMO nets (.net.xml) or GeoJSON, plain or .gz.
#[derive(Debug, Clone, Default)]
pub struct Maps(pub Vec<PathBuf>);

impl Maps {
    /// The map of a run of this scenario, packed as pages show it; `None` if there is none.
    pub fn of_scenario(&self, scenario: &Scenario, say: Say) -> Result<Option<Bytes>, Failure> {
        let files = if self.0.is_empty() { scenario.map.clone() } else { self.files()? };
        packed(&files, scenario.origin(), || Ok(bounds(scenario)), say)
    }

    /// The map of a run that has been flown: what the record keeps, if none is named.
    pub fn of_record(&self, record: &Record, say: Say) -> Result<Option<Bytes>, Failure> {
        if self.0.is_empty() {
            return Ok(standoff_map::of_record(record.dir())
                .unwrap_or_else(|what| {
                    say(&format!("warning: {what}; the page shows no map; --map FILE names another one"));
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
            say,
        )
    }

    fn files(&self) -> Result<Vec<MapFile>, Failure> {
        if self.0.len() > MAPS_MAX {
            return Err(Failure::Input(format!("{} maps are named; at most {MAPS_MAX}", self.0.len())));
        }
        Ok(self.0.iter().cloned().map(MapFile::OnDisk).collect())
    }
}

fn packed(
    files: &[MapFile],
    origin: Option<standoff_sim::traffic::Origin>,
    bounds: impl FnOnce() -> Result<Option<Bounds>, Failure>,
    say: Say,
) -> Result<Option<Bytes>, Failure> {
    if files.is_empty() {
        return Ok(None);
    }
    let Some(bounds) = bounds()? else { return Ok(None) };
    let Packed { gz, note: left_out } = pack(files, &Place { origin, bounds }).map_err(of_map)?;
    left_out.iter().for_each(|what| say(&format!("note: {what}")));
    Ok(Some(gz.into()))
}

/// A map that is not what it should be is wrong input.
fn of_map(error: MapError) -> Failure {
    if error.is_machine_s { Failure::running(error) } else { Failure::input(error) }
}

/// Where UAVs start and targets are.
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
