//! The numbers that kernels are written over: plain `f64`, numbers that carry derivatives, many numbers side by side.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use crate::{maths, trig};

pub(crate) mod sealed {
    pub trait Sealed {}
    impl Sealed for f64 {}
    impl Sealed for bool {}
}

/// A number that a kernel or a custom residual computes with.
///
/// Sealed: implemented by `f64`, by [`Dual`](crate::Dual), and by [`Lanes`](crate::Lanes). One source then gives values,
/// exact derivatives, and both for many problems side by side.
///
/// A comparison gives a [`Mask`](Self::Mask), and [`select`](Self::select) takes one of two numbers by it, derivatives
/// included. There is no plain value and no order: in lanes, where each lane may answer otherwise, there is nothing
/// to branch on.
///
/// ```
/// use ikiru_rig::Scalar;
///
/// /// How far a distance falls short of `least`, in metres; 0 beyond it.
/// fn shortfall<S: Scalar>(distance: S, least: f64) -> S {
///     S::select(distance.lt(least), -distance + least, S::zero())
/// }
/// assert_eq!(shortfall(0.25, 1.0), 0.75);
/// assert_eq!(shortfall(2.0, 1.0), 0.0);
/// ```
///
/// A shortfall by a branch on the order does not compile,
///
/// ```compile_fail,E0369
/// # use ikiru_rig::Scalar;
/// fn shortfall<S: Scalar>(distance: S, least: f64) -> S {
///     if distance < S::from(least) { -distance + least } else { S::zero() }
/// }
/// ```
///
/// nor by one on the plain value:
///
/// ```compile_fail,E0599
/// # use ikiru_rig::Scalar;
/// fn shortfall<S: Scalar>(distance: S, least: f64) -> S {
///     if distance.value() < least { -distance + least } else { S::zero() }
/// }
/// ```
pub trait Scalar:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + 'static
{
    /// What a comparison gives: `bool` for one number, one truth value a lane for many.
    type Mask: Mask;

    /// `if_true` where the mask holds and `if_false` elsewhere, each with its own derivatives.
    ///
    /// Both are computed whatever the mask says. Nothing of the one not taken comes through, not even NaN.
    #[must_use]
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self;

    /// Whether the value is less than another; never where either is NaN. Derivatives are not looked at, here and in
    /// the other comparisons.
    fn lt(self, other: impl Into<Self>) -> Self::Mask;
    /// Whether the value is less than another or equal to it; never where either is NaN.
    fn le(self, other: impl Into<Self>) -> Self::Mask;
    /// Whether the value is greater than another; never where either is NaN.
    #[inline(always)]
    fn gt(self, other: impl Into<Self>) -> Self::Mask {
        other.into().lt(self)
    }
    /// Whether the value is greater than another or equal to it; never where either is NaN.
    #[inline(always)]
    fn ge(self, other: impl Into<Self>) -> Self::Mask {
        other.into().le(self)
    }

    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// Sines and cosines of three angles in radians.
    #[must_use]
    fn sin_cos3(angles: [Self; 3]) -> ([Self; 3], [Self; 3]) {
        let all = angles.map(Self::sin_cos);
        (all.map(|a| a.0), all.map(|a| a.1))
    }
    /// Square root; where the value is 0, the derivative is 0 (the least subgradient of a norm).
    fn sqrt(self) -> Self;
    /// The angle of the point `(x, self)`, in `(-π, π]`; at the origin both value and derivative are 0.
    fn atan2(self, x: Self) -> Self;
    /// Exponential function.
    fn exp(self) -> Self;
    /// Natural logarithm of a positive number.
    fn ln(self) -> Self;

    /// The additive identity.
    #[must_use]
    fn zero() -> Self {
        Self::from(0.0)
    }
    /// The multiplicative identity.
    #[must_use]
    fn one() -> Self {
        Self::from(1.0)
    }
    /// Sine of an angle in radians.
    #[must_use]
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    /// Cosine of an angle in radians.
    #[must_use]
    fn cos(self) -> Self {
        self.sin_cos().1
    }
    /// The magnitude; its derivative at 0 is that of `self`.
    #[inline(always)]
    #[must_use]
    fn abs(self) -> Self {
        Self::select(self.lt(0.0), -self, self)
    }
    /// The larger of the two; `self` where they are equal.
    #[inline(always)]
    #[must_use]
    fn max(self, other: Self) -> Self {
        Self::select(other.gt(self), other, self)
    }
    /// The smaller of the two; `self` where they are equal.
    #[inline(always)]
    #[must_use]
    fn min(self, other: Self) -> Self {
        Self::select(other.lt(self), other, self)
    }
}

/// What a comparison of [`Scalar`]s gives. Combined by `!`, `&` and `|`, and read by [`Scalar::select`] alone.
///
/// Sealed: `bool` for one number.
pub trait Mask:
    sealed::Sealed + Copy + Debug + Not<Output = Self> + BitAnd<Output = Self> + BitOr<Output = Self> + 'static
{
}

