//! Predicted trajectory of a UAV: three consecutive arcs.

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::frame::{Displacement, Position, Velocity};
use crate::guidance::heading::Steering;
use crate::math;
use crate::params::UavParams;
use crate::uav::{Command, UavState};

/// Intent of a UAV: a command that is held for a time, followed by a constant turn rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Intent {
    pub(crate) command: Command,
    /// Duration of the command, s; may be infinite.
    pub(crate) for_s: f64,
    /// Turn rate afterwards, rad/s.
    pub(crate) turn_rate_after_rad_s: f64,
}

/// Maximum predicted turn rate of the field, rad/s; an orbit of 270 m at 40 m/s has this turn rate.
const FIELD_TURN_MAX_RAD_S: f64 = 0.15;

impl Intent {
    /// Intent to hold a command indefinitely.
    pub(crate) fn held(command: Command) -> Self {
        Self { command, for_s: f64::INFINITY, turn_rate_after_rad_s: command.turn_rate_rad_s }
    }

    /// Intent of a UAV that follows the guidance law: it holds the command, which is within the limits, until it has
    /// reached the desired heading, which turns with the field.
    pub(crate) fn of(command: Command, heading: Angle, steering: &Steering) -> Self {
        let error_rad = (steering.desired_heading - heading).rad();
        // Near the centre the field turns faster than any UAV, but the UAV will have left that region by then.
        let then_max_rad_s = command.turn_rate_rad_s.abs().max(FIELD_TURN_MAX_RAD_S);
        let turn_rate_after_rad_s = steering.feedforward_rad_s.clamp(-then_max_rad_s, then_max_rad_s);
        let closing_rad_s = command.turn_rate_rad_s - turn_rate_after_rad_s;
        let for_s = if error_rad * closing_rad_s > 0.0 { error_rad / closing_rad_s } else { 0.0 };
        Self { command, for_s, turn_rate_after_rad_s }
    }
}

/// An arc of constant turn rate, without end, on which the speed changes to its final value at a constant rate.
#[derive(Debug, Clone, Copy)]
struct Arc {
    from: Position,
    /// Heading as a unit vector.
    ahead: [f64; 2],
    /// Final speed, m/s, which is reached after `change_s` seconds, and what the initial one exceeds it by.
    speed_m_s: f64,
    excess_m_s: f64,
    change_s: f64,
    turn_rate_rad_s: f64,
}

impl Arc {
    fn of(state: &UavState) -> Self {
        let (sin, cos) = math::sin_cos(state.heading.rad());
        let UavState { position, speed_m_s, turn_rate_rad_s, .. } = *state;
        Self { from: position, ahead: [cos, sin], speed_m_s, excess_m_s: 0.0, change_s: 0.0, turn_rate_rad_s }
    }

    /// Mean speed until a time, m/s.
    #[inline]
    fn mean_m_s(&self, until_s: f64) -> f64 {
        if self.excess_m_s == 0.0 {
            return self.speed_m_s;
        }
        let share =
            if until_s < self.change_s { 1.0 - 0.5 * until_s / self.change_s } else { 0.5 * self.change_s / until_s };
        self.speed_m_s + self.excess_m_s * share
    }

    /// Angle turned after a time, rad.
    #[inline]
    fn turned_rad(&self, after_s: f64) -> f64 {
        self.turn_rate_rad_s * after_s
    }

    /// Displacement after a time, given sine and cosine of the angle turned.
    #[inline]
    fn flown(&self, after_s: f64, (sin, cos): (f64, f64)) -> Displacement {
        // Slower turns change the position by less than a centimetre within the prediction horizon.
        let (along_s, aside_s) = match self.turn_rate_rad_s {
            slow if slow.abs() < 1e-6 => (after_s, 0.0),
            turn => (sin / turn, (1.0 - cos) / turn),
        };
        let mean_m_s = self.mean_m_s(after_s);
        let [x, y] = self.ahead.map(|part| part * mean_m_s);
        Displacement::from_m(x * along_s - y * aside_s, y * along_s + x * aside_s)
    }

    /// The arc that continues this one after a time, at another turn rate.
    fn then(&self, after_s: f64, turn_rate_rad_s: f64) -> Self {
        let (sin, cos) = math::sin_cos(self.turned_rad(after_s));
        let [x, y] = self.ahead;
        let change_s = (self.change_s - after_s).max(0.0);
        let excess_m_s = if change_s > 0.0 { self.excess_m_s * change_s / self.change_s } else { 0.0 };
        Self {
            from: self.from + self.flown(after_s, (sin, cos)),
            ahead: [x * cos - y * sin, y * cos + x * sin],
            excess_m_s,
            change_s,
            turn_rate_rad_s,
            ..*self
        }
    }
}

/// Predicted trajectory: the current turn for the duration of the lag, then the command, then the turn rate after it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PredictedTrajectory {
    arcs: [Arc; 3],
    /// Times at which the second and the third arc begin, s after the first.
    begin_s: [f64; 2],
    /// Current time, s after the beginning of the first arc.
    age_s: f64,
    /// Maximum lateral acceleration of all arcs, m/s2. Bounds the deviation from the initial straight line.
    turn_m_s2: f64,
    /// Change of speed, m/s. Bounds the deviation from the initial straight line.
    change_m_s: f64,
    /// Lowest and highest acceleration, m/s2; infinite if the speed changes immediately.
    accelerations_m_s2: [f64; 2],
}

