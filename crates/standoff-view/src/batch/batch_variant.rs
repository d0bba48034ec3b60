//! One of the batches that the page shows.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use standoff_sim::monte_carlo::{MonteCarloError, Results, Runs, Settings, Statistics};

/// Maximum number of runs listed at each end of a metric.
const MAX_LISTED_RUNS: usize = 50;

/// Maximum number of settings in a name.
const MAX_SETTINGS_IN_NAME: usize = 3;

/// A batch: its scenario and its results.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Variant {
    /// Name that distinguishes it from the other batches.
    pub(super) name: String,
    scenario: String,
    version: String,
    /// Seed of run 0 of the whole batch, as text because JavaScript numbers have only 53 bits.
    seed: String,
    /// Index of the first run of the batch or shard.
    first_run: u64,
    /// Number of runs of the batch or shard.
    runs: u64,
    /// Shard of the batch, such as `0/2`; `None` for a whole batch.
    shard: Option<String>,
    /// Settings that differ between the batches, by key; keys that this batch does not have are absent.
    settings: Settings,
    /// Arguments of `--set` that turn the built-in scenario of this name into the one of the batch; `None` if only the
    /// full scenario text can do that.
    changes: Option<Vec<String>>,
    /// The scenario as TOML.
    toml: String,
    /// True if the scenario also needs a traffic file.
    has_traffic: bool,
    /// Statistics by metric.
    statistics: BTreeMap<String, Statistics>,
    /// Values by metric, one per run in order. Empty if there are too many for a page.
    pub(super) values: BTreeMap<String, Vec<Option<f64>>>,
    /// Runs with the smallest and with the largest values, by metric.
    pub(super) ends: BTreeMap<String, Ends>,
}

/// Runs with the most extreme values of a metric, as (index of the run, value). Equal values are in run order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Ends {
    pub(super) smallest: Vec<(u64, f64)>,
    pub(super) largest: Vec<(u64, f64)>,
}

impl Variant {
    /// Makes a variant without values; [`Variant::take`] adds them.
    pub(super) fn of(results: &Results, runs: &Runs<'_>) -> Result<Self, MonteCarloError> {
        let (batch, summary) = (results.batch(), runs.summary()?);
        let flown = batch.flown();
        Ok(Self {
            name: summary.scenario.clone(),
            scenario: summary.scenario,
            version: batch.version().to_owned(),
            seed: summary.seed.to_string(),
            first_run: flown.start,
            runs: flown.end - flown.start,
            shard: summary.shard.map(|shard| shard.to_string()),
            settings: results.settings()?,
            changes: batch.changes_of_built_in(),
            toml: batch.scenario_toml().to_owned(),
            has_traffic: batch.has_traffic(),
            statistics: summary.metrics.into_iter().collect(),
            values: BTreeMap::new(),
            ends: BTreeMap::new(),
        })
    }

    pub(super) fn has(&self, metric: &str) -> bool {
        self.statistics.contains_key(metric)
    }

    /// Number of values over all runs and metrics.
    pub(super) fn size(&self) -> u64 {
        self.runs.saturating_mul(self.statistics.len() as u64)
    }

    /// Adds the values of a metric: all of them if `all` is set, otherwise only those at both ends.
    pub(super) fn take(&mut self, metric: &str, column: &[Option<f64>], all: bool) {
        if !self.has(metric) {
            return;
        }
        if all {
            self.values.insert(metric.to_owned(), column.to_vec());
        }
        let with_run = (self.first_run..).zip(column).filter_map(|(run, value)| Some((run, (*value)?)));
        let mut runs: Vec<(u64, f64)> = with_run.collect();
        // Both sorts are stable, so equal values stay in run order.
        runs.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let smallest = runs.iter().take(MAX_LISTED_RUNS).copied().collect();
        runs.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        runs.truncate(MAX_LISTED_RUNS);
        self.ends.insert(metric.to_owned(), Ends { smallest, largest: runs });
    }
}

/// Removes the settings that are equal in all batches, and names the batches by the remaining ones.
pub(super) fn distinguish(variants: &mut [Variant]) {
    let keys: BTreeSet<String> = variants.iter().flat_map(|variant| variant.settings.keys().cloned()).collect();
    let differ = |key: &String| {
        let of = |variant: &Variant| variant.settings.get(key).cloned();
        // The description of a scenario has no influence on the run.
        key != "about" && variants.iter().any(|variant| of(variant) != of(&variants[0]))
    };
    let differing: BTreeSet<String> = keys.into_iter().filter(differ).collect();
    for variant in variants.iter_mut() {
        variant.settings.retain(|key, _| differing.contains(key));
    }
    let scenarios: Vec<String> = variants.iter().map(|variant| variant.scenario.clone()).collect();
    for variant in variants.iter_mut() {
        if scenarios.iter().filter(|scenario| **scenario == variant.scenario).count() > 1 {
            let mut parts: Vec<String> = variant.settings.iter().map(|(key, value)| format!("{key}={value}")).collect();
            if parts.len() > MAX_SETTINGS_IN_NAME {
                let more = parts.len() - MAX_SETTINGS_IN_NAME;
                parts.truncate(MAX_SETTINGS_IN_NAME);
                parts.push(format!("and {more} more"));
            }
            parts.insert(0, variant.scenario.clone());
            variant.name = parts.join(" ");
        }
    }
    for later in 1..variants.len() {
        let (before, rest) = variants.split_at_mut(later);
        let variant = &mut rest[0];
        if before.iter().any(|other| other.name == variant.name) {
            // The letter of the batch on the page.
            let letter = u8::try_from(later).ok().filter(|&index| index < 26).map(|index| char::from(b'A' + index));
            variant.name += &letter.map_or_else(|| format!(" ({later})"), |letter| format!(" ({letter})"));
        }
    }
}
