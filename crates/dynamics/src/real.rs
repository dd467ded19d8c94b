//! Numbers of which one or several are computed at once, and their sine and cosine.

use std::f64::consts::FRAC_2_PI;
use std::ops::{Add, Mul, Neg, Sub};

/// A number, or the same number of several states side by side in one register (lanes). The
/// recursion over the bodies is generic over it: the same code computes one state and many.
///
/// Constants of the robot are `f64`: they are the same in all lanes.
pub(crate) trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
{
    /// Returns `self · factor + term`. A register may round once, where its processor has such an
    /// instruction; `f64` and lanes that every processor has round the product and the sum.
    fn mul_add(self, factor: Self, term: Self) -> Self;

    /// Returns a number in all lanes like `self`, which proves that its processor is there.
    fn splat(self, number: f64) -> Self;

    /// Returns the absolute value.
    fn abs(self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        // Without the instruction, `f64::mul_add` is a call of some fifty cycles.
        self * factor + term
    }

    #[inline(always)]
    fn splat(self, number: f64) -> Self {
        number
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
}

/// Largest angle, rad, of which [`sin_cos`] counts the quarter turns without a rounding error.
const LARGEST_ANGLE: f64 = 1e6;

/// Returns an angle of equal sine and cosine that [`sin_cos`] can take: itself up to a million rad.
#[inline(always)]
pub(crate) fn bounded_angle(angle: f64) -> f64 {
    if angle.abs() <= LARGEST_ANGLE {
        angle
    } else {
        angle.sin().atan2(angle.cos())
    }
}

/// Added and subtracted, it rounds a number below 2^51 to the nearest integer.
const ROUNDING: f64 = 6_755_399_441_055_744.0; // 1.5 · 2^52

/// π/2 as a sum of three numbers, the first two of 33 bits: a product with a count of quarter turns
/// below 2^20 is exact (Cody and Waite 1980; fdlibm has the same numbers).
const HALF_PI: [f64; 3] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_795_950_6e-21,
];

/// Coefficients of the sine within an eighth of a turn (fdlibm's `S1` to `S6`).
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// Coefficients of the cosine within an eighth of a turn (fdlibm's `C1` to `C6`).
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Returns sine and cosine of a [`bounded_angle`], each within 2.3e-16. There is no branch, so that
/// all lanes of a register go the same way.
#[inline(always)]
pub(crate) fn sin_cos<T: Real>(angle: T) -> (T, T) {
    let rounding = angle.splat(ROUNDING);
    let quarters = angle.mul_add(angle.splat(FRAC_2_PI), rounding) - rounding;
    let [first, second, third] = HALF_PI;
    let remainder = (-quarters).mul_add(angle.splat(first), angle);
    let remainder = (-quarters).mul_add(angle.splat(second), remainder);
    let remainder = (-quarters).mul_add(angle.splat(third), remainder);
    // The number of quarter turns modulo four, from -2 to 2.
    let fours = quarters.mul_add(angle.splat(0.25), rounding) - rounding;
    let quarter = fours.mul_add(angle.splat(-4.0), quarters);
    let (sin, cos) = sin_cos_of_remainder(remainder);
    // Sine and cosine of the quarter turns are -1, 0 and 1, exactly.
    let quarter_sin = quarter * (angle.splat(2.0) - quarter.abs());
    let quarter_cos = angle.splat(1.0) - quarter.abs();
    (
        quarter_sin.mul_add(cos, quarter_cos * sin),
        quarter_cos.mul_add(cos, -(quarter_sin * sin)),
    )
}

/// Returns sine and cosine within an eighth of a turn, by fdlibm's polynomials.
#[inline(always)]
fn sin_cos_of_remainder<T: Real>(x: T) -> (T, T) {
    let z = x * x;
    let sin = (z * x).mul_add(polynomial(z, &SINE), x);
    let half = z * 0.5;
    let near_one = x.splat(1.0) - half;
    let correction = (z * z).mul_add(polynomial(z, &COSINE), x.splat(1.0) - near_one - half);
    (sin, near_one + correction)
}

/// Returns the polynomial of coefficients in ascending order.
#[inline(always)]
fn polynomial<T: Real>(z: T, coefficients: &[f64; 6]) -> T {
    let [c0, c1, c2, c3, c4, c5] = *coefficients;
    let sum = z.mul_add(z.splat(c5), z.splat(c4));
    let sum = sum.mul_add(z, z.splat(c3));
    let sum = sum.mul_add(z, z.splat(c2));
    let sum = sum.mul_add(z, z.splat(c1));
    sum.mul_add(z, z.splat(c0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sine and cosine agree with the standard library over many turns, also about multiples of
    /// π/2.
    #[test]
    fn sine_and_cosine_are_those_of_the_standard_library() {
        let steps = (-40_000..40_000).map(|k| f64::from(k) * 0.01237);
        let quarters = (-2000..2000).flat_map(|k| {
            let at = f64::from(k) * std::f64::consts::FRAC_PI_2;
            [at, at + 1e-9, at - 1e-3]
        });
        let large = [9.9e5, -9.9e5, 1e6 + 1.0, -3e9, 1e300, 0.0, -0.0];
        for angle in steps.chain(quarters).chain(large) {
            let (sin, cos) = sin_cos(bounded_angle(angle));
            let expected = angle.sin_cos();
            let error = (sin - expected.0).abs().max((cos - expected.1).abs());
            assert!(error <= 2.3e-16, "{angle}: off by {error:e}");
        }
        for angle in [f64::NAN, f64::INFINITY] {
            let (sin, cos) = sin_cos(bounded_angle(angle));
            assert!(sin.is_nan() && cos.is_nan(), "{angle}");
        }
    }
}
