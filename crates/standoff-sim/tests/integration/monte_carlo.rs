//! Batches of runs: the bytes do not depend on the number of threads, the number of shards, or interruptions.

use std::cell::Cell;
use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use standoff_score::{MetricSelection, Metrics};
use standoff_sim::monte_carlo::{
    Batch, Better, MonteCarloError, Results, Shard, Statistics, compare, compare_results, fly_all, fly_into, merge,
};
use standoff_sim::run::fly;
use standoff_sim::scenario::{Overrides, ScenarioTemplate};

/// Never set.
static NEVER: AtomicBool = AtomicBool::new(false);

/// Twenty seconds of the paper's pair, so that runs are short. Time out of view is not scored at the first time step,
/// so at the start it has no value.
fn pair(set: &[&str]) -> ScenarioTemplate {
    let set = [&["duration_s=20", "transient_s=5"], set].concat();
    ScenarioTemplate::load("paper/table-2-pair", &crate::common::overrides(&set)).unwrap()
}

fn choice() -> MetricSelection {
    MetricSelection::parse("table-2,handoffs,anees").unwrap()
}

fn batch(template: &ScenarioTemplate, runs: u64, shard: Option<(u64, u64)>) -> Batch {
    Batch::new(template, 5, runs, shard.map(|(index, of)| Shard { index, of }), choice()).unwrap()
}

fn threads(n: usize) -> Option<NonZeroUsize> {
    Some(NonZeroUsize::new(n).unwrap())
}

/// Flies a batch until `stop_after` runs are complete.
fn fly_until(
    dir: &Path,
    template: &ScenarioTemplate,
    batch: &Batch,
    n: usize,
    stop_after: u64,
) -> Result<Results, MonteCarloError> {
    let stop = AtomicBool::new(false);
    fly_into(dir, template, batch, threads(n), &stop, |progress| {
        stop.store(progress.done >= stop_after, Ordering::Relaxed)
    })
}

fn fly_whole(dir: &Path, template: &ScenarioTemplate, batch: &Batch, n: usize) -> Results {
    fly_until(dir, template, batch, n, u64::MAX).unwrap()
}

/// Names and bytes of all files in a folder.
fn files(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(dir)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    files
}

fn check_same(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&a), ["monte-carlo.json", "runs.parquet", "summary.json"]);
    assert_eq!(names(&a), names(&b));
    for ((name, a), (_, b)) in a.iter().zip(&b) {
        assert!(a == b, "{name} differs");
    }
}

/// Checks that the result is an error whose message contains all of `expected`.
fn check_refused<T>(result: Result<T, MonteCarloError>, expected: &[&str]) {
    let Err(error) = result else { panic!("not refused") };
    let message = error.to_string();
    for expected in expected {
        assert!(message.contains(expected), "{message}");
    }
    assert!(error.is_wrong_input(), "{message}");
}

