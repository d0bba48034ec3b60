//! One batch of those that the page shows.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use standoff_sim::monte_carlo::{MonteCarloError, Results, Runs, Settings, Statistics};

/// Most runs that are listed from either end of a metric.
const LISTED: usize = 50;

/// Most settings that make up a name.
const IN_NAME: usize = 3;

/// A batch: what was flown, and what came of it.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Variant {
    /// What tells it from the others.
    pub(super) name: String,
    scenario: String,
    version: String,
    /// Seed of run 0 of the whole batch, as text: a page's numbers have 53 bits.
    seed: String,
    /// The first run that was flown here, and how many were.
    first_run: u64,
    runs: u64,
    /// The part of the batch that this is: `0/2`.
    shard: Option<String>,
    /// The settings in which the batches differ, by key; what one does not have is not there.
    settings: Settings,
    /// What `--set` needs to get from the built-in scenario of that name to this one; `None`: it takes the scenario's
    /// text.
    changes: Option<Vec<String>>,
    /// The scenario as TOML.
    toml: String,
    /// It needs a traffic file as well.
    has_traffic: bool,
    /// By metric.
    statistics: BTreeMap<String, Statistics>,
    /// By metric: a value per run, in order. Empty if there are too many for a page.
    pub(super) values: BTreeMap<String, Vec<Option<f64>>>,
    /// By metric: the runs with the smallest and with the largest values.
    pub(super) ends: BTreeMap<String, Ends>,
}

/// The first runs from either end of a metric: number of the run, value. Of equal values the earlier run comes first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Ends {
    pub(super) smallest: Vec<(u64, f64)>,
    pub(super) largest: Vec<(u64, f64)>,
}

impl Variant {
    /// Everything but the values.
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

    /// How many values it has, over all runs and metrics.
    pub(super) fn size(&self) -> u64 {
        self.runs.saturating_mul(self.statistics.len() as u64)
    }

    /// Takes in the values of a metric; keeps them all, or those at both ends only.
    pub(super) fn take(&mut self, metric: &str, column: &[Option<f64>], all: bool) {
        if !self.has(metric) {
            return;
        }
        if all {
            self.values.insert(metric.to_owned(), column.to_vec());
        }
        let with_run = (self.first_run..).zip(column).filter_map(|(run, value)| Some((run, (*value)?)));
        let mut runs: Vec<(u64, f64)> = with_run.collect();
        // Both sorts keep the order of runs among equals.
        runs.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let smallest = runs.iter().take(LISTED).copied().collect();
        runs.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        runs.truncate(LISTED);
        self.ends.insert(metric.to_owned(), Ends { smallest, largest: runs });
    }
}

/// Keeps of each batch's settings those that are not the same in all, and names the batches by them.
pub(super) fn tell_apart(variants: &mut [Variant]) {
    let keys: BTreeSet<String> = variants.iter().flat_map(|variant| variant.settings.keys().cloned()).collect();
    let differ = |key: &String| {
        let of = |variant: &Variant| variant.settings.get(key).cloned();
        // Words about a scenario change nothing.
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
            if parts.len() > IN_NAME {
                let more = parts.len() - IN_NAME;
                parts.truncate(IN_NAME);
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
            variant.name += &format!(" ({})", later + 1);
        }
    }
}
