//! Runs that end early: killed, interrupted, or out of disk space. The remaining files are complete, or are marked as
//! unfinished and readable; older results are kept until the new ones are complete.

use std::fs;
use std::io::{Read as _, Write as _};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::common::{command, is_same, names, send_signal, standoff, text};
use serde_json::Value;

/// The mission of `SHORT`, paced so slowly on any machine that checkpoints are written during the flight.
const SLOW: [&str; 6] = ["run", "tour/02-two-uavs", "--view", "--no-open", "--speed=30", "--out"];
/// Duration of that mission, s.
const SLOW_S: f64 = 150.0;
/// A run that takes some seconds at full speed.
const LONG: [&str; 7] = ["run", "paper/table-2-pair", "--set", "duration_s=20000", "--metrics", "nis", "--out"];
/// A run that takes a fraction of a second.
const SHORT: [&str; 3] = ["run", "tour/02-two-uavs", "--out"];

/// Returns the end of an unfinished run, s, and checks that the JSON, the note and the table of `standoff report`
/// agree.
fn recorded_until_s(folder: &Path, dir: &str, duration_s: f64) -> f64 {
    let shown = standoff(folder, &["report", dir, "--json"]);
    let message = text(&shown.stderr);
    assert!(shown.status.success(), "{message}");
    let outcome: Value = serde_json::from_slice(&shown.stdout).unwrap();
    let until_s = outcome["unfinished_after_s"].as_f64().unwrap();
    assert_eq!(outcome["duration_s"].as_f64(), Some(duration_s));
    assert_eq!(message, format!("note: this run is unfinished: it covers {until_s} s of {duration_s} s\n"));
    let table = text(&standoff(folder, &["report", dir]).stdout);
    let line = table.lines().next().unwrap();
    assert!(line.ends_with(&format!("{duration_s} s, unfinished after {until_s} s")), "{line}");
    until_s
}

/// A small pseudo-random number generator; its quality does not matter. Returns numbers from 0 to 1.
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as f64 / (1u64 << 31) as f64
}

/// Starts a run and kills it after `time`; returns true if it had ended before.
fn kill_after(folder: &Path, args: &[&str], time: Duration) -> bool {
    let mut child = command(folder, args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    thread::sleep(time);
    let ended = child.try_wait().unwrap().is_some();
    child.kill().unwrap();
    child.wait().unwrap();
    ended
}

/// Either the older run or the new one exists in full; during the replacement, the older one has a temporary name.
#[test]
fn a_short_run_killed_at_any_time_leaves_the_older_or_the_new_run_complete() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let began = Instant::now();
    assert!(standoff(folder.path(), &[&SHORT[..], &["new"]].concat()).status.success());
    let longest = began.elapsed();
    let older = [&SHORT[..], &["o", "--seed", "9"]].concat();
    assert!(standoff(folder.path(), &[&SHORT[..], &["old", "--seed", "9"]].concat()).status.success());
    let mut state = 1;
    let mut kills = 0;
    while kills < 25 {
        assert!(standoff(folder.path(), &older).status.success());
        assert_eq!(names(folder.path()), ["new", "o", "old"]);
        kills +=
            u32::from(!kill_after(folder.path(), &[&SHORT[..], &["o"]].concat(), longest.mul_f64(random(&mut state))));
        // Between the two renames of a replacement, the older run has a temporary name.
        let place = if path("o").exists() { "o" } else { "o.standoff-older" };
        assert!(
            is_same(&path(place), &path("old")) || is_same(&path(place), &path("new")),
            "{:?}",
            names(&path(place))
        );
        assert!(path("o").exists() || standoff(folder.path(), &["report", "o.partial"]).status.success());
        let again = standoff(folder.path(), &[&SHORT[..], &["o"]].concat());
        assert!(again.status.success(), "{}", text(&again.stderr));
        assert!(is_same(&path("o"), &path("new")));
        assert_eq!(names(folder.path()), ["new", "o", "old"], "other files are left");
    }
}

