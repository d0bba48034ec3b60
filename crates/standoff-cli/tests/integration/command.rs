//! End-to-end tests of the command: its output, the files it writes, and its errors.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{names, standoff, text};
use serde_json::Value;
use standoff_score::MetricInfo;

/// Runs the command and checks for exit status 2, one message that contains all of `expected`, and no new files.
fn check_refused(args: &[&str], expected: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("bad.toml"), "[uavs]\ncount = 0\n[[targets.start]]\n").unwrap();
    fs::write(folder.path().join("bad.xml"), "<fcd-export>\n<timestep time=\"0\"><vehicle id=\"a\" x=\"0\"").unwrap();
    fs::create_dir(folder.path().join("mine")).unwrap();
    fs::write(folder.path().join("mine/thesis.tex"), "x").unwrap();
    let before = names(folder.path());
    let output = standoff(folder.path(), args);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert!(output.stdout.is_empty(), "{args:?}: {}", text(&output.stdout));
    for expected in expected {
        assert!(message.contains(expected), "{args:?}: {message}");
    }
    assert!(!message.contains("panicked"), "{args:?}: {message}");
    assert_eq!(names(folder.path()), before, "{args:?} left something behind");
    assert_eq!(fs::read_to_string(folder.path().join("mine/thesis.tex")).unwrap(), "x");
}

