//! Fuzz targets (`bolero`): maps that are nearly valid. `scripts/fuzz` tries more inputs.

#[path = "../../standoff-io/fuzz/harness.rs"]
mod harness;

use flate2::Compression;
use flate2::write::GzEncoder;
use harness::{Choices, check_message, corpus, run};
use standoff_io::geodesy::Origin;
use standoff_io::text_source;

use crate::encode::check;
use crate::error::{MapError, named};
use crate::geometry::Count;
use crate::{Bounds, MAP, Place, parse, projection, simplify};

const SUMO: [&str; 36] = [
    "<net>",
    "</net>",
    "<additional>",
    "<location netOffset=\"",
    "projParameter=\"",
    "!",
    "+proj=utm +zone=32",
    "+proj=tmerc +lat_0=0 +lon_0=9 +k=0",
    "+proj=merc",
    "+proj=lcc +lat_1=90 +lat_2=-90",
    "+proj=stere",
    "+proj=pipeline",
    "+zone=0",
    "+a=0",
    "+k=nan",
    "+towgs84=1,2,3,4,5,6,7",
    "+datum=NAD27",
    "+nadgrids=/dev/zero",
    "<edge id=\"e\" function=\"internal\">",
    "<edge id=\"e\" type=\"highway.primary\">",
    "</edge>",
    "<lane id=\"l\" shape=\"",
    "0,0 100,0",
    " 1,2",
    "width=\"1e9\"",
    "allow=\"rail\"",
    "disallow=\"all\"",
    "<junction id=\"j\" incLanes=\"e_1\" shape=\"",
    "<poly type=\"building\" geo=\"1\" shape=\"",
    "\"/>",
    "/>",
    "<!--",
    "-->",
    "<![CDATA[",
    "&b;",
    "<!DOCTYPE a [<!ENTITY b \"c\">]>",
];

const GEOJSON: [&str; 36] = [
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
    "\"properties\":",
    "\"crs\": {\"properties\": {\"name\": \"x\"}},",
    "\"LineString\"",
    "\"MultiLineString\"",
    "\"Polygon\"",
    "\"MultiPolygon\"",
    "\"Point\"",
    "\"GeometryCollection\"",
    "\"Topology\"",
    "\"highway\": \"motorway\",",
    "\"width\": 1e300,",
    "\"lanes\": -1,",
    "\"tags\": {\"building\": 1},",
    "[9, 44]",
    "[181, 91]",
    "[[0, 0], [1, 1]]",
    "1e400",
    "\\u0000",
    "\\ud800",
    "{\"type\": \"Feature\", \"geometry\": null, \"properties\": null},",
];

fn somewhere(choices: &mut Choices<'_>) -> Place {
    let origin = Some(Origin { latitude_deg: 44.25, longitude_deg: 9.0 });
    let bounds = *choices.one_of(&[Bounds([0.0, 0.0, 100.0, 100.0]), Bounds([-1e8, -1e8, 1e8, 1e8])]);
    Place { origin: *choices.one_of(&[None, origin]), bounds }
}

/// Returns whether the input was accepted.
fn try_one(bytes: &[u8], place: &Place) -> bool {
    let made = || {
        let read = text_source::text(bytes, &MAP)
            .and_then(|text| parse(text, Count::default(), false))
            .map_err(named("file\u{1b}"))?;
        let placed = projection::all(vec![("file\u{1b}".to_owned(), read)], place)?;
        Ok::<_, MapError>(simplify::fit(placed, true))
    };
    match made() {
        Err(error) => {
            check_message(&error.to_string());
            false
        }
        Ok(Err(message)) => {
            check_message(&message);
            false
        }
        Ok(Ok(packed)) => {
            packed.note.iter().for_each(|note| check_message(note));
            check(&packed.gz).unwrap();
            true
        }
    }
}

#[test]
fn any_sumo_map_is_read_or_refused() {
    let files = corpus("sumo");
    let place = Place { origin: None, bounds: Bounds([0.0, 0.0, 100.0, 100.0]) };
    files.iter().for_each(|file| assert!(try_one(file, &place)));
    run("SUMO map", 0.1, |choices| {
        let place = somewhere(choices);
        try_one(&choices.mutated(&files, &SUMO), &place)
    });
}

#[test]
fn any_geojson_is_read_or_refused() {
    let files = corpus("geojson");
    run("GeoJSON", 0.1, |choices| {
        let place = somewhere(choices);
        try_one(&choices.mutated(&files, &GEOJSON), &place)
    });
}

/// The map of a record may come from anyone.
#[test]
fn any_packed_map_is_read_or_refused() {
    let place = Place { origin: None, bounds: Bounds([0.0, 0.0, 100.0, 100.0]) };
    let unpacked = |bytes: &[u8]| {
        let read = text_source::text(bytes, &MAP).and_then(|text| parse(text, Count::default(), false)).unwrap();
        let placed = projection::all(vec![(String::new(), read)], &place).unwrap();
        let gz = simplify::fit(placed, true).unwrap().gz;
        let mut json = Vec::new();
        std::io::copy(&mut flate2::read::GzDecoder::new(&gz[..]), &mut json).unwrap();
        json
    };
    let files: Vec<_> = corpus("sumo").iter().map(|file| unpacked(file)).collect();
    run("packed map", 0.02, |choices| {
        let json =
            choices.mutated(&files, &["[", "]", "{", "}", ",", "\"lines\":", "\"minor\"", "-1", "2147483648", "null"]);
        let mut gz = GzEncoder::new(Vec::new(), Compression::fast());
        std::io::copy(&mut &json[..], &mut gz).unwrap();
        match check(&choices.damaged(gz.finish().unwrap())) {
            Ok(()) => true,
            Err(message) => {
                check_message(&message);
                false
            }
        }
    });
}
