//! The course that a UAV is foretold to fly: three arcs, one after the other.

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::frame::{Displacement, Position, Velocity};
use crate::guidance::heading::Steering;
use crate::math;
use crate::uav::{Command, UavState};

/// What a UAV is about to fly: it turns onto where it wants to go, and goes on from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Intent {
    pub(crate) command: Command,
    /// For so long, s; infinite: for good.
    pub(crate) for_s: f64,
    /// The turn rate after that, rad/s.
    pub(crate) then_rad_s: f64,
}

/// That of an orbit of 270 m at 40 m/s.
const FIELD_TURN_MAX_RAD_S: f64 = 0.15;

impl Intent {
    pub(crate) fn held(command: Command) -> Self {
        Self { command, for_s: f64::INFINITY, then_rad_s: command.turn_rate_rad_s }
    }

    /// A command of the guidance law, inside the limits: it is held until the heading is the desired one, which turns with
    /// the field.
    pub(crate) fn of(command: Command, heading: Angle, steering: &Steering) -> Self {
        let error_rad = (steering.desired_heading - heading).rad();
        // Near the centre the field turns faster than any UAV; by the time it is there, it is elsewhere.
        let then_max_rad_s = command.turn_rate_rad_s.abs().max(FIELD_TURN_MAX_RAD_S);
        let then_rad_s = steering.feedforward_rad_s.clamp(-then_max_rad_s, then_max_rad_s);
        let closing_rad_s = command.turn_rate_rad_s - then_rad_s;
        let for_s = if error_rad * closing_rad_s > 0.0 { error_rad / closing_rad_s } else { 0.0 };
        Self { command, for_s, then_rad_s }
    }
}

/// A turn, for ever.
#[derive(Debug, Clone, Copy)]
struct Arc {
    from: Position,
    /// The heading as a vector of length 1.
    ahead: [f64; 2],
    speed_m_s: f64,
    turn_rate_rad_s: f64,
}

impl Arc {
    fn of(state: &UavState) -> Self {
        let (sin, cos) = math::sin_cos(state.heading.rad());
        let UavState { position, speed_m_s, turn_rate_rad_s, .. } = *state;
        Self { from: position, ahead: [cos, sin], speed_m_s, turn_rate_rad_s }
    }

    /// What was flown after so long, and the sine and cosine of what was turned.
    #[inline]
    fn flown(&self, after_s: f64) -> (Displacement, (f64, f64)) {
        let (sin, cos) = math::sin_cos(self.turn_rate_rad_s * after_s);
        // Slower turns come to less than a centimetre in what is looked ahead.
        let (along_s, aside_s) = match self.turn_rate_rad_s {
            slow if slow.abs() < 1e-6 => (after_s, 0.0),
            turn => (sin / turn, (1.0 - cos) / turn),
        };
        let [x, y] = self.ahead.map(|part| part * self.speed_m_s);
        (Displacement::from_m(x * along_s - y * aside_s, y * along_s + x * aside_s), (sin, cos))
    }

    /// From there on, so long after, at another speed and turn rate.
    fn then(&self, after_s: f64, speed_m_s: f64, turn_rate_rad_s: f64) -> Self {
        let (flown, (sin, cos)) = self.flown(after_s);
        let [x, y] = self.ahead;
        Self { from: self.from + flown, ahead: [x * cos - y * sin, y * cos + x * sin], speed_m_s, turn_rate_rad_s }
    }
}

/// As it turns now, for the lag; as it is about to; and as it goes on then.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Course {
    arcs: [Arc; 3],
    /// When the second and the third begin, s.
    begin_s: [f64; 2],
    /// Now, s after the first began.
    age_s: f64,
    /// The hardest turn of all, and the change of speed, by which it leaves the straight line on which it began.
    turn_m_s2: f64,
    change_m_s: f64,
}

impl Course {
    /// From a state of so long ago on.
    pub(crate) fn of(state: &UavState, intent: Intent, lag_s: f64, age_s: f64) -> Self {
        let first = Arc::of(state);
        let begins = first.then(lag_s, state.speed_m_s, state.turn_rate_rad_s);
        let begin_s = [lag_s, f64::INFINITY];
        Self { arcs: [first, begins, begins], begin_s, age_s, turn_m_s2: 0.0, change_m_s: 0.0 }.with(intent)
    }

    /// The same with another intent.
    pub(crate) fn with(mut self, intent: Intent) -> Self {
        let Intent { command: Command { speed_m_s, turn_rate_rad_s }, for_s, then_rad_s } = intent;
        let second = Arc { speed_m_s, turn_rate_rad_s, ..self.arcs[1] };
        let third = if for_s.is_finite() { second.then(for_s, speed_m_s, then_rad_s) } else { second };
        (self.arcs[1], self.arcs[2], self.begin_s[1]) = (second, third, self.begin_s[0] + for_s);
        let turns_m_s2 = self.arcs.map(|arc| (arc.speed_m_s * arc.turn_rate_rad_s).abs());
        self.turn_m_s2 = turns_m_s2[0].max(turns_m_s2[1]).max(turns_m_s2[2]);
        self.change_m_s = (speed_m_s - self.arcs[0].speed_m_s).abs();
        self
    }

    /// Where it is so long from now.
    #[inline]
    pub(crate) fn at(&self, after_s: f64) -> Position {
        let ([first, second, third], [second_s, third_s]) = (&self.arcs, self.begin_s);
        let (arc, after_s) = match after_s + self.age_s {
            at_s if at_s < second_s => (first, at_s),
            at_s if at_s < third_s => (second, at_s - second_s),
            at_s => (third, at_s - third_s),
        };
        arc.from + arc.flown(after_s).0
    }

    pub(crate) fn fastest_m_s(&self) -> f64 {
        self.arcs[0].speed_m_s.abs().max(self.arcs[1].speed_m_s.abs())
    }

    /// Two do not come nearer than this within a time, m; mostly they stay much further apart.
    pub(crate) fn apart_m(&self, other: &Self, within_s: f64) -> f64 {
        let ((from, velocity, off_m), (its_from, its_velocity, its_off_m)) =
            (self.straight_on(within_s), other.straight_on(within_s));
        let (away, opening) = ((from - its_from).vector(), velocity - its_velocity);
        let nearest_s = (-away.dot(&opening) / opening.norm_squared().max(1e-12)).clamp(0.0, within_s);
        (away + opening * nearest_s).norm() - off_m - its_off_m
    }

    /// Where it were now if it had flown straight on from where it began, its velocity then, m/s, and how far off that it is
    /// at most within a time, m.
    fn straight_on(&self, within_s: f64) -> (Position, Vector2<f64>, f64) {
        let [Arc { from, ahead: [x, y], speed_m_s, .. }, ..] = self.arcs;
        let velocity = Velocity::from_m_s(x * speed_m_s, y * speed_m_s);
        let flown_s = self.age_s + within_s;
        let off_m = (0.5 * self.turn_m_s2 * flown_s + self.change_m_s) * flown_s;
        (from + velocity * self.age_s, velocity.vector(), off_m)
    }
}