#[test]
fn without_arguments_it_flies_figure_9_compares_the_papers_law_and_prints_the_results_folder() {
    let folder = tempfile::tempdir().unwrap();
    let output = standoff(folder.path(), &[]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    assert!(table.contains("improved/figure-9, seed 1: 4 UAVs, 7 targets"), "{table}");
    assert!(table.contains("this run  paper's law*"), "{table}");
    assert!(table.contains("results in standoff-out/improved/figure-9-1"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
    assert!(table.ends_with("(serves the replay with every time step)\n"), "{table}");
    assert_eq!(text(&output.stderr), "", "no progress bar in a pipe");
    let results = folder.path().join("standoff-out/improved/figure-9-1");
    assert_eq!(
        names(&results),
        [
            "alarms.csv",
            "detections.parquet",
            "events.parquet",
            "gaps.csv",
            "groups.parquet",
            "in_view.parquet",
            "margin.svg",
            "off_boresight.svg",
            "phase.svg",
            "report.html",
            "run.json",
            "scenario.toml",
            "separation.svg",
            "speed_and_turn_rate.svg",
            "standoff_distance.svg",
            "summary.json",
            "targets.parquet",
            "tracks.parquet",
            "trajectories.svg",
            "truth.parquet",
            "uavs.parquet"
        ]
    );
    // No file contains the path of the folder.
    for name in names(&results) {
        let bytes = fs::read(results.join(&name)).unwrap();
        let here = folder.path().to_str().unwrap().as_bytes().to_vec();
        assert!(!bytes.windows(here.len()).any(|window| window == here), "{name} names a path");
    }
}

/// If each UAV has its own team state, a figure shows how well they agree. docs/user/radio.md includes this figure;
/// `scripts/take_pictures` updates it.
#[test]
fn a_run_with_per_uav_team_states_writes_the_agreement_figure_of_the_docs() {
    let folder = tempfile::tempdir().unwrap();
    assert!(standoff(folder.path(), &["run", "tour/08-network-partition", "--out", "o"]).status.success());
    let shown = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/pictures/agreement.svg");
    assert!(fs::read(folder.path().join("o/agreement.svg")).unwrap() == fs::read(shown).unwrap());
}

#[test]
fn json_output_is_one_object_and_equals_the_summary_file() {
    let folder = tempfile::tempdir().unwrap();
    let output = standoff(folder.path(), &["run", "paper/table-2-pair", "--seed", "3", "--json", "--out", "o"]);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let saved: Value = serde_json::from_slice(&fs::read(folder.path().join("o/summary.json")).unwrap()).unwrap();
    assert_eq!(printed, saved);
    let keys: Vec<_> = printed.as_object().unwrap().keys().cloned().collect();
    assert_eq!(
        keys,
        ["scenario", "seed", "duration_s", "uavs", "targets", "targets_mean", "metrics", "events", "per_target"]
    );
    assert_eq!((&printed["uavs"], &printed["targets"], &printed["seed"]), (&2.into(), &4.into(), &3.into()));
    assert!(printed["metrics"]["phase_error_deg"].as_f64().unwrap() < 5.0);
    let event = &printed["events"][0];
    assert_eq!((&event["kind"], &event["target"]), (&"cued".into(), &"target-0".into()));
    assert!(event["time_s"].is_number() && event["reason"].is_string());
}

/// Metrics that were not requested are absent from the JSON and from the table.
#[test]
fn metrics_are_chosen_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let metrics = |args: &[&str]| -> Vec<String> {
        let printed: Value = serde_json::from_slice(&standoff(folder.path(), args).stdout).unwrap();
        printed["metrics"].as_object().unwrap().keys().cloned().collect()
    };
    let run = ["run", "tour/02-two-uavs", "--out", "o", "--json", "--metrics"];
    assert_eq!(metrics(&[&run[..], &["handoffs,nis"]].concat()), ["nis", "handoffs"]);
    assert_eq!(metrics(&["report", "o", "--json", "--metrics", "velocity_crlb_ratio"]).len(), 3);
    let standard = metrics(&["report", "o", "--json"]);
    assert!(standard.contains(&"anees".to_owned()) && !standard.contains(&"nis".to_owned()), "{standard:?}");
    let table = text(&standoff(folder.path(), &["report", "o", "--metrics", "nis"]).stdout);
    assert!(table.lines().any(|line| line.starts_with("  NIS ") && line.ends_with("goal 1")), "{table}");
    assert!(!table.contains("velocity error"), "{table}");
}

/// docs/user/metrics.md defines exactly the metrics that are printed.
#[test]
fn every_metric_is_defined() {
    let folder = tempfile::tempdir().unwrap();
    let output = standoff(folder.path(), &["run", "tour/01-one-uav", "--metrics", "all", "--json"]);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let printed: Vec<_> = printed["metrics"].as_object().unwrap().keys().cloned().collect();
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/user/metrics.md")).unwrap();
    let rows: Vec<Vec<&str>> = page
        .lines()
        .filter(|line| line.starts_with("| `") && line.matches(" | ").count() == 4)
        .map(|line| line.trim_matches(['|', ' ']).split(" | ").collect())
        .collect();
    let names: Vec<_> = rows.iter().map(|row| row[0].trim_matches('`').to_owned()).collect();
    assert_eq!(printed, names);
    for (row, info) in rows.iter().zip(MetricInfo::all()) {
        let (unit, factor) = MetricInfo::unit(info.name);
        let size = format!("{} {unit}", (factor * info.interest * 1e6).round() / 1e6);
        let worse = info.worse.map_or_else(|| "-".to_owned(), |worse| format!("{worse:?}").to_lowercase());
        assert_eq!([row[1], row[3], row[4]], [info.label, &*worse, size.trim_end()], "{}", info.name);
    }
}

/// A remark explains the behaviour, which could be mistaken for a failure, and how to avoid it.
#[test]
fn a_remark_explains_the_orbit_jumps_of_the_papers_mission() {
    let folder = tempfile::tempdir().unwrap();
    let table = text(&standoff(folder.path(), &["run", "paper/figure-9"]).stdout);
    let remark = "      r_d jumps because margin (16) is not a length (an erratum); use --set\n      orbit.margin=standard-deviations\n";
    assert!(table.contains(remark), "{table}");
    assert!(!table.contains("paper's law*"), "{table}");
    let args = ["run", "paper/figure-9", "--set", "orbit.margin=standard-deviations", "--out", "o"];
    let table = text(&standoff(folder.path(), &args).stdout);
    assert!(!table.contains("r_d jumps"), "{table}");
}

/// `report` lists the targets, and explains the consistency of manoeuvring and other targets.
#[test]
fn report_lists_each_target() {
    let folder = tempfile::tempdir().unwrap();
    standoff(folder.path(), &["run", "improved/figure-9", "--out", "o"]);
    let output = text(&standoff(folder.path(), &["report", "o"]).stdout);
    let rows: Vec<&str> = output.lines().filter(|line| line.starts_with("target-")).collect();
    assert_eq!(rows.len(), 7, "{output}");
    assert!(rows[0].ends_with("manoeuvres") && !rows[1].ends_with("manoeuvres"), "{output}");
    assert!(
        output.contains(" without manoeuvring targets, below 1") && output.contains(" of manoeuvring targets: "),
        "{output}"
    );
}

/// If a large fraction of target time is ungrouped, the table explains it, before the metrics of groups.
#[test]
fn a_large_ungrouped_fraction_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |t: u32| (0..6u32).map(move |car| format!("{t},{car},{},0,0,0\n", 4000 * car));
    let csv: String = (0..60).flat_map(rows).collect();
    fs::write(folder.path().join("far.csv"), format!("t_s,vehicle,x_m,y_m,vx_m_s,vy_m_s\n{csv}")).unwrap();
    let output = standoff(folder.path(), &["run", "--traffic", "far.csv", "--uavs", "2"]);
    let table = text(&output.stdout);
    let (custody, _) = table.split_once("\nEstimation\n").unwrap();
    assert!(custody.contains("of 6 targets on average are in no group: no orbit covers them\n"), "{table}");
    assert!(table.contains("      target \"1\"\n"), "{table}");
}

#[test]
fn a_repeated_run_writes_the_same_bytes_and_reports_the_replacement() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["run", "tour/02-two-uavs", "--seed", "5"];
    let first = standoff(folder.path(), &args);
    let results = folder.path().join("standoff-out/tour/02-two-uavs-5");
    let read = || names(&results).iter().map(|name| fs::read(results.join(name)).unwrap()).collect::<Vec<_>>();
    let bytes = read();
    let second = standoff(folder.path(), &args);
    assert_eq!(first.stdout, second.stdout);
    assert_eq!(text(&second.stderr), "note: replacing the older run in standoff-out/tour/02-two-uavs-5\n");
    assert!(bytes == read(), "the same scenario and seed gave different bytes");
}

