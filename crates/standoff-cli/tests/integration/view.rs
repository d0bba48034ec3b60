//! End-to-end tests of `standoff view` and `standoff run --view`: the pages they serve, and how they end.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use crate::common::{command, send_signal, standoff};
use serde_json::Value;

/// A running command that serves a page; it is killed when dropped.
struct Serving {
    child: Child,
    authority: String,
    errors: BufReader<std::process::ChildStderr>,
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn start(folder: &Path, args: &[&str]) -> Child {
    start_plainly(folder, &[args, &["--no-open"]].concat())
}

fn start_plainly(folder: &Path, args: &[&str]) -> Child {
    command(folder, args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn authority(line: &str) -> String {
    line.split("http://").nth(1).unwrap().trim_end().trim_end_matches('/').to_owned()
}

impl Serving {
    /// Starts `view`, which prints its address to standard output.
    fn view(folder: &Path, args: &[&str]) -> Self {
        let mut child = start(folder, args);
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let errors = BufReader::new(child.stderr.take().unwrap());
        Self { child, authority: authority(&line), errors }
    }

    /// Starts `run --view`, which prints its address to standard error.
    fn run(folder: &Path, args: &[&str]) -> Self {
        let mut child = start(folder, args);
        let mut errors = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        errors.read_line(&mut line).unwrap();
        Self { child, authority: authority(&line), errors }
    }

    fn get(&self, path: &str) -> (u16, String) {
        self.request(path, &self.authority)
    }

    /// Requests a path; returns the status and the uncompressed body.
    fn request(&self, path: &str, host: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(&self.authority).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        let answer = String::from_utf8_lossy(&bytes).into_owned();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), body.to_owned())
    }

    /// Waits until the outcome of the run is available, and returns the header of the replay.
    fn outcome(&self) -> Value {
        let until = Instant::now() + Duration::from_secs(60);
        loop {
            let body = self.get("/replay/head.json").1;
            // Long responses are chunked; each chunk follows its length in hexadecimal digits.
            let json = &body[body.find('{').unwrap()..=body.rfind('}').unwrap()];
            let head: Value = serde_json::from_str(json).unwrap();
            if head["outcome"].as_array().is_some_and(|lines| !lines.is_empty()) {
                return head;
            }
            assert!(Instant::now() < until, "the run never ended");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    #[cfg(unix)]
    fn interrupt(mut self) -> (Option<i32>, String) {
        send_signal("INT", self.child.id());
        let until = Instant::now() + Duration::from_secs(20);
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(Instant::now() < until, "the command does not end after Ctrl-C");
            std::thread::sleep(Duration::from_millis(10));
        };
        let mut errors = String::new();
        self.errors.read_to_string(&mut errors).unwrap();
        (status.code(), errors)
    }
}

#[test]
fn a_record_is_served_with_its_outcome_and_other_paths_and_hosts_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let run = start(folder.path(), &["run", "tour/02-two-uavs", "--out", "two"]).wait_with_output().unwrap();
    assert!(run.status.success());
    let summary: Value = serde_json::from_slice(&fs::read(folder.path().join("two/summary.json")).unwrap()).unwrap();

    let serving = Serving::view(folder.path(), &["view", "two"]);
    let head = serving.outcome();
    assert_eq!((head["scenario"].as_str(), head["seed"].as_str()), (Some("tour/02-two-uavs"), Some("1")));
    let error = |line: &&Value| line["metric"] == "position_error_m";
    let shown = head["outcome"].as_array().unwrap().iter().find(error).unwrap();
    assert_eq!(shown["value"], summary["metrics"]["position_error_m"]);
    for path in ["/", "/page.js", "/page.css", "/plotly.js", "/replay/overview/0", "/replay/detail/0"] {
        assert_eq!(serving.get(path).0, 200, "{path}");
    }
    for path in ["/replay/overview/7", "/replay", "/two/run.json", "/../two/run.json", "/replay/feed"] {
        assert!([400, 404, 426].contains(&serving.get(path).0), "{path}");
    }
    assert_eq!(serving.request("/", "evil.example").0, 403);
    let port = serving.authority.rsplit(':').next().unwrap().to_owned();
    assert_eq!(serving.request("/", &format!("localhost:{port}")).0, 200);
    #[cfg(unix)]
    assert_eq!(serving.interrupt().0, Some(0));
}

/// The map of the scenario is served for a recorded run, a scenario that is flown, and a run of a batch.
#[test]
fn the_background_map_is_served() {
    let folder = tempfile::tempdir().unwrap();
    let done = |args: &[&str]| assert!(start_plainly(folder.path(), args).wait_with_output().unwrap().status.success());
    done(&["run", "traffic/convoy", "--set", "duration_s=5", "--out", "convoy"]);
    done(&["monte-carlo", "traffic/convoy", "--set", "duration_s=5", "--runs", "2", "--out", "batch"]);
    for (args, base) in [
        (&["view", "convoy"][..], "/replay"),
        (&["view", "traffic/convoy", "--set", "duration_s=5"], "/replay"),
        (&["view", "batch"], "/run/0/1/replay"),
    ] {
        let serving = Serving::view(folder.path(), args);
        assert!(serving.get(&format!("{base}/head.json")).1.contains("\"map\":true"), "{args:?}");
        let (status, body) = serving.get(&format!("{base}/map.json"));
        assert!(status == 200 && body.contains("\"kind\":\"minor\""), "{args:?}: {status}");
    }
    let without = Serving::view(folder.path(), &["view", "tour/01-one-uav"]);
    assert!(without.get("/replay/head.json").1.contains("\"map\":false"));
    assert_eq!(without.get("/replay/map.json").0, 404);
}

/// The page receives the same bytes for a flown scenario and for its record.
#[test]
fn viewing_a_scenario_equals_viewing_its_record_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["run", "tour/02-two-uavs", "--seed", "3", "--out", "three"];
    assert!(start(folder.path(), &args).wait_with_output().unwrap().status.success());
    let flown = Serving::view(folder.path(), &["view", "tour/02-two-uavs", "--seed", "3"]);
    let read = Serving::view(folder.path(), &["view", "three"]);
    assert_eq!(flown.outcome(), read.outcome());
    for path in ["/replay/overview/0", "/replay/detail/0"] {
        assert!(flown.get(path) == read.get(path), "{path}");
    }
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["three"]);
}

