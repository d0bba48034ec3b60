//! Elementary functions, from one portable source, so that results do not depend on the platform or the build.
//!
//! Sine, cosine and arc tangent are where a mission spends its time: for arguments of a usual size they are worked out
//! here, by series short enough to need no branch, within 2 units in the last place of `libm`'s, which does the rest.

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4};
pub use core::f64::consts::{PI, TAU};

/// Sine of an angle in radians.
pub fn sin(x: f64) -> f64 {
    sin_cos(x).0
}

/// Cosine of an angle in radians.
pub fn cos(x: f64) -> f64 {
    sin_cos(x).1
}

/// Sine and cosine of an angle in radians.
pub fn sin_cos(x: f64) -> (f64, f64) {
    if has_usual_size(x) { usual_sin_cos(x) } else { (libm::sin(x), libm::cos(x)) }
}

/// Sines and cosines of several angles in radians: the same as one by one, in less time.
pub fn sin_cos_each<const N: usize>(x: [f64; N]) -> [(f64, f64); N] {
    // Without a branch between them, they are worked on side by side.
    let are_usual = x.iter().fold(true, |all, x| all & has_usual_size(*x));
    if are_usual { x.map(usual_sin_cos) } else { x.map(sin_cos) }
}

fn has_usual_size(x: f64) -> bool {
    // What is not a number is not usual.
    x.abs() < 1e5
}

#[inline]
fn usual_sin_cos(x: f64) -> (f64, f64) {
    let (quarter, quarters) = nearest_whole(x * FRAC_2_PI);
    // A quarter turn in three parts: the products with the first two are exact.
    const QUARTER_TURN: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];
    let r = ((x - quarters * QUARTER_TURN[0]) - quarters * QUARTER_TURN[1]) - quarters * QUARTER_TURN[2];
    let s = r * r;
    let sin = r + r * s * series(s, &SIN);
    let cos = 1.0 - s * (0.5 - s * series(s, &COS));
    // At odd quarters they change places, and two bits hold the signs.
    let swapped = (sin.to_bits() ^ cos.to_bits()) & (quarter & 1).wrapping_neg();
    let sin_sign = (quarter & 2) << 62;
    let cos_sign = (quarter.wrapping_add(1) & 2) << 62;
    (f64::from_bits(sin.to_bits() ^ swapped ^ sin_sign), f64::from_bits(cos.to_bits() ^ swapped ^ cos_sign))
}

/// Four-quadrant arc tangent of `y / x`, radians in [-pi, pi]; zero for (0, 0).
pub fn atan2(y: f64, x: f64) -> f64 {
    let (long, short) = if x.abs() < y.abs() { (y.abs(), x.abs()) } else { (x.abs(), y.abs()) };
    let is_usual = 1e-100 < long && long < 1e100 && !short.is_nan();
    if !is_usual {
        return libm::atan2(y, x);
    }
    // The angle between the long side and a direction of the table, whose tangent is in sixteenths.
    let (sixteenth, sixteenths) = nearest_whole(16.0 * short / long);
    let tan = sixteenths / 16.0;
    let t = (short - tan * long) / (long + tan * short);
    let s = t * t;
    let from_long = ARCS[((sixteenth & 31) as usize).min(16)] + (t + t * s * series(s, &ATAN));
    let from_x = if x.abs() < y.abs() { FRAC_PI_2 - from_long } else { from_long };
    let angle = if x < 0.0 { PI - from_x } else { from_x };
    angle.copysign(y)
}

/// Exponential.
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// Natural logarithm.
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// `sqrt(x^2 + y^2)` without overflow.
#[inline]
pub fn hypot(x: f64, y: f64) -> f64 {
    let sum = x * x + y * y;
    if 1e-280 < sum && sum < 1e300 { sum.sqrt() } else { libm::hypot(x, y) }
}

/// The nearest whole number of one that is not large; the last bits of the first answer are its own.
fn nearest_whole(x: f64) -> (u64, f64) {
    // Where a double's last place is one, adding rounds.
    const SHIFT: f64 = 1.5 / f64::EPSILON;
    let shifted = x + SHIFT;
    (shifted.to_bits(), shifted - SHIFT)
}

/// The sum of coefficients times powers of `s`, by pairs, so that not every sum has to wait for the one before.
fn series<const N: usize>(s: f64, coefficients: &[f64; N]) -> f64 {
    let (pairs, last) = coefficients.as_chunks::<2>();
    let start = last.first().copied().unwrap_or(0.0);
    let squared = s * s;
    pairs.iter().rev().fold(start, |sum, [even, odd]| sum * squared + (even + odd * s))
}

/// Of (sin r / r - 1) / r^2 in powers of r^2, for r up to an eighth of a turn.
const SIN: [f64; 8] = [
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5_040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 355_687_428_096_000.0,
];