/// Scores and figures are computed from the record only. Without the truth table, only the scores that need it are
/// missing.
#[test]
fn show_reproduces_the_results_and_uses_the_truth_for_scores_only() {
    let folder = tempfile::tempdir().unwrap();
    let run = standoff(folder.path(), &["run", "traffic/convoy", "--json", "--out", "o"]);
    let read = |name: &str| fs::read(folder.path().join("o").join(name)).unwrap();
    let (flown, drawn) = (read("summary.json"), read("standoff_distance.svg"));
    let shown = standoff(folder.path(), &["report", "o", "--json"]);
    assert_eq!((&shown.stdout, &read("summary.json")), (&run.stdout, &flown));

    fs::remove_file(folder.path().join("o/truth.parquet")).unwrap();
    let blind = standoff(folder.path(), &["report", "o", "--json"]);
    assert!(text(&blind.stderr).contains("no truth table"));
    assert!(read("standoff_distance.svg") == drawn, "the figure changed");
    let (blind, flown): (Value, Value) =
        (serde_json::from_slice(&blind.stdout).unwrap(), serde_json::from_slice(&flown).unwrap());
    assert_eq!(blind["events"], flown["events"]);
    assert!(blind["metrics"]["position_error_m"].is_null() && flown["metrics"]["position_error_m"].is_number());
    let without_truth = "standoff_error_own_estimate_m";
    assert_eq!(blind["metrics"][without_truth], flown["metrics"][without_truth]);
}

