use std::fs;
use std::path::Path;

use standoff::Position;

use super::super::{Overrides, Scenario, ScenarioTemplate, Settings};
use super::*;
use crate::common::{frames, load};

const TARGET: &str = "[[targets.start]]\nx_m = 1\n";

fn of_toml(toml: &str, folder: &Path) -> Result<Scenario, String> {
    let template = ScenarioTemplate::of_toml("mine", &format!("{toml}\n{TARGET}"), &Overrides::default(), folder);
    template.and_then(|template| template.draw(1)).map_err(|error| error.to_string())
}

/// The buildings of a file called `name`, in a scenario with targets in metres.
fn of_file(name: &str, text: &str, more: &str) -> Result<Scenario, String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), text).unwrap();
    let scenario = of_toml(&format!("[world]\nbuildings = \"{name}\"\n{more}"), folder.path());
    scenario.map_err(|error| error.replace(&folder.path().display().to_string(), ""))
}

/// The same, over traffic at 44.25 degrees north, 9 degrees east.
fn over_degrees(name: &str, text: &str) -> Result<Scenario, String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("t.csv"), "t,id,lat,lon\n0,a,44.25,9\n60,a,44.251,9\n").unwrap();
    fs::write(folder.path().join(name), text).unwrap();
    let toml = format!("[world]\nbuildings = \"{name}\"\n[traffic]\nfile = \"t.csv\"");
    let template = ScenarioTemplate::of_toml("mine", &toml, &Overrides::default(), folder.path());
    template.and_then(|template| template.draw(1)).map_err(|error| error.to_string())
}

fn heights_m(scenario: &Scenario) -> Vec<f64> {
    scenario.settings.buildings.all().iter().map(|building| building.height_m).collect()
}

const SUMO: &str = include_str!("../../../corpus/buildings/sumo.poly.xml");

#[test]
fn outlines_are_written_and_read_in_centimetres() {
    for text in ["1200: 0,0 2000,0 2000,1000", "0,0 -5,0 0,7; 1,1 2,1 1,2", "1: 0,0 1,0 0,1"] {
        assert_eq!(text.parse::<Outline>().unwrap().to_string(), text);
    }
    let ring = vec![[0.004, 0.0], [10.0, 0.0], [10.0, 0.001], [5.255, -3.0], [0.0, 0.0]];
    assert_eq!(Outline::of_m(Some(7.5), &[ring]).to_string(), "750: 0,0 1000,0 526,-300");
    for text in ["", "0,0 1,0", "1: 2: 0,0 1,0 0,1", "0 1 2", "a,b c,d e,f", "0,0 1,0 0,1;", "0,0 1,0 0,99999999999"] {
        assert!(text.parse::<Outline>().is_err(), "{text}");
    }
}

#[test]
fn a_record_has_the_buildings_and_needs_no_file() {
    let town = load("traffic/town", &["duration_s=5"], 1);
    assert_eq!(town.settings.buildings.all().len(), 300);
    let resolved = town.resolved().unwrap();
    assert!(!resolved.contains("town.poly.xml"), "{resolved}");
    let of_record = Settings::of_record("r", &resolved, &[]).unwrap();
    assert_eq!(of_record.buildings, town.settings.buildings);
    assert_eq!(of_record.score_config().buildings, town.settings.buildings);
    let again = ScenarioTemplate::of_text("r", &resolved, &[]).and_then(|template| template.draw(1)).unwrap();
    assert_eq!(again.settings.buildings, town.settings.buildings);
    assert_eq!(again.resolved().unwrap(), resolved);
    // Altitudes are simulated.
    assert!(town.uavs.iter().all(|uav| uav.vertical.is_some_and(|vertical| vertical.altitude_m == 150.0)));
    // A scenario without buildings does not mention them.
    assert!(!load("traffic/convoy", &[], 1).resolved().unwrap().contains("world"));
    assert!(load("traffic/town", &["world.buildings="], 1).settings.buildings.is_empty());
}

