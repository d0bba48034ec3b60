//! Zones of a scenario, typed or read from a file, as the geofence of a mission.

mod file;
mod kml;
mod shapes;
mod union;

use std::path::Path;

use shapes::{BandM, Found, NAMED, Shape, TRULY_SMALL};
use standoff::safety::geofence::ZONES_MAX;
use standoff::{Geofence, Position, TeamParams, UavId, UavState, Vertical, Zone};
use standoff_io::bounded_input;
use standoff_io::display_text::quoted;
use toml::Value;

use super::diagnostics::{self, Problems};
use super::dotted::value_at;
use super::earth::Earth;
use super::error::ScenarioError;
use super::load::Typed;
use super::locate::Map;
use super::number::Number;
use super::polygons::{Rings, check_metres};
use super::resolved::Settings;
use super::schema_types::{self, Uavs, ZONE_ALTITUDE_M, ZoneKind};
use super::traffic::NAME_MAX;
use crate::traffic::{Coordinates, Traffic};
use crate::wind::height_m;

/// Maximum size of a file of zones, bytes: the maximum number of vertices takes a hundredth of it.
const LENGTH_MAX: u64 = 4 << 20;

/// Maximum length of the name of a zone, characters.
const CALLED_MAX: usize = 100;

/// Number of vertices of the polygon that replaces a circle. It deviates from the circle by 0.5 % of the radius.
const CIRCLE_VERTICES: u32 = 32;

/// Replaces the names of files by their zones, the first zone at the position of the file, the others at the end of the
/// list, and degrees by metres. The scenario, and so its record, then contains the zones that are flown.
pub(super) fn spell_out(typed: &mut Typed, traffic: Option<&Traffic>) -> Result<(), ScenarioError> {
    let is_in_degrees = |zone: &schema_types::Zone| !zone.file.is_empty() || is_in_degrees(zone);
    if !typed.file.geofence.iter().any(is_in_degrees) {
        return Ok(());
    }
    let place = Place { earth: Earth::of(typed, traffic), is_metric: typed.origin_on_earth(traffic).is_none() };
    let (mut others, mut notes, typed_count) = (Vec::new(), Vec::new(), typed.file.geofence.len());
    let Some(mut all) = value_at(&typed.table, "geofence").and_then(Value::as_array).cloned() else { return Ok(()) };
    for (index, as_typed) in all.iter_mut().enumerate().take(ZONES_MAX) {
        if typed.file.geofence[index].file.is_empty() {
            circle_in_metres(typed, &format!("geofence.{index}"), as_typed, &place.earth)?;
            continue;
        }
        let (zones, notes_of_file) = zones_of_file(typed, index, as_typed, &place)?;
        notes.extend(notes_of_file);
        // Parts count from the first zone of the file.
        let index_of = |of_file: f64| {
            if of_file == 0.0 { index as f64 } else { (typed_count + others.len()) as f64 + of_file - 1.0 }
        };
        let zones = zones.into_iter().map(|zone| schema_types::Zone { part_of: zone.part_of.map(index_of), ..zone });
        let refused = |error: toml::ser::Error| ScenarioError::one(&typed.origin.label, None, error.to_string());
        let zones = zones.map(|zone| Value::try_from(zone).map_err(refused)).collect::<Result<Vec<_>, _>>()?;
        let mut zones = zones.into_iter();
        if let Some(first) = zones.next() {
            *as_typed = first;
        }
        others.extend(zones);
    }
    all.extend(others);
    typed.notes.extend(notes);
    typed.set("geofence", all.into())
}

/// Where files of zones are placed.
struct Place {
    earth: Result<Earth, String>,
    /// True if coordinates without a unit are metres.
    is_metric: bool,
}

/// Reads the zones of a file that a table names, and notes about it.
fn zones_of_file(
    typed: &Typed,
    index: usize,
    as_typed: &Value,
    place: &Place,
) -> Result<(Vec<schema_types::Zone>, Vec<String>), ScenarioError> {
    let (zone, key) = (&typed.file.geofence[index], format!("geofence.{index}.file"));
    let problem = |message: String| {
        let message = format!("{key} = {}: {message}", quoted(&zone.file));
        ScenarioError::from(typed.origin.problem(&Map::new(&typed.origin.text), &key, message, None))
    };
    if zone.file.len() > NAME_MAX {
        return Err(problem(format!("must be at most {NAME_MAX} bytes")));
    }
    if !zone.vertices.is_empty() || is_circle(zone) {
        return Err(problem("a zone has `vertices`, a circle or a `file`; keep one".to_owned()));
    }
    if zone.part_of.is_some() {
        return Err(problem("a file defines separate zones; remove `part_of`".to_owned()));
    }
    // Each zone would draw another number.
    let is_wrong = |key: &&str| as_typed.get(key).is_some_and(|limit_m| finite(limit_m).is_none());
    if let Some(key) = ["altitude_min_m", "altitude_max_m"].into_iter().find(is_wrong) {
        return Err(problem(format!(
            "{key} must be a finite number, not a distribution, if the zones are from a file"
        )));
    }
    let path = typed.files_from.as_deref().unwrap_or(Path::new("")).join(&zone.file);
    let bytes = bounded_input::bytes(&path, LENGTH_MAX).map_err(|reason| {
        let is_io_error = !bounded_input::is_input_error(&reason);
        ScenarioError { is_io_error, ..problem(bounded_input::cannot_be_read(&reason)) }
    })?;
    let contents = file::read(&bytes, zone.coordinates, place.is_metric, &place.earth).map_err(problem)?;
    let mut zones = zones(zone, contents.zones).map_err(problem)?;
    if zone.coordinates != Coordinates::Auto {
        zones.iter_mut().for_each(|of_file| of_file.coordinates = Coordinates::Metres);
    }
    let note = |note: String| format!("{key} = {}: {note}", quoted(&zone.file));
    Ok((zones, contents.notes.into_iter().map(note).collect()))
}

/// Returns a typed number, unless it is a distribution or not finite.
fn finite(typed: &Value) -> Option<f64> {
    match Number::read(typed) {
        Ok(Number::Constant(number)) => Some(number).filter(|number| number.is_finite()),
        _ => None,
    }
}

/// Returns the geofence; an empty one if it has problems.
pub(super) fn geofence(zones: &[schema_types::Zone], problems: &mut Problems) -> Geofence {
    if zones.len() > ZONES_MAX {
        problems.add("geofence", format!("must be at most {ZONES_MAX}, not {}", zones.len()), None);
        return Geofence::default();
    }
    let before = problems.found.len();
    let all: Vec<Zone> = zones.iter().enumerate().filter_map(|(place, zone)| checked(place, zone, problems)).collect();
    if problems.found.len() > before {
        return Geofence::default();
    }
    Geofence::new(all).unwrap_or_else(|error| {
        problems.add("geofence", error.to_string(), None);
        Geofence::default()
    })
}

/// Returns the vertices of an area of interest, which follows the rules of a zone; `None` if it has problems at `key`.
pub(super) fn area(table: &schema_types::Priority, key: &str, problems: &mut Problems) -> Option<Vec<Position>> {
    let &schema_types::Priority { x_m, y_m, radius_m, .. } = table;
    let vertices = table.vertices.clone();
    let zone = schema_types::Zone { kind: ZoneKind::KeepIn, x_m, y_m, radius_m, vertices, ..Default::default() };
    let mut of_zone = Problems::default();
    let zone = checked(0, &zone, &mut of_zone);
    let is_valid = of_zone.found.is_empty();
    for diagnostics::Found { key: of_zone, what, number } in of_zone.found {
        problems.add(of_zone.replacen("geofence.0", key, 1), what, number);
    }
    zone.filter(|_| is_valid).map(|zone| zone.vertices)
}

