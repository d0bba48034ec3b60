//! End-to-end tests of `standoff reproduce`: every study runs, the page is deterministic, and wrong usage is refused.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Output;

use crate::common::{standoff, text};

const OF_CLAIMS: [&str; 8] =
    ["table-2", "figure-6", "figure-7", "figure-8", "figure-9", "figure-10", "figure-11", "errata"];
const BEYOND: [&str; 3] = ["improvements", "coverage", "wind"];

fn reproduce(folder: &Path, threads: &str, args: &[&str]) -> Output {
    standoff(folder, &[&["reproduce", "--threads", threads], args].concat())
}

/// Returns all files in a folder and its subfolders, by relative path.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() {
            found.extend(files(&entry.path()).into_iter().map(|(path, bytes)| (format!("{name}/{path}"), bytes)));
        } else {
            found.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    found
}

/// Reproduces with two runs of each scenario; returns the files and the standard output.
fn with_two_runs(threads: &str, args: &[&str]) -> (BTreeMap<String, Vec<u8>>, String) {
    let folder = tempfile::tempdir().unwrap();
    let output = reproduce(folder.path(), threads, &[&["--runs", "2", "--out", "out"], args].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    (files(folder.path()), text(&output.stdout))
}

#[test]
fn every_study_runs_and_none_depends_on_the_number_of_threads() {
    let (written, printed) = with_two_runs("3", &[]);
    // The study of coverage takes most of the time, and flies its runs as the others do.
    for study in OF_CLAIMS.into_iter().chain(BEYOND).filter(|study| *study != "coverage") {
        let (one, _) = with_two_runs("1", &[study]);
        assert!(one.contains_key(&format!("out/{study}.json")), "{study}: {:?}", one.keys());
        for (path, bytes) in one {
            assert!(bytes == written[&path], "{path} differs between one and three threads");
        }
        assert!(study == "errata" || written.contains_key(&format!("out/{study}.csv")), "{study} has no data");
    }
    for (path, bytes) in &written {
        assert!(!path.ends_with(".svg") || bytes.len() < 100_000, "{path} has {} bytes", bytes.len());
    }
    assert!(printed.lines().all(|line| line.chars().count() <= 100), "{printed}");
    let (_, summary) = printed.split_once("\nSummary\n").unwrap();
    assert!(summary.contains("  Table II: tracking one group") && summary.contains("  total "));
    assert!(summary.contains(" of these verdicts are weak: they come from fewer than 30 runs"), "{summary}");
}

#[test]
fn the_page_has_every_claim_and_nothing_else_is_measured_for_it() {
    let page_args = ["--page", "docs/user/page.md"];
    let (written, _) = with_two_runs("3", &page_args);
    assert!(written == with_two_runs("1", &page_args).0, "the files differ between one and three threads");
    let page = text(&written["docs/user/page.md"]);
    for study in OF_CLAIMS {
        let claims: serde_json::Value = serde_json::from_slice(&written[&format!("out/{study}.json")]).unwrap();
        for claim in claims.as_array().unwrap() {
            let what = claim["what"].as_str().unwrap().replace('|', "\\|");
            assert!(page.contains(&what), "{study}: {what} is not on the page");
        }
        assert!(page.contains(&format!("Command: `standoff reproduce {study} --runs 2`.")), "{study}");
    }
    let is_beyond = |path: &String| BEYOND.iter().chain(&["overconfident"]).any(|study| path.contains(study));
    assert_eq!(written.keys().find(|path| is_beyond(path)), None);
    let pictures: Vec<&str> = page.split("](").filter_map(|part| part.split_once(".svg)")).map(|part| part.0).collect();
    assert!(pictures.len() > 10, "{pictures:?}");
    for picture in pictures {
        assert!(written.contains_key(&format!("docs/user/{picture}.svg")), "{picture}");
    }
}

#[test]
fn one_study_prints_the_papers_number_ours_and_a_verdict() {
    let folder = tempfile::tempdir().unwrap();
    let output = reproduce(folder.path(), "2", &["figure-7"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let printed = text(&output.stdout);
    let claim = printed.lines().skip_while(|line| !line.contains("sigma_scale 0.01"));
    let [claim, numbers, reason] = claim.take(3).collect::<Vec<_>>()[..] else { panic!("{printed}") };
    assert!(claim.starts_with("  not reproduced  "), "{claim}");
    assert!(numbers.contains("paper 90.00 deg (± 10.00 deg); ours "), "{numbers}");
    assert!(reason.contains("the lower end of the tolerance"), "{reason}");
    let csv = text(&files(folder.path())["standoff-out/reproduce/figure-7.csv"]);
    let again = reproduce(folder.path(), "2", &["figure-7"]);
    let note = "note: replacing older results in standoff-out/reproduce\n";
    assert_eq!(text(&again.stderr), note.to_owned() + &text(&output.stderr));
    assert!(!text(&reproduce(folder.path(), "2", &["figure-6"]).stderr).contains("replacing"));
    assert!(
        csv.starts_with("sigma_scale,target_m,optimal_phase_difference_deg,eta_over_eta_at_90_deg\n0.01,0,90,1\n"),
        "{csv}"
    );
}

#[test]
fn another_seed_gives_other_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let table = |seed: &str| {
        let output = reproduce(folder.path(), "2", &["table-2", "--runs", "2", "--seed", seed]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&files(folder.path())["standoff-out/reproduce/table-2.csv"])
    };
    let (first, second) = (table("1"), table("2"));
    // The second run from seed 1 is the first run from seed 2.
    assert_eq!(first.lines().nth(2), second.lines().nth(1));
    assert_ne!(first, second);
}

#[test]
fn wrong_usage_is_refused_with_status_2_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "mine").unwrap();
    for (args, expected) in [
        (&["--runs", "0"][..], "0 is not in 2..=1000000"),
        (&["--runs", "1"], "1 is not in 2..=1000000"),
        (&["--runs", "many"], "--runs \"many\": must be a whole number"),
        (
            &["table-3"],
            "[possible values: table-2, figure-6, figure-7, figure-8, figure-9, figure-10, figure-11, errata, improvements, coverage, wind]",
        ),
        (&["table-2", "--page", "page.md"], "cannot be used with"),
        (&["--traffic", "file", "--page", "page.md"], "cannot be used with"),
        (&["figure-6", "--out", "file"], "file: not a folder"),
    ] {
        let output = reproduce(folder.path(), "2", args);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(message.contains(expected), "{args:?}: {message}");
    }
    assert_eq!(files(folder.path()).keys().collect::<Vec<_>>(), ["file"]);
}
