//! Histograms of metrics over runs.

use serde::Serialize;

/// Minimum and maximum number of bins if the values are not integers.
const BINS: (f64, f64) = (8.0, 60.0);

/// Number of runs of each batch per bin. The bins have equal widths and are the same for all batches.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Histogram {
    /// Lower bound of the first bin.
    from: f64,
    /// Width of each bin.
    width: f64,
    /// Counts by batch and bin.
    counts: Vec<Vec<u64>>,
}

impl Histogram {
    /// Makes the histogram of a metric from one list of values per batch; `None` without any value.
    ///
    /// Integers in a small range get one bin each. Otherwise the number of bins is the square root of the largest
    /// number of values. The upper bound of the last bin belongs to it.
    pub(super) fn of(columns: &[Vec<Option<f64>>]) -> Option<Self> {
        let columns: Vec<Vec<f64>> = columns
            .iter()
            .map(|column| column.iter().copied().flatten().filter(|value| value.is_finite()).collect())
            .collect();
        let values = || columns.iter().flatten().copied();
        let (least, most) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        let range = most - least;
        let largest = columns.iter().map(Vec::len).max().unwrap_or_default();
        let whole = range < BINS.1 && values().all(|value| value.fract() == 0.0);
        let (from, width, bins) = if whole {
            (least - 0.5, 1.0, range + 1.0)
        } else if range > f64::MIN_POSITIVE && range.is_finite() {
            let bins = (largest as f64).sqrt().ceil().clamp(BINS.0, BINS.1);
            (least, range / bins, bins)
        } else {
            // All values are equal: one bin, narrow relative to their size.
            let width = least.abs().max(1.0) / 100.0;
            (least - width / 2.0, width, 1.0)
        };
        let last = bins as usize - 1;
        let mut counts = vec![vec![0; last + 1]; columns.len()];
        for (counts, column) in counts.iter_mut().zip(&columns) {
            for value in column {
                counts[(((value - from) / width) as usize).min(last)] += 1;
            }
        }
        Some(Self { from, width, counts })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_counted_once_in_common_classes() {
        let (a, b) = (vec![Some(0.0), Some(0.5), None, Some(2.4)], vec![Some(4.0), Some(1.0)]);
        let histogram = Histogram::of(&[a, b]).unwrap();
        assert_eq!((histogram.from, histogram.width), (0.0, 0.5));
        assert_eq!(histogram.counts, [[1, 1, 0, 0, 1, 0, 0, 0], [0, 0, 1, 0, 0, 0, 0, 1]]);
    }

    #[test]
    fn integers_get_one_class_each() {
        let histogram = Histogram::of(&[vec![Some(2.0), Some(0.0), Some(2.0)]]).unwrap();
        assert_eq!(histogram, Histogram { from: -0.5, width: 1.0, counts: vec![vec![1, 0, 2]] });
    }

    #[test]
    fn equal_huge_and_missing_values_are_handled() {
        assert_eq!(Histogram::of(&[vec![Some(2.5); 3]]).unwrap().counts, [[3]]);
        assert_eq!(Histogram::of(&[vec![Some(1e300), Some(-1e300)]]).unwrap().counts.concat().iter().sum::<u64>(), 2);
        assert_eq!(Histogram::of(&[vec![Some(f64::MAX), Some(f64::MIN)]]).unwrap().counts, [[2]]);
        assert_eq!(Histogram::of(&[vec![None, Some(f64::NAN)]]), None);
    }
}
