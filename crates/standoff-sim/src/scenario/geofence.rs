//! Zones of a scenario, typed or read from GeoJSON, as the geofence of a mission.

use std::path::Path;

use serde_json::Value;
use standoff::research::ZONES_MAX;
use standoff::{Geofence, Position, UavState, Zone};
use standoff_io::bounded_input;
use standoff_io::display_text::quoted;
use standoff_io::geodesy::{LocalPlane, Origin};

use super::diagnostics::Problems;
use super::error::ScenarioError;
use super::load::Typed;
use super::locate::Map;
use super::number::Number;
use super::resolved::Settings;
use super::schema_types::{self, ZoneKind, resolved};
use super::traffic::NAME_MAX;

/// Maximum size of a GeoJSON file, bytes: the maximum number of vertices takes a hundredth of it.
const LENGTH_MAX: u64 = 4 << 20;

/// Maximum length of the name of a zone, characters.
const CALLED_MAX: usize = 100;

/// Replaces the names of GeoJSON files by their polygons: the first polygon at the position of the file, the others at
/// the end of the list. The scenario, and so its record, then contains the zones that are flown.
pub(super) fn spell_out(typed: &mut Typed, origin: Option<Origin>) -> Result<(), ScenarioError> {
    let mut others = Vec::new();
    for place in 0..typed.file.geofence.len().min(ZONES_MAX) {
        let zone = &typed.file.geofence[place];
        if zone.file.is_empty() {
            continue;
        }
        let key = format!("geofence.{place}.file");
        let problem = |message: String| {
            let message = format!("{key} = {}: {message}", quoted(&zone.file));
            ScenarioError::from(typed.origin.problem(&Map::new(&typed.origin.text), &key, message, None))
        };
        if zone.file.len() > NAME_MAX {
            return Err(problem(format!("must be at most {NAME_MAX} bytes")));
        }
        if !zone.vertices.is_empty() {
            return Err(problem("a zone has `vertices` or a `file`; keep one".to_owned()));
        }
        let path = typed.files_from.as_deref().unwrap_or(Path::new("")).join(&zone.file);
        let bytes = bounded_input::bytes(&path, LENGTH_MAX).map_err(|reason| {
            let is_io_error = !bounded_input::is_input_error(&reason);
            ScenarioError { is_io_error, ..problem(bounded_input::cannot_be_read(&reason)) }
        })?;
        let zones = polygons(&bytes, origin).and_then(|polygons| zones(zone, polygons)).map_err(problem)?;
        let mut zones = zones.into_iter();
        if let Some(first) = zones.next() {
            typed.file.geofence[place] = first;
        }
        others.extend(zones);
    }
    typed.file.geofence.extend(others);
    Ok(())
}

/// Returns the geofence; an empty one if it has problems.
pub(super) fn geofence(zones: &[resolved::Zone], problems: &mut Problems) -> Geofence {
    if zones.len() > ZONES_MAX {
        problems.add("geofence", format!("must be at most {ZONES_MAX}, not {}", zones.len()), None);
        return Geofence::default();
    }
    let before = problems.found.len();
    let mut all = Vec::new();
    for (place, zone) in zones.iter().enumerate() {
        if zone.name.chars().any(char::is_control) || zone.name.chars().count() > CALLED_MAX {
            problems.add(
                format!("geofence.{place}.name"),
                format!("must be one line of at most {CALLED_MAX} characters"),
                None,
            );
        }
        if zone.vertices.is_empty() {
            problems.add(
                format!("geofence.{place}"),
                "has no outline; give `vertices` = [[0, 0], [500, 0], [0, 500]] or a `file`",
                None,
            );
            continue;
        }
        if let Some(vertex) = zone.vertices.iter().position(|point| point.len() != 2) {
            problems.add(format!("geofence.{place}.vertices.{vertex}"), "must be [east, north], m", None);
            continue;
        }
        let outline = zone.vertices.iter().map(|point| Position::from_m(point[0], point[1])).collect();
        let zone = Zone { name: zone.name.clone(), kind: zone.kind.into(), vertices: outline };
        // Each zone is checked separately to locate its error.
        if let Err(error) = Geofence::new(vec![zone.clone()]) {
            let key = match error.vertex {
                Some(vertex) => format!("geofence.{place}.vertices.{vertex}"),
                None => format!("geofence.{place}.vertices"),
            };
            problems.add(key, error.reason, None);
        }
        all.push(zone);
    }
    if problems.found.len() > before {
        return Geofence::default();
    }
    Geofence::new(all).unwrap_or_else(|error| {
        problems.add("geofence", error.to_string(), None);
        Geofence::default()
    })
}

