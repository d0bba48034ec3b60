//! Mission time as integer microseconds; the library never reads a clock.

use core::ops::{Add, Sub};

/// Point in time, microseconds since the start of the mission.
///
/// ```
/// use standoff::{Duration, Time};
///
/// let period = Duration::from_s(0.5);
/// let third = Time::EPOCH + period + period;
/// assert_eq!((third.us(), third.s()), (1_000_000, 1.0));
/// assert_eq!(third - Time::EPOCH, Duration::from_s(1.0));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct Time(i64);

/// Time difference, microseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct Duration(i64);

impl Time {
    /// The start of the mission.
    pub const EPOCH: Self = Self(0);

    /// Creates a time from microseconds since the start of the mission.
    pub const fn from_us(us: i64) -> Self {
        Self(us)
    }

    /// Microseconds since the start of the mission.
    pub const fn us(self) -> i64 {
        self.0
    }

    /// Seconds since the start of the mission.
    pub fn s(self) -> f64 {
        self.0 as f64 / 1e6
    }
}

/// The team's grid of time steps: whole periods since [`Time::EPOCH`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimeGrid {
    pub(crate) period: Duration,
}

impl TimeGrid {
    /// Time step of a time: the nearest one, if it is within a tenth of a period.
    pub(crate) fn step(self, time: Time) -> Option<i64> {
        let (us, period) = (time.us(), self.period.us());
        let nearest = us.saturating_add(period / 2).div_euclid(period);
        let off = us.saturating_sub(nearest.saturating_mul(period));
        (off.abs() <= period / 10).then_some(nearest)
    }

    /// Time step of a time that may be off the grid.
    pub(crate) fn step_at(self, time: Time) -> i64 {
        time.us().div_euclid(self.period.us())
    }

    /// Number of periods in which a duration has passed.
    pub(crate) fn periods(self, duration: Duration) -> i64 {
        (duration.us() + self.period.us() - 1) / self.period.us()
    }

    pub(crate) fn time(self, step: i64) -> Time {
        Time::from_us(step.saturating_mul(self.period.us()))
    }
}

impl Duration {
    /// Zero duration.
    pub const ZERO: Self = Self(0);

    /// Creates a duration from microseconds.
    pub const fn from_us(us: i64) -> Self {
        Self(us)
    }

    /// Creates a duration from seconds, rounded to the nearest microsecond; saturates.
    pub fn from_s(s: f64) -> Self {
        Self((s * 1e6).round() as i64)
    }

    /// Microseconds.
    pub const fn us(self) -> i64 {
        self.0
    }

    /// Seconds.
    pub const fn s(self) -> f64 {
        self.0 as f64 / 1e6
    }
}

impl Add<Duration> for Time {
    type Output = Self;
    fn add(self, later: Duration) -> Self {
        Self(self.0.saturating_add(later.0))
    }
}

impl Add for Duration {
    type Output = Self;
    fn add(self, more: Self) -> Self {
        Self(self.0.saturating_add(more.0))
    }
}

impl Sub for Time {
    type Output = Duration;
    fn sub(self, earlier: Self) -> Duration {
        Duration(self.0.saturating_sub(earlier.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_hundred_half_seconds_are_exactly_a_hundred_seconds() {
        let mut now = Time::EPOCH;
        for _ in 0..200 {
            now = now + Duration::from_s(0.5);
        }
        assert_eq!(now, Time::from_us(100_000_000));
        assert_eq!((now - Time::EPOCH).s(), 100.0);
    }

    #[test]
    fn times_at_the_ends_of_the_range_do_not_overflow() {
        assert_eq!(Time::from_us(i64::MAX) + Duration::from_us(1), Time::from_us(i64::MAX));
        assert_eq!((Time::from_us(i64::MIN) - Time::from_us(1)).us(), i64::MIN);
    }
}
