//! An orbit whose centre and radius move as a UAV can follow: continuous, with bounded speed and acceleration.
//!
//! What an orbit should be like jumps: another member becomes the furthest, members come and go. What is flown follows it
//! as a reference model of the second order, critically damped with time constant T, whose acceleration never exceeds
//! a_max, and which brakes in time:
//!
//! ```text
//! e = x* - x      c(e) = e / 2T  for |e| <= 4 a_max T^2,  else  sqrt(2 a_max (|e| - 2 a_max T^2)) along e,  at most c_max
//! x'' = 2 / T (x*' + c(e) - x')        |x''| <= a_max
//! ```
//!
//! For small e that is x'' = e / T^2 + 2 / T (x*' - x'): no overshoot, and no lag behind what moves steadily. For large e
//! it is the speed from which a_max just stops (less than that near the end); both parts and their slopes meet at
//! 4 a_max T^2. The centre is x in the plane, with x*' the members' mean velocity. The radius is x on a line, with
//! x*' = 0: it follows (15) of the spread about the centre *as flown*, so that who is in view of the one is in view of the
//! other, and lags by 2 T behind a steady change of it. Its rate is one member's, which the filter learns late; taken in,
//! an error of 1 m/s would put the radius 2 T / sin((alpha_f - eps_m) / 2) = 6 m off.
//!
//! Beyond the paper, whose orbit is where (15) has it at once. Reference models and their limits: Fossen, *Handbook of
//! Marine Craft Hydrodynamics and Motion Control* (2011), section 10.2; the approach by the square root is ArduPilot's
//! `sqrt_controller`.

use nalgebra::{SVector, Vector1};

use crate::frame::{Position, Velocity};
use crate::guidance::standoff_distance::{StandoffDistance, StandoffParams};
use crate::param::{Allowed, ParamError};
use crate::target::TargetState;

/// How quick an orbit's centre and radius may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionParams {
    /// Time constant T with which centre and radius follow what they should be, s; at least 0; 0: at once. One shorter
    /// than the time between two instants counts as that.
    pub response_s: f64,
    /// Largest acceleration a_max of centre and radius, m/s2; above 0.
    pub acceleration_max_m_s2: f64,
    /// Fastest that centre and radius approach what they should be, c_max, m/s; above 0. The radius changes no faster.
    pub approach_max_m_s: f64,
}

impl MotionParams {
    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = Vec::new();
        Allowed::at_least(0.0).at_most(60.0).check("response_s", self.response_s, &mut errors);
        let above_0 = Allowed::above(0.0);
        above_0.at_most(100.0).check("acceleration_max_m_s2", self.acceleration_max_m_s2, &mut errors);
        above_0.at_most(1000.0).check("approach_max_m_s", self.approach_max_m_s, &mut errors);
        errors
    }

    /// Orbits are at once where they should be.
    pub fn is_at_once(&self) -> bool {
        self.response_s <= 0.0
    }
}

/// Where an orbit is flown, and how that moves.
///
/// ```
/// use standoff::{MotionParams, OrbitMotion, Position, Spread, TargetState, TeamParams, Velocity};
///
/// let params = MotionParams { response_s: 1.5, acceleration_max_m_s2: 3.0, approach_max_m_s: 25.0 };
/// let bounds = TeamParams::table_1().group.standoff;
/// let at = |x_m| TargetState::new(Position::from_m(x_m, 0.0), Velocity::ZERO, [0.0, 0.0]);
/// let alone = bounds.distance(Spread::default(), 0.0);
/// // Its only member is 100 m from where the orbit is: the centre sets out for it, and the radius holds it meanwhile.
/// let orbit = OrbitMotion::start(&at(0.0), &alone).centred_on(&at(100.0), &params, 0.5);
/// assert!(orbit.centre.x_m() > 0.0 && orbit.velocity.x_m_s() <= 3.0 * 0.5 + 1e-9);
/// let spread = Spread::of(&at(100.0), &orbit.state());
/// let orbit = orbit.widened_to(bounds.distance(spread, 0.0).distance_m, &bounds, &params, 0.5);
/// assert!(orbit.radius_m >= 250.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrbitMotion {
    /// Its centre.
    pub centre: Position,
    /// How that moves.
    pub velocity: Velocity,
    /// Its radius, m; within the bounds of r_d.
    pub radius_m: f64,
    /// How that changes, m/s; 0 at a bound.
    pub rate_m_s: f64,
}