#[test]
fn in_memory_runs_equal_single_runs_on_any_number_of_threads() {
    let bits = |rows: &[Metrics]| {
        rows.iter().map(|row| row.values().iter().map(|v| v.map(f64::to_bits)).collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    for set in [&[][..], &["priorities=[{priority=5, x_m=0, y_m=0, radius_m=300}]"]] {
        let template = pair(set);
        let one_by_one: Vec<_> =
            (3..16).map(|seed| fly(&template.draw(seed).unwrap(), MetricSelection::all()).unwrap()).collect();
        for n in [1, 2, 3, 40] {
            let rows = fly_all(&template, 3..16, MetricSelection::all(), threads(n)).unwrap();
            assert_eq!(bits(&rows), bits(&one_by_one), "{n} threads, {set:?}");
        }
    }
    assert!(fly_all(&pair(&[]), 3..3, MetricSelection::all(), None).unwrap().is_empty());
}

/// Also checks that the statistics are those of the rows.
#[test]
fn batch_bytes_do_not_depend_on_threads_shards_and_stops() {
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    let template = pair(&[]);
    let whole = batch(&template, 17, None);
    let results = fly_whole(&at("one"), &template, &whole, 1);
    for n in [2, 3] {
        fly_whole(&at(&format!("threads {n}")), &template, &whole, n);
        check_same(&at("one"), &at(&format!("threads {n}")));
    }
    for of in [1, 2, 5, 17] {
        let part = |index: u64| at(&format!("part {index} of {of}"));
        for index in 0..of {
            fly_whole(&part(index), &template, &batch(&template, 17, Some((index, of))), 2);
        }
        let parts: Vec<PathBuf> = (0..of).rev().map(part).collect();
        let merged = merge(&parts, &at(&format!("merged {of}")), &NEVER).unwrap();
        assert_eq!(merged.summary().unwrap(), results.summary().unwrap());
        check_same(&at("one"), &at(&format!("merged {of}")));
    }
    for stop_after in [1, 4, 9, 16] {
        let error = fly_until(&at("stopped"), &template, &whole, 2, stop_after).unwrap_err();
        assert!(matches!(error, MonteCarloError::Interrupted), "{error}");
    }
    fly_whole(&at("stopped"), &template, &whole, 3);
    check_same(&at("one"), &at("stopped"));

    let rows = fly_all(&template, 5..22, choice(), None).unwrap();
    let summary = results.summary().unwrap();
    assert_eq!((summary.seed, summary.runs, summary.metrics.len()), (5, 17, 8));
    for (name, statistics) in &summary.metrics {
        let values: Vec<_> = rows.iter().map(|row| row[name]).collect();
        assert_eq!(*statistics, Statistics::of(&values), "{name}");
        assert_eq!(statistics.n, 17);
    }
}

/// A stopped batch keeps its runs. Resuming it flies only the missing runs and reports the number of existing ones.
#[test]
fn complete_runs_are_not_flown_again() {
    let home = tempfile::tempdir().unwrap();
    let template = pair(&[]);
    let whole = batch(&template, 12, None);
    fly_until(home.path(), &template, &whole, 1, 5).unwrap_err();
    let (first, calls) = (Cell::new(None), Cell::new(0));
    let never = AtomicBool::new(false);
    let report = |progress| {
        calls.set(calls.get() + 1);
        first.set(first.get().or(Some(progress)));
    };
    fly_into(home.path(), &template, &whole, threads(1), &never, report).unwrap();
    let first = first.get().unwrap();
    assert!(first.before >= 5 && first.done == first.before && first.of == 12, "{first:?}");
    let called = calls.get();
    assert!(called >= 1 + 12 - first.before);
    fly_into(home.path(), &template, &whole, threads(1), &never, |_| calls.set(0)).unwrap();
    assert_eq!(calls.get(), called, "a complete batch was begun again");
}

/// Leftovers of a process that ended in its last steps are removed, and an invalid summary is rewritten, both when
/// flying and when merging.
#[test]
fn complete_batch_is_repaired() {
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    let template = pair(&[]);
    let (whole, parts) = (batch(&template, 4, None), [at("0"), at("1")]);
    for (index, part) in (0..).zip(&parts) {
        fly_whole(part, &template, &batch(&template, 4, Some((index, 2))), 1);
    }
    fly_whole(&at("undisturbed"), &template, &whole, 1);
    let _ = fly_until(&at("begun"), &template, &whole, 1, 1);
    let journal = fs::read(at("begun").join("monte-carlo.journal")).unwrap();
    let again: [&dyn Fn(); 2] =
        [&|| drop(fly_whole(&at("out"), &template, &whole, 1)), &|| drop(merge(&parts, &at("out"), &NEVER).unwrap())];
    again[0]();
    for again in again {
        for damage in [Some(&b"{}"[..]), Some(&[b' '; 100_000]), None] {
            match damage {
                Some(bytes) => fs::write(at("out").join("summary.json"), bytes).unwrap(),
                None => fs::remove_file(at("out").join("summary.json")).unwrap(),
            }
            fs::write(at("out").join("monte-carlo.journal"), &journal).unwrap();
            again();
            check_same(&at("undisturbed"), &at("out"));
        }
    }
}

/// The error for the same batch asks to wait for the other process. For a different batch, waiting is useless, so the
/// error names the difference.
#[test]
fn batch_in_progress_is_distinguished_from_a_different_one() {
    let home = tempfile::tempdir().unwrap();
    let template = pair(&[]);
    let (whole, other) = (batch(&template, 4, None), batch(&template, 5, None));
    let refused = |batch: &Batch| fly_until(home.path(), &template, batch, 1, u64::MAX).map(drop).unwrap_err();
    let (tries, never) = (Cell::new(0), AtomicBool::new(false));
    fly_into(home.path(), &template, &whole, threads(1), &never, |_| {
        if tries.replace(tries.get() + 1) == 0 {
            let error = refused(&whole);
            assert!(error.to_string().contains("another run is writing") && !error.is_wrong_input(), "{error}");
            let error = refused(&other);
            assert!(
                error.to_string().contains("contains a different batch: the number of runs is 4, not 5"),
                "{error}"
            );
            let error = Results::open(home.path()).map(drop).unwrap_err();
            assert!(error.to_string().contains("another run is writing") && !error.is_wrong_input(), "{error}");
        }
    })
    .unwrap();
    assert!(tries.get() > 0);
}

/// For each property of a batch: a different value is refused, the error names it, and no file changes.
#[test]
fn different_batch_is_refused_with_the_difference() {
    let home = tempfile::tempdir().unwrap();
    let (unfinished, complete) = (home.path().join("unfinished"), home.path().join("complete"));
    let template = pair(&[]);
    let first = batch(&template, 6, None);
    fly_until(&unfinished, &template, &first, 1, 2).unwrap_err();
    fly_whole(&complete, &template, &first, 1);
    let other_scenario = ScenarioTemplate::load("paper/table-2-single", &Overrides::default()).unwrap();
    let other_value = pair(&["guidance.lead_s=1"]);
    let new = |template, seed, runs, shard, list| {
        Batch::new(template, seed, runs, shard, MetricSelection::parse(list).unwrap())
    };
    let list = "table-2,handoffs,anees";
    for dir in [&unfinished, &complete] {
        let before = files(dir);
        for (template, other, expected) in [
            (
                &other_scenario,
                new(&other_scenario, 5, 6, None, list),
                "the scenario is paper/table-2-pair, not paper/table-2-single",
            ),
            (
                &other_value,
                new(&other_value, 5, 6, None, list),
                "its scenario contains [guidance] lead_s = 3 instead of [guidance] lead_s = 1",
            ),
            (&template, new(&template, 6, 6, None, list), "the first seed is 5, not 6"),
            (&template, new(&template, 5, 7, None, list), "the number of runs is 6, not 7"),
            (&template, new(&template, 5, 6, Some(Shard { index: 0, of: 2 }), list), "the shard is none, not 0/2"),
            (&template, new(&template, 5, 6, None, "table-2,handoffs"), "it has additional metrics: anees"),
            (&template, new(&template, 5, 6, None, "all"), "it lacks the metrics custody_fraction"),
        ] {
            check_refused(
                fly_until(dir, template, &other.unwrap(), 1, u64::MAX),
                &["contains a different batch", expected],
            );
            assert_eq!(files(dir), before);
        }
    }
}

/// Same name and settings, but another road.
#[test]
fn different_traffic_with_the_same_name_is_a_different_batch() {
    let home = tempfile::tempdir().unwrap();
    let file = home.path().join("road.csv");
    let load = |y: f64| {
        let rows: String = (0..30).map(|t| format!("{t},a,{},{y}\n", 10 * t)).collect();
        fs::write(&file, format!("t,id,x,y\n{rows}")).unwrap();
        let overrides = Overrides { traffic: vec![file.clone()], ..Overrides::default() };
        ScenarioTemplate::load("traffic/convoy", &overrides).unwrap()
    };
    let dir = home.path().join("out");
    let (here, there) = (load(0.0), load(0.5));
    fly_whole(&dir, &here, &batch(&here, 2, None), 1);
    check_refused(fly_until(&dir, &there, &batch(&there, 2, None), 1, 9), &["the checksum of its traffic is"]);
    let again = load(0.0);
    fly_whole(&dir, &again, &batch(&again, 2, None), 1);
}

/// Journal of a program of the same version that computes different results: here, its first run was flown with another
/// scenario.
#[test]
fn runs_of_another_build_are_refused() {
    let home = tempfile::tempdir().unwrap();
    let template = pair(&[]);
    let whole = batch(&template, 6, None);
    fly_until(home.path(), &pair(&["guidance.radial_gain=0.5"]), &whole, 1, 2).unwrap_err();
    let before = files(home.path());
    check_refused(fly_until(home.path(), &template, &whole, 1, 9), &["a repeat of seed 5 gives different results"]);
    assert_eq!(files(home.path()), before);
}

#[test]
fn invalid_batches_are_refused() {
    let template = pair(&[]);
    let new = |seed, runs, index, of| Batch::new(&template, seed, runs, Some(Shard { index, of }), choice());
    check_refused(new(1, 0, 0, 1), &["number of runs is 0", "at least 1"]);
    check_refused(new(u64::MAX, 2, 0, 1), &["seed 18446744073709551615 and 2 runs", "9223372036854775807"]);
    check_refused(new(i64::MAX as u64, 2, 0, 1), &["the last seed must be at most"]);
    assert!(new(i64::MAX as u64, 1, 0, 1).is_ok());
    for (index, of) in [(2, 2), (0, 0), (0, 4)] {
        check_refused(new(1, 3, index, of), &[&format!("shard {index}/{of} of 3 runs"), "at least one run for each"]);
    }
}

#[test]
fn folder_with_other_contents_is_not_touched() {
    let home = tempfile::tempdir().unwrap();
    fs::write(home.path().join("thesis.tex"), "x").unwrap();
    let template = pair(&[]);
    let refused = "something other than a run of standoff";
    check_refused(fly_until(home.path(), &template, &batch(&template, 2, None), 1, 9), &[refused]);
    check_refused(fly_until(&home.path().join("thesis.tex"), &template, &batch(&template, 2, None), 1, 9), &[refused]);
    assert_eq!(files(home.path()), [("thesis.tex".to_owned(), b"x".to_vec())]);
}

/// A random radius that is too large for some seeds: the error names the seed, and the runs before it are kept.
#[test]
fn invalid_seed_is_reported_and_the_other_runs_are_kept() {
    let home = tempfile::tempdir().unwrap();
    let template = pair(&["orbit.radius_min_m={ uniform = { min = 300.0, max = 750.0 } }"]);
    let bad = (5..25).find(|seed| template.draw(*seed).is_err()).unwrap();
    assert!(bad > 5, "the first seed must be valid for this test");
    let whole = batch(&template, 20, None);
    for _ in 0..2 {
        let fly = fly_until(home.path(), &template, &whole, 1, u64::MAX);
        check_refused(fly, &[&format!("seed {bad}: "), "not smaller than radius_min_m"]);
    }
    let (kept, stop) = (Cell::new(0), AtomicBool::new(false));
    let _ = fly_into(home.path(), &template, &whole, threads(1), &stop, |progress| {
        kept.set(progress.done);
        stop.store(true, Ordering::Relaxed);
    });
    assert_eq!(kept.get(), bad - 5);
    for n in [1, 2, 5, 20] {
        check_refused(fly_all(&template, 5..25, choice(), threads(n)), &[&format!("seed {bad}: ")]);
    }
    // No memory is allocated for a hundred million runs before they are flown.
    check_refused(
        compare(&template, &template, 5, 100_000_000, choice(), threads(2), &NEVER),
        &[&format!("seed {bad}: ")],
    );
}

/// Serialised batch for another machine.
#[test]
fn batch_is_serialised_and_that_of_another_version_is_refused() {
    let whole = batch(&pair(&[]), 6, None);
    let json = whole.json().unwrap();
    assert_eq!(Batch::from_json(&json).unwrap(), whole);
    let part = Shard { index: 1, of: 3 };
    assert_eq!(whole.part(part).unwrap(), batch(&pair(&[]), 6, Some((1, 3))));
    check_refused(whole.part(Shard { index: 7, of: 7 }), &["shard 7/7 of 6 runs", "at least one run"]);
    let version = env!("CARGO_PKG_VERSION");
    let other = json.replace(&format!("\"version\":\"{version}\""), "\"version\":\"0.0.9\"");
    check_refused(Batch::from_json(&other), &["from standoff 0.0.9", &format!("this is {version}")]);
    check_refused(Batch::from_json(&json[..99]), &["batch JSON: "]);
    check_refused(Batch::from_json(&json.replace("\"runs\":6", "\"runs\":0")), &["the number of runs is 0"]);
}

#[test]
fn stopped_comparison_and_merge_give_no_results() {
    let home = tempfile::tempdir().unwrap();
    let (template, out) = (pair(&[]), home.path().join("out"));
    let parts = [0, 1].map(|index| home.path().join(index.to_string()));
    for (index, dir) in (0..).zip(&parts) {
        fly_whole(dir, &template, &batch(&template, 4, Some((index, 2))), 1);
    }
    let stop = AtomicBool::new(true);
    let stopped = |error| matches!(error, MonteCarloError::Interrupted);
    assert!(stopped(compare(&template, &template, 5, 9, choice(), threads(1), &stop).unwrap_err()));
    assert!(stopped(compare_results(&parts[0], &parts[0], &stop).unwrap_err()));
    assert!(stopped(merge(&parts, &out, &stop).unwrap_err()));
    assert!(!out.join("runs.parquet").exists());
    merge(&parts, &out, &NEVER).unwrap();
}

/// If the last files cannot be written, the runs stay in the journal.
#[test]
fn unwritable_results_lose_no_runs() {
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    let template = pair(&[]);
    let whole = batch(&template, 6, None);
    fly_whole(&at("undisturbed"), &template, &whole, 1);
    for name in ["runs.parquet.partial", "summary.json.partial", "monte-carlo.json.partial"] {
        // Creates the journal first, because it requires an empty folder.
        let _ = fly_until(&at(name), &template, &whole, 1, 1);
        fs::create_dir(at(name).join(name)).unwrap();
        let error = fly_until(&at(name), &template, &whole, 1, u64::MAX).unwrap_err();
        assert!(error.to_string().contains("cannot write") && !error.is_wrong_input(), "{error}");
        fs::remove_dir(at(name).join(name)).unwrap();
        let done = Cell::new(0);
        fly_into(&at(name), &template, &whole, None, &AtomicBool::new(false), |now| done.set(now.before)).unwrap();
        assert_eq!(done.get(), 6, "{name}: runs were flown again");
        check_same(&at("undisturbed"), &at(name));
    }
}

/// A long active run does not delay a stop: it has 1,000,000 s, and 1,000 s of flight take seconds to compute.
#[test]
fn stop_does_not_wait_for_active_runs() {
    let home = tempfile::tempdir().unwrap();
    let template = pair(&["duration_s=1000000"]);
    let stop = AtomicBool::new(false);
    let began = Instant::now();
    let report = |_| stop.store(began.elapsed() > Duration::from_millis(200), Ordering::Relaxed);
    let flown = fly_into(home.path(), &template, &batch(&template, 4, None), threads(2), &stop, report);
    assert!(matches!(flown, Err(MonteCarloError::Interrupted)));
    assert!(began.elapsed() < Duration::from_secs(2), "{:?}", began.elapsed());
}

#[test]
fn merge_needs_every_shard_of_one_batch_exactly_once() {
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    let template = pair(&[]);
    for index in 0..3 {
        fly_whole(&at(&index.to_string()), &template, &batch(&template, 6, Some((index, 3))), 1);
    }
    fly_whole(&at("whole"), &template, &batch(&template, 6, None), 1);
    fly_whole(&at("half"), &template, &batch(&template, 6, Some((1, 2))), 1);
    fly_whole(&at("longer"), &template, &batch(&template, 7, Some((1, 3))), 1);
    let other = pair(&["guidance.lead_s=1"]);
    fly_whole(&at("other"), &other, &batch(&other, 6, Some((1, 3))), 1);
    fly_until(&at("unfinished"), &template, &batch(&template, 6, Some((1, 3))), 1, 1).unwrap_err();
    fs::create_dir(at("empty")).unwrap();

    let merge = |names: &[&str]| merge(&names.iter().map(|name| at(name)).collect::<Vec<_>>(), &at("out"), &NEVER);
    check_refused(merge(&[]), &["no folder is given"]);
    check_refused(merge(&["0", "2"]), &["missing: shard 1/3"]);
    check_refused(merge(&["1"]), &["missing: shard 0/3, 2/3"]);
    check_refused(merge(&["0", "1", "2", "1"]), &["are both shard 1/3"]);
    check_refused(merge(&["0", "half", "2"]), &["is shard 1/2", "is shard 0/3"]);
    check_refused(merge(&["0", "whole", "2"]), &["whole contains a whole batch"]);
    check_refused(merge(&["0", "longer", "2"]), &["longer", "the number of runs is 7, not 6"]);
    check_refused(merge(&["0", "other", "2"]), &["other", "lead_s = 1 instead of [guidance] lead_s = 3"]);
    check_refused(merge(&["0", "unfinished", "2"]), &["unfinished: its batch is not complete"]);
    check_refused(merge(&["0", "empty", "2"]), &["empty: contains no results"]);
    check_refused(merge(&["0", "nowhere", "2"]), &["nowhere: contains no results"]);
    assert!(!at("out").exists());
    merge(&["0", "1", "2"]).unwrap();
    check_same(&at("out"), &at("whole"));
    merge(&["2", "0", "1"]).unwrap();
}

#[test]
#[cfg(unix)]
fn table_of_runs_is_opened_once_for_any_number_of_metrics() {
    let home = tempfile::tempdir().unwrap();
    let template = pair(&[]);
    let results = fly_whole(home.path(), &template, &batch(&template, 3, None), 1);
    let (summary, runs) = (results.summary().unwrap(), results.runs().unwrap());
    fs::remove_file(home.path().join("runs.parquet")).unwrap();
    assert_eq!(runs.summary().unwrap(), summary);
    assert_eq!(runs.column("anees").unwrap().len(), 3);
    assert!(results.runs().is_err());
}

/// No changed byte of a result goes unnoticed, whether in a row or in the description of the batch.
#[test]
fn changed_results_are_refused() {
    let home = tempfile::tempdir().unwrap();
    let template = pair(&[]);
    fly_whole(home.path(), &template, &batch(&template, 3, None), 1);
    let path = home.path().join("runs.parquet");
    let good = fs::read(&path).unwrap();
    for at in (0..good.len()).step_by(97) {
        let mut changed = good.clone();
        changed[at] ^= 0x10;
        fs::write(&path, &changed).unwrap();
        check_refused(Results::open(home.path()), &["runs.parquet is damaged", "changed since it was written"]);
    }
    fs::write(&path, &good[..good.len() - 1]).unwrap();
    check_refused(Results::open(home.path()), &["runs.parquet is damaged"]);
    fs::write(&path, &good).unwrap();
    let manifest = home.path().join("monte-carlo.json");
    let text = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, text.replace("\"seed\": 5", "\"seed\": 6")).unwrap();
    check_refused(Results::open(home.path()).unwrap().summary(), &["the row of run 0 with seed 6 is out of order"]);
    fs::write(&manifest, text.replace("\"format\": 2", "\"format\": 3")).unwrap();
    check_refused(Results::open(home.path()), &["monte-carlo.json has format 3"]);
    fs::write(&manifest, text.replace("\"seed\": 5", "\"seed\": 5,\n\"seed\": 5")).unwrap();
    check_refused(Results::open(home.path()), &["monte-carlo.json is damaged", "duplicate field `seed` at line 6"]);
    let long = format!("\"scenario\": \"{}", "x".repeat(1000));
    fs::write(&manifest, text.replace("\"scenario\": \"", &long)).unwrap();
    check_refused(Results::open(home.path()), &["monte-carlo.json is damaged", "characters; at most 1000"]);
    fs::write(&manifest, &text[..50]).unwrap();
    check_refused(Results::open(home.path()), &["monte-carlo.json is damaged"]);
}

/// With twice the noise, estimates are worse in every run. The same scenario twice gives no differences.
#[test]
fn comparison_uses_the_same_draws() {
    let (fine, coarse) = (pair(&[]), pair(&["sensor.range_sd_m=20", "sensor.bearing_sd_deg=6"]));
    let of = |comparison: &standoff_sim::monte_carlo::Comparison, metric: &str| {
        comparison.metrics.iter().find(|(name, _)| name == metric).unwrap().1
    };
    let same = compare(&fine, &fine, 1, 10, MetricSelection::all(), threads(2), &NEVER).unwrap();
    for (name, paired) in &same.metrics {
        assert!(paired.difference.is_none_or(|difference| difference == 0.0), "{name}");
        assert!(!paired.differs, "{name}");
    }
    let comparison = compare(&fine, &coarse, 1, 10, MetricSelection::all(), threads(2), &NEVER).unwrap();
    assert_eq!(comparison, compare(&fine, &coarse, 1, 10, MetricSelection::all(), threads(1), &NEVER).unwrap());
    let position = of(&comparison, "position_error_m");
    assert_eq!((position.n, position.differs, position.better), (10, true, Some(Better::A)));
    assert_eq!(position.b_smaller, Some(0.0));
    let a = Statistics::of(
        &fly_all(&fine, 1..11, MetricSelection::all(), None)
            .unwrap()
            .iter()
            .map(|row| row["position_error_m"])
            .collect::<Vec<_>>(),
    );
    assert_eq!(position.mean_a, a.mean);

    // Two batches that have seeds 5 to 8 in common.
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    fly_whole(&at("a"), &fine, &batch(&fine, 4, None), 1);
    let later =
        Batch::new(&coarse, 3, 10, None, MetricSelection::parse("position_error_m,anees,removals").unwrap()).unwrap();
    fly_whole(&at("b"), &coarse, &later, 1);
    let of_folders = compare_results(&at("a"), &at("b"), &NEVER).unwrap();
    assert_eq!((of_folders.seed, of_folders.runs), (5, 4));
    let names: Vec<_> = of_folders.metrics.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["position_error_m", "anees"]);
    let flown = compare(&fine, &coarse, 5, 4, MetricSelection::all(), None, &NEVER).unwrap();
    assert_eq!(of(&of_folders, "position_error_m"), of(&flown, "position_error_m"));
    let far = Batch::new(&fine, 100, 2, None, choice()).unwrap();
    fly_whole(&at("far"), &fine, &far, 1);
    check_refused(compare_results(&at("a"), &at("far"), &NEVER), &["no seed or no metric in common"]);
    check_refused(compare(&fine, &fine, 1, 0, MetricSelection::all(), None, &NEVER), &["number of runs is 0"]);
}
