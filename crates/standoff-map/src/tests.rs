//! Tests with whole files: small ones from this file, and real ones of `../shared/data` if available.

use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use standoff_io::geodesy::Origin;
use standoff_io::text_source;
use standoff_sim::scenario::MapFile;
use standoff_sim::traffic::{Options, Traffic, read};

use crate::encode::{Contents, Layer, check};
use crate::feature_class::Kind;
use crate::geometry::Count;
use crate::limits::{MAX_POINTS, MAX_SHAPES};
use crate::{Bounds, MAP, MapError, Packed, Place, pack, parse};

const METRES: Place = Place { origin: None, bounds: Bounds([0.0, 0.0, 100.0, 100.0]) };

/// An edge from 0, 0 to 100, 0 with two lanes of 3 m, whose middle is 1.5 m to the left; a path; a junction.
const NET: &str = r#"<net version="1.20">
<location netOffset="-500000,-4900000" convBoundary="0,0,1,1" origBoundary="0,0,1,1" projParameter="+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"/>
<edge id=":j_0" function="internal"><lane id=":j_0_0" index="0" speed="9" length="1" shape="100,0 105,5"/></edge>
<edge id="e" from="a" to="b" priority="3">
  <lane id="e_0" index="0" allow="pedestrian" speed="2" length="100" width="2" shape="0,-2.5 100,-2.5"/>
  <lane id="e_1" index="1" speed="13.9" length="100" width="3" shape="0,0 50,0 100,0"/>
  <lane id="e_2" index="2" speed="13.9" length="100" width="3" shape="0,3 50,3 100,3"/>
</edge>
<edge id="m" from="b" to="c"><lane id="m_0" index="0" speed="27" length="9" shape="0,50 100,50"/></edge>
<edge id="f" from="b" to="c"><lane id="f_0" index="0" allow="pedestrian bicycle" speed="2" length="9" width="2" shape="0,9 100,9"/></edge>
<edge id="t" from="b" to="c"><lane id="t_0" index="0" allow="tram" speed="9" length="9" shape="0,20 100,20"/></edge>
<junction id="b" type="priority" x="100" y="1" incLanes="e_0 e_1 e_2" intLanes="" shape="100,-2 100,5 110,5 110,-2"/>
<junction id="d" type="dead_end" x="0" y="9" incLanes="f_0" intLanes="" shape="0,8 0,10 -1,10"/>
</net>"#;

/// Packs maps that are given as texts, as files on disk.
fn packed(texts: &[&str], place: &Place) -> Result<Packed, MapError> {
    let home = tempfile::tempdir().unwrap();
    let files: Vec<MapFile> = (0..)
        .zip(texts)
        .map(|(number, text)| {
            let path = home.path().join(format!("{number}.map"));
            std::fs::write(&path, text).unwrap();
            MapFile::OnDisk(path)
        })
        .collect();
    let result = pack(&files, place);
    result
        .map_err(|error| MapError { file: Path::new(&error.file).file_name().unwrap().display().to_string(), ..error })
}

fn refused(texts: &[&str], place: &Place) -> String {
    packed(texts, place).unwrap_err().to_string()
}

/// Contents of a packed map: class, width, and points in metres.
type Unpacked = Vec<(Kind, f64, Vec<[f64; 2]>)>;

fn unpacked(packed: &Packed) -> (Unpacked, Unpacked, Option<String>) {
    check(&packed.gz).unwrap();
    let mut json = String::new();
    GzDecoder::new(&packed.gz[..]).read_to_string(&mut json).unwrap();
    let Contents { layers, credit, .. } = serde_json::from_str(&json).unwrap();
    let points = |deltas: &Vec<i32>| {
        let step = |at: &mut [i32; 2], by: &[i32]| {
            *at = [at[0] + by[0], at[1] + by[1]];
            Some(at.map(|value| f64::from(value) / 10.0))
        };
        deltas.chunks(2).scan([0; 2], step).collect::<Vec<_>>()
    };
    let lines =
        layers.iter().flat_map(|layer| layer.lines.iter().map(|line| (layer.kind, layer.width_m, points(line))));
    let rings =
        layers.iter().flat_map(|layer| layer.areas.iter().flatten().map(|ring| (layer.kind, 0.0, points(ring))));
    (lines.collect(), rings.collect(), credit)
}

