//! Vectors, rotations and frames over any [`Scalar`]: the small algebra of the kernels.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::scalar::{Ordered, Scalar};

/// Three numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vec3<S = f64> {
    /// First component.
    pub x: S,
    /// Second component.
    pub y: S,
    /// Third component.
    pub z: S,
}

/// A rotation, as the images of the three axes (the columns of its matrix).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation<S = f64> {
    /// Image of the x axis.
    pub x: Vec3<S>,
    /// Image of the y axis.
    pub y: Vec3<S>,
    /// Image of the z axis.
    pub z: Vec3<S>,
}

/// A rigid transform, most often `world_from_joint`: how a joint's frame lies in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<S = f64> {
    /// Orientation of the frame.
    pub rotation: Rotation<S>,
    /// Position of its origin, in metres.
    pub origin: Vec3<S>,
}

impl<S: Scalar> Vec3<S> {
    /// The vector `(x, y, z)`.
    #[inline(always)]
    pub fn new(x: S, y: S, z: S) -> Self {
        Self { x, y, z }
    }

    /// A constant: its derivatives are 0.
    #[inline(always)]
    #[must_use]
    pub fn constant(v: DVec3) -> Self {
        Self::new(S::from(v.x), S::from(v.y), S::from(v.z))
    }

    /// The zero vector.
    #[inline(always)]
    #[must_use]
    pub fn zero() -> Self {
        Self::new(S::zero(), S::zero(), S::zero())
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> S {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// Vector product.
    #[inline(always)]
    #[must_use]
    pub fn cross(self, o: Self) -> Self {
        Self::new(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }

    /// Euclidean length; its derivative at 0 is 0.
    #[inline(always)]
    pub fn length(self) -> S {
        self.dot(self).sqrt()
    }

    /// Distance to another point; its derivative at 0 is 0.
    #[inline(always)]
    pub fn distance(self, o: Self) -> S {
        (self - o).length()
    }

    /// `if_true` where the mask holds and `if_false` elsewhere: [`Scalar::select`] for each component.
    #[inline(always)]
    #[must_use]
    pub fn select(mask: S::Mask, if_true: Self, if_false: Self) -> Self {
        Self::new(
            S::select(mask, if_true.x, if_false.x),
            S::select(mask, if_true.y, if_false.y),
            S::select(mask, if_true.z, if_false.z),
        )
    }
}

impl<S: Ordered> Vec3<S> {
    /// The plain values: of `f64`, and of [`Dual`](crate::Dual) without its derivatives. What is written over any
    /// [`Scalar`] has none.
    #[inline(always)]
    pub fn value(self) -> DVec3 {
        DVec3::new(self.x.value(), self.y.value(), self.z.value())
    }
}

impl<S> Vec3<S> {
    /// The vector of what a function makes of each component.
    #[inline(always)]
    pub fn map<T>(self, mut f: impl FnMut(S) -> T) -> Vec3<T> {
        Vec3 { x: f(self.x), y: f(self.y), z: f(self.z) }
    }
}

impl<S: Scalar> Add for Vec3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<S: Scalar> AddAssign for Vec3<S> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<S: Scalar> Sub for Vec3<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<S: Scalar> Mul<S> for Vec3<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: S) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

impl<S: Scalar> Neg for Vec3<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<S: Scalar> Rotation<S> {
    /// No rotation.
    #[inline(always)]
    #[must_use]
    pub fn identity() -> Self {
        let (o, i) = (S::zero(), S::one());
        Self { x: Vec3::new(i, o, o), y: Vec3::new(o, i, o), z: Vec3::new(o, o, i) }
    }

    /// The rotation of a unit quaternion `x i + y j + z k + w`.
    #[inline(always)]
    pub fn from_quaternion(x: S, y: S, z: S, w: S) -> Self {
        let (x2, y2, z2) = (x + x, y + y, z + z);
        let (xx, xy, xz) = (x * x2, x * y2, x * z2);
        let (yy, yz, zz) = (y * y2, y * z2, z * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        let i = S::one();
        Self {
            x: Vec3::new(i - (yy + zz), xy + wz, xz - wy),
            y: Vec3::new(xy - wz, i - (xx + zz), yz + wx),
            z: Vec3::new(xz + wy, yz - wx, i - (xx + yy)),
        }
    }

    /// The rotation by `angle` (radians) about a constant unit axis.
    #[inline(always)]
    #[must_use]
    pub fn about(axis: DVec3, angle: S) -> Self {
        let (s, c) = angle.sin_cos();
        let v = S::one() - c;
        let (x, y, z) = (axis.x, axis.y, axis.z);
        Self {
            x: Vec3::new(c + v * (x * x), v * (x * y) + s * z, v * (x * z) - s * y),
            y: Vec3::new(v * (x * y) - s * z, c + v * (y * y), v * (y * z) + s * x),
            z: Vec3::new(v * (x * z) + s * y, v * (y * z) - s * x, c + v * (z * z)),
        }
    }

    /// A constant: its derivatives are 0.
    #[must_use]
    pub fn constant(q: DQuat) -> Self {
        let m = DMat3::from_quat(q);
        Self { x: Vec3::constant(m.x_axis), y: Vec3::constant(m.y_axis), z: Vec3::constant(m.z_axis) }
    }

    /// The vector, rotated.
    #[inline(always)]
    #[must_use]
    pub fn apply(&self, v: Vec3<S>) -> Vec3<S> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// A constant vector, rotated.
    #[inline(always)]
    #[must_use]
    pub fn apply_constant(&self, v: DVec3) -> Vec3<S> {
        self.apply(Vec3::constant(v))
    }

    /// The vector, rotated back.
    #[inline(always)]
    #[must_use]
    pub fn apply_inverse(&self, v: Vec3<S>) -> Vec3<S> {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// `self · other`: `other` is applied first.
    #[inline(always)]
    #[must_use]
    pub fn compose(&self, other: &Self) -> Self {
        Self { x: self.apply(other.x), y: self.apply(other.y), z: self.apply(other.z) }
    }

    /// The rotation back.
    #[inline(always)]
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self {
            x: Vec3::new(self.x.x, self.y.x, self.z.x),
            y: Vec3::new(self.x.y, self.y.y, self.z.y),
            z: Vec3::new(self.x.z, self.y.z, self.z.z),
        }
    }

    /// `self` turned about its own x axis, by an angle's sine and cosine; likewise `turn_y` and `turn_z`.
    #[inline(always)]
    pub(crate) fn turn_x(&mut self, (s, c): (S, S)) {
        (self.y, self.z) = (self.y * c + self.z * s, self.z * c - self.y * s);
    }

    #[inline(always)]
    pub(crate) fn turn_y(&mut self, (s, c): (S, S)) {
        (self.z, self.x) = (self.z * c + self.x * s, self.x * c - self.z * s);
    }

    #[inline(always)]
    pub(crate) fn turn_z(&mut self, (s, c): (S, S)) {
        (self.x, self.y) = (self.x * c + self.y * s, self.y * c - self.x * s);
    }
}

impl Rotation<f64> {
    /// As a quaternion with `w ≥ 0`.
    #[must_use]
    pub fn quaternion(&self) -> DQuat {
        let q =
            DQuat::from_mat3(&DMat3::from_cols(self.x.value(), self.y.value(), self.z.value())).normalize();
        if q.w < 0.0 { -q } else { q }
    }
}

impl<S: Scalar> Frame<S> {
    /// The world's own frame.
    #[inline(always)]
    #[must_use]
    pub fn identity() -> Self {
        Self { rotation: Rotation::identity(), origin: Vec3::zero() }
    }

    /// A constant: its derivatives are 0.
    #[inline(always)]
    #[must_use]
    pub fn constant(frame: &Frame<f64>) -> Self {
        frame.map(S::from)
    }

    /// Where a point given in this frame lies in the world.
    #[inline(always)]
    #[must_use]
    pub fn point(&self, point_in_frame: Vec3<S>) -> Vec3<S> {
        self.origin + self.rotation.apply(point_in_frame)
    }

    /// `self · other`: the frame that `other` is, seen from where `self` is given.
    #[inline(always)]
    #[must_use]
    pub fn compose(&self, other: &Self) -> Self {
        Self { rotation: self.rotation.compose(&other.rotation), origin: self.point(other.origin) }
    }

    /// The transform back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { rotation: self.rotation.inverse(), origin: -self.rotation.apply_inverse(self.origin) }
    }
}

impl<S: Copy> Frame<S> {
    /// The frame of what a function makes of each number: columns of the rotation first, then the origin.
    #[inline(always)]
    pub fn map<T>(&self, mut f: impl FnMut(S) -> T) -> Frame<T> {
        let r = &self.rotation;
        Frame {
            rotation: Rotation { x: r.x.map(&mut f), y: r.y.map(&mut f), z: r.z.map(&mut f) },
            origin: self.origin.map(f),
        }
    }
}

impl Frame<f64> {
    /// From a unit quaternion and a translation.
    #[must_use]
    pub fn new(rotation: DQuat, origin: DVec3) -> Self {
        Self { rotation: Rotation::constant(rotation), origin: Vec3::constant(origin) }
    }
}

impl From<Vec3<f64>> for DVec3 {
    #[inline(always)]
    fn from(v: Vec3<f64>) -> Self {
        v.value()
    }
}

impl From<DVec3> for Vec3<f64> {
    #[inline(always)]
    fn from(v: DVec3) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<Frame<f64>> for DAffine3 {
    fn from(f: Frame<f64>) -> Self {
        DAffine3 {
            matrix3: DMat3::from_cols(f.rotation.x.value(), f.rotation.y.value(), f.rotation.z.value()),
            translation: f.origin.value(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_agree_with_glam() {
        let axis = DVec3::new(0.3, -0.8, 0.5).normalize();
        let q = DQuat::from_axis_angle(axis, 1.234);
        let v = DVec3::new(0.2, 0.9, -1.1);
        for r in [
            Rotation::about(axis, 1.234),
            Rotation::from_quaternion(q.x, q.y, q.z, q.w),
            Rotation::constant(q),
        ] {
            assert!((r.apply(v.into()).value() - q * v).length() < 1e-15);
            assert!((r.apply_inverse(v.into()).value() - q.inverse() * v).length() < 1e-15);
            assert!(r.compose(&r.inverse()).apply(v.into()).distance(v.into()) < 1e-15);
            assert!(r.quaternion().dot(q).abs() > 1.0 - 1e-15);
        }
        let mut turned = Rotation::identity();
        turned.turn_z(Scalar::sin_cos(0.3));
        turned.turn_y(Scalar::sin_cos(-0.5));
        turned.turn_x(Scalar::sin_cos(0.7));
        let q = DQuat::from_rotation_z(0.3) * DQuat::from_rotation_y(-0.5) * DQuat::from_rotation_x(0.7);
        assert!((turned.apply(v.into()).value() - q * v).length() < 1e-15);
        let frame = Frame::new(q, v);
        assert!(frame.compose(&frame.inverse()).origin.length() < 1e-15);
    }
}
