use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde_json::Value;
use standoff_score::MetricSelection;
use standoff_sim::monte_carlo::{Batch as Flown, Results, Shard, compare_results, fly_all, fly_into};
use standoff_sim::scenario::ScenarioTemplate;
use tempfile::TempDir;

use super::Batch;
use crate::common::overrides;
use crate::page;

fn template(scenario: &str, set: &[&str]) -> ScenarioTemplate {
    ScenarioTemplate::load(scenario, &overrides(&[&["duration_s=40"], set].concat())).unwrap()
}

fn fly(dir: &Path, template: &ScenarioTemplate, seed: u64, runs: u64, shard: Option<Shard>) -> Results {
    let batch = Flown::new(template, seed, runs, shard, MetricSelection::standard()).unwrap();
    fly_into(dir, template, &batch, None, &AtomicBool::new(false), |_| ()).unwrap()
}

/// Six runs of a pair with lead, from seed 5 on, and six without lead, from seed 7 on.
fn two() -> (TempDir, [Results; 2]) {
    let folder = tempfile::tempdir().unwrap();
    let with = template("paper/table-2-pair", &[]);
    let without = template("paper/table-2-pair", &["guidance.lead_s=0"]);
    let a = fly(&folder.path().join("a"), &with, 5, 6, None);
    let b = fly(&folder.path().join("b"), &without, 7, 6, None);
    (folder, [a, b])
}

fn json(batch: &Batch) -> Value {
    serde_json::from_str(&batch.json().unwrap()).unwrap()
}

#[test]
fn the_page_contains_every_value_of_every_run_exactly() {
    let (_folder, [a, b]) = two();
    let batch = Batch::of(&[a, b]).unwrap();
    for (variant, first, set) in [(0, 5, &[][..]), (1, 7, &["guidance.lead_s=0"])] {
        let flown =
            fly_all(&template("paper/table-2-pair", set), first..first + 6, MetricSelection::standard(), None).unwrap();
        assert_eq!(batch.variants[variant].values.len(), MetricSelection::standard().names().count());
        for (metric, values) in &batch.variants[variant].values {
            let bits = |value: Option<f64>| value.map(f64::to_bits);
            let expected: Vec<_> = flown.iter().map(|metrics| bits(metrics[metric])).collect();
            assert_eq!(values.iter().copied().map(bits).collect::<Vec<_>>(), expected, "{metric}");
        }
    }
}

#[test]
fn statistics_match_the_summary_and_comparisons_match_compare() {
    let (_folder, [a, b]) = two();
    let json = json(&Batch::of(&[a.clone(), b.clone()]).unwrap());
    for (variant, results) in json["variants"].as_array().unwrap().iter().zip([&a, &b]) {
        let summary: Value = serde_json::from_str(&results.summary().unwrap().json().unwrap()).unwrap();
        assert_eq!(variant["statistics"], summary["metrics"]);
    }
    let compared = compare_results(a.dir(), b.dir(), &AtomicBool::new(false)).unwrap();
    assert_eq!((compared.seed, compared.runs), (7, 4));
    let expected: Value = serde_json::from_str(&compared.json().unwrap()).unwrap();
    let shown = &json["comparisons"].as_array().unwrap()[0];
    assert_eq!(shown["metrics"], expected["metrics"]);
    assert_eq!(shown["b"], json["variants"][1]["name"]);
}

#[test]
fn smallest_and_largest_runs_are_listed_and_the_worse_end_is_marked() {
    let (_folder, [a, _]) = two();
    let separations = a.runs().unwrap().column("separation_min_m").unwrap();
    let batch = Batch::of(&[a]).unwrap();
    let mut runs: Vec<(u64, f64)> = (0..).zip(separations).map(|(run, value)| (run, value.unwrap())).collect();
    runs.sort_by(|(_, a), (_, b)| a.total_cmp(b));
    let ends = &batch.variants[0].ends["separation_min_m"];
    assert_eq!(ends.smallest, runs);
    runs.reverse();
    assert_eq!(ends.largest, runs);
    let json = json(&batch);
    let metric =
        |name: &str| json["metrics"].as_array().unwrap().iter().find(|metric| metric["name"] == name).unwrap().clone();
    assert_eq!(metric("separation_min_m")["bad"], "small");
    assert_eq!(metric("phase_error_deg")["bad"], "large");
    assert!(metric("anees")["bad"].is_null());
    // No run has removals: equal values are in run order.
    let removals = &batch.variants[0].ends["removals"].largest;
    assert_eq!(removals.iter().map(|(run, _)| *run).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
}

#[test]
fn a_large_batch_contains_only_counts_and_the_smallest_and_largest_runs() {
    let (_folder, [a, _]) = two();
    let batch = Batch::with_limit(10, &[a]).unwrap();
    assert!(batch.variants[0].values.is_empty());
    assert_eq!(batch.variants[0].ends["phase_error_deg"].largest.len(), 6);
    let json = json(&batch);
    let counts = json["metrics"][0]["histogram"]["counts"][0].as_array().unwrap();
    assert_eq!(counts.iter().filter_map(Value::as_u64).sum::<u64>(), 6);
}

#[test]
fn batches_are_named_by_their_differences() {
    let (folder, [a, b]) = two();
    let same = fly(&folder.path().join("c"), &template("paper/table-2-pair", &[]), 5, 2, None);
    let other = fly(&folder.path().join("d"), &template("paper/table-2-single", &[]), 5, 2, None);
    let names = |results: &[&Results]| {
        let results: Vec<Results> = results.iter().map(|results| (*results).clone()).collect();
        Batch::of(&results).unwrap().variants.iter().map(|variant| variant.name.clone()).collect::<Vec<_>>()
    };
    let set = ["paper/table-2-pair guidance.lead_s=3", "paper/table-2-pair guidance.lead_s=0"];
    assert_eq!(names(&[&a, &b]), set);
    assert_eq!(names(&[&a, &same]), ["paper/table-2-pair", "paper/table-2-pair (B)"]);
    assert_eq!(names(&[&a, &other]), ["paper/table-2-pair", "paper/table-2-single"]);
}

#[test]
fn run_indices_of_a_shard_are_those_of_the_whole_batch() {
    let folder = tempfile::tempdir().unwrap();
    let shard = Shard { index: 1, of: 2 };
    let half = fly(folder.path(), &template("paper/table-2-single", &[]), 1, 4, Some(shard));
    let batch = Batch::of(&[half]).unwrap();
    let variant = &json(&batch)["variants"][0];
    assert_eq!((&variant["first_run"], &variant["runs"], &variant["shard"]), (&2.into(), &2.into(), &"1/2".into()));
    let mut runs: Vec<u64> = batch.variants[0].ends["anees"].largest.iter().map(|(run, _)| *run).collect();
    runs.sort_unstable();
    assert_eq!(runs, [2, 3]);
}

#[test]
fn the_page_does_not_contain_the_path_of_the_results() {
    let (folder, [a, b]) = two();
    let batch = Batch::of(&[a, b]).unwrap();
    assert!(!batch.json().unwrap().contains(&folder.path().display().to_string()));
    let page = page::batch_report(&batch).unwrap();
    assert!(page.len() < 2_500_000, "{} bytes", page.len());
}
