//! A fixed-wing UAV under its low-level autopilot: first-order lags on speed and turn rate, and their limits (1-4).
//!
//! ```text
//! x' = v cos psi      y' = v sin psi      psi' = omega
//! v' = (u_v - v) / tau_v                  omega' = (u_omega - omega) / tau_omega         Eq. (1)
//! |u_v - v_0| <= dv_max                   |u_omega| <= omega_max                         Eq. (2, 3)
//! ```
//!
//! Erratum: at the paper's 0.5 s the Euler step (4) of the heading loop is only marginally stable. Holding the command
//! and solving (1) exactly over the step is the default; Euler stays selectable.

use core::array::from_fn;

use crate::angle::Angle;
use crate::frame::{Displacement, FARTHEST_M, FASTEST_M_S, FASTEST_RAD_S, Position, Velocity};
use crate::math;
use crate::param::{Allowed, ParamError, errors_of};
use crate::time::Duration;

/// Identifies a UAV; teams agree on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct UavId(pub u32);

/// An aircraft: a UAV of the team, or an intruder by a number of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Aircraft {
    /// Of the team.
    Uav(UavId),
    /// Not of the team ([`Traffic`](crate::Traffic)).
    Intruder(u32),
}

/// Position, heading, speed and turn rate of a UAV: the state of Eq. (1).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct UavState {
    /// Position in the world frame.
    pub position: Position,
    /// Heading psi; also the direction of motion (no wind).
    #[doc(alias = "psi")]
    pub heading: Angle,
    /// Speed v, m/s.
    pub speed_m_s: f64,
    /// Turn rate omega, rad/s, positive anticlockwise.
    #[doc(alias = "omega")]
    pub turn_rate_rad_s: f64,
    /// Where altitudes are flown: how high it is; `None`: nobody knows.
    #[serde(skip)]
    pub vertical: Option<Vertical>,
}

/// Altitude, and how it changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertical {
    /// Altitude above the plane, m.
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
    /// A UAV that flies straight on; how high, nobody knows.
    pub const fn straight(position: Position, heading: Angle, speed_m_s: f64) -> Self {
        Self { position, heading, speed_m_s, turn_rate_rad_s: 0.0, vertical: None }
    }

    /// The same so long after, if it goes on to fly, turn and climb as it does.
    pub(crate) fn carried_on(&self, after_s: f64) -> Self {
        let turned_rad = self.turn_rate_rad_s * after_s;
        let (moved, heading) = if turned_rad.abs() < 1e-9 {
            (self.velocity() * after_s, self.heading)
        } else {
            // The chord of the arc, half of the turn from where it began.
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

    /// Velocity over ground.
    pub fn velocity(&self) -> Velocity {
        Velocity::from_polar(self.speed_m_s, self.heading)
    }

    /// Every component is finite.
    pub fn is_finite(&self) -> bool {
        self.position.is_finite()
            && self.heading.rad().is_finite()
            && self.speed_m_s.is_finite()
            && self.turn_rate_rad_s.is_finite()
            && self.vertical.is_none_or(|vertical| vertical.numbers().iter().all(|number| number.is_finite()))
    }

    /// The same, and none is beyond what there is on Earth.
    pub(crate) fn is_sound(&self) -> bool {
        self.is_finite()
            && self.position.is_within(FARTHEST_M)
            && self.speed_m_s.abs() <= FASTEST_M_S
            && self.turn_rate_rad_s.abs() <= FASTEST_RAD_S
            && self.vertical.is_none_or(|vertical| {
                vertical.altitude_m.abs() <= FARTHEST_M && vertical.climb_rate_m_s.abs() <= FASTEST_M_S
            })
    }
}

/// What the low-level autopilot is asked for: speed u_v and turn rate u_omega.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Speed, m/s.
    #[doc(alias = "u_v")]
    pub speed_m_s: f64,
    /// Turn rate, rad/s, positive anticlockwise.
    #[doc(alias = "u_omega")]
    pub turn_rate_rad_s: f64,
}