/// Returns a zone; `None` if it has problems.
fn checked(place: usize, zone: &schema_types::Zone, problems: &mut Problems) -> Option<Zone> {
    if zone.name.chars().any(char::is_control) || zone.name.chars().count() > CALLED_MAX {
        problems.add(
            format!("geofence.{place}.name"),
            format!("must be one line of at most {CALLED_MAX} characters"),
            None,
        );
    }
    let vertices = outline(place, zone, problems)?;
    let is_index = |part_of: f64| part_of.fract() == 0.0 && part_of < place as f64;
    if let Some(part_of) = zone.part_of.filter(|part_of| !is_index(*part_of)) {
        let what = "must be the index of an earlier zone, from 0";
        problems.add(format!("geofence.{place}.part_of"), what, Some(part_of.into()));
        return None;
    }
    let (altitude_min_m, altitude_max_m) = (zone.altitude_min_m, zone.altitude_max_m);
    let altitudes_m = || altitude_min_m.into_iter().chain(altitude_max_m);
    if altitudes_m().any(|altitude_m| !ZONE_ALTITUDE_M.contains(altitude_m)) {
        // Reported already.
        return None;
    }
    if let (Some(floor_m), Some(ceiling_m)) = (altitude_min_m, altitude_max_m)
        && floor_m > ceiling_m
    {
        let what = format!("must not be below altitude_min_m = {floor_m}");
        problems.add(format!("geofence.{place}.altitude_max_m"), what, Some(ceiling_m.into()));
        return None;
    }
    check_coordinates(place, zone, &vertices, problems)?;
    let (kind, part_of) = (zone.kind.into(), zone.part_of.map(|part_of| part_of as usize));
    let zone = Zone { name: zone.name.clone(), kind, vertices, altitude_min_m, altitude_max_m, part_of };
    // Each zone is checked separately to locate its error.
    if let Err(error) = Geofence::new(vec![Zone { part_of: None, ..zone.clone() }]) {
        let key = match error.vertex {
            Some(vertex) => format!("geofence.{place}.vertices.{vertex}"),
            None => format!("geofence.{place}.vertices"),
        };
        problems.add(key, error.reason, None);
    }
    Some(zone)
}

/// Returns the vertices of a zone; `None` if it has none or several outlines.
fn outline(place: usize, zone: &schema_types::Zone, problems: &mut Problems) -> Option<Vec<Position>> {
    let circle = match (zone.x_m, zone.y_m, zone.radius_m) {
        (None, None, None) => None,
        (Some(x_m), Some(y_m), Some(radius_m)) if zone.vertices.is_empty() => Some(([x_m, y_m], radius_m)),
        (Some(_), Some(_), Some(_)) => {
            problems.add(format!("geofence.{place}"), "a zone has `vertices` or a circle; keep one", None);
            return None;
        }
        _ => {
            problems.add(format!("geofence.{place}"), "a circle needs `x_m`, `y_m` and `radius_m`", None);
            return None;
        }
    };
    if zone.vertices.is_empty() && circle.is_none() {
        problems.add(
            format!("geofence.{place}"),
            "has no outline; give `vertices` = [[0, 0], [500, 0], [0, 500]], `x_m`, `y_m` and `radius_m` of a circle, \
             or a `file`",
            None,
        );
        return None;
    }
    if let Some(vertex) = zone.vertices.iter().position(|point| point.len() != 2) {
        problems.add(format!("geofence.{place}.vertices.{vertex}"), "must be [east, north], m", None);
        return None;
    }
    Some(match circle {
        Some(([x_m, y_m], radius_m)) => {
            standoff::ZoneKind::from(zone.kind).circle(Position::from_m(x_m, y_m), radius_m, CIRCLE_VERTICES)
        }
        None => zone.vertices.iter().map(|point| Position::from_m(point[0], point[1])).collect(),
    })
}

/// Checks that the coordinates of a zone are metres; `None` if not.
fn check_coordinates(
    place: usize,
    zone: &schema_types::Zone,
    vertices: &[Position],
    problems: &mut Problems,
) -> Option<()> {
    let rings_m = vec![vertices.iter().map(|at| [at.x_m(), at.y_m()]).collect()];
    if zone.coordinates == Coordinates::Auto
        && let Err(message) = check_metres(&rings_m)
    {
        problems.add(format!("geofence.{place}.vertices"), format!("{message}; {TRULY_SMALL}"), None);
        return None;
    }
    if zone.coordinates == Coordinates::Degrees {
        let what =
            "`vertices`, `x_m` and `y_m` are metres; for degrees, use a `file`, or a circle with lat_deg and lon_deg";
        problems.add(format!("geofence.{place}.coordinates"), what, None);
        return None;
    }
    Some(())
}

/// Checks that every UAV stays in the bands of the keep-in zones, because the agents do not limit altitudes to them.
pub(super) fn check_altitudes(geofence: &Geofence, team: &TeamParams, uavs: &Uavs, problems: &mut Problems) {
    let altitudes_m = |uav: u32| {
        let id = UavId(uav);
        let start = uavs.start.get(uav as usize).filter(|_| team.uav.climb.is_some());
        let vertical = start.and_then(|start| start.altitude_m);
        team.altitudes_m(id, vertical.map(|altitude_m| Vertical { altitude_m, climb_rate_m_s: 0.0 }))
    };
    let count = if uavs.start.is_empty() { uavs.count as u32 } else { uavs.start.len() as u32 };
    for (place, zone) in geofence.zones().enumerate().filter(|(_, zone)| zone.kind == standoff::ZoneKind::KeepIn) {
        let outside = |uav: &u32| !zone.has_altitudes(altitudes_m(*uav));
        let Some(uav) = (0..count).find(outside) else { continue };
        let [low_m, high_m] = altitudes_m(uav);
        let (key, limit_m, required) = match zone.altitude_min_m.filter(|floor_m| *floor_m > low_m) {
            Some(floor_m) => ("altitude_min_m", Some(floor_m), format!("at most {low_m}")),
            None => ("altitude_max_m", zone.altitude_max_m, format!("at least {high_m}")),
        };
        let range =
            if low_m < high_m { format!("can fly at {low_m} to {high_m}") } else { format!("flies at {low_m}") };
        let what = if high_m.is_finite() {
            format!(
                "must be {required}: UAV {uav} {range} m, and a keep-in zone must contain all altitudes of all UAVs; \
                 change groups.altitude_lowest_m, groups.altitude_step_m, groups.altitude_policy, uavs.climb or the start \
                 of the UAV, or remove this limit"
            )
        } else {
            format!(
                "must contain all altitudes of all UAVs: UAV {uav} can be commanded to fly at any altitude from {low_m} m, \
                 one per group; set groups.altitude_policy = \"common\" or \"per-uav\", or the table [uavs.climb] with \
                 altitude_max_m"
            )
        };
        problems.add(format!("geofence.{place}.{key}"), what, limit_m.map(Number::Constant));
    }
}

/// Checks that a UAV can circle in the intersection of the keep-in zones.
pub(super) fn check_room(geofence: &Geofence, settings: &Settings, problems: &mut Problems) {
    let wind_m_s = settings.team.wind.map_or(0.0, |wind| wind.orbit_wind_m_s);
    let Some([found_m, required_m]) = geofence.lacking_room(&settings.team.uav, settings.period, wind_m_s) else {
        return;
    };
    let is_keep_in = |(_, zone): &(usize, &Zone)| zone.kind == standoff::ZoneKind::KeepIn;
    let keep_in: Vec<(usize, &Zone)> = geofence.zones().enumerate().filter(is_keep_in).collect();
    let named = |(index, zone): &(usize, &Zone)| match zone.name.as_str() {
        "" => index.to_string(),
        name => format!("{index} {}", quoted(name)),
    };
    let mut names: Vec<String> = keep_in.iter().take(NAMED).map(named).collect();
    if keep_in.len() > NAMED {
        names.push("...".to_owned());
    }
    let zones = format!("keep-in zone{} {}", if keep_in.len() == 1 { "" } else { "s" }, names.join(", "));
    let in_wind = if wind_m_s > 0.0 { format!(" in a wind of {wind_m_s:.0} m/s") } else { String::new() };
    let what = if found_m < 0.0 {
        format!("no position is inside all of {zones}, but a UAV must be; remove or enlarge some of them")
    } else {
        format!(
            "the largest circle inside {zones}, and outside large keep-out zones, has a radius of {found_m:.0} m; must be at \
             least {required_m:.0} m, so that a UAV can circle there at its lowest speed{in_wind}, clear of the outlines; enlarge the \
             zones, or change uavs.speed_m_s, uavs.speed_change_max_m_s or uavs.turn_rate_max_rad_s"
        )
    };
    problems.add("geofence", what, None);
}

