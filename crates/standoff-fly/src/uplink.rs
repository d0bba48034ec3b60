//! Whether commands arrive at the autopilot: from its answers, and from the roll, which must follow the roll targets.
//!
//! ArduPlane holds a roll target for 3 s, so a lost link does not change the roll of a steady turn. The answers show it:
//! the last airspeed is commanded again and again, because roll targets have no answer. Time counts only while telemetry
//! arrives, so a gap of the whole link is not a lost uplink.

use std::collections::VecDeque;

use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};
use standoff::{Duration, Time};

use crate::command;

/// Time after which the last airspeed is commanded again, so that an answer is due.
const PROBE_PERIOD: Duration = Duration::from_us(250_000);

/// Time without an answer after which commands do not arrive: six probes.
const UNANSWERED_MAX: Duration = Duration::from_us(1_500_000);

/// Age up to which roll targets bound the measured roll. After a step, ArduPlane's roll was 63 % of the way after 0.45 s,
/// and within 9 % of it after 1 s.
const RESPONSE: Duration = Duration::from_us(1_000_000);

/// Time outside the bounds after which the roll does not follow.
const ASTRAY_MAX: Duration = Duration::from_us(800_000);

/// Distance of the bounds from the roll targets, rad: gusts, and the error of a slow roll.
const MARGIN_RAD: f64 = 0.21;

/// Part of the change of the roll targets that is added to the bounds: the roll overshoots by 16 % of a step.
const OVERSHOOT: f64 = 0.25;

/// Roll up to which the autopilot may limit roll targets, rad: 20 degrees. ArduPlane allows at least 25 degrees when it
/// prevents a stall.
const LIMITED_ROLL_RAD: f64 = 0.349;

/// Evidence about the uplink since commands began.
#[derive(Debug, Clone, Default)]
pub(crate) struct Uplink {
    /// Roll targets of the last [`RESPONSE`], and one older one: time and roll, rad.
    rolls: VecDeque<(Time, f64)>,
    /// Last command of an airspeed.
    airspeed: Option<MavMessage>,
    /// Last time at which a command with an answer was sent.
    sent_at: Option<Time>,
    unanswered: Duration,
    astray: Duration,
}

impl Uplink {
    /// Adds the probe that is due to the messages of a step, and remembers what is sent.
    pub(crate) fn send(&mut self, now: Time, messages: &mut Vec<MavMessage>) {
        for message in messages.iter() {
            match message {
                MavMessage::COMMAND_INT(int) => {
                    self.sent_at = Some(now);
                    if int.command == MavCmd::MAV_CMD_GUIDED_CHANGE_SPEED {
                        self.airspeed = Some(message.clone());
                    }
                }
                MavMessage::SET_ATTITUDE_TARGET(target) => {
                    self.rolls.push_back((now, command::roll_of(target)));
                }
                _ => {}
            }
        }
        while self.rolls.get(1).is_some_and(|(second_at, _)| now - *second_at >= RESPONSE) {
            self.rolls.pop_front();
        }
        if self.sent_at.is_none_or(|at| now - at >= PROBE_PERIOD) && self.airspeed.is_some() {
            self.sent_at = Some(now);
            messages.extend(self.airspeed.clone());
        }
    }

    /// Last roll target, rad.
    pub(crate) fn last_roll_rad(&self) -> Option<f64> {
        self.rolls.back().map(|(_, roll_rad)| *roll_rad)
    }

    /// Takes in what has arrived in the time since the last call: whether a command was answered, and the measured roll,
    /// rad; `None` if there is no new one.
    pub(crate) fn hear(&mut self, passed: Duration, is_answered: bool, roll_rad: Option<f64>) {
        if is_answered {
            self.unanswered = Duration::from_us(0);
        } else if roll_rad.is_some() {
            self.unanswered = self.unanswered + passed;
        }
        match roll_rad {
            Some(roll_rad) if !self.is_followed_by(roll_rad) => self.astray = self.astray + passed,
            Some(_) => self.astray = Duration::from_us(0),
            None => {}
        }
    }

    /// True if the roll is within the bounds that the last targets give.
    fn is_followed_by(&self, roll_rad: f64) -> bool {
        let targets = || self.rolls.iter().map(|(_, target_rad)| *target_rad);
        let (lowest, highest) = (targets().fold(f64::INFINITY, f64::min), targets().fold(-f64::INFINITY, f64::max));
        if lowest > highest {
            return true;
        }
        let margin = MARGIN_RAD + OVERSHOOT * (highest - lowest);
        (lowest.min(LIMITED_ROLL_RAD) - margin..=highest.max(-LIMITED_ROLL_RAD) + margin).contains(&roll_rad)
    }

