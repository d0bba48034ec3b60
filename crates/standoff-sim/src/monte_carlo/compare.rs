//! Two scenarios, or two batches, seed by seed: the same draws for both, so that what is left is what was changed.

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::results::as_object;
use super::statistics::{interval, mean_and_sd};
use super::{Batch, MonteCarloError, Results, fly_seed, in_order, unless_set};
use crate::scenario::Template;
use crate::score::{About, BadEnd, Choice, Metrics};

/// B compared with A, seed by seed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// What A is.
    pub a: String,
    /// What B is.
    pub b: String,
    /// The first seed that both have.
    pub seed: u64,
    /// Seeds that both have.
    pub runs: u64,
    /// The metrics by name, in their own order.
    #[serde(serialize_with = "as_object")]
    pub metrics: Vec<(String, Paired)>,
}

/// A metric of A and of B, over the runs in which both have it. `None` where it is not defined.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Paired {
    /// Runs in which both have it.
    pub n: u64,
    /// Mean of A.
    pub mean_a: Option<f64>,
    /// Mean of B.
    pub mean_b: Option<f64>,
    /// Mean of B - A.
    pub difference: Option<f64>,
    /// 95 % confidence interval of `difference`, by Student's t on the differences. From two runs on.
    pub ci95: Option<[f64; 2]>,
    /// Share of the runs in which B is smaller than A.
    pub b_smaller: Option<f64>,
    /// Share of the runs in which both are equal.
    pub equal: Option<f64>,
    /// The size of interest: below it, A and B count as alike, however surely they differ.
    pub interest: f64,
    /// The interval lies beyond the size of interest.
    pub differs: bool,
    /// Who is better, if they differ and it is known which way is better.
    pub better: Option<Better>,
}

/// Who is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// A is.
    A,
    /// B is.
    B,
}

impl Paired {
    /// Of a metric's values in A and B, run by run.
    pub fn of(metric: &str, pairs: &[(Option<f64>, Option<f64>)]) -> Self {
        let pairs: Vec<(f64, f64)> = pairs.iter().filter_map(|(a, b)| a.zip(*b)).collect();
        let mean = |value: fn(&(f64, f64)) -> f64| mean_and_sd(&pairs.iter().map(value).collect::<Vec<_>>()).0;
        let share = |is: fn(&(f64, f64)) -> bool| {
            (!pairs.is_empty()).then(|| pairs.iter().filter(|pair| is(pair)).count() as f64 / pairs.len() as f64)
        };
        let differences: Vec<f64> = pairs.iter().map(|(a, b)| b - a).collect();
        let (difference, sd) = mean_and_sd(&differences);
        let ci95 = difference.zip(sd).map(|(mean, sd)| interval(mean, sd, differences.len()));
        let about = About::of(metric);
        let interest = about.map_or(0.0, |about| about.interest);
        let below = ci95.is_some_and(|[_, hi]| hi < -interest);
        let differs = below || ci95.is_some_and(|[lo, _]| lo > interest);
        // UAVs that come near one another are in danger. That more room is better still is not said.
        let bad = about.and_then(|about| about.bad).filter(|_| !metric.starts_with("separation_"));
        let better = |bad| if below == (bad == BadEnd::Large) { Better::B } else { Better::A };
        Self {
            n: pairs.len() as u64,
            mean_a: mean(|(a, _)| *a),
            mean_b: mean(|(_, b)| *b),
            difference,
            ci95,
            b_smaller: share(|(a, b)| b < a),
            equal: share(|(a, b)| a == b),
            interest,
            differs,
            better: bad.filter(|_| differs).map(better),
        }
    }
}

impl Comparison {
    /// Of what A and B, called so, came to with the same seeds, from `seed` on, whoever flew them.
    pub fn of([a, b]: [&str; 2], seed: u64, choice: Choice, flown: &[[Metrics; 2]]) -> Self {
        let metrics = choice.names().map(|name| {
            let pairs: Vec<_> = flown.iter().map(|[a, b]| (a.value(name), b.value(name))).collect();
            (name.to_owned(), Paired::of(name, &pairs))
        });
        Self { a: a.to_owned(), b: b.to_owned(), seed, runs: flown.len() as u64, metrics: metrics.collect() }
    }