/// A manifest states what the controller reports. Metrics of data that it does not report are null, even if the tables
/// contain rows.
#[test]
fn metrics_of_data_that_the_controller_does_not_report_are_null() {
    let folder = tempfile::tempdir().unwrap();
    standoff(folder.path(), &["run", "tour/02-two-uavs", "--out", "o"]);
    let manifest = folder.path().join("o/run.json");
    let text_before = fs::read_to_string(&manifest).unwrap();
    assert!(!text_before.contains("reported"), "{text_before}");
    let silent = text_before.replacen('{', r#"{"reported": {"tracks": false, "groups": false, "events": false},"#, 1);
    fs::write(&manifest, silent).unwrap();
    let shown = standoff(folder.path(), &["report", "o", "--json"]);
    assert!(text(&shown.stderr).contains("reports no tracks") && text(&shown.stderr).contains("reports no groups"));
    let summary: Value = serde_json::from_slice(&shown.stdout).unwrap();
    let metrics = &summary["metrics"];
    for none in
        ["custody_fraction", "ungrouped_fraction", "position_error_m", "standoff_error_m", "handoffs", "removals"]
    {
        assert!(metrics.get(none).is_some_and(Value::is_null), "{none}: {metrics}");
    }
    assert!(metrics["in_view_fraction"].is_number() && metrics["separation_min_m"].is_number());
    assert_eq!(summary["targets"], 3);
}

#[test]
fn any_traffic_file_flies_without_a_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let mut csv = "time_s,vehicle,x_m,y_m\n".to_owned();
    for second in 0..60 {
        csv += &format!("{second},lead,{},0\n{second},tail,{},10\n", 10 * second, 10 * second - 30);
    }
    fs::write(folder.path().join("two.csv"), csv).unwrap();
    let output = standoff(folder.path(), &["run", "--traffic", "two.csv", "--uavs", "3", "--json"]);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&printed["scenario"], &printed["uavs"], &printed["targets"]), (&"two".into(), &3.into(), &2.into()));
    assert_eq!(printed["metrics"]["member_out_of_view_fraction"], Value::from(0.0));
    let [results] = &names(&folder.path().join("standoff-out"))[..] else { panic!("one folder") };
    assert!(results.starts_with("two-1+traffic=") && results.ends_with("+uavs=3"), "{results}");
    assert!(folder.path().join("standoff-out").join(results).join("trajectories.svg").exists());
}

