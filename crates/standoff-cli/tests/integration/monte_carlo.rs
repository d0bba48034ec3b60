//! End-to-end tests of batches: output, files, and that no completed run is lost however the process ends.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::common::{command, is_same, names, send_signal, standoff, text};
use serde_json::Value;

/// Checks that a command succeeds, and returns its output.
fn printed(folder: &Path, args: &[&str]) -> String {
    let output = standoff(folder, args);
    assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

fn check_same(a: &Path, b: &Path) {
    assert_eq!(names(a), ["monte-carlo.json", "report.html", "runs.parquet", "summary.json"]);
    assert!(is_same(a, b));
}

#[test]
fn json_output_equals_the_summary_and_has_every_statistic() {
    let folder = tempfile::tempdir().unwrap();
    let args =
        ["monte-carlo", "--runs", "4", "--seed", "3", "--metrics", "table-2", "--json", "--set", "duration_s=40"];
    let json = printed(folder.path(), &args);
    let out = folder.path().join("standoff-out/paper/table-2-pair-seeds-3-to-6+duration_s=40");
    assert_eq!(json, fs::read_to_string(out.join("summary.json")).unwrap());
    let summary: Value = serde_json::from_str(&json).unwrap();
    let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(keys(&summary), ["scenario", "seed", "runs", "metrics"]);
    assert_eq!(summary["metrics"].as_object().unwrap().len(), 6);
    let phase = &summary["metrics"]["phase_error_deg"];
    assert_eq!(keys(phase), ["n", "mean", "ci95", "sd", "p5", "p50", "p95", "max"]);
    // Run k equals a `standoff run` with the first seed plus k.
    let alone = |seed: &str| {
        let args = ["run", "paper/table-2-pair", "--set", "duration_s=40", "--json", "--seed", seed];
        let run: Value = serde_json::from_str(&printed(folder.path(), &args)).unwrap();
        run["metrics"]["phase_error_deg"].as_f64().unwrap()
    };
    let runs = ["3", "4", "5", "6"].map(alone);
    // serde_json parses a number exactly except for its last digit.
    let check = |got: &Value, expected: f64| assert!((got.as_f64().unwrap() / expected - 1.0).abs() < 1e-14);
    let mean = runs.iter().sum::<f64>() / 4.0;
    check(&phase["mean"], mean);
    check(&phase["max"], runs.into_iter().fold(0.0, f64::max));
    let [lo, hi] = [0, 1].map(|end| phase["ci95"][end].as_f64().unwrap());
    assert!(lo < mean && mean < hi);

    let one = printed(folder.path(), &["monte-carlo", "tour/01-one-uav", "--runs", "1", "--json"]);
    let one: Value = serde_json::from_str(&one).unwrap();
    assert_eq!(one["metrics"]["phase_error_deg"]["n"], 0);
    assert!(one["metrics"]["phase_error_deg"]["mean"].is_null() && one["metrics"]["anees"]["ci95"].is_null());
}

#[test]
fn a_repeated_command_prints_the_table_of_a_complete_batch_again() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["monte-carlo", "tour/02-two-uavs", "--runs", "3", "--out", "o", "--threads", "2"];
    let table = printed(folder.path(), &args);
    assert!(table.starts_with("tour/02-two-uavs, 3 runs, seeds 1 to 3\n"), "{table}");
    assert!(table.contains("95 % of the mean") && table.contains("\n  position error "), "{table}");
    assert!(table.ends_with("\nresults in o\nnext:\n  open o/report.html  (plots, and every run)\n  standoff compare o OTHER  (with another batch)\n"), "{table}");
    let again = standoff(folder.path(), &args);
    assert_eq!((text(&again.stdout), again.status.code()), (table, Some(0)));
    assert_eq!(text(&again.stderr), "note: o is already complete; no runs are flown\n");
}

#[test]
fn merged_shards_equal_the_whole_batch_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let fly =
        |more: &[&str]| printed(folder.path(), &[&["monte-carlo", "tour/02-two-uavs", "--runs", "5"], more].concat());
    fly(&["--out", "whole"]);
    assert!(
        fly(&["--shard", "1/2", "--out", "b"])
            .starts_with("tour/02-two-uavs, 3 runs, seeds 3 to 5, shard 1/2 of 5 runs")
    );
    let lone = standoff(folder.path(), &["merge", "b", "--out", "merged"]);
    assert_eq!(
        (text(&lone.stderr), lone.status.code()),
        ("error: cannot merge: missing: shard 0/2\n".to_owned(), Some(2))
    );
    fly(&["--shard", "0/2", "--out", "a"]);
    let json = printed(folder.path(), &["merge", "b", "a", "--out", "merged", "--json"]);
    assert_eq!(json, fs::read_to_string(folder.path().join("whole/summary.json")).unwrap());
    check_same(&folder.path().join("whole"), &folder.path().join("merged"));
}