    /// What shows that commands do not arrive or are not followed; `None` without such evidence.
    pub(crate) fn failure(&self) -> Option<&'static str> {
        if self.unanswered >= UNANSWERED_MAX {
            Some("the autopilot does not answer commands")
        } else if self.astray >= ASTRAY_MAX {
            Some("the roll does not follow the commands")
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use standoff::math::PI;

    use super::*;

    const STEP: Duration = Duration::from_us(100_000);

    /// Roll of an aircraft with the identified response: a limited second-order lag with dead time, at 1 kHz.
    struct Aircraft {
        /// Roll targets of the dead time, oldest first, rad.
        waiting: VecDeque<f64>,
        roll_rad: f64,
        rate_rad_s: f64,
        /// Largest roll that the autopilot allows, rad.
        limit_rad: f64,
    }

    impl Aircraft {
        fn new(limit_rad: f64) -> Self {
            Self { waiting: vec![0.0; 88].into(), roll_rad: 0.0, rate_rad_s: 0.0, limit_rad }
        }

        fn fly(&mut self, target_rad: f64, gust_rad: f64) -> f64 {
            let (natural_rad_s, damping) = (5.78, 0.477);
            for _ in 0..100 {
                self.waiting.push_back(target_rad.clamp(-self.limit_rad, self.limit_rad));
                let target_rad = self.waiting.pop_front().unwrap();
                let desired = natural_rad_s / (2.0 * damping) * (target_rad - self.roll_rad);
                self.rate_rad_s +=
                    1e-3 * 2.0 * damping * natural_rad_s * (desired.clamp(-1.86, 1.86) - self.rate_rad_s);
                self.roll_rad += 1e-3 * self.rate_rad_s;
            }
            self.roll_rad + gust_rad
        }
    }

    fn now(step: i64) -> Time {
        Time::from_us(step * STEP.us())
    }

    /// Sends roll targets at 10 Hz for 60 s; returns whether a failure was stated.
    fn is_alarmed(limit_rad: f64, target_rad: impl Fn(f64) -> f64, gust_rad: impl Fn(f64) -> f64) -> bool {
        let (mut uplink, mut aircraft) = (Uplink::default(), Aircraft::new(limit_rad));
        (0..600).any(|step| {
            let time_s = 0.1 * step as f64;
            uplink.send(now(step), &mut vec![command::roll(1, target_rad(time_s))]);
            let roll_rad = aircraft.fly(target_rad(time_s), gust_rad(time_s));
            uplink.hear(STEP, true, Some(roll_rad));
            uplink.failure().is_some()
        })
    }

    fn sin(x: f64) -> f64 {
        standoff::math::sin_cos(x).0
    }

    /// Steps between the limits, the limit cycle that ArduPlane's simulator showed, targets that the autopilot limits, and
    /// gusts that roll the aircraft by 25 degrees.
    #[test]
    fn a_roll_that_follows_its_targets_late_limited_or_in_gusts_is_no_lost_uplink() {
        let square =
            |period_s: f64| move |time_s: f64| if time_s.rem_euclid(period_s) < 0.5 * period_s { 1.05 } else { -1.05 };
        for period_s in [0.4, 1.0, 2.0, 2.5, 4.0, 6.0, 20.0] {
            assert!(!is_alarmed(1.2, square(period_s), |_| 0.0), "steps, {period_s} s");
            let cycle = |time_s: f64| sin(2.0 * PI * time_s / period_s);
            assert!(!is_alarmed(1.2, cycle, |_| 0.0), "cycle, {period_s} s");
            assert!(!is_alarmed(0.436, cycle, |_| 0.0), "cycle within 25 degrees, {period_s} s");
        }
        for period_s in [0.4, 0.7, 1.0, 1.5, 2.0] {
            let gust = |time_s: f64| 0.436 * sin(2.0 * PI * time_s / period_s);
            assert!(!is_alarmed(1.2, |_| 0.5, gust), "gusts, {period_s} s");
        }
        assert!(!is_alarmed(0.436, |_| 1.05, |_| 0.0), "25 degrees instead of 60");
    }

    /// The aircraft keeps its roll, or flies another one.
    #[test]
    fn a_roll_that_does_not_follow_is_stated_within_2_s() {
        for (target_rad, roll_rad) in [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.4, -0.4), (1.0, -0.2)] {
            let mut uplink = Uplink::default();
            let mut alarm_s = None;
            for step in 0..100 {
                // The targets change from the roll at 5 s.
                let target_rad = if step < 50 { roll_rad } else { target_rad };
                uplink.send(now(step), &mut vec![command::roll(1, target_rad)]);
                uplink.hear(STEP, true, Some(roll_rad));
                if uplink.failure().is_some() && alarm_s.is_none() {
                    alarm_s = Some(0.1 * step as f64 - 5.0);
                    assert_eq!(uplink.failure(), Some("the roll does not follow the commands"));
                }
            }
            assert!(alarm_s.is_some_and(|s| (0.5..=2.0).contains(&s)), "{target_rad} {roll_rad}: {alarm_s:?}");
        }
    }

    #[test]
    fn missing_answers_count_only_while_telemetry_arrives_and_probes_ask_for_them() {
        let mut uplink = Uplink::default();
        let airspeed = command::airspeed(1, 20.0);
        uplink.send(now(0), &mut vec![airspeed.clone()]);
        let mut probes = 0;
        for step in 1..=40 {
            let mut messages = vec![command::roll(1, 0.2)];
            uplink.send(now(step), &mut messages);
            probes += messages.iter().filter(|message| **message == airspeed).count();
            // No telemetry for 2 s.
            uplink.hear(STEP, false, (step > 20).then_some(0.2));
            assert_eq!(uplink.failure().is_some(), step >= 35, "{step}");
        }
        assert!((12..=14).contains(&probes), "{probes}");
        uplink.hear(STEP, true, Some(0.2));
        assert_eq!(uplink.failure(), None);
    }
}
