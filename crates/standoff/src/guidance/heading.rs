//! From a desired heading to a turn rate: feedback plus feedforward (23-25).
//!
//! ```text
//! u_omega = -k_omega (psi - psi_d) + psi_d'                                             Eq. (24)
//! psi_d'  = 4 v r_d r^2 / (r^2 + r_d^2)^2 - 2 r r_d' / (r^2 + r_d^2)                    Eq. (25), printed
//! psi_d'  = 4 v r_d^3   / (r^2 + r_d^2)^2 - 2 r r_d' / (r^2 + r_d^2)                    exact
//! ```
//!
//! Erratum: the printed form is the derivative of the field's heading only on the orbit (r = r_d). The exact form holds
//! everywhere for the field (13) about a centre at rest. What is flown has k_l, a virtual radius and a moving centre
//! in it: the third form differentiates that.

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::frame::{Displacement, Position, Velocity};
use crate::guidance::moving_centre;
use crate::guidance::standoff_distance::{Ramp, StandoffDistance};
use crate::guidance::vector_field::{FieldAt, PolarMotion, Sense, VectorField, convergence_threshold_m2_s};
use crate::param::{Allowed, ParamError};
use crate::target::TargetState;
use crate::uav::UavState;

/// Which derivative of the desired heading is fed forward.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Feedforward {
    /// Eq. (25) as printed.
    Printed,
    /// Eq. (25) made exact: the derivative along the field (13).
    Exact,
    /// The derivative along the field really flown: (20), (22) and (28) included.
    #[default]
    Flown,
    /// As `Flown`, but along the UAV's actual motion, wherever that leads.
    Actual,
}

/// How far ahead of a radius that changes active measure 2 steers (22).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lead {
    /// By k_rd seconds; at least 0; 0 switches it off.
    Constant(f64),
    /// By the field's own lag, k_l r_d / v.
    Scheduled,
    /// By the field's own lag, to the r_d of the spread as it will be then, whoever is furthest by then.
    Predicted,
}

/// What a UAV's nominal speed is relative to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SpeedReference {
    /// The ground, as (28), (29) have it: round a centre that moves, a UAV gains and loses phase in turn.
    #[default]
    Ground,
    /// The centre: round one that moves, the UAVs of an orbit keep their phases, as far as their speed limits allow.
    Centre,
}

/// Gains of the guidance law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuidanceParams {
    /// Which way round the orbits are flown.
    pub sense: Sense,
    /// k_l of active measure 1; above 0, at most 1; 1 switches it off.
    #[doc(alias = "k_l")]
    pub radial_gain: f64,
    /// k_rd of active measure 2.
    #[doc(alias = "k_rd")]
    pub lead: Lead,
    /// What the nominal speed is relative to.
    pub speed_reference: SpeedReference,
    /// k_omega, 1/s; above 0.
    #[doc(alias = "k_omega")]
    pub heading_gain_1_s: f64,
    /// Gain on the turn rate's distance from the feedforward, dimensionless; at least 0; 0, as in the paper: none.
    pub turn_rate_gain: f64,
    /// Which feedforward.
    pub feedforward: Feedforward,
    /// k_v, 1/s; at least 0.
    #[doc(alias = "k_v")]
    pub spacing_gain_1_s: f64,
    /// Separation theta_d of a pair, rad; at least 0, at most pi.
    #[doc(alias = "theta_d")]
    pub separation_rad: f64,
}

impl GuidanceParams {
    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = Vec::new();
        Allowed::at_least(1e-3).at_most(1.0).check("radial_gain", self.radial_gain, &mut errors);
        if let Lead::Constant(lead_s) = self.lead {
            Allowed::at_least(0.0).at_most(100.0).check("lead_s", lead_s, &mut errors);
        }
        Allowed::above(0.0).at_most(100.0).check("heading_gain_1_s", self.heading_gain_1_s, &mut errors);
        Allowed::at_least(0.0).at_most(100.0).check("turn_rate_gain", self.turn_rate_gain, &mut errors);
        Allowed::at_least(0.0).at_most(100.0).check("spacing_gain_1_s", self.spacing_gain_1_s, &mut errors);
        let half_turn = Allowed::at_least(0.0).at_most(crate::math::PI);
        half_turn.check("separation_rad", self.separation_rad, &mut errors);
        errors
    }

    fn field(&self, orbit: &Orbit) -> VectorField {
        VectorField { radius_m: orbit.steered.radius_m, radial_gain: self.radial_gain, sense: self.sense }
    }

    /// The lead k_rd on an orbit of `radius_m`, flown at `speed_m_s` relative to its centre, s.
    ///
    /// Near the orbit the field closes in at r' = -(v / (k_l r_d)) (r - r_d), by Eq. (14) with (20): so a ramp of r_d is
    /// followed with a lag of k_l r_d / v.
    pub fn lead_s(&self, radius_m: f64, speed_m_s: f64) -> f64 {
        match self.lead {
            Lead::Constant(lead_s) => lead_s,
            Lead::Scheduled | Lead::Predicted => self.radial_gain * radius_m / speed_m_s,
        }
    }
}

