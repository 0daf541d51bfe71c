//! Dual numbers: a value with its derivatives in `N` directions (forward-mode differentiation).

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::lanes::LaneScalar;
use crate::scalar::{Ordered, Scalar, sealed};

/// A value and its derivatives in `N` directions: plain numbers, or [`Lanes`](crate::Lanes) of them.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize, S = f64> {
    /// The value.
    pub value: S,
    /// The derivative in each direction.
    pub derivatives: [S; N],
}

impl<const N: usize, S: Scalar> Dual<N, S> {
    /// The value whose derivative is 1 in `direction` and 0 in the others.
    ///
    /// A `direction` of `N` or more gives a constant.
    #[must_use]
    pub fn variable(value: S, direction: usize) -> Self {
        let mut derivatives = [S::zero(); N];
        if let Some(d) = derivatives.get_mut(direction) {
            *d = S::one();
        }
        Self { value, derivatives }
    }

    /// The result of a function of one variable with the given value and slope here.
    #[inline(always)]
    fn chain(self, value: S, slope: S) -> Self {
        let mut derivatives = self.derivatives;
        for derivative in &mut derivatives {
            *derivative = *derivative * slope;
        }
        Self { value, derivatives }
    }

    #[inline(always)]
    fn combine(self, other: Self, value: S, slope: S, other_slope: S) -> Self {
        let mut derivatives = [S::zero(); N];
        for i in 0..N {
            derivatives[i] = self.derivatives[i] * slope + other.derivatives[i] * other_slope;
        }
        Self { value, derivatives }
    }
}

impl<const N: usize, S: Scalar> Default for Dual<N, S> {
    fn default() -> Self {
        Self::from(0.0)
    }
}

impl<const N: usize, S: Scalar> From<f64> for Dual<N, S> {
    fn from(value: f64) -> Self {
        Self { value: S::from(value), derivatives: [S::zero(); N] }
    }
}

impl<const N: usize, S: PartialEq> PartialEq for Dual<N, S> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<const N: usize, S: PartialOrd> PartialOrd for Dual<N, S> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<const N: usize, S: Scalar> Add for Dual<N, S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.combine(o, self.value + o.value, S::one(), S::one())
    }
}

impl<const N: usize, S: Scalar> Sub for Dual<N, S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.combine(o, self.value - o.value, S::one(), -S::one())
    }
}

impl<const N: usize, S: Scalar> Mul for Dual<N, S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.combine(o, self.value * o.value, o.value, self.value)
    }
}

impl<const N: usize, S: Scalar> Div for Dual<N, S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let quotient = self.value / o.value;
        self.combine(o, quotient, S::one() / o.value, -quotient / o.value)
    }
}

impl<const N: usize, S: Scalar> Add<f64> for Dual<N, S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: f64) -> Self {
        Self { value: self.value + o, ..self }
    }
}

impl<const N: usize, S: Scalar> Sub<f64> for Dual<N, S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: f64) -> Self {
        Self { value: self.value - o, ..self }
    }
}

impl<const N: usize, S: Scalar> Mul<f64> for Dual<N, S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        self.chain(self.value * o, S::from(o))
    }
}

impl<const N: usize, S: Scalar> Div<f64> for Dual<N, S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: f64) -> Self {
        self.chain(self.value / o, S::from(1.0 / o))
    }
}

impl<const N: usize, S: Scalar> Neg for Dual<N, S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, -S::one())
    }
}

impl<const N: usize, S: Scalar> AddAssign for Dual<N, S> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<const N: usize, S: Scalar> SubAssign for Dual<N, S> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl<const N: usize, S: Scalar> sealed::Sealed for Dual<N, S> {}

impl<const N: usize, S: Scalar> Scalar for Dual<N, S> {
    type Mask = S::Mask;

    #[inline(always)]
    fn select(mask: S::Mask, if_true: Self, if_false: Self) -> Self {
        Self {
            value: S::select(mask, if_true.value, if_false.value),
            derivatives: std::array::from_fn(|i| {
                S::select(mask, if_true.derivatives[i], if_false.derivatives[i])
            }),
        }
    }

    #[inline(always)]
    fn lt(self, other: impl Into<Self>) -> S::Mask {
        self.value.lt(other.into().value)
    }

    #[inline(always)]
    fn le(self, other: impl Into<Self>) -> S::Mask {
        self.value.le(other.into().value)
    }

    /// A slope is selected, rather than each derivative.
    #[inline(always)]
    fn abs(self) -> Self {
        self.chain(self.value.abs(), S::select(self.value.lt(0.0), -S::one(), S::one()))
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, S::select(root.gt(0.0), S::from(0.5) / root, S::zero()))
    }

    fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        let is_off_origin = square.gt(0.0);
        let dy = S::select(is_off_origin, x.value / square, S::zero());
        let dx = S::select(is_off_origin, -self.value / square, S::zero());
        self.combine(x, self.value.atan2(x.value), dy, dx)
    }

    fn exp(self) -> Self {
        let exp = self.value.exp();
        self.chain(exp, exp)
    }

    fn ln(self) -> Self {
        self.chain(self.value.ln(), S::one() / self.value)
    }
}

impl<const N: usize> Ordered for Dual<N> {
    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }
}

impl<const N: usize, const M: usize, S: LaneScalar<M>> LaneScalar<M> for Dual<N, S> {
    type Lane = Dual<N, S::Lane>;

    #[inline(always)]
    fn gather(values: [f64; M]) -> Self {
        Self { value: S::gather(values), derivatives: [S::zero(); N] }
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> Self::Lane {
        Dual { value: self.value.lane(lane), derivatives: self.derivatives.map(|d| d.lane(lane)) }
    }

    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: Self::Lane) {
        self.value.set_lane(lane, value.value);
        for (derivative, of_lane) in self.derivatives.iter_mut().zip(value.derivatives) {
            derivative.set_lane(lane, of_lane);
        }
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
