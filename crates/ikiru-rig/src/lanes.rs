//! Lanes: the numbers of many problems side by side, so that one pass over a kernel or a residual computes them all.

use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use crate::scalar::{Mask, Scalar, sealed};

/// `N` numbers side by side, a *lane* each: the same quantity of `N` problems.
///
/// Each lane is computed as a plain `f64` would be, and comes out the same to the bit. Loops over lanes have a length that
/// the compiler knows. There is no plain value and no order, as everywhere behind [`Scalar`].
///
/// ```
/// use ikiru_rig::{LaneScalar, Lanes, Scalar};
///
/// let x = Lanes([-2.0, 0.5, 3.0]);
/// let clipped = Lanes::select(x.gt(1.0), Lanes::one(), x.abs());
/// assert_eq!(clipped.0, [2.0, 0.5, 1.0]);
/// assert_eq!(clipped.lane(1), 0.5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Lanes<const N: usize>(
    /// The number of each lane.
    pub [f64; N],
);

/// Which lanes a comparison holds in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaneMask<const N: usize>([bool; N]);

/// A [`Scalar`] of `N` lanes: [`Lanes`], and [`Dual`](crate::Dual) numbers over them.
pub trait LaneScalar<const N: usize>: Scalar {
    /// What stands in one lane.
    type Lane: Scalar;

    /// A constant that may differ from lane to lane, as a target does; its derivatives are 0.
    #[must_use]
    fn gather(values: [f64; N]) -> Self;

    /// The number of one lane.
    ///
    /// # Panics
    /// When `lane` is `N` or more.
    fn lane(&self, lane: usize) -> Self::Lane;

    /// Puts a number into one lane.
    ///
    /// # Panics
    /// When `lane` is `N` or more.
    fn set_lane(&mut self, lane: usize, value: Self::Lane);
}

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(f64, f64) -> bool) -> LaneMask<N> {
        LaneMask(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl<const N: usize> LaneScalar<N> for Lanes<N> {
    type Lane = f64;

    #[inline(always)]
    fn gather(values: [f64; N]) -> Self {
        Self(values)
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> f64 {
        self.0[lane]
    }

    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: f64) {
        self.0[lane] = value;
    }
}

impl<const N: usize> sealed::Sealed for Lanes<N> {}

impl<const N: usize> Scalar for Lanes<N> {
    type Mask = LaneMask<N>;

    #[inline(always)]
    fn select(mask: LaneMask<N>, if_true: Self, if_false: Self) -> Self {
        Self(std::array::from_fn(|i| f64::select(mask.0[i], if_true.0[i], if_false.0[i])))
    }

    #[inline(always)]
    fn lt(self, other: impl Into<Self>) -> LaneMask<N> {
        self.compare(other.into(), |a, b| a < b)
    }

    #[inline(always)]
    fn le(self, other: impl Into<Self>) -> LaneMask<N> {
        self.compare(other.into(), |a, b| a <= b)
    }

    fn sin_cos(self) -> (Self, Self) {
        let both = self.0.map(Scalar::sin_cos);
        (Self(both.map(|b| b.0)), Self(both.map(|b| b.1)))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    fn atan2(self, x: Self) -> Self {
        self.zip(x, Scalar::atan2)
    }

    fn exp(self) -> Self {
        Self(self.0.map(Scalar::exp))
    }

    fn ln(self) -> Self {
        Self(self.0.map(Scalar::ln))
    }
}

impl<const N: usize> sealed::Sealed for LaneMask<N> {}

impl<const N: usize> Mask for LaneMask<N> {}

impl<const N: usize> Not for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|holds| !holds))
    }
}

impl<const N: usize> BitAnd for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] & o.0[i]))
    }
}

impl<const N: usize> BitOr for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] | o.0[i]))
    }
}

impl<const N: usize> Default for Lanes<N> {
    #[inline(always)]
    fn default() -> Self {
        Self::from(0.0)
    }
}

