//! Statistics of one metric over the runs of a batch: one plain algorithm, over the runs in their order.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// What a metric came to over the runs that have it. Everything is `None` where it is not defined.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Statistics {
    /// Runs that have a value.
    pub n: u64,
    /// Mean over the runs; of a pooled metric, see [`pooled_root_ratio`].
    pub mean: Option<f64>,
    /// 95 % confidence interval of `mean`, by Student's t. From two runs on.
    pub ci95: Option<[f64; 2]>,
    /// Standard deviation of the runs, over n - 1. From two runs on.
    pub sd: Option<f64>,
    /// 5 % quantile of the runs.
    pub p5: Option<f64>,
    /// Median of the runs.
    pub p50: Option<f64>,
    /// 95 % quantile of the runs.
    pub p95: Option<f64>,
    /// Largest value of the runs.
    pub max: Option<f64>,
}

/// A mean and its 95 % confidence interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pooled {
    /// The pooled value.
    pub mean: f64,
    /// Its interval; from two runs on.
    pub ci95: Option<[f64; 2]>,
}

impl Statistics {
    /// The statistics of a metric's values, a value per run; runs without one do not count.
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

/// The square root of a ratio of sums over all runs, such as squared errors over squared bounds: one run weighs as much
/// as what it adds to the sums. Runs that lack either count for nothing.
///
/// The interval is that of the ratio of two means by the delta method, with Student's t and n - 1 degrees of freedom.
/// `None` if the denominators add up to nothing above zero.
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

/// Mean of at least one value, and standard deviation, over n - 1, of at least two.
pub(super) fn mean_and_sd(values: &[f64]) -> (Option<f64>, Option<f64>) {
    let n = values.len() as f64;
    if values.is_empty() {
        return (None, None);
    }
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (Some(mean), (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt()))
}

/// The 95 % confidence interval of a mean of `n` values, at least two, with this standard deviation.
pub(super) fn interval(mean: f64, sd: f64, n: usize) -> [f64; 2] {
    let half = student_t_975(n - 1) * sd / (n as f64).sqrt();
    [mean - half, mean + half]
}

/// The 97.5 % quantile of Student's t with so many degrees of freedom, at least one: half the width of a 95 % interval
/// of a mean, in standard errors.
pub fn student_t_975(freedom: usize) -> f64 {
    // Fails only for a freedom that is not positive.
    StudentsT::new(0.0, 1.0, freedom as f64).map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
}

/// The quantile `p` of ascending values, between order statistics: the value at position p (n - 1), counted from 0, on
/// the straight line between the two values around it. `None` of no values.
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

    /// The tables of Student's t, with more digits: Simpson's rule over the density gives 0.975 at each, to 1e-11.
    #[test]
    fn quantiles_of_student_t_are_those_of_the_tables() {
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

    /// 2, 4, 4, 4, 5, 5, 7, 9: mean 5, squares 32, so sd = sqrt(32/7); quantiles as NumPy's default.
    #[test]
    fn statistics_are_those_of_a_small_sample() {
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
    fn what_is_not_defined_is_none() {
        let none = Statistics::of(&[None]);
        assert_eq!((none.n, none.mean, none.ci95, none.sd, none.p50, none.max), (0, None, None, None, None, None));
        let one = Statistics::of(&[Some(3.0)]);
        assert_eq!((one.n, one.mean, one.ci95, one.sd), (1, Some(3.0), None, None));
        assert_eq!((one.p5, one.p50, one.p95, one.max), (Some(3.0), Some(3.0), Some(3.0), Some(3.0)));
        let same = Statistics::of(&[Some(3.0); 4]);
        assert_eq!((same.sd, same.ci95), (Some(0.0), Some([3.0, 3.0])));
    }

    /// Numerators 1, 4, 7 over denominators 1, 2, 5: ratio 12/8, residuals -0.5, 1, -0.5, their sd sqrt(0.75).
    #[test]
    fn a_pooled_ratio_weighs_runs_by_what_they_add() {
        let pooled =
            pooled_root_ratio(&[Some(1.0), Some(4.0), None, Some(7.0)], &[Some(1.0), Some(2.0), Some(9.0), Some(5.0)]);
        let Pooled { mean, ci95 } = pooled.unwrap();
        close(mean, 1.5f64.sqrt());
        let se = 0.75f64.sqrt() / 3f64.sqrt() / (8.0 / 3.0) / (2.0 * 1.5f64.sqrt());
        let [lo, hi] = ci95.unwrap();
        close(hi - mean, 4.302652729749464 * se);
        close(mean - lo, hi - mean);
    }

    /// The interval covers the true ratio as often as it says: 1,000 batches of 60 runs of dependent sums.
    #[test]
    fn the_interval_of_a_pooled_ratio_covers_in_95_of_100() {
        use crate::draws::{Draws, Stream};
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
        // Three standard errors of a share of 0.95.
        assert!((929..=971).contains(&covered), "{covered}");
    }

    #[test]
    fn a_pooled_ratio_of_nothing_is_none() {
        assert_eq!(pooled_root_ratio(&[], &[]), None);
        assert_eq!(pooled_root_ratio(&[Some(1.0)], &[Some(0.0)]), None);
        assert_eq!(pooled_root_ratio(&[Some(4.0)], &[Some(1.0)]), Some(Pooled { mean: 2.0, ci95: None }));
    }
}
