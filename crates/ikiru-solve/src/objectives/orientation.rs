//! Orientation: the rotation of a joint's frame in the world.

use glam::{DQuat, DVec3};
use ikiru_rig::{Frame, JointId, Rotation, Vec3, rotation_vector};

use crate::objective::{Objective, Part, Reads, Rows, Unfit, UnfitReason, View};
use crate::objectives::angles::inverse_right_jacobian;
use crate::words::Unit;

/// Turns a joint's frame to a rotation of the world.
///
/// Residual: the rotation vector `log(target⁻¹ · R)`, 3 rows in radians; its length is the angle between the
/// two. At an angle of π, where two rotation vectors are as short, the one whose quaternion the
/// conversion gives is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// The joint to turn.
    pub joint: JointId,
    /// `world_from_joint`'s rotation as it should be; any length but 0.
    pub target: DQuat,
}

impl Orientation {
    /// The joint's frame at `target`.
    #[must_use]
    pub fn new(joint: JointId, target: DQuat) -> Self {
        Self { joint, target }
    }
}

impl Objective for Orientation {
    fn kind(&self) -> &'static str {
        "orientation"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.part(Part::new(3, Unit::Radians))
    }

    fn check(&self) -> Result<(), Unfit> {
        check_rotation(self.target)
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        evaluate_orientation(view.frame(0), self.target, 0, rows);
    }
}

pub(super) fn check_rotation(rotation: DQuat) -> Result<(), Unfit> {
    let length = rotation.length();
    if length.is_finite() && length > 1e-100 { Ok(()) } else { Err(UnfitReason::Rotation.into()) }
}

/// Three rows of a part: the rotation vector from the target to the frame, in the target's axes.
#[inline(always)]
pub(super) fn evaluate_orientation(frame: &Frame<f64>, target: DQuat, part: usize, rows: &mut Rows<'_>) {
    let target = Rotation::<f64>::constant(target.normalize());
    let error = target.inverse().compose(&frame.rotation);
    let phi = rotation_vector(error.quaternion());
    let first = rows.open(part, phi.to_array());
    if rows.wants_jacobian() {
        // The frame turns to exp(ω) R, so the error to error · exp(Rᵀ ω).
        let inverse = inverse_right_jacobian(phi);
        for row in 0..3 {
            let by_body: DVec3 = inverse.row(row);
            let by_world = frame.rotation.apply(Vec3::from(by_body)).value();
            rows.by_frame(first + row, 0)[3..].copy_from_slice(&by_world.to_array());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::check_on_random_rigs;

    #[test]
    fn derivatives() {
        check_on_random_rigs(|joints, random| Orientation { joint: joints[0], target: random.rotation() });
    }

    #[test]
    fn a_rotation_without_length_is_refused() {
        let zero = Orientation::new(JointId::from_index(0), DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0));
        assert!(zero.check().is_err());
        assert!(Orientation { target: DQuat::NAN, ..zero }.check().is_err());
        assert!(Orientation { target: DQuat::from_xyzw(0.0, 0.0, 3.0, 4.0), ..zero }.check().is_ok());
    }
}
