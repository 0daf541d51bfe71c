//! Relative pose: how one joint's frame lies in another's.

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, Rotation, Vec3, rotation_vector};

use crate::objective::{Objective, Part, Reads, Rows, Unfit, View};
use crate::objectives::angles::inverse_right_jacobian;
use crate::objectives::orientation::check_rotation;
use crate::objectives::position::check_target;
use crate::words::Unit;

/// Holds one joint's frame at a place and rotation of another's: both hands on one box, a hand on the hip.
///
/// Residual: `R_baseᵀ (origin − origin_base) − position`, 3 rows in metres, then `log(rotation⁻¹ R_baseᵀ R)`,
/// 3 rows in radians; what is `None` is left out. The loss and a tolerance hold for each part alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePose {
    /// The joint whose frame the other is seen from, then the joint to hold.
    pub joints: [JointId; 2],
    /// Where the second joint's origin should be, in the first's frame (metres).
    pub position: Option<DVec3>,
    /// How the second joint's frame should be turned in the first's; any length but 0.
    pub rotation: Option<DQuat>,
}

impl RelativePose {
    /// `joint` at `position` and `rotation` of `base`.
    #[must_use]
    pub fn new(base: JointId, joint: JointId, position: Option<DVec3>, rotation: Option<DQuat>) -> Self {
        Self { joints: [base, joint], position, rotation }
    }
}

impl Objective for RelativePose {
    fn kind(&self) -> &'static str {
        "relative_pose"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frames(&self.joints)?;
        if self.position.is_some() {
            reads.part(Part::new(3, Unit::Metres))?;
        }
        if self.rotation.is_some() {
            reads.part(Part::new(3, Unit::Radians))?;
        }
        Ok(())
    }

    fn check(&self) -> Result<(), Unfit> {
        self.position.map_or(Ok(()), check_target)?;
        self.rotation.map_or(Ok(()), check_rotation)
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let (base, frame) = (view.frame(0), view.frame(1));
        if let Some(position) = self.position {
            let apart = frame.origin - base.origin;
            let seen = base.rotation.apply_inverse(apart).value() - position;
            let first = rows.open(0, seen.to_array());
            if rows.wants_jacobian() {
                let axes = [base.rotation.x, base.rotation.y, base.rotation.z];
                for (row, axis) in axes.into_iter().enumerate() {
                    // axis · (v − v_base − ω_base × apart)
                    let by_turn = axis.cross(apart).value();
                    let axis = axis.value();
                    rows.by_frame(first + row, 0)[..3].copy_from_slice(&(-axis).to_array());
                    rows.by_frame(first + row, 0)[3..].copy_from_slice(&by_turn.to_array());
                    rows.by_frame(first + row, 1)[..3].copy_from_slice(&axis.to_array());
                }
            }
        }
        if let Some(rotation) = self.rotation {
            let wanted = Rotation::<f64>::constant(rotation.normalize());
            let seen = base.rotation.inverse().compose(&frame.rotation);
            let phi = rotation_vector(wanted.inverse().compose(&seen).quaternion());
            let first = rows.open(usize::from(self.position.is_some()), phi.to_array());
            if rows.wants_jacobian() {
                let inverse = inverse_right_jacobian(phi);
                for row in 0..3 {
                    let by_world = frame.rotation.apply(Vec3::from(inverse.row(row))).value();
                    rows.by_frame(first + row, 0)[3..].copy_from_slice(&(-by_world).to_array());
                    rows.by_frame(first + row, 1)[3..].copy_from_slice(&by_world.to_array());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::check_on_random_rigs;

    #[test]
    fn derivatives() {
        check_on_random_rigs(|joints, random| {
            let position = (random.below(3) > 0).then(|| random.vector(0.5));
            let rotation = (random.below(3) > 0).then(|| random.rotation());
            RelativePose::new(joints[0], joints[1], position, rotation)
        });
    }
}
