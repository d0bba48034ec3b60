//! Gusts: the Dryden model of turbulence at low altitude of MIL-F-8785C, its two horizontal components.
//!
//! ```text
//! sigma = 0.1 W20 / k^0.4      L = h / k^1.2      k = 0.177 + 0.000823 h      h in feet, 10 to 1,000
//! along the mean wind:   H(s) = sigma sqrt(2 T / pi) / (1 + T s)                      T = L / V_a
//! across it:             H(s) = sigma sqrt(T / pi) (1 + sqrt(3) T s) / (1 + T s)^2
//! ```
//!
//! W20 is the wind speed at 20 feet: 15 knots (7.7 m/s) in light, 30 in moderate and 45 in severe turbulence. Both
//! filters are discretised exactly, so that variance and spectrum do not depend on the period. Gusts are constant during
//! a time step, and independent for each UAV.
//!
//! Source: MIL-F-8785C, *Flying Qualities of Piloted Airplanes*, 1980, sections 3.7.2.2 and 3.7.5.

use standoff::math;
use standoff::{Angle, Duration, UavId, Velocity};

use crate::random::{Draws, Stream};

/// Heights for which the model is defined, feet; outside, those of the nearest one apply.
const HEIGHT_MIN_FT: f64 = 10.0;
const HEIGHT_MAX_FT: f64 = 1000.0;
const FOOT_M: f64 = 0.3048;

/// Intensity of the gusts, and the airspeed at which UAVs fly through them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GustModel {
    /// Wind speed at 20 feet W20, m/s.
    pub w20_m_s: f64,
    /// Airspeed V_a, m/s; above 0.
    pub airspeed_m_s: f64,
}

impl GustModel {
    /// Standard deviation per component, m/s, and time constant T, s, at a height, m.
    fn at(&self, height_m: f64) -> (f64, f64) {
        let height_ft = (height_m / FOOT_M).clamp(HEIGHT_MIN_FT, HEIGHT_MAX_FT);
        let ln_k = math::ln(0.177 + 0.000_823 * height_ft);
        let length_m = FOOT_M * height_ft * math::exp(-1.2 * ln_k);
        (0.1 * self.w20_m_s * math::exp(-0.4 * ln_k), length_m / self.airspeed_m_s)
    }
}

/// Gusts around one UAV: states of the filters, with unit variance of their outputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gusts {
    along: f64,
    /// States of the filter across the wind: a low pass of noise, and a low pass of that. Their stationary covariance is
    /// [1, 1/2; 1/2, 1/2].
    across: [f64; 2],
}

impl Gusts {
    /// Draws the stationary state at the first time step.
    pub(crate) fn new(uav: UavId, draws: Draws) -> Self {
        let [along, first, second] = draws.at(Stream::Gust, uav.0.into(), 0).normals();
        Self { along, across: [first, 0.5 * (first + second)] }
    }

    /// Advances the gusts by `period`, to time step `tick`, at a height, m.
    pub(crate) fn step(
        &mut self,
        model: &GustModel,
        height_m: f64,
        period: Duration,
        uav: UavId,
        (draws, tick): (Draws, u64),
    ) {
        let noise: [f64; 3] = draws.at(Stream::Gust, uav.0.into(), tick).normals();
        let a = period.s() / model.at(height_m).1;
        let decay = math::exp(-a);
        let (kept, [first, second]) = (decay * decay, self.across);
        // Cholesky factor of the covariance of the noise, which keeps the stationary covariance.
        let covariance = [1.0 - kept, 0.5 - kept * (a + 0.5), 0.5 - kept * (a * a + a + 0.5)];
        let l11 = covariance[0].sqrt();
        let l21 = covariance[1] / l11;
        let l22 = (covariance[2] - l21 * l21).max(0.0).sqrt();
        self.along = decay * self.along + l11 * noise[0];
        self.across = [decay * first + l11 * noise[1], decay * (a * first + second) + l21 * noise[1] + l22 * noise[2]];
    }

    /// Velocity of the gust at a height, m, in a mean wind with this direction.
    pub(crate) fn velocity(&self, model: &GustModel, height_m: f64, mean: Angle) -> Velocity {
        let (sd_m_s, _) = model.at(height_m);
        let [first, second] = self.across;
        let root_3 = 3f64.sqrt();
        let across = (root_3 * first + (1.0 - root_3) * second) / 2f64.sqrt();
        let (sin, cos) = mean.sin_cos();
        let (along_m_s, across_m_s) = (sd_m_s * self.along, sd_m_s * across);
        Velocity::from_m_s(along_m_s * cos - across_m_s * sin, along_m_s * sin + across_m_s * cos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers of the specification: at 1,000 feet k = 1, so that sigma = 0.1 W20 and L = 1,000 feet; at 20 feet
    /// sigma = 0.1 W20 / 0.19346^0.4.
    #[test]
    fn intensity_and_length_are_those_of_the_specification() {
        let model = GustModel { w20_m_s: 15.4, airspeed_m_s: 23.0 };
        let (sd_m_s, time_s) = model.at(304.8);
        assert!((sd_m_s - 1.54).abs() < 1e-9 && (time_s - 304.8 / 23.0).abs() < 1e-9);
        assert_eq!(model.at(5000.0), model.at(304.8));
        assert!((model.at(6.096).0 - 1.54 * math::exp(-0.4 * math::ln(0.193_46))).abs() < 1e-9);
        assert_eq!(model.at(-1.0), model.at(3.048));
    }

    /// Over many UAVs: the standard deviations, and the autocorrelations exp(-t) along and (1 - t / 2) exp(-t) across
    /// the wind at a time lag of t time constants, whatever the period is.
    #[test]
    fn gusts_have_the_variance_and_the_autocorrelation_of_the_model() {
        let model = GustModel { w20_m_s: 10.0, airspeed_m_s: 20.0 };
        let (draws, n) = (Draws::new(3), 20_000u32);
        let (sd_m_s, time_s) = model.at(100.0);
        for steps in [1u64, 5] {
            let period = Duration::from_s(time_s / steps as f64);
            let (mut squares, mut products) = ([0.0; 4], [0.0; 2]);
            for uav in (0..n).map(UavId) {
                let mut gusts = Gusts::new(uav, draws);
                let first = gusts.velocity(&model, 100.0, Angle::ZERO);
                (1..=steps).for_each(|tick| gusts.step(&model, 100.0, period, uav, (draws, tick)));
                let last = gusts.velocity(&model, 100.0, Angle::ZERO);
                let values = [first.x_m_s(), first.y_m_s(), last.x_m_s(), last.y_m_s()].map(|value| value / sd_m_s);
                squares.iter_mut().zip(values).for_each(|(sum, value)| *sum += value * value / f64::from(n));
                products[0] += values[0] * values[2] / f64::from(n);
                products[1] += values[1] * values[3] / f64::from(n);
            }
            // Five standard errors.
            for square in squares {
                assert!((square - 1.0).abs() < 5.0 * (2.0 / f64::from(n)).sqrt(), "{square}");
            }
            let expected = [math::exp(-1.0), 0.5 * math::exp(-1.0)];
            for (product, expected) in products.into_iter().zip(expected) {
                assert!((product - expected).abs() < 5.0 * (1.2 / f64::from(n)).sqrt(), "{product} {expected}");
            }
        }
    }
}
