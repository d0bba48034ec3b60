//! Heading control: turn rate command that follows a guidance law, by feedback plus feedforward (23-25).
//!
//! ```text
//! u_omega = -k_omega (psi - psi_d) + psi_d'                                             Eq. (24)
//! ```
//!
//! A [law](super::law) returns course, turn rate and speed over ground, from the orbit and from position and velocity of
//! the UAV alone. [`OrbitRelativeState::steer`] follows it: a kinematic UAV by (24), a UAV that banks as its
//! [inner loop](super::inner_loop) does between two decisions.

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::frame::{Displacement, Position, Velocity};
use crate::guidance::followed::{Followed, Guidance};
use crate::guidance::inner_loop::{Demand, InnerLoopGains};
use crate::guidance::moving_centre::{self, GroundTrack};
use crate::guidance::standoff_distance::{Ramp, StandoffDistance};
use crate::guidance::vector_field::{FieldAt, PolarMotion, VectorField, convergence_threshold_m2_s};
use crate::params::{GuidanceParams, UavParams};
use crate::target::TargetState;
use crate::uav::{Command, UavState};

impl GuidanceParams {
    fn field(&self, orbit: &Orbit) -> VectorField {
        VectorField {
            radius_m: orbit.steered.radius_m,
            radial_gain: self.radial_gain,
            orbit_direction: self.orbit_direction,
        }
    }
}

/// The orbit to fly: a circle with a moving centre and a changing radius.
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
    /// Steered radius (22), within the bounds of r_d.
    pub steered: Ramp,
}

impl Orbit {
    /// Extrapolates centre and steered radius, which determine the field, by `after_s` seconds at their rates.
    fn extrapolated(&self, after_s: f64) -> Self {
        // A radius that shrinks for a long lag stays positive.
        let radius_m = (self.steered.radius_m + self.steered.rate_m_s * after_s).max(1.0);
        Self {
            centre: self.centre + self.centre_velocity * after_s,
            steered: Ramp { radius_m, ..self.steered },
            ..*self
        }
    }

    /// Creates an orbit from a centre, a standoff distance and a steered radius.
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

/// An orbit and the law that leads onto it, which a UAV follows until its next decision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DesiredPath {
    /// Gains of the law.
    pub law: GuidanceParams,
    /// Orbit at the time of the decision.
    pub orbit: Orbit,
    /// Ground speed, m/s.
    pub speed_m_s: f64,
}

impl DesiredPath {
    /// Returns where the law leads a UAV in the state `own` over ground, `after_s` seconds after the time of the
    /// decision. The orbit moves on at its rates.
    pub fn guidance(&self, after_s: f64, own: &UavState) -> Guidance {
        let orbit = self.orbit.extrapolated(after_s);
        OrbitRelativeState::of(&self.law, own.position, &orbit).guide(&self.law, own, self.speed_m_s)
    }
}

impl Demand {
    /// What a UAV in the state `own` over ground flies `after_s` seconds after the time of a decision: its path, or without
    /// one the turn of its command.
    pub fn of(path: Option<&DesiredPath>, command: Command, after_s: f64, own: &UavState) -> Self {
        path.map_or(Self::Turn(command.turn_rate_rad_s), |path| Self::Path(path.guidance(after_s, own)))
    }
}

/// Output of the guidance law for one UAV, with intermediate values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steering {
    /// Desired turn rate u_omega before limits, rad/s.
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
    /// Steered radius (22), m.
    pub steered_radius_m: f64,
    /// Threshold of Lemma 3.1, m2/s.
    pub convergence_threshold_m2_s: f64,
    /// True if the centre is too fast for the field (29).
    pub centre_too_fast: bool,
}

/// Returns the ground speed that results in `speed_m_s` in the frame of the law, m/s, before limits.
pub fn ground_speed_m_s(params: &GuidanceParams, uav: &UavState, orbit: &Orbit, speed_m_s: f64) -> f64 {
    OrbitRelativeState::of(params, uav.position, orbit).ground_speed_m_s(params, speed_m_s)
}

