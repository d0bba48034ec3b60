//! End-to-end tests of sweeps: points, table, files, and resumption.

use std::fs;
use std::path::Path;

use crate::common::{names, standoff, text};
use serde_json::Value;

const SHORT: [&str; 6] = ["sweep", "paper/table-2-pair", "--set", "duration_s=20", "--set", "transient_s=5"];

/// Checks that a short sweep succeeds, and returns its output.
fn printed(folder: &Path, args: &[&str]) -> String {
    let output = standoff(folder, &[&SHORT[..], args].concat());
    assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Checks that a short sweep is refused with this message.
fn refused(folder: &Path, args: &[&str], message: &str) {
    let output = standoff(folder, &[&SHORT[..], args].concat());
    assert_eq!(output.status.code(), Some(2), "{args:?}");
    assert!(text(&output.stderr).contains(message), "{args:?}: {}", text(&output.stderr));
}

#[test]
fn each_point_of_a_grid_is_the_batch_with_its_values() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--vary", "sensor.range_sd_m=5,20", "--vary", "uavs.count=2..3:2", "--runs", "3", "--seed", "4"];
    let json = printed(folder.path(), &[&args[..], &["--json", "--metrics", "table-2"]].concat());
    let sweep: Value = serde_json::from_str(&json).unwrap();
    let values: Vec<_> = sweep["points"].as_array().unwrap().iter().map(|point| point["values"].to_string()).collect();
    let point = |sd, count| format!("{{\"sensor.range_sd_m\":{sd},\"uavs.count\":{count}}}");
    assert_eq!(values, [point(5, 2), point(5, 3), point(20, 2), point(20, 3)]);
    // The random draws of all points are those of the same seeds.
    let batch = ["monte-carlo", "paper/table-2-pair", "--runs", "3", "--seed", "4", "--json", "--metrics", "table-2"];
    let set = ["--set", "sensor.range_sd_m=20", "--set", "uavs.count=2", "--set", "duration_s=20"];
    let args = [&batch[..], &set, &["--set", "transient_s=5"]].concat();
    let alone: Value = serde_json::from_slice(&standoff(folder.path(), &args).stdout).unwrap();
    assert_eq!(sweep["points"][2]["metrics"], alone["metrics"]);
}

#[test]
fn a_sweep_prints_the_mean_and_interval_of_each_point_and_writes_a_table_and_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--vary", "sensor.range_sd_m=5,20", "--runs", "3", "--out", "o"];
    let table = printed(folder.path(), &args);
    assert!(table.starts_with("paper/table-2-pair, 2 points with 3 runs each, seeds 1 to 3\n"), "{table}");
    assert!(table.contains("\ndifferences from sensor.range_sd_m=5, paired by seed\n"), "{table}");
    assert!(table.contains("\nposition error, m\n  sensor.range_sd_m      n      mean  95 % interval"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() < 100), "{table}");
    let compared = standoff(folder.path(), &["compare", "o/points/0", "o/points/1", "--json"]);
    let compared: Value = serde_json::from_slice(&compared.stdout).unwrap();
    let difference = compared["metrics"]["position_error_m"]["difference"].as_f64().unwrap();
    assert!(table.contains(&format!("   {difference:.3}  ")), "{difference}: {table}");
    assert!(table.ends_with("results in o\nnext:\n  open o/report.html\n"), "{table}");
    let out = folder.path().join("o");
    assert_eq!(names(&out), ["points", "report.html", "sweep.json", "sweep.parquet"]);
    assert_eq!(names(&out.join("points")), ["0", "1"]);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("data-part=\"sweep\"") && page.contains("data-part=\"charts\""));
    let bytes = fs::read(out.join("sweep.parquet")).unwrap();
    let again = standoff(folder.path(), &[&SHORT[..], &args].concat());
    assert_eq!(
        (text(&again.stdout), text(&again.stderr)),
        (table, "note: o is already complete; no runs are flown\n".into())
    );
    // A lost point is flown again, the others are kept.
    fs::remove_dir_all(out.join("points/1")).unwrap();
    fs::remove_file(out.join("sweep.parquet")).unwrap();
    let resumed = standoff(folder.path(), &[&SHORT[..], &args, &["--threads", "1"]].concat());
    assert_eq!(text(&resumed.stderr), "note: resuming after 3 of 6 runs\n");
    assert_eq!(fs::read(out.join("sweep.parquet")).unwrap(), bytes);
}

#[test]
fn a_latin_hypercube_depends_on_its_seed_only() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--vary", "sensor.range_sd_m=5..20", "--vary", "uavs.count=2..4", "--points", "3", "--runs", "1"];
    let points = |more: &[&str]| {
        let json = printed(folder.path(), &[&args[..], &["--json", "--metrics", "anees"], more].concat());
        let sweep: Value = serde_json::from_str(&json).unwrap();
        let points = sweep["points"].as_array().unwrap().clone();
        points.into_iter().map(|point| point["values"].clone()).collect::<Vec<_>>()
    };
    let first = points(&[]);
    assert_eq!(points(&["--seed", "5"]), first);
    assert_ne!(points(&["--points-seed", "2"]), first);
    let mut counts: Vec<_> = first.iter().map(|values| values["uavs.count"].as_i64().unwrap()).collect();
    counts.sort_unstable();
    assert_eq!(counts, [2, 3, 4], "a key of whole numbers takes whole numbers");
    for values in &first {
        assert!((5.0..=20.0).contains(&values["sensor.range_sd_m"].as_f64().unwrap()), "{values}");
    }
}

#[test]
fn wrong_sweeps_are_refused_before_the_first_run() {
    let folder = tempfile::tempdir().unwrap();
    for (args, message) in [
        (&["--runs", "2"][..], "--vary"),
        (&["--vary", "sensor.range_sd_m", "--runs", "2"], "write KEY=A,B,C"),
        (&["--vary", "sensor.range_sd_m=5..20", "--runs", "2"], "--points N"),
        (&["--vary", "sensor.range_sd_n=5,6", "--runs", "2"], "did you mean `range_sd_m`?"),
        (&["--vary", "sensor.range_sd_m=5,-6", "--runs", "2"], "sensor.range_sd_m = -6"),
        (
            &["--vary", "uavs.count=2,3", "--vary", "uavs.count=4", "--runs", "2"],
            "uavs.count: this key is varied twice",
        ),
        (&["--vary", "uavs.count=2,3", "--points-seed", "4", "--runs", "2"], "--points"),
        (&["--vary", "uavs.count=2,3", "--points", "1", "--runs", "2"], "1 points: must be from 2 to 10000"),
        (&["--vary", "uavs.count=2,3", "--runs", "0"], "the number of runs is 0"),
    ] {
        refused(folder.path(), args, message);
    }
    fs::create_dir(folder.path().join("o")).unwrap();
    fs::write(folder.path().join("o/letter.txt"), "mine").unwrap();
    refused(
        folder.path(),
        &["--vary", "uavs.count=2,3", "--runs", "1", "--out", "o"],
        "o contains letter.txt, but no sweep",
    );
    assert_eq!(names(folder.path()), ["o"]);
    printed(folder.path(), &["--vary", "uavs.count=2,3", "--runs", "1", "--out", "p"]);
    let other = ["--vary", "uavs.count=2,4", "--runs", "1", "--out", "p"];
    refused(folder.path(), &other, "p contains a different sweep: point 1 is uavs.count=3, not uavs.count=4");
    let other = ["--vary", "uavs.count=2,3", "--set", "sensor.range_sd_m=9", "--runs", "1", "--out", "p"];
    refused(folder.path(), &other, "range_sd_m");
}