/// Returns warnings about UAVs that start where they may not be, or where they cannot avoid violating a zone.
pub(super) fn warnings(settings: &Settings, uavs: &[UavState]) -> Vec<String> {
    let geofence = &settings.geofence;
    let warning = |(uav, state): (usize, &UavState)| {
        let named = |zone: usize| {
            let zone = geofence.zones().nth(zone)?;
            let name = if zone.name.is_empty() { String::new() } else { format!(" {}", quoted(&zone.name)) };
            Some(format!("{} zone{name}", zone.kind.name()))
        };
        if let Some(zone) = geofence.violated_zones(state.position).next() {
            let side = match geofence.zones().nth(zone)?.kind {
                standoff::ZoneKind::KeepOut => "inside",
                standoff::ZoneKind::KeepIn => "outside",
            };
            return Some(format!("UAV {uav} starts {side} {}: it leaves as soon as it can", named(zone)?));
        }
        let is_safe = geofence.can_stay_inside(&settings.team.uav, settings.period, state);
        (!is_safe).then(|| {
            format!("UAV {uav} starts so close to a zone's outline that it may not be able to turn away from it")
        })
    };
    if geofence.is_empty() { Vec::new() } else { uavs.iter().enumerate().filter_map(warning).collect() }
}

/// Rings of a polygon: the outline, then the holes.
type Rings = Vec<Vec<[f64; 2]>>;

/// Returns the polygons of GeoJSON in the local plane; their coordinates are degrees if its origin is known, otherwise
/// metres.
fn polygons(bytes: &[u8], origin: Option<Origin>) -> Result<Vec<(String, Rings)>, String> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let json: Value = serde_json::from_slice(bytes).map_err(|error| format!("is not GeoJSON: {error}"))?;
    let plane = match origin {
        Some(Origin { latitude_deg, longitude_deg }) => {
            Some(LocalPlane::about(latitude_deg, longitude_deg).map_err(|error| error.to_string())?)
        }
        None => None,
    };
    let mut found = Vec::new();
    collect(&json, "", plane.as_ref(), &mut found)?;
    if found.is_empty() {
        return Err("has no polygon; must contain a Polygon or MultiPolygon".to_owned());
    }
    Ok(found)
}

fn collect(
    object: &Value,
    name: &str,
    plane: Option<&LocalPlane>,
    found: &mut Vec<(String, Rings)>,
) -> Result<(), String> {
    let list = |key: &str| object.get(key).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    match object.get("type").and_then(Value::as_str).unwrap_or_default() {
        "FeatureCollection" => list("features").iter().try_for_each(|feature| collect(feature, name, plane, found)),
        "GeometryCollection" => list("geometries").iter().try_for_each(|part| collect(part, name, plane, found)),
        "Feature" => {
            let name = object.pointer("/properties/name").and_then(Value::as_str).unwrap_or(name);
            object.get("geometry").map_or(Ok(()), |geometry| collect(geometry, name, plane, found))
        }
        "Polygon" => {
            found.push((name.to_owned(), rings(object.get("coordinates"), plane)?));
            Ok(())
        }
        "MultiPolygon" => list("coordinates").iter().try_for_each(|polygon| {
            found.push((name.to_owned(), rings(Some(polygon), plane)?));
            Ok(())
        }),
        // Points and lines enclose nothing.
        "Point" | "MultiPoint" | "LineString" | "MultiLineString" => Ok(()),
        kind if object.is_object() => Err(format!("type = {}: must be a type of GeoJSON", quoted(kind))),
        _ => Ok(()),
    }
}

