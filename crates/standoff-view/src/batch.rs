//! Monte Carlo results to look at: one batch of runs, or several that are compared with the first of them.
//!
//! The page gets it all as one JSON object ([`Batch::json`]), in the units of `runs.parquet`.

mod histogram;
mod metric;
mod variant;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use standoff_sim::monte_carlo::{Comparison, MonteCarloError, Results, compare_results};

use histogram::Histogram;
use metric::Metric;
use variant::Variant;

/// Format of the JSON; it rises when that changes.
const FORMAT: u32 = 1;

/// Most values, over all runs, metrics and batches, with which the page still holds every one of them: some 2 MB of it.
const VALUES: u64 = 200_000;

/// What the page shows of one batch, or of several.
#[derive(Debug, Clone, Serialize)]
pub struct Batch {
    format: u32,
    metrics: Vec<Metric>,
    variants: Vec<Variant>,
    /// Each further batch with the first, where they have seeds and metrics in common.
    comparisons: Vec<Option<Comparison>>,
}

impl Batch {
    /// Opens complete batches; there must be at least one. The further ones are compared with the first.
    pub fn open(dirs: &[&Path]) -> Result<Self, MonteCarloError> {
        let results = dirs.iter().map(|dir| Results::open(dir)).collect::<Result<Vec<_>, _>>()?;
        Self::of(&results)
    }

    /// Of batches that are open.
    pub fn of(results: &[Results]) -> Result<Self, MonteCarloError> {
        Self::holding(VALUES, results)
    }

    /// The same, with every value only if there are at most so many.
    fn holding(most: u64, results: &[Results]) -> Result<Self, MonteCarloError> {
        let runs = results.iter().map(Results::runs).collect::<Result<Vec<_>, _>>()?;
        let variants = results.iter().zip(&runs).map(|(results, runs)| Variant::of(results, runs));
        let mut variants = variants.collect::<Result<Vec<_>, _>>()?;
        variant::tell_apart(&mut variants);
        let values: u64 = variants.iter().map(Variant::size).sum();
        let mut names: Vec<&str> = Vec::new();
        for name in results.iter().flat_map(|results| results.batch().metrics()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let mut metrics = Vec::new();
        for name in names {
            // One metric at a time: of a large batch, memory never holds more.
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
            // A page tells what was flown, not where it lies.
            if let Some(Comparison { a, b, .. }) = comparison {
                (*a, *b) = (variants[0].name.clone(), variant.name.clone());
            }
        }
        Ok(Self { format: FORMAT, metrics, variants, comparisons })
    }

    /// As JSON.
    pub fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }
}

#[cfg(test)]
mod tests;
