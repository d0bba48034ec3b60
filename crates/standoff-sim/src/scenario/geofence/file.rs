//! Reads zones from files: GeoJSON, plans of QGroundControl and KML.

use std::collections::BTreeSet;

use serde_json::Value;
use standoff_io::display_text::quoted;
use standoff_io::text_source;

use super::super::earth::Earth;
use super::super::polygons::{GeoJson, can_be_degrees, check_metres, has_altitudes, rings, states_degrees};
use super::super::schema_types::ZoneKind;
use super::kml::{self, ZONES, described};
use super::shapes::{BandM, Contents, Found, INSTEAD, NAMED, Shape, TRULY_SMALL};
use crate::traffic::Coordinates;

/// Advice for a file of QGroundControl without a fence.
const DRAW_THE_FENCE: &str = "open it with QGroundControl, draw the fence and save it as .plan";

/// Reads zones. `earth` places degrees, or states why it cannot. Plans and KML are in degrees. GeoJSON has the given
/// `coordinates`. If none are given, it is in degrees if the traffic is, if it states so, or if all its coordinates can
/// be; otherwise it is in metres.
pub(super) fn read(
    bytes: &[u8],
    coordinates: Coordinates,
    is_metric: bool,
    earth: &Result<Earth, String>,
) -> Result<Contents, String> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let only_degrees = |what: &str| match coordinates {
        Coordinates::Metres => {
            Err(format!("{what} in degrees, but `coordinates` of the zone is \"metres\"; remove it"))
        }
        Coordinates::Auto | Coordinates::Degrees => Ok(()),
    };
    let in_degrees = |what: &str| {
        earth.as_ref().map_err(|reason| format!("{what} in degrees, but the traffic is in metres and {reason}"))
    };
    let contents = match bytes.trim_ascii_start() {
        [b'<', ..] => {
            only_degrees("KML is")?;
            kml::read(bytes, in_degrees("KML is")?)?
        }
        [b'Q', b'G', b'C', b' ', ..] => {
            return Err(format!("is a list of waypoints; must be {}; {DRAW_THE_FENCE}", ZONES.formats));
        }
        _ => {
            text_source::check_is_text(bytes, &ZONES).map_err(described)?;
            let json: Value = serde_json::from_slice(bytes)
                .map_err(|error| format!("is not GeoJSON, a plan of QGroundControl or KML: {error}"))?;
            match json.get("geoFence") {
                Some(fence) => {
                    check_version(fence)?;
                    only_degrees("a plan of QGroundControl is")?;
                    plan(fence, in_degrees("a plan of QGroundControl is")?)?
                }
                None if json.get("fileType").is_some() || json.get("groundStation").is_some() => {
                    return Err(format!(
                        "has no geoFence; must be a plan of QGroundControl with zones; {DRAW_THE_FENCE}"
                    ));
                }
                None => {
                    let is_in_degrees = match coordinates {
                        Coordinates::Auto => !is_metric || states_degrees(&json)? || can_be_degrees(&json),
                        given => given == Coordinates::Degrees,
                    };
                    let what = "its coordinates are, or can be,";
                    let advice = "; if they are metres, set `coordinates` = \"metres\"";
                    let earth =
                        is_in_degrees.then(|| in_degrees(what).map_err(|message| message + advice)).transpose()?;
                    geojson(&json, earth, coordinates)?
                }
            }
        }
    };
    if contents.zones.is_empty() {
        return Err("has no polygon; must contain a polygon (in a plan, or a circle)".to_owned());
    }
    Ok(contents)
}

/// Rejects the fence of a plan of an old or of a newer ground station.
fn check_version(fence: &Value) -> Result<(), String> {
    let version = fence.get("version");
    let Some(old) = ["polygon", "circle"].into_iter().find(|key| fence.get(key).is_some()) else {
        return check_is_version(version, 2).map_err(|what| format!("geoFence: {what}"));
    };
    let what = match version {
        Some(version) if version.as_u64() == Some(2) => format!("has the key `{old}` of version 1"),
        _ => "has version 1".to_owned(),
    };
    Err(format!(
        "geoFence {what}, of old ground stations; must have version 2; open the plan with a newer QGroundControl, check \
         the fence and save it"
    ))
}

/// Checks a version, if it is stated.
fn check_is_version(stated: Option<&Value>, version: u64) -> Result<(), String> {
    let Some(stated) = stated.filter(|stated| stated.as_u64() != Some(version)) else { return Ok(()) };
    let value = if stated.is_number() { stated.to_string() } else { quoted(&stated.to_string()) };
    Err(format!("version = {value}: must be {version}; save the plan again with QGroundControl"))
}

