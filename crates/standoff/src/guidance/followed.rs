//! Guidance over ground, and the loop that follows it.

use crate::angle::Angle;
use crate::uav::{Command, UavState};

/// Where a law leads a UAV, over ground. It does not depend on wind, lags or the autopilot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guidance {
    /// Desired course psi_d (23).
    pub course: Angle,
    /// Turn rate of the path, its curvature times the speed, rad/s, positive to the left (25).
    pub turn_rate_rad_s: f64,
    /// Ground speed, m/s.
    pub speed_m_s: f64,
    /// Distance of the UAV to the right of the path, m: outside an anticlockwise orbit, inside a clockwise one.
    pub right_of_path_m: f64,
    /// Rate a at which a UAV that follows the law comes nearer to the path, 1/s: d' = -a d; on an orbit v / (k_l r_d).
    pub closing_rate_1_s: f64,
}

/// Guidance, and the loop that follows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Followed {
    /// State over ground for which the guidance holds: that of a kinematic UAV one turn rate lag later.
    pub(crate) own: UavState,
    pub(crate) guidance: Guidance,
    /// Gain k_omega on the difference of the courses, 1/s.
    pub(crate) gain_1_s: f64,
}

impl Followed {
    /// A turn of a UAV in the state `own` over ground.
    pub(crate) fn turn(own: &UavState, Command { speed_m_s, turn_rate_rad_s }: Command) -> Self {
        let guidance =
            Guidance { course: own.heading, turn_rate_rad_s, speed_m_s, right_of_path_m: 0.0, closing_rate_1_s: 0.0 };
        Self { own: *own, guidance, gain_1_s: 0.0 }
    }

    /// Straight flight of a UAV in the state `own` to a course over ground, at a ground speed, m/s.
    pub(crate) fn straight(own: &UavState, course: Angle, speed_m_s: f64, gain_1_s: f64) -> Self {
        let turn = Self::turn(own, Command { speed_m_s, turn_rate_rad_s: 0.0 });
        Self { guidance: Guidance { course, ..turn.guidance }, gain_1_s, ..turn }
    }

    /// The same at another desired ground speed, m/s, which may be beyond the limits.
    pub(crate) fn at_speed(self, speed_m_s: f64) -> Self {
        Self { guidance: Guidance { speed_m_s, ..self.guidance }, ..self }
    }

    /// Course rate, rad/s, before limits.
    ///
    /// Implements Eq. (24).
    pub(crate) fn course_rate_rad_s(&self) -> f64 {
        self.guidance.turn_rate_rad_s - self.gain_1_s * (self.own.heading - self.guidance.course).rad()
    }
}