#[test]
fn a_comparison_shows_the_effect_of_a_change() {
    let folder = tempfile::tempdir().unwrap();
    let run =
        |more: &[&str]| printed(folder.path(), &[&["compare", "paper/table-2-pair", "--runs", "8"], more].concat());
    let noisy = ["--set", "duration_s=40", "--set-b", "sensor.range_sd_m=30", "--metrics", "position_error_m,anees"];
    let table = run(&noisy);
    let line = table.lines().find(|line| line.starts_with("  position error ")).unwrap();
    assert!(line.ends_with("  A better"), "{table}");
    assert!(table.contains("B: paper/table-2-pair sensor.range_sd_m=30\n"), "{table}");
    let json: Value = serde_json::from_str(&run(&[&noisy[..], &["--json"]].concat())).unwrap();
    let position = &json["metrics"]["position_error_m"];
    let difference = position["mean_b"].as_f64().unwrap() - position["mean_a"].as_f64().unwrap();
    assert!((position["difference"].as_f64().unwrap() - difference).abs() < 1e-12);
    assert_eq!((&position["differs"], &position["better"]), (&true.into(), &"a".into()));
    assert!(fs::read_dir(folder.path()).unwrap().next().is_none(), "a comparison left files behind");

    for lead in ["0", "3"] {
        let set = format!("guidance.lead_s={lead}");
        let args = ["monte-carlo", "--runs", "8", "--set", "duration_s=40", "--set", &set, "--out", lead];
        printed(folder.path(), &args);
    }
    let of_folders = printed(folder.path(), &["compare", "0", "3", "--report", "page.html"]);
    assert!(fs::read_to_string(folder.path().join("page.html")).unwrap().contains("data-part=\"batch\""));
    let flown = run(&["--set", "duration_s=40", "--set", "guidance.lead_s=0", "--set-b", "guidance.lead_s=3"]);
    // Without names and next commands.
    let rows =
        |table: &str| table.lines().skip(4).take_while(|line| *line != "next:").map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(rows(&of_folders), rows(&flown));
}

#[test]
fn wrong_input_is_refused_with_one_clear_message() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("mine")).unwrap();
    fs::write(folder.path().join("mine/thesis.tex"), "x").unwrap();
    let refused = |args: &[&str], expected: &[&str]| {
        let output = standoff(folder.path(), args);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(output.stdout.is_empty(), "{args:?}");
        for expected in expected {
            assert!(message.contains(expected), "{args:?}: {message}");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "{args:?} left something behind");
    };
    refused(&["monte-carlo"], &["--runs"]);
    refused(&["monte-carlo", "--runs", "0"], &["the number of runs is 0; must be at least 1"]);
    refused(&["monte-carlo", "--runs", "-1"], &["--runs"]);
    refused(&["monte-carlo", "--runs", "2", "--threads", "0"], &["--threads"]);
    refused(&["monte-carlo", "--runs", "2", "--seed", "18446744073709551615"], &["the last seed must be at most"]);
    for shard in ["2/2", "0/0", "-1/2", "1"] {
        refused(&["monte-carlo", "--runs", "9", &format!("--shard={shard}")], &["must be I/N", "I from 0 to N - 1"]);
    }
    refused(&["monte-carlo", "--runs", "2", "--shard", "0/3"], &["at least one run for each of N shards"]);
    refused(&["monte-carlo", "--runs", "2", "--metrics", "speed"], &["--metrics", "\"speed\": no such metric"]);
    refused(&["monte-carlo", "--runs", "2", "--metrics", ","], &["--metrics", "must name at least one metric"]);
    refused(&["monte-carlo", "paper/table-9", "--runs", "2"], &["no such scenario"]);
    refused(&["monte-carlo", "--runs", "2", "--set", "uavs.count=0"], &["uavs.count = 0", "| --set uavs.count=0"]);
    refused(&["monte-carlo", "--runs", "2", "--out", "mine"], &["mine contains something other than a run"]);
    refused(&["merge", "--out", "o"], &["DIR"]);
    refused(&["merge", "mine", "--out", "o"], &["mine: contains no results of standoff monte-carlo"]);
    refused(&["compare", "paper/table-2-pair"], &["nothing to compare", "--set-b"]);
    refused(
        &["compare", "paper/table-2-pair", "--set-b", "guidance.lead_s=0", "--report", "x"],
        &["--report", "folders"],
    );
    refused(&["compare", "mine", "mine"], &["mine: contains no results"]);
    for option in ["--set=a=1", "--set-b=a=1", "--uavs=2", "--runs=9", "--seed=2", "--threads=1", "--metrics=nis"] {
        refused(&["compare", "mine", "mine", option], &["their runs have already been flown"]);
    }
    refused(&["compare", "paper/table-2-pair", "--set-b", "guidance.nonsense=1"], &["guidance.nonsense"]);
    refused(&["compare", "paper/table-2-pair", "paper/table-2-single", "--runs", "0"], &["number of runs is 0"]);
}

/// A small pseudo-random number generator; its quality does not matter. Returns numbers from 0 to 1.
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as f64 / (1u64 << 31) as f64
}

