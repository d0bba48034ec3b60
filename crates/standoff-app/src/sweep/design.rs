//! Points of a sweep: a grid over all values, or a Latin hypercube.

use serde::{Deserialize, Serialize};
use standoff_sim::random::{Draws, Stream};

use super::axis::{Axis, AxisValues};

/// Maximum number of points of a sweep, each of which has a folder.
pub const POINTS_MAX: usize = 10_000;

/// Sampling by a Latin hypercube.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct LatinHypercube {
    /// Number of points.
    pub points: usize,
    /// Seed of the points; it is independent of the seeds of the runs.
    pub seed: u64,
}

/// Returns the points of the grid, the first key varying slowest.
pub(super) fn grid(axes: &[Axis]) -> Result<Vec<Vec<String>>, String> {
    let mut points = vec![Vec::new()];
    for axis in axes {
        let AxisValues::Listed(values) = &axis.values else {
            let what = "a range needs a number of values (FROM..TO:COUNT), or a Latin hypercube (--points N)";
            return Err(format!("{}: {what}", axis.key));
        };
        let size = points.len() * values.len();
        if size > POINTS_MAX {
            return Err(format!("the grid has {size} points or more; at most {POINTS_MAX}"));
        }
        let extended = points.iter().flat_map(|point: &Vec<String>| {
            values.iter().map(move |value| [point.as_slice(), std::slice::from_ref(value)].concat())
        });
        points = extended.collect();
    }
    Ok(points)
}

/// Returns the points of a Latin hypercube: each key takes each of its strata once, in an independent random order.
/// `is_whole` returns whether a key takes whole numbers only; the argument is the index of its axis.
pub(super) fn latin_hypercube(
    axes: &[Axis],
    design: LatinHypercube,
    is_whole: impl Fn(usize) -> bool,
) -> Result<Vec<Vec<String>>, String> {
    let LatinHypercube { points, seed } = design;
    if !(2..=POINTS_MAX).contains(&points) {
        return Err(format!("{points} points: must be from 2 to {POINTS_MAX}"));
    }
    let draws = Draws::new(seed);
    let columns: Vec<Vec<String>> = axes
        .iter()
        .enumerate()
        .map(|(index, axis)| {
            let mut draw = draws.at(Stream::Sweep, index as u64, 0);
            // Fisher-Yates shuffle.
            let mut strata: Vec<usize> = (0..points).collect();
            for last in (1..points).rev() {
                strata.swap(last, (draw.uniform() * (last + 1) as f64) as usize);
            }
            let whole = matches!(axis.values, AxisValues::Range { .. }) && is_whole(index);
            let mut value = |stratum: usize| match &axis.values {
                AxisValues::Listed(values) => values[stratum * values.len() / points].clone(),
                AxisValues::Range { from, to } => {
                    let share = (stratum as f64 + draw.uniform()) / points as f64;
                    if whole {
                        let (from, to) = (from.ceil(), to.floor());
                        return (from + ((to - from + 1.0) * share).floor()).to_string();
                    }
                    rounded(from + (to - from) * share, to - from).clamp(*from, *to).to_string()
                }
            };
            strata.into_iter().map(&mut value).collect()
        })
        .collect();
    Ok((0..points).map(|point| columns.iter().map(|column| column[point].clone()).collect()).collect())
}

/// Rounds a number to a decimal that is at most a ten-thousandth of the width of its range away.
fn rounded(value: f64, width: f64) -> f64 {
    let digits = (4.0 - width.log10().floor()).clamp(0.0, 17.0) as usize;
    format!("{value:.digits$}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(typed: &[&str]) -> Vec<Axis> {
        typed.iter().map(|one| Axis::parse(one).unwrap()).collect()
    }

    #[test]
    fn the_grid_has_all_combinations() {
        let points = grid(&axes(&["a=1,2", "b=x,y,z"])).unwrap();
        assert_eq!(points.len(), 6);
        assert_eq!(
            (points[0].join(" "), points[1].join(" "), points[5].join(" ")),
            ("1 x".into(), "1 y".into(), "2 z".into())
        );
        assert!(grid(&axes(&["a=0..1"])).unwrap_err().contains("FROM..TO:COUNT"));
        assert!(grid(&axes(&["a=0..1:1000", "b=0..1:1000"])).unwrap_err().contains("at most 10000"));
    }

    #[test]
    fn a_latin_hypercube_has_one_point_in_each_stratum_of_each_key() {
        let axes = axes(&["a=10..30", "b=-1..1", "c=2..9", "d=x,y"]);
        let design = LatinHypercube { points: 8, seed: 5 };
        let points = latin_hypercube(&axes, design, |index| index == 2).unwrap();
        let sorted = |index: usize| {
            let mut values: Vec<f64> = points.iter().map(|point| point[index].parse().unwrap()).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        for (index, from, width) in [(0, 10.0, 20.0), (1, -1.0, 2.0)] {
            for (stratum, value) in sorted(index).into_iter().enumerate() {
                let share = (value - from) / width * 8.0;
                assert!((stratum as f64 - 0.01..=stratum as f64 + 1.01).contains(&share), "{index}: {value}");
            }
        }
        assert_eq!(sorted(2), [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        assert_eq!(points.iter().filter(|point| point[3] == "x").count(), 4);
        assert_eq!(latin_hypercube(&axes, design, |index| index == 2).unwrap(), points);
        assert_ne!(latin_hypercube(&axes, LatinHypercube { seed: 6, ..design }, |_| false).unwrap(), points);
    }
}