impl Mask for bool {}

/// What one number has and lanes do not: an order, and a plain value.
///
/// Not to be named outside of this crate, so that no residual and no kernel over [`Scalar`] comes to branch on a value.
pub trait Ordered: Scalar<Mask = bool> + PartialOrd {
    /// The plain value, without derivatives.
    fn value(self) -> f64;
}

impl Ordered for f64 {
    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
}

impl Scalar for f64 {
    type Mask = bool;

    #[inline(always)]
    fn select(mask: bool, if_true: f64, if_false: f64) -> f64 {
        if mask { if_true } else { if_false }
    }
    #[inline(always)]
    fn lt(self, other: impl Into<f64>) -> bool {
        self < other.into()
    }
    #[inline(always)]
    fn le(self, other: impl Into<f64>) -> bool {
        self <= other.into()
    }
    #[inline(always)]
    fn sin_cos(self) -> (f64, f64) {
        trig::sin_cos(self)
    }
    #[inline(always)]
    fn sin_cos3(angles: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        trig::sin_cos3(angles)
    }
    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }
    #[inline]
    fn atan2(self, x: f64) -> f64 {
        maths::atan2(self, x)
    }
    #[inline]
    fn exp(self) -> f64 {
        maths::exp(self)
    }
    #[inline]
    fn ln(self) -> f64 {
        maths::ln(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;

    const NUMBERS: [f64; 7] = [f64::NEG_INFINITY, -1.5, -0.0, 0.0, 1.5, f64::INFINITY, f64::NAN];

    /// Each comparison of two numbers, in the order of the operators `<`, `<=`, `>`, `>=`.
    fn compared<S: Scalar>(a: S, b: S) -> [S::Mask; 4] {
        [a.lt(b), a.le(b), a.gt(b), a.ge(b)]
    }

    #[test]
    fn comparisons_are_the_operators_of_the_value() {
        for a in NUMBERS {
            for b in NUMBERS {
                let operators = [a < b, a <= b, a > b, a >= b];
                assert_eq!(compared(a, b), operators, "{a} and {b}");
                // Derivatives that say otherwise are not looked at.
                let dual = |value, slope| Dual { value, derivatives: [slope] };
                assert_eq!(compared(dual(a, 9.0), dual(b, -9.0)), operators, "{a} and {b}");
                assert_eq!(dual(a, 9.0).lt(b), a < b);
            }
        }
    }

    #[test]
    fn masks_are_combined() {
        let inside = |x: f64| x.gt(0.0) & !x.ge(1.0);
        let outside = |x: f64| x.le(0.0) | x.ge(1.0);
        for x in [-1.0, 0.0, 0.5, 1.0, 2.0] {
            assert_eq!(inside(x), x > 0.0 && x < 1.0);
            assert_eq!(outside(x), !inside(x));
        }
    }

    #[test]
    fn what_is_not_selected_does_not_come_through() {
        let (one, nan) =
            (Dual { value: 1.0, derivatives: [2.0] }, Dual { value: f64::NAN, derivatives: [f64::NAN] });
        for taken in [Dual::select(true, one, nan), Dual::select(false, nan, one)] {
            assert_eq!((taken.value, taken.derivatives), (1.0, [2.0]));
        }
        assert!(f64::select(false, 1.0, f64::NAN).is_nan());
    }

    #[test]
    fn magnitude_and_extremes_keep_signs_of_zeros_and_what_is_not_a_number() {
        let bits = |x: f64| x.to_bits();
        assert_eq!(bits(Scalar::abs(-0.0)), bits(-0.0));
        assert_eq!(bits(Scalar::max(-0.0, 0.0)), bits(-0.0));
        assert_eq!(bits(Scalar::min(0.0, -0.0)), bits(0.0));
        assert_eq!((Scalar::max(1.0, f64::NAN), Scalar::min(1.0, f64::NAN)), (1.0, 1.0));
        assert!(Scalar::max(f64::NAN, 1.0).is_nan() && Scalar::abs(f64::NAN).is_nan());
    }

    #[test]
    fn kinks_take_the_derivative_of_the_first() {
        let dual = |value, slope| Dual { value, derivatives: [slope] };
        assert_eq!(dual(0.0, 3.0).abs().derivatives, [3.0]);
        assert_eq!(dual(-0.5, 3.0).abs().derivatives, [-3.0]);
        assert_eq!(dual(2.0, 3.0).max(dual(2.0, 5.0)).derivatives, [3.0]);
        assert_eq!(dual(2.0, 3.0).min(dual(2.0, 5.0)).derivatives, [3.0]);
        assert_eq!(dual(2.0, 3.0).max(dual(2.5, 5.0)).derivatives, [5.0]);
        assert_eq!(dual(2.0, 3.0).min(dual(1.5, 5.0)).derivatives, [5.0]);
    }
}