/// A batch of many short runs is mostly killed during a flight; a batch of few runs, while its files are created or
/// completed.
#[test]
fn a_batch_killed_at_any_time_has_the_same_results_when_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let mut state = 1;
    for (runs, kills_min, pieces) in [("200", 25, 10.0), ("2", 25, 1.0)] {
        let fly = ["monte-carlo", "--runs", runs, "--metrics", "table-2", "--set", "duration_s=40", "--out"];
        let whole = format!("whole-{runs}");
        let began = Instant::now();
        printed(folder.path(), &[&fly[..], &[&whole]].concat());
        let longest = began.elapsed().div_f64(pieces);
        let mut kills = 0;
        for batch in 0.. {
            let out = format!("killed-{runs}-{batch}");
            // Each attempt runs longer, so that the last steps, which are repeated in every attempt, are completed.
            for attempt in 1.. {
                let mut child = command(folder.path(), &[&fly[..], &[&out]].concat())
                    .stdout(Stdio::null())
                    .stderr(Stdio::piped())
                    .spawn()
                    .unwrap();
                thread::sleep(longest.mul_f64(random(&mut state) * (1.0 + 0.2 * f64::from(attempt))));
                let ended = child.try_wait().unwrap().is_some();
                child.kill().unwrap();
                let output = child.wait_with_output().unwrap();
                if ended {
                    assert!(output.status.success(), "{}", text(&output.stderr));
                    break;
                }
                kills += 1;
            }
            check_same(&folder.path().join(&whole), &folder.path().join(&out));
            if kills >= kills_min {
                break;
            }
        }
    }
}

#[test]
#[cfg(unix)]
fn an_interrupted_batch_ends_soon_and_can_be_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let args = |out| ["monte-carlo", "--runs", "2000", "--metrics", "table-2", "--set", "duration_s=20", "--out", out];
    for (signal, out) in [("INT", "i"), ("TERM", "t")] {
        let child = command(folder.path(), &args(out)).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let journal = folder.path().join(out).join("monte-carlo.journal");
        while fs::metadata(&journal).map_or(0, |file| file.len()) < 4_000 {
            thread::sleep(Duration::from_millis(1));
        }
        let signalled = Instant::now();
        send_signal(signal, child.id());
        let output = child.wait_with_output().unwrap();
        assert!(signalled.elapsed() < Duration::from_secs(2), "{:?}", signalled.elapsed());
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(output.stdout.is_empty());
        assert!(
            message.starts_with("error: interrupted; ") && message.contains(" of 2000 runs are saved in "),
            "{message}"
        );
        assert!(message.ends_with("repeat the command to resume\n"), "{message}");
        let resumed = standoff(folder.path(), &args(out));
        assert!(resumed.status.success() && text(&resumed.stderr).starts_with("note: resuming after "));
    }
    check_same(&folder.path().join("i"), &folder.path().join("t"));
}

/// If the page cannot be written, the results are complete, and repeating the command writes the page.
#[test]
#[cfg(target_os = "linux")]
fn a_page_that_does_not_fit_can_be_written_later() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["monte-carlo", "--runs", "3", "--metrics", "table-2", "--set", "duration_s=20", "--out", "o"];
    let script = "trap '' XFSZ; ulimit -f 1000; exec \"$0\" \"$@\"";
    let mut limited = Command::new("sh");
    limited.args(["-c", script, env!("CARGO_BIN_EXE_standoff")]).args(args).current_dir(folder.path());
    let output = limited.output().unwrap();
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("cannot write o/report.html: File too large"), "{message}");
    let again = standoff(folder.path(), &args);
    assert_eq!(text(&again.stderr), "note: o is already complete; no runs are flown\n");
    printed(folder.path(), &[&args[..8], &["whole"]].concat());
    check_same(&folder.path().join("whole"), &folder.path().join("o"));
}

/// A file-size limit simulates a full disk, because it needs no root privileges.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_loses_no_completed_run() {
    let folder = tempfile::tempdir().unwrap();
    let args = |out| ["monte-carlo", "--runs", "60", "--metrics", "table-2", "--set", "duration_s=20", "--out", out];
    printed(folder.path(), &args("whole"));
    let limited = |blocks: u32| {
        // Blocks have 512 bytes. With the signal ignored, a write beyond the limit fails as on a full disk.
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
        let mut command = Command::new("sh");
        command.args(["-c", &script, env!("CARGO_BIN_EXE_standoff")]).args(args("full"));
        command.current_dir(folder.path()).output().unwrap()
    };
    for blocks in [1, 6, 8] {
        let output = limited(blocks);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{blocks} blocks: {message}");
        assert!(message.contains("cannot write full/monte-carlo.journal: File too large"), "{message}");
    }
    let resumed = standoff(folder.path(), &args("full"));
    let note = text(&resumed.stderr);
    let kept: usize = note.strip_prefix("note: resuming after ").unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(kept > 10, "{note}");
    check_same(&folder.path().join("whole"), &folder.path().join("full"));
}
