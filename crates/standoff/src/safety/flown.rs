//! The last decision of a UAV, which its present motion follows from.

use crate::params::UavParams;
use crate::safety::fallback::Plan;
use crate::safety::motion::Motion;
use crate::time::Time;
use crate::uav::{Command, UavState};

/// Longest duration of a command, s; after it, the motion that it has caused is unknown.
const FLOWN_MAX_S: f64 = 10.0;

/// Motion of a UAV at a decision, and that decision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Flown {
    pub(crate) from: Time,
    pub(crate) motion: Motion,
    pub(crate) command: Command,
    /// Circle that stays clear of all outlines.
    pub(crate) plan: Option<Plan>,
}

impl Flown {
    /// Time since the decision, s; `None` if it is too long ago.
    pub(crate) fn age_s(&self, now: Time) -> Option<f64> {
        Some((now - self.from).s()).filter(|age_s| (0.0..=FLOWN_MAX_S).contains(age_s))
    }

    /// Mean acceleration since the decision, m/s2, to an airspeed, m/s.
    pub(crate) fn acceleration_m_s2(&self, now: Time, airspeed_m_s: f64) -> f64 {
        let age_s = self.age_s(now).filter(|age_s| *age_s > 0.0);
        age_s.map_or(0.0, |age_s| (airspeed_m_s - self.motion.state.speed_m_s) / age_s)
    }

    /// The motion at the next decision: the bank angle is that of the turn rate, its command the predicted one. Without
    /// a decision before it, or long after it, the UAV is in a steady turn.
    pub(crate) fn motion(flown: Option<&Self>, uav: &UavParams, state: &UavState, now: Time) -> Motion {
        let mut motion = Motion::steady(uav, state);
        if let Some((bank, (flown, age_s))) = uav.bank.zip(flown.and_then(|flown| Some((flown, flown.age_s(now)?)))) {
            let predicted = bank.predicted(uav, &flown.motion, flown.command, age_s);
            motion = motion.with_bank_command_of(&predicted);
        }
        motion
    }
}
