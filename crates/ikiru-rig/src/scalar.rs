//! The numbers that kernels are written over: plain `f64`, or dual numbers that carry derivatives.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::{maths, trig};

pub(crate) mod sealed {
    pub trait Sealed {}
    impl Sealed for f64 {}
}

/// A number that a kernel or a custom residual computes with.
///
/// Sealed: implemented by `f64` and by [`Dual`](crate::Dual). One source then gives values and exact
/// derivatives. Comparisons look at the value alone.
pub trait Scalar:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialOrd
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
    /// The plain value, without derivatives.
    fn value(self) -> f64;
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
    #[must_use]
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }
    /// The larger of the two; `self` where they are equal.
    #[must_use]
    fn max(self, other: Self) -> Self {
        if other > self { other } else { self }
    }
    /// The smaller of the two; `self` where they are equal.
    #[must_use]
    fn min(self, other: Self) -> Self {
        if other < self { other } else { self }
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn value(self) -> f64 {
        self
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
