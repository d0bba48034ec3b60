//! Polygons of map files in the plane of the scenario: those of zones and of buildings.

use serde_json::Value;
use standoff_io::display_text::quoted;

use super::earth::Earth;

/// Rings of a polygon: the outline, then the holes; east and north, m.
pub(super) type Rings = Vec<Vec<[f64; 2]>>;

/// Names of WGS 84 in old GeoJSON files.
const WGS84: [&str; 5] =
    ["urn:ogc:def:crs:OGC:1.3:CRS84", "urn:ogc:def:crs:OGC::CRS84", "CRS84", "EPSG:4326", "urn:ogc:def:crs:EPSG::4326"];

/// Returns whether an object of GeoJSON states that its coordinates are degrees. Fails if it states another frame.
pub(super) fn states_degrees(object: &Value) -> Result<bool, String> {
    let Some(crs) = object.get("crs").filter(|crs| !crs.is_null()) else { return Ok(false) };
    let name = crs.pointer("/properties/name").and_then(Value::as_str);
    if name.is_some_and(|name| WGS84.contains(&name)) {
        return Ok(true);
    }
    let stated = name.map_or_else(|| crs.to_string(), str::to_owned);
    Err(format!(
        "crs = {}: must be WGS 84 (EPSG:4326); convert the file, with ogr2ogr -t_srs EPSG:4326",
        quoted(&stated)
    ))
}

/// Returns true if GeoJSON has coordinates, and all of them can be degrees.
pub(super) fn can_be_degrees(object: &Value) -> bool {
    let mut points = Vec::new();
    collect_points(object, &mut points);
    !points.is_empty() && points.iter().all(|[x, y, _]| x.abs() <= 180.0 && y.abs() <= 90.0)
}

/// Returns true if a position of GeoJSON has an altitude other than zero.
pub(super) fn has_altitudes(object: &Value) -> bool {
    let mut points = Vec::new();
    collect_points(object, &mut points);
    points.iter().any(|[.., altitude_m]| *altitude_m != 0.0)
}

/// Collects all positions in a part of GeoJSON, with their altitudes or zero.
fn collect_points(part: &Value, points: &mut Vec<[f64; 3]>) {
    let number = |place: usize| part.get(place).and_then(Value::as_f64);
    match (number(0), number(1)) {
        (Some(x), Some(y)) => points.push([x, y, number(2).unwrap_or_default()]),
        _ => {
            let members = ["features", "geometry", "geometries", "coordinates"].iter().filter_map(|key| part.get(key));
            let parts = part.as_array().map(Vec::as_slice).unwrap_or_default();
            members.chain(parts).for_each(|part| collect_points(part, points));
        }
    }
}

/// Checks a polygon whose coordinates are read as metres.
pub(super) fn check_metres(rings_m: &Rings) -> Result<(), &'static str> {
    let is_small = |axis: usize| {
        let values = || rings_m.iter().flatten().map(|point| point[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min) < 1.0
    };
    if is_small(0) && is_small(1) {
        return Err("is smaller than 1 m; its coordinates are probably degrees, but the traffic is in metres; give \
                    metres, or use traffic in degrees");
    }
    Ok(())
}

/// An object of GeoJSON, by what a reader of polygons does with it.
pub(super) enum GeoJson<'a> {
    /// Features or geometries.
    Collection(&'a [Value]),
    /// The geometry of a feature, if it has one.
    Feature(Option<&'a Value>),
    /// Coordinates of polygons.
    Polygons(&'a [Value]),
    /// Points and lines, which enclose nothing, by type.
    Other(&'a str),
}

impl<'a> GeoJson<'a> {
    pub(super) fn of(object: &'a Value) -> Result<Self, String> {
        let list = |key: &str| object.get(key).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
        Ok(match object.get("type").and_then(Value::as_str).unwrap_or_default() {
            "FeatureCollection" => Self::Collection(list("features")),
            "GeometryCollection" => Self::Collection(list("geometries")),
            "Feature" => Self::Feature(object.get("geometry").filter(|geometry| !geometry.is_null())),
            "Polygon" => Self::Polygons(std::slice::from_ref(object.get("coordinates").unwrap_or(&Value::Null))),
            "MultiPolygon" => Self::Polygons(list("coordinates")),
            kind @ ("Point" | "MultiPoint" | "LineString" | "MultiLineString") => Self::Other(kind),
            kind => return Err(format!("type = {}: must be a type of GeoJSON", quoted(kind))),
        })
    }
}

/// Reads the rings of a polygon of GeoJSON. Degrees are placed by `earth`; without it, they are in metres.
pub(super) fn rings(coordinates: &Value, earth: Option<&Earth>) -> Result<Rings, String> {
    let nested = || "a polygon's coordinates must be lists of [longitude, latitude], or of [east, north]".to_owned();
    let point = |point: &Value| -> Result<[f64; 2], String> {
        let number = |place: usize| point.get(place).and_then(Value::as_f64);
        let (Some(x), Some(y)) = (number(0), number(1)) else { return Err(nested()) };
        earth.map_or(Ok([x, y]), |earth| earth.place(y, x))
    };
    let ring = |ring: &Value| ring.as_array().ok_or_else(nested)?.iter().map(point).collect();
    coordinates.as_array().ok_or_else(nested)?.iter().map(ring).collect()
}
