//! Fuzz target: zones in GeoJSON, plans and KML. `scripts/fuzz` runs it for longer.

use standoff_io::geodesy::Origin;

use super::*;
use crate::fuzz_harness::{corpus, refused, run};

const PARTS: [&str; 37] = [
    "{",
    "}",
    "[",
    "]",
    ",",
    ":",
    "null",
    "true",
    "[[[[[[[[",
    "\"type\"",
    "\"FeatureCollection\"",
    "\"Feature\"",
    "\"features\":",
    "\"geometry\":",
    "\"geometries\":",
    "\"coordinates\":",
    "\"properties\": {\"name\": \"\\u001b[2J\"},",
    "\"properties\": {\"altitude_min_m\": 50, \"altitude_max_m\": 1e2},",
    "\"Polygon\"",
    "\"MultiPolygon\"",
    "\"Point\"",
    "\"GeometryCollection\"",
    "\"Topology\"",
    "[181, 91]",
    "[0, 0], [1, 1], [0, 1]",
    "\"geoFence\":",
    "\"circles\":",
    "\"circle\": {\"center\": [44, 9], \"radius\": 50}",
    "\"inclusion\": true",
    "\"polygon\":",
    "<kml>",
    "<Polygon>",
    "</Polygon>",
    "<innerBoundaryIs>",
    "<extrude>1</extrude>",
    "<altitudeMode>relativeToGround</altitudeMode>",
    "<coordinates>9,44,3 9.1,44 9,44.1</coordinates>",
];

/// Reads zones; returns whether they were accepted. Accepted zones must be valid outlines for the library.
fn try_one(bytes: &[u8], origin: Option<Origin>, kind: ZoneKind) -> bool {
    let earth = origin.ok_or("unknown".to_owned()).map(|origin| Earth::Plane(origin.plane().unwrap()));
    let table = schema_types::Zone { kind, ..schema_types::Zone::default() };
    let found = match file::read(bytes, Coordinates::Auto, origin.is_none(), &earth)
        .and_then(|contents| zones(&table, contents.zones))
    {
        Ok(found) => found,
        Err(message) => return refused(&message),
    };
    assert!((1..=ZONES_MAX).contains(&found.len()));
    let mut all = Vec::new();
    for zone in found {
        let outline: Vec<_> = match (zone.x_m, zone.y_m, zone.radius_m) {
            (Some(x_m), Some(y_m), Some(radius_m)) => {
                standoff::ZoneKind::from(zone.kind).circle(Position::from_m(x_m, y_m), radius_m, CIRCLE_VERTICES)
            }
            _ => zone.vertices.iter().map(|at| Position::from_m(at[0], at[1])).collect(),
        };
        assert!(outline.iter().all(|at| at.is_finite()) && zone.file.is_empty());
        all.push(Zone {
            name: zone.name,
            kind: zone.kind.into(),
            vertices: outline,
            altitude_min_m: zone.altitude_min_m,
            altitude_max_m: zone.altitude_max_m,
            part_of: zone.part_of.map(|part_of| part_of as usize),
        });
        Geofence::new(vec![Zone { part_of: None, ..all[all.len() - 1].clone() }]).unwrap();
    }
    // Parts of garbage may touch after rounding; this is an error of the scenario.
    let _ = Geofence::new(all);
    true
}

#[test]
fn any_file_gives_zones_or_is_refused() {
    let files = corpus("zones");
    let traffic = Some(Origin { latitude_deg: 44.25, longitude_deg: 9.0 });
    run("zones", 0.05, |choices| {
        let (origin, kind) =
            (*choices.one_of(&[None, traffic]), *choices.one_of(&[ZoneKind::KeepIn, ZoneKind::KeepOut]));
        try_one(&choices.mutated(&files, &PARTS), origin, kind)
    });
}
