//! Time histories of many runs: the 5 to 95 % band of all runs, and the first run.

use standoff_view::figures::study::{Band, Line, Plot};

use super::statistics::quantiles;
use super::study::{Data, line, plot};

/// Time history of one run: at each time step the time, s, and any number of values (of UAVs or groups).
pub(crate) type History = Vec<(f64, Vec<f64>)>;

/// Creates a plot of the first run's values, and of the median and the 5 to 95 % range of all runs at each time step.
pub(crate) fn bands(axis: &str, runs: &[History]) -> Plot {
    let levels = levels(runs);
    let points = levels.iter().map(|&(time, [low, _, high])| (time, low, high)).collect();
    let band = Band { label: "5 to 95 %".to_owned(), colour: 0, points };
    let median = line("median", 0, levels.iter().map(|&(time, [_, middle, _])| (time, middle)));
    let lines = [median].into_iter().chain(one_run(runs.first()));
    Plot { bands: vec![band], shown: vec![0.0], ..plot("Time (s)", axis, lines) }
}

/// Returns the data of such plots.
pub(crate) fn data(name: &'static str, kinds: &[(&str, &[History])]) -> Data {
    let levels: Vec<_> = kinds.iter().map(|(_, runs)| levels(runs)).collect();
    let heads: String = kinds.iter().map(|(name, _)| format!(",{name}_p5,{name}_p50,{name}_p95")).collect();
    let times = levels.first().map(Vec::as_slice).unwrap_or_default();
    let row = |(index, &(time, _)): (usize, &(f64, [f64; 3]))| {
        let cells = levels.iter().flat_map(|levels| levels.get(index).map_or([f64::NAN; 3], |at| at.1));
        [time].into_iter().chain(cells).collect()
    };
    Data::new(name, format!("time_s{heads}"), times.iter().enumerate().map(row))
}

/// Computes the 5, 50 and 95 % quantiles of all values of all runs at each time step.
fn levels(runs: &[History]) -> Vec<(f64, [f64; 3])> {
    let Some(first) = runs.first() else { return Vec::new() };
    let at = |index: usize| -> Vec<f64> {
        runs.iter().filter_map(|run| run.get(index)).flat_map(|at| at.1.iter().copied()).collect()
    };
    first.iter().enumerate().map(|(index, &(time, _))| (time, quantiles(&at(index)))).collect()
}

/// Returns the values of one run as a line with gaps, one curve per value.
fn one_run(run: Option<&History>) -> Option<Line> {
    let run = run?;
    let most = run.iter().map(|at| at.1.len()).max()?;
    let mut points = Vec::new();
    for index in 0..most {
        points.extend(run.iter().map(|(time, values)| (*time, values.get(index).copied().unwrap_or(f64::NAN))));
        points.push((f64::NAN, f64::NAN));
    }
    Some(line("first run", 3, points))
}
