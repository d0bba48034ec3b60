//! Paired comparison of two scenarios or batches: both use the same random draws per seed, so that only the changes
//! differ.

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use standoff_score::{MetricInfo, MetricSelection, Metrics, WorseDirection};

use super::results::as_object;
use super::statistics::{interval, mean_and_sd};
use super::{Batch, MonteCarloError, Results, check_not_stopped, fly_seed, in_order};
use crate::scenario::ScenarioTemplate;

/// Comparison of B with A, seed by seed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of A.
    pub a: String,
    /// Name of B.
    pub b: String,
    /// First common seed.
    pub seed: u64,
    /// Number of common seeds.
    pub runs: u64,
    /// Metrics by name, in the order of [`MetricInfo::all`].
    #[serde(serialize_with = "as_object")]
    pub metrics: Vec<(String, Paired)>,
}

/// Metric of A and B over the runs in which both have a value. Undefined values are `None`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Paired {
    /// Number of runs in which both have a value.
    pub n: u64,
    /// Mean of A.
    pub mean_a: Option<f64>,
    /// Mean of B.
    pub mean_b: Option<f64>,
    /// Mean of B - A.
    pub difference: Option<f64>,
    /// 95 % confidence interval of `difference`, by Student's t on the differences; needs two runs.
    pub ci95: Option<[f64; 2]>,
    /// Fraction of runs in which B is smaller than A.
    pub b_smaller: Option<f64>,
    /// Fraction of runs in which A and B are equal.
    pub equal: Option<f64>,
    /// Smallest difference of practical interest. Below it, A and B count as equivalent, even if the difference is
    /// statistically significant.
    pub interest: f64,
    /// True if the whole interval lies beyond the smallest difference of interest.
    pub differs: bool,
    /// The better one, if they differ and the metric has a better direction.
    pub better: Option<Better>,
}

/// The better one of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// A is better.
    A,
    /// B is better.
    B,
}

impl Paired {
    /// Compares the values of a metric in A and B, run by run.
    pub fn of(metric: &str, pairs: &[(Option<f64>, Option<f64>)]) -> Self {
        let pairs: Vec<(f64, f64)> = pairs.iter().filter_map(|(a, b)| a.zip(*b)).collect();
        let mean = |value: fn(&(f64, f64)) -> f64| mean_and_sd(&pairs.iter().map(value).collect::<Vec<_>>()).0;
        let share = |is: fn(&(f64, f64)) -> bool| {
            (!pairs.is_empty()).then(|| pairs.iter().filter(|pair| is(pair)).count() as f64 / pairs.len() as f64)
        };
        let differences: Vec<f64> = pairs.iter().map(|(a, b)| b - a).collect();
        let (difference, sd) = mean_and_sd(&differences);
        let ci95 = difference.zip(sd).map(|(mean, sd)| interval(mean, sd, differences.len()));
        let about = MetricInfo::of(metric);
        let interest = about.map_or(0.0, |about| about.interest);
        let below = ci95.is_some_and(|[_, hi]| hi < -interest);
        let differs = below || ci95.is_some_and(|[lo, _]| lo > interest);
        let bad = about.and_then(MetricInfo::rated);
        let better = |bad| if below == (bad == WorseDirection::Large) { Better::B } else { Better::A };
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
    /// Compares the metrics of A and B, flown with consecutive seeds from `seed` on by any program.
    pub fn of([a, b]: [&str; 2], seed: u64, choice: MetricSelection, flown: &[[Metrics; 2]]) -> Self {
        let metrics = choice.names().map(|name| {
            let pairs: Vec<_> = flown.iter().map(|[a, b]| (a[name], b[name])).collect();
            (name.to_owned(), Paired::of(name, &pairs))
        });
        Self { a: a.to_owned(), b: b.to_owned(), seed, runs: flown.len() as u64, metrics: metrics.collect() }
    }

    /// Returns one JSON object and a newline.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

/// Flies A and B with the same `runs` seeds from `seed` on, and compares them. `stop` takes effect within one time step
/// of each active run.
pub fn compare(
    a: &ScenarioTemplate,
    b: &ScenarioTemplate,
    seed: u64,
    runs: u64,
    choice: MetricSelection,
    threads: Option<NonZeroUsize>,
    stop: &AtomicBool,
) -> Result<Comparison, MonteCarloError> {
    // The limits are those of a batch.
    Batch::new(a, seed, runs, None, choice)?;
    let flown = in_order(seed..seed + runs, threads, stop, |seed, halt| {
        let fly = |template| fly_seed(template, seed, choice, || !halt.is_stopped());
        Ok([fly(a)?, fly(b)?])
    })?;
    Ok(Comparison::of([a.name(), b.name()], seed, choice, &flown))
}

/// Compares two complete batches over their common seeds and metrics; fails if `stop` is set.
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
        check_not_stopped(stop)?;
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
    fn differences_are_computed_per_run() {
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
    fn better_side_is_given_only_for_metrics_with_a_direction() {
        let pairs = [(10.0, 9.0), (20.0, 18.9), (30.0, 29.1)];
        assert_eq!(of("phase_error_deg", &pairs).better, Some(Better::B));
        let (other_way, anees) = (pairs.map(|(a, b)| (b, a)), of("anees", &pairs));
        assert_eq!(of("phase_error_deg", &other_way).better, Some(Better::A));
        assert_eq!((anees.differs, anees.better), (true, None));
    }

    /// A position error that is significantly smaller, but only by a centimetre, counts as equivalent.
    #[test]
    fn differences_below_the_size_of_interest_do_not_count() {
        let by = |less_m: f64| of("position_error_m", &[1.0, 2.0, 3.0].map(|at_m| (at_m, at_m - less_m - 1e-4 * at_m)));
        let (centimetre, decimetres) = (by(0.01), by(0.2));
        assert!(centimetre.ci95.unwrap()[1] < 0.0 && !centimetre.differs && centimetre.better.is_none());
        assert_eq!((decimetres.differs, decimetres.better, decimetres.interest), (true, Some(Better::B), 0.1));
    }

    #[test]
    fn more_custody_is_better_and_more_separation_is_not_rated() {
        let pairs = [(0.5, 0.6), (0.6, 0.7), (0.7, 0.8001)];
        assert_eq!(of("custody_fraction", &pairs).better, Some(Better::B));
        let pairs = pairs.map(|(a, b)| (1000.0 * a, 1000.0 * b));
        let wider = of("separation_min_m", &pairs);
        assert_eq!((wider.differs, wider.better), (true, None));
    }

    #[test]
    fn unpaired_runs_are_ignored_and_equal_runs_do_not_differ() {
        let paired = Paired::of(
            "anees",
            &[(Some(1.0), None), (None, Some(1.0)), (Some(2.0), Some(2.0)), (Some(3.0), Some(3.0))],
        );
        assert_eq!((paired.n, paired.ci95, paired.differs), (2, Some([0.0, 0.0]), false));
        assert_eq!((paired.b_smaller, paired.equal), (Some(0.0), Some(1.0)));
        assert_eq!(Paired::of("anees", &[]).difference, None);
    }
}
