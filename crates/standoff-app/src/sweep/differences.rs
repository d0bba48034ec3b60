//! Paired differences between the points of a sweep: all points fly the same seeds.

use standoff_sim::monte_carlo::{MonteCarloError, Paired, Results, Runs};
use standoff_view::sweep::Difference;

use crate::comparison::Verdict;

/// Maximum number of differences up to which every point is a reference (about 3 MB of the page).
const DIFFERENCES_MAX: usize = 100_000;

/// Maximum number of points whose files are open at the same time, in addition to those of the references.
const OPEN_MAX: usize = 100;

/// Differences by reference point, point and metric.
pub(super) type Differences = Vec<Vec<Vec<Difference>>>;

/// Computes the differences of all points from each reference: from every point or, in a large sweep, from the first one
/// only. The points have the same seeds and metrics.
pub(super) fn differences(results: &[Results], metrics: &[String]) -> Result<Differences, MonteCarloError> {
    let pairs = results.len() * results.len() * metrics.len();
    let references = opened(&results[..if pairs <= DIFFERENCES_MAX { results.len() } else { 1 }])?;
    let mut differences = vec![Vec::new(); references.len()];
    for results in results.chunks(OPEN_MAX) {
        let points = opened(results)?;
        let mut found = vec![vec![Vec::new(); points.len()]; references.len()];
        // One metric at a time, so that only a column of each reference is in memory.
        for metric in metrics {
            let columns = references.iter().map(|runs| runs.column(metric)).collect::<Result<Vec<_>, _>>()?;
            for (point, runs) in points.iter().enumerate() {
                let values = runs.column(metric)?;
                for (column, found) in columns.iter().zip(&mut found) {
                    found[point].push(difference(metric, column, &values));
                }
            }
        }
        for (differences, found) in differences.iter_mut().zip(found) {
            differences.extend(found);
        }
    }
    Ok(differences)
}

fn opened(results: &[Results]) -> Result<Vec<Runs<'_>>, MonteCarloError> {
    results.iter().map(Results::runs).collect()
}

fn difference(metric: &str, reference: &[Option<f64>], values: &[Option<f64>]) -> Difference {
    let pairs: Vec<_> = reference.iter().copied().zip(values.iter().copied()).collect();
    let paired = Paired::of(metric, &pairs);
    let verdict = match Verdict::of(&paired) {
        Verdict::ABetter => "worse",
        Verdict::BBetter => "better",
        other => other.text(),
    };
    (paired.n, paired.difference, paired.ci95, verdict)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_is_that_on_the_point() {
        let verdict = |metric, [a, b, c]: [f64; 3], [d, e, f]: [f64; 3]| {
            difference(metric, &[Some(a), Some(b), Some(c)], &[Some(d), Some(e), Some(f)]).3
        };
        assert_eq!(verdict("phase_error_deg", [10.0, 20.0, 30.0], [9.0, 18.9, 29.1]), "better");
        assert_eq!(verdict("phase_error_deg", [9.0, 18.9, 29.1], [10.0, 20.0, 30.0]), "worse");
        assert_eq!(verdict("anees", [1.0, 2.0, 3.0], [2.0, 3.1, 4.0]), "differs");
        assert_eq!(verdict("anees", [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]), "same");
        assert_eq!(verdict("anees", [1.0, 2.0, 3.0], [9.0, 2.0, 0.0]), "unclear");
    }
}
