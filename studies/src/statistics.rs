//! Estimates with intervals from one value per run, in the order of the runs.

use serde::Serialize;
use standoff_score::Metrics;
use standoff_sim::monte_carlo::{pooled_root_ratio, quantile, student_t_975};

/// Standard normal quantile of 97.5 %.
const Z: f64 = 1.959_963_984_540_054;

/// An estimate and its interval; NaN if no run has a value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Estimate {
    /// Returns a number that is computed without random numbers; its interval has no width.
    pub(crate) fn exact(value: f64) -> Self {
        Self { value, low: value, high: value }
    }

    /// Computes the mean and its 95 % interval by Student's t.
    pub(crate) fn mean(values: &[f64]) -> Self {
        let value = mean(values);
        let half = student_95(values.len()) * standard_error(values);
        Self { value, low: value - half, high: value + half }
    }

    /// Computes the mean of a metric over the runs that have it.
    pub(crate) fn of(runs: &[Metrics], metric: &str) -> Self {
        Self::mean(&runs.iter().filter_map(|run| run[metric]).collect::<Vec<_>>())
    }

    /// Computes the mean difference of a metric, paired by seed.
    pub(crate) fn difference(from: &[Metrics], to: &[Metrics], metric: &str) -> Self {
        let pairs = from.iter().zip(to).filter_map(|(from, to)| Some(to[metric]? - from[metric]?));
        Self::mean(&pairs.collect::<Vec<_>>())
    }

    /// Computes the relative change from the mean of `from` to the mean of `to`, percent, with the linearised 95 %
    /// interval of the paired ratio.
    pub(crate) fn percent(from: &[f64], to: &[f64]) -> Self {
        let start = mean(from);
        let ratio = (mean(to) - start) / start;
        let rest: Vec<f64> = from.iter().zip(to).map(|(from, to)| to - from - ratio * from).collect();
        let half = student_95(from.len()) * standard_error(&rest) / start.abs();
        Self { value: 100.0 * ratio, low: 100.0 * (ratio - half), high: 100.0 * (ratio + half) }
    }

    /// Computes the percentage of runs where a statement holds, with Wilson's 95 % interval.
    pub(crate) fn share(held: impl IntoIterator<Item = bool>) -> Self {
        let (mut yes, mut n) = (0.0, 0.0);
        for held in held {
            yes += f64::from(held);
            n += 1.0;
        }
        let share = yes / n;
        let (middle, weight) = (share + Z * Z / (2.0 * n), 1.0 + Z * Z / n);
        let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
        let percent = |bound: f64| 100.0 * bound.clamp(0.0, 1.0);
        Self { value: 100.0 * share, low: percent((middle - half) / weight), high: percent((middle + half) / weight) }
    }

    /// Computes the median and the 5 to 95 % range.
    pub(crate) fn middle(values: &[f64]) -> Self {
        let [low, value, high] = quantiles(values);
        Self { value, low, high }
    }

    /// Computes the root of the ratio of two metrics, pooled over all runs; NaN if undefined.
    pub(crate) fn pooled(runs: &[Metrics], numerator: &str, denominator: &str) -> Self {
        let column = |metric: &str| runs.iter().map(|run| run[metric]).collect::<Vec<_>>();
        let pooled = pooled_root_ratio(&column(numerator), &column(denominator));
        let value = pooled.map_or(f64::NAN, |pooled| pooled.mean);
        let [low, high] = pooled.and_then(|pooled| pooled.ci95).unwrap_or([f64::NAN; 2]);
        Self { value, low, high }
    }

    /// Converts the unit by a factor.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self { value: factor * self.value, low: factor * self.low, high: factor * self.high }
    }

    /// Formats the estimate with its interval in brackets.
    pub(crate) fn formatted(&self, number: fn(f64) -> String) -> String {
        format!("{} [{}, {}]", number(self.value), number(self.low), number(self.high))
    }
}

/// Returns the mean; NaN for an empty slice.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the 5, 50 and 95 % quantiles, interpolated linearly; NaN for an empty slice.
pub(crate) fn quantiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    [0.05, 0.5, 0.95].map(|level| quantile(&sorted, level).unwrap_or(f64::NAN))
}