    /// One JSON object and a newline.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

/// Flies A and B with the same `runs` seeds, from `seed` on, and compares them. `stop` ends it within an instant of each
/// run in hand.
pub fn compare(
    a: &Template,
    b: &Template,
    seed: u64,
    runs: u64,
    choice: Choice,
    threads: Option<NonZeroUsize>,
    stop: &AtomicBool,
) -> Result<Comparison, MonteCarloError> {
    // The same limits as for a batch.
    Batch::new(a, seed, runs, None, choice)?;
    let flown = in_order(seed..seed + runs, threads, stop, |seed, halt| {
        let fly = |template| fly_seed(template, seed, choice, || !halt.is_up());
        Ok([fly(a)?, fly(b)?])
    })?;
    Ok(Comparison::of([a.name(), b.name()], seed, choice, &flown))
}

/// Compares two complete batches, over the seeds and the metrics that both have; ends when `stop` is set.
pub fn compare_results(a: &Path, b: &Path, stop: &AtomicBool) -> Result<Comparison, MonteCarloError> {
    let names = (a.display().to_string(), b.display().to_string());
    let (a, b) = (Results::open(a)?, Results::open(b)?);
    let common: Vec<&str> =
        a.batch().metrics.iter().filter(|name| b.batch().metrics.contains(name)).map(String::as_str).collect();
    let mut pairs = vec![Vec::new(); common.len()];
    let mut others = b.runs()?.rows(&common)?.peekable();
    let (mut seed, mut runs) = (None, 0);
    for row in a.runs()?.rows(&common)? {
        let row = row?;
        unless_set(stop)?;
        while others.next_if(|other| other.as_ref().is_ok_and(|other| other.seed < row.seed)).is_some() {}
        let same = others.next_if(|other| other.as_ref().map_or(true, |other| other.seed == row.seed));
        let Some(other) = same.transpose()? else { continue };
        seed = seed.or(Some(row.seed));
        runs += 1;
        for (pairs, pair) in pairs.iter_mut().zip(row.values.into_iter().zip(other.values)) {
            pairs.push(pair);
        }
    }
    let Some(seed) = seed.filter(|_| !common.is_empty()) else {
        let what = format!("{} and {} have no seed or no metric in common", names.0, names.1);
        return Err(MonteCarloError::NotComparable(what));
    };
    let metrics = common.iter().zip(&pairs).map(|(name, pairs)| ((*name).to_owned(), Paired::of(name, pairs)));
    Ok(Comparison { a: names.0, b: names.1, seed: seed as u64, runs, metrics: metrics.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(metric: &str, pairs: &[(f64, f64)]) -> Paired {
        Paired::of(metric, &pairs.iter().map(|(a, b)| (Some(*a), Some(*b))).collect::<Vec<_>>())
    }

    /// Differences -1, -2, -3: mean -2, sd 1, t(2) = 4.3027, half width 2.4841.
    #[test]
    fn differences_are_taken_run_by_run() {
        let paired = of("handoffs", &[(10.0, 9.0), (20.0, 18.0), (30.0, 27.0)]);
        assert_eq!(
            (paired.n, paired.mean_a, paired.mean_b, paired.difference),
            (3, Some(20.0), Some(18.0), Some(-2.0))
        );
        let [lo, hi] = paired.ci95.unwrap();
        assert!((lo + 4.484138).abs() < 1e-6 && (hi - 0.484138).abs() < 1e-6, "{lo} {hi}");
        assert_eq!((paired.b_smaller, paired.differs, paired.better), (Some(1.0), false, None));
    }

    #[test]
    fn who_is_better_is_said_only_where_it_is_known() {
        let pairs = [(10.0, 9.0), (20.0, 18.9), (30.0, 29.1)];
        assert_eq!(of("phase_error_deg", &pairs).better, Some(Better::B));
        let (other_way, anees) = (pairs.map(|(a, b)| (b, a)), of("anees", &pairs));
        assert_eq!(of("phase_error_deg", &other_way).better, Some(Better::A));
        assert_eq!((anees.differs, anees.better), (true, None));
    }

    /// A position error that is surely smaller by a centimetre is the same for who flies.
    #[test]
    fn what_differs_by_less_than_is_of_interest_is_alike() {
        let by = |less_m: f64| of("position_error_m", &[1.0, 2.0, 3.0].map(|at_m| (at_m, at_m - less_m - 1e-4 * at_m)));
        let (centimetre, decimetres) = (by(0.01), by(0.2));
        assert!(centimetre.ci95.unwrap()[1] < 0.0 && !centimetre.differs && centimetre.better.is_none());
        assert_eq!((decimetres.differs, decimetres.better, decimetres.interest), (true, Some(Better::B), 0.1));
    }

    #[test]
    fn more_of_what_is_watched_is_better_and_more_room_between_uavs_is_not_said_to_be() {
        let pairs = [(0.5, 0.6), (0.6, 0.7), (0.7, 0.8001)];
        assert_eq!(of("watched_fraction", &pairs).better, Some(Better::B));
        let pairs = pairs.map(|(a, b)| (1000.0 * a, 1000.0 * b));
        let room = of("separation_min_m", &pairs);
        assert_eq!((room.differs, room.better), (true, None));
    }

    #[test]
    fn runs_without_a_partner_do_not_count_and_equals_do_not_differ() {
        let paired = Paired::of(
            "anees",
            &[(Some(1.0), None), (None, Some(1.0)), (Some(2.0), Some(2.0)), (Some(3.0), Some(3.0))],
        );
        assert_eq!((paired.n, paired.ci95, paired.differs), (2, Some([0.0, 0.0]), false));
        assert_eq!((paired.b_smaller, paired.equal), (Some(0.0), Some(1.0)));
        assert_eq!(Paired::of("anees", &[]).difference, None);
    }
}
