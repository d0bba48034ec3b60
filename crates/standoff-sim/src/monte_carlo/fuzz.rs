//! Fuzz targets (`bolero`) for the journal and the results of a batch. See [`crate::fuzz_harness`].

use standoff_score::MetricSelection;
use std::fs;
use std::sync::atomic::AtomicBool;

use super::batch::Values;
use super::journal::Journal;
use super::journal::tests::{read_journal, sealed};
use super::{Batch, Results, results};
use crate::fuzz_harness::{JSON, put, refused, run};
use crate::scenario::{Overrides, ScenarioTemplate};

fn batch() -> Batch {
    let template = ScenarioTemplate::load("tour/01-one-uav", &Overrides::default()).unwrap();
    Batch::new(&template, 1, 3, None, MetricSelection::parse("anees,position_error_m").unwrap()).unwrap()
}

fn values() -> Vec<Values> {
    vec![vec![Some(1.0), None], vec![Some(-2.5), Some(0.0)], vec![None, Some(1e99)]]
}

fn are_finite(values: &[Option<f64>]) -> bool {
    values.iter().flatten().all(|value| value.is_finite())
}

#[test]
fn any_journal_is_accepted_or_refused() {
    let home = tempfile::tempdir().unwrap();
    let batch = batch();
    let mut journal = Journal::open(home.path(), &batch).unwrap();
    values().iter().zip(0..).for_each(|(values, run)| journal.put(0, run, values).unwrap());
    drop(journal);
    let path = home.path().join("monte-carlo.journal");
    let good = fs::read(&path).unwrap();
    let json = serde_json::to_vec(&batch).unwrap();
    let slots = good[good.len() - 3 * 28..].to_vec();
    run("journal", 0.05, |choices| {
        let bytes = if choices.below(2) == 0 {
            choices.damaged(good.clone())
        } else {
            // Valid checksums with invalid contents.
            sealed(&choices.mutated(std::slice::from_ref(&json), &JSON), &choices.damaged(slots.clone()))
        };
        put(&path, bytes);
        match read_journal(&path) {
            Ok(None) => false,
            Ok(Some((batch, rows))) => {
                assert!(batch.check().is_ok());
                rows.take(10).for_each(|row| assert!(row.unwrap().1.is_none_or(|values| are_finite(&values))));
                true
            }
            Err(error) => refused(&error),
        }
    });
}

#[test]
fn any_results_are_read_or_refused() {
    let home = tempfile::tempdir().unwrap();
    results::write(home.path(), &batch(), values().into_iter().map(Ok), &AtomicBool::new(false)).unwrap();
    let (manifest, table) = (home.path().join("monte-carlo.json"), home.path().join("runs.parquet"));
    let good_manifest = fs::read(&manifest).unwrap();
    let good_table = fs::read(&table).unwrap();
    let sealed = |crc: u32| {
        let text = String::from_utf8_lossy(&good_manifest).into_owned();
        text.replace(&crc32fast::hash(&good_table).to_string(), &crc.to_string())
    };
    run("results", 0.05, |choices| {
        if choices.below(2) == 0 {
            put(&manifest, choices.mutated(std::slice::from_ref(&good_manifest), &JSON));
            put(&table, &good_table);
        } else {
            let bytes = choices.damaged(good_table.clone());
            put(&manifest, sealed(crc32fast::hash(&bytes)));
            put(&table, bytes);
        }
        let read = |results: Results| {
            let runs = results.runs()?;
            for metric in results.batch().metrics() {
                assert!(are_finite(&runs.column(metric)?));
            }
            results.settings().map(drop)
        };
        Results::open(home.path()).and_then(read).map_or_else(|error| refused(&error), |()| true)
    });
}