/// A command inside the limits, and which limit it met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitedCommand {
    /// The command to give.
    pub command: Command,
    /// More speed change was wanted than (2) allows.
    pub speed_limited: bool,
    /// More turn rate was wanted than (3) allows.
    pub turn_rate_limited: bool,
}

/// How (1) is carried over a time step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Exact solution under a held command.
    #[default]
    Exact,
    /// One Euler step (4), as printed.
    Euler,
}

/// Limits and lags of a UAV.
///
/// ```
/// use standoff::{Angle, Command, Duration, Position, TeamParams, UavState};
///
/// let params = TeamParams::table_1().uav;
/// let state =
///     UavState { position: Position::from_m(0.0, 0.0), heading: Angle::from_deg(90.0), speed_m_s: 40.0, turn_rate_rad_s: 0.0, vertical: None };
/// // Too much is asked for: the limits are those of the paper's table.
/// let limited = params.limit(Command { speed_m_s: 100.0, turn_rate_rad_s: 1.0 });
/// assert_eq!((limited.command.speed_m_s, limited.command.turn_rate_rad_s), (55.0, 0.3));
/// let next = params.response(Duration::from_s(0.5)).step(&state, limited.command);
/// assert!(next.speed_m_s > 40.0 && next.heading.deg() > 90.0 && next.position.y_m() > 20.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UavParams {
    /// Nominal speed v_0, which is also the desired speed v_d, m/s; 1 to 1,000.
    #[doc(alias = "v_0")]
    #[doc(alias = "v_d")]
    pub speed_m_s: f64,
    /// Largest change of the speed command, dv_max, m/s; at least 0, below `speed_m_s`.
    #[doc(alias = "dv_max")]
    pub speed_change_max_m_s: f64,
    /// Largest turn rate command, omega_max, rad/s; 0.001 (a turn in 105 minutes) to 10.
    #[doc(alias = "omega_max")]
    pub turn_rate_max_rad_s: f64,
    /// Lag of the speed, tau_v, s; 0.001 to 60.
    #[doc(alias = "tau_v")]
    pub speed_lag_s: f64,
    /// Lag of the turn rate, tau_omega, s; 0.001 to 60.
    #[doc(alias = "tau_omega")]
    pub turn_rate_lag_s: f64,
    /// Exact or Euler.
    pub integrator: Integrator,
    /// How it climbs; `None`: it is at once at whatever altitude is asked for, as in the paper, which is flat.
    pub climb: Option<ClimbParams>,
}

/// How a UAV climbs and descends, and where it may: a first-order lag on its rate of climb, as (1) has for the turn rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClimbParams {
    /// Largest rate of climb and of descent, m/s; 0.01 to 100.
    pub rate_max_m_s: f64,
    /// Lag of the rate of climb, s; 0.001 to 60.
    pub lag_s: f64,
    /// Lowest altitude that may be asked for, m above the plane; 1 to 20,000.
    pub altitude_min_m: f64,
    /// Highest, m; not below the lowest, at most 20,000.
    pub altitude_max_m: f64,
}

impl Default for ClimbParams {
    /// A small fixed-wing UAV: 3 m/s, reached within a second.
    fn default() -> Self {
        Self { rate_max_m_s: 3.0, lag_s: 1.0, altitude_min_m: 50.0, altitude_max_m: 3000.0 }
    }
}

