//! What a joint is: its place in the tree, its rest transform, and how it moves.

use glam::{DQuat, DVec3};

use crate::humanoid::Role;
use crate::limit::{Cone, Range};
use crate::maths;

/// A joint of one rig: its position in the list of joints, parents first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct JointId(pub(crate) u32);

impl JointId {
    /// The joint at a position in the list.
    #[must_use]
    pub fn from_index(idx: usize) -> Self {
        Self(u32::try_from(idx).unwrap_or(u32::MAX))
    }

    /// The position in the list.
    #[inline(always)]
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The order of the three elementary rotations of an Euler joint: `Zyx` is `R = Rz · Ry · Rx`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum EulerOrder {
    /// `Rx · Ry · Rz`
    Xyz,
    /// `Rx · Rz · Ry`
    Xzy,
    /// `Ry · Rx · Rz`
    Yxz,
    /// `Ry · Rz · Rx`
    Yzx,
    /// `Rz · Rx · Ry`
    Zxy,
    /// `Rz · Ry · Rx`: the paper's (equation 5)
    #[default]
    Zyx,
}

impl EulerOrder {
    /// All six.
    pub const ALL: [Self; 6] = [Self::Xyz, Self::Xzy, Self::Yxz, Self::Yzx, Self::Zxy, Self::Zyx];

    /// The axes (0 = x) from left to right.
    #[inline(always)]
    #[must_use]
    pub fn axes(self) -> [usize; 3] {
        match self {
            Self::Xyz => [0, 1, 2],
            Self::Xzy => [0, 2, 1],
            Self::Yxz => [1, 0, 2],
            Self::Yzx => [1, 2, 0],
            Self::Zxy => [2, 0, 1],
            Self::Zyx => [2, 1, 0],
        }
    }

    /// The rotation of three angles, given as (x, y, z) in radians.
    #[must_use]
    pub fn quaternion(self, angles: [f64; 3]) -> DQuat {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        self.axes()
            .into_iter()
            .map(|axis| maths::turn_about(axes[axis], angles[axis]))
            .fold(DQuat::IDENTITY, |q, turn| q * turn)
    }

    /// The angles (x, y, z) of a rotation, the middle one in `[−π/2, π/2]`. Where the middle one is ±π/2
    /// (gimbal lock) the last is 0.
    #[must_use]
    pub fn angles(self, q: DQuat) -> [f64; 3] {
        let [i, j, k] = self.axes();
        let sign = if (j + 3 - i) % 3 == 1 { 1.0 } else { -1.0 };
        let m = glam::DMat3::from_quat(q).to_cols_array_2d(); // m[column][row]
        let mut angles = [0.0; 3];
        let sin_middle = (sign * m[k][i]).clamp(-1.0, 1.0);
        let cos_middle = maths::hypot(m[i][i], m[j][i]);
        angles[j] = maths::atan2(sin_middle, cos_middle);
        if cos_middle > 1e-9 {
            angles[i] = maths::atan2(-sign * m[k][j], m[k][k]);
            angles[k] = maths::atan2(-sign * m[j][i], m[i][i]);
        } else {
            angles[i] = maths::atan2(sign * m[j][k], m[j][j]);
        }
        angles
    }