/// The orbit to fly: a circle about a centre that moves, of a radius that changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orbit {
    /// Estimated centre.
    pub centre: Position,
    /// Estimated velocity of the centre.
    pub centre_velocity: Velocity,
    /// Radius r_d, m; above 0.
    #[doc(alias = "r_d")]
    pub distance_m: f64,
    /// Rate of r_d, m/s.
    pub rate_m_s: f64,
    /// The radius steered for (22), within the bounds of r_d.
    pub steered: Ramp,
}

impl Orbit {
    /// The orbit about a centre at a standoff distance, steered for another radius.
    pub fn about(centre: &TargetState, standoff: &StandoffDistance, steered: Ramp) -> Self {
        Self {
            centre: centre.position(),
            centre_velocity: centre.velocity(),
            distance_m: standoff.distance_m,
            rate_m_s: standoff.rate_m_s,
            steered,
        }
    }
}

/// What the law wants of one UAV, and what it looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steering {
    /// Wanted turn rate u_omega before limits, rad/s.
    pub turn_rate_rad_s: f64,
    /// Desired heading psi_d (23).
    #[doc(alias = "psi_d")]
    pub desired_heading: Angle,
    /// Feedforward part of the turn rate (25), rad/s.
    pub feedforward_rad_s: f64,
    /// Distance r from the centre, m.
    pub centre_distance_m: f64,
    /// Direction from the centre to the UAV.
    pub phase: Angle,
    /// Radius steered for (22), m.
    pub steered_distance_m: f64,
    /// Threshold of Lemma 3.1, m2/s.
    pub convergence_threshold_m2_s: f64,
    /// The centre is too fast for the field (29).
    pub centre_too_fast: bool,
}

/// The speed over ground that keeps `speed_m_s` relative to what the parameters refer it to, m/s, before limits.
pub fn ground_speed_m_s(params: &GuidanceParams, uav: &UavState, orbit: &Orbit, speed_m_s: f64) -> f64 {
    OnOrbit::of(params, uav.position, orbit).ground_speed_m_s(params, speed_m_s)
}

/// Steers a UAV that flies at `speed_m_s` over ground (the speed really commanded) onto `orbit`.
///
/// Implements Eq. (23), (24), (25).
pub fn steer(params: &GuidanceParams, uav: &UavState, orbit: &Orbit, speed_m_s: f64) -> Steering {
    OnOrbit::of(params, uav.position, orbit).steer(params, uav, speed_m_s)
}

/// Where a UAV is about the orbit it is to fly, and the field there: worked out once for all who ask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OnOrbit {
    pub(crate) orbit: Orbit,
    /// Direction from the centre to the UAV.
    pub(crate) phase: Angle,
    uav_rel_centre: Displacement,
    field: FieldAt,
    /// Direction of the field, a unit vector.
    along: Vector2<f64>,
}

impl OnOrbit {
    pub(crate) fn of(params: &GuidanceParams, uav: Position, orbit: &Orbit) -> Self {
        let [on_orbit] = Self::each(params, [(uav, *orbit)]);
        on_orbit
    }

    /// Several UAVs, each about its own orbit: the same as one by one, in less time.
    #[inline]
    pub(crate) fn each<const N: usize>(params: &GuidanceParams, uavs: [(Position, Orbit); N]) -> [Self; N] {
        let uavs_rel_centre = uavs.map(|(uav, orbit)| uav - orbit.centre);
        let phases = Displacement::direction_each(uavs_rel_centre);
        core::array::from_fn(|i| {
            let (orbit, uav_rel_centre) = (uavs[i].1, uavs_rel_centre[i]);
            let field = params.field(&orbit).at(uav_rel_centre.length_m());
            Self { orbit, phase: phases[i], uav_rel_centre, field, along: field.direction(uav_rel_centre) }
        })
    }