impl ClimbParams {
    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = Vec::new();
        Allowed::at_least(0.01).at_most(100.0).check("rate_max_m_s", self.rate_max_m_s, &mut errors);
        Allowed::at_least(1e-3).at_most(60.0).check("lag_s", self.lag_s, &mut errors);
        Allowed::at_least(1.0).at_most(2e4).check("altitude_min_m", self.altitude_min_m, &mut errors);
        Allowed::at_least(self.altitude_min_m).at_most(2e4).because("not below altitude_min_m").check(
            "altitude_max_m",
            self.altitude_max_m,
            &mut errors,
        );
        errors
    }

    /// An altitude inside the limits, m.
    pub fn limit_m(&self, altitude_m: f64) -> f64 {
        altitude_m.clamp(self.altitude_min_m, self.altitude_max_m)
    }

    /// The state after so long on the way to an altitude, m; without one it levels off.
    ///
    /// The rate asked for is the way that is left over four lags, at which it is critically damped, and two steps, so that no
    /// altitude is overshot.
    pub fn step(&self, from: &Vertical, altitude_m: Option<f64>, dt: Duration) -> Vertical {
        let wanted_m_s =
            altitude_m.map_or(0.0, |to_m| (self.limit_m(to_m) - from.altitude_m) / (4.0 * self.lag_s + 2.0 * dt.s()));
        let rate_m_s = wanted_m_s.clamp(-self.rate_max_m_s, self.rate_max_m_s);
        let decay = math::exp(-dt.s() / self.lag_s);
        let excess_m_s = from.climb_rate_m_s - rate_m_s;
        Vertical {
            altitude_m: from.altitude_m + rate_m_s * dt.s() + excess_m_s * self.lag_s * (1.0 - decay),
            climb_rate_m_s: rate_m_s + excess_m_s * decay,
        }
    }
}

impl UavParams {
    /// Largest speed that may be commanded, m/s.
    pub fn speed_max_m_s(&self) -> f64 {
        self.speed_m_s + self.speed_change_max_m_s
    }

    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = Vec::new();
        Allowed::at_least(1.0).at_most(1000.0).check("speed_m_s", self.speed_m_s, &mut errors);
        Allowed::at_least(0.0).below(self.speed_m_s).because("the UAV must keep flying: below speed_m_s").check(
            "speed_change_max_m_s",
            self.speed_change_max_m_s,
            &mut errors,
        );
        Allowed::at_least(1e-3).at_most(10.0).check("turn_rate_max_rad_s", self.turn_rate_max_rad_s, &mut errors);
        let lag = Allowed::at_least(1e-3).at_most(60.0);
        lag.check("speed_lag_s", self.speed_lag_s, &mut errors);
        lag.check("turn_rate_lag_s", self.turn_rate_lag_s, &mut errors);
        let climb = self.climb.map(|climb| climb.errors()).unwrap_or_default();
        errors.extend(errors_of([("climb", climb)]));
        errors
    }

    /// Every parameter that is out of range where commands are held for `dt`: with a lag shorter than that, an Euler step
    /// (4) overshoots the command, past the limits, be it into flying backwards; with one shorter than half, by more than
    /// it began with, and states grow without bound. Table I's lags are too short for its period.
    pub fn errors_over(&self, dt: Duration) -> Vec<ParamError> {
        let mut errors = Vec::new();
        if self.integrator == Integrator::Euler {
            let lag = Allowed::at_least(dt.s())
                .because("the period: with a shorter lag an Euler step overshoots, an exact one does not");
            lag.check("speed_lag_s", self.speed_lag_s, &mut errors);
            lag.check("turn_rate_lag_s", self.turn_rate_lag_s, &mut errors);
        }
        errors
    }

    /// Brings a wanted command inside the limits.
    ///
    /// Implements Eq. (2), (3). Total: a wanted value that is not a number becomes level flight at the nominal speed,
    /// and counts as limited.
    pub fn limit(&self, wanted: Command) -> LimitedCommand {
        let (speed_m_s, speed_limited) = self.limit_speed_m_s(wanted.speed_m_s);
        let (turn_rate_rad_s, turn_rate_limited) =
            clamp_flagged(wanted.turn_rate_rad_s, -self.turn_rate_max_rad_s, self.turn_rate_max_rad_s, 0.0);
        LimitedCommand { command: Command { speed_m_s, turn_rate_rad_s }, speed_limited, turn_rate_limited }
    }

    /// The speed of [`Self::limit`] alone, m/s, and whether it met the limit.
    pub(crate) fn limit_speed_m_s(&self, wanted_m_s: f64) -> (f64, bool) {
        let (lower, upper) = (self.speed_m_s - self.speed_change_max_m_s, self.speed_m_s + self.speed_change_max_m_s);
        clamp_flagged(wanted_m_s, lower, upper, self.speed_m_s)
    }

    /// How a UAV answers commands that are held for `dt`.
    pub fn response(&self, dt: Duration) -> Response {
        let dt_s = dt.s();
        let after = |t_s: f64| {
            let turn_decay = math::exp(-t_s / self.turn_rate_lag_s);
            Instant {
                t_s,
                speed_decay: math::exp(-t_s / self.speed_lag_s),
                turn_decay,
                lagged_s: self.turn_rate_lag_s * (1.0 - turn_decay),
            }
        };
        // Speed, turn rate and heading have closed forms; position, their integral, has none. Pieces no longer than two
        // lags keep the quadrature's error below a nanometre.
        let lag_s = self.speed_lag_s.min(self.turn_rate_lag_s);
        let pieces = (0.5 * dt_s / lag_s).ceil().clamp(1.0, 1000.0);
        let piece_s = dt_s / pieces;
        let pieces = (0..pieces as u32).map(|piece| {
            let instants = GAUSS_LEGENDRE.map(|(node, _)| after((f64::from(piece) + 0.5 + 0.5 * node) * piece_s));
            Piece {
                weight_s: GAUSS_LEGENDRE.map(|(_, weight)| 0.5 * weight * piece_s),
                t_s: instants.map(|at| at.t_s),
                speed_decay: instants.map(|at| at.speed_decay),
                lagged_s: instants.map(|at| at.lagged_s),
            }
        });
        Response { params: *self, pieces: pieces.collect(), end: after(dt_s) }
    }

    /// Largest modulus of the sampled heading loop's eigenvalues under u_omega = -k_omega psi; the loop is stable
    /// below 1.
    ///
    /// A diagnostic of the erratum of Eq. (4): Euler needs `heading_gain_1_s * period < 1`.
    pub fn heading_loop_modulus(&self, heading_gain_1_s: f64, period: Duration) -> f64 {
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

/// How a UAV answers commands that are held for a time, worked out once for all of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    params: UavParams,
    pieces: Vec<Piece>,
    end: Instant,
}

