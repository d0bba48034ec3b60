//! Random draws by key: a draw depends on (seed, stream, object, tick) and on no other draw.
//!
//! An additional UAV or target therefore changes no other noise, and two variants of a scenario see the same world,
//! draw by draw. The parts of a key are mixed one after the other by the output function of SplitMix64, in which every
//! output bit depends on every input bit; the result seeds a new SplitMix64.

mod split_mix;
mod ziggurat;

use split_mix::SplitMix64;
use standoff::math;
use ziggurat::Ziggurat;

/// Purpose of a draw.
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
    /// Seeds of the episodes after the first one.
    Episode = 5,
    /// Whether a message is lost.
    RadioLoss = 6,
    /// Latency of a message.
    RadioDelay = 7,
    /// Whether a message is duplicated.
    RadioDuplicate = 8,
    /// Points of a Latin hypercube.
    Sweep = 9,
    /// Whether a target in view is detected.
    Detection = 10,
    /// Noise of the range rate.
    RangeRate = 11,
    /// Number of false alarms of a scan.
    FalseAlarmCount = 12,
    /// Range, bearing and range rate of a false alarm.
    FalseAlarm = 13,
    /// Order of the detections of a scan.
    DetectionOrder = 14,
    /// Error of the position that a UAV assumes.
    NavigationPosition = 15,
    /// Error of the heading that a UAV assumes.
    NavigationHeading = 16,
    /// Gusts around a UAV.
    Gust = 17,
}

/// All random draws of a run.
#[derive(Debug, Clone, Copy)]
pub struct Draws {
    /// The seed, mixed.
    seed: u64,
    ziggurat: &'static Ziggurat,
}

impl Draws {
    /// Creates the draws of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed: mixed(seed), ziggurat: Ziggurat::get() }
    }

    /// Returns the draws for one purpose, object and tick.
    pub fn at(&self, stream: Stream, object: u64, tick: u64) -> Draw {
        let key = mixed(mixed(mixed(self.seed ^ stream as u64) ^ object) ^ tick);
        Draw { bits: SplitMix64(key), ziggurat: self.ziggurat }
    }
}

fn mixed(word: u64) -> u64 {
    SplitMix64(word).next_u64()
}

/// A short sequence of random numbers.
#[derive(Debug, Clone)]
pub struct Draw {
    bits: SplitMix64,
    ziggurat: &'static Ziggurat,
}

impl Draw {
    /// Draws a number uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Draws a seed: uniform over 0 to 2^53 - 1, which a float represents exactly.
    pub fn seed(&mut self) -> u64 {
        self.bits.next_u64() >> 11
    }

    /// Draws a standard normal.
    pub fn normal(&mut self) -> f64 {
        self.ziggurat.normal(&mut self.bits)
    }

    /// Draws a Poisson number of the given mean, at least 0, by adding up exponentially distributed gaps.
    pub fn poisson(&mut self, mean: f64) -> u32 {
        let mut sum = -math::ln(1.0 - self.uniform());
        let mut count = 0;
        while sum < mean {
            count += 1;
            sum -= math::ln(1.0 - self.uniform());
        }
        count
    }

