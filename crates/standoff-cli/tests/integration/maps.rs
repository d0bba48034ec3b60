//! Background maps: how they get into records and onto pages, and which maps are refused.

use std::fs;
use std::path::Path;

use crate::common::{names, standoff, text};

const NET: &str = concat!(
    "<net>\n<location netOffset=\"0,0\" convBoundary=\"0,0,1,1\" origBoundary=\"0,0,1,1\" projParameter=\"!\"/>\n",
    "<edge id=\"e\"><lane id=\"l\" index=\"0\" speed=\"9\" length=\"9\" shape=\"0,0 100,0\"/></edge>\n</net>\n"
);

#[track_caller]
fn done(folder: &Path, args: &[&str]) -> String {
    let output = standoff(folder, args);
    let messages = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {messages}");
    messages
}

fn folder() -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| fs::write(home.path().join(name), text).unwrap();
    fs::create_dir(home.path().join("secret")).unwrap();
    put("secret/town.net.xml", NET);
    put("cars.csv", "t,id,x,y\n0,a,0,0\n0,b,9,0\n20,a,90,0\n20,b,99,0\n");
    put("bare.toml", "[traffic]\nfile = \"cars.csv\"\n");
    put("named.toml", "basemap = [\"secret/town.net.xml\"]\n[traffic]\nfile = \"cars.csv\"\n");
    home
}

fn has_map(report: &Path) -> bool {
    fs::read_to_string(report).unwrap().contains("data-part=\"map\"")
}

#[test]
fn a_record_contains_the_map_of_its_scenario_but_not_its_path() {
    let home = folder();
    let at = |name: &str| home.path().join(name);
    done(home.path(), &["run", "named.toml", "--out", "named"]);
    assert!(at("named/map.json.gz").is_file() && has_map(&at("named/report.html")));
    for file in ["scenario.toml", "run.json", "summary.json", "report.html"] {
        assert!(!fs::read_to_string(at("named").join(file)).unwrap().contains("secret"), "{file} contains a path");
    }
    // `show` and a repeated run work as for any other record.
    fs::remove_file(at("named/report.html")).unwrap();
    done(home.path(), &["report", "named"]);
    assert!(has_map(&at("named/report.html")));
    done(home.path(), &["run", "named.toml", "--out", "named"]);
}

/// The flight does not depend on a map.
#[test]
fn a_map_changes_only_the_page() {
    let home = folder();
    let at = |name: &str| home.path().join(name);
    done(home.path(), &["run", "bare.toml", "--out", "bare"]);
    done(home.path(), &["run", "bare.toml", "--out", "with", "--map", "secret/town.net.xml"]);
    assert!(!at("bare/map.json.gz").exists() && !has_map(&at("bare/report.html")));
    assert!(at("with/map.json.gz").is_file() && has_map(&at("with/report.html")));
    for name in names(&at("bare")).iter().filter(|name| *name != "report.html") {
        assert!(fs::read(at("bare").join(name)).unwrap() == fs::read(at("with").join(name)).unwrap(), "{name}");
    }
    // `show --map` adds a map to an existing record.
    done(home.path(), &["report", "bare", "--map", "secret/town.net.xml"]);
    assert_eq!(fs::read(at("bare/map.json.gz")).unwrap(), fs::read(at("with/map.json.gz")).unwrap());
    assert!(has_map(&at("bare/report.html")));
}

#[test]
fn a_damaged_map_in_a_record_is_left_out_with_a_warning() {
    let home = folder();
    done(home.path(), &["run", "named.toml", "--out", "named"]);
    fs::write(home.path().join("named/map.json.gz"), "rubbish\u{1b}").unwrap();
    let printed = done(home.path(), &["report", "named"]);
    assert!(printed.contains("warning: map.json.gz is not a valid packed map"), "{printed}");
    assert!(!has_map(&home.path().join("named/report.html")));
}

#[test]
fn unusable_maps_are_refused_before_the_flight() {
    let home = folder();
    fs::write(home.path().join("degrees.csv"), "t,id,lat,lon\n0,a,44.5,11.3\n20,a,44.501,11.3\n").unwrap();
    fs::write(home.path().join("line.geojson"), "{\"type\": \"LineString\", \"coordinates\": [[9, 44], [10, 44]]}")
        .unwrap();
    let traffic = ["run", "--traffic", "cars.csv", "--out", "out"];
    let degrees = ["run", "--traffic", "degrees.csv", "--out", "out"];
    for (args, map, expected) in [
        (&traffic, "none.xml", "none.xml: cannot be read: No such file"),
        (&traffic, "secret", "secret: cannot be read: it is a folder, not a file"),
        (&traffic, "cars.csv", "cars.csv:1:1: is not a map: must be a SUMO net (.net.xml), SUMO polygons or GeoJSON"),
        (&traffic, "line.geojson", "line.geojson: its coordinates are in degrees, but the run is in metres"),
        (&degrees, "line.geojson", "line.geojson: no part of it is within 5 km of the run"),
        (&degrees, "secret/town.net.xml", "secret/town.net.xml:2:73: projParameter = \"!\": it has no projection"),
    ] {
        let output = standoff(home.path(), &[&args[..], &["--map", map]].concat());
        let printed = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{map}: {printed}");
        assert!(printed.contains(&format!("error: {expected}")) && !printed.contains("panicked"), "{map}: {printed}");
        assert!(!home.path().join("out").exists() && !home.path().join("out.partial").exists());
    }
    fs::write(home.path().join("bad.toml"), "basemap = [\"cars.csv\"]\n[traffic]\nfile = \"cars.csv\"\n").unwrap();
    assert_eq!(standoff(home.path(), &["check", "bad.toml"]).status.code(), Some(2));
}
