//! Polygons of map files in the plane of the scenario: those of zones and of buildings.

use serde_json::Value;
use standoff_io::display_text::quoted;
use standoff_io::geodesy::LocalPlane;

/// Rings of a polygon: the outline, then the holes; east and north, m.
pub(super) type Rings = Vec<Vec<[f64; 2]>>;

/// Converts degrees to east and north, m. Rounded to the millimetre for the record.
pub(super) fn place(latitude_deg: f64, longitude_deg: f64, plane: &LocalPlane) -> Result<[f64; 2], String> {
    let at = plane
        .position(latitude_deg, longitude_deg)
        .map_err(|error| format!("[{longitude_deg}, {latitude_deg}] is not near the traffic: {error}"))?;
    Ok([at.x_m(), at.y_m()].map(|metres| (metres * 1e3).round() / 1e3))
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
    /// Points and lines, which enclose nothing.
    Other,
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
            "Point" | "MultiPoint" | "LineString" | "MultiLineString" => Self::Other,
            kind => return Err(format!("type = {}: must be a type of GeoJSON", quoted(kind))),
        })
    }
}

/// Reads the rings of a polygon of GeoJSON. Degrees are converted to the plane; without it, they are in metres.
pub(super) fn rings(coordinates: &Value, plane: Option<&LocalPlane>) -> Result<Rings, String> {
    let nested = || "a polygon's coordinates must be lists of [longitude, latitude], or of [east, north]".to_owned();
    let point = |point: &Value| -> Result<[f64; 2], String> {
        let number = |place: usize| point.get(place).and_then(Value::as_f64);
        let (Some(x), Some(y)) = (number(0), number(1)) else { return Err(nested()) };
        plane.map_or(Ok([x, y]), |plane| place(y, x, plane))
    };
    let ring = |ring: &Value| ring.as_array().ok_or_else(nested)?.iter().map(point).collect();
    coordinates.as_array().ok_or_else(nested)?.iter().map(ring).collect()
}