fn rings(coordinates: Option<&Value>, plane: Option<&LocalPlane>) -> Result<Rings, String> {
    let nested = || "a polygon's coordinates must be lists of [longitude, latitude], or of [east, north]".to_owned();
    let point = |point: &Value| -> Result<[f64; 2], String> {
        let number = |place: usize| point.get(place).and_then(Value::as_f64);
        let (Some(x), Some(y)) = (number(0), number(1)) else { return Err(nested()) };
        let Some(plane) = plane else { return Ok([x, y]) };
        let at = plane.position(y, x).map_err(|error| format!("[{x}, {y}] is not near the traffic: {error}"))?;
        // Rounded to the millimetre for the record.
        Ok([at.x_m(), at.y_m()].map(|metres| (metres * 1e3).round() / 1e3))
    };
    let ring = |ring: &Value| ring.as_array().ok_or_else(nested)?.iter().map(point).collect();
    coordinates.and_then(Value::as_array).ok_or_else(nested)?.iter().map(ring).collect()
}

/// Converts the polygons to zones of the table that names their file.
fn zones(table: &schema_types::Zone, polygons: Vec<(String, Rings)>) -> Result<Vec<schema_types::Zone>, String> {
    let mut all = Vec::new();
    for (name, rings) in polygons {
        let name = if table.name.is_empty() { name } else { table.name.clone() };
        for (place, mut ring) in rings.into_iter().enumerate() {
            let kind = match (place, table.kind) {
                (0, kind) => kind,
                // A hole in a keep-in zone is a keep-out zone.
                (_, ZoneKind::KeepIn) => ZoneKind::KeepOut,
                (_, ZoneKind::KeepOut) => {
                    let what = "a keep-out zone with a hole: no UAV could reach the hole; remove it";
                    return Err(what.to_owned());
                }
            };
            if ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            let outline = ring.iter().map(|[x_m, y_m]| Position::from_m(*x_m, *y_m)).collect();
            let checked = Zone { name: String::new(), kind: kind.into(), vertices: outline };
            Geofence::new(vec![checked]).map_err(|error| {
                let vertex = error.vertex.map_or(String::new(), |vertex| format!(", vertex {vertex}"));
                format!("polygon {}{vertex}: {}", all.len(), error.reason)
            })?;
            let points = ring.iter().map(|point| point.map(Number::Constant).to_vec()).collect();
            all.push(schema_types::Zone { name: name.clone(), file: String::new(), kind, vertices: points });
            if all.len() > ZONES_MAX {
                return Err(format!("has more than {ZONES_MAX} zones"));
            }
        }
    }
    Ok(all)
}

