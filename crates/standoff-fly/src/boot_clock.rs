//! Time of samples from the autopilot's clock.
//!
//! A sample that waited in a buffer arrives late, but its time stamp shows when it was taken. The difference between the
//! two clocks is the smallest difference between arrival and time stamp so far, or since it was forgotten.

use standoff::{Duration, Time};

/// Time in which the clocks may drift apart by 1 us: 2,000 ppm.
const DRIFT_1_US: i64 = 500;

/// Maximum time by which a time stamp may jump ahead of the time that has passed here.
const JUMP_MAX_US: i64 = 10_000_000;

/// Time without accepted samples after which the clock starts again: the autopilot has restarted.
const RESTART_AFTER: Duration = Duration::from_us(5_000_000);

/// A sample that is newer by at most this is the same one: the offset drifts by this much until the clock starts again.
const REPEATED_MAX: Duration = Duration::from_us(RESTART_AFTER.us() / DRIFT_1_US);

/// Difference to the expected time stamp from which on a sample is one of another autopilot, us.
const OTHER_MIN_US: i64 = 2_000_000;

/// Number of changes between the time stamps of two autopilots, each soon after the one before, that show two.
const DOUBLED_MIN: u32 = 10;

/// Longest time between two of these changes.
const CHANGE_MAX: Duration = Duration::from_us(2_000_000);

/// Relation of the autopilot's clock to the clock of this program.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct BootClock {
    last: Option<Accepted>,
    /// The next sample gives the difference between the clocks.
    is_forgotten: bool,
    /// The last sample had the time stamp of another autopilot.
    is_other: bool,
    /// Number of times that the time stamps have changed to those of another autopilot and back, and the last time.
    changes: (u32, Option<Time>),
}

/// Last accepted sample of any kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Accepted {
    boot_us: i64,
    arrived_at: Time,
    /// Smallest difference between arrival and time stamp, us.
    offset_us: i64,
}

impl BootClock {
    /// Returns the time of a sample that arrived at `now`; `None` if it is to be dropped, because it is not newer than
    /// `last_at`, the time of the last sample of its kind, or because its time stamp is implausible.
    pub(crate) fn sample_at(&mut self, boot_ms: u32, now: Time, last_at: Option<Time>) -> Option<Time> {
        let boot_us = i64::from(boot_ms) * 1000;
        let difference_us = now.us().saturating_sub(boot_us);
        let known = self.last.filter(|last| now - last.arrived_at <= RESTART_AFTER && now >= last.arrived_at);
        let Some(last) = known else {
            // The autopilot has restarted.
            *self =
                Self { last: Some(Accepted { boot_us, arrived_at: now, offset_us: difference_us }), ..Self::default() };
            return Some(now);
        };
        let passed_us = (now - last.arrived_at).us();
        let is_other = (boot_us - last.boot_us - passed_us).abs() > OTHER_MIN_US;
        if self.is_other && !is_other {
            let (count, changed_at) = self.changes;
            let is_soon = changed_at.is_some_and(|at| now - at <= CHANGE_MAX);
            self.changes = (if is_soon { count.saturating_add(1) } else { 1 }, Some(now));
        }
        self.is_other = is_other;
        if boot_us - last.boot_us > passed_us + JUMP_MAX_US {
            return None;
        }
        let is_forgotten = self.is_forgotten && boot_us > last.boot_us;
        let followed_us = difference_us.min(last.offset_us + passed_us / DRIFT_1_US);
        let offset_us = if is_forgotten { difference_us } else { followed_us };
        let at = Time::from_us(boot_us.saturating_add(offset_us));
        if last_at.is_some_and(|last_at| at - last_at <= REPEATED_MAX) {
            return None;
        }
        self.last = Some(Accepted { boot_us: boot_us.max(last.boot_us), arrived_at: now, offset_us });
        self.is_forgotten &= !is_forgotten;
        Some(at)
    }

    /// Forgets the difference between the clocks: the next sample counts as new.
    pub(crate) fn forget_offset(&mut self) {
        self.is_forgotten = true;
    }

    /// True if the time stamps are those of two autopilots.
    pub(crate) fn is_doubled(&self) -> bool {
        self.changes.0 >= DOUBLED_MIN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn s(seconds: f64) -> Time {
        Time::from_us((seconds * 1e6) as i64)
    }

    #[test]
    fn samples_that_waited_in_a_buffer_keep_the_time_at_which_they_were_taken() {
        let mut clock = BootClock::default();
        assert_eq!(clock.sample_at(1_000, s(100.0), None), Some(s(100.0)));
        assert_eq!(clock.sample_at(1_100, s(100.1), Some(s(100.0))), Some(s(100.1)));
        // The program was paused: three samples arrive together.
        let late = [1_200, 2_000, 2_900].map(|boot_ms| clock.sample_at(boot_ms, s(102.0), Some(s(100.1))).unwrap());
        for (at, expected) in late.into_iter().zip([100.2, 101.0, 101.9]) {
            assert!((at - s(expected)).us().abs() < 5_000, "{at:?} {expected}");
        }
    }

    #[test]
    fn repeated_old_and_far_future_samples_are_dropped_until_the_autopilot_restarts() {
        let mut clock = BootClock::default();
        let at = clock.sample_at(500_000, s(100.0), None);
        assert_eq!(clock.sample_at(500_000, s(100.5), at), None);
        assert_eq!(clock.sample_at(400_000, s(100.5), at), None);
        assert_eq!(clock.sample_at(600_000, s(100.5), at), None);
        assert_eq!(clock.sample_at(u32::MAX, s(100.5), at), None);
        assert!(clock.sample_at(500_600, s(100.6), at).is_some());
        // After 5 s without a valid sample, any time stamp starts again.
        assert_eq!(clock.sample_at(3_000, s(105.5), at), None);
        assert_eq!(clock.sample_at(3_200, s(105.7), at), Some(s(105.7)));
    }

    /// A simulator that was held for 1.6 s, or a link whose delay has grown: samples stay old until the offset is
    /// forgotten, and are new from the next one on. Old samples stay dropped.
    #[test]
    fn a_forgotten_offset_is_known_again_with_the_next_sample() {
        let mut clock = BootClock::default();
        let mut at = clock.sample_at(1_000, s(100.0), None);
        for tenth in 1..100u32 {
            at = clock.sample_at(1_000 + 100 * tenth, s(101.6 + 0.1 * f64::from(tenth)), at);
            let delay_s = (s(101.6 + 0.1 * f64::from(tenth)) - at.unwrap()).s();
            assert!((1.5..=1.6).contains(&delay_s), "{delay_s}");
        }
        clock.forget_offset();
        assert_eq!(clock.sample_at(10_000, s(111.65), at), None, "an old sample");
        assert_eq!(clock.sample_at(11_000, s(111.7), at), Some(s(111.7)));
    }

    #[test]
    fn time_stamps_that_jump_to_and_fro_are_those_of_two_autopilots() {
        let mut clock = BootClock::default();
        // A program that is paused every 3 s receives samples late, but from one autopilot.
        for second in 0..60u32 {
            let at = s(100.0 + f64::from(3 * (second / 3)));
            clock.sample_at(1_000 + 1_000 * second, at, None);
            assert!(!clock.is_doubled());
        }
        for tenth in 600..620u32 {
            let at = s(100.0 + 0.1 * f64::from(tenth));
            clock.sample_at(1_000 + 100 * tenth, at, None);
            clock.sample_at(300_000 + 100 * tenth, at, None);
        }
        assert!(clock.is_doubled());
    }
}