impl OrbitMotion {
    /// An orbit that is where it should be.
    pub fn start(centre: &TargetState, standoff: &StandoffDistance) -> Self {
        let (centre, velocity) = (centre.position(), centre.velocity());
        Self { centre, velocity, radius_m: standoff.distance_m, rate_m_s: standoff.rate_m_s }
    }

    /// The centre `dt_s` later, when it should be `wanted`; the radius follows by [`Self::widened_to`].
    #[must_use]
    pub fn centred_on(self, wanted: &TargetState, params: &MotionParams, dt_s: f64) -> Self {
        let of =
            |at: Position, velocity: Velocity| Motion { at: (at - Position::ORIGIN).vector(), rate: velocity.vector() };
        let flown = of(self.centre, self.velocity).follow(&of(wanted.position(), wanted.velocity()), params, dt_s);
        Self {
            centre: Position::from_m(flown.at.x, flown.at.y),
            velocity: Velocity::from_m_s(flown.rate.x, flown.rate.y),
            ..self
        }
    }

    /// The radius `dt_s` later, when r_d about the centre as flown by then is `wanted_m`. At a bound it stops, and is free
    /// at once to leave it: nothing is wound up beyond.
    #[must_use]
    pub fn widened_to(self, wanted_m: f64, bounds: &StandoffParams, params: &MotionParams, dt_s: f64) -> Self {
        let of = |radius_m: f64, rate_m_s: f64| Motion { at: Vector1::new(radius_m), rate: Vector1::new(rate_m_s) };
        let flown = of(self.radius_m, self.rate_m_s).follow(&of(wanted_m, 0.0), params, dt_s);
        let radius_m = flown.at.x.clamp(bounds.radius_min_m, bounds.radius_max_m);
        let fastest_m_s = params.approach_max_m_s;
        let is_free = radius_m == flown.at.x;
        let rate_m_s = if is_free { flown.rate.x.clamp(-fastest_m_s, fastest_m_s) } else { 0.0 };
        Self { radius_m, rate_m_s, ..self }
    }

    /// The centre as a state without acceleration.
    pub fn state(&self) -> TargetState {
        TargetState::new(self.centre, self.velocity, [0.0, 0.0])
    }
}

/// Where something is and how it moves, in `D` dimensions: m, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Motion<const D: usize> {
    at: SVector<f64, D>,
    rate: SVector<f64, D>,
}

impl<const D: usize> Motion<D> {
    /// This motion `dt_s` later, when it should be as `wanted`.
    fn follow(self, wanted: &Self, params: &MotionParams, dt_s: f64) -> Self {
        // The period is what a response can be no shorter than without ringing.
        let (t_s, a_m_s2) = (params.response_s.max(dt_s), params.acceleration_max_m_s2);
        let carried = self.at + self.rate * dt_s;
        let error = wanted.at - carried;
        let distance_m = error.norm();
        let knee_m = a_m_s2 * t_s * t_s;
        let approach_m_s = if distance_m <= 4.0 * knee_m {
            distance_m / (2.0 * t_s)
        } else {
            (2.0 * a_m_s2 * (distance_m - 2.0 * knee_m)).sqrt()
        };
        let approach_m_s = approach_m_s.min(params.approach_max_m_s);
        let along = if distance_m > 0.0 { error / distance_m } else { error };
        // A lag of T / 2, by Euler's implicit step, which holds for any step.
        let gain = dt_s / (0.5 * t_s + dt_s);
        let change = (wanted.rate + along * approach_m_s - self.rate) * gain;
        let most_m_s = a_m_s2 * dt_s;
        let change = if change.norm() > most_m_s { change * (most_m_s / change.norm()) } else { change };
        let next = Self { at: carried + change * (0.5 * dt_s), rate: self.rate + change };
        // No time has passed, or the numbers are beyond all use.
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

    const PARAMS: MotionParams = MotionParams { response_s: 1.5, acceleration_max_m_s2: 3.0, approach_max_m_s: 25.0 };
    const BOUNDS: StandoffParams = StandoffParams {
        field_of_view_rad: 1.2,
        field_of_view_margin_rad: 0.2,
        radius_min_m: 250.0,
        radius_max_m: 700.0,
    };
    const DT_S: f64 = 0.5;

    fn state(x_m: f64, y_m: f64, vx_m_s: f64, vy_m_s: f64) -> TargetState {
        TargetState::new(Position::from_m(x_m, y_m), Velocity::from_m_s(vx_m_s, vy_m_s), [0.0, 0.0])
    }

    fn r_d(distance_m: f64, rate_m_s: f64) -> StandoffDistance {
        StandoffDistance { unclamped_m: distance_m, distance_m, rate_m_s }
    }

    /// The ways of an orbit that starts at rest at the origin with a radius of 400 m, at so many instants.
    fn flown(wanted: impl Fn(f64) -> (TargetState, f64), steps: u32, dt_s: f64) -> Vec<OrbitMotion> {
        let mut orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(400.0, 0.0));
        let mut next = |step: u32| {
            let (centre, wanted_m) = wanted(f64::from(step) * dt_s);
            orbit = orbit.centred_on(&centre, &PARAMS, dt_s).widened_to(wanted_m, &BOUNDS, &PARAMS, dt_s);
            orbit
        };
        (1..=steps).map(&mut next).collect()
    }

