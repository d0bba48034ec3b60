//! Orbit motion: moves the centre and radius of an orbit continuously, with bounded speed and acceleration, so that
//! UAVs can follow.
//!
//! The desired orbit jumps when another member becomes the furthest one or when the membership changes. The flown orbit
//! follows it as a second-order reference model. The model is critically damped with time constant T, its acceleration
//! never exceeds a_max, and it brakes in time:
//!
//! ```text
//! e = x* - x      c(e) = e / 2T  for |e| <= 4 a_max T^2,  else  sqrt(2 a_max (|e| - 2 a_max T^2)) along e,  at most c_max
//! x'' = 2 / T (x*' + c(e) - x')        |x''| <= a_max
//! ```
//!
//! For small e this is x'' = e / T^2 + 2 / T (x*' - x'), without overshoot and without lag behind a steady motion. For
//! large e, c(e) is the speed from which a_max just stops in time (near the end it is lower). Both parts and their
//! slopes are continuous at 4 a_max T^2.
//!
//! For the centre, x is a position in the plane and x*' is the mean velocity of the members. For the radius, x is a
//! number and x*' = 0. The radius follows (15) for the spread around the *flown* centre, so that the members in view
//! from the desired orbit are also in view from the flown orbit. It lags by 2 T behind a steady change. A desired rate
//! is not used for the radius: it would be that of a single member, which the filter estimates with delay, and an error
//! of 1 m/s would shift the radius by 2 T / sin((alpha_f - eps_m) / 2) = 6 m.
//!
//! The turn limit about the moving centre (27), which is a lower bound of the radius, follows the limit at the mean
//! velocity of the members as a first-order low-pass.
//!
//! This is not part of the paper, which uses the orbit of (15) directly. Reference models and their limits: Fossen,
//! *Handbook of Marine Craft Hydrodynamics and Motion Control* (2011), section 10.2. The square-root approach is
//! ArduPilot's `sqrt_controller`.

use nalgebra::{SVector, Vector1};

use crate::frame::{Position, Velocity};
use crate::guidance::standoff_distance::StandoffDistance;
use crate::params::{MotionParams, StandoffParams};
use crate::target::TargetState;

impl MotionParams {
    /// Returns true if orbits follow the desired values immediately.
    pub fn is_instantaneous(&self) -> bool {
        self.time_constant_s <= 0.0
    }
}

/// The flown orbit and its motion.
///
/// ```
/// use standoff::params::MotionParams;
/// use standoff::guidance::orbit_motion::OrbitMotion;
/// use standoff::guidance::standoff_distance::Spread;
/// use standoff::{Position, TargetState, TeamParams, Velocity};
///
/// let motion = MotionParams { time_constant_s: 1.5, acceleration_max_m_s2: 3.0, closing_speed_max_m_s: 25.0 };
/// let params = TeamParams::paper();
/// let (bounds, sensor) = (params.group.standoff, params.track.sensor);
/// let at = |x_m| TargetState::new(Position::from_m(x_m, 0.0), Velocity::ZERO, [0.0, 0.0]);
/// let alone = bounds.distance(Spread::default(), 0.0, &sensor);
/// // The only member is 100 m from the centre: the centre starts to move, and the radius keeps the member in view.
/// let orbit = OrbitMotion::start(&at(0.0), &alone, 0.0).with_centre(&at(100.0), &motion, 0.5);
/// assert!(orbit.centre.x_m() > 0.0 && orbit.velocity.x_m_s() <= 3.0 * 0.5 + 1e-9);
/// let spread = Spread::of(&at(100.0), &orbit.state());
/// let orbit = orbit.with_radius(bounds.distance(spread, 0.0, &sensor).distance_m, &bounds, &motion, 0.5);
/// assert!(orbit.radius_m >= 250.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrbitMotion {
    /// Centre of the orbit.
    pub centre: Position,
    /// Velocity of the centre.
    pub velocity: Velocity,
    /// Radius, m; within the bounds of r_d.
    pub radius_m: f64,
    /// Rate of the radius, m/s; 0 at a bound.
    pub rate_m_s: f64,
    /// Turn limit that bounds the radius, m.
    pub turn_limit_m: f64,
}

/// Time constant with which the turn limit follows that of the members' mean velocity, s. It filters the error of the
/// velocity: at 40 m/s, 1 m/s more or less changes the limit by 9 m.
const TURN_LIMIT_TIME_CONSTANT_S: f64 = 5.0;