/// Computes Spearman's rank correlation; `None` if one of the two series is constant.
pub(crate) fn rank_correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    let (a, b): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let (a, b) = (ranks(&a), ranks(&b));
    let (mean_a, mean_b) = (mean(&a), mean(&b));
    let product = |x: &[f64], mean_x: f64, y: &[f64], mean_y: f64| -> f64 {
        x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum()
    };
    let size = (product(&a, mean_a, &a, mean_a) * product(&b, mean_b, &b, mean_b)).sqrt();
    (size > 0.0).then(|| product(&a, mean_a, &b, mean_b) / size)
}

/// Returns ranks from 1; equal values share their mean rank.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for tied in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let rank = first as f64 + 0.5 * (tied.len() as f64 + 1.0);
        tied.iter().for_each(|&index| ranks[index] = rank);
        first += tied.len();
    }
    ranks
}

/// Returns the standard error of the mean; NaN for fewer than two values.
fn standard_error(values: &[f64]) -> f64 {
    let (mean, n) = (mean(values), values.len() as f64);
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (squares / ((n - 1.0) * n)).sqrt()
}

/// Returns half the width of the 95 % interval of the mean of `n` values, in standard errors; NaN for fewer than two.
fn student_95(n: usize) -> f64 {
    if n < 2 { f64::NAN } else { student_t_975(n - 1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(got: f64, expected: f64) {
        assert!((got - expected).abs() < 1e-3, "{got} instead of {expected}");
    }

    /// Student's quantiles from published tables: 2.262 (9 degrees of freedom), 1.984 (99).
    #[test]
    fn the_interval_of_a_mean_uses_students_t() {
        close(student_95(10), 2.262);
        close(student_95(100), 1.984);
        let got = Estimate::mean(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        close(got.value, 5.5);
        close(got.high - got.value, 2.262 * 0.957_427);
    }

    /// If all pairs shrink by 30 %, the interval has no width; without the pairing it is wide.
    #[test]
    fn a_relative_change_uses_the_pairing() {
        let from = [10.0, 20.0, 40.0];
        let got = Estimate::percent(&from, &from.map(|value| 0.7 * value));
        close(got.value, -30.0);
        close(got.high - got.low, 0.0);
        let shuffled = Estimate::percent(&from, &[28.0, 7.0, 14.0]);
        assert!(shuffled.value == got.value && shuffled.high > 10.0, "{shuffled:?}");
    }

    /// Wilson's interval of 8 in 10: 49.0 to 94.3 %; of all of 200: 98.1 to 100 %.
    #[test]
    fn a_percentage_has_wilsons_interval() {
        let got = Estimate::share((0..10).map(|run| run < 8));
        close(got.low, 49.016);
        close(got.high, 94.332);
        let all = Estimate::share([true; 200]);
        close(all.low, 98.115);
        assert_eq!((all.value, all.high), (100.0, 100.0));
    }

    #[test]
    fn quantiles_are_interpolated() {
        assert_eq!(quantiles(&[3.0, 1.0, 2.0]), [1.1, 2.0, 2.9]);
        assert!(quantiles(&[]).iter().all(|quantile| quantile.is_nan()));
    }

    #[test]
    fn rank_correlation_does_not_depend_on_the_scale() {
        let correlation = |pairs: &[(f64, f64)]| rank_correlation(pairs);
        assert_eq!(correlation(&[(1.0, 1.0), (2.0, 100.0), (3.0, 1e6)]), Some(1.0));
        assert_eq!(correlation(&[(1.0, 5.0), (2.0, 4.0), (3.0, -1.0)]), Some(-1.0));
        assert_eq!(correlation(&[(1.0, 5.0), (2.0, 5.0)]), None);
        // Ties: ranks 1, 2.5, 2.5, 4 against 1, 2, 3, 4.
        close(correlation(&[(0.0, 0.0), (1.0, 1.0), (1.0, 2.0), (9.0, 3.0)]).unwrap(), 0.948_683);
    }
}