/// Steers a UAV in the state `own` onto `orbit`. `uav` describes the aircraft, `speed_m_s` is the commanded ground speed.
///
/// Implements Eq. (23), (24), (25).
pub fn steer(params: &GuidanceParams, uav: &UavParams, own: &UavState, orbit: &Orbit, speed_m_s: f64) -> Steering {
    OrbitRelativeState::of(params, own.position, orbit).steer(params, uav, own, speed_m_s)
}

/// Position of a UAV relative to its orbit, and the field at that position. Computed once and shared by all users.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OrbitRelativeState {
    pub(crate) orbit: Orbit,
    /// Direction from the centre to the UAV.
    pub(crate) phase: Angle,
    uav_rel_centre: Displacement,
    field: FieldAt,
    /// Direction of the field, a unit vector.
    along: Vector2<f64>,
}

impl OrbitRelativeState {
    pub(crate) fn of(params: &GuidanceParams, uav: Position, orbit: &Orbit) -> Self {
        let [on_orbit] = Self::each(params, [(uav, *orbit)]);
        on_orbit
    }

    /// Like [`Self::of`] for several UAVs, each with its own orbit. Same results, but faster.
    #[inline]
    pub(crate) fn each<const N: usize>(params: &GuidanceParams, uavs: [(Position, Orbit); N]) -> [Self; N] {
        let uavs_rel_centre = uavs.map(|(uav, orbit)| uav - orbit.centre);
        let phases = Displacement::direction_batch(uavs_rel_centre);
        core::array::from_fn(|i| {
            let (orbit, uav_rel_centre) = (uavs[i].1, uavs_rel_centre[i]);
            let field = params.field(&orbit).at(uav_rel_centre.length_m());
            Self { orbit, phase: phases[i], uav_rel_centre, field, along: field.direction(uav_rel_centre) }
        })
    }

    /// Direction of the field, a unit vector.
    pub(crate) fn along(&self) -> Vector2<f64> {
        self.along
    }

    /// Distance r from the centre, m.
    pub(crate) fn centre_distance_m(&self) -> f64 {
        self.field.r_m
    }

    /// See [`ground_speed_m_s`].
    pub(crate) fn ground_speed_m_s(&self, params: &GuidanceParams, speed_m_s: f64) -> f64 {
        params.law().ground_speed_m_s(self, speed_m_s)
    }

    /// Ground track along the field at ground speed `speed_m_s`.
    pub(crate) fn ground_track(&self, speed_m_s: f64) -> GroundTrack {
        moving_centre::ground_track(self.along, self.orbit.centre_velocity, speed_m_s)
    }

    /// Rate at which the direction of the field turns at a UAV that moves with `velocity` over ground, rad/s.
    pub(crate) fn field_turn_rate_rad_s(&self, velocity: Velocity) -> f64 {
        let Self { orbit, uav_rel_centre, field, .. } = self;
        let motion = PolarMotion::of(*uav_rel_centre, velocity - orbit.centre_velocity);
        field.turn_rate_rad_s(motion, orbit.steered.rate_m_s)
    }

    /// Motion relative to the centre of a UAV that follows the field on `flown`.
    fn motion_along(&self, flown: &GroundTrack, speed_m_s: f64) -> PolarMotion {
        if flown.centre_too_fast {
            let ground_track = Velocity::from_polar(speed_m_s, flown.heading);
            PolarMotion::of(self.uav_rel_centre, ground_track - self.orbit.centre_velocity)
        } else {
            self.field.motion_along(flown.relative_speed_m_s)
        }
    }

    /// Guidance along the ground track `flown`, whose path turns at `turn_rate_rad_s`.
    pub(crate) fn guidance(
        &self,
        params: &GuidanceParams,
        flown: &GroundTrack,
        speed_m_s: f64,
        turn_rate_rad_s: f64,
    ) -> Guidance {
        let radius_m = self.orbit.steered.radius_m;
        Guidance {
            course: flown.heading,
            turn_rate_rad_s,
            speed_m_s,
            right_of_path_m: params.orbit_direction.sign() * (self.centre_distance_m() - radius_m),
            closing_rate_1_s: speed_m_s / (params.radial_gain * radius_m),
        }
    }