#[test]
fn several_traffic_files_and_standard_input_are_flown_together() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |y_m: u32| (0..30).map(|t| format!("{t},car,{},{y_m}\n", 10 * t)).collect::<String>();
    for (name, y_m) in [("north.csv", 9), ("south.csv", 0)] {
        fs::write(folder.path().join(name), format!("time_s,vehicle,x_m,y_m\n{}", rows(y_m))).unwrap();
    }
    let mut piped = crate::common::command(
        folder.path(),
        &["run", "--traffic", "north.csv", "--traffic", "-", "--traffic", "south.csv", "--uavs", "1", "--out", "o"],
    );
    let input = folder.path().join("input");
    fs::write(&input, "time_s,vehicle,x_m,y_m\n0,bus,0,4\n1,bus,9,4\n").unwrap();
    let output = piped.stdin(fs::File::open(&input).unwrap()).output().unwrap();
    let printed = text(&output.stdout);
    assert!(printed.starts_with("north, seed 1: 1 UAV, 3 targets (2.0 at a time), 29 s"), "{printed}");
    assert!(printed.contains("UAVs over north.csv, standard input, south.csv"), "{printed}");
    let scenario = fs::read_to_string(folder.path().join("o/scenario.toml")).unwrap();
    assert!(scenario.contains("file = [\"north.csv\", \"-\", \"south.csv\"]"), "{scenario}");
    let output = standoff(folder.path(), &["report", "o", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    check_refused(&["run", "--traffic", "-"], &["standard input: is empty; must be"]);
    check_refused(&["run", "--traffic", "bad.xml", "--traffic", "none.csv"], &["bad.xml:2:"]);
    check_refused(&["run", "--traffic", "-", "--set", "traffic.file=[1]"], &["traffic.file.0 = 1: must be"]);
}

/// A run never replaces the results of a different run.
#[test]
fn different_changes_have_different_folders_and_their_order_does_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let csv = |x: &str| format!("time_s,vehicle,x_m,y_m\n0,van,{x},0\n10,van,80,0\n");
    fs::create_dir(folder.path().join("other")).unwrap();
    fs::write(folder.path().join("van.csv"), csv("0")).unwrap();
    fs::write(folder.path().join("same.csv"), csv("0")).unwrap();
    fs::write(folder.path().join("other/van.csv"), csv("1")).unwrap();
    let results = |args: &[&str]| {
        let output = standoff(folder.path(), &[&["run"], args].concat());
        let printed = text(&output.stdout);
        assert_eq!(text(&output.stderr), "", "{args:?}");
        let out = printed.lines().find_map(|line| line.strip_prefix("results in ")).unwrap().to_owned();
        assert!(folder.path().join(&out).join("run.json").exists(), "{out}");
        out
    };
    let short = ["tour/01-one-uav", "--set", "duration_s=2"];
    let plain = "standoff-out/tour/01-one-uav-1+duration_s=2";
    assert_eq!(results(&short), plain);
    let pair = "standoff-out/tour/01-one-uav-1+uavs=2+duration_s=2+guidance.radial_gain=0.5";
    assert_eq!(results(&[&short[..], &["--set", "guidance.radial_gain=0.5", "--uavs", "2"]].concat()), pair);
    let quoted = results(&["tour/01-one-uav", "--set", "duration_s=2", "--set", "about=a run/of mine"]);
    assert!(quoted.starts_with("standoff-out/tour/01-one-uav-1+about=a-run-of-mine+duration_s=2+"), "{quoted}");
    let van = results(&["--traffic", "van.csv"]);
    assert!(van.starts_with("standoff-out/van-1+traffic="), "{van}");
    assert_ne!(van, results(&["--traffic", "other/van.csv"]));
    let named = results(&["tour/01-one-uav", "--traffic", "other/van.csv", "--set", "duration_s=10"]);
    assert!(named.starts_with("standoff-out/tour/01-one-uav-1+traffic=van-"), "{named}");

    // Equivalent commands: the last value of a key counts, the order of keys does not, and traffic is identified by
    // content.
    let again = |args: &[&str], out: &str| {
        let output = standoff(folder.path(), &[&["run"], args].concat());
        assert_eq!(text(&output.stderr), format!("note: replacing the older run in {out}\n"), "{args:?}");
    };
    again(&[&["--set", "duration_s = 9"], &short[..]].concat(), plain);
    let reordered = ["--set", "guidance.radial_gain=1", "--set", "guidance.radial_gain=0.5", "--set", "duration_s=2"];
    again(&[&reordered[..], &["tour/01-one-uav", "--uavs", "2"]].concat(), pair);
    let table = results(&[&short[..], &["--set", "guidance.radial_gain=1", "--set", "guidance={}"]].concat());
    assert!(table.starts_with(&format!("{plain}+guidance=--+")), "{table}");
    fs::rename(folder.path().join("same.csv"), folder.path().join("van.csv")).unwrap();
    again(&["--traffic", "van.csv"], &van);
}

#[test]
fn messages_suggest_what_the_user_may_have_meant() {
    let figure_9 = "did you mean `paper/figure-9` or `improved/figure-9`?";
    for command in ["run", "check", "view", "scenarios", "baseline"] {
        check_refused(&[command, "figure-9"], &[figure_9]);
        check_refused(&[command, "figure9"], &[figure_9]);
    }
    check_refused(&["monte-carlo", "table-2-single", "--runs", "2"], &["did you mean `paper/table-2-single`?"]);
    check_refused(&["run", "bad"], &["did you mean `bad.toml`?"]);
    check_refused(&["view", "bad"], &["did you mean bad.toml?"]);
    check_refused(&["run", "figure-9.toml"], &["cannot be read", figure_9]);
    for command in ["check", "run", "view"] {
        check_refused(
            &[command, "a/city.csv"],
            &["its name is that of a traffic file", "standoff run --traffic a/city.csv"],
        );
        check_refused(&[command, "city.fcd.xml.gz"], &["standoff run --traffic city.fcd.xml.gz"]);
    }
    check_refused(
        &["view", "standoff-out/mine-2"],
        &["standoff-out/mine-2: no results folder, scenario file", "standoff scenarios lists"],
    );
    for option in ["--set", "--set-b"] {
        let args = ["compare", "mine.toml", option, "guidance.lead_s", "0"];
        check_refused(&args, &[option, "a key without its value: write guidance.lead_s=VALUE"]);
    }
    for args in [&["run"][..], &["run", "tour/01-one-uav"]] {
        let args = [args, &["--set", "guidance.lead_s", "0"]].concat();
        check_refused(&args, &["--set", "write guidance.lead_s=VALUE, with = and no space"]);
    }
    check_refused(
        &["run", "--uavs", "2", "--set", "uavs.count=3"],
        &["--uavs 2 and --set uavs.count=3 contradict each other"],
    );
    check_refused(&["run", "--set", "uavs={}", "--uavs=2"], &["--uavs 2 and --set uavs={} contradict each other"]);
}

