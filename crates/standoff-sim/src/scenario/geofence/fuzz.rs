//! Fuzz target: zones in GeoJSON. `scripts/fuzz` runs it for longer.

use super::*;
use crate::fuzz_harness::{corpus, refused, run};

const GEOJSON: [&str; 24] = [
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
    "\"Polygon\"",
    "\"MultiPolygon\"",
    "\"Point\"",
    "\"GeometryCollection\"",
    "\"Topology\"",
    "[181, 91]",
    "[0, 0], [1, 1], [0, 1]",
];

/// Reads zones; returns whether they were accepted. Accepted zones must be valid outlines for the library.
fn try_one(bytes: &[u8], origin: Option<Origin>, kind: ZoneKind) -> bool {
    let table = schema_types::Zone { name: String::new(), file: "file".to_owned(), kind, vertices: Vec::new() };
    let found = match polygons(bytes, origin).and_then(|polygons| zones(&table, polygons)) {
        Ok(found) => found,
        Err(message) => return refused(&message),
    };
    assert!((1..=ZONES_MAX).contains(&found.len()));
    for zone in found {
        let place = |point: &Vec<Number>| match point[..] {
            [Number::Constant(x_m), Number::Constant(y_m)] => Position::from_m(x_m, y_m),
            _ => panic!("{point:?} is not a position"),
        };
        let outline: Vec<_> = zone.vertices.iter().map(place).collect();
        assert!(outline.iter().all(|at| at.is_finite()) && zone.file.is_empty());
        Geofence::new(vec![Zone { name: zone.name, kind: zone.kind.into(), vertices: outline }]).unwrap();
    }
    true
}

#[test]
fn any_geojson_gives_zones_or_is_refused() {
    let files = corpus("zones");
    let traffic = Some(Origin { latitude_deg: 44.25, longitude_deg: 9.0 });
    run("zones", 0.05, |choices| {
        let (origin, kind) =
            (*choices.one_of(&[None, traffic]), *choices.one_of(&[ZoneKind::KeepIn, ZoneKind::KeepOut]));
        try_one(&choices.mutated(&files, &GEOJSON), origin, kind)
    });
}