    /// Where the law leads a UAV in the state `own`, at ground speed `speed_m_s`. The position of `own` must be the one
    /// that `self` was created with.
    fn guide(&self, params: &GuidanceParams, own: &UavState, speed_m_s: f64) -> Guidance {
        params.law().guide(params, self, own, speed_m_s)
    }

    /// See [`steer`]. The position of `own` must be the one that `self` was created with.
    pub(crate) fn steer(&self, params: &GuidanceParams, uav: &UavParams, own: &UavState, speed_m_s: f64) -> Steering {
        self.steering(&self.follow(params, uav, own, speed_m_s), speed_m_s)
    }

    /// How a UAV follows the law at ground speed `speed_m_s`: a kinematic one by (24), a UAV that banks by its inner loop.
    pub(crate) fn follow(&self, params: &GuidanceParams, uav: &UavParams, own: &UavState, speed_m_s: f64) -> Followed {
        let of = |on_orbit: &Self, own: UavState, gain: fn(&GuidanceParams, &Guidance) -> f64| {
            let guidance = on_orbit.guide(params, &own, speed_m_s);
            Followed { own, guidance, gain_1_s: gain(params, &guidance) }
        };
        if uav.bank.is_some() {
            return of(self, *own, |_, guidance| InnerLoopGains::of(guidance).heading_1_s);
        }
        // With the state one lag later, the lag has no effect on the loop: see `orbit_loop`.
        let ahead_s = params.law().ahead_s(uav.turn_rate_lag_s);
        if ahead_s == 0.0 {
            return of(self, *own, |params, _| params.heading_gain_1_s);
        }
        let later = own.extrapolated(ahead_s);
        let then = Self::of(params, later.position, &self.orbit.extrapolated(ahead_s));
        of(&then, later, |params, _| params.heading_gain_1_s)
    }

    /// Turn rate, before limits, and intermediate values of a UAV that follows the law at ground speed `speed_m_s`.
    pub(crate) fn steering(&self, followed: &Followed, speed_m_s: f64) -> Steering {
        let Self { orbit, phase, .. } = self;
        let r_m = self.centre_distance_m();
        let flown = self.ground_track(speed_m_s);
        let r_rate_m_s = self.motion_along(&flown, speed_m_s).r_rate_m_s;
        Steering {
            turn_rate_rad_s: followed.course_rate_rad_s(),
            desired_heading: flown.heading,
            feedforward_rad_s: followed.guidance.turn_rate_rad_s,
            centre_distance_m: r_m,
            phase: *phase,
            steered_radius_m: orbit.steered.radius_m,
            convergence_threshold_m2_s: convergence_threshold_m2_s(r_m, r_rate_m_s, orbit.distance_m, orbit.rate_m_s),
            centre_too_fast: flown.centre_too_fast,
        }
    }

