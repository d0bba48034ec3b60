//! Standard normals by the ziggurat method of Marsaglia and Tsang (2000): one 64-bit random number per draw, and nearly
//! always no elementary function.
//!
//! It is not taken from a library: the available ones use exponential and logarithm of the platform as soon as any
//! crate of a build does, and results must not depend on the platform.

use std::sync::LazyLock;

use standoff::math;

use super::split_mix::SplitMix64;

/// Number of layers of equal area into which the area under exp(-x^2 / 2), x > 0, is divided.
const LAYERS: usize = 256;
/// Start of the tail of the lowest layer, such that the highest layer ends at the maximum of the curve.
const TAIL_FROM: f64 = 3.654_152_885_361_009;
/// Area of a layer.
const AREA: f64 = 0.004_928_673_233_974_655;

/// The layers, from the lowest to the highest.
#[derive(Debug)]
pub(super) struct Ziggurat {
    /// Width of each layer, and 0 for the top; that of the lowest is its area as a rectangle.
    x: [f64; LAYERS + 1],
    /// Height of the curve at `x`.
    bell: [f64; LAYERS + 1],
}

impl Ziggurat {
    pub(super) fn get() -> &'static Self {
        static ZIGGURAT: LazyLock<Ziggurat> = LazyLock::new(Ziggurat::new);
        &ZIGGURAT
    }

    fn new() -> Self {
        let (mut x, mut bell) = ([0.0; LAYERS + 1], [1.0; LAYERS + 1]);
        (x[0], bell[0]) = (AREA / bell_at(TAIL_FROM), 0.0);
        (x[1], bell[1]) = (TAIL_FROM, bell_at(TAIL_FROM));
        for layer in 2..LAYERS {
            bell[layer] = bell[layer - 1] + AREA / x[layer - 1];
            x[layer] = (-2.0 * math::ln(bell[layer])).sqrt();
        }
        Self { x, bell }
    }

    /// Draws a standard normal.
    pub(super) fn normal(&self, random: &mut SplitMix64) -> f64 {
        loop {
            let bits = random.next_u64();
            // The lowest eight bits select the layer, the highest 53 the position in it, in [-1, 1).
            let layer = (bits & 0xff) as usize;
            let x = (bits as i64 >> 11) as f64 * UNIT * self.x[layer];
            if x.abs() < self.x[layer + 1] {
                return x;
            }
            if let Some(x) = self.at_the_edge(layer, x, random) {
                return x;
            }
        }
    }

    /// Decides on a point that is not below the next layer: in the tail, or near the curve.
    #[cold]
    fn at_the_edge(&self, layer: usize, x: f64, random: &mut SplitMix64) -> Option<f64> {
        let mut uniform = || (random.next_u64() >> 11) as f64 * 0.5 * UNIT;
        if layer == 0 {
            loop {
                let beyond = -math::ln(1.0 - uniform()) / TAIL_FROM;
                if -2.0 * math::ln(1.0 - uniform()) > beyond * beyond {
                    return Some((TAIL_FROM + beyond).copysign(x));
                }
            }
        }
        let (low, high) = (self.bell[layer], self.bell[layer + 1]);
        (low + (high - low) * uniform() < bell_at(x)).then_some(x)
    }
}

/// 2^-52.
const UNIT: f64 = f64::EPSILON;

fn bell_at(x: f64) -> f64 {
    math::exp(-0.5 * x * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rest for the highest layer has the area of a layer, so the two constants match.
    #[test]
    fn the_layers_fill_the_area_under_the_curve() {
        let ziggurat = Ziggurat::new();
        for layer in 1..LAYERS {
            let area = ziggurat.x[layer] * (ziggurat.bell[layer + 1] - ziggurat.bell[layer]);
            assert!((area / AREA - 1.0).abs() < 1e-9, "layer {layer}: {area}");
        }
        // The lowest layer is a rectangle and the tail, which Simpson's rule integrates.
        let step = 1e-3;
        let parts = (0..6000).map(|i| {
            [(0.0, 1.0), (0.5, 4.0), (1.0, 1.0)]
                .map(|(at, weight)| weight * bell_at(TAIL_FROM + (f64::from(i) + at) * step))
        });
        let tail = parts.flatten().sum::<f64>() * step / 6.0;
        assert!((TAIL_FROM * bell_at(TAIL_FROM) + tail - AREA).abs() < 1e-14);
    }

    /// Quantiles of the normal distribution, including the tail, to which moments are insensitive.
    #[test]
    fn the_fractions_beyond_quantiles_match_the_normal_distribution() {
        let mut random = SplitMix64(11);
        let n = 1_000_000;
        let normals: Vec<f64> = (0..n).map(|_| Ziggurat::get().normal(&mut random)).collect();
        for (quantile, beyond) in [
            (0.0, 0.5),
            (0.253_347_103, 0.4),
            (0.674_489_750, 0.25),
            (1.281_551_566, 0.1),
            (1.959_963_985, 0.025),
            (3.090_232_306, 1e-3),
            (3.540_083_799, 2e-4),
            (3.719_016_485, 1e-4),
            (4.055_626_981, 2.5e-5),
        ] {
            let se = (f64::from(n) * beyond * (1.0 - beyond)).sqrt();
            for sign in [1.0, -1.0] {
                let got = normals.iter().filter(|normal| sign * **normal > quantile).count() as f64;
                assert!((got - f64::from(n) * beyond).abs() < 5.0 * se, "{quantile}, sign {sign}: {got}");
            }
        }
    }
}
