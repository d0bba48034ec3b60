//! Data of the Monte Carlo page: one batch of runs, or several batches that are compared with the first one.
//!
//! The page receives one JSON object ([`Batch::json`]), in the units of `runs.parquet`.

mod batch_variant;
mod histogram;
mod metric;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use standoff_sim::monte_carlo::{Comparison, MonteCarloError, Results, compare_results};

use batch_variant::Variant;
use histogram::Histogram;
use metric::Metric;

/// Format number of the JSON; it increases with every change of the format.
const FORMAT: u32 = 1;

/// Maximum number of values, over all runs, metrics and batches, up to which the page contains all values (about 2 MB).
const VALUES: u64 = 200_000;

/// Page data of one or several batches.
#[derive(Debug, Clone, Serialize)]
pub struct Batch {
    format: u32,
    metrics: Vec<Metric>,
    variants: Vec<Variant>,
    /// Comparison of each further batch with the first one; `None` if they have no common seeds or metrics.
    comparisons: Vec<Option<Comparison>>,
}

impl Batch {
    /// Opens at least one complete batch. Further batches are compared with the first one.
    pub fn open(dirs: &[&Path]) -> Result<Self, MonteCarloError> {
        let results = dirs.iter().map(|dir| Results::open(dir)).collect::<Result<Vec<_>, _>>()?;
        Self::of(&results)
    }

    /// Makes the page data of open batches.
    pub fn of(results: &[Results]) -> Result<Self, MonteCarloError> {
        Self::with_limit(VALUES, results)
    }

    /// Makes the page data; it contains all values only if there are at most `most`.
    fn with_limit(most: u64, results: &[Results]) -> Result<Self, MonteCarloError> {
        let runs = results.iter().map(Results::runs).collect::<Result<Vec<_>, _>>()?;
        let variants = results.iter().zip(&runs).map(|(results, runs)| Variant::of(results, runs));
        let mut variants = variants.collect::<Result<Vec<_>, _>>()?;
        batch_variant::distinguish(&mut variants);
        let values: u64 = variants.iter().map(Variant::size).sum();
        let mut names: Vec<&str> = Vec::new();
        for name in results.iter().flat_map(|results| results.batch().metrics()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let mut metrics = Vec::new();
        for name in names {
            // Reads one metric at a time to limit memory use with large batches.
            let mut columns = Vec::new();
            for (runs, variant) in runs.iter().zip(&mut variants) {
                let column = if variant.has(name) { runs.column(name)? } else { Vec::new() };
                variant.take(name, &column, values <= most);
                columns.push(column);
            }
            metrics.push(Metric::of(name, Histogram::of(&columns)));
        }
        let never = AtomicBool::new(false);
        let compared = |other: &Results| compare_results(results[0].dir(), other.dir(), &never);
        let comparisons = results.iter().skip(1).map(|other| match compared(other) {
            Ok(comparison) => Ok(Some(comparison)),
            Err(MonteCarloError::NotComparable(_)) => Ok(None),
            Err(error) => Err(error),
        });
        let mut comparisons = comparisons.collect::<Result<Vec<_>, _>>()?;
        for (comparison, variant) in comparisons.iter_mut().zip(variants.iter().skip(1)) {
            // The page shows names of batches instead of their paths.
            if let Some(Comparison { a, b, .. }) = comparison {
                (*a, *b) = (variants[0].name.clone(), variant.name.clone());
            }
        }
        Ok(Self { format: FORMAT, metrics, variants, comparisons })
    }

    /// Serialises the page data to JSON.
    pub fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }
}

#[cfg(test)]
mod tests;
