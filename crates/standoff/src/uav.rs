//! Kinematic model of a fixed-wing UAV with its low-level autopilot: first-order lags on speed and turn rate, and
//! limits (1-4).
//!
//! ```text
//! x' = v cos psi      y' = v sin psi      psi' = omega
//! v' = (u_v - v) / tau_v                  omega' = (u_omega - omega) / tau_omega         Eq. (1)
//! |u_v - v_0| <= dv_max                   |u_omega| <= omega_max                         Eq. (2, 3)
//! ```
//!
//! Erratum: at the paper's period of 0.5 s the Euler step (4) of the heading loop is only marginally stable. By
//! default, the model holds the command and solves (1) exactly over the step. The Euler step can still be selected.

use core::array::from_fn;

use crate::angle::Angle;
use crate::frame::{Displacement, FARTHEST_M, FASTEST_M_S, FASTEST_RAD_S, Position, Velocity};
use crate::math;
use crate::params::{ClimbParams, Integrator, UavParams};
use crate::time::Duration;
use crate::validation::{Allowed, ParamError};

/// Id of a UAV, unique in its team and the same for all agents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct UavId(pub u32);

/// Id of an aircraft: a UAV of the team, or an intruder, which are numbered separately.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Aircraft {
    /// A UAV of the team.
    Uav(UavId),
    /// An aircraft outside the team ([`TrafficReport`](crate::TrafficReport)).
    Intruder(u32),
}

/// Position, heading, speed and turn rate of a UAV: the state of Eq. (1).
///
/// In wind, the state is that over ground: course, ground speed and course rate. Heading and airspeed are then an
/// [`AirVelocity`](crate::AirVelocity).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct UavState {
    /// Position in the world frame.
    pub position: Position,
    /// Heading psi, the direction of motion over ground. In wind: the course chi.
    #[doc(alias = "psi")]
    pub heading: Angle,
    /// Speed v over ground, m/s.
    pub speed_m_s: f64,
    /// Turn rate omega, rad/s, positive anticlockwise. In wind: the course rate.
    #[doc(alias = "omega")]
    pub turn_rate_rad_s: f64,
    /// Altitude and climb rate; `None` if unknown or if the mission is flat.
    #[serde(skip)]
    pub vertical: Option<Vertical>,
}

/// Altitude and climb rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertical {
    /// Altitude above the ground plane (z = 0), m.
    pub altitude_m: f64,
    /// Rate of climb, m/s, positive upward.
    pub climb_rate_m_s: f64,
}

impl Vertical {
    pub(crate) fn numbers(&self) -> [f64; 2] {
        [self.altitude_m, self.climb_rate_m_s]
    }
}

impl UavState {
    /// A UAV in straight flight at unknown altitude.
    pub const fn level_flight(position: Position, heading: Angle, speed_m_s: f64) -> Self {
        Self { position, heading, speed_m_s, turn_rate_rad_s: 0.0, vertical: None }
    }

    /// Extrapolates the state by `after_s` seconds at constant speed, turn rate and climb rate.
    pub fn extrapolated(&self, after_s: f64) -> Self {
        let turned_rad = self.turn_rate_rad_s * after_s;
        let (moved, heading) = if turned_rad.abs() < 1e-9 {
            (self.velocity() * after_s, self.heading)
        } else {
            // The chord of the arc; its direction is the initial heading plus half the turn.
            let chord_m = 2.0 * self.speed_m_s / self.turn_rate_rad_s * math::sin(0.5 * turned_rad);
            let along = self.heading + Angle::from_rad(0.5 * turned_rad);
            (Displacement::from_polar(chord_m, along), self.heading + Angle::from_rad(turned_rad))
        };
        let vertical = self.vertical.map(|Vertical { altitude_m, climb_rate_m_s }| Vertical {
            altitude_m: altitude_m + climb_rate_m_s * after_s,
            climb_rate_m_s,
        });
        Self { position: self.position + moved, heading, vertical, ..*self }
    }

    /// The state after a steady turn of `after_s` seconds towards a direction, as far as the maximum turn rate allows.
    pub(crate) fn turned_towards(&self, direction: Angle, turn_rate_max_rad_s: f64, after_s: f64) -> Self {
        let turn_rate_rad_s = (direction - self.heading).rad() / after_s;
        let turn_rate_rad_s = turn_rate_rad_s.clamp(-turn_rate_max_rad_s, turn_rate_max_rad_s);
        Self { turn_rate_rad_s, ..*self }.extrapolated(after_s)
    }