#[test]
fn help_has_a_fixed_width_in_pipes_and_examples_fit_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let mut commands = vec![vec!["--help"]];
    let main = text(&standoff(folder.path(), &["--help"]).stdout);
    let listed = main.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // Indented lines continue the description of a command.
    let names = listed.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    commands.extend(names.map(|name| vec!["help", name]));
    assert_eq!(commands.len(), 16, "{commands:?}");
    for command in commands {
        let help = text(&standoff(folder.path(), &command).stdout);
        let widest = help.lines().max_by_key(|line| line.chars().count()).unwrap();
        assert!(widest.chars().count() <= 100, "{command:?}: {widest}");
        for line in help.lines().skip_while(|line| *line != "Examples:") {
            assert!(line.chars().count() <= 80, "{command:?}: would wrap on a terminal: {line}");
        }
    }
}

/// Like bash, the test sources the script and calls its function with the words typed so far.
#[cfg(unix)]
#[test]
fn bash_completes_commands_options_and_names() {
    let folder = tempfile::tempdir().unwrap();
    let ask = "source <(\"$0\" completions bash) || exit; shift 0; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); \
        _standoff standoff \"${COMP_WORDS[COMP_CWORD]}\" \"${COMP_WORDS[COMP_CWORD - 1]}\"; echo \"${COMPREPLY[*]}\"";
    let completed = |words: &[&str]| {
        let mut bash = Command::new("bash");
        bash.current_dir(folder.path()).args(["--norc", "-c", ask, env!("CARGO_BIN_EXE_standoff"), "standoff"]);
        let output = bash.args(words).output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{words:?}: {}", text(&output.stderr));
        text(&output.stdout).trim_end().to_owned()
    };
    assert_eq!(completed(&["m"]), "monte-carlo merge");
    assert_eq!(completed(&["run", "--se"]), "--set --seed");
    assert_eq!(completed(&["run", "impr"]), "improved/table-2-pair improved/figure-9");
    assert_eq!(completed(&["compare", "improved/figure-9", "paper/figure-9-"]), "paper/figure-9-basic");
    assert_eq!(completed(&["view", "tour/04"]), "tour/04-two-groups");
    assert_eq!(completed(&["reproduce", "table"]), "table-2");
    assert_eq!(completed(&["run", "mine"]), "", "bash falls back to file names");
    for shell in ["zsh", "fish", "elvish", "powershell"] {
        let script = text(&standoff(folder.path(), &["completions", shell]).stdout);
        assert!(script.contains("monte-carlo") && script.contains("no-open"), "{shell}: {script}");
        // Arguments that also accept files get no scenario names here: these shells would then not complete files.
        assert_eq!(script.contains("paper/table-2-pair"), shell == "zsh", "{shell}: {script}");
    }
}