/// Returns whether the centre of a circle was typed in degrees.
fn is_in_degrees(zone: &schema_types::Zone) -> bool {
    zone.lat_deg.is_some() || zone.lon_deg.is_some()
}

/// Returns whether any key of a circle was typed.
fn is_circle(zone: &schema_types::Zone) -> bool {
    [zone.x_m, zone.y_m, zone.lat_deg, zone.lon_deg, zone.radius_m].iter().any(Option::is_some)
}

/// Replaces the latitude and longitude of a circle by metres.
pub(super) fn circle_in_metres(
    typed: &Typed,
    table: &str,
    as_typed: &mut Value,
    earth: &Result<Earth, String>,
) -> Result<(), ScenarioError> {
    let has = |key: &str| as_typed.get(key).is_some();
    let key = format!("{table}.{}", if has("lat_deg") { "lat_deg" } else { "lon_deg" });
    let refuse = |what: &str| {
        let message = format!("{key}: {what}");
        ScenarioError::from(typed.origin.problem(&Map::new(&typed.origin.text), &key, message, None))
    };
    let (latitude_deg, longitude_deg) = match (as_typed.get("lat_deg"), as_typed.get("lon_deg")) {
        (None, None) => return Ok(()),
        (Some(latitude_deg), Some(longitude_deg)) => finite(latitude_deg)
            .zip(finite(longitude_deg))
            .ok_or_else(|| refuse("must be a finite number, not a distribution; draw x_m and y_m instead"))?,
        _ => return Err(refuse("a circle needs both lat_deg and lon_deg, or x_m and y_m")),
    };
    if has("x_m") || has("y_m") {
        return Err(refuse("a circle has lat_deg and lon_deg, or x_m and y_m; keep one pair"));
    }
    let earth = earth.as_ref().map_err(|reason| refuse(&format!("{reason}; or give x_m and y_m")))?;
    let [x_m, y_m] = earth.place(latitude_deg, longitude_deg).map_err(|message| refuse(&message))?;
    let Some(as_typed) = as_typed.as_table_mut() else { return Ok(()) };
    as_typed.retain(|key, _| !["lat_deg", "lon_deg"].contains(&key));
    as_typed.extend([("x_m", x_m), ("y_m", y_m)].map(|(key, metres)| (key.to_owned(), metres.into())));
    if let Some(coordinates) = as_typed.get_mut("coordinates").filter(|unit| unit.as_str() == Some("degrees")) {
        *coordinates = "metres".into();
    }
    Ok(())
}

/// Returns warnings about UAVs that start where they may not be, or where they cannot avoid violating a zone.
pub(super) fn warnings(settings: &Settings, uavs: &[UavState]) -> Vec<String> {
    let geofence = &settings.geofence;
    if let Some(warning) = wind_warning(settings).filter(|_| !geofence.is_empty()) {
        return vec![warning];
    }
    let warning = |(uav, state): (usize, &UavState)| {
        let altitudes_m = settings.team.altitudes_m(UavId(uav as u32), state.vertical);
        let named = |zone: usize| {
            let zone = geofence.zone(zone)?;
            let name = if zone.name.is_empty() { String::new() } else { format!(" {}", quoted(&zone.name)) };
            Some(format!("{} zone{name}", zone.kind.name()))
        };
        if let Some(zone) = geofence.violated_zones_between(state.position, altitudes_m).next() {
            let side = match geofence.zone(zone)?.kind {
                standoff::ZoneKind::KeepOut => "inside",
                standoff::ZoneKind::KeepIn => "outside",
            };
            return Some(format!("UAV {uav} starts {side} {}: it leaves as soon as it can", named(zone)?));
        }
        let wind = settings.wind.map(|wind| wind.at(height_m(state, None, &settings.team, UavId(uav as u32))));
        let own = (state, wind.unwrap_or_default());
        let is_safe = geofence.can_stay_inside(&settings.team.uav, settings.period, own, altitudes_m);
        (!is_safe).then(|| {
            format!("UAV {uav} starts so close to a zone's outline that it may not be able to turn away from it")
        })
    };
    if geofence.is_empty() { Vec::new() } else { uavs.iter().enumerate().filter_map(warning).collect() }
}

/// Returns a warning if UAVs cannot circle over ground in the wind, so that they cannot stay inside zones.
fn wind_warning(settings: &Settings) -> Option<String> {
    let uav = &settings.team.uav;
    let wind_m_s = settings.wind?.at(settings.team.initial_altitude_m(UavId(0))).velocity.speed_m_s();
    let (key, airspeed_m_s) = match uav.bank {
        None => ("the lowest airspeed, uavs.speed_m_s - uavs.speed_change_max_m_s", uav.speeds_m_s()[0]),
        Some(_) => ("the nominal airspeed, uavs.speed_m_s", uav.speed_m_s),
    };
    (wind_m_s >= airspeed_m_s).then(|| {
        format!(
            "UAVs may cross the outlines of zones: they turn away from them on circles over ground at {key} = \
             {airspeed_m_s}, and the wind of {wind_m_s:.1} m/s is not slower"
        )
    })
}

/// Converts the zones of a file to those of the table that names it.
fn zones(table: &schema_types::Zone, found: Vec<Found>) -> Result<Vec<schema_types::Zone>, String> {
    let mut all = Vec::new();
    for Found { name, kind, shape, band_m } in found {
        // Those of the table, otherwise those of the file.
        let altitude_min_m = table.altitude_min_m.or(band_m[0]);
        let altitude_max_m = table.altitude_max_m.or(band_m[1]);
        let name = if table.name.is_empty() { name } else { table.name.clone() };
        let of_file = kind.unwrap_or(table.kind);
        let polygons = match shape {
            Shape::Polygons(polygons) => polygons,
            Shape::Circle { centre_m: [x_m, y_m], radius_m } => {
                if !(1.0..=1e6).contains(&radius_m) {
                    return Err(format!("zone {}: radius = {radius_m} m; must be 1 to 1000000", all.len()));
                }
                let [x_m, y_m, radius_m] = [x_m, y_m, radius_m].map(Some);
                all.push(schema_types::Zone {
                    name,
                    kind: of_file,
                    x_m,
                    y_m,
                    radius_m,
                    altitude_min_m,
                    altitude_max_m,
                    ..schema_types::Zone::default()
                });
                continue;
            }
        };
        let outlines = outlines(polygons, of_file, [altitude_min_m, altitude_max_m], all.len())?;
        let mut first = None;
        for (kind, outline) in outlines {
            // A hole is no part of the zone around it.
            let part_of = first.filter(|_| kind == of_file).map(|first: usize| first as f64);
            first = first.or(Some(all.len()));
            all.push(schema_types::Zone {
                name: name.clone(),
                kind,
                vertices: outline.iter().map(|point| point.to_vec()).collect(),
                altitude_min_m,
                altitude_max_m,
                part_of,
                ..schema_types::Zone::default()
            });
            if all.len() > ZONES_MAX {
                return Err(format!("has more than {ZONES_MAX} zones"));
            }
        }
    }
    if all.len() > ZONES_MAX {
        return Err(format!("has more than {ZONES_MAX} zones"));
    }
    Ok(all)
}

/// Kind and vertices of an outline, m.
type Outline = (ZoneKind, Vec<[f64; 2]>);