    /// Velocity over ground.
    pub fn velocity(&self) -> Velocity {
        Velocity::from_polar(self.speed_m_s, self.heading)
    }

    /// Returns true if every component is finite.
    pub fn is_finite(&self) -> bool {
        self.position.is_finite()
            && self.heading.rad().is_finite()
            && self.speed_m_s.is_finite()
            && self.turn_rate_rad_s.is_finite()
            && self.vertical.is_none_or(|vertical| vertical.numbers().iter().all(|number| number.is_finite()))
    }

    /// Returns true if every component is finite and physically plausible.
    pub(crate) fn is_valid(&self) -> bool {
        self.is_finite()
            && self.position.is_within(FARTHEST_M)
            && self.speed_m_s.abs() <= FASTEST_M_S
            && self.turn_rate_rad_s.abs() <= FASTEST_RAD_S
            && self.vertical.is_none_or(|vertical| {
                vertical.altitude_m.abs() <= FARTHEST_M && vertical.climb_rate_m_s.abs() <= FASTEST_M_S
            })
    }
}

/// Command to the low-level autopilot: speed u_v and turn rate u_omega. In wind, these are airspeed and heading rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Speed, m/s.
    #[doc(alias = "u_v")]
    pub speed_m_s: f64,
    /// Turn rate, rad/s, positive anticlockwise.
    #[doc(alias = "u_omega")]
    pub turn_rate_rad_s: f64,
}

/// A command within the limits, and flags for the limits that were applied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitedCommand {
    /// The command, within the limits.
    pub command: Command,
    /// The desired speed change exceeded the limit (2).
    pub speed_limited: bool,
    /// The desired turn rate exceeded the limit (3).
    pub turn_rate_limited: bool,
}

impl ClimbParams {
    /// Clamps an altitude to the limits, m.
    pub fn limit_m(&self, altitude_m: f64) -> f64 {
        // Unlike `clamp`, this accepts the limits of an edited record, whose order is unchecked.
        altitude_m.max(self.altitude_min_m).min(self.altitude_max_m)
    }

    /// Returns the state after flying towards a commanded altitude (m) for `dt`. Without a command the UAV levels off.
    ///
    /// The commanded rate is the remaining altitude difference divided by four lags plus two steps. Four lags make the
    /// loop critically damped; the two steps prevent overshoot.
    pub fn step(&self, from: &Vertical, altitude_m: Option<f64>, dt: Duration) -> Vertical {
        let desired_m_s =
            altitude_m.map_or(0.0, |to_m| (self.limit_m(to_m) - from.altitude_m) / (4.0 * self.lag_s + 2.0 * dt.s()));
        let rate_m_s = desired_m_s.clamp(-self.rate_max_m_s, self.rate_max_m_s);
        let decay = math::exp(-dt.s() / self.lag_s);
        let excess_m_s = from.climb_rate_m_s - rate_m_s;
        Vertical {
            altitude_m: from.altitude_m + rate_m_s * dt.s() + excess_m_s * self.lag_s * (1.0 - decay),
            climb_rate_m_s: rate_m_s + excess_m_s * decay,
        }
    }
}

impl UavParams {
    /// Maximum speed that may be commanded, m/s.
    pub fn speed_max_m_s(&self) -> f64 {
        self.speed_m_s + self.speed_change_max_m_s
    }

    /// Lowest and highest speed that may be commanded, m/s; in wind, airspeed.
    pub fn speeds_m_s(&self) -> [f64; 2] {
        [self.speed_m_s - self.speed_change_max_m_s, self.speed_m_s + self.speed_change_max_m_s]
    }