#[test]
fn a_slow_run_killed_at_any_time_can_be_read_up_to_its_last_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let fly = [&SLOW[..], &["o"]].concat();
    let mut state = 2;
    for attempt in 0..5 {
        let _ = fs::remove_dir_all(path("o.partial"));
        let mut child = command(folder.path(), &fly).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        // The first attempt is killed before the first checkpoint, the others after it.
        while !path("o.partial/events.parquet").exists() || attempt > 0 && !path("o.partial/checkpoint").exists() {
            assert!(child.try_wait().unwrap().is_none(), "make the mission slower");
            thread::sleep(Duration::from_millis(1));
        }
        thread::sleep(Duration::from_secs_f64(2.0 * random(&mut state)));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(!path("o").exists());
        if path("o.partial/checkpoint").exists() {
            let until_s = recorded_until_s(folder.path(), "o.partial", SLOW_S);
            assert!(until_s > 0.0 && until_s < SLOW_S);
            assert!(path("o.partial/report.html").exists());
        } else {
            let shown = standoff(folder.path(), &["report", "o.partial"]);
            let message = text(&shown.stderr);
            assert_eq!((attempt, shown.status.code()), (0, Some(2)), "{message}");
            assert!(message.contains("ended before its first checkpoint"), "{message}");
        }
    }
    let again = standoff(folder.path(), &[&SHORT[..], &["o"]].concat());
    assert_eq!(text(&again.stderr), "note: an unfinished run is kept in o.standoff-older until this one is complete\n");
    assert_eq!(names(folder.path()), ["o"]);
    assert!(standoff(folder.path(), &[&SHORT[..], &["whole"]].concat()).status.success());
    assert!(is_same(&path("o"), &path("whole")));
}

#[test]
fn an_interrupted_run_ends_soon_and_prints_its_folder_and_its_end_time() {
    let folder = tempfile::tempdir().unwrap();
    for (signal, out) in [("INT", "i"), ("TERM", "t")] {
        let partial = format!("{out}.partial");
        let args = [&LONG[..], &[out]].concat();
        let mut child = command(folder.path(), &args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        while !folder.path().join(&partial).join("events.parquet").exists() {
            assert!(child.try_wait().unwrap().is_none(), "make the mission longer");
            thread::sleep(Duration::from_millis(1));
        }
        thread::sleep(Duration::from_millis(100));
        let signalled = Instant::now();
        send_signal(signal, child.id());
        let status = child.wait().unwrap();
        assert!(signalled.elapsed() < Duration::from_secs(20), "{:?}", signalled.elapsed());
        let (mut printed, mut message) = (String::new(), String::new());
        child.stdout.unwrap().read_to_string(&mut printed).unwrap();
        child.stderr.unwrap().read_to_string(&mut message).unwrap();
        assert_eq!((status.code(), printed.as_str()), (Some(1), ""), "{message}");
        let until_s = recorded_until_s(folder.path(), &partial, 20_000.0);
        let advice = format!("to print its results, run standoff report {partial}");
        let expected =
            format!("error: interrupted; the run up to {until_s} s is saved in {partial}, unfinished: {advice}\n");
        assert_eq!(message, expected);
        assert!(!folder.path().join(out).exists());
    }
}

/// The folder contains the record of one of the runs or the older one, never a mixture. Each run either succeeds or
/// reports that another run is writing.
#[test]
fn two_simultaneous_runs_into_one_folder_never_mix() {
    let folder = tempfile::tempdir().unwrap();
    let fly = |out: &str, seed: &str| {
        command(folder.path(), &["run", "tour/01-one-uav", "--set", "duration_s=2", "--out", out, "--seed", seed])
    };
    for seed in ["1", "2", "3"] {
        assert!(fly(seed, seed).output().unwrap().status.success());
    }
    let path = |name: &str| folder.path().join(name);
    assert!(fly("o", "3").output().unwrap().status.success());
    for round in 0..40 {
        let runs = ["1", "2"].map(|seed| fly("o", seed).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap());
        let ends = runs.map(|run| run.wait_with_output().unwrap());
        for end in &ends {
            let message = text(&end.stderr);
            let is_expected = end.status.success() || message.contains("another run is writing");
            assert!(is_expected, "round {round}: {:?}: {message}", end.status.code());
        }
        let seeds = ["1", "2", "3"].iter().zip([ends[0].status.success(), ends[1].status.success(), false]);
        let whole: Vec<_> = seeds.filter(|(seed, _)| is_same(&path("o"), &path(seed))).collect();
        assert!(matches!(whole[..], [(_, true)]), "round {round}: {whole:?}");
        assert_eq!(names(folder.path()), ["1", "2", "3", "o"]);
    }
}

#[test]
fn reserved_folder_suffixes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for out in ["o.partial", "o.standoff-older", "o.partial/"] {
        let output = standoff(folder.path(), &[&SHORT[..], &[out]].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains("ends with a suffix that standoff reserves"), "{}", text(&output.stderr));
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
#[cfg(unix)]
fn a_symbolic_link_to_a_folder_is_refused_before_the_flight() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("real")).unwrap();
    std::os::unix::fs::symlink("real", folder.path().join("link")).unwrap();
    for out in ["link", "link/", "link/."] {
        let output = standoff(folder.path(), &[&SHORT[..], &[out]].concat());
        assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    }
    assert_eq!(names(folder.path()), ["link", "real"]);
}