/// Outlines of a zone with one or more polygons, each without its last point, which repeats the first. A hole in a keep-in
/// zone is a keep-out zone. `before` is the number of zones before it in the file.
fn outlines(
    mut polygons: Vec<Rings>,
    kind: ZoneKind,
    [altitude_min_m, altitude_max_m]: BandM,
    before: usize,
) -> Result<Vec<Outline>, String> {
    if polygons.is_empty() {
        return Err(format!("polygon {before} has no parts; remove it"));
    }
    for (index, rings) in polygons.iter_mut().enumerate() {
        let polygon = format!("polygon {}", before + index);
        if rings.is_empty() {
            return Err(format!("{polygon} has no outline"));
        }
        if kind == ZoneKind::KeepOut && rings.len() > 1 {
            return Err("a keep-out zone with a hole: no UAV could reach the hole; remove it".to_owned());
        }
        for ring in rings {
            if ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            let vertices = ring.iter().map(|[x_m, y_m]| Position::from_m(*x_m, *y_m)).collect();
            let checked = Zone { vertices, altitude_min_m, altitude_max_m, ..Zone::default() };
            Geofence::new(vec![checked]).map_err(|error| {
                let vertex = error.vertex.map_or(String::new(), |vertex| format!(", vertex {vertex}"));
                format!("{polygon}{vertex}: {}", error.reason)
            })?;
        }
    }
    if kind == ZoneKind::KeepOut || polygons.len() == 1 {
        let kind_of = |place: usize| if place == 0 { kind } else { ZoneKind::KeepOut };
        let of_polygon = |rings: Rings| {
            rings.into_iter().enumerate().map(|(place, ring)| (kind_of(place), ring)).collect::<Vec<_>>()
        };
        return Ok(polygons.into_iter().flat_map(of_polygon).collect());
    }
    for (index, polygon) in polygons.iter().enumerate() {
        if union::union(std::slice::from_ref(polygon)).is_some_and(|outlines| outlines.is_empty()) {
            let width_m = union::SAME_M;
            return Err(format!("polygon {} is less than {width_m} m wide; remove it", before + index));
        }
    }
    let joined = union::union(&polygons).map(|outlines| {
        let is_outer = |ring: &Vec<[f64; 2]>| union::twice_area_m2(ring) > 0.0;
        let kind_of = |ring: &Vec<[f64; 2]>| if is_outer(ring) { kind } else { ZoneKind::KeepOut };
        outlines.into_iter().map(|ring| (kind_of(&ring), ring)).collect()
    });
    joined.ok_or_else(|| {
        format!("polygon {before} has parts that cannot be joined, because their outlines are nearly equal; join them")
    })
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
        let of_record = super::Settings::of_record("r", &scenario.resolved().unwrap(), &[]).unwrap();
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
            ("{", "is not GeoJSON, a plan of QGroundControl or KML"),
            ("{\"type\":\"FeatureCollection\",\"features\":[]}", "has no polygon"),
            (
                "{\"type\":\"Point\",\"coordinates\":[500,0]}",
                "feature is a Point: a zone is a polygon; remove it, or give a",
            ),
            ("{\"type\":\"Polygon\",\"coordinates\":[[500,1]]}", "must be lists"),
            (
                "{\"type\":\"Polygon\",\"coordinates\":[[[11.3,44.5],[11.4,44.5],[11.3,44.6]]]}",
                "its coordinates are, or can be, in degrees, but the traffic is in metres and the location of the scenario on \
                 the Earth is unknown: name the SUMO net of the traffic in `basemap` or with --map",
            ),
            (
                "{\"type\":\"Polygon\",\"coordinates\":[[[511.3,44.5],[511.4,44.5],[511.3,44.6]]]}",
                "polygon 0 is smaller than 1 m; its coordinates are probably degrees",
            ),
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
    fn the_unit_of_a_zone_can_be_given() {
        let folder = tempfile::tempdir().unwrap();
        let file =
            |coordinates: &str| of_toml(&format!("[[geofence]]\nfile = \"z.geojson\"\n{coordinates}"), folder.path());
        write_geojson(folder.path(), "Polygon", &format!("[{}]", ring(50.0, 50.0, 50.8, 50.8)));
        let unknown = file("").unwrap_err();
        assert!(unknown.contains("if they are metres, set `coordinates` = \"metres\""), "{unknown}");
        let placed = file("coordinates = \"metres\"").unwrap();
        assert_eq!(placed.settings.geofence.zones().next().unwrap().vertices[0].x_m(), 50.0);
        assert!(file("coordinates = \"degrees\"").unwrap_err().contains("the traffic is in metres and the location"));
        let mast = "[[geofence]]\nvertices = [[500, 0], [500.8, 0], [500, 0.8]]\n";
        let small = of_toml(mast, folder.path()).unwrap_err();
        assert!(small.contains("if it is that small, set its `coordinates`"), "{small}");
        let of_mast = of_toml(&format!("{mast}coordinates = \"metres\""), folder.path()).unwrap();
        let of_record = super::Settings::of_record("r", &of_mast.resolved().unwrap(), &[]).unwrap();
        assert_eq!(of_record.geofence, of_mast.settings.geofence);
        let degrees = of_toml(&format!("{mast}coordinates = \"degrees\""), folder.path()).unwrap_err();
        assert!(degrees.contains("`vertices`, `x_m` and `y_m` are metres"), "{degrees}");
    }

    #[test]
    fn files_of_old_ground_stations_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = |text: &str| {
            fs::write(folder.path().join("a.plan"), text).unwrap();
            of_toml("[[geofence]]\nfile = \"a.plan\"\n", folder.path()).unwrap_err()
        };
        let old =
            "{\"fileType\":\"Plan\",\"geoFence\":{\"version\":1,\"polygon\":[[44.5,11.3],[44.6,11.3],[44.6,11.4]]}}";
        for (text, expected) in [
            (old, "geoFence has version 1, of old ground stations; must have version 2; open the plan"),
            (
                "{\"groundStation\":\"QGroundControl\",\"items\":[],\"version\":\"1.0\"}",
                "has no geoFence; must be a plan of",
            ),
            ("QGC WPL 110\n", "is a list of waypoints; must be GeoJSON, a plan of QGroundControl or KML; open it"),
        ] {
            let error = error(text);
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn files_that_are_not_text_are_named() {
        let folder = tempfile::tempdir().unwrap();
        for (bytes, expected) in [
            (&b"{\"name\":\"Caf\xe9\"}"[..], "1:13: not text; must be UTF-8; save the file as UTF-8"),
            (
                b"\0\0\x27\x0a\0\0\0\0",
                "is a Shapefile; must be GeoJSON, a plan of QGroundControl or KML; convert it to GeoJSON, with",
            ),
            (b"\x1f\x8b\x08\0\0", "is compressed with gzip; decompress it first"),
            (b"PK\x03\x04", "is compressed with zip"),
            (
                b"PK\x03\x04\x14\0\0\0\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x07\0\0\0doc.kml",
                "is KMZ; must be GeoJSON, a plan of QGroundControl or KML; convert it to GeoJSON, with ogr2ogr",
            ),
        ] {
            fs::write(folder.path().join("z"), bytes).unwrap();
            let error = of_toml("[[geofence]]\nfile = \"z\"\n", folder.path()).unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
    }

    fn write_geojson(folder: &std::path::Path, geometry: &str, coordinates: &str) {
        let geometry = format!("{{\"type\":\"{geometry}\",\"coordinates\":{coordinates}}}");
        let feature = format!("{{\"type\":\"Feature\",\"properties\":{{\"name\":\"a\"}},\"geometry\":{geometry}}}");
        fs::write(folder.join("z.geojson"), feature).unwrap();
    }

    fn ring(west: f64, south: f64, east: f64, north: f64) -> String {
        format!("[[{west},{south}],[{east},{south}],[{east},{north}],[{west},{north}],[{west},{south}]]")
    }

    #[test]
    fn a_multipolygon_without_area_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let error = |parts: &[String]| {
            let parts: Vec<String> = parts.iter().map(|part| format!("[{part}]")).collect();
            write_geojson(folder.path(), "MultiPolygon", &format!("[{}]", parts.join(",")));
            let toml = "[[geofence]]\nkind = \"keep-in\"\nfile = \"z.geojson\"\n";
            of_toml(toml, folder.path()).err().unwrap_or_default()
        };
        let (large, narrow) = (ring(-3000.0, -3000.0, 3000.0, 3000.0), ring(4000.0, 0.0, 4000.04, 900.0));
        assert!(error(&[]).contains("polygon 0 has no parts; remove it"), "{}", error(&[]));
        let message = error(&[large.clone(), narrow]);
        assert!(message.contains("polygon 1 is less than 0.05 m wide; remove it"), "{message}");
        assert_eq!(error(&[large, ring(4000.0, 0.0, 4000.2, 900.0)]), "");
    }

    /// Two halves with a common side, the same in another kind, two apart, and four around a hole.
    #[test]
    fn a_multipolygon_is_one_zone() {
        let folder = tempfile::tempdir().unwrap();
        let flown = |kind: &str, parts: &[String]| {
            let parts: Vec<String> = parts.iter().map(|part| format!("[{part}]")).collect();
            write_geojson(folder.path(), "MultiPolygon", &format!("[{}]", parts.join(",")));
            let other = "vertices = [[9000, 9000], [9500, 9000], [9000, 9500]]";
            let toml = format!("[[geofence]]\nkind = \"{kind}\"\nfile = \"z.geojson\"\n[[geofence]]\n{other}");
            let scenario = of_toml(&toml, folder.path()).unwrap();
            let resolved = scenario.resolved().unwrap();
            assert_eq!(super::Settings::of_record("r", &resolved, &[]).unwrap().geofence, scenario.settings.geofence);
            let zone = |zone: &standoff::Zone| (zone.kind.name(), zone.vertices.len(), zone.part_of);
            let zones: Vec<_> = scenario.settings.geofence.zones().map(zone).collect();
            (zones, scenario.settings.geofence.clone())
        };
        let halves = [ring(-3000.0, -3000.0, 0.0, 3000.0), ring(0.0, -3000.0, 3000.0, 3000.0)];
        let other = ("keep-out", 3, None);
        assert_eq!(flown("keep-in", &halves).0, [("keep-in", 4, None), other]);
        assert_eq!(flown("keep-out", &halves).0, [("keep-out", 4, None), other, ("keep-out", 4, Some(0))]);
        let apart = [ring(-2000.0, -1000.0, -100.0, 900.0), ring(100.0, -1000.0, 2000.0, 900.0)];
        let (zones, geofence) = flown("keep-in", &apart);
        assert_eq!(zones, [("keep-in", 4, None), other, ("keep-in", 4, Some(0))]);
        let at = |x_m| standoff::Position::from_m(x_m, 0.0);
        assert!(geofence.contains(at(-1000.0)) && geofence.contains(at(1000.0)) && !geofence.contains(at(0.0)));
        let around = [(-900.0, -900.0, 900.0, -500.0), (-900.0, 500.0, 900.0, 900.0)]
            .into_iter()
            .chain([(-900.0, -500.0, -500.0, 500.0), (500.0, -500.0, 900.0, 500.0)])
            .map(|(west, south, east, north)| ring(west, south, east, north));
        let (zones, geofence) = flown("keep-in", &around.collect::<Vec<_>>());
        assert_eq!(zones, [("keep-in", 4, None), other, ("keep-out", 4, None)]);
        assert!(!geofence.contains(at(0.0)) && geofence.contains(at(700.0)));
    }

    #[test]
    fn keep_in_zones_without_room_for_a_turning_circle_are_refused() {
        let square = |name: &str, x_m: f64, half_m: f64| {
            let (west, east) = (x_m - half_m, x_m + half_m);
            format!(
                "[[geofence]]\nname = \"{name}\"\nkind = \"keep-in\"\nvertices = [[{west}, -{half_m}], [{east}, -{half_m}], \
                 [{east}, {half_m}], [{west}, {half_m}]]\n"
            )
        };
        let apart = typed(&(square("a", -1000.0, 2000.0) + &square("b", 2500.0, 1000.0))).unwrap_err();
        let expected =
            "no position is inside all of keep-in zones 0 \"a\", 1 \"b\", but a UAV must be; remove or enlarge";
        assert!(apart.starts_with("mine:1:3: geofence: ") && apart.contains(expected), "{apart}");
        let small = typed(&square("a", 0.0, 60.0)).unwrap_err();
        let expected = "the largest circle inside keep-in zone 0 \"a\", and outside large keep-out zones, has a radius of \
                        60 m; must be at least 89 m";
        assert!(small.contains(expected), "{small}");
        // A slower or more agile UAV has room.
        assert!(typed(&format!("[uavs]\nturn_rate_max_rad_s = 0.5\n{}", square("a", 0.0, 60.0))).is_ok());
        assert!(typed(&(square("a", 0.0, 2000.0) + &square("b", 2500.0, 1000.0))).is_ok());
    }

    #[test]
    fn geojson_in_degrees_over_metric_traffic_is_placed_by_the_net_or_refused() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("t.csv"), "t,id,x,y\n0,a,5000,3000\n60,a,5100,3000\n").unwrap();
        // The south-west corner is at 44.5 degrees north, 11.3 degrees east.
        let net = |projection: &str, name: &str| {
            let location = format!(
                "<location netOffset=\"-682845.756,-4929982.183\" convBoundary=\"0,0,9000,9000\" \
                 origBoundary=\"0,0,1,1\" projParameter=\"{projection}\"/>"
            );
            fs::write(folder.path().join(name), format!("<net>{location}<edge/></net>")).unwrap();
        };
        net("+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs", "a.net.xml");
        net("!", "none.net.xml");
        write_geojson(folder.path(), "Polygon", &format!("[{}]", ring(11.3, 44.5, 11.31, 44.51)));
        let load_with = |maps: &[&str], basemap: &str| {
            let toml =
                format!("basemap = [{basemap}]\n[traffic]\nfile = \"t.csv\"\n[[geofence]]\nfile = \"z.geojson\"");
            let maps = maps.iter().map(|name| folder.path().join(name)).collect();
            let overrides = Overrides { maps, ..Overrides::default() };
            let template = super::super::ScenarioTemplate::of_toml("mine", &toml, &overrides, folder.path());
            template.and_then(|template| template.draw(1)).map_err(|error| error.to_string())
        };
        let load = |basemap: &str| load_with(&[], basemap);
        let placed = load("\"a.net.xml\"").unwrap();
        for basemap in ["", "\"none.net.xml\""] {
            let by_override = load_with(&["a.net.xml"], basemap).unwrap();
            assert_eq!(by_override.settings.geofence, placed.settings.geofence);
        }
        let vertices = &placed.settings.geofence.zones().next().unwrap().vertices;
        assert!(vertices[0].distance_m(standoff::Position::from_m(0.0, 0.0)) < 5.0, "{vertices:?}");
        // A hundredth of a degree is 1,112 m north and 794 m east.
        let [east_m, north_m] = [vertices[0].distance_m(vertices[1]), vertices[0].distance_m(vertices[3])];
        assert!((east_m - 794.0).abs() < 3.0 && (north_m - 1_111.0).abs() < 3.0, "{east_m} {north_m}");
        for basemap in ["", "\"none.net.xml\""] {
            assert!(load(basemap).unwrap_err().contains("the location of the scenario on the Earth is unknown"));
        }
        let square = ring(11.3, 44.5, 11.31, 44.51);
        let crs = |name: &str| {
            let crs = format!("\"crs\":{{\"type\":\"name\",\"properties\":{{\"name\":\"{name}\"}}}}");
            let text = format!("{{\"type\":\"Polygon\",{crs},\"coordinates\":[{square}]}}");
            fs::write(folder.path().join("z.geojson"), text).unwrap();
            load("\"a.net.xml\"")
        };
        assert!(crs("urn:ogc:def:crs:OGC:1.3:CRS84").is_ok());
        let refused = crs("urn:ogc:def:crs:EPSG::25832").unwrap_err();
        assert!(refused.contains("crs = \"urn:ogc:def:crs:EPSG::25832\": must be WGS 84 (EPSG:4326)"), "{refused}");
    }

    /// Zones over traffic at 44.5 degrees north, 11.3 degrees east, from a file called `name`.
    fn of_file(name: &str, text: &str, zone: &str) -> Result<Scenario, String> {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("t.csv"), "t,id,lat,lon\n0,a,44.5,11.3\n60,a,44.501,11.3\n").unwrap();
        fs::write(folder.path().join(name), text).unwrap();
        let toml = format!("[traffic]\nfile = \"t.csv\"\n[[geofence]]\nfile = \"{name}\"\n{zone}");
        let template = super::super::ScenarioTemplate::of_toml("mine", &toml, &Overrides::default(), folder.path());
        template.and_then(|template| template.draw(1)).map_err(|error| error.to_string())
    }

    const PLAN: &str = r#"{"fileType": "Plan", "geoFence": {"circles": [{"circle": {"center": [44.51, 11.3], "radius":
        200}, "inclusion": false, "version": 1}], "polygons": [{"inclusion": true, "polygon": [[44.4, 11.2], [44.4, 11.4],
        [44.6, 11.4], [44.6, 11.2]], "version": 1}], "version": 2}, "version": 1}"#;

    const KML: &str = r#"<?xml version="1.0" encoding="UTF-8"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document><name>all
        </name><Placemark><name>wood &amp; lake</name><Polygon><outerBoundaryIs><LinearRing><coordinates>
        11.31,44.51,ALT 11.32,44.51,0 11.32,44.52,0 11.31,44.51,0 </coordinates></LinearRing></outerBoundaryIs></Polygon>
        </Placemark></Document></kml>"#;

    #[test]
    fn plans_of_qgroundcontrol_determine_the_kind_of_their_zones() {
        let scenario = of_file("area.plan", PLAN, "name = \"area\"").unwrap();
        let zones: Vec<_> = scenario.settings.geofence.zones().collect();
        assert_eq!(zones.iter().map(|zone| zone.kind.name()).collect::<Vec<_>>(), ["keep-in", "keep-out"]);
        assert_eq!(zones.iter().map(|zone| zone.vertices.len()).collect::<Vec<_>>(), [4, 32]);
        assert!(zones.iter().all(|zone| zone.name == "area"));
        let resolved = scenario.resolved().unwrap();
        assert!(resolved.contains("radius_m = 200") && !resolved.contains("plan"), "{resolved}");
        assert_eq!(super::Settings::of_record("r", &resolved, &[]).unwrap().geofence, scenario.settings.geofence);
        for (from, to, expected) in [
            ("\"inclusion\": true", "\"inclusion\": 1", "geoFence: polygons.0.inclusion must be true or false"),
            ("\"version\": 2", "\"version\": 3", "geoFence: version = 3: must be 2; save the plan again"),
            ("\"version\": 1}]", "\"version\": 9}]", "geoFence: polygons.0.version = 9: must be 1"),
            (
                "\"polygons\"",
                "\"polygon\"",
                "geoFence has the key `polygon` of version 1, of old ground stations; must",
            ),
            ("[44.4, 11.2]", "[44.4]", "geoFence: a position must be [latitude, longitude]"),
            ("\"radius\"", "\"r\"", "geoFence: circles.0 has no radius"),
            ("200", "0.5", "zone 1: radius = 0.5 m; must be 1 to 1000000"),
            ("[44.4, 11.2]", "[14.4, 11.2]", "[11.2, 14.4] is not near the traffic"),
            ("geoFence", "mission", "with zones; open it with QGroundControl, draw"),
            ("\"circles\":", "\"circles\": 1, \"others\":", "geoFence: circles must be a list"),
        ] {
            let error = of_file("area.plan", &PLAN.replace(from, to), "").unwrap_err();
            assert!(
                error.starts_with("mine:4:1: geofence.0.file = \"area.plan\": ") && error.contains(expected),
                "{error}"
            );
        }
    }

    /// Traffic just west of the antimeridian, and a zone drawn across it.
    #[test]
    fn longitudes_of_zones_beyond_180_are_wrapped() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("t.csv"), "t,id,lat,lon\n0,a,44.5,179.995\n60,a,44.501,179.995\n").unwrap();
        let zone = |west: f64, east: f64| {
            write_geojson(folder.path(), "Polygon", &format!("[{}]", ring(west, 44.5, east, 44.51)));
            let toml = "[traffic]\nfile = \"t.csv\"\n[[geofence]]\nfile = \"z.geojson\"";
            let template = super::super::ScenarioTemplate::of_toml("mine", toml, &Overrides::default(), folder.path());
            let scenario = template.and_then(|template| template.draw(1)).map_err(|error| error.to_string());
            scenario.map(|scenario| scenario.settings.geofence.zones().next().unwrap().vertices.clone())
        };
        assert_eq!(zone(179.999, 180.01).unwrap(), zone(179.999, -179.99).unwrap());
        assert_eq!(zone(-180.001, -179.99).unwrap(), zone(179.999, -179.99).unwrap());
        assert!(zone(179.999, 541.0).unwrap_err().contains("is not near the traffic"));
    }

    #[test]
    fn polygons_of_kml_are_zones() {
        let with_altitude = |altitude: &str| of_file("a.kml", &KML.replace("ALT", altitude), "kind = \"keep-out\"");
        let scenario = with_altitude("0").unwrap();
        let zone = scenario.settings.geofence.zones().next().unwrap();
        assert_eq!((zone.name.as_str(), zone.vertices.len()), ("wood & lake", 3));
        assert!((zone.vertices[0].y_m() - 1_111.0).abs() < 2.0, "{:?}", zone.vertices);
        assert_eq!(scenario.warnings, [""; 0]);
        let note = "geofence.0.file = \"a.kml\": ignores the altitudes of polygons, except for extruded ones with a single \
                    altitude relative to the ground";
        assert_eq!(with_altitude("120").unwrap().warnings, [note]);
        for (from, to, expected) in [
            ("44.51,ALT", "44.51,x", "coordinates = \"11.31,44.51,x\": must be longitude,latitude,altitude"),
            (
                "</Document>",
                "<Placemark><name>mast</name><Point/></Placemark>",
                "placemark \"mast\" is a Point: a zone is",
            ),
            ("<Polygon>", "<LineString/><Polygon>", "placemark \"wood & lake\" is a LineString: a zone is a polygon"),
            ("<Polygon>", "<Model/><Polygon>", "placemark \"wood & lake\" is a Model: a zone is a polygon"),
            (
                "</Document>",
                "<NetworkLink/></Document>",
                "element = \"NetworkLink\": linked files are not read; add each",
            ),
            ("</Document>", "<Placemark><name>x</name></Placemark></Document>", "placemark \"x\" has no geometry"),
            (
                "<Polygon>",
                "<Polygon><outerBoundaryIs><coordinates>11.3,44.5</coordinates></outerBoundaryIs>",
                "a polygon \
              has two outlines",
            ),
            ("wood &amp;", "wood &nbsp;", "entity = \"&nbsp;\" is not read; only &amp;"),
            ("kml", "gpx", "1:39: element = \"gpx\"; the root element must be kml"),
            ("</kml>", "", "the file ends inside an element"),
        ] {
            let error = of_file("a.kml", &KML.replace(from, to).replace("ALT", "0"), "").unwrap_err();
            assert!(
                error.starts_with("mine:4:1: geofence.0.file = \"a.kml\": ") && error.contains(expected),
                "{error}"
            );
        }
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.kml"), KML).unwrap();
        let metric = of_toml("[[geofence]]\nfile = \"a.kml\"", folder.path()).unwrap_err();
        assert!(metric.contains("KML is in degrees, but the traffic is in metres and the location"), "{metric}");
    }

    #[test]
    fn parts_of_kml_without_zones_are_noted() {
        let others = "<GroundOverlay/><Placemark><TimeSpan/><Polygon>";
        let scenario = of_file(
            "a.kml",
            &KML.replace("ALT", "0").replace("<Placemark>", others).replace(
                "<name>wood \
            &amp; lake</name><Polygon>",
                "",
            ),
            "",
        );
        let note = "geofence.0.file = \"a.kml\": ignores GroundOverlay, TimeSpan: only polygons are zones, and they exist all \
                    the time";
        assert_eq!(scenario.unwrap().warnings, [note]);
    }

    #[test]
    fn parts_of_geojson_without_zones_are_refused_or_noted() {
        let feature = |properties: &str, z: &str| {
            format!(
                "{{\"type\":\"Feature\",\"properties\":{properties},\"geometry\":{{\"type\":\"Polygon\",\"coordinates\":\
                 [[[11.31,44.51{z}],[11.32,44.51],[11.32,44.52],[11.31,44.51]]]}}}}"
            )
        };
        let warnings = |properties, z| of_file("a.geojson", &feature(properties, z), "").unwrap().warnings;
        assert_eq!(warnings("{\"name\":\"a\",\"fill\":\"red\",\"altitude_max_m\":100}", ",0"), [""; 0]);
        let start = "geofence.0.file = \"a.geojson\": ignores the";
        assert_eq!(
            warnings("{\"inclusion\":true,\"ceiling_ft\":400,\"floor\":null}", ""),
            [format!(
                "{start} properties \"ceiling_ft\", \"inclusion\": the kind of a zone is that of the table, its altitudes are \
                 altitude_min_m and altitude_max_m"
            )]
        );
        assert_eq!(
            warnings("null", ",120"),
            [format!("{start} altitudes of points; give altitude_min_m or altitude_max_m")]
        );
        let part = feature("null", "");
        let whole = format!(
            "{{\"type\":\"FeatureCollection\",\"features\":[{part},{{\"type\":\"Feature\",\"properties\":{{\"name\":\
             \"mast\"}},\"geometry\":null}}]}}"
        );
        let refused = of_file("a.geojson", &whole, "").unwrap_err();
        assert!(refused.ends_with("feature \"mast\" has no geometry; draw its polygon, or remove it"), "{refused}");
    }

    /// The polygon has its points at 120 m above the ground or the sea, or one of them elsewhere.
    #[test]
    fn extruded_polygons_of_kml_have_a_ceiling() {
        let band = |first_m: &str, mode: &str| {
            let kml =
                KML.replace(",0 ", ",120 ").replace("ALT", first_m).replace("<Polygon>", &format!("<Polygon>{mode}"));
            let scenario = of_file("a.kml", &kml, "").unwrap();
            let zone = scenario.settings.geofence.zones().next().unwrap();
            (zone.altitude_min_m, zone.altitude_max_m, !scenario.warnings.is_empty())
        };
        let relative = "<extrude>1</extrude><altitudeMode>relativeToGround</altitudeMode>";
        assert_eq!(band("120", relative), (None, Some(120.0), false));
        for (first_m, mode) in [
            ("119", relative),
            ("120", "<extrude>1</extrude><altitudeMode>absolute</altitudeMode>"),
            ("120", "<extrude>0</extrude><altitudeMode>relativeToGround</altitudeMode>"),
            ("120", "<extrude>1</extrude>"),
        ] {
            assert_eq!(band(first_m, mode), (None, None, true), "{mode}");
        }
    }

    #[test]
    fn circles_become_polygons_on_their_safe_side() {
        let radius_m = 400.0;
        for (kind, low_m, high_m) in [("keep-out", radius_m, 1.005 * radius_m), ("keep-in", 0.995 * radius_m, radius_m)]
        {
            let toml = format!("[[geofence]]\nkind = \"{kind}\"\nx_m = 2000\ny_m = -300\nradius_m = {radius_m}");
            let scenario = typed(&toml).unwrap();
            let geofence = &scenario.settings.geofence;
            let zone = geofence.zones().next().unwrap();
            let centre = standoff::Position::from_m(2000.0, -300.0);
            for (from, to) in zone.vertices.iter().zip(zone.vertices.iter().cycle().skip(1)) {
                let middle = standoff::Position::from_m((from.x_m() + to.x_m()) / 2.0, (from.y_m() + to.y_m()) / 2.0);
                for distance_m in [from, &middle].map(|at| at.distance_m(centre)) {
                    assert!((low_m - 1e-6..=high_m + 1e-6).contains(&distance_m), "{kind}: {distance_m}");
                }
            }
            let resolved = scenario.resolved().unwrap();
            assert_eq!(&super::Settings::of_record("r", &resolved, &[]).unwrap().geofence, geofence);
        }
        let drawn = typed("[[geofence]]\nx_m = { uniform = [2000, 3000] }\ny_m = 0\nradius_m = 100").unwrap();
        assert!((2000.0..3000.0).contains(&drawn.file.geofence[0].x_m.unwrap()));
        let degrees = of_file("a.plan", PLAN, "[[geofence]]\nlat_deg = 44.51\nlon_deg = 11.3\nradius_m = 200").unwrap();
        let zones: Vec<_> = degrees.settings.geofence.zones().collect();
        assert_eq!(zones[1].vertices, zones[2].vertices);
        for (circle, expected) in [
            ("x_m = 1\ny_m = 2", "geofence.0: a circle needs `x_m`, `y_m` and `radius_m`"),
            ("radius_m = 5", "geofence.0: a circle needs"),
            ("x_m = 1\ny_m = 2\nradius_m = 0", "geofence.0.radius_m = 0: must be"),
            (
                "x_m = 1\ny_m = 2\nradius_m = 9\nvertices = [[0, 0], [9, 0], [0, 9]]",
                "a zone has `vertices` or a circle; keep one",
            ),
            ("lat_deg = 44\nradius_m = 9", "geofence.0.lat_deg: a circle needs both"),
            (
                "lat_deg = 44\nlon_deg = 9\nradius_m = 9",
                "geofence.0.lat_deg: the location of the scenario on the Earth is unknown",
            ),
            ("lat_deg = 44\nlon_deg = 9\nx_m = 1\nradius_m = 9", "keep one pair"),
            ("radius = 9", "radius"),
        ] {
            let error = typed(&format!("[[geofence]]\n{circle}")).unwrap_err();
            assert!(error.contains(expected), "{circle}: {error}");
        }
        let both = of_file("a.plan", PLAN, "radius_m = 5").unwrap_err();
        assert!(both.contains("a zone has `vertices`, a circle or a `file`; keep one"), "{both}");
    }

    #[test]
    fn floors_and_ceilings_are_flown_and_a_record_has_them() {
        let outline = "vertices = [[2000, 0], [2500, 0], [2000, 400]]";
        let scenario = typed(&format!(
            "[[geofence]]\n{outline}\naltitude_min_m = 0\naltitude_max_m = {{ uniform = [100, 200] }}\n\
             [[geofence]]\nx_m = 0\ny_m = 5000\nradius_m = 50\naltitude_min_m = 450\n[[geofence]]\n{outline}"
        ))
        .unwrap();
        let limits: Vec<_> =
            scenario.settings.geofence.zones().map(|zone| (zone.altitude_min_m, zone.altitude_max_m)).collect();
        assert!(limits[0].0 == Some(0.0) && limits[0].1.is_some_and(|drawn_m| (100.0..200.0).contains(&drawn_m)));
        assert_eq!(limits[1..], [(Some(450.0), None), (None, None)]);
        let resolved = scenario.resolved().unwrap();
        assert_eq!(super::Settings::of_record("r", &resolved, &[]).unwrap().geofence, scenario.settings.geofence);
        assert_eq!(resolved.matches("altitude_min_m").count(), 2);
        for (limits, expected) in [
            ("altitude_max_m = -1", "mine:3:1: geofence.0.altitude_max_m = -1: must be at least 0 and at most 100000"),
            ("altitude_min_m = nan", "mine:3:1: geofence.0.altitude_min_m = nan: must be a finite number"),
            (
                "altitude_min_m = 2e5",
                "mine:3:1: geofence.0.altitude_min_m = 200000: must be at least 0 and at most 100000",
            ),
            (
                "altitude_max_m = 119\naltitude_min_m = 120",
                "mine:3:1: geofence.0.altitude_max_m = 119: must not be below altitude_min_m = 120",
            ),
        ] {
            let error = typed(&format!("[[geofence]]\n{outline}\n{limits}")).unwrap_err();
            assert_eq!(error, expected);
        }
    }

    /// Two UAVs, which fly at 300 and 350 m if each has its own altitude.
    #[test]
    fn a_keep_in_zone_must_contain_all_altitudes_of_all_uavs() {
        let zone = "separation = false\n[[geofence]]\nkind = \"keep-in\"\nx_m = 0\ny_m = 0\nradius_m = 9000\n";
        let result = |limits: &str, rest: &str| typed(&format!("{zone}{limits}\n{rest}")).map(|_| ());
        let per_uav = "[groups]\naltitude_policy = \"per-uav\"\n";
        let common = "[groups]\naltitude_policy = \"common\"\n";
        let two = "[uavs]\ncount = 2\n";
        // The band touches both altitudes exactly.
        assert_eq!(result("altitude_min_m = 300\naltitude_max_m = 350", &format!("{two}{per_uav}")), Ok(()));
        assert_eq!(result("altitude_min_m = 300\naltitude_max_m = 300", &format!("{two}{common}")), Ok(()));
        assert_eq!(result("altitude_max_m = 3000", &format!("{two}[uavs.climb]\n")), Ok(()));
        let climbing = "[uavs.climb]\naltitude_max_m = 500\n[[uavs.start]]\naltitude_m = 120\n";
        assert_eq!(result("altitude_min_m = 120\naltitude_max_m = 500", climbing), Ok(()));
        for (limits, rest, expected) in [
            (
                "altitude_max_m = 349",
                format!("{two}{per_uav}"),
                "mine:7:1: geofence.0.altitude_max_m = 349: must be at least 350: UAV 1 flies at 350 m, and a keep-in \
                 zone must contain all altitudes of all UAVs; change groups.altitude_lowest_m, groups.altitude_step_m, \
                 groups.altitude_policy, uavs.climb or the start of the UAV, or remove this limit",
            ),
            (
                "altitude_min_m = 301",
                format!("{two}{common}"),
                "mine:7:1: geofence.0.altitude_min_m = 301: must be at most 300: UAV 0 flies at 300 m, and",
            ),
            (
                "altitude_max_m = 5000",
                two.to_owned(),
                "mine:7:1: geofence.0.altitude_max_m = 5000: must contain all altitudes of all UAVs: UAV 0 can be \
                 commanded to fly at any altitude from 300 m, one per group; set groups.altitude_policy = \"common\" or \
                 \"per-uav\", or the table [uavs.climb] with altitude_max_m",
            ),
            (
                "altitude_max_m = 499",
                climbing.to_owned(),
                "mine:7:1: geofence.0.altitude_max_m = 499: must be at least 500: UAV 0 can fly at 120 to 500 m, and",
            ),
            (
                "altitude_min_m = 121",
                climbing.to_owned(),
                "mine:7:1: geofence.0.altitude_min_m = 121: must be at most 120: UAV 0 can fly at 120 to 500 m, and",
            ),
        ] {
            let error = result(limits, &rest).unwrap_err();
            assert!(error.starts_with(expected), "{error}");
        }
        let inverted = "[uavs.climb]\naltitude_min_m = 500\naltitude_max_m = 400\n";
        let error = result("altitude_max_m = 450", inverted).unwrap_err();
        assert!(error.contains("uavs.climb.altitude_max_m = 400") && !error.contains("geofence"), "{error}");
        // A keep-out zone limits no altitudes.
        let out = zone.replace("keep-in", "keep-out").replace("x_m = 0", "x_m = 20000");
        assert!(typed(&format!("{out}altitude_max_m = 120")).is_ok());
    }

    #[test]
    fn zones_of_geojson_have_the_band_of_their_feature_or_of_the_table() {
        let folder = tempfile::tempdir().unwrap();
        let of_file = |properties: &str, table: &str| {
            let geometry = "{\"type\":\"Polygon\",\"coordinates\":[[[900,0],[1900,0],[900,900],[900,0]]]}";
            let collection = format!("{{\"type\":\"GeometryCollection\",\"geometries\":[{geometry}]}}");
            let feature = format!("{{\"type\":\"Feature\",\"properties\":{properties},\"geometry\":{collection}}}");
            fs::write(folder.path().join("z.geojson"), feature).unwrap();
            let scenario = of_toml(&format!("[[geofence]]\nfile = \"z.geojson\"\n{table}"), folder.path())?;
            let zone = scenario.settings.geofence.zones().next().unwrap();
            Ok((zone.altitude_min_m, zone.altitude_max_m))
        };
        assert_eq!(of_file("null", ""), Ok((None, None)));
        assert_eq!(of_file("{\"altitude_min_m\": null}", ""), Ok((None, None)));
        let both = "{\"altitude_min_m\": 50, \"altitude_max_m\": 120.5}";
        assert_eq!(of_file(both, ""), Ok((Some(50.0), Some(120.5))));
        assert_eq!(of_file(both, "altitude_min_m = 60"), Ok((Some(60.0), Some(120.5))));
        for (properties, table, expected) in [
            ("{\"altitude_max_m\": \"FL95\"}", "", "properties.altitude_max_m = \"FL95\": must be a number, m"),
            ("{\"altitude_max_m\": -5}", "", "polygon 0: altitude_max_m = -5 must be between 0 and 100000"),
            (both, "altitude_min_m = 121", "polygon 0: altitude_min_m = 121 is above altitude_max_m = 120.5"),
            (both, "altitude_min_m = { uniform = [1, 2] }", "altitude_min_m must be a finite number, not"),
            (both, "altitude_max_m = nan", "altitude_max_m must be a finite number, not"),
        ] {
            let error: String = of_file(properties, table).unwrap_err();
            assert!(
                error.starts_with("mine:2:1: geofence.0.file = \"z.geojson\": ") && error.contains(expected),
                "{error}"
            );
        }
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
        // The UAV flies at 300 m or above.
        let below = |ceiling_m: &str| {
            let zone = "[[geofence]]\nvertices = [[0, -500], [400, -500], [400, 500], [0, 500]]\naltitude_max_m = ";
            typed(&format!("{zone}{ceiling_m}\n[[uavs.start]]\nx_m = 200\n")).unwrap().warnings
        };
        assert_eq!((below("299").len(), below("300").len()), (0, 1));
    }

    /// In wind, a circle over ground needs more room than in calm air; without one, UAVs cannot stay inside.
    #[test]
    fn the_wind_counts_for_room_and_starts() {
        let zones = |kind: &str, x_m: f64, wind_m_s: f64| {
            let zone =
                format!("[[geofence]]\nkind = \"{kind}\"\nvertices = [[0, -500], [300, -500], [300, 500], [0, 500]]\n");
            typed(&format!("{zone}[wind]\nspeed_m_s = {wind_m_s}\nfrom_deg = 270\n[[uavs.start]]\nx_m = {x_m}\n"))
        };
        assert_eq!(zones("keep-in", 150.0, 0.0).unwrap().warnings, [""; 0]);
        let error = zones("keep-in", 150.0, 10.0).unwrap_err().to_string();
        assert!(error.contains("circle there at its lowest speed in a wind of 10 m/s"), "{error}");
        let is_warned = |x_m: f64, wind_m_s: f64, expected: &str| {
            let warnings = zones("keep-out", x_m, wind_m_s).unwrap().warnings;
            warnings.iter().any(|warning| warning.contains(expected))
        };
        let starts =
            [-250.0, -150.0, -110.0].map(|x_m| [0.0, 20.0].map(|wind_m_s| is_warned(x_m, wind_m_s, "turn away")));
        assert!(starts.iter().all(|[calm, wind]| wind >= calm) && starts.contains(&[false, true]), "{starts:?}");
        let cross = "UAVs may cross the outlines of zones: ";
        assert_eq!([24.0, 26.0].map(|wind_m_s| is_warned(-5000.0, wind_m_s, cross)), [false, true]);
    }
}