/// Each of the two runs has the same bytes as if it was served alone.
#[test]
fn two_runs_are_shown_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["run", "tour/02-two-uavs", "--out", "two"];
    assert!(start(folder.path(), &args).wait_with_output().unwrap().status.success());
    let pair = Serving::view(folder.path(), &["view", "two", "tour/01-one-uav"]);
    assert!(pair.get("/").1.contains("data-bases=\"/replay /replay-2\""));
    for (base, what) in [("/replay", "two"), ("/replay-2", "tour/01-one-uav")] {
        let alone = Serving::view(folder.path(), &["view", what]);
        alone.outcome();
        for half in ["head.json", "overview/0", "detail/0"] {
            let until = Instant::now() + Duration::from_secs(60);
            while pair.get(&format!("{base}/{half}")) != alone.get(&format!("/replay/{half}")) {
                assert!(Instant::now() < until, "{what}: {half} differs from the run served alone");
                std::thread::sleep(Duration::from_millis(20));
            }
        }
    }
    for path in ["/replay-3/head.json", "/replay-2", "/replay/head.json/", "/replay-2head.json"] {
        assert_eq!(pair.get(path).0, 404, "{path}");
    }
}

#[test]
fn a_run_cannot_be_shown_with_a_batch_or_two_other_runs() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["monte-carlo", "tour/01-one-uav", "--runs", "2", "--out", "batch"];
    assert!(standoff(folder.path(), &args).status.success());
    for what in [&["tour/01-one-uav", "batch"][..], &["batch", "tour/01-one-uav"], &["tour/01-one-uav"; 3]] {
        let done = start(folder.path(), &[&["view"], what].concat()).wait_with_output().unwrap();
        let message = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(2), "{message}");
        assert!(message.contains("name one run, two runs, or any number of folders"), "{message}");
    }
}