#[test]
fn net_in_metres_keeps_its_frame_and_edges_have_the_width_of_their_lanes() {
    let (lines, rings, credit) = unpacked(&packed(&[NET], &METRES).unwrap());
    let expected = [
        (Kind::Path, 2.0, vec![[0.0, 9.0], [100.0, 9.0]]),
        (Kind::Rail, 3.0, vec![[0.0, 20.0], [100.0, 20.0]]),
        (Kind::Minor, 6.0, vec![[0.0, 1.5], [100.0, 1.5]]),
        (Kind::Major, 3.0, vec![[0.0, 50.0], [100.0, 50.0]]),
    ];
    assert_eq!(lines, expected);
    let junction = vec![[100.0, -2.0], [100.0, 5.0], [110.0, 5.0], [110.0, -2.0], [100.0, -2.0]];
    assert_eq!(rings, [(Kind::Minor, 0.0, junction)]);
    assert_eq!(credit, None);
}

/// Names of the roads of a packed map, with the first point of each line, m.
fn names(packed: &Packed) -> Vec<(String, [f64; 2])> {
    check(&packed.gz).unwrap();
    let contents: Contents = serde_json::from_reader(GzDecoder::new(&packed.gz[..])).unwrap();
    let of = |layer: &Layer| {
        let at = |index: &u32| [0, 1].map(|axis| f64::from(layer.lines[*index as usize][axis]) / 10.0);
        let named =
            layer.names.iter().flat_map(|(name, lines)| lines.iter().map(move |index| (name.clone(), at(index))));
        named.collect::<Vec<_>>()
    };
    contents.layers.iter().flat_map(of).collect()
}

