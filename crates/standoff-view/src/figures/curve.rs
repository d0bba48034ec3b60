//! A curve that is thinned while it streams in, so that a run of any length stays small.

/// Most points of a curve.
pub(super) const MOST_POINTS: usize = 2_000;
/// Beyond this a value is no physical quantity.
const ABSURD: f64 = 1e9;

/// A point of a chart: time and value, or east and north.
pub(super) type Point = (f64, f64);

/// The value if it can be drawn.
pub(super) fn usable(value: f64) -> Option<f64> {
    (value.abs() <= ABSURD).then_some(value)
}

/// A curve with gaps where a value is missing.
///
/// When there are too many points, each stride of instants keeps its ends and its extremes. A gap no
/// longer than the stride is below what a figure resolves and is joined across.
#[derive(Debug, Clone, Default)]
pub(super) struct Curve {
    doublings: u32,
    samples: Vec<(usize, Point)>,
}

impl Curve {
    /// Adds the point of an instant, if it can be drawn; instants come in order.
    pub(super) fn push(&mut self, index: usize, x: f64, y: impl Into<Option<f64>>) {
        self.samples.extend(usable(x).zip(y.into().and_then(usable)).map(|at| (index, at)));
        if self.samples.len() > 2 * MOST_POINTS {
            self.thin(MOST_POINTS);
        }
    }

    fn thin(&mut self, most: usize) {
        loop {
            let mut kept: Vec<(usize, Point)> = Vec::new();
            for bucket in self.samples.chunk_by(|a, b| a.0 >> self.doublings == b.0 >> self.doublings) {
                let height = |a: &&(usize, Point), b: &&(usize, Point)| a.1.1.total_cmp(&b.1.1);
                let extremes = [bucket.iter().min_by(height), bucket.iter().max_by(height)];
                let mut bucket = [bucket.first(), extremes[0], extremes[1], bucket.last()];
                bucket.sort_by_key(|sample| sample.map(|sample| sample.0));
                kept.extend(bucket.into_iter().flatten());
            }
            kept.dedup_by_key(|sample| sample.0);
            self.samples = kept;
            if self.samples.len() <= most.max(4) {
                return;
            }
            self.doublings += 1;
        }
    }

    /// The unbroken stretches of the curve, of at most `most` points in all.
    pub(super) fn runs(&self, most: usize) -> Vec<Vec<Point>> {
        let mut curve = self.clone();
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
        curve.runs(MOST_POINTS)
    }

    #[test]
    fn a_missing_or_absurd_value_breaks_the_curve() {
        let runs = runs([Some(1.0), Some(2.0), None, Some(3.0), Some(f64::NAN), Some(4.0), Some(1e300)]);
        assert_eq!(runs, [vec![(0.0, 1.0), (1.0, 2.0)], vec![(3.0, 3.0)], vec![(5.0, 4.0)]]);
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
