//! Zones of a file, before they become those of a scenario.

use standoff_io::display_text::quoted;

use super::super::polygons::Rings;
use super::super::schema_types::ZoneKind;

/// Advice on how to give a circle, which files give as points.
pub(super) const INSTEAD: &str =
    "a zone is a polygon; remove it, or give a circle in the scenario (lat_deg, lon_deg, radius_m)";

/// Advice for a zone smaller than 1 m.
pub(super) const TRULY_SMALL: &str = "if it is that small, set its `coordinates`";

/// Maximum number of zones or properties that a message names.
pub(super) const NAMED: usize = 5;

/// A zone of a file, in the plane of the scenario.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) name: String,
    /// Kind, if the file determines it.
    pub(super) kind: Option<ZoneKind>,
    pub(super) shape: Shape,
    pub(super) band_m: BandM,
}

/// Floor and ceiling of a zone, if the file determines them, m.
pub(super) type BandM = [Option<f64>; 2];

#[derive(Debug)]
pub(super) enum Shape {
    /// The union of its parts.
    Polygons(Vec<Rings>),
    Circle {
        centre_m: [f64; 2],
        radius_m: f64,
    },
}

/// Zones of a file, and what the user should know about them.
#[derive(Debug, Default)]
pub(super) struct Contents {
    pub(super) zones: Vec<Found>,
    pub(super) notes: Vec<String>,
}

/// Name of a shape in a message, with a blank after it; empty without a name.
pub(super) fn named(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!("{} ", quoted(name)) }
}