/// Starts a command that prints a message at its start, blocks it there by a full pipe until it handles Ctrl-C,
/// interrupts it and then reads the pipe. Returns its exit status and its messages.
#[cfg(target_os = "linux")]
fn interrupted_at_the_start(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let (mut read, mut write) = UnixStream::pair().unwrap();
    write.set_nonblocking(true).unwrap();
    let mut filled = 0;
    while let Ok(n) = write.write(b".") {
        filled += n;
    }
    write.set_nonblocking(false).unwrap();
    let stderr = Stdio::from(OwnedFd::from(write));
    // This process's copy of the write end is closed with the temporary `Command`; only the child keeps one.
    let mut child = command(folder, args).stdout(Stdio::null()).stderr(stderr).spawn().unwrap();
    let handles_sigint = || {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
        // SIGINT is signal 2: the second bit.
        u64::from_str_radix(caught.trim(), 16).unwrap() & 2 != 0
    };
    while !handles_sigint() {
        thread::sleep(Duration::from_millis(1));
    }
    send_signal("INT", child.id());
    let mut messages = Vec::new();
    read.read_to_end(&mut messages).unwrap();
    (child.wait().unwrap().code(), text(&messages[filled..]))
}

#[test]
#[cfg(target_os = "linux")]
fn a_run_interrupted_before_its_first_time_step_leaves_only_the_older_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let older = [&SHORT[..], &["o", "--seed", "9"]].concat();
    assert!(standoff(folder.path(), &older).status.success());
    assert!(standoff(folder.path(), &[&SHORT[..], &["old", "--seed", "9"]].concat()).status.success());
    let (status, message) = interrupted_at_the_start(folder.path(), &[&SHORT[..], &["o"]].concat());
    let expected = "note: replacing the older run in o\nerror: interrupted; nothing of the run was saved\n";
    assert_eq!((status, message.as_str()), (Some(1), expected));
    assert!(is_same(&path("o"), &path("old")));
    assert_eq!(names(folder.path()), ["o", "old"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_batch_interrupted_before_its_page_is_complete_and_the_command_can_be_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["monte-carlo", "tour/02-two-uavs", "--runs", "3", "--metrics", "nis", "--out", "o"];
    let whole = standoff(folder.path(), &args);
    let files = names(&folder.path().join("o"));
    fs::remove_file(folder.path().join("o/report.html")).unwrap();
    let (status, message) = interrupted_at_the_start(folder.path(), &args);
    let expected = "note: o is already complete; no runs are flown\n\
                error: interrupted; 3 runs are complete in o: repeat the command to print their results\n";
    assert_eq!((status, message.as_str()), (Some(1), expected));
    assert!(!folder.path().join("o/report.html").exists());
    let again = standoff(folder.path(), &args);
    assert_eq!((again.status.code(), text(&again.stdout)), (Some(0), text(&whole.stdout)));
    assert_eq!(names(&folder.path().join("o")), files);
}

/// A file-size limit simulates a full disk.
#[test]
fn a_run_without_room_for_its_tables_fails_and_leaves_the_older_run() {
    let folder = tempfile::tempdir().unwrap();
    assert!(standoff(folder.path(), &[&SHORT[..], &["o"]].concat()).status.success());
    let limited = |blocks: u32, args: &[&str]| {
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
        let mut shell = Command::new("sh");
        shell.args(["-c", &script, env!("CARGO_BIN_EXE_standoff")]).args(args);
        shell.current_dir(folder.path()).output().unwrap()
    };
    for blocks in [0, 1, 8] {
        let output = limited(blocks, &[&SHORT[..], &["o", "--seed", "2"]].concat());
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{blocks} blocks: {message}");
        assert!(message.contains("error: cannot write o.partial/") && message.contains("File too large"), "{message}");
        assert!(message.ends_with("; nothing of the run was saved\n") || blocks < 8, "{message}");
        assert_eq!(names(folder.path()), ["o"], "the older run stays");
    }
}

/// The limit is set during the flight. A checkpoint that cannot be written does not end the run; a table does.
#[test]
#[cfg(target_os = "linux")]
fn a_disk_that_fills_up_during_the_flight_leaves_the_part_saved_before() {
    let folder = tempfile::tempdir().unwrap();
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' XFSZ; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_standoff")]).args(SLOW).arg("l");
    let mut child = shell.current_dir(folder.path()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let checkpoint = folder.path().join("l.partial/checkpoint");
    while !checkpoint.exists() {
        assert!(child.try_wait().unwrap().is_none(), "make the mission slower");
        thread::sleep(Duration::from_millis(1));
    }
    let limit = ["--pid", &child.id().to_string(), "--fsize=1000"];
    assert!(Command::new("prlimit").args(limit).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("error: cannot write l.partial/"), "{message}");
    assert!(message.contains(".parquet: File too large"), "{message}");
    let until_s = recorded_until_s(folder.path(), "l.partial", SLOW_S);
    assert!(message.contains(&format!("; the run up to {until_s} s is saved in l.partial, unfinished")), "{message}");
}

#[test]
fn help_that_cannot_be_printed_is_an_error() {
    for (args, out, status) in
        [("--help", "/dev/full", 1), ("--version", "/dev/full", 1), ("run --help", "/dev/null", 0)]
    {
        let script = format!("\"$0\" {args} > {out}");
        let output = Command::new("sh").args(["-c", &script, env!("CARGO_BIN_EXE_standoff")]).output().unwrap();
        assert_eq!(output.status.code(), Some(status), "{args}: {}", text(&output.stderr));
    }
}

#[test]
fn a_closed_or_full_output_loses_no_results() {
    let folder = tempfile::tempdir().unwrap();
    for (ending, status) in [("| true", "0"), (">&-", "0"), ("2>&-", "0"), ("> /dev/full", "1")] {
        let script = format!("{{ \"$0\" run tour/02-two-uavs --out o {ending}; }} 2>errors; echo ${{PIPESTATUS:-$?}}");
        let mut shell = Command::new("bash");
        shell.current_dir(folder.path()).args(["-c", &script, env!("CARGO_BIN_EXE_standoff")]);
        let output = shell.output().unwrap();
        let errors = fs::read_to_string(folder.path().join("errors")).unwrap();
        assert_eq!(text(&output.stdout).lines().last(), Some(status), "{ending}: {errors}");
        assert!(!errors.contains("panicked"), "{errors}");
        assert!(folder.path().join("o/report.html").exists());
        fs::remove_dir_all(folder.path().join("o")).unwrap();
    }
}
