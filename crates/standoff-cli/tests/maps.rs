//! What lies under the vehicles: how it comes into a record and onto pages, and what is refused.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const NET: &str = concat!(
    "<net>\n<location netOffset=\"0,0\" convBoundary=\"0,0,1,1\" origBoundary=\"0,0,1,1\" projParameter=\"!\"/>\n",
    "<edge id=\"e\"><lane id=\"l\" index=\"0\" speed=\"9\" length=\"9\" shape=\"0,0 100,0\"/></edge>\n</net>\n"
);

fn standoff(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_standoff")).current_dir(folder).args(args).output().unwrap()
}

#[track_caller]
fn done(folder: &Path, args: &[&str]) -> String {
    let output = standoff(folder, args);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{args:?}: {told}");
    told
}

fn folder() -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| fs::write(home.path().join(name), text).unwrap();
    fs::create_dir(home.path().join("secret")).unwrap();
    put("secret/town.net.xml", NET);
    put("cars.csv", "t,id,x,y\n0,a,0,0\n0,b,9,0\n20,a,90,0\n20,b,99,0\n");
    put("bare.toml", "[traffic]\nfile = \"cars.csv\"\n");
    put("named.toml", "map = [\"secret/town.net.xml\"]\n[traffic]\nfile = \"cars.csv\"\n");
    home
}

fn has_map(report: &Path) -> bool {
    fs::read_to_string(report).unwrap().contains("data-part=\"map\"")
}

#[test]
fn a_run_keeps_the_map_that_its_scenario_names_and_no_path_of_it() {
    let home = folder();
    let at = |name: &str| home.path().join(name);
    done(home.path(), &["run", "named.toml", "--out", "named"]);
    assert!(at("named/map.json.gz").is_file() && has_map(&at("named/report.html")));
    for file in ["scenario.toml", "run.json", "summary.json", "report.html"] {
        assert!(!fs::read_to_string(at("named").join(file)).unwrap().contains("secret"), "{file} tells a path");
    }
    // The record is told again, and replaced, as any other.
    fs::remove_file(at("named/report.html")).unwrap();
    done(home.path(), &["show", "named"]);
    assert!(has_map(&at("named/report.html")));
    done(home.path(), &["run", "named.toml", "--out", "named"]);
}

/// Nothing that is flown depends on a map.
#[test]
fn a_map_changes_no_table() {
    let home = folder();
    let at = |name: &str| home.path().join(name);
    done(home.path(), &["run", "bare.toml", "--out", "bare"]);
    done(home.path(), &["run", "bare.toml", "--out", "with", "--map", "secret/town.net.xml"]);
    assert!(!at("bare/map.json.gz").exists() && !has_map(&at("bare/report.html")));
    assert!(at("with/map.json.gz").is_file() && has_map(&at("with/report.html")));
    for entry in fs::read_dir(at("bare")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name != "report.html" {
            assert!(fs::read(at("bare").join(&name)).unwrap() == fs::read(at("with").join(&name)).unwrap(), "{name}");
        }
    }
    // An older record gets one.
    done(home.path(), &["show", "bare", "--map", "secret/town.net.xml"]);
    assert_eq!(fs::read(at("bare/map.json.gz")).unwrap(), fs::read(at("with/map.json.gz")).unwrap());
    assert!(has_map(&at("bare/report.html")));
}

#[test]
fn a_damaged_map_of_a_record_costs_the_map_and_nothing_else() {
    let home = folder();
    done(home.path(), &["run", "named.toml", "--out", "named"]);
    fs::write(home.path().join("named/map.json.gz"), "rubbish\u{1b}").unwrap();
    let told = done(home.path(), &["show", "named"]);
    assert!(told.contains("warning: map.json.gz is no map as it was packed"), "{told}");
    assert!(!has_map(&home.path().join("named/report.html")));
}

#[test]
fn maps_that_cannot_be_used_are_refused_before_anything_is_flown() {
    let home = folder();
    fs::write(home.path().join("degrees.csv"), "t,id,lat,lon\n0,a,44.5,11.3\n20,a,44.501,11.3\n").unwrap();
    fs::write(home.path().join("line.geojson"), "{\"type\": \"LineString\", \"coordinates\": [[9, 44], [10, 44]]}")
        .unwrap();
    let traffic = ["run", "--traffic", "cars.csv", "--out", "out"];
    let degrees = ["run", "--traffic", "degrees.csv", "--out", "out"];
    for (args, map, expected) in [
        (&traffic, "none.xml", "none.xml: cannot be read: No such file"),
        (&traffic, "secret", "secret: cannot be read: it is a folder, not a file"),
        (&traffic, "cars.csv", "cars.csv:1:1: is no map: must be a SUMO net (.net.xml), SUMO polygons or GeoJSON"),
        (&traffic, "line.geojson", "line.geojson: its coordinates are degrees, and the run is in metres"),
        (&degrees, "line.geojson", "line.geojson: nothing of it is within 5 km of the run"),
        (&degrees, "secret/town.net.xml", "secret/town.net.xml:2:73: projParameter = \"!\": it has no projection"),
    ] {
        let output = standoff(home.path(), &[&args[..], &["--map", map]].concat());
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{map}: {told}");
        assert!(told.contains(&format!("error: {expected}")) && !told.contains("panicked"), "{map}: {told}");
        assert!(!home.path().join("out").exists() && !home.path().join("out.partial").exists());
    }
    fs::write(home.path().join("bad.toml"), "map = [\"cars.csv\"]\n[traffic]\nfile = \"cars.csv\"\n").unwrap();
    assert_eq!(standoff(home.path(), &["check", "bad.toml"]).status.code(), Some(2));
}