#[test]
fn wrong_input_is_refused_with_one_clear_message() {
    let drawn = "error: uavs.count = 0: must be at least 1 and at most 4096\n --> bad.toml:2:1\n  |\n2 | count = 0\n  | ^^^^^^^^^\n";
    check_refused(&["run", "bad.toml"], &[drawn]);
    check_refused(&["check", "bad.toml"], &[drawn]);
    check_refused(&["monte-carlo", "bad.toml", "--runs", "2"], &[drawn]);
    check_refused(&["compare", "bad.toml", "paper/figure-8", "--runs", "2"], &[drawn]);
    check_refused(&["run", "paper/table-9"], &["no such scenario", "paper/table-2-pair"]);
    check_refused(&["scenarios", "show", "paper/table-9"], &["no built-in scenario has this name"]);
    check_refused(&["run", "--traffic", "bad.xml"], &["bad.xml:2:"]);
    check_refused(&["run", "--traffic", "none.xml"], &["none.xml", "No such file"]);
    check_refused(&["run", "--traffic", "mine"], &["mine"]);
    check_refused(&["run", "--uavs", "0"], &["uavs.count = 0"]);
    check_refused(&["run", "--uavs", "two"], &["--uavs"]);
    check_refused(
        &["run", "--set", "guidance.radial_gian=1"],
        &[
            "guidance.radial_gian: there is no such key",
            "| --set guidance.radial_gian=1",
            "did you mean `radial_gain`?",
        ],
    );
    check_refused(
        &["run", "--set", "orbit.radius_max_m=1"],
        &["orbit.radius_max_m = 1", "not smaller than radius_min_m"],
    );
    check_refused(&["run", "--set", "sensor.field_of_view_deg=5"], &["field_of_view_margin_deg = 10", "below 5"]);
    check_refused(&["run", "--out", "mine"], &["mine contains something other than a run of standoff (thesis.tex)"]);
    check_refused(&["run", "--metrics", "wind"], &["--metrics", "no such metric", "position_error_m"]);
    check_refused(&["run", "--metrics", ","], &["--metrics", "must name at least one metric"]);
    check_refused(&["report", "mine"], &["mine"]);
    check_refused(&["report", "nowhere"], &["nowhere"]);
    check_refused(&["fly"], &["fly"]);
    let tiles = "http://127.0.0.1/{z}/{x}/{y}.png";
    check_refused(&["run", "--tiles", tiles], &["--tiles adds images to the page that --view serves: add --view"]);
    check_refused(&["view", "--tiles", "http://a/{z}/{x}"], &["--tiles", "must contain {y} once"]);
    for command in [&["view", "--no-open"][..], &["run", "--view", "--no-open"]] {
        let arguments = [command, &["--tiles", tiles]].concat();
        check_refused(&arguments, &["--tiles: the run has no geographic coordinates"]);
    }
}

