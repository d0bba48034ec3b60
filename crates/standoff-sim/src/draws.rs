//! Randomness by key: what is drawn depends on (seed, stream, object, tick) and on nothing that was drawn before.
//!
//! So adding a UAV or a target changes nobody else's noise, and two variants of a scenario meet the same world, draw by
//! draw.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use standoff::math;

/// What a draw is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Stream {
    /// Values that a scenario gives as distributions.
    Scenario = 1,
    /// Acceleration of random targets.
    TargetMotion = 2,
    /// Measurement noise.
    Measurement = 3,
    /// Error of the cues.
    Cue = 4,
}

/// All randomness of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Draws {
    seed: u64,
}

impl Draws {
    /// The draws of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// The draws for one purpose, object and tick.
    pub fn at(&self, stream: Stream, object: u64, tick: u64) -> Draw {
        let mut key = [0u8; 32];
        for (place, word) in key.chunks_exact_mut(8).zip([self.seed, stream as u64, object, tick]) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        Draw(ChaCha8Rng::from_seed(key))
    }
}

/// A short sequence of random numbers.
#[derive(Debug, Clone)]
pub struct Draw(ChaCha8Rng);

impl Draw {
    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Two independent standard normals (Box-Muller, on portable elementary functions).
    pub fn normals(&mut self) -> [f64; 2] {
        let radius = (-2.0 * math::ln(1.0 - self.uniform())).sqrt();
        let angle = math::TAU * self.uniform();
        [radius * math::cos(angle), radius * math::sin(angle)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_depends_on_every_part_of_its_key_and_on_nothing_else() {
        let draw = |seed, stream, object, tick| Draws::new(seed).at(stream, object, tick).uniform().to_bits();
        let reference = draw(1, Stream::Cue, 2, 3);
        assert_eq!(draw(1, Stream::Cue, 2, 3), reference);
        for other in [
            draw(2, Stream::Cue, 2, 3),
            draw(1, Stream::Measurement, 2, 3),
            draw(1, Stream::Cue, 3, 3),
            draw(1, Stream::Cue, 2, 4),
        ] {
            assert_ne!(other, reference);
        }
    }

    /// Pins the generator: these bits may change only with a new record format.
    #[test]
    fn the_generator_is_pinned() {
        let mut draw = Draws::new(42).at(Stream::Measurement, 7, 9);
        let got = [draw.uniform(), draw.uniform()];
        assert_eq!(got, PINNED, "{got:?}");
    }
    const PINNED: [f64; 2] = [0.324055963018935, 0.9531631695141117];

    #[test]
    fn normals_have_the_moments_of_a_standard_normal() {
        let n = 20_000;
        let (mut sum, mut squares, mut fourths, mut product) = (0.0, 0.0, 0.0, 0.0);
        for object in 0..n {
            let [a, b] = Draws::new(5).at(Stream::Measurement, object, 0).normals();
            sum += a + b;
            squares += a * a + b * b;
            fourths += a * a * a * a + b * b * b * b;
            product += a * b;
        }
        let count = 2.0 * n as f64;
        // Five standard errors each.
        assert!((sum / count).abs() < 5.0 / count.sqrt());
        assert!((squares / count - 1.0).abs() < 5.0 * (2.0 / count).sqrt());
        assert!((fourths / count - 3.0).abs() < 5.0 * (96.0 / count).sqrt());
        assert!((product / n as f64).abs() < 5.0 / (n as f64).sqrt());
    }
}
