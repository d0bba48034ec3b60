//! A running mean.

/// Sum and number of the added values.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mean {
    pub(crate) sum: f64,
    pub(crate) n: u64,
}

impl Mean {
    pub(crate) fn add(&mut self, value: f64) {
        self.sum += value;
        self.n += 1;
    }

    pub(crate) fn value(&self) -> Option<f64> {
        (self.n > 0).then(|| self.sum / self.n as f64)
    }

    pub(crate) fn and(self, other: Self) -> Self {
        Self { sum: self.sum + other.sum, n: self.n + other.n }
    }
}

/// Weighted mean of values with integer weights. The mean of equal values is bitwise equal to that value.
pub(crate) fn weighted(values: impl Iterator<Item = (f64, u64)>) -> Option<f64> {
    let mut values = values.filter(|(_, times)| *times > 0);
    let (first, times) = values.next()?;
    let (off, times) =
        values.fold((0.0, times), |(off, all), (value, times)| (off + (value - first) * times as f64, all + times));
    Some(first + off / times as f64)
}

/// Returns a count per minute of these time steps; `None` without a time step.
pub(crate) fn per_min(count: u64, time_steps: u64, period_s: f64) -> Option<f64> {
    (time_steps > 0).then(|| count as f64 / (time_steps as f64 * period_s / 60.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_of_equal_values_is_that_value() {
        let value = 0.1 + 0.2;
        assert_eq!(weighted([(value, 3), (value, 7), (1.0, 0)].into_iter()), Some(value));
        assert_eq!(weighted([(1.0, 1), (3.0, 3)].into_iter()), Some(2.5));
        assert_eq!(weighted([(1.0, 0)].into_iter()), None);
    }
}