    /// Returns every parameter that is out of range if each command is held for `dt`.
    ///
    /// If a lag is shorter than `dt`, an Euler step (4) overshoots the command, possibly past the limits and even into
    /// negative speeds. If it is shorter than half of `dt`, the error grows with every step without bound. The lags of
    /// Table I are too short for its period.
    pub fn errors_for_period(&self, dt: Duration) -> Vec<ParamError> {
        let mut errors = Vec::new();
        if self.integrator == Integrator::Euler {
            let lag = Allowed::at_least(dt.s())
                .with_reason("the period: with a shorter lag an Euler step overshoots, an exact one does not");
            lag.check("speed_lag_s", self.speed_lag_s, &mut errors);
            lag.check("turn_rate_lag_s", self.turn_rate_lag_s, &mut errors);
        }
        errors
    }

    /// Limits a desired command.
    ///
    /// Implements Eq. (2), (3). Defined for all inputs: NaN becomes straight flight at the nominal speed and counts as
    /// limited.
    pub fn limit(&self, desired: Command) -> LimitedCommand {
        let (speed_m_s, speed_limited) = self.limit_speed_m_s(desired.speed_m_s);
        let (turn_rate_rad_s, turn_rate_limited) =
            clamp_flagged(desired.turn_rate_rad_s, -self.turn_rate_max_rad_s, self.turn_rate_max_rad_s, 0.0);
        LimitedCommand { command: Command { speed_m_s, turn_rate_rad_s }, speed_limited, turn_rate_limited }
    }

    /// Limits a desired speed like [`Self::limit`], m/s; `true` if the limit was applied.
    pub(crate) fn limit_speed_m_s(&self, desired_m_s: f64) -> (f64, bool) {
        let [lower, upper] = self.speeds_m_s();
        clamp_flagged(desired_m_s, lower, upper, self.speed_m_s)
    }

    /// Returns the response of the UAV to commands that are held for `dt`.
    pub fn response(&self, dt: Duration) -> AutopilotModel {
        let dt_s = dt.s();
        let after = |t_s: f64| {
            let turn_decay = math::exp(-t_s / self.turn_rate_lag_s);
            LagDecay {
                t_s,
                speed_decay: math::exp(-t_s / self.speed_lag_s),
                turn_decay,
                lagged_s: self.turn_rate_lag_s * (1.0 - turn_decay),
            }
        };
        // Speed, turn rate and heading have closed forms. Position has none and is integrated numerically; pieces of at
        // most two lags keep the quadrature error below a nanometre.
        let lag_s = self.speed_lag_s.min(self.turn_rate_lag_s);
        let pieces = (0.5 * dt_s / lag_s).ceil().clamp(1.0, 1000.0);
        let piece_s = dt_s / pieces;
        let pieces = (0..pieces as u32).map(|piece| {
            let nodes = GAUSS_LEGENDRE.map(|(node, _)| after((f64::from(piece) + 0.5 + 0.5 * node) * piece_s));
            Piece {
                weight_s: GAUSS_LEGENDRE.map(|(_, weight)| 0.5 * weight * piece_s),
                t_s: nodes.map(|at| at.t_s),
                speed_decay: nodes.map(|at| at.speed_decay),
                lagged_s: nodes.map(|at| at.lagged_s),
            }
        });
        AutopilotModel { params: *self, pieces: pieces.collect(), end: after(dt_s) }
    }

    /// Returns the spectral radius of the sampled heading loop under u_omega = -k_omega psi. The loop is stable if it
    /// is below 1.
    ///
    /// Diagnoses the erratum of Eq. (4): Euler needs `heading_gain_1_s * period < 1`.
    pub fn heading_loop_spectral_radius(&self, heading_gain_1_s: f64, period: Duration) -> f64 {
        let (k, t, tau) = (heading_gain_1_s, period.s(), self.turn_rate_lag_s);
        let (trace, determinant) = match self.integrator {
            Integrator::Exact => {
                let e = math::exp(-t / tau);
                let (heading_per_rate, heading_per_command) = (tau * (1.0 - e), t - tau * (1.0 - e));
                let a = 1.0 - k * heading_per_command;
                (a + e, a * e + k * (1.0 - e) * heading_per_rate)
            }
            Integrator::Euler => (2.0 - t / tau, 1.0 - t / tau + k * t * t / tau),
        };
        let discriminant = 0.25 * trace * trace - determinant;
        if discriminant < 0.0 { determinant.sqrt() } else { 0.5 * trace.abs() + discriminant.sqrt() }
    }
}