#[test]
fn geojson_has_heights_storeys_and_courtyards() {
    let feature = |properties: &str, x_m: i32| {
        let ring = format!("[[{x_m},0],[{},0],[{x_m},20],[{x_m},0]]", x_m + 20);
        format!(
            "{{\"type\":\"Feature\",\"properties\":{{{properties}}},\"geometry\":{{\"type\":\"Polygon\",\"coordinates\":[{ring}]}}}}"
        )
    };
    let file = |features: &[String]| {
        let text = format!("{{\"type\":\"FeatureCollection\",\"features\":[{}]}}", features.join(","));
        of_file("b.geojson", &text, "building_height_m = 8").unwrap()
    };
    let scenario = file(&[
        feature("\"height_m\": 12.5, \"height\": 3", 0),
        feature("\"building\": \"yes\", \"height\": \"15 m\"", 30),
        feature("\"building\": \"house\", \"building:levels\": \"4\"", 60),
        feature("\"building\": \"yes\", \"height\": \"tall\"", 90),
        feature("\"building\": \"no\"", 120),
        feature("\"landuse\": \"grass\"", 150),
    ]);
    assert_eq!(heights_m(&scenario), [12.5, 15.0, 12.0, 8.0]);
    assert_eq!(
        scenario.warnings,
        [
            "world.buildings = \"b.geojson\": 1 of 4 buildings have no height: they are world.building_height_m high",
            "world.buildings = \"b.geojson\": ignores 2 of its shapes, which are not buildings"
        ]
    );
    // If no polygon is called a building, all are.
    assert_eq!(heights_m(&file(&[feature("", 0), feature("\"name\": \"a\"", 30)])), [8.0, 8.0]);
    let court = of_file("m.geojson", include_str!("../../../corpus/buildings/metres.geojson"), "").unwrap();
    let rings: Vec<usize> = court.settings.buildings.all().iter().map(|building| building.rings.len()).collect();
    assert_eq!((heights_m(&court), rings), (vec![10.0, 10.0], vec![2, 1]));
}