    /// Of the angles that give a rotation those nearest to `previous`, whole turns included: what lies between
    /// two keys then goes the short way.
    #[must_use]
    pub fn angles_near(self, q: DQuat, previous: [f64; 3]) -> [f64; 3] {
        use std::f64::consts::{PI, TAU};
        let angles = self.angles(q);
        let [_, middle, _] = self.axes();
        let mut flipped = angles;
        for (axis, angle) in flipped.iter_mut().enumerate() {
            *angle = if axis == middle { PI - *angle } else { *angle + PI };
        }
        let near = |mut angles: [f64; 3]| {
            let mut distance = 0.0;
            for (angle, previous) in angles.iter_mut().zip(previous) {
                *angle -= TAU * ((*angle - previous) / TAU).round();
                distance += (*angle - previous).powi(2);
            }
            (distance, angles)
        };
        let (a, b) = (near(angles), near(flipped));
        if a.0 <= b.0 { a.1 } else { b.1 }
    }
}

/// How a joint moves on top of its rest transform, with the limits of that motion.
///
/// A new variant will be a new major version: whoever matches, matches all of them.
// Not `non_exhaustive`: other crates of the project would then need the `_` arm that CONTRIBUTING forbids, and the compiler
// would no longer show them what a new way to move asks of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum JointMotion {
    /// It does not move.
    #[default]
    Fixed,
    /// A rotation about a unit axis of the joint's frame.
    Hinge {
        /// Unit axis.
        axis: DVec3,
        /// Range of the angle, radians.
        range: Range,
    },
    /// A translation along a unit axis of the joint's frame.
    Slider {
        /// Unit axis.
        axis: DVec3,
        /// Range of the offset, metres.
        range: Range,
    },
    /// Three angles about the axes of the joint's frame.
    Euler {
        /// Order of the elementary rotations.
        order: EulerOrder,
        /// Ranges of the angles (x, y, z), radians.
        ranges: [Range; 3],
    },
    /// Any rotation, as a unit quaternion.
    Ball {
        /// Limit of the rotation.
        cone: Option<Cone>,
    },
    /// A translation, then any rotation about the moved origin: a root that floats.
    Free {
        /// Limit of the rotation.
        cone: Option<Cone>,
    },
}

impl JointMotion {
    /// A ball joint without limits.
    pub const BALL: Self = Self::Ball { cone: None };
    /// A floating root without limits.
    pub const FREE: Self = Self::Free { cone: None };

    /// How many numbers describe it: a ball has 4 (a quaternion), a free joint 7.
    #[must_use]
    pub fn n_coords(&self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Hinge { .. } | Self::Slider { .. } => 1,
            Self::Euler { .. } => 3,
            Self::Ball { .. } => 4,
            Self::Free { .. } => 7,
        }
    }

    /// How many directions it can move in: a ball has 3, a free joint 6.
    #[must_use]
    pub fn n_dofs(&self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Hinge { .. } | Self::Slider { .. } => 1,
            Self::Euler { .. } | Self::Ball { .. } => 3,
            Self::Free { .. } => 6,
        }
    }

    /// How many of those, the first ones, move along an axis rather than turning about it.
    #[must_use]
    pub fn n_translations(&self) -> usize {
        match self {
            Self::Slider { .. } => 1,
            Self::Free { .. } => 3,
            Self::Fixed | Self::Hinge { .. } | Self::Euler { .. } | Self::Ball { .. } => 0,
        }
    }

    /// One lower-case word: `fixed`, `hinge`, `slider`, `euler`, `ball` or `free`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Hinge { .. } => "hinge",
            Self::Slider { .. } => "slider",
            Self::Euler { .. } => "euler",
            Self::Ball { .. } => "ball",
            Self::Free { .. } => "free",
        }
    }

    /// The ranges of its angles or offset; none for balls.
    #[inline(always)]
    #[must_use]
    pub fn ranges(&self) -> &[Range] {
        match self {
            Self::Hinge { range, .. } | Self::Slider { range, .. } => std::slice::from_ref(range),
            Self::Euler { ranges, .. } => ranges,
            Self::Fixed | Self::Ball { .. } | Self::Free { .. } => &[],
        }
    }

    /// The cone that limits its rotation.
    #[must_use]
    pub fn cone(&self) -> Option<&Cone> {
        match self {
            Self::Ball { cone } | Self::Free { cone } => cone.as_ref(),
            Self::Fixed | Self::Hinge { .. } | Self::Slider { .. } | Self::Euler { .. } => None,
        }
    }

    /// This motion of a joint of that rest rotation, from which its cone counts what its centre does not say.
    pub(crate) fn at_rest(self, rest: DQuat) -> Self {
        match self {
            Self::Ball { cone } => Self::Ball { cone: cone.map(|cone| cone.at_rest(rest)) },
            Self::Free { cone } => Self::Free { cone: cone.map(|cone| cone.at_rest(rest)) },
            Self::Fixed | Self::Hinge { .. } | Self::Slider { .. } | Self::Euler { .. } => self,
        }
    }

    pub(crate) fn is_scalar(&self) -> bool {
        matches!(self, Self::Hinge { .. } | Self::Slider { .. })
    }
}