/// Two vehicles are 2 km apart, so that one disc covers one of them.
#[test]
fn the_coverage_baseline_is_printed_for_a_scenario_and_with_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let apart = "targets={ acceleration_sd_m_s2 = 0.0, start = [{ x_m = 0.0 }, { x_m = 2000.0 }] }";
    let of = |args: &[&str]| {
        let output = standoff(folder.path(), &[args, &["tour/01-one-uav", "--set", apart]].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let one: Value = serde_json::from_str(r#"{"discs": 1, "mover_fraction": 0.5, "best_fraction": 0.5}"#).unwrap();
    let two: Value = serde_json::from_str(r#"{"discs": 2, "mover_fraction": 1.0, "best_fraction": 1.0}"#).unwrap();
    let printed: Value = serde_json::from_str(&of(&["baseline", "--json", "--uavs", "2"])).unwrap();
    assert_eq!((&printed["baseline"]["half_of_uavs"], &printed["baseline"]["all_uavs"]), (&one, &two));
    assert_eq!((&printed["uavs"], &printed["targets"], &printed["seed"]), (&2.into(), &2.into(), &1.into()));
    let table = of(&["baseline", "--uavs", "2"]);
    assert!(table.contains("1 disc, half as many as UAVs            50.0            50.0\n"), "{table}");
    assert!(table.contains("2 discs, as many as UAVs               100.0           100.0\n"), "{table}");
    assert!(!of(&["baseline"]).contains("half as many"), "with one UAV, both rows would be equal");
    assert!(names(folder.path()).is_empty(), "nothing is written");

    let run = of(&["run", "--baseline", "--out", "o"]);
    assert!(
        run.contains("      baseline 50 %: 1 greedy disc with perfect knowledge of all targets, at 20 m/s\n"),
        "{run}"
    );
    let json: Value = serde_json::from_str(&of(&["run", "--baseline", "--json", "--out", "o"])).unwrap();
    assert_eq!(json["baseline"]["all_uavs"], one);
    let files = || {
        names(&folder.path().join("o"))
            .iter()
            .map(|name| fs::read(folder.path().join("o").join(name)).unwrap())
            .collect::<Vec<_>>()
    };
    let with_baseline = files();
    of(&["run", "--out", "o"]);
    assert!(files() == with_baseline, "the baseline changes the files");
    check_refused(&["baseline", "paper/table-9"], &["no such scenario", "paper/table-2-pair"]);
    check_refused(&["baseline", "bad.toml"], &["error: uavs.count = 0: must be at least 1 and at most 4096"]);
    check_refused(&["baseline", "--uavs", "2", "--set", "uavs.count=3"], &["contradict each other"]);
}

#[test]
fn check_prints_that_a_scenario_is_valid_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let output = standoff(folder.path(), &["check", "traffic/convoy"]);
    assert_eq!(text(&output.stdout), "traffic/convoy: valid (2 UAVs, 219.5 s)\n");
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_printed_scenario_can_be_run() {
    let folder = tempfile::tempdir().unwrap();
    let printed = standoff(folder.path(), &["scenarios", "show", "tour/01-one-uav"]);
    fs::write(folder.path().join("mine.toml"), &printed.stdout).unwrap();
    let output = standoff(folder.path(), &["run", "mine.toml"]);
    assert!(text(&output.stdout).contains("results in standoff-out/mine-1"));
    assert!(text(&standoff(folder.path(), &["scenarios"]).stdout).contains("paper/table-2-pair "));
    let schema: Value = serde_json::from_slice(&standoff(folder.path(), &["scenarios", "schema"]).stdout).unwrap();
    assert_eq!(schema["title"], "A scenario of standoff");
}

#[test]
fn help_has_examples_and_the_version_is_printed() {
    let folder = tempfile::tempdir().unwrap();
    assert!(
        text(&standoff(folder.path(), &["--help"]).stdout).contains("standoff run --traffic city.fcd.xml.gz --uavs 2")
    );
    assert!(text(&standoff(folder.path(), &["run", "--help"]).stdout).contains("Examples:"));
    assert_eq!(text(&standoff(folder.path(), &["--version"]).stdout), "standoff 0.1.0\n");
}

/// A file-size limit simulates a full disk: the tables of the record fit, the page does not.
#[cfg(unix)]
#[test]
fn the_record_is_kept_if_the_page_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let limited = "trap '' XFSZ; ulimit -f 2000; exec \"$0\" run tour/02-two-uavs --out o";
    let mut shell = Command::new("sh");
    shell.current_dir(folder.path()).args(["-c", limited, env!("CARGO_BIN_EXE_standoff")]);
    let output = shell.output().unwrap();
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("report.html: File too large"), "{message}");
    assert_eq!(names(folder.path()), ["o"]);
    assert!(!names(&folder.path().join("o")).contains(&"report.html".to_owned()), "a partial page is left");
    let shown = standoff(folder.path(), &["report", "o"]);
    assert!(shown.status.success(), "{}", text(&shown.stderr));
    assert!(folder.path().join("o/report.html").exists(), "show did not write the page");
}

#[test]
fn columns_are_aligned_for_long_metric_names() {
    let folder = tempfile::tempdir().unwrap();
    for args in [["compare", "--set-b=guidance.lead_s=1"], ["monte-carlo", "--out=batch"]] {
        let [command, option] = args;
        let args = [command, "tour/02-two-uavs", option, "--runs=2", "--metrics=limits"];
        let output = standoff(folder.path(), &args);
        let table = text(&output.stdout);
        let is_head = |line: &&str| line.starts_with("      ") && line.contains("95 %");
        let lines: Vec<&str> = table.lines().skip_while(|line| !is_head(line)).collect();
        let first = lines[0].split_whitespace().next().unwrap();
        let end = lines[0].find(first).unwrap() + first.len();
        let rows: Vec<&&str> =
            lines[1..].iter().take_while(|line| !line.is_empty()).filter(|row| row.starts_with("  ")).collect();
        assert!(rows.iter().any(|row| row.starts_with("  position error / Cramer-Rao bound ")), "{table}");
        let ends = |row: &str, at: usize| row.char_indices().nth(at).map_or(row.len(), |(byte, _)| byte);
        assert!(
            rows.iter().all(|row| !row[..ends(row, end)].ends_with(' ') && row[ends(row, end)..].starts_with(' ')),
            "{table}"
        );
    }
}