impl<const N: usize> From<f64> for Lanes<N> {
    /// One number in every lane.
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self([value; N])
    }
}

/// The operators of `f64`, lane by lane: with other lanes, and with one number for all of them.
macro_rules! lane_by_lane {
    ($($operator:ident $method:ident),*) => {$(
        impl<const N: usize> $operator for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.zip(o, $operator::$method)
            }
        }

        impl<const N: usize> $operator<f64> for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: f64) -> Self {
                Self(self.0.map(|a| $operator::$method(a, o)))
            }
        }
    )*};
}

lane_by_lane!(Add add, Sub sub, Mul mul, Div div);

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(Neg::neg))
    }
}

impl<const N: usize> AddAssign for Lanes<N> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<const N: usize> SubAssign for Lanes<N> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;

    /// Every function and operator of [`Scalar`], once.
    fn everything<S: Scalar>(a: S, b: S) -> Vec<S> {
        let mut sum = a;
        sum += b;
        let mut rest = a;
        rest -= b;
        let (sin, cos) = a.sin_cos();
        let three = S::sin_cos3([a, b, a * b]);
        let mut all = vec![sum, rest, a + b, a - b, a * b, a / b, a + 0.3, a - 0.3, a * 0.3, a / 0.3, -a];
        all.extend([sin, cos, a.sin(), a.cos(), a.sqrt(), a.atan2(b), a.exp(), a.ln()]);
        all.extend(three.0.into_iter().chain(three.1));
        all.extend([a.abs(), a.max(b), a.min(b), S::zero(), S::one(), S::default(), S::from(0.7)]);
        let masks = [
            a.lt(b),
            a.le(b),
            a.gt(b),
            a.ge(b),
            a.lt(0.5),
            !a.lt(b),
            a.lt(b) & b.lt(1.0),
            a.lt(b) | b.lt(1.0),
        ];
        all.extend(masks.map(|mask| S::select(mask, a, b)));
        all
    }

    fn same(a: f64, b: f64) -> bool {
        a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
    }

    const A: [f64; 8] = [0.0, -0.0, 1.5, -1.5, 0.4, f64::NAN, f64::INFINITY, 3e7];
    const B: [f64; 8] = [0.0, 0.0, 1.5, 0.25, -7.0, 1.0, 2.0, -1e-9];

    #[test]
    fn a_lane_is_a_plain_number_to_the_bit() {
        let all = everything(Lanes(A), Lanes(B));
        for lane in 0..8 {
            for (i, (lanes, alone)) in all.iter().zip(everything(A[lane], B[lane])).enumerate() {
                assert!(same(lanes.lane(lane), alone), "result {i}, lane {lane}: {lanes:?} is not {alone}");
            }
        }
    }

    #[test]
    fn a_lane_of_dual_numbers_is_a_dual_number_to_the_bit() {
        let mut dual = [Dual::<2, Lanes<8>>::gather(A), Dual::gather(B)];
        let alone = |lane: usize| {
            // Different derivatives in every lane.
            let slope = 1.0 + lane as f64;
            [
                Dual { value: A[lane], derivatives: [slope, 0.3] },
                Dual { value: B[lane], derivatives: [-0.7, 1.0 / slope] },
            ]
        };
        for lane in 0..8 {
            assert_eq!(dual[0].lane(lane).derivatives, [0.0; 2]);
            for (dual, alone) in dual.iter_mut().zip(alone(lane)) {
                dual.set_lane(lane, alone);
            }
        }
        let all = everything(dual[0], dual[1]);
        for lane in 0..8 {
            let [a, b] = alone(lane);
            for (i, (lanes, alone)) in all.iter().zip(everything(a, b)).enumerate() {
                let lanes = lanes.lane(lane);
                let is_same = same(lanes.value, alone.value)
                    && (0..2).all(|k| same(lanes.derivatives[k], alone.derivatives[k]));
                assert!(is_same, "result {i}, lane {lane}: {lanes:?} is not {alone:?}");
            }
        }
    }
}