/// A joint that follows another: its value is `multiplier · leader + offset` (URDF's mimic).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mimic {
    /// The joint that it follows, a hinge or slider that does not follow itself.
    pub leader: JointId,
    /// Factor on the leader's value.
    pub multiplier: f64,
    /// Added, in radians or metres.
    pub offset: f64,
}

/// A joint: a node of the tree, with the transform to its parent.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Unique in the rig.
    pub name: String,
    /// Other names that it answers to (a URDF joint: its child link).
    pub aliases: Vec<String>,
    /// The parent, which stands earlier in the list; `None` for a root.
    pub parent: Option<JointId>,
    /// Rotation of `parent_from_joint` at rest, a unit quaternion.
    pub rest_rotation: DQuat,
    /// Translation of `parent_from_joint` at rest, metres.
    pub rest_translation: DVec3,
    /// How it moves.
    pub motion: JointMotion,
    /// The joint that it follows.
    pub mimic: Option<Mimic>,
    /// The humanoid bone that it is.
    pub role: Option<Role>,
}

impl Joint {
    /// A fixed joint that coincides with its parent; set the fields that differ.
    #[must_use]
    pub fn new(name: impl Into<String>, parent: Option<JointId>) -> Self {
        Self {
            name: name.into(),
            aliases: Vec::new(),
            parent,
            rest_rotation: DQuat::IDENTITY,
            rest_translation: DVec3::ZERO,
            motion: JointMotion::Fixed,
            mimic: None,
            role: None,
        }
    }

    /// Numbers of its own in a pose: none for a joint that follows another.
    #[must_use]
    pub fn n_coords(&self) -> usize {
        if self.mimic.is_some() { 0 } else { self.motion.n_coords() }
    }

    /// Degrees of freedom of its own: none for a joint that follows another.
    #[must_use]
    pub fn n_dofs(&self) -> usize {
        if self.mimic.is_some() { 0 } else { self.motion.n_dofs() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn euler_angles_come_back_as_the_same_rotation(a in prop::array::uniform3(-4.0..4.0f64)) {
            for order in EulerOrder::ALL {
                let q = order.quaternion(a);
                let b = order.angles(q);
                prop_assert!(order.quaternion(b).dot(q).abs() > 1.0 - 1e-12);
                prop_assert!(b[order.axes()[1]].abs() <= std::f64::consts::FRAC_PI_2 + 1e-12);
            }
        }

        #[test]
        fn the_angles_nearest_to_others_give_the_same_rotation(
            a in prop::array::uniform3(-4.0..4.0f64),
            d in prop::array::uniform3(-0.2..0.2f64),
        ) {
            for order in EulerOrder::ALL {
                let b = order.angles_near(order.quaternion(a), std::array::from_fn(|i| a[i] + d[i]));
                prop_assert!(order.quaternion(b).dot(order.quaternion(a)).abs() > 1.0 - 1e-12);
                // They are at most as far as the angles that the rotation was made of.
                let far = |v: [f64; 3]| (0..3).map(|i| (v[i] - a[i] - d[i]).powi(2)).sum::<f64>();
                prop_assert!(far(b) <= far(a) + 1e-9);
            }
        }

        #[test]
        fn gimbal_lock_still_gives_the_rotation(a in -3.0..3.0f64, c in -3.0..3.0f64, up in any::<bool>()) {
            for order in EulerOrder::ALL {
                let [i, j, k] = order.axes();
                let mut angles = [0.0; 3];
                (angles[i], angles[k]) = (a, c);
                angles[j] = if up { 1.0 } else { -1.0 } * std::f64::consts::FRAC_PI_2;
                let q = order.quaternion(angles);
                prop_assert!(order.quaternion(order.angles(q)).dot(q).abs() > 1.0 - 1e-9);
            }
        }
    }
}
