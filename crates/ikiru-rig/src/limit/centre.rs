//! The centre of a cone: where its middle lies in the parent and in the joint, whatever the rest pose is.

use glam::DQuat;

use super::cone_error::ConeError;
use crate::maths;

/// Where the middle of a [`Cone`](super::Cone) lies: two constant rotations, P and K. The limit then holds for
/// `L = P⁻¹ · (rest · q) · K`, where `rest · q` is parent from joint.
///
/// So it does not depend on the rest pose: of a joint that rests elsewhere, and of one whose own axes are turned where K is
/// turned with them, it allows the same. A cone without a centre is one about the rest pose, `L = q`: it has the rest rotation for P
/// and the identity for K. A rotation that is not given is the identity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConeCentre {
    /// P, parent from cone: where the cone's own axes point in the frame of the joint's parent.
    pub parent_rotation: DQuat,
    /// K, joint from cone: where they point in the joint's frame.
    pub joint_rotation: DQuat,
}

impl ConeCentre {
    /// With unit quaternions; an error where one has no direction.
    fn normalised(&self) -> Result<Self, ConeError> {
        let unit = |name, q: DQuat| maths::unit_quaternion(q).ok_or(ConeError::Centre(name, q.to_array()));
        Ok(Self {
            parent_rotation: unit("parent_rotation", self.parent_rotation)?,
            joint_rotation: unit("joint_rotation", self.joint_rotation)?,
        })
    }
}

/// A centre with the rest rotation of the joint folded in: `L = A · q · K` with `A = P⁻¹ · rest`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Folded {
    pub(super) centre: ConeCentre,
    before: DQuat,
}

impl Folded {
    /// Of a joint that rests at the identity.
    pub(super) fn new(centre: &ConeCentre) -> Result<Self, ConeError> {
        Ok(Self::of(centre.normalised()?, DQuat::IDENTITY))
    }

    /// Of a centre with unit rotations, and a joint that rests elsewhere.
    pub(super) fn of(centre: ConeCentre, rest: DQuat) -> Self {
        // What a rig accepts as a unit quaternion may be off by 1e-6.
        Self { centre, before: (centre.parent_rotation.conjugate() * rest).normalize() }
    }

    /// L of a joint's rotation.
    pub(super) fn enter(&self, q: DQuat) -> DQuat {
        self.before * q * self.centre.joint_rotation
    }

    /// The joint's rotation of L.
    pub(super) fn leave(&self, l: DQuat) -> DQuat {
        (self.before.conjugate() * l * self.centre.joint_rotation.conjugate()).normalize()
    }

    /// From the tangent space of L to that of the joint's rotation: `q · exp(K ω)` has the L of `L · exp(ω)`.
    pub(super) fn tangent_from_cone(&self) -> DQuat {
        self.centre.joint_rotation
    }
}
