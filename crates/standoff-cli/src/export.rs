//! `standoff export`: writes a recorded run for maps and globes.

use std::path::PathBuf;

use chrono::{DateTime, Utc};
use clap::{ArgGroup, Parser};
use standoff_app::{Export, ExportFormat, ExportOptions, Failure, of_record, report_end, save};
use standoff_io::geodesy::Origin;
use standoff_record::Record;

use crate::fly::pair;
use crate::terminal::note;

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff export standoff-out/city-1 --kml city.kml
  standoff export standoff-out/improved/figure-9-1 --geojson run.geojson \\
    --origin 47.4,8.5 --begin 2026-07-01T10:00:00Z";

/// Options of `standoff export`.
#[derive(Parser)]
#[command(group = ArgGroup::new("format").args(["kml", "geojson", "gpx", "czml"]).required(true).multiple(true))]
pub(crate) struct Args {
    /// The folder of the run.
    dir: PathBuf,
    /// Write KML (Google Earth, QGIS).
    #[arg(long, value_name = "FILE")]
    kml: Option<PathBuf>,
    /// Write GeoJSON (GIS, web maps).
    #[arg(long, value_name = "FILE")]
    geojson: Option<PathBuf>,
    /// Write GPX (navigation): the paths, and the gaps as waypoints.
    #[arg(long, value_name = "FILE")]
    gpx: Option<PathBuf>,
    /// Write CZML (Cesium).
    #[arg(long, value_name = "FILE")]
    czml: Option<PathBuf>,
    /// Place of the coordinates 0, 0 of a run in metres, degrees.
    #[arg(long, value_name = "LATITUDE,LONGITUDE", value_parser = pair, allow_hyphen_values = true)]
    origin: Option<[f64; 2]>,
    /// Wall-clock time of the start of a run without it, with its offset from UTC [default: 1970-01-01T00:00:00Z].
    #[arg(long, value_name = "TIME", value_parser = time)]
    begin: Option<DateTime<Utc>>,
    /// Time between two outlines of an orbit, a field of view or an uncertainty, s; 0.1 to 3600.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = interval)]
    every: f64,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let record = Record::open(&args.dir).map_err(of_record)?;
    report_end(&record, &note);
    let origin = args.origin.map(|[latitude_deg, longitude_deg]| Origin { latitude_deg, longitude_deg });
    let export = Export::of(&record, &ExportOptions { origin, begin: args.begin, interval_s: args.every })?;
    let files = [
        (&args.kml, ExportFormat::Kml),
        (&args.geojson, ExportFormat::GeoJson),
        (&args.gpx, ExportFormat::Gpx),
        (&args.czml, ExportFormat::Czml),
    ];
    for (file, format) in files {
        if let Some(file) = file {
            save(file, &export.text(format)?)?;
        }
    }
    Ok(())
}

fn time(text: &str) -> Result<DateTime<Utc>, String> {
    let error = |_| format!("`{text}`: must be a date and a time, for example 2026-07-01T10:00:00Z");
    DateTime::parse_from_rfc3339(text).map(DateTime::from).map_err(error)
}

fn interval(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.1..=3600.0).contains(seconds));
    seconds.ok_or_else(|| format!("`{text}`: must be between 0.1 and 3600 s"))
}