/// Reads the polygons and circles of a plan's fence: those with `inclusion` are keep-in zones.
fn plan(fence: &Value, earth: &Earth) -> Result<Contents, String> {
    let wrong = |what: &str| format!("geoFence: {what}; save the plan again with QGroundControl");
    let list = |key: &str| match fence.get(key) {
        None => Ok([].as_slice()),
        Some(Value::Array(list)) => Ok(list.as_slice()),
        Some(_) => Err(wrong(&format!("{key} must be a list"))),
    };
    let point = |point: &Value| {
        let number = |place: usize| point.get(place).and_then(Value::as_f64);
        let (Some(lat), Some(lon)) = (number(0), number(1)) else {
            return Err(wrong("a position must be [latitude, longitude]"));
        };
        earth.place(lat, lon)
    };
    let found = |key: String, zone: &Value, shape: Shape| {
        check_is_version(zone.get("version"), 1).map_err(|what| format!("geoFence: {key}.{what}"))?;
        let kind = match zone.get("inclusion").and_then(Value::as_bool) {
            Some(true) => ZoneKind::KeepIn,
            Some(false) => ZoneKind::KeepOut,
            None => return Err(wrong(&format!("{key}.inclusion must be true or false"))),
        };
        Ok(Found { name: String::new(), kind: Some(kind), shape, band_m: [None; 2] })
    };
    let mut contents = Contents::default();
    for (index, zone) in list("polygons")?.iter().enumerate() {
        let outline = zone.get("polygon").and_then(Value::as_array);
        let outline = outline.ok_or_else(|| wrong(&format!("polygons.{index} has no positions")))?;
        let shape = Shape::Polygons(vec![vec![outline.iter().map(point).collect::<Result<_, _>>()?]]);
        contents.zones.push(found(format!("polygons.{index}"), zone, shape)?);
    }
    for (index, zone) in list("circles")?.iter().enumerate() {
        let radius_m = zone.pointer("/circle/radius").and_then(Value::as_f64);
        let radius_m = radius_m.ok_or_else(|| wrong(&format!("circles.{index} has no radius")))?;
        let centre_m = point(zone.pointer("/circle/center").unwrap_or(&Value::Null))?;
        contents.zones.push(found(format!("circles.{index}"), zone, Shape::Circle { centre_m, radius_m })?);
    }
    Ok(contents)
}

/// Reads the polygons of GeoJSON. Without `earth`, it must be in metres.
fn geojson(json: &Value, earth: Option<&Earth>, coordinates: Coordinates) -> Result<Contents, String> {
    let (mut zones, mut ignored) = (Vec::new(), BTreeSet::new());
    collect(json, Properties { name: "", band_m: [None; 2] }, earth, &mut zones, &mut ignored)?;
    if earth.is_none() && coordinates == Coordinates::Auto {
        let polygons = zones.iter().flat_map(|zone| match &zone.shape {
            Shape::Polygons(polygons) => polygons.as_slice(),
            Shape::Circle { .. } => &[],
        });
        for (index, rings_m) in polygons.enumerate() {
            check_metres(rings_m).map_err(|message| format!("polygon {index} {message}; {TRULY_SMALL}"))?;
        }
    }
    let mut notes = Vec::new();
    if !ignored.is_empty() {
        let names: Vec<String> = ignored.iter().take(NAMED).map(|name| quoted(name)).collect();
        notes.push(format!(
            "ignores the properties {}: the kind of a zone is that of the table, its altitudes are altitude_min_m and \
             altitude_max_m",
            names.join(", ")
        ));
    }
    if has_altitudes(json) {
        notes.push("ignores the altitudes of points; give altitude_min_m or altitude_max_m".to_owned());
    }
    Ok(Contents { zones, notes })
}

/// Parts of the names of properties that may concern the kind or the altitudes of a zone.
const MEANINGFUL: [&str; 12] =
    ["agl", "alt", "ceiling", "elev", "exclu", "floor", "height", "inclu", "kind", "lower", "msl", "upper"];

/// Returns whether a property is not read, but may have been meant to be.
fn is_ignored(name: &str, value: &Value) -> bool {
    let lower = name.to_lowercase();
    !value.is_null()
        && !["name", "altitude_min_m", "altitude_max_m"].contains(&name)
        && MEANINGFUL.iter().any(|part| lower.contains(part))
}

/// Properties of a feature of GeoJSON.
#[derive(Clone, Copy)]
struct Properties<'a> {
    name: &'a str,
    band_m: BandM,
}

/// Reads the polygons of a part of GeoJSON. `outer` are the properties of the feature around it.
fn collect<'a>(
    object: &'a Value,
    outer: Properties<'_>,
    earth: Option<&Earth>,
    found: &mut Vec<Found>,
    ignored: &mut BTreeSet<&'a str>,
) -> Result<(), String> {
    states_degrees(object)?;
    match GeoJson::of(object)? {
        GeoJson::Collection(parts) => parts.iter().try_for_each(|part| collect(part, outer, earth, found, ignored)),
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
            let all = object.get("properties").and_then(Value::as_object).into_iter().flatten();
            ignored.extend(all.filter(|(name, value)| is_ignored(name, value)).map(|(name, _)| name.as_str()));
            let geometry = geometry.ok_or_else(|| {
                format!("feature {}has no geometry; draw its polygon, or remove it", super::shapes::named(name))
            })?;
            collect(geometry, properties, earth, found, ignored)
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
