//! Dual numbers: a value with its derivatives in `N` directions (forward-mode differentiation).

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::maths;
use crate::scalar::{Scalar, sealed};

/// A value and its derivatives in `N` directions.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// The derivative in each direction.
    pub derivatives: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The value whose derivative is 1 in `direction` and 0 in the others.
    ///
    /// A `direction` of `N` or more gives a constant.
    #[must_use]
    pub fn variable(value: f64, direction: usize) -> Self {
        let mut derivatives = [0.0; N];
        if let Some(d) = derivatives.get_mut(direction) {
            *d = 1.0;
        }
        Self { value, derivatives }
    }

    /// The result of a function of one variable with the given value and slope here.
    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        Self { value, derivatives: self.derivatives.map(|d| d * slope) }
    }

    #[inline(always)]
    fn combine(self, other: Self, value: f64, slope: f64, other_slope: f64) -> Self {
        let mut derivatives = [0.0; N];
        for i in 0..N {
            derivatives[i] = self.derivatives[i] * slope + other.derivatives[i] * other_slope;
        }
        Self { value, derivatives }
    }
}

impl<const N: usize> Default for Dual<N> {
    fn default() -> Self {
        Self::from(0.0)
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    fn from(value: f64) -> Self {
        Self { value, derivatives: [0.0; N] }
    }
}

impl<const N: usize> PartialEq for Dual<N> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<const N: usize> PartialOrd for Dual<N> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.combine(o, self.value + o.value, 1.0, 1.0)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.combine(o, self.value - o.value, 1.0, -1.0)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.combine(o, self.value * o.value, o.value, self.value)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let quotient = self.value / o.value;
        self.combine(o, quotient, 1.0 / o.value, -quotient / o.value)
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: f64) -> Self {
        Self { value: self.value + o, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: f64) -> Self {
        Self { value: self.value - o, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        self.chain(self.value * o, o)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: f64) -> Self {
        self.chain(self.value / o, 1.0 / o)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl<const N: usize> sealed::Sealed for Dual<N> {}

impl<const N: usize> Scalar for Dual<N> {
    fn value(self) -> f64 {
        self.value
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Scalar::sin_cos(self.value);
        (self.chain(sin, cos), self.chain(cos, -sin))
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }

    fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        let (dy, dx) = if square > 0.0 { (x.value / square, -self.value / square) } else { (0.0, 0.0) };
        self.combine(x, maths::atan2(self.value, x.value), dy, dx)
    }

    fn exp(self) -> Self {
        let exp = maths::exp(self.value);
        self.chain(exp, exp)
    }

    fn ln(self) -> Self {
        self.chain(maths::ln(self.value), 1.0 / self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(name: &str, at: f64, f: impl Fn(Dual<1>) -> Dual<1>) {
        let step = 1e-6;
        let value = |x: f64| f(Dual::from(x)).value;
        let numeric = (value(at + step) - value(at - step)) / (2.0 * step);
        let exact = f(Dual::variable(at, 0)).derivatives[0];
        assert!(
            (numeric - exact).abs() < 1e-8 * (1.0 + exact.abs()),
            "{name} at {at}: {exact} is not {numeric}"
        );
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        for at in [0.1, 0.7, 1.9, 3.3] {
            check("sin", at, Scalar::sin);
            check("cos", at, Scalar::cos);
            check("sqrt", at, Scalar::sqrt);
            check("exp", at, Scalar::exp);
            check("ln", at, Scalar::ln);
            check("atan2 y", at, |y| y.atan2(Dual::from(-0.4)));
            check("atan2 x", at, |x| Dual::from(0.8).atan2(x));
            check("quotient", at, |x| (x * x + 1.0) / (x - 7.0) - x / 3.0);
            check("absolute", -at, |x| (x * 2.0).abs() + x.max(Dual::from(0.0)) - x.min(Dual::from(-9.0)));
        }
    }

    #[test]
    fn nothing_is_nan_where_a_norm_is_not_smooth() {
        let x = Dual::<1>::variable(0.0, 0);
        assert_eq!((x * x).sqrt().derivatives, [0.0]);
        assert_eq!(x.atan2(Dual::from(0.0)).derivatives, [0.0]);
    }
}
