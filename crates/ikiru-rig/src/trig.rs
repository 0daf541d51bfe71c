//! Sine and cosine together, in plain arithmetic: the same bits on every platform, and no call.

use std::f64::consts::FRAC_2_PI;

/// Adding and taking away this number (1.5 · 2⁵²) rounds a small `f64` to the nearest integer, which is
/// then found in its low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

// π/2 in three parts. The first two have 33 significant bits, so that their products with an integer
// below 2²⁰ are exact; the third is the rest.
const HALF_PI_1: f64 = f64::from_bits(0x3FF9_21FB_5440_0000);
const HALF_PI_2: f64 = f64::from_bits(0x3DD0_B461_1A60_0000);
const HALF_PI_3: f64 = 2.022_266_248_795_950_7e-21;

/// Beyond this magnitude the reduction above would lose bits, and a slower function takes over.
const LARGEST: f64 = 1.0e6;

/// `(sin x, cos x)` for `x` in radians, within two units in the last place of 1.
#[inline(always)]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    // Also false for a NaN, which the other function hands through.
    if x.abs() < LARGEST { sin_cos_small(x) } else { libm::sincos(x) }
}

/// [`sin_cos`] of three angles; without a branch between them, they share vector instructions.
#[inline(always)]
pub(crate) fn sin_cos3(x: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let largest = x[0].abs().max(x[1].abs()).max(x[2].abs());
    // A NaN among the three would be lost in the maximum.
    if largest < LARGEST && !(x[0] + x[1] + x[2]).is_nan() {
        let mut sin = [0.0; 4];
        let mut cos = [0.0; 4];
        let padded = [x[0], x[1], x[2], 0.0];
        for i in 0..4 {
            (sin[i], cos[i]) = sin_cos_small(padded[i]);
        }
        ([sin[0], sin[1], sin[2]], [cos[0], cos[1], cos[2]])
    } else {
        let all = x.map(sin_cos);
        (all.map(|a| a.0), all.map(|a| a.1))
    }
}

#[inline(always)]
fn sin_cos_small(x: f64) -> (f64, f64) {
    let shifted = x * FRAC_2_PI + ROUND;
    let turns = shifted - ROUND;
    let quadrant = shifted.to_bits();
    let r = ((x - turns * HALF_PI_1) - turns * HALF_PI_2) - turns * HALF_PI_3;
    let r2 = r * r;
    let r4 = r2 * r2;
    // Taylor's series: at |r| ≤ π/4 the first term left out is below 1e-19 (sine) and 3e-18 (cosine).
    // Even and odd powers of r² are summed apart, which halves the chain of dependent operations.
    let sin_even = 1.0 + r4 * (1.0 / 120.0 + r4 * (1.0 / 362_880.0 + r4 * (1.0 / 6_227_020_800.0)));
    let sin_odd =
        -1.0 / 6.0 + r4 * (-1.0 / 5_040.0 + r4 * (-1.0 / 39_916_800.0 + r4 * (-1.0 / 1_307_674_368_000.0)));
    let sin = r + r * ((sin_even - 1.0) + r2 * sin_odd);
    let cos_even = r4
        * (1.0 / 24.0
            + r4 * (1.0 / 40_320.0 + r4 * (1.0 / 479_001_600.0 + r4 * (1.0 / 20_922_789_888_000.0))));
    let cos_odd = -0.5 + r4 * (-1.0 / 720.0 + r4 * (-1.0 / 3_628_800.0 + r4 * (-1.0 / 87_178_291_200.0)));
    let cos = 1.0 + (cos_even + r2 * cos_odd);
    // Odd quadrants swap the two: by bit masks, since a branch here would be mispredicted half the time.
    let odd = (quadrant & 1).wrapping_neg();
    let (s, c) = (sin.to_bits(), cos.to_bits());
    let (a, b) = ((s & !odd) | (c & odd), (c & !odd) | (s & odd));
    // Quadrants 2 and 3 have a negative sine, 1 and 2 a negative cosine: the sign bit is set without a branch.
    let sin_sign = (quadrant & 2) << 62;
    let cos_sign = ((quadrant + 1) & 2) << 62;
    (f64::from_bits(a ^ sin_sign), f64::from_bits(b ^ cos_sign))
}

#[cfg(test)]
mod tests {
    use super::{sin_cos, sin_cos3};

    #[test]
    fn agrees_with_the_standard_library() {
        for i in -400_000..=400_000_i32 {
            let x = f64::from(i) * 0.003_1 + 1e-9 * f64::from(i % 7);
            let (sin, cos) = sin_cos(x);
            assert!((sin - x.sin()).abs() < 4e-16, "sin {x}");
            assert!((cos - x.cos()).abs() < 4e-16, "cos {x}");
        }
    }

    #[test]
    fn small_angles_keep_their_relative_precision() {
        for exponent in 1..300 {
            let x = 10f64.powi(-exponent);
            let (sin, cos) = sin_cos(x);
            assert!((sin - x.sin()).abs() <= 1e-15 * x, "sin {x}");
            assert!((cos - x.cos()).abs() < 3e-16, "cos {x}");
        }
    }

    #[test]
    fn whole_turns_large_values_and_nan() {
        for turns in -1000..1000_i32 {
            let x = f64::from(turns) * std::f64::consts::FRAC_PI_2;
            let (sin, cos) = sin_cos(x);
            assert!((sin - x.sin()).abs() < 4e-16 && (cos - x.cos()).abs() < 4e-16);
            assert!((sin * sin + cos * cos - 1.0).abs() < 1e-15);
        }
        assert_eq!(sin_cos(1e18), libm::sincos(1e18));
        assert!(sin_cos(f64::NAN).0.is_nan());
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn three_at_once_are_the_same_bits() {
        for i in -10_000..10_000_i32 {
            let x = [f64::from(i) * 0.01, f64::from(i) * -0.37, f64::from(i) * 123.0];
            let (sin, cos) = sin_cos3(x);
            for k in 0..3 {
                assert_eq!((sin[k], cos[k]), sin_cos(x[k]));
            }
        }
        assert!(sin_cos3([0.0, f64::NAN, 1.0]).0[1].is_nan());
        assert_eq!(sin_cos3([0.0, 1e18, 1.0]).0[1], libm::sin(1e18));
    }
}
