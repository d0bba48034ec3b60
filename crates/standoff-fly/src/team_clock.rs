//! The team's time, which is that of the clocks of the aircraft, from the time of this program, which is monotonic.
//!
//! The clock of a computer can be set. Then the team's time goes on without a step until nothing is commanded, and only
//! then follows the clock.

use standoff::{Duration, Time};

/// Zero of the team's time: 2026-01-01 00:00 UTC, seconds of UNIX time. It is fixed, so that all aircraft of a team, and
/// programs that restart, have the same time steps.
const EPOCH_UNIX_S: i64 = 1_767_225_600;

/// Largest difference between the clock and the team's time that is no step of the clock: the team's clocks agree within
/// 50 ms.
const ERROR_MAX: Duration = Duration::from_us(50_000);

/// Time in which the team's time follows a smaller difference by 1 us.
const FOLLOW_1_US: i64 = 1_000;

/// Converts the team's time to UNIX time, both in microseconds.
pub(crate) fn unix_us(team_us: i64) -> i64 {
    team_us.saturating_add(EPOCH_UNIX_S * 1_000_000)
}

/// Converts UNIX time to the team's time, both in microseconds.
pub(crate) fn team_us(unix_us: i64) -> i64 {
    unix_us.saturating_sub(EPOCH_UNIX_S * 1_000_000)
}

/// Relation of the team's time to the time of this program.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct TeamClock {
    /// The team's time less the time of this program.
    offset: Duration,
    /// The clock's time less the team's time.
    error: Duration,
    heard_at: Option<Time>,
}

impl TeamClock {
    /// Takes over the time of the clock at `now`. `is_free`: nothing is commanded, so the team's time may have a step.
    pub(crate) fn hear(&mut self, now: Time, clock: Time, is_free: bool) {
        let offset = clock - now;
        self.error = Duration::from_us(offset.us().saturating_sub(self.offset.us()));
        let Some(heard_at) = self.heard_at.replace(now) else {
            (self.offset, self.error) = (offset, Duration::from_us(0));
            return;
        };
        if !self.is_set() {
            let change_us = (now - heard_at).us() / FOLLOW_1_US;
            self.offset = self.offset + Duration::from_us(self.error.us().clamp(-change_us, change_us));
        } else if is_free {
            (self.offset, self.error) = (offset, Duration::from_us(0));
        }
    }

    /// True if the clock was set, and the team's time has not followed.
    pub(crate) fn is_set(&self) -> bool {
        self.error.us().saturating_abs() > ERROR_MAX.us()
    }

    /// Time by which the clock was set, positive if forward; zero if it was not set.
    pub(crate) fn error(&self) -> Duration {
        self.error
    }

    /// The team's time at a time of this program.
    pub(crate) fn team(&self, at: Time) -> Time {
        at + self.offset
    }

    /// The time of this program at a time of the team.
    pub(crate) fn own(&self, at: Time) -> Time {
        Time::from_us(at.us().saturating_sub(self.offset.us()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn s(seconds: f64) -> Time {
        Time::from_us((seconds * 1e6) as i64)
    }

    #[test]
    fn a_step_of_the_clock_changes_the_teams_time_only_while_nothing_is_commanded() {
        for step_s in [-1e5, -0.06, 0.06, 1.0, 1e5] {
            let mut clock = TeamClock::default();
            clock.hear(s(5.0), s(1000.0), false);
            assert_eq!((clock.team(s(6.0)), clock.own(s(1001.0)), clock.is_set()), (s(1001.0), s(6.0), false));
            clock.hear(s(6.0), s(1001.0 + step_s), false);
            assert!(clock.is_set());
            assert_eq!((clock.team(s(7.0)), clock.error()), (s(1002.0), Duration::from_s(step_s)));
            clock.hear(s(7.0), s(1002.0 + step_s), true);
            assert_eq!((clock.is_set(), clock.team(s(8.0))), (false, s(1003.0 + step_s)));
        }
    }

    #[test]
    fn a_clock_that_is_adjusted_slowly_is_followed_without_a_step() {
        let mut clock = TeamClock::default();
        for tenths in 0..10_000i32 {
            let now_s = 0.1 * f64::from(tenths);
            // 500 ppm.
            clock.hear(s(now_s), s(now_s * 1.0005), false);
            assert!(!clock.is_set());
        }
        assert!((clock.team(s(999.9)) - s(999.9 * 1.0005)).us().abs() < 1_000);
    }
}