/// Of (cos r - 1 + r^2 / 2) / r^4 in powers of r^2, for r up to an eighth of a turn.
const COS: [f64; 7] = [
    1.0 / 24.0,
    -1.0 / 720.0,
    1.0 / 40_320.0,
    -1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 20_922_789_888_000.0,
];

/// Of (arctan t / t - 1) / t^2 in powers of t^2, for t up to 1/32.
const ATAN: [f64; 5] = [-1.0 / 3.0, 1.0 / 5.0, -1.0 / 7.0, 1.0 / 9.0, -1.0 / 11.0];

/// Arc tangents of sixteenths.
const ARCS: [f64; 17] = [
    0.0,
    0.062_418_809_995_957_35,
    0.124_354_994_546_761_44,
    0.185_347_949_995_694_76,
    0.244_978_663_126_864_14,
    0.302_884_868_374_971_4,
    0.358_770_670_270_572_25,
    0.412_410_441_597_387_3,
    0.463_647_609_000_806_1,
    0.512_389_460_310_737_7,
    0.558_599_315_343_562_4,
    0.602_287_346_134_964_2,
    0.643_501_108_793_284_4,
    0.682_316_554_874_748_1,
    0.718_829_999_621_624_5,
    0.753_151_280_962_194_4,
    FRAC_PI_4,
];

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Equal but for so many units in the last place; zeros are zeros.
    fn close(got: f64, expected: f64, units: u64) -> bool {
        got == expected || got.is_nan() && expected.is_nan() || got.to_bits().abs_diff(expected.to_bits()) <= units
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn sine_and_cosine_are_libms(turns in -1.0..1.0f64, scale in 0..6i32) {
            let x = turns * [1e-3, 1.0, 4.0, 1e2, 9e4, 1e9][scale as usize];
            let (sin, cos) = sin_cos(x);
            prop_assert!(close(sin, libm::sin(x), 2), "sin {x:e}: {sin:e} {:e}", libm::sin(x));
            prop_assert!(close(cos, libm::cos(x), 2), "cos {x:e}: {cos:e} {:e}", libm::cos(x));
        }

        #[test]
        fn the_arc_tangent_is_libms(x in -1.0..1.0f64, y in -1.0..1.0f64, scale in -3..4i32) {
            let y = y * [1e-9, 1e-3, 1e-1, 1.0, 1e1, 1e3, 1e9][(scale + 3) as usize];
            let (got, expected) = (atan2(y, x), libm::atan2(y, x));
            prop_assert!(close(got, expected, 2), "{y:e} / {x:e}: {got:e} {expected:e}");
        }

        #[test]
        fn the_hypotenuse_is_libms(x in -1.0..1.0f64, y in -1.0..1.0f64, power in -300..300i32) {
            let scale = format!("1e{power}").parse::<f64>().unwrap();
            let (x, y) = (x * scale, y * scale);
            prop_assert!(close(hypot(x, y), libm::hypot(x, y), 2));
        }
    }

    /// Zeros of either sign, infinities, the smallest and the largest numbers, and what is not a number.
    #[test]
    fn at_the_ends_of_the_range_it_is_libm() {
        let tiny = f64::MIN_POSITIVE / 8.0;
        let ends = [0.0, tiny, 1e-200, 1e-100, 1.0, 1e5, 1e100, 1e200, f64::MAX, f64::INFINITY, f64::NAN];
        let ends = ends.iter().flat_map(|end| [*end, -*end]);
        for x in ends.clone() {
            let (sin, cos) = sin_cos(x);
            assert!(close(sin, libm::sin(x), 1) && close(cos, libm::cos(x), 1), "{x}");
            for y in ends.clone() {
                let (got, expected) = (atan2(y, x), libm::atan2(y, x));
                assert!(close(got, expected, 1), "{y} / {x}: {got} {expected}");
                assert!(close(hypot(y, x), libm::hypot(y, x), 1), "{y}, {x}");
            }
        }
    }

    /// The names of quarter turns are exact, and so is their order about west.
    #[test]
    fn quarter_turns_are_exact() {
        for (y, x, expected) in [(0.0, 3.0, 0.0), (2.0, 0.0, 0.5 * PI), (0.0, -5.0, PI), (-0.0, -5.0, -PI)] {
            assert_eq!(atan2(y, x), expected);
        }
        for (y, x, eighths) in [(7.0, 7.0, 1.0), (7.0, -7.0, 3.0), (-7.0, 7.0, -1.0), (-7.0, -7.0, -3.0)] {
            assert_eq!(atan2(y, x), eighths * 0.25 * PI);
        }
        assert_eq!((sin(0.5 * PI), cos(0.0), sin(0.0)), (1.0, 1.0, 0.0));
    }
}