#[test]
fn sumo_polygons_are_in_the_metres_of_the_traffic() {
    let scenario =
        of_file("b.poly.xml", &SUMO.replace("9.001,44.25 9.0012,44.25 9.0012,44.2502", "50,0 60,0 60,9"), "").unwrap();
    assert_eq!(heights_m(&scenario), [7.5, 10.0]);
    let corners = scenario.settings.buildings.all()[0].rings[0].clone();
    assert_eq!(corners, [(0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (0.0, 10.0)].map(|(x, y)| Position::from_m(x, y)));
}

/// 44.25 degrees north: 111.1 km per degree north, 79.8 km per degree east.
#[test]
fn degrees_are_placed_at_the_traffic_in_degrees() {
    let scenario = over_degrees("b.geojson", include_str!("../../../corpus/buildings/osm.geojson")).unwrap();
    let building = &scenario.settings.buildings.all()[0];
    assert_eq!((building.height_m, scenario.settings.buildings.all().len()), (12.0, 1));
    let corner = building.rings[0][2];
    assert!((corner.x_m() - 95.8).abs() < 0.3 && (corner.y_m() - 22.2).abs() < 0.1, "{corner:?}");
    let geo = "<additional><poly type=\"building\" geo=\"1\" shape=\"9.001,44.25 9.0012,44.25 9.0012,44.2502\"/></additional>";
    let of_sumo = over_degrees("b.poly.xml", geo).unwrap();
    assert_eq!(of_sumo.settings.buildings.all()[0].rings[0][2], corner);
    assert!(over_degrees("b.poly.xml", SUMO).unwrap_err().contains("b.poly.xml:3:5: poly: its shape is in metres"));
    let far = "{\"type\":\"Polygon\",\"coordinates\":[[[0,0],[1,0],[0,1]]]}";
    assert!(over_degrees("b.geojson", far).unwrap_err().contains("is not near the traffic"));
}

#[test]
fn errors_have_the_file_and_the_line() {
    let error = |name: &str, text: &str| of_file(name, text, "").unwrap_err();
    for (name, text, expected) in [
        ("b.xml", "<net>\n</net>", "/b.xml:1:1: element = \"net\"; the root element must be additional"),
        ("b.xml", "<additional>\n<poly id=\"a\"/></additional>", "/b.xml:2:1: poly: shape is missing"),
        ("b.xml", "<additional>\n<poly shape=\"0,0 5 9,9\"/></additional>", "/b.xml:2:7: \"5\": must be x,y"),
        (
            "b.xml",
            "<additional>\n<poly shape=\"0,0 5,0\"/></additional>",
            "2:1: building 0: an outline has 2 different",
        ),
        ("b.xml", "<additional>\n<poly geo=\"1\" shape=\"9,44 9,45 8,4\"/></additional>", "2:1: poly: geo = 1"),
        ("b.xml", "<additional>\n<poly shape=\"0,0 1,0\"", "/b.xml:2:1: not well-formed XML"),
        ("b.xml", "<additional/>", "contains no polygon"),
        ("b.geojson", "{\n\"type\": ", "/b.geojson:2:"),
        ("b.geojson", "{\"type\":\"Topology\"}", "must be a type of GeoJSON"),
        (
            "b.geojson",
            "{\"type\":\"Polygon\",\"coordinates\":[[[11.3,44.5],[11.4,44.5],[11.3,44.6]]]}",
            "building 0 is smaller than 1 m; its coordinates are probably degrees",
        ),
        (
            "b.geojson",
            "{\"type\":\"Polygon\",\"coordinates\":[[[1e9,0],[2,0],[0,3]]]}",
            "building 0: coordinates must be at most 1e7 m",
        ),
        ("b.csv", "t,id\n", "is neither GeoJSON nor SUMO polygons"),
        ("b.csv", "", "is empty"),
    ] {
        let found = error(name, text);
        assert!(found.contains(expected), "{found}");
    }
    let missing = of_toml("[world]\nbuildings = \"none.geojson\"", Path::new("")).unwrap_err();
    assert!(missing.contains("none.geojson") && missing.contains("cannot be read"), "{missing}");
    let outline = of_toml("[world]\nbuilding_outlines_cm = [\"0,0 1,0\"]", Path::new("")).unwrap_err();
    assert!(
        outline.contains("world.building_outlines_cm.0 = \"0,0 1,0\": an outline has 2 different vertices"),
        "{outline}"
    );
    let height = of_toml("[world]\nbuilding_height_m = 0", Path::new("")).unwrap_err();
    assert!(height.contains("world.building_height_m = 0: must be above 0"), "{height}");
}

/// A wall east of the only UAV hides the target behind it from a low altitude, and not from a high one. The record and
/// the scores agree with the detections.
#[test]
fn a_target_behind_a_building_is_neither_detected_nor_in_view() {
    let fly = |altitude_m: u32| {
        let toml = format!(
            "duration_s = 2\n[world]\nbuilding_outlines_cm = [\"2000: -10000,-500 10000,-500 10000,500 -10000,500\"]\n\
             [groups]\naltitude_lowest_m = {altitude_m}\n[[uavs.start]]\ny_m = 400\n[[targets.start]]\ny_m = -20"
        );
        let template = ScenarioTemplate::of_toml("mine", &toml, &Overrides::default(), Path::new("")).unwrap();
        let scenario = template.draw(1).unwrap();
        let frames = frames(&scenario);
        let last = frames.last().unwrap().clone();
        let mut scorer = standoff_score::FrameScorer::new(scenario.settings.score_config());
        let in_view: Vec<_> = frames.iter().map(|frame| scorer.frame(frame).custody().in_view).collect();
        (last.detections.len(), *in_view.last().unwrap())
    };
    // The line is 15 m from the target where it enters the wall, 420 m from the UAV: 20 m high from 560 m altitude.
    assert_eq!(fly(300), (0, Some(0)));
    assert_eq!(fly(700), (1, Some(1)));
}

#[test]
fn missions_with_buildings_are_deterministic_and_buildings_hide() {
    let fly = |set: &[&str]| frames(&load("traffic/town", &[&["duration_s=60"], set].concat(), 3));
    let (first, second) = (fly(&[]), fly(&[]));
    assert!(first == second);
    let detections =
        |frames: &[standoff_record::Frame]| frames.iter().map(|frame| frame.detections.len()).sum::<usize>();
    let (with, without) = (detections(&first), detections(&fly(&["world.buildings="])));
    assert!(with < without * 9 / 10, "{with} of {without}");
    // From above, buildings hide less.
    assert!(detections(&fly(&["groups.altitude_lowest_m=900"])) > with);
}