    /// Threshold of Lemma 3.1 for a UAV that flies along the field at ground speed `speed_m_s`, m2/s; same result as
    /// [`steer`]. `None` if the centre is too fast for the field (29).
    pub(crate) fn threshold_m2_s(&self, speed_m_s: f64) -> Option<f64> {
        let Orbit { centre_velocity, distance_m, rate_m_s, .. } = self.orbit;
        let relative_speed_m_s = moving_centre::relative_speed_m_s(self.along, centre_velocity, speed_m_s)?;
        let r_rate_m_s = self.field.motion_along(relative_speed_m_s).r_rate_m_s;
        Some(convergence_threshold_m2_s(self.centre_distance_m(), r_rate_m_s, distance_m, rate_m_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::{Feedforward, Law, OrbitDirection, TeamParams};

    const LAG_S: f64 = 1.0 / 3.0;

    /// A kinematic UAV with this lag, s.
    fn lagging(turn_rate_lag_s: f64) -> UavParams {
        UavParams { turn_rate_lag_s, ..TeamParams::paper().uav }
    }

    fn params(law: Law) -> GuidanceParams {
        GuidanceParams { law, radial_gain: 1.0, ..TeamParams::paper().guidance }
    }

    fn orbit(centre_velocity: Velocity, rate_m_s: f64) -> Orbit {
        let steered = Ramp { radius_m: 300.0, rate_m_s };
        Orbit { centre: Position::ORIGIN, centre_velocity, distance_m: 300.0, rate_m_s, steered }
    }

    fn uav(r_m: f64, heading: Angle) -> UavState {
        let position = Position::ORIGIN + Displacement::from_polar(r_m, Angle::ZERO);
        UavState::level_flight(position, heading, 40.0)
    }

    /// Checks Eq. (23), (24): on the orbit due east of the centre the desired heading is north; 10 degrees off it, the
    /// feedback is k_omega times the wrapped error.
    #[test]
    fn the_turn_rate_is_feedback_plus_feedforward() {
        let got = steer(
            &params(Law::Oh2015),
            &lagging(LAG_S),
            &uav(300.0, Angle::from_deg(100.0)),
            &orbit(Velocity::ZERO, 0.0),
            40.0,
        );
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
        let got = steer(&params(Law::Oh2015), &lagging(LAG_S), &state, &orbit(Velocity::ZERO, 0.0), 40.0);
        assert!((got.turn_rate_rad_s - (40.0 / 300.0 - 2.0 * 10f64.to_radians())).abs() < 1e-9);
    }

    /// Checks the erratum of Eq. (25): at r = 100 m, r_d = 300 m, v = 40 m/s the field turns at 0.432 rad/s; the
    /// published form gives 0.048. On the orbit both agree.
    #[test]
    fn the_published_feedforward_is_wrong_off_the_orbit() {
        let at = |feedforward, r| {
            let params = GuidanceParams { feedforward, ..params(Law::Oh2015) };
            steer(&params, &lagging(LAG_S), &uav(r, Angle::ZERO), &orbit(Velocity::ZERO, 0.0), 40.0).feedforward_rad_s
        };
        assert!((at(Feedforward::StaticCentre, 100.0) - 0.432).abs() < 1e-9);
        assert!((at(Feedforward::Paper, 100.0) - 0.048).abs() < 1e-9);
        assert!((at(Feedforward::StaticCentre, 300.0) - at(Feedforward::Paper, 300.0)).abs() < 1e-12);
    }

    /// Returns the feedforward of this project's law for a UAV without lag, and the derivative of psi_d along its motion
    /// by central differences.
    fn feedforward_and_derivative(params: &GuidanceParams, state: UavState, at_start: Orbit) -> (f64, f64) {
        let speed_m_s = state.speed_m_s;
        // The law's derivative is at a constant speed relative to the centre.
        let on_orbit = OrbitRelativeState::of(params, state.position, &at_start);
        let relative_m_s = moving_centre::relative_speed_m_s(on_orbit.along(), at_start.centre_velocity, speed_m_s);
        let heading_at = |t: f64| {
            let position = state.position + state.velocity() * t;
            let orbit = Orbit {
                centre: at_start.centre + at_start.centre_velocity * t,
                steered: Ramp {
                    radius_m: at_start.steered.radius_m + at_start.steered.rate_m_s * t,
                    ..at_start.steered
                },
                ..at_start
            };
            let along = OrbitRelativeState::of(params, position, &orbit).along();
            let ground_m_s = relative_m_s
                .map_or(speed_m_s, |relative| moving_centre::ground_speed_m_s(along, orbit.centre_velocity, relative));
            steer(params, &lagging(LAG_S), &UavState { position, ..state }, &orbit, ground_m_s).desired_heading
        };
        let h = 1e-4;
        let feedforward_rad_s = steer(params, &lagging(0.0), &state, &at_start, speed_m_s).feedforward_rad_s;
        (feedforward_rad_s, (heading_at(h) - heading_at(-h)).rad() / (2.0 * h))
    }

    /// Checks Eq. (25) as this project's law has it: the derivative of psi_d along the motion of a UAV, whether it
    /// follows the field or not, with k_l, a moving centre, a changing radius and both orbit directions; also with the
    /// radius at its bound, and with a centre faster than the UAV.
    #[test]
    fn the_feedforward_is_the_derivative_of_the_desired_heading_along_the_motion() {
        let slow = orbit(Velocity::from_m_s(9.0, -5.0), 3.0);
        let bounded =
            Orbit { distance_m: 695.0, rate_m_s: 8.0, steered: Ramp { radius_m: 700.0, rate_m_s: 0.0 }, ..slow };
        let fast = orbit(Velocity::from_m_s(-50.0, 20.0), 3.0);
        for sense in [OrbitDirection::Anticlockwise, OrbitDirection::Clockwise] {
            let params = GuidanceParams { orbit_direction: sense, radial_gain: 0.2, ..params(Law::Standoff) };
            for (r_m, heading_deg) in [(80.0, 10.0), (290.0, 100.0), (310.0, -60.0), (600.0, -150.0)] {
                for orbit in [slow, bounded, fast] {
                    let state = uav(r_m, Angle::from_deg(heading_deg));
                    let (got, expected) = feedforward_and_derivative(&params, state, orbit);
                    assert!((got - expected).abs() < 1e-5, "r {r_m}, {orbit:?}: {got} {expected}");
                }
            }
        }
    }

    /// Checks Eq. (24), (25) with a lag: the command is that of the state and the orbit one lag later.
    #[test]
    fn the_law_is_followed_one_lag_ahead() {
        let params = GuidanceParams { radial_gain: 0.2, ..params(Law::Standoff) };
        let now = orbit(Velocity::from_m_s(9.0, -5.0), 3.0);
        let later = Orbit {
            centre: now.centre + now.centre_velocity * LAG_S,
            steered: Ramp { radius_m: 300.0 + 3.0 * LAG_S, ..now.steered },
            ..now
        };
        let state = UavState { turn_rate_rad_s: 0.2, ..uav(290.0, Angle::from_deg(100.0)) };
        let (got, expected) = (
            steer(&params, &lagging(LAG_S), &state, &now, 40.0),
            steer(&params, &lagging(0.0), &state.extrapolated(LAG_S), &later, 40.0),
        );
        assert_eq!(got.turn_rate_rad_s, expected.turn_rate_rad_s);
        assert_eq!(got.feedforward_rad_s, expected.feedforward_rad_s);
        assert_eq!(got.desired_heading, steer(&params, &lagging(0.0), &state, &now, 40.0).desired_heading);
    }

    /// Checks Lemma 3.1's threshold if the field cannot be flown: the UAV does not converge to a centre that escapes.
    #[test]
    fn a_uav_does_not_converge_to_a_centre_that_is_too_fast() {
        let state = uav(600.0, Angle::from_deg(180.0));
        let got =
            steer(&params(Law::Standoff), &lagging(LAG_S), &state, &orbit(Velocity::from_m_s(-60.0, 0.0), 0.0), 40.0);
        assert!(got.centre_too_fast && got.convergence_threshold_m2_s < 0.0, "{got:?}");
    }

    #[test]
    fn a_centre_faster_than_the_uav_is_pursued_with_a_finite_turn_rate() {
        let got = steer(
            &params(Law::Standoff),
            &lagging(LAG_S),
            &uav(300.0, Angle::ZERO),
            &orbit(Velocity::from_m_s(0.0, 90.0), 0.0),
            40.0,
        );
        assert!(got.centre_too_fast && got.turn_rate_rad_s.is_finite());
        assert!((got.desired_heading.deg() - 90.0).abs() < 1e-9);
    }
}
