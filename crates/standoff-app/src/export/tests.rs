//! Tests of exports.

use standoff_sim::run::Mission;
use standoff_sim::scenario::{Overrides, Scenario};

use chrono::DateTime;

use super::reader::GAP_MIN_S;
use super::*;
use crate::fly::fly;

/// Exports 60 s of a built-in scenario about an origin.
fn exported(scenario: &str, set: &[&str], origin: Option<Origin>) -> Result<Export, Failure> {
    let begin = DateTime::parse_from_rfc3339("2026-07-01T10:00:00+02:00").unwrap().into();
    exported_from(scenario, set, origin, Some(begin))
}

fn exported_from(
    scenario: &str,
    set: &[&str],
    origin: Option<Origin>,
    begin: Option<DateTime<Utc>>,
) -> Result<Export, Failure> {
    let home = tempfile::tempdir().unwrap();
    let set = set.iter().map(|change| (*change).to_owned()).chain(["duration_s=60".to_owned()]).collect();
    let scenario = Scenario::load(scenario, &Overrides { set, ..Overrides::default() }, 1).unwrap();
    let out = home.path().join("run");
    let mut mission = Mission::new(&scenario).unwrap();
    let closed = fly(&scenario, &mut mission, &out, None, &|_| (), || true, |_| ()).ok().unwrap();
    Export::of(&Record::open(closed.dir()).unwrap(), &ExportOptions { origin, begin, interval_s: 10.0 })
}

const ORIGIN: Option<Origin> = Some(Origin { latitude_deg: -35.36, longitude_deg: 149.165 });

#[test]
fn paths_and_outlines_are_where_the_record_has_them() {
    let export = exported("tour/02-two-uavs", &[], ORIGIN).unwrap();
    let kinds = |kind: &str| export.outlines.iter().filter(|of| of.kind == kind).count();
    // One group, two UAVs (without a boresight at first) and three tracks every 10 s from 0 to 60 s.
    assert_eq!(export.paths.iter().filter(|path| path.kind == "uav").count(), 2);
    assert_eq!(export.paths.iter().filter(|path| path.kind == "track").count(), 3);
    assert_eq!([kinds("orbit"), kinds("field of view"), kinds("uncertainty")], [7, 12, 21]);
    assert!(export.outlines.iter().all(|of| of.ring.first() == of.ring.last() && of.end_s <= 60.0));
    assert!(export.gaps.is_empty(), "{:?}", export.gaps);
    let [longitude_deg, latitude_deg] = export.paths[0].fixes[0].at;
    assert!((latitude_deg + 35.36).abs() < 0.02 && (longitude_deg - 149.165).abs() < 0.02);
    assert_eq!(export.utc(60.0), "2026-07-01T08:01:00.000Z");
}

#[test]
fn targets_that_are_out_of_view_have_gaps() {
    let export = exported("tour/04-two-groups", &["uavs.count=1"], ORIGIN).unwrap();
    assert!(!export.gaps.is_empty());
    assert!(export.gaps.iter().all(|gap| gap.end_s - gap.begin_s >= GAP_MIN_S && gap.name.starts_with("target-")));
}

#[test]
fn a_run_in_metres_needs_an_origin_and_one_in_degrees_has_its_own() {
    let message = |result: Result<Export, Failure>| match result {
        Err(Failure::Input(message)) => message,
        other => panic!("{other:?}"),
    };
    assert!(message(exported("tour/02-two-uavs", &[], None)).contains("give --origin LATITUDE,LONGITUDE"));
    let outside = Some(Origin { latitude_deg: 91.0, longitude_deg: 0.0 });
    assert!(message(exported("tour/02-two-uavs", &[], outside)).contains("at most 90"));
}

#[test]
fn a_run_over_traffic_with_dates_has_its_own_time() {
    let home = tempfile::tempdir().unwrap();
    let (traffic, scenario) = (home.path().join("cars.csv"), home.path().join("cars.toml"));
    let row = |second: u32| format!("2026-03-01T12:{:02}:{:02}+01:00,car,{second},0\n", second / 60, second % 60);
    std::fs::write(&traffic, "time,id,x,y\n".to_owned() + &(0..70).map(row).collect::<String>()).unwrap();
    std::fs::write(&scenario, "[traffic]\nfile = \"cars.csv\"\n").unwrap();
    let scenario = scenario.to_str().unwrap();
    assert_eq!(exported_from(scenario, &[], ORIGIN, None).unwrap().utc(60.0), "2026-03-01T11:01:00.000Z");
    let refused = exported(scenario, &[], ORIGIN).unwrap_err();
    assert!(
        matches!(&refused, Failure::Input(what) if what.starts_with("--begin: the record has its own")),
        "{refused:?}"
    );
}

#[test]
fn lines_of_geojson_over_the_antimeridian_do_not_go_around_the_world() {
    let origin = Some(Origin { latitude_deg: -17.0, longitude_deg: 180.0 });
    let export = exported("tour/02-two-uavs", &[], origin).unwrap();
    let far = |at: &[[f64; 2]]| at.windows(2).any(|pair| (pair[0][0] - pair[1][0]).abs() > 180.0);
    assert!(export.outlines.iter().any(|of| far(&of.ring)), "nothing crosses it");
    let geojson: serde_json::Value = serde_json::from_str(&export.text(ExportFormat::GeoJson).unwrap()).unwrap();
    for feature in geojson["features"].as_array().unwrap() {
        let coordinates = &feature["geometry"]["coordinates"];
        let line = if coordinates[0][0].is_array() { &coordinates[0] } else { coordinates };
        let Some(line) = line.as_array().filter(|line| line[0].is_array()) else { continue };
        let line: Vec<_> = line.iter().map(|at| [at[0].as_f64().unwrap(), at[1].as_f64().unwrap()]).collect();
        assert!(!far(&line), "{}", feature["properties"]["kind"]);
    }
}

#[test]
fn texts_have_all_parts() {
    let export = exported("tour/02-two-uavs", &["sensor.detection_probability=0.05"], ORIGIN).unwrap();
    let of = |format| export.text(format).unwrap();
    let gaps = export.gaps.len();
    let kml = of(ExportFormat::Kml);
    assert_eq!(kml.matches("<Placemark>").count(), export.paths.len() + export.outlines.len() + gaps);
    let gpx = of(ExportFormat::Gpx);
    assert_eq!((gpx.matches("<trk>").count(), gpx.matches("<wpt ").count()), (export.paths.len(), gaps));
    let geojson: serde_json::Value = serde_json::from_str(&of(ExportFormat::GeoJson)).unwrap();
    assert_eq!(geojson["features"].as_array().unwrap().len(), export.paths.len() + export.outlines.len() + gaps);
    let czml: serde_json::Value = serde_json::from_str(&of(ExportFormat::Czml)).unwrap();
    assert_eq!(czml.as_array().unwrap().len(), 1 + export.paths.len() + export.outlines.len() + gaps);
}