    /// Distance r from the centre, m.
    pub(crate) fn centre_distance_m(&self) -> f64 {
        self.field.r_m
    }

    /// See [`ground_speed_m_s`].
    pub(crate) fn ground_speed_m_s(&self, params: &GuidanceParams, speed_m_s: f64) -> f64 {
        match params.speed_reference {
            SpeedReference::Ground => speed_m_s,
            SpeedReference::Centre => {
                moving_centre::at_relative_speed(self.along, self.orbit.centre_velocity, speed_m_s).1
            }
        }
    }

    /// See [`steer`]; the UAV is where it was said to be.
    pub(crate) fn steer(&self, params: &GuidanceParams, uav: &UavState, speed_m_s: f64) -> Steering {
        let Self { orbit, phase, uav_rel_centre, field, along } = self;
        let r_m = self.centre_distance_m();
        let mut flown = moving_centre::over_ground(*along, orbit.centre_velocity, speed_m_s);
        if params.speed_reference == SpeedReference::Centre && !flown.centre_too_fast {
            // The same heading, but differentiated at constant speed relative to the centre.
            flown = moving_centre::at_relative_speed(*along, orbit.centre_velocity, flown.relative_speed_m_s).0;
        }
        let motion = if flown.centre_too_fast {
            let over_ground = Velocity::from_polar(speed_m_s, flown.heading);
            PolarMotion::of(*uav_rel_centre, over_ground - orbit.centre_velocity)
        } else {
            field.motion_along(flown.relative_speed_m_s)
        };
        let feedforward_rad_s = match params.feedforward {
            // Differentiating at constant centre velocity and speed.
            Feedforward::Flown => {
                field.turn_rate_rad_s(motion, orbit.steered.rate_m_s) * flown.heading_per_field_heading
            }
            Feedforward::Actual => {
                let actual = PolarMotion::of(*uav_rel_centre, uav.velocity() - orbit.centre_velocity);
                field.turn_rate_rad_s(actual, orbit.steered.rate_m_s) * flown.heading_per_field_heading
            }
            Feedforward::Exact => params.sense.sign() * at_rest_rad_s(r_m, orbit, speed_m_s, orbit.distance_m),
            Feedforward::Printed => params.sense.sign() * at_rest_rad_s(r_m, orbit, speed_m_s, r_m),
        };
        let heading_error = uav.heading - flown.heading;
        Steering {
            turn_rate_rad_s: feedforward_rad_s
                - params.heading_gain_1_s * heading_error.rad()
                - params.turn_rate_gain * (uav.turn_rate_rad_s - feedforward_rad_s),
            desired_heading: flown.heading,
            feedforward_rad_s,
            centre_distance_m: r_m,
            phase: *phase,
            steered_distance_m: orbit.steered.radius_m,
            convergence_threshold_m2_s: convergence_threshold_m2_s(
                r_m,
                motion.r_rate_m_s,
                orbit.distance_m,
                orbit.rate_m_s,
            ),
            centre_too_fast: flown.centre_too_fast,
        }
    }

    /// Threshold of Lemma 3.1 for a UAV that flies along the field at `speed_m_s` over ground, m2/s: what [`steer`]
    /// gives; `None`: the centre is too fast for the field (29).
    pub(crate) fn threshold_m2_s(&self, speed_m_s: f64) -> Option<f64> {
        let Orbit { centre_velocity, distance_m, rate_m_s, .. } = self.orbit;
        let relative_speed_m_s = moving_centre::relative_speed_m_s(self.along, centre_velocity, speed_m_s)?;
        let r_rate_m_s = self.field.motion_along(relative_speed_m_s).r_rate_m_s;
        Some(convergence_threshold_m2_s(self.centre_distance_m(), r_rate_m_s, distance_m, rate_m_s))
    }
}