impl OrbitMotion {
    /// Starts the orbit at the desired centre, radius and turn limit.
    pub fn start(centre: &TargetState, standoff: &StandoffDistance, turn_limit_m: f64) -> Self {
        let (centre, velocity) = (centre.position(), centre.velocity());
        Self { centre, velocity, radius_m: standoff.distance_m, rate_m_s: standoff.rate_m_s, turn_limit_m }
    }

    /// Advances the turn limit by `dt_s` towards `limit_m`, which may be infinite.
    #[must_use]
    pub fn with_turn_limit(self, limit_m: f64, dt_s: f64) -> Self {
        let gain = dt_s / (TURN_LIMIT_TIME_CONSTANT_S + dt_s);
        let is_finite = self.turn_limit_m.is_finite() && limit_m.is_finite();
        let turn_limit_m = if is_finite { self.turn_limit_m + gain * (limit_m - self.turn_limit_m) } else { limit_m };
        Self { turn_limit_m, ..self }
    }

    /// Advances the centre by `dt_s` towards the desired centre. The radius is advanced by [`Self::with_radius`].
    #[must_use]
    pub fn with_centre(self, desired: &TargetState, params: &MotionParams, dt_s: f64) -> Self {
        let of =
            |at: Position, velocity: Velocity| Motion { at: (at - Position::ORIGIN).vector(), rate: velocity.vector() };
        let flown = of(self.centre, self.velocity).follow(&of(desired.position(), desired.velocity()), params, dt_s);
        Self {
            centre: Position::from_m(flown.at.x, flown.at.y),
            velocity: Velocity::from_m_s(flown.rate.x, flown.rate.y),
            ..self
        }
    }

    /// Advances the radius by `dt_s` towards `desired_m`, which is r_d around the flown centre at that time. The radius
    /// stops at a bound and can leave it immediately (no wind-up). If the lower bound has risen, the radius rises with
    /// it.
    #[must_use]
    pub fn with_radius(self, desired_m: f64, bounds: &StandoffParams, params: &MotionParams, dt_s: f64) -> Self {
        let of = |radius_m: f64, rate_m_s: f64| Motion { at: Vector1::new(radius_m), rate: Vector1::new(rate_m_s) };
        let flown = of(self.radius_m, self.rate_m_s).follow(&of(desired_m, 0.0), params, dt_s);
        let radius_m = flown.at.x.clamp(bounds.radius_min_m, bounds.radius_max_m);
        let fastest_m_s = params.closing_speed_max_m_s;
        let rate_m_s = if radius_m == flown.at.x {
            flown.rate.x.clamp(-fastest_m_s, fastest_m_s)
        } else if radius_m == bounds.radius_min_m {
            ((radius_m - self.radius_m) / dt_s).clamp(0.0, fastest_m_s)
        } else {
            0.0
        };
        Self { radius_m, rate_m_s, ..self }
    }

    /// Position and velocity of the centre as a state with zero acceleration.
    pub fn state(&self) -> TargetState {
        TargetState::new(self.centre, self.velocity, [0.0, 0.0])
    }
}

/// Position and rate in `D` dimensions: m, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Motion<const D: usize> {
    at: SVector<f64, D>,
    rate: SVector<f64, D>,
}

impl<const D: usize> Motion<D> {
    /// Advances the motion by `dt_s` towards the desired one.
    fn follow(self, desired: &Self, params: &MotionParams, dt_s: f64) -> Self {
        // A time constant below the period would cause ringing.
        let (t_s, a_m_s2) = (params.time_constant_s.max(dt_s), params.acceleration_max_m_s2);
        let predicted = self.at + self.rate * dt_s;
        let error = desired.at - predicted;
        let distance_m = error.norm();
        let knee_m = a_m_s2 * t_s * t_s;
        let approach_m_s = if distance_m <= 4.0 * knee_m {
            distance_m / (2.0 * t_s)
        } else {
            (2.0 * a_m_s2 * (distance_m - 2.0 * knee_m)).sqrt()
        };
        let approach_m_s = approach_m_s.min(params.closing_speed_max_m_s);
        let along = if distance_m > 0.0 { error / distance_m } else { error };
        // A lag of T / 2, by an implicit Euler step, which is stable for any step size.
        let gain = dt_s / (0.5 * t_s + dt_s);
        let change = (desired.rate + along * approach_m_s - self.rate) * gain;
        let max_m_s = a_m_s2 * dt_s;
        let change = if change.norm() > max_m_s { change * (max_m_s / change.norm()) } else { change };
        let next = Self { at: predicted + change * (0.5 * dt_s), rate: self.rate + change };
        // The result is not finite if `dt_s` and T are zero, or after an overflow.
        if next.is_finite() { next } else { self }
    }