    /// Puts items into a uniformly random order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, (self.uniform() * (last + 1) as f64) as usize);
        }
    }

    /// Draws independent standard normals.
    pub fn normals<const N: usize>(&mut self) -> [f64; N] {
        core::array::from_fn(|_| self.normal())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normals_of(n: u64, key: impl Fn(u64) -> (u64, Stream, u64, u64)) -> Vec<f64> {
        let normal = |index| {
            let (seed, stream, object, tick) = key(index);
            Draws::new(seed).at(stream, object, tick).normal()
        };
        (0..n).map(normal).collect()
    }

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
        let got = [draw.uniform(), draw.uniform(), draw.normal(), draw.normal()];
        assert_eq!(got, PINNED, "{got:?}");
        assert_eq!(Draws::new(42).at(Stream::Measurement, 7, 9).seed(), (PINNED[0] * (1u64 << 53) as f64) as u64);
    }
    const PINNED: [f64; 4] = [0.26073312662109194, 0.6994719299284348, 0.5026577007152908, -0.8623114835657002];

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

    /// Mean and variance of a Poisson number are equal; a mean of 0 gives 0.
    #[test]
    fn poisson_numbers_have_the_given_mean_and_variance() {
        assert_eq!(Draws::new(5).at(Stream::FalseAlarmCount, 0, 0).poisson(0.0), 0);
        let n = 20_000;
        for mean in [0.3, 5.0, 40.0] {
            let number = |tick| f64::from(Draws::new(5).at(Stream::FalseAlarmCount, 0, tick).poisson(mean));
            let numbers: Vec<f64> = (0..n).map(number).collect();
            let average = numbers.iter().sum::<f64>() / n as f64;
            let variance = numbers.iter().map(|number| (number - mean) * (number - mean)).sum::<f64>() / n as f64;
            // Five standard errors each.
            assert!((average - mean).abs() < 5.0 * (mean / n as f64).sqrt(), "{mean}: {average}");
            let fourth = mean + 3.0 * mean * mean;
            assert!((variance - mean).abs() < 5.0 * ((fourth - mean * mean) / n as f64).sqrt(), "{mean}: {variance}");
        }
    }

    /// Every item is equally likely at every place.
    #[test]
    fn shuffled_items_are_uniform_over_the_places() {
        let n = 12_000;
        let mut counts = [[0u32; 4]; 4];
        for tick in 0..n {
            let mut items = [0, 1, 2, 3];
            Draws::new(5).at(Stream::DetectionOrder, 0, tick).shuffle(&mut items);
            items.iter().enumerate().for_each(|(place, item)| counts[place][*item] += 1);
        }
        let allowed = 5.0 * (n as f64 * 0.25 * 0.75).sqrt();
        assert!(
            counts.as_flattened().iter().all(|count| (f64::from(*count) - 0.25 * n as f64).abs() < allowed),
            "{counts:?}"
        );
    }

    /// Keys that differ by one in one part: neither their normals nor the squares of these are correlated.
    #[test]
    fn neighbouring_keys_are_independent() {
        let n = 100_000;
        let correlation =
            |a: &[f64], b: &[f64], of: fn(f64) -> f64| a.iter().zip(b).map(|(a, b)| of(*a) * of(*b)).sum::<f64>();
        let size = |x: f64| (x * x - 1.0) / 2f64.sqrt();
        let by_tick = |seed, stream, object| normals_of(n, move |tick| (seed, stream, object, tick));
        let reference = by_tick(7, Stream::Measurement, 3);
        let neighbours = [
            by_tick(8, Stream::Measurement, 3),
            by_tick(7, Stream::Cue, 3),
            by_tick(7, Stream::Measurement, 4),
            by_tick(7, Stream::Measurement, 3 | 1 << 32),
            normals_of(n, |tick| (7, Stream::Measurement, 3, tick + 1)),
            normals_of(n, |object| (7, Stream::Measurement, object, 3)),
            normals_of(n, |seed| (seed, Stream::Measurement, 3, 3)),
        ];
        for (index, neighbour) in neighbours.iter().enumerate() {
            for (what, of) in [("values", (|x| x) as fn(f64) -> f64), ("squares", size)] {
                let sum = correlation(&reference, neighbour, of);
                assert!(sum.abs() < 5.0 * (n as f64).sqrt(), "neighbour {index}, {what}: {sum}");
            }
        }
    }

    /// Flipping any bit of a key flips each bit of the draw with probability one half.
    #[test]
    fn every_bit_of_a_key_affects_every_bit_of_a_draw() {
        let n = 2_000u64;
        let bits =
            |[seed, object, tick]: [u64; 3]| Draws::new(seed).at(Stream::Measurement, object, tick).bits.next_u64();
        for word in 0..3 {
            for flipped in (0..64).step_by(3) {
                let mut flips = [0u32; 64];
                for index in 0..n {
                    let key = [index / 100, index % 10, index];
                    let mut other = key;
                    other[word] ^= 1 << flipped;
                    let difference = bits(key) ^ bits(other);
                    flips.iter_mut().enumerate().for_each(|(bit, count)| *count += (difference >> bit & 1) as u32);
                }
                // Six standard errors, because four thousand counts are tested.
                let allowed = 6.0 * (0.25 * n as f64).sqrt();
                for count in flips {
                    let off = f64::from(count) - 0.5 * n as f64;
                    assert!(off.abs() < allowed, "word {word}, bit {flipped}: {count} of {n}");
                }
            }
        }
    }
}