/// Turn rate of the anticlockwise field (13) about a centre at rest, rad/s. The exact form has r_d three times in the
/// numerator; the printed one has r in place of two of them.
///
/// Implements Eq. (25), printed with `twice_m` = r, exact with `twice_m` = r_d.
fn at_rest_rad_s(r_m: f64, orbit: &Orbit, speed_m_s: f64, twice_m: f64) -> f64 {
    let (r, r_d, v) = (r_m, orbit.distance_m, speed_m_s);
    let square_sum = r * r + r_d * r_d;
    4.0 * v * r_d * twice_m * twice_m / (square_sum * square_sum) - 2.0 * r * orbit.rate_m_s / square_sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params(feedforward: Feedforward) -> GuidanceParams {
        GuidanceParams {
            sense: Sense::Anticlockwise,
            radial_gain: 1.0,
            lead: Lead::Constant(0.0),
            speed_reference: SpeedReference::Ground,
            heading_gain_1_s: 2.0,
            turn_rate_gain: 0.0,
            feedforward,
            spacing_gain_1_s: 0.5,
            separation_rad: 0.5 * crate::math::PI,
        }
    }

    fn orbit(centre_velocity: Velocity, rate_m_s: f64) -> Orbit {
        let steered = Ramp { radius_m: 300.0, rate_m_s };
        Orbit { centre: Position::ORIGIN, centre_velocity, distance_m: 300.0, rate_m_s, steered }
    }

    fn uav(r_m: f64, heading: Angle) -> UavState {
        let position = Position::ORIGIN + Displacement::from_polar(r_m, Angle::ZERO);
        UavState::straight(position, heading, 40.0)
    }

    /// Checks Eq. (23), (24): on the orbit due east of the centre the desired heading is north; 10 degrees off it, the
    /// feedback is k_omega times the wrapped error.
    #[test]
    fn the_turn_rate_is_feedback_plus_feedforward() {
        let got =
            steer(&params(Feedforward::Exact), &uav(300.0, Angle::from_deg(100.0)), &orbit(Velocity::ZERO, 0.0), 40.0);
        assert!((got.desired_heading.deg() - 90.0).abs() < 1e-9);
        assert!((got.feedforward_rad_s - 40.0 / 300.0).abs() < 1e-12);
        assert!((got.turn_rate_rad_s - (40.0 / 300.0 - 2.0 * 10f64.to_radians())).abs() < 1e-9);
    }

    /// Checks Eq. (24)'s wrap: heading -170 degrees where 170 is desired is an error of 20 degrees.
    #[test]
    fn the_heading_error_wraps() {
        // North of the centre, anticlockwise, the field points west.
        let mut state = uav(300.0, Angle::from_deg(-170.0));
        state.position = Position::from_m(0.0, 300.0);
        let got = steer(&params(Feedforward::Exact), &state, &orbit(Velocity::ZERO, 0.0), 40.0);
        assert!((got.turn_rate_rad_s - (40.0 / 300.0 - 2.0 * 10f64.to_radians())).abs() < 1e-9);
    }

    /// Checks the erratum of Eq. (25): at r = 100 m, r_d = 300 m, v = 40 m/s the field turns at 0.432 rad/s; the
    /// printed form says 0.048. On the orbit both agree.
    #[test]
    fn the_printed_feedforward_is_wrong_off_the_orbit() {
        let at =
            |form, r| steer(&params(form), &uav(r, Angle::ZERO), &orbit(Velocity::ZERO, 0.0), 40.0).feedforward_rad_s;
        assert!((at(Feedforward::Exact, 100.0) - 0.432).abs() < 1e-9);
        assert!((at(Feedforward::Printed, 100.0) - 0.048).abs() < 1e-9);
        assert!((at(Feedforward::Flown, 100.0) - 0.432).abs() < 1e-9);
        assert!((at(Feedforward::Exact, 300.0) - at(Feedforward::Printed, 300.0)).abs() < 1e-12);
    }

    /// The flown feedforward beside the derivative of psi_d along the flown velocity, by central differences.
    fn flown_and_differentiated(params: &GuidanceParams, r_m: f64, at_start: Orbit) -> (f64, f64) {
        let state = uav(r_m, Angle::ZERO);
        let here = steer(params, &state, &at_start, 40.0);
        let heading_at = |t: f64| {
            let position = state.position + Velocity::from_polar(40.0, here.desired_heading) * t;
            let orbit = Orbit {
                centre: at_start.centre + at_start.centre_velocity * t,
                steered: Ramp {
                    radius_m: at_start.steered.radius_m + at_start.steered.rate_m_s * t,
                    ..at_start.steered
                },
                ..at_start
            };
            steer(params, &UavState { position, ..state }, &orbit, 40.0).desired_heading
        };
        let h = 1e-4;
        (here.feedforward_rad_s, (heading_at(h) - heading_at(-h)).rad() / (2.0 * h))
    }

    /// Checks Eq. (25) in its flown form: the derivative of psi_d along the flown velocity with k_l, a moving centre, a
    /// changing radius and both senses; also with the radius at its bound, and with a centre faster than the UAV.
    #[test]
    fn the_flown_feedforward_is_the_derivative_of_the_desired_heading() {
        let slow = orbit(Velocity::from_m_s(9.0, -5.0), 3.0);
        let bounded =
            Orbit { distance_m: 695.0, rate_m_s: 8.0, steered: Ramp { radius_m: 700.0, rate_m_s: 0.0 }, ..slow };
        let fast = orbit(Velocity::from_m_s(-50.0, 20.0), 3.0);
        for sense in [Sense::Anticlockwise, Sense::Clockwise] {
            let params = GuidanceParams { sense, radial_gain: 0.2, ..params(Feedforward::Flown) };
            for r_m in [80.0, 290.0, 310.0, 600.0] {
                for orbit in [slow, bounded, fast] {
                    let (got, expected) = flown_and_differentiated(&params, r_m, orbit);
                    assert!((got - expected).abs() < 1e-5, "r {r_m}, {orbit:?}: {got} {expected}");
                }
            }
        }
    }

    /// Checks Eq. (25) along the actual motion: the derivative of psi_d for a UAV that flies elsewhere.
    #[test]
    fn the_actual_feedforward_is_the_derivative_along_the_actual_motion() {
        let params = GuidanceParams { radial_gain: 0.2, ..params(Feedforward::Actual) };
        let slow = orbit(Velocity::from_m_s(9.0, -5.0), 3.0);
        for (r_m, heading_deg) in [(80.0, 10.0), (290.0, 100.0), (600.0, -150.0)] {
            let state = uav(r_m, Angle::from_deg(heading_deg));
            let heading_at = |t: f64| {
                let position = state.position + state.velocity() * t;
                let steered = Ramp { radius_m: 300.0 + 3.0 * t, ..slow.steered };
                let orbit = Orbit { centre: slow.centre + slow.centre_velocity * t, steered, ..slow };
                steer(&params, &UavState { position, ..state }, &orbit, 40.0).desired_heading
            };
            let expected = (heading_at(1e-4) - heading_at(-1e-4)).rad() / 2e-4;
            let got = steer(&params, &state, &slow, 40.0).feedforward_rad_s;
            assert!((got - expected).abs() < 1e-5, "r {r_m}: {got} {expected}");
        }
    }

    #[test]
    fn the_turn_rate_gain_damps_towards_the_feedforward() {
        let at_rest = params(Feedforward::Exact);
        let damped = GuidanceParams { turn_rate_gain: 0.5, ..at_rest };
        let turning = UavState { turn_rate_rad_s: 0.2, ..uav(300.0, Angle::from_deg(90.0)) };
        let rate = |params: &GuidanceParams| steer(params, &turning, &orbit(Velocity::ZERO, 0.0), 40.0).turn_rate_rad_s;
        let expected = rate(&at_rest) - 0.5 * (0.2 - 40.0 / 300.0);
        assert!((rate(&damped) - expected).abs() < 1e-12);
    }

    /// Checks Lemma 3.1's threshold where the field cannot be flown: a centre that runs away is not converged to.
    #[test]
    fn falling_behind_is_not_convergence() {
        let state = uav(600.0, Angle::from_deg(180.0));
        let got = steer(&params(Feedforward::Flown), &state, &orbit(Velocity::from_m_s(-60.0, 0.0), 0.0), 40.0);
        assert!(got.centre_too_fast && got.convergence_threshold_m2_s < 0.0, "{got:?}");
    }

    #[test]
    fn a_centre_faster_than_the_uav_gives_a_finite_chase() {
        let got = steer(
            &params(Feedforward::Flown),
            &uav(300.0, Angle::ZERO),
            &orbit(Velocity::from_m_s(0.0, 90.0), 0.0),
            40.0,
        );
        assert!(got.centre_too_fast && got.turn_rate_rad_s.is_finite());
        assert!((got.desired_heading.deg() - 90.0).abs() < 1e-9);
    }
}
