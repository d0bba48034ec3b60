//! Rate of change of a direction, from its last samples.

use std::collections::VecDeque;

use standoff::{Angle, Duration, Time};

/// Time over which the rate is measured.
const WINDOW: Duration = Duration::from_us(300_000);

/// Longest time between the first and the last sample.
const WINDOW_MAX: Duration = Duration::from_us(1_000_000);

/// Samples of a direction over the window, and one older one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Directions {
    samples: VecDeque<(Time, Angle)>,
}

impl Directions {
    /// Adds a sample that is later than the last one.
    pub(crate) fn push(&mut self, at: Time, direction: Angle) {
        self.samples.push_back((at, direction));
        while self.samples.get(1).is_some_and(|(second_at, _)| at - *second_at >= WINDOW) {
            self.samples.pop_front();
        }
    }

    /// Removes all samples.
    pub(crate) fn clear(&mut self) {
        self.samples.clear();
    }

    /// Mean rate over the window, rad/s, positive to the left; `None` without samples over the window.
    pub(crate) fn rate_rad_s(&self) -> Option<f64> {
        let ((first_at, first), (last_at, last)) = (*self.samples.front()?, *self.samples.back()?);
        let time = last_at - first_at;
        (time >= WINDOW && time <= WINDOW_MAX).then(|| (last - first).rad() / time.s())
    }

    /// Last sample.
    pub(crate) fn last(&self) -> Option<(Time, Angle)> {
        self.samples.back().copied()
    }
}
