//! Statistics of one metric over the runs of a batch, computed in the order of runs.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Statistics of a metric over the runs that have a value. Undefined values are `None`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Statistics {
    /// Number of runs that have a value.
    pub n: u64,
    /// Mean over the runs; for a pooled metric, see [`pooled_root_ratio`].
    pub mean: Option<f64>,
    /// 95 % confidence interval of `mean` by Student's t; needs two runs.
    pub ci95: Option<[f64; 2]>,
    /// Sample standard deviation over the runs (n - 1); needs two runs.
    pub sd: Option<f64>,
    /// 5 % quantile over the runs.
    pub p5: Option<f64>,
    /// Median over the runs.
    pub p50: Option<f64>,
    /// 95 % quantile over the runs.
    pub p95: Option<f64>,
    /// Maximum over the runs.
    pub max: Option<f64>,
}

/// Pooled value and its 95 % confidence interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pooled {
    /// Pooled value.
    pub mean: f64,
    /// 95 % confidence interval; needs two runs.
    pub ci95: Option<[f64; 2]>,
}

impl Statistics {
    /// Computes the statistics of a metric's values, one per run; runs without a value are ignored.
    pub fn of(values: &[Option<f64>]) -> Self {
        let mut values: Vec<f64> = values.iter().copied().flatten().collect();
        let (mean, sd) = mean_and_sd(&values);
        let ci95 = mean.zip(sd).map(|(mean, sd)| interval(mean, sd, values.len()));
        values.sort_by(f64::total_cmp);
        Self {
            n: values.len() as u64,
            mean,
            ci95,
            sd,
            p5: quantile(&values, 0.05),
            p50: quantile(&values, 0.5),
            p95: quantile(&values, 0.95),
            max: values.last().copied(),
        }
    }
}

/// Computes the square root of a ratio of sums over all runs, such as squared errors over squared bounds. The weight of
/// a run is its contribution to the sums. Runs that lack a value are ignored.
///
/// The interval is that of the ratio of two means by the delta method, with Student's t and n - 1 degrees of freedom.
/// Returns `None` if the sum of the denominators is not positive.
pub fn pooled_root_ratio(numerators: &[Option<f64>], denominators: &[Option<f64>]) -> Option<Pooled> {
    let pairs: Vec<(f64, f64)> = numerators.iter().zip(denominators).filter_map(|(a, b)| a.zip(*b)).collect();
    let n = pairs.len() as f64;
    let (above, below) = pairs.iter().fold((0.0, 0.0), |(above, below), (a, b)| (above + a, below + b));
    let ratio = above / below;
    if below <= 0.0 || ratio < 0.0 {
        return None;
    }
    let root = ratio.sqrt();
    // Var(A/B) = Var(a - (A/B) b) / (n mean(b)^2); d sqrt(x) = dx / (2 sqrt(x)).
    let residuals: Vec<f64> = pairs.iter().map(|(a, b)| a - ratio * b).collect();
    let sd = mean_and_sd(&residuals).1.filter(|_| root > 0.0);
    let ci95 = sd.map(|sd| interval(root, sd / (below / n) / (2.0 * root), pairs.len()));
    Some(Pooled { mean: root, ci95 })
}

/// Returns the mean of at least one value, and the sample standard deviation (n - 1) of at least two.
pub(super) fn mean_and_sd(values: &[f64]) -> (Option<f64>, Option<f64>) {
    let n = values.len() as f64;
    if values.is_empty() {
        return (None, None);
    }
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (Some(mean), (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt()))
}

/// Returns the 95 % confidence interval of a mean of `n` values, at least two, with this standard deviation.
pub(super) fn interval(mean: f64, sd: f64, n: usize) -> [f64; 2] {
    let half = student_t_975(n - 1) * sd / (n as f64).sqrt();
    [mean - half, mean + half]
}

/// Returns the 97.5 % quantile of Student's t with `freedom` degrees of freedom, at least one: half the width of a 95 %
/// interval of a mean, in standard errors.
pub fn student_t_975(freedom: usize) -> f64 {
    // Fails only if the degrees of freedom are not positive.
    StudentsT::new(0.0, 1.0, freedom as f64).map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
}

