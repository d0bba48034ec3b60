//! A curve that is thinned while points are added, so that its size is bounded for runs of any length.

use std::ops::Range;

/// Maximum number of points of a curve.
pub(super) const MAX_POINTS: usize = 2_000;
/// Larger values cannot be physical quantities.
const MAX_PLAUSIBLE: f64 = 1e9;

/// A point of a chart: time and value, or east and north.
pub(super) type Point = (f64, f64);

/// Returns the value if it can be drawn.
pub(super) fn usable(value: f64) -> Option<f64> {
    (value.abs() <= MAX_PLAUSIBLE).then_some(value)
}

/// Axis range that contains all values with a relative margin `room`, and is at least `least` wide.
pub(super) fn range(values: impl IntoIterator<Item = f64>, least: f64, room: f64) -> Range<f64> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    values.into_iter().filter_map(usable).for_each(|value| (low, high) = (low.min(value), high.max(value)));
    let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
    // At a billion metres, a range of one metre is too small for distinct ticks.
    let width = (high - low).max(least).max(1e-6 * low.abs().max(high.abs()));
    let (middle, half) = ((low + high) / 2.0, (0.5 + room) * width);
    middle - half..middle + half
}

/// A curve with gaps at missing values.
///
/// If there are too many points, the time steps are divided into strides, and each stride keeps its ends, middle and
/// extremes. Gaps up to the length of a stride are below the resolution of a figure and are bridged.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    doublings: u32,
    samples: Vec<(usize, Point)>,
    /// Number of samples to which the curve is thinned once it has twice as many.
    most: usize,
}

impl Default for Curve {
    fn default() -> Self {
        Self { doublings: 0, samples: Vec::new(), most: MAX_POINTS }
    }
}

impl Curve {
    /// Adds the point of a time step, if it can be drawn. `index`: number of the time step, in ascending order.
    pub(super) fn push(&mut self, index: usize, x: f64, y: impl Into<Option<f64>>) {
        self.samples.extend(usable(x).zip(y.into().and_then(usable)).map(|at| (index, at)));
        self.keep(self.most);
    }

    /// Sets the number of points to keep; the curve may temporarily have up to twice as many.
    pub(super) fn keep(&mut self, most: usize) {
        self.most = most;
        if self.samples.len() > 2 * most {
            self.thin(most);
            // Frees the unused capacity.
            self.samples.shrink_to(2 * most);
        }
    }

    fn thin(&mut self, most: usize) {
        loop {
            let mut kept: Vec<(usize, Point)> = Vec::new();
            for bucket in self.samples.chunk_by(|a, b| a.0 >> self.doublings == b.0 >> self.doublings) {
                let across = |a: &&(usize, Point), b: &&(usize, Point)| a.1.0.total_cmp(&b.1.0);
                let height = |a: &&(usize, Point), b: &&(usize, Point)| a.1.1.total_cmp(&b.1.1);
                let samples = || bucket.iter();
                let extremes = [samples().min_by(across), samples().max_by(across)];
                let mut few = vec![bucket.first(), bucket.get(bucket.len() / 2), bucket.last()];
                few.extend(extremes.into_iter().chain([samples().min_by(height), samples().max_by(height)]));
                few.sort_by_key(|sample| sample.map(|sample| sample.0));
                kept.extend(few.into_iter().flatten());
            }
            kept.dedup_by_key(|sample| sample.0);
            self.samples = kept;
            if self.samples.len() <= most.max(7) {
                return;
            }
            self.doublings += 1;
        }
    }

    /// The unbroken segments of the curve, with at most `most` points in total.
    pub(super) fn runs(&self, most: usize) -> Vec<Vec<Point>> {
        self.runs_since(0, most)
    }

    /// The unbroken segments from the time step `first` on.
    pub(super) fn runs_since(&self, first: usize, most: usize) -> Vec<Vec<Point>> {
        let mut curve = self.clone();
        curve.samples.retain(|sample| sample.0 >= first);
        curve.thin(most);
        let runs = curve.samples.chunk_by(|a, b| b.0 - a.0 <= 1 << curve.doublings);
        runs.map(|run| run.iter().map(|sample| sample.1).collect()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs(values: impl IntoIterator<Item = Option<f64>>) -> Vec<Vec<Point>> {
        let mut curve = Curve::default();
        (0..).zip(values).for_each(|(index, value)| curve.push(index, index as f64, value));
        curve.runs(MAX_POINTS)
    }

    #[test]
    fn missing_and_absurd_values_break_the_curve() {
        let runs = runs([Some(1.0), Some(2.0), None, Some(3.0), Some(f64::NAN), Some(4.0), Some(1e300)]);
        assert_eq!(runs, [vec![(0.0, 1.0), (1.0, 2.0)], vec![(3.0, 3.0)], vec![(5.0, 4.0)]]);
    }

    #[test]
    fn thinning_keeps_the_extent_of_a_path_on_both_axes() {
        let mut curve = Curve::default();
        (0..40).for_each(|i| curve.push(i, if i == 13 { -9.0 } else { 0.0 }, if i == 29 { 9.0 } else { 0.0 }));
        let kept = curve.runs(16).concat();
        assert!(kept.len() <= 16 && kept.contains(&(-9.0, 0.0)) && kept.contains(&(0.0, 9.0)));
        assert_eq!(curve.runs_since(38, 16).concat(), [(0.0, 0.0); 2]);
    }

    #[test]
    fn thinning_keeps_extremes_ends_and_long_gaps() {
        let spike = |i: i32| f64::from(i % 7) + if i == 12_345 { 50.0 } else { 0.0 };
        let runs = runs((0..30_001).map(|i| (!(5_000..9_000).contains(&i)).then(|| spike(i))));
        assert_eq!(runs.len(), 2);
        assert!((1000..=2000).contains(&(runs[0].len() + runs[1].len())));
        assert_eq!(runs[0].last(), Some(&(4_999.0, spike(4_999))));
        assert_eq!(runs[1].last(), Some(&(30_000.0, spike(30_000))));
        assert!(runs[1].contains(&(12_345.0, spike(12_345))));
    }
}