/// The quadrature over a piece of the time: weights, and what its instants are like; by columns, to be worked on side by
/// side.
#[derive(Debug, Clone, PartialEq)]
struct Piece {
    weight_s: [f64; GAUSS_LEGENDRE.len()],
    t_s: [f64; GAUSS_LEGENDRE.len()],
    speed_decay: [f64; GAUSS_LEGENDRE.len()],
    lagged_s: [f64; GAUSS_LEGENDRE.len()],
}

/// What is left of the difference between state and command after some time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Instant {
    t_s: f64,
    speed_decay: f64,
    turn_decay: f64,
    /// For how long the difference of the turn rates would have had to last, undiminished, to turn the UAV as far.
    lagged_s: f64,
}

impl Response {
    /// The state after holding `command`.
    ///
    /// Implements Eq. (1) exactly, or Eq. (4) where Euler is selected.
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
                math::sin_cos_each::<{ GAUSS_LEGENDRE.len() }>(from_fn(|i| heading_rad(t_s[i], lagged_s[i])));
            for (i, (sin, cos)) in directions.into_iter().enumerate() {
                let way_m = weight_s[i] * speed_m_s(speed_decay[i]);
                x_m += way_m * cos;
                y_m += way_m * sin;
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

/// Nodes and weights of the six-point rule on [-1, 1].
const GAUSS_LEGENDRE: [(f64, f64); 6] = [
    (-0.932_469_514_203_152, 0.171_324_492_379_170_36),
    (-0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (-0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];

fn clamp_flagged(wanted: f64, lower: f64, upper: f64, fallback: f64) -> (f64, bool) {
    if wanted.is_nan() {
        return (fallback, true);
    }
    (wanted.clamp(lower, upper), wanted < lower || wanted > upper)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::PI;

    /// 50 m at 3 m/s: 20 s on, and never beyond, for a lag shorter and one longer than the period; then level.
    #[test]
    fn an_altitude_is_climbed_to_and_never_overshot() {
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
        // Out of the limits it goes to the limit; with no altitude asked for it levels off.
        let climb = ClimbParams { altitude_max_m: 320.0, ..ClimbParams::default() };
        let mut at = Vertical { altitude_m: 300.0, climb_rate_m_s: 3.0 };
        (0..240).for_each(|_| at = climb.step(&at, Some(400.0), Duration::from_s(0.5)));
        assert!((at.altitude_m - 320.0).abs() < 1e-3, "{at:?}");
        let mut at = Vertical { altitude_m: 300.0, climb_rate_m_s: 3.0 };
        (0..240).for_each(|_| at = climb.step(&at, None, Duration::from_s(0.5)));
        assert!((at.altitude_m - 303.0).abs() < 1e-6 && at.climb_rate_m_s.abs() < 1e-9, "{at:?}");
    }

    fn table_1(integrator: Integrator) -> UavParams {
        UavParams {
            speed_m_s: 40.0,
            speed_change_max_m_s: 15.0,
            turn_rate_max_rad_s: 0.3,
            speed_lag_s: 1.0 / 3.0,
            turn_rate_lag_s: 1.0 / 3.0,
            integrator,
            climb: None,
        }
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
    fn the_exact_step_solves_the_kinematics() {
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
            assert!((got.position.x_m() - s[0]).abs() < 1e-9, "{dt_s} s: {got:?} against {s:?}");
            assert!((got.position.y_m() - s[1]).abs() < 1e-9);
            assert!((got.heading - Angle::from_rad(s[2])).abs_rad() < 1e-9);
            assert!((got.speed_m_s - s[3]).abs() < 1e-9);
            assert!((got.turn_rate_rad_s - s[4]).abs() < 1e-9);
        }
    }

    /// Checks Eq. (4): the state moves by T_s f(x, u).
    #[test]
    fn the_euler_step_is_the_printed_one() {
        let command = Command { speed_m_s: 44.0, turn_rate_rad_s: 0.2 };
        let got = table_1(Integrator::Euler).response(Duration::from_s(0.5)).step(&start(), command);
        assert!((got.position.x_m() - (10.0 + 0.5 * 38.0 * math::cos(100.0 * PI / 180.0))).abs() < 1e-12);
        assert!((got.heading - Angle::from_rad(100.0 * PI / 180.0 - 0.05)).abs_rad() < 1e-12);
        assert!((got.speed_m_s - (38.0 + 0.5 * 3.0 * 6.0)).abs() < 1e-9);
        assert!((got.turn_rate_rad_s - (-0.1 + 0.5 * 3.0 * 0.3)).abs() < 1e-9);
    }

    /// Checks Eq. (4) where it is allowed: whatever is commanded inside the limits, speed and turn rate stay inside.
    #[test]
    fn an_euler_step_that_is_allowed_does_not_overshoot() {
        let period = Duration::from_s(0.5);
        let with_lags =
            |speed_lag_s, turn_rate_lag_s| UavParams { speed_lag_s, turn_rate_lag_s, ..table_1(Integrator::Euler) };
        let names =
            |params: UavParams| params.errors_over(period).into_iter().map(|error| error.path).collect::<Vec<_>>();
        // Table I's lags fly at 10 m/s after one step down from 55 m/s, where 25 m/s is the least that is commanded.
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

    /// Checks the erratum of Eq. (4): at Table I's values the Euler loop has no stability left, the exact one has.
    #[test]
    fn the_euler_heading_loop_is_marginal_at_table_1() {
        let period = Duration::from_s(0.5);
        assert!((table_1(Integrator::Euler).heading_loop_modulus(2.0, period) - 1.0).abs() < 1e-9);
        assert!((table_1(Integrator::Exact).heading_loop_modulus(2.0, period) - 0.720).abs() < 5e-4);
        assert!(table_1(Integrator::Euler).heading_loop_modulus(2.1, period) > 1.0);
    }

    /// Checks Eq. (2), (3).
    #[test]
    fn commands_are_limited_and_say_so() {
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