    fn is_finite(&self) -> bool {
        self.at.iter().chain(self.rate.iter()).all(|number| number.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guidance::standoff_distance::Spread;

    const PARAMS: MotionParams =
        MotionParams { time_constant_s: 1.5, acceleration_max_m_s2: 3.0, closing_speed_max_m_s: 25.0 };
    const BOUNDS: StandoffParams =
        StandoffParams { field_of_view_margin_rad: 0.2, radius_min_m: 250.0, radius_max_m: 700.0 };
    const DT_S: f64 = 0.5;

    fn state(x_m: f64, y_m: f64, vx_m_s: f64, vy_m_s: f64) -> TargetState {
        TargetState::new(Position::from_m(x_m, y_m), Velocity::from_m_s(vx_m_s, vy_m_s), [0.0, 0.0])
    }

    fn r_d(distance_m: f64, rate_m_s: f64) -> StandoffDistance {
        StandoffDistance { unclamped_m: distance_m, distance_m, rate_m_s }
    }

    /// Motion of an orbit that starts stationary at the origin with a radius of 400 m, at `steps` time steps.
    fn flown(desired: impl Fn(f64) -> (TargetState, f64), steps: u32, dt_s: f64) -> Vec<OrbitMotion> {
        let mut orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(400.0, 0.0), 0.0);
        let mut next = |step: u32| {
            let (centre, desired_m) = desired(f64::from(step) * dt_s);
            orbit = orbit.with_centre(&centre, &PARAMS, dt_s).with_radius(desired_m, &BOUNDS, &PARAMS, dt_s);
            orbit
        };
        (1..=steps).map(&mut next).collect()
    }

    /// A small step, to which no limit applies, is followed with e(t) = e_0 (1 + t / T) exp(-t / T).
    #[test]
    fn the_step_response_to_a_small_step_is_critically_damped() {
        let dt_s = 0.001;
        let orbits = flown(|_| (state(3.0, 4.0, 0.0, 0.0), 400.0), 6000, dt_s);
        for (step, orbit) in (1u32..).zip(&orbits) {
            let by_t = f64::from(step) * dt_s / PARAMS.time_constant_s;
            let expected_m = 5.0 * (1.0 + by_t) * crate::math::exp(-by_t);
            let error_m = orbit.centre.distance_m(Position::from_m(3.0, 4.0));
            assert!((error_m - expected_m).abs() < 0.01, "{error_m} {expected_m}");
        }
    }

    /// Jumps of 5, 50, 300 and 5000 m: the orbit moves straight to the goal with bounded acceleration and speed, with
    /// almost no overshoot. The same applies to centre and radius.
    #[test]
    fn a_jump_becomes_a_motion_that_brakes_in_time() {
        for jump_m in [5.0, 50.0, 300.0, 5000.0] {
            let (east, north) = (0.6 * jump_m, 0.8 * jump_m);
            let orbits = flown(|_| (state(east, north, 0.0, 0.0), 400.0 + jump_m.min(200.0)), 1000, DT_S);
            let mut before = (Velocity::ZERO, 0.0f64);
            for orbit in &orbits {
                let along_m = 0.6 * orbit.centre.x_m() + 0.8 * orbit.centre.y_m();
                assert!(along_m < jump_m * 1.03, "{jump_m}: {along_m}");
                assert!((0.8 * orbit.centre.x_m() - 0.6 * orbit.centre.y_m()).abs() < 1e-6);
                assert!((orbit.velocity - before.0).speed_m_s() <= 3.0 * DT_S + 1e-9);
                assert!(orbit.velocity.speed_m_s() <= 25.0 + 1e-9);
                assert!(orbit.radius_m < 400.0 + jump_m.min(200.0) * 1.03);
                assert!((orbit.rate_m_s - before.1).abs() <= 3.0 * DT_S + 1e-9);
                before = (orbit.velocity, orbit.rate_m_s);
            }
            let last = orbits.last().unwrap();
            assert!(last.centre.distance_m(Position::from_m(east, north)) < 1e-6, "{jump_m}");
            assert!((last.radius_m - 400.0 - jump_m.min(200.0)).abs() < 1e-6);
        }
        // At 3 m/s2, 300 m take at least 20 s, less the last 3 m's sqrt(2 * 3 / 3) s; the lag adds little.
        let orbits = flown(|_| (state(300.0, 0.0, 0.0, 0.0), 400.0), 100, DT_S);
        let arrived = orbits.iter().position(|orbit| orbit.centre.x_m() > 297.0).unwrap();
        assert!((36..42).contains(&arrived), "{arrived}");
    }

    /// The approach is continuous at the knee, in itself and in its slope: 2 a T and 1 / 2T.
    #[test]
    fn the_approach_is_continuous_at_the_knee() {
        let still = Motion { at: Vector1::new(0.0), rate: Vector1::new(0.0) };
        // The step is so short that the acceleration limit has no effect. The approach speed is measured by the change.
        let params = MotionParams { acceleration_max_m_s2: 3.0, closing_speed_max_m_s: 1e9, time_constant_s: 1.5 };
        let approach = |error_m: f64| {
            let gain = 1e-3 / (0.75 + 1e-3);
            // The change is zero if the desired rate cancels the approach speed.
            let desired = |c: f64| Motion { at: Vector1::new(error_m), rate: Vector1::new(-c) };
            let (mut low, mut high): (f64, f64) = (0.0, 100.0);
            for _ in 0..60 {
                let c = 0.5 * (low + high);
                let change = still.follow(&desired(c), &params, 1e-3).rate.x / gain;
                if change > 0.0 { low = c } else { high = c }
            }
            low
        };
        let knee_m = 4.0 * 3.0 * 1.5 * 1.5;
        assert!((approach(knee_m) - 2.0 * 3.0 * 1.5).abs() < 1e-6);
        let slope = |from_m: f64, to_m: f64| (approach(to_m) - approach(from_m)) / (to_m - from_m);
        assert!((slope(knee_m - 0.01, knee_m) - 1.0 / 3.0).abs() < 1e-3);
        assert!((slope(knee_m, knee_m + 0.01) - 1.0 / 3.0).abs() < 1e-3);
    }

    /// A centre at 10 m/s is followed without lag, a radius that should grow by 2 m/s with a lag of 2 T = 3 s.
    #[test]
    fn a_steady_centre_is_followed_without_lag_and_a_steady_radius_with_lag() {
        let orbits = flown(|t_s| (state(10.0 * t_s, -20.0, 10.0, 0.0), 400.0 + 2.0 * t_s), 120, DT_S);
        let last = orbits.last().unwrap();
        assert!(last.centre.distance_m(Position::from_m(600.0, -20.0)) < 1e-3, "{last:?}");
        // Sampling changes the lag by up to half a period.
        assert!((last.radius_m - 514.0).abs() <= 2.0 * 0.5 * DT_S + 1e-3, "{last:?}");
        assert!((last.rate_m_s - 2.0).abs() < 1e-3, "{last:?}");
    }

    /// A radius of 690 m that grows by 20 m/s stops at the bound of 700 m. Later it leaves the bound as if from
    /// standstill.
    #[test]
    fn the_radius_stops_at_a_bound_without_wind_up() {
        let mut orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(690.0, 20.0), 0.0);
        let mut step = |desired_m| {
            orbit = orbit.with_radius(desired_m, &BOUNDS, &PARAMS, DT_S);
            (orbit.radius_m, orbit.rate_m_s)
        };
        let at_bound: Vec<_> = (0..4).map(|_| step(700.0)).collect();
        assert!(at_bound[1..].iter().all(|at| *at == (700.0, 0.0)), "{at_bound:?}");
        // Full a_max from the first time step: 0.5 * 3 * 0.5^2 m.
        assert_eq!(step(400.0), (700.0 - 0.375, -1.5));
    }