/// Response of a UAV to commands that are held for a fixed time. Precomputed once for all UAVs and steps.
#[derive(Debug, Clone, PartialEq)]
pub struct AutopilotModel {
    pub(crate) params: UavParams,
    pieces: Vec<Piece>,
    end: LagDecay,
}

/// Quadrature over one piece of the time step: weights and decay factors at the nodes, as arrays for SIMD.
#[derive(Debug, Clone, PartialEq)]
struct Piece {
    weight_s: [f64; GAUSS_LEGENDRE.len()],
    t_s: [f64; GAUSS_LEGENDRE.len()],
    speed_decay: [f64; GAUSS_LEGENDRE.len()],
    lagged_s: [f64; GAUSS_LEGENDRE.len()],
}

/// Remaining share of the difference between state and command after a time `t_s`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LagDecay {
    t_s: f64,
    speed_decay: f64,
    turn_decay: f64,
    /// Integral of `turn_decay` from 0 to `t_s`, s: the heading change per unit of initial turn rate difference.
    lagged_s: f64,
}

impl AutopilotModel {
    /// Duration of the time step, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.end.t_s
    }

    /// Returns the state after holding `command` for the time step.
    ///
    /// Implements Eq. (1) exactly, or Eq. (4) if Euler is selected, also for a UAV that banks.
    pub fn step(&self, state: &UavState, command: Command) -> UavState {
        match self.params.integrator {
            Integrator::Exact => self.step_exact(state, command),
            Integrator::Euler => self.step_euler(state, command),
        }
    }

    fn step_exact(&self, state: &UavState, command: Command) -> UavState {
        let end = &self.end;
        let speed_excess = state.speed_m_s - command.speed_m_s;
        let turn_excess = state.turn_rate_rad_s - command.turn_rate_rad_s;
        let heading_rad =
            |t_s: f64, lagged_s: f64| state.heading.rad() + command.turn_rate_rad_s * t_s + turn_excess * lagged_s;
        let speed_m_s = |decay: f64| command.speed_m_s + speed_excess * decay;
        let (mut x_m, mut y_m) = (0.0, 0.0);
        for piece in &self.pieces {
            let Piece { weight_s, t_s, speed_decay, lagged_s } = piece;
            let directions =
                math::sin_cos_batch::<{ GAUSS_LEGENDRE.len() }>(from_fn(|i| heading_rad(t_s[i], lagged_s[i])));
            for (i, (sin, cos)) in directions.into_iter().enumerate() {
                let distance_m = weight_s[i] * speed_m_s(speed_decay[i]);
                x_m += distance_m * cos;
                y_m += distance_m * sin;
            }
        }
        UavState {
            position: state.position + Displacement::from_m(x_m, y_m),
            heading: Angle::from_rad(heading_rad(end.t_s, end.lagged_s)),
            speed_m_s: speed_m_s(end.speed_decay),
            turn_rate_rad_s: command.turn_rate_rad_s + turn_excess * end.turn_decay,
            vertical: state.vertical,
        }
    }

    fn step_euler(&self, state: &UavState, command: Command) -> UavState {
        let (params, dt_s) = (&self.params, self.end.t_s);
        UavState {
            position: state.position + state.velocity() * dt_s,
            heading: state.heading + Angle::from_rad(state.turn_rate_rad_s * dt_s),
            speed_m_s: state.speed_m_s + dt_s * (command.speed_m_s - state.speed_m_s) / params.speed_lag_s,
            turn_rate_rad_s: state.turn_rate_rad_s
                + dt_s * (command.turn_rate_rad_s - state.turn_rate_rad_s) / params.turn_rate_lag_s,
            vertical: state.vertical,
        }
    }
}

