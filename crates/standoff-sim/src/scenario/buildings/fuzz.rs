//! Fuzz target: buildings in GeoJSON and SUMO polygons. `scripts/fuzz` runs it for longer.

use standoff_io::text_source;

use super::*;
use crate::fuzz_harness::{corpus, refused, run};

const PARTS: [&str; 29] = [
    "{",
    "}",
    "[",
    "]",
    ",",
    "null",
    "[[[[[[[[",
    "\"type\":",
    "\"FeatureCollection\"",
    "\"Feature\"",
    "\"features\":",
    "\"geometry\":",
    "\"coordinates\":",
    "\"properties\": {\"building\": \"yes\", \"height\": \"12 m\"},",
    "\"properties\": {\"building:levels\": 1e9},",
    "\"Polygon\"",
    "\"MultiPolygon\"",
    "\"Point\"",
    "[9, 44.25]",
    "[1e300, -1e300]",
    "[0, 0], [10, 0], [0, 10]",
    "<additional>",
    "</additional>",
    "<poly type=\"building\" shape=\"0,0 9,0 0,9\">",
    "</poly>",
    "<param key=\"height\" value=\"9\"/>",
    " geo=\"1\"",
    "shape=\"9,44.25 9.001,44.25 9,44.251\"",
    "1e400,nan",
];

/// Reads buildings; returns whether they were accepted. Their text must give the same buildings again.
fn try_one(bytes: &[u8], origin: Option<Origin>) -> bool {
    let contents = match text_source::text(bytes, &BUILDINGS).and_then(|text| file::read(text, origin)) {
        Ok(contents) => contents,
        Err(fault) => return refused(&fault.message),
    };
    for outline in &contents.buildings {
        assert_eq!(&outline.to_string().parse::<Outline>().unwrap(), outline);
    }
    Buildings::new(contents.buildings.iter().map(|outline| outline.building(10.0)).collect()).unwrap();
    true
}

#[test]
fn any_file_gives_buildings_or_is_refused() {
    let files = corpus("buildings");
    let traffic = Some(Origin { latitude_deg: 44.25, longitude_deg: 9.0 });
    run("buildings", 0.05, |choices| {
        let origin = *choices.one_of(&[None, traffic]);
        try_one(&choices.mutated(&files, &PARTS), origin)
    });
}
