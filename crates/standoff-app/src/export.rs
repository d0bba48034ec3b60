//! `standoff export`: writes the paths, orbits, fields of view and gaps of a recorded run for maps and globes.

mod czml;
mod geojson;
mod gpx;
mod kml;
mod model;
mod reader;
mod xml;

use chrono::{DateTime, Utc};
use standoff_io::geodesy::Origin;
use standoff_record::Record;

use crate::error::{Failure, of_record};
use crate::report::settings_of;
pub use model::Export;
pub(crate) use model::utc;
use reader::Reader;

/// Format of an exported file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportFormat {
    /// KML 2.2 with the tracks of Google's extension, for Google Earth and QGIS.
    Kml,
    /// GeoJSON (RFC 7946), for GIS and web maps.
    GeoJson,
    /// GPX 1.1, for navigation software: the paths, and the gaps as waypoints.
    Gpx,
    /// CZML, for Cesium.
    Czml,
}

/// How a run is exported.
#[derive(Debug, Clone, Copy)]
pub struct ExportOptions {
    /// Origin of the local plane, for a record without one.
    pub origin: Option<Origin>,
    /// Wall-clock time of the start of the mission, for a record without one. `None`: the start of 1970.
    pub begin: Option<DateTime<Utc>>,
    /// Time between two outlines of an orbit, a field of view or an uncertainty, s.
    pub interval_s: f64,
}

impl Export {
    /// Reads a recorded run. Fails if it has no origin and `options` have none, or if it has what they give.
    pub fn of(record: &Record, options: &ExportOptions) -> Result<Self, Failure> {
        let manifest = record.manifest();
        let origin = match (manifest.origin, options.origin) {
            (Some(_), Some(_)) => {
                return Err(Failure::Input("--origin: the record has its own origin; leave the option out".to_owned()));
            }
            (Some(origin), None) | (None, Some(origin)) => origin,
            (None, None) => {
                let what = "the coordinates of this run are metres without a place on the Earth; give --origin LATITUDE,LONGITUDE";
                return Err(Failure::Input(what.to_owned()));
            }
        };
        let begin = match (manifest.begin_unix_us, options.begin) {
            (Some(_), Some(_)) => {
                return Err(Failure::Input("--begin: the record has its own time; leave the option out".to_owned()));
            }
            (known_us, given) => known_us.and_then(DateTime::from_timestamp_micros).or(given).unwrap_or_default(),
        };
        let plane = origin.plane().map_err(|error| Failure::Input(format!("--origin: {error}")))?;
        let settings = settings_of(record)?;
        let mut reader = Reader::new(plane, &settings, record, options.interval_s);
        for frame in record.frames().map_err(of_record)? {
            reader.frame(&frame.map_err(of_record)?)?;
        }
        reader.finish(manifest.title(), begin)
    }

    /// Returns the run as text in a format.
    pub fn text(&self, format: ExportFormat) -> Result<String, Failure> {
        match format {
            ExportFormat::Kml => kml::text(self),
            ExportFormat::GeoJson => Ok(geojson::text(self)),
            ExportFormat::Gpx => gpx::text(self),
            ExportFormat::Czml => Ok(czml::text(self)),
        }
    }
}

#[cfg(test)]
mod tests;