    /// A small step, to which no limit applies, is followed as the formula says: e(t) = e_0 (1 + t / T) exp(-t / T).
    #[test]
    fn a_small_step_is_answered_as_by_a_critically_damped_system() {
        let dt_s = 0.001;
        let orbits = flown(|_| (state(3.0, 4.0, 0.0, 0.0), 400.0), 6000, dt_s);
        for (step, orbit) in (1u32..).zip(&orbits) {
            let by_t = f64::from(step) * dt_s / PARAMS.response_s;
            let expected_m = 5.0 * (1.0 + by_t) * crate::math::exp(-by_t);
            let error_m = orbit.centre.distance_m(Position::from_m(3.0, 4.0));
            assert!((error_m - expected_m).abs() < 0.01, "{error_m} {expected_m}");
        }
    }

    /// Jumps of 5, 50, 300 and 5000 m: the way there is a straight motion of bounded acceleration and speed, which goes
    /// hardly beyond, and ends there. Centre and radius do alike.
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
        // With 3 m/s2, 297 of 300 m take 20 s less the last 3 m's sqrt(2 * 3 / 3) s at least; the lag adds little.
        let orbits = flown(|_| (state(300.0, 0.0, 0.0, 0.0), 400.0), 100, DT_S);
        let arrived = orbits.iter().position(|orbit| orbit.centre.x_m() > 297.0).unwrap();
        assert!((36..42).contains(&arrived), "{arrived}");
    }

    /// The approach is continuous at the knee, in itself and in its slope: 2 a T and 1 / 2T.
    #[test]
    fn both_parts_of_the_approach_meet() {
        let still = Motion { at: Vector1::new(0.0), rate: Vector1::new(0.0) };
        // So short a step that the limit of the acceleration does not matter, seen through the change.
        let params = MotionParams { acceleration_max_m_s2: 3.0, approach_max_m_s: 1e9, response_s: 1.5 };
        let approach = |error_m: f64| {
            let gain = 1e-3 / (0.75 + 1e-3);
            // At the speed of the approach nothing changes: the wanted rate takes it off.
            let wanted = |c: f64| Motion { at: Vector1::new(error_m), rate: Vector1::new(-c) };
            let (mut low, mut high): (f64, f64) = (0.0, 100.0);
            for _ in 0..60 {
                let c = 0.5 * (low + high);
                let change = still.follow(&wanted(c), &params, 1e-3).rate.x / gain;
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

    /// A centre at 10 m/s is followed without lag; a radius that should grow by 2 m/s, by 2 T = 3 s.
    #[test]
    fn a_centre_that_moves_steadily_is_followed_without_lag_and_a_radius_with_its_own() {
        let orbits = flown(|t_s| (state(10.0 * t_s, -20.0, 10.0, 0.0), 400.0 + 2.0 * t_s), 120, DT_S);
        let last = orbits.last().unwrap();
        assert!(last.centre.distance_m(Position::from_m(600.0, -20.0)) < 1e-3, "{last:?}");
        // Of the sampled motion, up to half a period more or less.
        assert!((last.radius_m - 514.0).abs() <= 2.0 * 0.5 * DT_S + 1e-3, "{last:?}");
        assert!((last.rate_m_s - 2.0).abs() < 1e-3, "{last:?}");
    }

    /// At 690 m it grows by 20 m/s: it stops at the bound of 700 m, and a second later leaves it as it would from rest.
    #[test]
    fn at_a_bound_the_radius_stops_and_winds_nothing_up() {
        let mut orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(690.0, 20.0));
        let mut step = |wanted_m| {
            orbit = orbit.widened_to(wanted_m, &BOUNDS, &PARAMS, DT_S);
            (orbit.radius_m, orbit.rate_m_s)
        };
        let at_bound: Vec<_> = (0..4).map(|_| step(700.0)).collect();
        assert!(at_bound[1..].iter().all(|at| *at == (700.0, 0.0)), "{at_bound:?}");
        // All of a_max from the first instant: 0.5 * 3 * 0.5^2 m.
        assert_eq!(step(400.0), (700.0 - 0.375, -1.5));
    }

    /// Shorter than the period, a response is as long as that: nothing rings.
    #[test]
    fn a_response_shorter_than_the_period_does_not_ring() {
        let quick = MotionParams { response_s: 0.01, acceleration_max_m_s2: 100.0, approach_max_m_s: 1000.0 };
        let mut orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(400.0, 0.0));
        for _ in 0..40 {
            orbit = orbit.centred_on(&state(20.0, 0.0, 0.0, 0.0), &quick, DT_S);
            assert!(orbit.centre.x_m() < 20.6, "{orbit:?}");
        }
        assert!((orbit.centre.x_m() - 20.0).abs() < 1e-6, "{orbit:?}");
    }

    /// Whatever is asked for, an orbit has numbers; so has one that starts beyond all use.
    #[test]
    fn no_wish_makes_an_orbit_that_is_none() {
        let wishes = [0.0, 1e-300, -1e9, 1e160, -1e308, f64::MAX, f64::INFINITY, f64::NAN];
        for wish in wishes {
            for other in wishes {
                let mut orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(400.0, 0.0));
                for dt_s in [0.5, 0.0, 1e-12, 1e6] {
                    orbit = orbit.centred_on(&state(wish, other, other, wish), &PARAMS, dt_s);
                    orbit = orbit.widened_to(wish, &BOUNDS, &PARAMS, dt_s);
                    let numbers = [orbit.centre.x_m(), orbit.centre.y_m(), orbit.velocity.speed_m_s()];
                    assert!(numbers.iter().all(|number| number.is_finite()), "{wish} {other} {dt_s}: {orbit:?}");
                    assert!((250.0..=700.0).contains(&orbit.radius_m) && orbit.rate_m_s.abs() <= 25.0, "{orbit:?}");
                }
            }
        }
    }

    /// The radius is that of the spread about the centre as flown: a member 100 m from a centre that is on its way to it.
    #[test]
    fn the_radius_is_about_the_centre_as_flown() {
        let member = state(100.0, 0.0, 0.0, 0.0);
        let orbit = OrbitMotion::start(&state(0.0, 0.0, 0.0, 0.0), &r_d(400.0, 0.0)).centred_on(&member, &PARAMS, DT_S);
        // From rest, with all of a_max.
        assert_eq!(orbit.state(), state(0.375, 0.0, 1.5, 0.0));
        let spread = Spread::of(&member, &orbit.state());
        assert_eq!(spread, Spread { distance_m: 99.625, rate_m_s: -1.5 });
    }

    #[test]
    fn parameters_that_make_no_motion_are_refused() {
        let bad = MotionParams { response_s: -1.0, acceleration_max_m_s2: 0.0, approach_max_m_s: f64::NAN };
        let names: Vec<_> = bad.errors().into_iter().map(|error| error.path).collect();
        assert_eq!(names, ["response_s", "acceleration_max_m_s2", "approach_max_m_s"]);
        assert!(PARAMS.errors().is_empty());
    }
}