/// The settings are those of the batch, not those of the scenario file it came from.
#[test]
fn a_run_of_a_batch_is_flown_again_with_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let change = ["--set", "guidance.radial_gain=0.5"];
    let batch = [&["monte-carlo", "tour/02-two-uavs", "--runs", "4", "--seed", "5", "--out", "batch"], &change[..]];
    assert!(standoff(folder.path(), &batch.concat()).status.success());
    let batch = Serving::view(folder.path(), &["view", "batch"]);
    assert!(batch.get("/batch.json").1.contains("position_error_m"));
    let alone = Serving::view(folder.path(), &[&["view", "tour/02-two-uavs", "--seed", "7"], &change[..]].concat());
    alone.outcome();
    for half in ["overview/0", "detail/0", "head.json"] {
        assert!(batch.get(&format!("/run/0/7/replay/{half}")) == alone.get(&format!("/replay/{half}")), "{half}");
    }
    for path in ["/run/0/7/", "/page.js"] {
        assert_eq!(batch.get(path).0, 200, "{path}");
    }
    for path in ["/run/1/7/replay/head.json", "/run/0/07/", "/run/0/x/", "/run/0/7", "/batch/runs.parquet"] {
        assert_eq!(batch.get(path).0, 404, "{path}");
    }
}

#[test]
fn a_live_view_does_not_change_the_results_of_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["run", "tour/02-two-uavs", "--out", "plain"];
    assert!(start(folder.path(), &args).wait_with_output().unwrap().status.success());
    let live = Serving::run(
        folder.path(),
        &["run", "tour/02-two-uavs", "--view", "--speed", "10000", "--out", "live", "--json"],
    );
    live.outcome();
    #[cfg(unix)]
    assert_eq!(live.interrupt().0, Some(0));
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    for file in ["summary.json", "uavs.parquet", "tracks.parquet", "report.html"] {
        assert!(read(&format!("plain/{file}")) == read(&format!("live/{file}")), "{file}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_live_run_is_saved_and_can_be_viewed() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["run", "tour/02-two-uavs", "--set", "duration_s=20000", "--view", "--speed", "1000", "--out", "live"];
    let live = Serving::run(folder.path(), &args);
    // The first part of the replay is served once it is full, long before the end of the run.
    let until = Instant::now() + Duration::from_secs(60);
    while live.get("/replay/overview/0").0 != 200 {
        assert!(Instant::now() < until, "the run makes no progress");
    }
    let (status, errors) = live.interrupt();
    assert_eq!(status, Some(1), "{errors}");
    assert!(errors.contains("interrupted; the run up to "), "{errors}");
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["live.partial"]);
    let kept = Serving::view(folder.path(), &["view", "live.partial"]);
    assert_eq!(kept.outcome()["unfinished"], true);
    let (status, errors) = kept.interrupt();
    assert_eq!(status, Some(0));
    assert!(errors.contains("note: this run is unfinished: it covers "), "{errors}");
}

#[test]
fn invalid_view_arguments_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("empty")).unwrap();
    fs::create_dir(folder.path().join("half.partial")).unwrap();
    fs::write(folder.path().join("other.html"), "<!DOCTYPE html>").unwrap();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = taken.local_addr().unwrap().to_string();
    for (args, status, expected) in [
        (&["view", "empty"][..], 2, "empty"),
        (&["view", "no/such"], 2, "no/such: no results folder, scenario file or built-in scenario"),
        (&["view", "no/such-1+guidance.lead_s=0"], 2, "such-1+guidance.lead_s=0: no results folder, scenario file"),
        (&["view", "no/fly.html"], 2, "no/fly.html: cannot be read"),
        (&["view", "other.html"], 2, "other.html: it is not a page that flies missions"),
        (&["view", "other.html", "--seed", "3"], 2, "it has its own controls"),
        (&["view", "half/"], 2, "an unfinished run is in half.partial"),
        (&["view", "--listen", "nowhere"], 2, "--listen"),
        (&["view", "--listen", &taken], 1, &taken),
        (&["run", "tour/02-two-uavs", "--view", "--speed", "0"], 2, "between 0.01 and 10000"),
        (&["run", "tour/02-two-uavs", "--speed", "2"], 2, "--view"),
        (&["run", "tour/02-two-uavs", "--listen", "127.0.0.1:0"], 2, "add --view"),
        (&["view", "empty", "--seed", "3"], 2, "apply to scenarios"),
    ] {
        let output = start(folder.path(), args).wait_with_output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{args:?}: {message}");
        assert!(message.contains(expected) && !message.contains("panicked"), "{args:?}: {message}");
    }
}