#[cfg(test)]
mod fuzz;

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::{Overrides, Scenario};

    const TARGET: &str = "[[targets.start]]\nx_m = 1\n";

    fn of_toml(toml: &str, folder: &std::path::Path) -> Result<Scenario, String> {
        let template = super::super::ScenarioTemplate::of_toml(
            "mine",
            &format!("{toml}\n{TARGET}"),
            &Overrides::default(),
            folder,
        );
        template.and_then(|template| template.draw(1)).map_err(|error| error.to_string())
    }

    fn typed(toml: &str) -> Result<Scenario, String> {
        of_toml(toml, std::path::Path::new(""))
    }

    #[test]
    fn zones_are_flown_and_a_record_has_them() {
        let scenario = typed(
            "[[geofence]]\nname = \"airfield\"\nvertices = [[2000, 0], [2500, 0], [2000, { uniform = [400, 500] }]]\n\
             [[geofence]]\nkind = \"keep-in\"\nvertices = [[-5000, -5000], [5000, -5000], [0, 5000]]",
        )
        .unwrap();
        let geofence = &scenario.settings.geofence;
        let zones: Vec<_> = geofence.zones().map(|zone| (zone.name.as_str(), zone.kind.name())).collect();
        assert_eq!(zones, [("airfield", "keep-out"), ("", "keep-in")]);
        let drawn_m = geofence.zones().next().unwrap().vertices[2].y_m();
        assert!((400.0..500.0).contains(&drawn_m));
        let of_record = super::Settings::of_record("r", &scenario.resolved().unwrap()).unwrap();
        assert_eq!(&of_record.geofence, geofence);
        assert_eq!(scenario.warnings, [""; 0]);
        // A scenario without zones does not mention them.
        assert!(!typed("").unwrap().resolved().unwrap().contains("geofence"));
    }

    #[test]
    fn errors_of_a_zone_point_at_its_vertex() {
        let error = |toml: &str| typed(toml).unwrap_err();
        let bow = "[[geofence]]\nvertices = [[0, 0], [100, 100], [100, 0], [0, 100]]";
        assert_eq!(
            error(bow),
            "mine:2:13: geofence.0.vertices.0: the side that starts here crosses or touches the side that \
             starts at vertex 2; an outline must not cross itself"
        );
        assert!(error("[[geofence]]\nvertices = [[0, 0], [100, 100], [5]]").contains("must be [east, north], m"));
        assert!(error("[[geofence]]\nvertices = [[0, 0], [100, 100]]").contains("needs at least three"));
        assert!(error("[[geofence]]\nname = \"a\"").contains("has no outline"));
        assert!(error("[[geofence]]\nkind = \"keep-off\"\nvertices = [[0, 0], [1, 0], [0, 1]]").contains("keep-off"));
        assert!(error(&"[[geofence]]\nvertices = [[0, 0], [1, 0], [0, 1]]\n".repeat(101)).contains("at most 100"));
    }

    #[test]
    fn geojson_is_written_out_in_the_scenario() {
        let folder = tempfile::tempdir().unwrap();
        let feature = |name: &str, rings: &str| {
            let geometry = format!("{{\"type\":\"Polygon\",\"coordinates\":[{rings}]}}");
            format!("{{\"type\":\"Feature\",\"properties\":{{\"name\":\"{name}\"}},\"geometry\":{geometry}}}")
        };
        let ring = "[[0,0],[900,0],[900,900],[0,900],[0,0]]";
        let hole = "[[300,300],[600,300],[300,600],[300,300]]";
        let write = |features: &str| {
            let text = format!("{{\"type\":\"FeatureCollection\",\"features\":[{features}]}}");
            fs::write(folder.path().join("z.geojson"), text).unwrap();
        };
        let of_kind =
            |kind: &str| of_toml(&format!("[[geofence]]\nkind = \"{kind}\"\nfile = \"z.geojson\""), folder.path());
        write(&[feature("a", ring), feature("b", hole)].join(","));
        let scenario = of_kind("keep-out").unwrap();
        let vertices: Vec<usize> = scenario.settings.geofence.zones().map(|zone| zone.vertices.len()).collect();
        assert_eq!(vertices, [4, 3]);
        // The resolved scenario needs no file.
        let resolved = scenario.resolved().unwrap();
        assert!(!resolved.contains("geojson"), "{resolved}");
        let again =
            super::super::ScenarioTemplate::of_text("r", &resolved, &[]).and_then(|template| template.draw(1)).unwrap();
        assert_eq!(again.settings.geofence, scenario.settings.geofence);
        // A hole in a keep-in zone becomes a keep-out zone; in a keep-out zone it is rejected.
        write(&feature("a", &format!("{ring},{hole}")));
        let kinds: Vec<_> =
            of_kind("keep-in").unwrap().settings.geofence.zones().map(|zone| zone.kind.name()).collect();
        assert_eq!(kinds, ["keep-in", "keep-out"]);
        assert!(of_kind("keep-out").unwrap_err().contains("a keep-out zone with a hole"));
        for (text, expected) in [
            ("{", "is not GeoJSON"),
            ("{\"type\":\"Point\",\"coordinates\":[0,0]}", "has no polygon"),
            ("{\"type\":\"Polygon\",\"coordinates\":[[0,1]]}", "must be lists"),
            ("{\"type\":\"Topology\"}", "must be a type of GeoJSON"),
        ] {
            fs::write(folder.path().join("z.geojson"), text).unwrap();
            let error = of_kind("keep-out").unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
        fs::remove_file(folder.path().join("z.geojson")).unwrap();
        assert!(of_kind("keep-out").unwrap_err().contains("z.geojson"));
    }

    #[test]
    fn uavs_that_start_in_forbidden_places_cause_warnings() {
        let start = |x_m: f64| {
            let zone = "[[geofence]]\nname = \"wood\"\nvertices = [[0, -500], [400, -500], [400, 500], [0, 500]]\n";
            typed(&format!("{zone}[[uavs.start]]\nx_m = {x_m}\n")).unwrap().warnings
        };
        assert_eq!(start(-400.0), [""; 0]);
        assert_eq!(start(200.0), ["UAV 0 starts inside keep-out zone \"wood\": it leaves as soon as it can"]);
        assert!(start(-20.0)[0].contains("may not be able to turn away"));
    }
}
