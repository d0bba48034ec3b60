//! Density of the air in the International Standard Atmosphere (ISO 2533), up to 20 km.
//!
//! ```text
//! sigma = (1 - L h / T_0)^(g / (R L) - 1)                 h <= 11 km, T_0 = 288.15 K, L = 0.0065 K/m
//! sigma = sigma(11 km) exp(-g (h - 11 km) / (R T_11))     above, T_11 = 216.65 K
//! ```

use crate::math;

/// Standard gravity, m/s2.
pub const GRAVITY_M_S2: f64 = 9.80665;

/// Temperature at sea level, K.
const TEMPERATURE_0_K: f64 = 288.15;

/// Decrease of the temperature with the height in the troposphere, K/m.
const LAPSE_K_M: f64 = 0.0065;

/// Specific gas constant of air, J/(kg K).
const GAS_CONSTANT_J_KG_K: f64 = 287.052_87;

/// Height of the tropopause, m.
const TROPOPAUSE_M: f64 = 11_000.0;

/// Density at a height above sea level, m, relative to that at sea level. The true airspeed is the equivalent airspeed
/// divided by its square root.
pub fn density_ratio(height_m: f64) -> f64 {
    let below_m = height_m.min(TROPOPAUSE_M);
    let temperature_k = TEMPERATURE_0_K - LAPSE_K_M * below_m;
    let exponent = GRAVITY_M_S2 / (GAS_CONSTANT_J_KG_K * LAPSE_K_M) - 1.0;
    let above_m = (height_m - TROPOPAUSE_M).max(0.0);
    let scale_height_m = GAS_CONSTANT_J_KG_K * temperature_k / GRAVITY_M_S2;
    math::exp(exponent * math::ln(temperature_k / TEMPERATURE_0_K) - above_m / scale_height_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the tables of ISO 2533 by geopotential height.
    #[test]
    fn the_density_is_that_of_the_standard_tables() {
        for (height_m, density_kg_m3) in [(0.0, 1.225), (1e3, 1.1116), (5e3, 0.73612), (11e3, 0.36392), (2e4, 0.08803)]
        {
            let ratio = density_ratio(height_m);
            assert!((ratio * 1.225 / density_kg_m3 - 1.0).abs() < 1e-3, "{height_m} m: {}", ratio * 1.225);
        }
        // Below sea level, too.
        assert!((density_ratio(-500.0) * 1.225 / 1.2849 - 1.0).abs() < 1e-3);
    }
}