    /// The radius rises with its lower bound, and its rate is that of the bound. The turn limit itself is a low-pass of
    /// the limit at the members' velocity.
    #[test]
    fn the_radius_rises_with_the_turn_limit() {
        let mut orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(260.0, 0.0), 250.0);
        for step in 1..=100 {
            let before = orbit;
            orbit = orbit.with_turn_limit(350.0, DT_S);
            let expected_m = 350.0 - 100.0 * crate::math::exp(-f64::from(step) * crate::math::ln(1.1));
            assert!((orbit.turn_limit_m - expected_m).abs() < 1e-9);
            let bounds = StandoffParams { radius_min_m: orbit.turn_limit_m, ..BOUNDS };
            orbit = orbit.with_radius(bounds.radius_min_m, &bounds, &PARAMS, DT_S);
            assert!(orbit.radius_m >= orbit.turn_limit_m && orbit.radius_m < 370.0, "{orbit:?}");
            let is_at_bound = orbit.radius_m == orbit.turn_limit_m;
            let mean_m_s = (orbit.radius_m - before.radius_m) / DT_S;
            assert!(!is_at_bound || (orbit.rate_m_s - mean_m_s).abs() < 1e-9, "{orbit:?}");
        }
        assert!((orbit.radius_m - 350.0).abs() < 0.1);
        assert_eq!(orbit.with_turn_limit(f64::INFINITY, DT_S).turn_limit_m, f64::INFINITY);
        assert_eq!(orbit.with_turn_limit(f64::INFINITY, DT_S).with_turn_limit(400.0, DT_S).turn_limit_m, 400.0);
    }

    /// A time constant below the period is treated as the period, so that the motion does not ring.
    #[test]
    fn a_time_constant_shorter_than_the_period_does_not_ring() {
        let quick = MotionParams { time_constant_s: 0.01, acceleration_max_m_s2: 100.0, closing_speed_max_m_s: 1000.0 };
        let mut orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(400.0, 0.0), 0.0);
        for _ in 0..40 {
            orbit = orbit.with_centre(&state(20.0, 0.0, 0.0, 0.0), &quick, DT_S);
            assert!(orbit.centre.x_m() < 20.6, "{orbit:?}");
        }
        assert!((orbit.centre.x_m() - 20.0).abs() < 1e-6, "{orbit:?}");
    }

    /// The orbit stays finite for any desired values.
    #[test]
    fn extreme_desired_values_give_a_finite_orbit() {
        let extremes = [0.0, 1e-300, -1e9, 1e160, -1e308, f64::MAX, f64::INFINITY, f64::NAN];
        for desired in extremes {
            for other in extremes {
                let mut orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(400.0, 0.0), 0.0);
                for dt_s in [0.5, 0.0, 1e-12, 1e6] {
                    orbit = orbit.with_centre(&state(desired, other, other, desired), &PARAMS, dt_s);
                    orbit = orbit.with_radius(desired, &BOUNDS, &PARAMS, dt_s);
                    let numbers = [orbit.centre.x_m(), orbit.centre.y_m(), orbit.velocity.speed_m_s()];
                    assert!(numbers.iter().all(|number| number.is_finite()), "{desired} {other} {dt_s}: {orbit:?}");
                    assert!((250.0..=700.0).contains(&orbit.radius_m) && orbit.rate_m_s.abs() <= 25.0, "{orbit:?}");
                }
            }
        }
    }

    /// The spread is measured from the flown centre: a member 100 m from a centre that moves towards it.
    #[test]
    fn the_spread_is_measured_from_the_flown_centre() {
        let member = state(100.0, 0.0, 0.0, 0.0);
        let orbit =
            OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(400.0, 0.0), 0.0).with_centre(&member, &PARAMS, DT_S);
        // Full a_max from standstill.
        assert_eq!(orbit.state(), state(0.375, 0.0, 1.5, 0.0));
        let spread = Spread::of(&member, &orbit.state());
        assert_eq!(spread, Spread { distance_m: 99.625, rate_m_s: -1.5 });
    }

    #[test]
    fn invalid_parameters_are_rejected() {
        let bad = MotionParams { time_constant_s: -1.0, acceleration_max_m_s2: 0.0, closing_speed_max_m_s: f64::NAN };
        let names: Vec<_> = bad.out_of_range().into_iter().map(|error| error.path).collect();
        assert_eq!(names, ["time_constant_s", "acceleration_max_m_s2", "closing_speed_max_m_s"]);
        assert!(PARAMS.out_of_range().is_empty());
    }
}
