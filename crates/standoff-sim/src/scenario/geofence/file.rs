//! Reads zones from files: GeoJSON, plans of QGroundControl and KML.

use serde_json::Value;
use standoff_io::display_text::quoted;

use super::super::earth::Earth;
use super::super::polygons::{GeoJson, can_be_degrees, check_metres, rings, states_degrees};
use super::super::schema_types::ZoneKind;
use super::kml;
use super::shapes::{BandM, Contents, Found, INSTEAD, Shape};

/// Reads zones. `earth` places degrees, or states why it cannot. Plans and KML are in degrees. GeoJSON is in degrees if
/// the traffic is, if it states so, or if all its coordinates can be; otherwise it is in metres.
pub(super) fn read(bytes: &[u8], is_metric: bool, earth: &Result<Earth, String>) -> Result<Contents, String> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let in_degrees = |what: &str| {
        earth.as_ref().map_err(|reason| format!("{what} in degrees, but the traffic is in metres and {reason}"))
    };
    let contents = match bytes.trim_ascii_start() {
        [b'<', ..] => kml::read(bytes, in_degrees("KML is")?)?,
        [b'P', b'K', ..] => return Err("is compressed with zip (KMZ); decompress it first, with unzip".to_owned()),
        _ => {
            let json: Value = serde_json::from_slice(bytes)
                .map_err(|error| format!("is not GeoJSON, a plan of QGroundControl or KML: {error}"))?;
            match json.get("geoFence") {
                Some(fence) => plan(fence, in_degrees("a plan of QGroundControl is")?)?,
                None if json.get("fileType").is_some() => {
                    return Err("has no geoFence; must be a plan of QGroundControl with zones".to_owned());
                }
                None => {
                    let is_in_degrees = !is_metric || states_degrees(&json)? || can_be_degrees(&json);
                    let what = "its coordinates are, or can be,";
                    geojson(&json, if is_in_degrees { Some(in_degrees(what)?) } else { None })?
                }
            }
        }
    };
    if contents.zones.is_empty() {
        return Err("has no polygon; must contain a polygon (in a plan, or a circle)".to_owned());
    }
    Ok(contents)
}

/// Reads the polygons and circles of a plan's fence: those with `inclusion` are keep-in zones.
fn plan(fence: &Value, earth: &Earth) -> Result<Contents, String> {
    let list = |key: &str| fence.get(key).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let wrong = |what: &str| format!("geoFence: {what}; save the plan again with QGroundControl");
    let point = |point: &Value| {
        let number = |place: usize| point.get(place).and_then(Value::as_f64);
        let (Some(lat), Some(lon)) = (number(0), number(1)) else {
            return Err(wrong("a position must be [latitude, longitude]"));
        };
        earth.place(lat, lon)
    };
    let kind = |zone: &Value| match zone.get("inclusion").and_then(Value::as_bool) {
        Some(true) => Ok(Some(ZoneKind::KeepIn)),
        Some(false) => Ok(Some(ZoneKind::KeepOut)),
        None => Err(wrong("inclusion must be true or false")),
    };
    let mut contents = Contents::default();
    for zone in list("polygons") {
        let outline =
            zone.get("polygon").and_then(Value::as_array).ok_or_else(|| wrong("a polygon has no positions"))?;
        let shape = Shape::Polygons(vec![vec![outline.iter().map(point).collect::<Result<_, _>>()?]]);
        contents.zones.push(Found { name: String::new(), kind: kind(zone)?, shape, band_m: [None; 2] });
    }
    for zone in list("circles") {
        let number = |path: &str| zone.pointer(path).and_then(Value::as_f64);
        let radius_m = number("/circle/radius").ok_or_else(|| wrong("a circle has no radius"))?;
        let centre_m = point(zone.pointer("/circle/center").unwrap_or(&Value::Null))?;
        contents.zones.push(Found {
            name: String::new(),
            kind: kind(zone)?,
            shape: Shape::Circle { centre_m, radius_m },
            band_m: [None; 2],
        });
    }
    Ok(contents)
}

/// Reads the polygons of GeoJSON. Without `earth`, it must be in metres.
fn geojson(json: &Value, earth: Option<&Earth>) -> Result<Contents, String> {
    let mut zones = Vec::new();
    collect(json, Properties { name: "", band_m: [None; 2] }, earth, &mut zones)?;
    if earth.is_none() {
        let polygons = zones.iter().flat_map(|zone| match &zone.shape {
            Shape::Polygons(polygons) => polygons.as_slice(),
            Shape::Circle { .. } => &[],
        });
        for (index, rings_m) in polygons.enumerate() {
            check_metres(rings_m).map_err(|message| format!("polygon {index} {message}"))?;
        }
    }
    Ok(Contents { zones, note: None })
}

/// Properties of a feature of GeoJSON.
#[derive(Clone, Copy)]
struct Properties<'a> {
    name: &'a str,
    band_m: BandM,
}

/// Reads the polygons of a part of GeoJSON. `outer` are the properties of the feature around it.
fn collect(object: &Value, outer: Properties<'_>, earth: Option<&Earth>, found: &mut Vec<Found>) -> Result<(), String> {
    states_degrees(object)?;
    match GeoJson::of(object)? {
        GeoJson::Collection(parts) => parts.iter().try_for_each(|part| collect(part, outer, earth, found)),
        GeoJson::Feature(geometry) => {
            let property = |key: &str| object.get("properties").and_then(|properties| properties.get(key));
            let altitude_m = |key: &str| match property(key) {
                None | Some(Value::Null) => Ok(None),
                Some(Value::Number(number)) => Ok(number.as_f64()),
                Some(other) => {
                    let value = other.as_str().map_or_else(|| other.to_string(), str::to_owned);
                    Err(format!("properties.{key} = {}: must be a number, m", quoted(&value)))
                }
            };
            let name = property("name").and_then(Value::as_str).unwrap_or(outer.name);
            let band_m = [altitude_m("altitude_min_m")?, altitude_m("altitude_max_m")?];
            let properties = Properties { name, band_m };
            geometry.map_or(Ok(()), |geometry| collect(geometry, properties, earth, found))
        }
        GeoJson::Polygons(polygons) => {
            let parts = polygons.iter().map(|coordinates| rings(coordinates, earth)).collect::<Result<_, _>>()?;
            let shape = Shape::Polygons(parts);
            found.push(Found { name: outer.name.to_owned(), kind: None, shape, band_m: outer.band_m });
            Ok(())
        }
        GeoJson::Other(kind) => Err(format!("feature {}is a {kind}: {INSTEAD}", super::shapes::named(outer.name))),
    }
}
