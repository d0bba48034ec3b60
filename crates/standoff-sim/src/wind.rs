//! True wind, and the motion of the UAVs relative to the air.

use standoff::math;
use standoff::{AirVelocity, Duration, TeamParams, UavId, UavState, Wind};

use crate::gusts::{GustModel, Gusts};

/// Lowest height of the wind profile, m: the power law does not hold near the ground.
const HEIGHT_MIN_M: f64 = 1.0;

/// A wind, steady or with gusts, whose mean speed depends on the height above the plane.
///
/// ```text
/// speed(h) = speed(h_ref) (h / h_ref)^exponent
/// ```
///
/// The power law is the usual profile of the lowest hundreds of metres; the exponent is about 1/7 over open land in
/// neutral air, and 0 gives the same wind at all heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindModel {
    /// Wind at the reference height.
    pub at_reference: Wind,
    /// Reference height, m; above 0.
    pub reference_height_m: f64,
    /// Exponent of the power law.
    pub shear_exponent: f64,
    /// Gusts; `None`: the wind is steady.
    pub gusts: Option<GustModel>,
}

impl WindModel {
    /// Mean wind at a height above the plane, m.
    #[must_use]
    pub fn at(&self, height_m: f64) -> Wind {
        if self.shear_exponent <= 0.0 {
            return self.at_reference;
        }
        let factor = shear_factor(height_m, self.reference_height_m, self.shear_exponent);
        Wind { velocity: self.at_reference.velocity.vector().scale(factor).into() }
    }

    /// Wind around a UAV at a height, m, with the gusts around it.
    pub(crate) fn around(&self, height_m: f64, gusts: Option<&Gusts>) -> Wind {
        let mean = self.at(height_m);
        let Some((model, gusts)) = self.gusts.zip(gusts) else { return mean };
        Wind { velocity: mean.velocity + gusts.velocity(&model, height_m, mean.velocity.direction()) }
    }
}

/// Factor by which the wind at a height, m, is stronger than that at the reference height.
pub(crate) fn shear_factor(height_m: f64, reference_height_m: f64, exponent: f64) -> f64 {
    math::exp(exponent * math::ln(height_m.max(HEIGHT_MIN_M) / reference_height_m))
}

/// Height of an aircraft above the plane, m; if altitudes are not simulated, the commanded or the initial one of a UAV.
pub(crate) fn height_m(state: &UavState, commanded_m: Option<f64>, team: &TeamParams, uav: UavId) -> f64 {
    let flown_m = state.vertical.map(|vertical| vertical.altitude_m);
    flown_m.or(commanded_m).unwrap_or_else(|| team.initial_altitude_m(uav))
}

/// Motion of an aircraft relative to the air, and the wind around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AirMotion {
    heading: standoff::Angle,
    airspeed_m_s: f64,
    heading_rate_rad_s: f64,
    pub(crate) wind: Wind,
}

impl AirMotion {
    /// An aircraft that starts in straight flight with the heading and the airspeed of `start`; also returns its state
    /// over ground. Without wind, it has no motion relative to the air.
    pub(crate) fn start(start: &UavState, wind: Option<Wind>) -> (Option<Self>, UavState) {
        let Some(wind) = wind else { return (None, *start) };
        let air = Self { heading: start.heading, airspeed_m_s: start.speed_m_s, heading_rate_rad_s: 0.0, wind };
        (Some(air), wind.over_ground(start, 0.0))
    }

    pub(crate) fn velocity(&self) -> AirVelocity {
        AirVelocity { heading: self.heading, airspeed_m_s: self.airspeed_m_s }
    }

    /// Returns the state over ground after a time step `dt`. `flown` returns the state after it in air that does not
    /// move; heading and speed are then those relative to the air. The air moves with the wind at the start of the time
    /// step. `wind_of` returns the wind at the end.
    pub(crate) fn fly(
        &mut self,
        truth: &UavState,
        dt: Duration,
        flown: impl FnOnce(&UavState) -> UavState,
        wind_of: impl FnOnce(&UavState) -> Wind,
    ) -> UavState {
        let before = UavState {
            heading: self.heading,
            speed_m_s: self.airspeed_m_s,
            turn_rate_rad_s: self.heading_rate_rad_s,
            ..*truth
        };
        let mut air = flown(&before);
        air.position = air.position + self.wind.velocity * dt.s();
        // The mean acceleration: at the end of a time step the lag has ended most of it.
        let acceleration_m_s2 = (air.speed_m_s - before.speed_m_s) / dt.s();
        let wind = wind_of(&air);
        *self =
            Self { heading: air.heading, airspeed_m_s: air.speed_m_s, heading_rate_rad_s: air.turn_rate_rad_s, wind };
        wind.over_ground(&air, acceleration_m_s2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff::{Angle, Command, Position, TeamParams, Velocity};

    /// Ten times the height at an exponent of 0.5: the square root of ten times the speed, in the same direction.
    #[test]
    fn the_wind_follows_the_power_law() {
        let at_reference = Wind { velocity: Velocity::from_m_s(3.0, -4.0) };
        let wind = WindModel { at_reference, reference_height_m: 10.0, shear_exponent: 0.5, gusts: None };
        let high = wind.at(100.0).velocity;
        assert!((high.speed_m_s() - 5.0 * 10f64.sqrt()).abs() < 1e-9);
        assert!((high.direction() - at_reference.velocity.direction()).abs_rad() < 1e-12);
        assert!((wind.at(10.0).velocity - at_reference.velocity).speed_m_s() < 1e-12);
        assert!(wind.at(-5.0).velocity.is_finite());
        assert_eq!(WindModel { shear_exponent: 0.0, ..wind }.at(100.0), at_reference);
    }

    /// In the frame that moves with the wind, the UAV flies as in calm air.
    #[test]
    fn a_uav_drifts_with_the_wind() {
        let (params, dt) = (TeamParams::paper().uav, Duration::from_s(0.5));
        let (response, wind) = (params.response(dt), Wind { velocity: Velocity::from_m_s(6.0, -3.0) });
        let mut calm = UavState::level_flight(Position::ORIGIN, Angle::from_deg(30.0), 40.0);
        let (air, mut truth) = AirMotion::start(&calm, Some(wind));
        let mut air = air.unwrap();
        for step in 1..=40 {
            let command = Command { speed_m_s: 45.0, turn_rate_rad_s: 0.2 };
            calm = response.step(&calm, command);
            truth = air.fly(&truth, dt, |before| response.step(before, command), |_| wind);
            let drifted = calm.position + wind.velocity * (dt.s() * f64::from(step));
            assert!((truth.position - drifted).length_m() < 1e-6);
            assert_eq!(air.velocity(), AirVelocity { heading: calm.heading, airspeed_m_s: calm.speed_m_s });
            assert!((truth.velocity() - calm.velocity() - wind.velocity).speed_m_s() < 1e-9);
        }
    }
}