/// Nodes and weights of the six-point Gauss-Legendre rule on [-1, 1].
const GAUSS_LEGENDRE: [(f64, f64); 6] = [
    (-0.932_469_514_203_152, 0.171_324_492_379_170_36),
    (-0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (-0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];

/// Clamps `desired`; `true` if it was out of range. NaN gives `fallback`.
pub(crate) fn clamp_flagged(desired: f64, lower: f64, upper: f64, fallback: f64) -> (f64, bool) {
    if desired.is_nan() {
        return (fallback, true);
    }
    (desired.clamp(lower, upper), desired < lower || desired > upper)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::PI;
    use crate::params::TeamParams;

    /// A climb of 50 m at 3 m/s ends level at the commanded altitude without overshoot, for lags shorter and longer
    /// than the period.
    #[test]
    fn a_climb_reaches_the_commanded_altitude_without_overshoot() {
        for (lag_s, from_m, to_m) in [(1.0, 300.0, 350.0), (0.1, 300.0, 350.0), (2.0, 350.0, 300.0)] {
            let climb = ClimbParams { lag_s, ..ClimbParams::default() };
            let mut at = Vertical { altitude_m: from_m, climb_rate_m_s: 0.0 };
            for _ in 0..240 {
                at = climb.step(&at, Some(to_m), Duration::from_s(0.5));
                let (low_m, high_m) = (to_m.min(from_m), to_m.max(from_m));
                assert!(low_m - 1e-3 <= at.altitude_m && at.altitude_m <= high_m + 1e-3, "{at:?}");
                assert!(at.climb_rate_m_s.abs() <= 3.0);
            }
            assert!((at.altitude_m - to_m).abs() < 1e-3 && at.climb_rate_m_s.abs() < 1e-3, "{at:?}");
        }
        // A command beyond the limits leads to the limit; without a command the UAV levels off.
        let climb = ClimbParams { altitude_max_m: 320.0, ..ClimbParams::default() };
        let mut at = Vertical { altitude_m: 300.0, climb_rate_m_s: 3.0 };
        (0..240).for_each(|_| at = climb.step(&at, Some(400.0), Duration::from_s(0.5)));
        assert!((at.altitude_m - 320.0).abs() < 1e-3, "{at:?}");
        let mut at = Vertical { altitude_m: 300.0, climb_rate_m_s: 3.0 };
        (0..240).for_each(|_| at = climb.step(&at, None, Duration::from_s(0.5)));
        assert!((at.altitude_m - 303.0).abs() < 1e-6 && at.climb_rate_m_s.abs() < 1e-9, "{at:?}");
    }

    fn table_1(integrator: Integrator) -> UavParams {
        UavParams { integrator, ..TeamParams::paper().uav }
    }

    fn start() -> UavState {
        UavState {
            position: Position::from_m(10.0, -5.0),
            heading: Angle::from_deg(100.0),
            speed_m_s: 38.0,
            turn_rate_rad_s: -0.1,
            vertical: None,
        }
    }

    /// Checks Eq. (1): the exact step equals ten thousand small Runge-Kutta steps.
    #[test]
    fn the_exact_step_matches_runge_kutta() {
        let params = table_1(Integrator::Exact);
        let command = Command { speed_m_s: 47.0, turn_rate_rad_s: 0.3 };
        let f = |s: [f64; 5]| {
            [
                s[3] * math::cos(s[2]),
                s[3] * math::sin(s[2]),
                s[4],
                (command.speed_m_s - s[3]) / params.speed_lag_s,
                (command.turn_rate_rad_s - s[4]) / params.turn_rate_lag_s,
            ]
        };
        for dt_s in [0.5, 0.64, 2.0] {
            let s0 = start();
            let mut s = [s0.position.x_m(), s0.position.y_m(), s0.heading.rad(), s0.speed_m_s, s0.turn_rate_rad_s];
            let h = dt_s / 10_000.0;
            let shifted = |s: [f64; 5], k: [f64; 5], by: f64| core::array::from_fn(|i| s[i] + by * k[i]);
            for _ in 0..10_000 {
                let k1 = f(s);
                let k2 = f(shifted(s, k1, h / 2.0));
                let k3 = f(shifted(s, k2, h / 2.0));
                let k4 = f(shifted(s, k3, h));
                s = core::array::from_fn(|i| s[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            }
            let got = params.response(Duration::from_s(dt_s)).step(&s0, command);
            assert!((got.position.x_m() - s[0]).abs() < 1e-9, "{dt_s} s: {got:?} != {s:?}");
            assert!((got.position.y_m() - s[1]).abs() < 1e-9);
            assert!((got.heading - Angle::from_rad(s[2])).abs_rad() < 1e-9);
            assert!((got.speed_m_s - s[3]).abs() < 1e-9);
            assert!((got.turn_rate_rad_s - s[4]).abs() < 1e-9);
        }
    }

    /// Checks Eq. (4): the state moves by T_s f(x, u).
    #[test]
    fn the_euler_step_is_the_published_one() {
        let command = Command { speed_m_s: 44.0, turn_rate_rad_s: 0.2 };
        let got = table_1(Integrator::Euler).response(Duration::from_s(0.5)).step(&start(), command);
        assert!((got.position.x_m() - (10.0 + 0.5 * 38.0 * math::cos(100.0 * PI / 180.0))).abs() < 1e-12);
        assert!((got.heading - Angle::from_rad(100.0 * PI / 180.0 - 0.05)).abs_rad() < 1e-12);
        assert!((got.speed_m_s - (38.0 + 0.5 * 3.0 * 6.0)).abs() < 1e-9);
        assert!((got.turn_rate_rad_s - (-0.1 + 0.5 * 3.0 * 0.3)).abs() < 1e-9);
    }

    /// Checks Eq. (4) with permitted lags: for all commands within the limits, speed and turn rate stay within them.
    #[test]
    fn an_euler_step_with_permitted_lags_does_not_overshoot() {
        let period = Duration::from_s(0.5);
        let with_lags =
            |speed_lag_s, turn_rate_lag_s| UavParams { speed_lag_s, turn_rate_lag_s, ..table_1(Integrator::Euler) };
        let names = |params: UavParams| {
            params.errors_for_period(period).into_iter().map(|error| error.path).collect::<Vec<_>>()
        };
        // With Table I's lags one step from 55 m/s ends at 10 m/s, although the lowest speed command is 25 m/s.
        assert_eq!(names(table_1(Integrator::Euler)), ["speed_lag_s", "turn_rate_lag_s"]);
        assert!(names(table_1(Integrator::Exact)).is_empty());
        assert_eq!(names(with_lags(0.5f64.next_down(), 0.5)), ["speed_lag_s"]);
        assert_eq!(names(with_lags(0.5, 0.5f64.next_down())), ["turn_rate_lag_s"]);
        for lag_s in [0.5, 0.7, 60.0] {
            let params = with_lags(lag_s, lag_s);
            assert!(names(params).is_empty(), "{lag_s}");
            let response = params.response(period);
            let mut state = UavState { speed_m_s: 55.0, turn_rate_rad_s: 0.3, ..start() };
            for step in 0..40 {
                let sign = if step % 4 < 2 { -1.0 } else { 1.0 };
                state = response.step(&state, Command { speed_m_s: 40.0 + 15.0 * sign, turn_rate_rad_s: 0.3 * sign });
                assert!((25.0 - 1e-9..=55.0 + 1e-9).contains(&state.speed_m_s), "{lag_s}: {state:?}");
                assert!(state.turn_rate_rad_s.abs() <= 0.3 + 1e-12, "{lag_s}: {state:?}");
            }
        }
    }

    /// Checks the erratum of Eq. (4): at Table I's values the Euler loop has no stability margin, the exact one has.
    #[test]
    fn the_euler_heading_loop_is_marginally_stable_at_table_1() {
        let period = Duration::from_s(0.5);
        assert!((table_1(Integrator::Euler).heading_loop_spectral_radius(2.0, period) - 1.0).abs() < 1e-9);
        assert!((table_1(Integrator::Exact).heading_loop_spectral_radius(2.0, period) - 0.720).abs() < 5e-4);
        assert!(table_1(Integrator::Euler).heading_loop_spectral_radius(2.1, period) > 1.0);
    }

    /// Checks Eq. (2), (3).
    #[test]
    fn limited_commands_set_their_flags() {
        let params = table_1(Integrator::Exact);
        let limited = params.limit(Command { speed_m_s: 60.0, turn_rate_rad_s: -1.0 });
        assert_eq!(limited.command, Command { speed_m_s: 55.0, turn_rate_rad_s: -0.3 });
        assert!(limited.speed_limited && limited.turn_rate_limited);
        let free = params.limit(Command { speed_m_s: 25.0, turn_rate_rad_s: 0.3 });
        assert!(!free.speed_limited && !free.turn_rate_limited);
        let nonsense = params.limit(Command { speed_m_s: f64::NAN, turn_rate_rad_s: f64::NAN });
        assert_eq!(nonsense.command, Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 });
    }
}