/// Returns the quantile `p` of ascending values by linear interpolation between order statistics, at position p (n - 1)
/// counted from 0. `None` without values.
pub fn quantile(sorted: &[f64], p: f64) -> Option<f64> {
    let position = p * (sorted.len().checked_sub(1)?) as f64;
    let (below, above) = (sorted.get(position.floor() as usize)?, sorted.get(position.ceil() as usize)?);
    Some(below + (above - below) * (position - position.floor()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(got: f64, expected: f64) {
        assert!((got - expected).abs() <= 1e-9 * expected.abs().max(1.0), "{got}, not {expected}");
    }

    /// Values of tables of Student's t, with more digits: Simpson's rule over the density gives 0.975 at each, to
    /// 1e-11.
    #[test]
    fn student_t_quantiles_equal_published_tables() {
        for (freedom, expected) in [
            (1, 12.706204736174704),
            (2, 4.302652729749464),
            (9, 2.262157162798205),
            (29, 2.045229642132703),
            (199, 1.971956544249395),
            (9_999, 1.960201263621358),
        ] {
            close(student_t_975(freedom), expected);
        }
    }

    /// 2, 4, 4, 4, 5, 5, 7, 9: mean 5, sum of squares 32, so sd = sqrt(32/7); quantiles as in NumPy's default.
    #[test]
    fn statistics_of_a_small_sample_are_correct() {
        let values = [9.0, 2.0, 5.0, 4.0, 4.0, 7.0, 4.0, 5.0].map(Some);
        let s = Statistics::of(&[&values[..], &[None, None]].concat());
        assert_eq!((s.n, s.mean, s.p50, s.max), (8, Some(5.0), Some(4.5), Some(9.0)));
        close(s.sd.unwrap(), 2.1380899352993947);
        close(s.p5.unwrap(), 2.7);
        close(s.p95.unwrap(), 8.3);
        let [lo, hi] = s.ci95.unwrap();
        // t(7) = 2.364624251592784
        close(hi - 5.0, 2.364624251592784 * 2.1380899352993947 / 8f64.sqrt());
        close(lo + hi, 10.0);
    }

    #[test]
    fn undefined_statistics_are_none() {
        let none = Statistics::of(&[None]);
        assert_eq!((none.n, none.mean, none.ci95, none.sd, none.p50, none.max), (0, None, None, None, None, None));
        let one = Statistics::of(&[Some(3.0)]);
        assert_eq!((one.n, one.mean, one.ci95, one.sd), (1, Some(3.0), None, None));
        assert_eq!((one.p5, one.p50, one.p95, one.max), (Some(3.0), Some(3.0), Some(3.0), Some(3.0)));
        let same = Statistics::of(&[Some(3.0); 4]);
        assert_eq!((same.sd, same.ci95), (Some(0.0), Some([3.0, 3.0])));
    }

    /// Numerators 1, 4, 7 over denominators 1, 2, 5: ratio 12/8, residuals -0.5, 1, -0.5 with sd sqrt(0.75).
    #[test]
    fn pooled_ratio_weights_runs_by_their_contribution() {
        let pooled =
            pooled_root_ratio(&[Some(1.0), Some(4.0), None, Some(7.0)], &[Some(1.0), Some(2.0), Some(9.0), Some(5.0)]);
        let Pooled { mean, ci95 } = pooled.unwrap();
        close(mean, 1.5f64.sqrt());
        let se = 0.75f64.sqrt() / 3f64.sqrt() / (8.0 / 3.0) / (2.0 * 1.5f64.sqrt());
        let [lo, hi] = ci95.unwrap();
        close(hi - mean, 4.302652729749464 * se);
        close(mean - lo, hi - mean);
    }

    /// The interval covers the true ratio with its nominal frequency: 1,000 batches of 60 runs of dependent sums.
    #[test]
    fn interval_of_a_pooled_ratio_has_nominal_coverage() {
        use crate::random::{Draws, Stream};
        let mut covered = 0;
        for batch in 0..1_000 {
            let (mut above, mut below) = (Vec::new(), Vec::new());
            for run in 0..60 {
                let [a, b] = Draws::new(batch).at(Stream::Measurement, run, 0).normals();
                below.push(Some(10.0 + b));
                above.push(Some(2.0 * (10.0 + b) + 3.0 * a));
            }
            let [lo, hi] = pooled_root_ratio(&above, &below).unwrap().ci95.unwrap();
            covered += u32::from((lo..hi).contains(&2f64.sqrt()));
        }
        // Three standard errors of a proportion of 0.95.
        assert!((929..=971).contains(&covered), "{covered}");
    }

    #[test]
    fn pooled_ratio_without_values_is_none() {
        assert_eq!(pooled_root_ratio(&[], &[]), None);
        assert_eq!(pooled_root_ratio(&[Some(1.0)], &[Some(0.0)]), None);
        assert_eq!(pooled_root_ratio(&[Some(4.0)], &[Some(1.0)]), Some(Pooled { mean: 2.0, ci95: None }));
    }
}