#[test]
fn roads_keep_their_names() {
    let net = NET.replace(r#"<edge id="m""#, r#"<edge name=" Via Emilia &amp; Co " id="m""#);
    let long = NET.replace(r#"<edge id="m""#, &format!(r#"<edge name="{}" id="m""#, "x".repeat(101)));
    assert_eq!(names(&packed(&[&net], &METRES).unwrap()), [("Via Emilia & Co".to_owned(), [0.0, 50.0])]);
    assert_eq!(names(&packed(&[&long], &METRES).unwrap()), []);
    let road = |properties: &str, north: u32| {
        let line = format!("[[200,{north}],[300,{north}]]");
        format!(
            r#"{{"type":"Feature","properties":{properties},"geometry":{{"type":"LineString","coordinates":{line}}}}}"#
        )
    };
    let features = [
        road(r#"{"name":"Bahnhofstraße","highway":"residential"}"#, 1),
        road(r#"{"highway":"residential"}"#, 2),
        // The name of a road is not its class.
        road(r#"{"name":"park","highway":"primary"}"#, 3),
        road(r#"{"name":"  "}"#, 4),
    ];
    let text = format!(r#"{{"type":"FeatureCollection","features":[{}]}}"#, features.join(","));
    let found = packed(&[&text], &METRES).unwrap();
    assert_eq!(names(&found), [("Bahnhofstraße".to_owned(), [200.0, 1.0]), ("park".to_owned(), [200.0, 3.0])]);
    assert!(unpacked(&found).0.iter().all(|(kind, ..)| *kind != Kind::Green));
}

/// Traffic of `sumo --fcd-output.utm` lacks the offset of its net.
#[test]
fn net_for_traffic_in_its_projection_is_shifted() {
    let place = Place { origin: None, bounds: Bounds([500_000.0, 4_900_000.0, 500_100.0, 4_900_100.0]) };
    // The position of a degree east and north, by the same projection.
    let square =
        r#"{"type": "Polygon", "coordinates": [[[9.0, 44.25], [9.001, 44.25], [9.001, 44.251], [9.0, 44.25]]]}"#;
    let (lines, rings, _) = unpacked(&packed(&[NET, square], &place).unwrap());
    assert_eq!(lines[2].2, [[500_000.0, 4_900_001.5], [500_100.0, 4_900_001.5]]);
    assert!(rings.iter().any(|(.., ring)| (ring[0][0] - 500_000.0).abs() < 0.2), "{rings:?}");
    let elsewhere = Place { bounds: Bounds([300_000.0, 0.0, 300_100.0, 100.0]), ..place };
    assert!(refused(&[NET], &elsewhere).contains("it spans x = 0 to 110 m"));
}

/// The central meridian of zone 32, 9 degrees east, is at 500,000 m.
#[test]
fn net_for_traffic_in_degrees_is_projected_back() {
    // 4,900,001.5 m / 0.9996 along the meridian from the equator, which is 361.2 m north of 44.25 degrees (Helmert's
    // series).
    let origin = Some(Origin { latitude_deg: 44.25, longitude_deg: 9.0 });
    let place = Place { origin, bounds: Bounds([0.0; 4]) };
    let (lines, ..) = unpacked(&packed(&[NET], &place).unwrap());
    let (_, _, line) = &lines[2];
    let [[west_m, y_m], [east_m, _]] = line[..] else { panic!("{line:?}") };
    assert!(west_m.abs() < 0.11 && (east_m - 100.04).abs() < 0.11, "a metre is 1/0.9996 m on the ground: {line:?}");
    assert!((y_m - 361.2).abs() < 0.11, "{line:?}");
}

#[test]
fn geojson_properties_define_the_class() {
    let json = r#"{"type": "FeatureCollection", "copyright": "OpenStreetMap", "features": [
      {"type": "Feature", "properties": {"highway": "primary", "lanes": "3"}, "geometry":
        {"type": "LineString", "coordinates": [[9.0, 44.25], [9.001, 44.25, 17]]}},
      {"properties": null, "geometry": null, "type": "Feature"},
      {"type": "Feature", "geometry": {"type": "Point", "coordinates": [9, 44]}, "properties": {"natural": "tree"}},
      {"type": "Feature", "properties": {"tags": {"building": "yes"}}, "geometry": {"type": "MultiPolygon", "coordinates":
        [[[[9, 44.25], [9.001, 44.25], [9.001, 44.251], [9, 44.25]], [[9.0005, 44.2501], [9.0008, 44.2501], [9.0008, 44.2504],
        [9.0005, 44.2501]]]]}}]}"#;
    let origin = Some(Origin { latitude_deg: 44.25, longitude_deg: 9.0 });
    let place = Place { origin, bounds: Bounds([0.0; 4]) };
    let (lines, rings, credit) = unpacked(&packed(&[json], &place).unwrap());
    // A thousandth of a degree along the parallel of 44.25: 79.87 m.
    assert_eq!(lines, [(Kind::Major, 9.5, vec![[0.0, 0.0], [79.9, 0.0]])]);
    assert_eq!(rings.iter().map(|ring| (ring.0, ring.2.len())).collect::<Vec<_>>(), [(Kind::Building, 4); 2]);
    assert_eq!(credit.as_deref(), Some("\u{a9} OpenStreetMap contributors"));
}

const LINE: &str = r#"{"type": "LineString", "coordinates": [[9.0, 44.2525], [9.001, 44.2525]]}"#;

#[test]
fn geojson_in_degrees_for_traffic_in_metres_needs_the_net() {
    let (lines, ..) = unpacked(&packed(&[LINE, NET], &METRES).unwrap());
    let (_, _, line) = lines.iter().find(|(kind, ..)| *kind == Kind::Other).unwrap();
    assert!(line[0][0].abs() < 0.11 && line[0][1].abs() < 300.0 && (line[1][0] - 79.8).abs() < 0.3, "{line:?}");
    let error_text = refused(&[LINE], &METRES);
    assert!(error_text.starts_with("0.map: its coordinates are in degrees, but the run is in metres"), "{error_text}");
    let without = NET.replace("+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs", "!");
    assert_eq!(refused(&[LINE, &without], &METRES), error_text);
    assert!(packed(&[&without], &METRES).is_ok(), "metres need no projection");
}

#[test]
fn coordinates_beyond_degrees_are_metres_in_the_plane() {
    let line = r#"{"type": "LineString", "coordinates": [[0, 100], [200.04, 100]]}"#;
    let (lines, ..) = unpacked(&packed(&[line], &METRES).unwrap());
    assert_eq!(lines, [(Kind::Other, 1.0, vec![[0.0, 100.0], [200.0, 100.0]])]);
}

/// A road drawn across the antimeridian, as map editors do, and one in the west.
#[test]
fn longitudes_beyond_180_are_wrapped() {
    let fiji = Place { origin: Some(Origin { latitude_deg: -16.8, longitude_deg: 179.995 }), ..METRES };
    let roads = |last: &str| {
        format!(
            r#"{{"type": "MultiLineString", "coordinates": [[[179.99, -16.8], {last}], [[-179.999, -16.8], [-179.99, -16.8]]]}}"#
        )
    };
    let drawn = |last: &str| unpacked(&packed(&[&roads(last)], &fiji).unwrap()).0;
    assert_eq!(drawn("[180.01, -16.8]"), drawn("[-179.99, -16.8]"));
    let ends_m = drawn("[180.01, -16.8]").into_iter().map(|(.., line)| line.last().unwrap()[0]).collect::<Vec<_>>();
    // A degree of longitude has 106.6 km there.
    assert!(ends_m.len() == 2 && ends_m.iter().all(|x| (x - 1598.7).abs() < 0.5), "{ends_m:?}");
    let wrong = refused(&[&roads("[1800.1, -16.8]")], &fiji);
    assert!(wrong.starts_with("0.map: [1800.1, -16.8] cannot be degrees (-360 to 360, -90 to 90), but"), "{wrong}");
    let net = NET.replace("+zone=32", "+zone=60").replace("-500000,-4900000", "-819000,1860000");
    let over_net = Place { bounds: Bounds([0.0, -2000.0, 2000.0, 2000.0]), ..METRES };
    let line = r#"{"type": "LineString", "coordinates": [[179.999, -16.8], [180.001, -16.8]]}"#;
    assert_eq!(unpacked(&packed(&[&net, line], &over_net).unwrap()).0.len(), 5, "degrees over a net in metres");
}

#[test]
fn a_map_of_which_nothing_is_left_is_refused() {
    let speck = r#"<additional><poly id="a" shape="1,1 1.01,1" type="road"/></additional>"#;
    let nothing = refused(&[NET, speck], &METRES);
    assert!(nothing.starts_with("1.map: nothing of it is left, because all its lines and areas near"), "{nothing}");
}

#[test]
fn frames_that_cannot_be_placed_are_refused_with_advice() {
    let degrees = Place { origin: Some(Origin { latitude_deg: 44.25, longitude_deg: 9.0 }), ..METRES };
    let with =
        |projection: &str| NET.replace("+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs", projection);
    for (projection, expected) in [
        ("!", "0.map:2:86: projParameter = \"!\": it has no projection, so its location on the Earth is unknown"),
        ("+proj=nonsense", "0.map:2:86: projParameter = \"+proj=nonsense\": "),
        ("+proj=longlat", "0.map:2:86: projParameter = \"+proj=longlat\": must convert degrees to metres and back"),
        ("+proj=utm +zone=32 +nadgrids=/dev/zero", "0.map:2:86: projParameter = "),
        ("rubbish", "0.map:2:86: projParameter = "),
    ] {
        let error_text = refused(&[&with(projection)], &degrees);
        assert!(error_text.starts_with(expected), "{error_text}");
    }
    let far = Place { bounds: Bounds([1e5, 0.0, 1e5, 9.0]), ..METRES };
    let error_text = refused(&[NET], &far);
    let zero = refused(&[NET], &Place { bounds: Bounds([1e5, -0.4, 1e5, 0.0]), ..METRES });
    assert!(zero.contains("y = 0 to 0 m; it spans"), "{zero}");
    assert!(
        error_text.contains("no part of it is within 5 km of the run, which is at x = 100000 to 100000 m"),
        "{error_text}"
    );
}

#[test]
fn invalid_maps_are_refused_with_the_position() {
    for (text, expected) in [
        ("", "0.map: is empty; must be a SUMO net (.net.xml), SUMO polygons or GeoJSON"),
        (" \n", "0.map: contains no text; must be"),
        ("t,id,x,y\n", "0.map:1:1: is not a map: must be a SUMO net"),
        (
            "<fcd-export/>",
            "0.map:1:1: element = \"fcd-export\"; the root element must be net or additional; this is traffic",
        ),
        (
            "<kml/>",
            "0.map:1:1: element = \"kml\"; the root element must be net or additional; this is KML: convert it to",
        ),
        ("<net>\n</net>", "0.map: contains neither edges nor polygons"),
        ("<net>\n<edge id=\"a\">\n <lane id=\"l\"/></edge></net>", "0.map:3:2: lane: shape is missing"),
        ("<net>\n<edge id=\"a\"><lane shape=\"1,2 3\"/></edge></net>", "0.map:2:20: \"3\": must be x,y in metres"),
        (
            "<net>\n<edge id=\"a\"><lane shape=\"1,2 1e99,3\"/></edge></net>",
            "0.map:2:20: \"1e99,3\": must be -1e8 to 1e8 m",
        ),
        ("<net><edge id=\"a\"><lane shape=\"1,2 3,4\"/></edge></net>", "0.map: contains no <location>"),
        ("<net><location netOffset=\"1,2\"/></net>", "0.map:1:6: location: projParameter is missing"),
        ("<net><location netOffset=\"1\" projParameter=\"!\"/></net>", "0.map:1:16: netOffset: \"1\": must be x,y"),
        ("<net><edge", "0.map:1:6: not well-formed XML"),
        ("{\"type\": \"FeatureCollection\", \"features\": [", "0.map:1:"),
        ("{\"type\": \"Topology\"}", "0.map:1:20: this is TopoJSON"),
        ("{\"type\": \"Flight\"}", "0.map: type = \"Flight\": must be FeatureCollection"),
        (
            "{\"type\": \"FeatureCollection\", \"features\": [\n{\"type\": \"Car\"}]}",
            "0.map:2:16: type = \"Car\": must be Feature",
        ),
        ("{\"type\": \"LineString\", \"coordinates\": [[1, 2],\n[3]]}", "0.map:2:3: a position with one number"),
        ("{\"type\": \"LineString\", \"coordinates\": [[1, 2],\n[1e300, 3]]}", "0.map:2:"),
        (
            "{\"type\": \"Polygon\", \"coordinates\": [[1, 2], [3, 4]]}",
            "0.map: Polygon: its coordinates have the wrong nesting depth",
        ),
        ("{\"type\": \"Point\", \"coordinates\": [1, 2]}", "0.map: contains neither lines nor polygons"),
        ("{\"crs\": {\"properties\": {\"name\": \"EPSG:3857\"}}}", "0.map:1:46: crs = \"EPSG:3857\": must be WGS84"),
    ] {
        let error_text = refused(&[text], &METRES);
        assert!(error_text.starts_with(expected), "{text}: {error_text}");
    }
    let deep = format!("{{\"type\": \"LineString\", \"coordinates\": {}", "[".repeat(100_000));
    assert!(refused(&[&deep], &METRES).contains("recursion limit"), "{}", refused(&[&deep], &METRES));
}

/// Stored values must be scalars without deep nesting; skipped values may be anything.
#[test]
fn nested_values_of_properties_are_skipped() {
    let large = format!("[1e999, {}0{}]", "[".repeat(1_000), "]".repeat(1_000));
    for json in [
        format!("{{\"id\": {large}, \"copyright\": {{\"a\": {large}}}, {}", &LINE[1..]),
        format!("{{\"crs\": {large}, {}", &LINE[1..]),
        format!(
            "{{\"crs\": {{\"type\": {large}, \"properties\": {{\"x\": {large}, \"name\": {large}}}}}, {}",
            &LINE[1..]
        ),
        format!(
            "{{\"type\": \"Feature\", \"properties\": {{\"highway\": {large}, \"width\": {{\"m\": {large}}}}}, \"geometry\": {LINE}}}"
        ),
    ] {
        let (lines, ..) = unpacked(&packed(&[&json, NET], &METRES).unwrap());
        assert!(lines.iter().any(|(kind, ..)| *kind == Kind::Other), "{json}");
    }
    let long = format!("{{\"crs\": {{\"properties\": {{\"name\": \"{}\"}}}}}}", "\u{e9}".repeat(1_000));
    assert!(refused(&[&long], &METRES).contains(": must be WGS84"));
}

/// Contents in memory are counted immediately, before their enclosing object ends: here it never ends.
#[test]
fn limits_are_checked_before_data_are_stored() {
    let lane = "<lane id=\"l\" shape=\"0,0 1,1\"/>\n";
    let points = Count { points: MAX_POINTS - 3, shapes: 0 };
    let shapes = Count { points: 0, shapes: MAX_SHAPES - 1 };
    for (text, before, place, expected) in [
        (format!("<net><edge id=\"e\">\n{lane}{lane}"), points, "3:1", "has more than 5000000 points"),
        (format!("<net><edge id=\"e\">\n{lane}{lane}"), shapes, "3:1", "has more than 1000000 lines and areas"),
        (
            "{\"coordinates\": [[[1, 2]], [\n[1, 2], [1, 2], [1, 2]".to_owned(),
            points,
            "2:22",
            "has more than 5000000 points",
        ),
        ("{\"geometries\": [{},\n{}".to_owned(), shapes, "2:2", "has more than 1000000 lines and areas"),
    ] {
        let text = text_source::text(text.as_bytes(), &MAP).unwrap();
        let fault = parse(text, before, false).unwrap_err();
        assert!(fault.message.starts_with(expected), "{fault}");
        assert_eq!(fault.position.unwrap().to_string(), place, "{fault}");
    }
}

#[test]
fn maps_of_a_run_share_the_limits_and_reading_stops_there() {
    let half = vec!["[[0,0],[0,1]]"; MAX_SHAPES / 2 + 1].join(",");
    let half = format!("{{\"type\": \"MultiLineString\", \"coordinates\": [{half}]}}");
    let error_text = refused(&[&half, &half, "rubbish"], &METRES);
    assert!(error_text.starts_with("1.map: has more than 1000000 lines and areas; crop the map"), "{error_text}");
}

#[test]
fn gzipped_map_equals_the_plain_one() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("a.net.xml.gz");
    let mut gz = GzEncoder::new(Vec::new(), Compression::fast());
    gz.write_all(NET.as_bytes()).unwrap();
    std::fs::write(&path, gz.finish().unwrap()).unwrap();
    assert_eq!(pack(&[MapFile::OnDisk(path)], &METRES), packed(&[NET], &METRES));
    let missing = pack(&[MapFile::OnDisk(home.path().join("none"))], &METRES).unwrap_err();
    assert!(missing.to_string().contains("none: cannot be read: No such file") && !missing.is_io_error, "{missing}");
    assert!(pack(&[MapFile::OnDisk(home.path().to_owned())], &METRES).unwrap_err().message.contains("it is a folder"));
}

/// A grid of zigzag lines of ten times the maximum size is simplified until it fits, and the note reports it.
#[test]
fn map_that_is_too_large_is_simplified_until_it_fits() {
    let mut json = "{\"type\": \"MultiLineString\", \"coordinates\": [".to_owned();
    let mut noise = 1_u32;
    for way in 0..4_000 {
        let points = (0..400).map(|k| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let off = f64::from(noise >> 16) / 65_536.0 * 6.0;
            format!("[{}, {:.2}]", 200.0 + 7.0 * f64::from(k), f64::from(way) + off)
        });
        json += &format!("{}[{}]", if way > 0 { ",\n" } else { "" }, points.collect::<Vec<_>>().join(","));
    }
    json += "]}";
    let packed = packed(&[&json], &METRES).unwrap();
    assert!(packed.gz.len() <= crate::limits::MAX_PACKED, "{} bytes", packed.gz.len());
    let note = packed.note.clone().unwrap();
    assert!(note.starts_with("the map is simplified: lines have a tolerance of "), "{note}");
    assert_eq!(unpacked(&packed).0.len(), 4_000, "no line is lost");
}

#[test]
fn distant_shapes_are_omitted_with_a_note() {
    let far = NET.replace("0,50 100,50", "0,50000 100,50000");
    let packed = packed(&[&far], &METRES).unwrap();
    let expected =
        "the map is simplified: 1 of 5 lines and areas are omitted because they are more than 5 km from the run";
    assert_eq!(packed.note.as_deref(), Some(expected));
}

#[test]
fn damaged_map_of_a_record_is_refused() {
    let home = tempfile::tempdir().unwrap();
    assert_eq!(crate::of_record(home.path()), Ok(None));
    let good = packed(&[NET], &METRES).unwrap();
    let path = home.path().join(standoff_record::MAP_FILE);
    std::fs::write(&path, &good.gz).unwrap();
    assert_eq!(crate::of_record(home.path()).unwrap().unwrap().gz, good.gz);
    let gz = |json: &str| {
        let mut gz = GzEncoder::new(Vec::new(), Compression::fast());
        gz.write_all(json.as_bytes()).unwrap();
        gz.finish().unwrap()
    };
    for (bad, what) in [
        ("{\"format\":1,\"layers\":[{\"kind\":\"minor\",\"width_m\":1,\"lines\":[[1,2,3]],\"areas\":[]}]}", "lines"),
        ("{\"format\":1,\"layers\":[{\"kind\":\"minor\",\"width_m\":-1,\"lines\":[],\"areas\":[]}]}", "widths"),
        (&format!("{{\"format\":1,\"credit\":\"{}\",\"layers\":[]}}", "x".repeat(101)), "credit"),
    ] {
        assert_eq!(check(&gz(bad)), Err(format!("invalid {what}")));
    }
    for bad in [
        good.gz[..20].to_vec(),
        b"rubbish".to_vec(),
        gz("{}"),
        gz("{\"format\":9,\"layers\":[]}"),
        gz("{\"format\":1,\"layers\":[{\"kind\":\"x\",\"width_m\":1,\"lines\":[],\"areas\":[]}]}"),
        gz("{\"format\":1,\"layers\":[{\"kind\":\"minor\",\"width_m\":1,\"lines\":[[1,2,3]],\"areas\":[]}]}"),
        gz("{\"format\":1,\"layers\":[{\"kind\":\"minor\",\"width_m\":1,\"lines\":[[1e300,2,3,4]],\"areas\":[]}]}"),
        gz("{\"format\":1,\"layers\":[{\"kind\":\"minor\",\"width_m\":-1,\"lines\":[],\"areas\":[]}]}"),
        gz(&format!("{{\"format\":1,\"credit\":\"{}\",\"layers\":[]}}", "x".repeat(101))),
        gz(&" ".repeat(40_000_000)),
    ] {
        std::fs::write(&path, &bad).unwrap();
        let error_text = crate::of_record(home.path()).unwrap_err();
        assert!(
            error_text.starts_with("map.json.gz is not a valid packed map: ") && error_text.len() < 400,
            "{error_text}"
        );
    }
}

fn data() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !folder.is_dir() {
        println!("no ../shared/data here");
        return None;
    }
    Some(folder)
}

fn distance_m([x, y]: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let along = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy).max(1e-9);
    let along = along.clamp(0.0, 1.0);
    standoff::math::hypot(x - a[0] - along * dx, y - a[1] - along * dy)
}

fn is_inside([x, y]: [f64; 2], ring: &[[f64; 2]]) -> bool {
    let crosses = |edge: &&[[f64; 2]]| {
        let [a, b] = [edge[0], edge[1]];
        (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    };
    ring.windows(2).filter(crosses).count() % 2 == 1
}

/// Distances of vehicles from the drawn roads, m: 0 on a road or in a junction, otherwise from the road's edge.
fn off_road_m(traffic: &Traffic, net: &Path) -> Vec<f64> {
    let bounds = Bounds::of(traffic.places()).unwrap();
    let packed = pack(&[MapFile::OnDisk(net.to_owned())], &Place { origin: traffic.origin, bounds }).unwrap();
    let (lines, rings, _) = unpacked(&packed);
    let is_road = |kind: Kind| matches!(kind, Kind::Minor | Kind::Major);
    let roads = lines.iter().filter(|(kind, ..)| is_road(*kind));
    let segments: Vec<_> = roads
        .flat_map(|(_, width_m, line)| line.windows(2).map(move |pair| (width_m / 2.0, [pair[0], pair[1]])))
        .collect();
    let mut off: Vec<f64> = Vec::new();
    for at in traffic.places().step_by(20) {
        let distances = segments.iter().map(|(half_m, segment)| (distance_m(at, *segment) - half_m).max(0.0));
        let distance_to_road_m = distances.fold(f64::INFINITY, f64::min);
        off.push(if rings.iter().any(|(kind, _, ring)| is_road(*kind) && is_inside(at, ring)) {
            0.0
        } else {
            distance_to_road_m
        });
    }
    off.sort_by(f64::total_cmp);
    off
}

/// Both frames: metres of the net's frame, and degrees through its projection.
#[test]
fn real_vehicles_drive_on_the_roads_of_their_net() {
    let Some(folder) = data() else { return };
    for (traffic, net) in [
        ("bologna_split.fcd.xml.gz", "bologna_joined.net.xml.gz"),
        ("bologna_split.geo.fcd.xml.gz", "bologna_joined.net.xml.gz"),
        ("bologna_handoff_a.fcd.xml.gz", "bologna_joined.net.xml.gz"),
        ("bologna_handoff_a.geo.fcd.xml.gz", "bologna_joined.net.xml.gz"),
        ("hersfeld_split.geo.fcd.xml.gz", "hersfeld_cut.net.xml.gz"),
    ] {
        let read = read(&folder.join(traffic), &Options::default()).unwrap();
        let off = off_road_m(&read, &folder.join(net));
        let share = off.iter().filter(|off_m| **off_m == 0.0).count() as f64 / off.len() as f64;
        let (count, most_m) = (off.len(), off[off.len() - 1]);
        println!(
            "{traffic}: {:.2} % of {count} positions on a road, the largest distance from a road {most_m:.2} m",
            100.0 * share
        );
        // Hersfeld's net was cropped, and one of five cars continues beyond it.
        let least = if net.starts_with("hersfeld") { 0.94 } else { 0.999 };
        assert!(share > least, "{traffic}: {share}");
    }
}