impl PredictedTrajectory {
    /// Predicts from a state that is `age_s` seconds old.
    pub(crate) fn of(state: &UavState, intent: Intent, uav: &UavParams, age_s: f64) -> Self {
        let (first, lag_s) = (Arc::of(state), uav.turn_rate_lag_s);
        let second = first.then(lag_s, state.turn_rate_rad_s);
        Self {
            arcs: [first, second, second],
            begin_s: [lag_s, f64::INFINITY],
            age_s,
            turn_m_s2: 0.0,
            change_m_s: 0.0,
            accelerations_m_s2: uav.accelerations_m_s2(state.speed_m_s),
        }
        .with(intent)
    }

    /// The trajectory from the same state with another intent.
    pub(crate) fn with(mut self, intent: Intent) -> Self {
        let Intent { command: Command { speed_m_s, turn_rate_rad_s }, for_s, turn_rate_after_rad_s } = intent;
        let excess_m_s = self.arcs[0].speed_m_s - speed_m_s;
        let change_s = excess_m_s.abs() / self.accelerations_m_s2[usize::from(excess_m_s < 0.0)].abs();
        let excess_m_s = if change_s > 0.0 { excess_m_s } else { 0.0 };
        let second = Arc { speed_m_s, excess_m_s, change_s, turn_rate_rad_s, ..self.arcs[1] };
        let third = if for_s.is_finite() { second.then(for_s, turn_rate_after_rad_s) } else { second };
        (self.arcs[1], self.arcs[2], self.begin_s[1]) = (second, third, self.begin_s[0] + for_s);
        let turns_m_s2 = self.arcs.map(|arc| ((arc.speed_m_s + arc.excess_m_s.max(0.0)) * arc.turn_rate_rad_s).abs());
        self.turn_m_s2 = turns_m_s2[0].max(turns_m_s2[1]).max(turns_m_s2[2]);
        self.change_m_s = (speed_m_s - self.arcs[0].speed_m_s).abs();
        self
    }

    /// Positions at regular times from now on.
    pub(crate) fn sampled(&self) -> SampledTrajectory {
        let ([first, second, third], [second_s, third_s]) = (&self.arcs, self.begin_s);
        let arcs: [(&Arc, f64); SampledTrajectory::SAMPLES] =
            core::array::from_fn(|sample| match sample as f64 * SampledTrajectory::STEP_S + self.age_s {
                at_s if at_s < second_s => (first, at_s),
                at_s if at_s < third_s => (second, at_s - second_s),
                at_s => (third, at_s - third_s),
            });
        let directions = math::sin_cos_batch(arcs.map(|(arc, after_s)| arc.turned_rad(after_s)));
        SampledTrajectory(core::array::from_fn(|sample| {
            let (arc, after_s) = arcs[sample];
            arc.from + arc.flown(after_s, directions[sample])
        }))
    }

    /// Lower bound of the distance of two trajectories within a time, m; usually a coarse bound.
    pub(crate) fn separation_m(&self, other: &Self, within_s: f64) -> f64 {
        let ((from, velocity, off_m), (other_from, other_velocity, other_off_m)) =
            (self.extend_straight(within_s), other.extend_straight(within_s));
        let (away, opening) = ((from - other_from).vector(), velocity - other_velocity);
        let nearest_s = (-away.dot(&opening) / opening.norm_squared().max(1e-12)).clamp(0.0, within_s);
        (away + opening * nearest_s).norm() - off_m - other_off_m
    }

    /// Straight-line approximation: current position if the aircraft had flown straight from its initial state, initial
    /// velocity (m/s), and upper bound of the deviation within a time (m).
    fn extend_straight(&self, within_s: f64) -> (Position, Vector2<f64>, f64) {
        let [Arc { from, ahead: [x, y], speed_m_s, .. }, ..] = self.arcs;
        let velocity = Velocity::from_m_s(x * speed_m_s, y * speed_m_s);
        let flown_s = self.age_s + within_s;
        let off_m = (0.5 * self.turn_m_s2 * flown_s + self.change_m_s) * flown_s;
        (from + velocity * self.age_s, velocity.vector(), off_m)
    }
}

/// Positions of a predicted trajectory at regular times from now on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SampledTrajectory([Position; Self::SAMPLES]);

impl SampledTrajectory {
    /// Time between two positions, s. A UAV at 40 m/s that turns at 0.3 rad/s deviates by 0.4 m from their chord.
    const STEP_S: f64 = 0.5;
    /// Number of positions; the last one is the prediction horizon.
    const SAMPLES: usize = 25;

    /// Position at the sample nearest to a time, s from now.
    pub(crate) fn at(&self, after_s: f64) -> Position {
        self.0[((after_s / Self::STEP_S + 0.5) as usize).min(Self::SAMPLES - 1)]
    }

    /// Vectors from another trajectory to this one within a time, at both ends of each step, with the time of the
    /// first, s.
    pub(crate) fn relative(&self, other: &Self, within_s: f64) -> impl Iterator<Item = (f64, [Vector2<f64>; 2])> {
        let steps = ((within_s / Self::STEP_S) as usize).min(Self::SAMPLES - 1);
        let relative = |sample: usize| (self.0[sample] - other.0[sample]).vector();
        (0..steps).map(move |step| (step as f64 * Self::STEP_S, [relative(step), relative(step + 1)]))
    }
}

/// Minimum length of a vector that moves straight from one to another.
pub fn least_length([from, to]: [Vector2<f64>; 2]) -> f64 {
    Position::ORIGIN.nearest_on_line(from.into(), to.into()).vector().norm()
}
