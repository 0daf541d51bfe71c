//! Rest pose: a gentle pull of every joint towards a given pose.

use glam::DQuat;
use ikiru_rig::{JointId, JointMotion, Pose, Rig, difference_joint};

use crate::objective::{Inputs, JointRows, Objective, Part, Rows};
use crate::objectives::known_rotation::turn_residual;

/// Pulls joints towards a pose: what decides between the many poses that reach a target.
///
/// Cost: the squared tangent from the given pose, divided by the number of joints. Residual: that tangent, divided
/// by the root of the number, in radians (metres for sliders and for the translation of a free root).
/// It only shapes the pose: success does not ask for it.
#[derive(Clone, Debug, PartialEq)]
pub struct RestPose {
    joints: Vec<JointId>,
    pose: Pose,
}

impl RestPose {
    /// Pulls `joints` towards where they are in `pose`.
    #[must_use]
    pub fn new(joints: &[JointId], pose: Pose) -> Self {
        Self { joints: joints.to_vec(), pose }
    }

    /// The pose that it pulls to.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// The pose that it pulls to, to change it.
    #[must_use]
    pub fn pose_mut(&mut self) -> &mut Pose {
        &mut self.pose
    }
}

impl Objective for RestPose {
    fn kind(&self) -> &'static str {
        "rest_pose"
    }

    fn joints(&self) -> &[JointId] {
        &[]
    }

    fn parts(&self) -> &[Part] {
        &[]
    }

    fn check(&self) -> Result<(), &'static str> {
        if self.pose.is_valid() { Ok(()) } else { Err("has a pose that is not finite") }
    }

    fn evaluate(&self, _: &Inputs<'_>, _: &mut Rows<'_>) {}

    fn mandatory(&self) -> bool {
        false
    }

    fn joint_rows(&self) -> Option<&dyn JointRows> {
        Some(self)
    }
}

impl JointRows for RestPose {
    fn joints(&self) -> &[JointId] {
        &self.joints
    }

    fn check(&self, rig: &Rig) -> Result<(), &'static str> {
        let own = self.pose.rig();
        let is_same = |joint: &JointId| {
            let kind = |rig: &Rig| rig.get(*joint).map(|joint| std::mem::discriminant(&joint.motion));
            kind(own) == kind(rig) && own.coords_of(*joint) == rig.coords_of(*joint)
        };
        if self.joints.iter().all(is_same) {
            Ok(())
        } else {
            Err("has a pose of another rig than the problem")
        }
    }

    fn evaluate(
        &self,
        idx: usize,
        motion: &JointMotion,
        coords: &[f64],
        residual: &mut [f64],
        mut derivative: Option<&mut [f64]>,
    ) {
        let scale = 1.0 / (self.joints.len() as f64).sqrt();
        let at = self.pose.rig().coords_of(self.joints[idx]);
        let n = residual.len();
        let Some(rest) = self.pose.coords().get(at).filter(|rest| rest.len() == coords.len()) else {
            return; // a pose of another rig: refused when the solve starts
        };
        let translations = match motion {
            JointMotion::Ball { .. } => 0,
            JointMotion::Free { .. } => 3,
            _ => {
                difference_joint(motion, rest, coords, residual);
                n
            }
        };
        if let JointMotion::Free { .. } = motion {
            for i in 0..3 {
                residual[i] = coords[i] - rest[i];
            }
        }
        for i in 0..translations {
            residual[i] *= scale;
            if let Some(derivative) = derivative.as_deref_mut() {
                derivative[i * n + i] = scale;
            }
        }
        if translations < n {
            let target = DQuat::from_slice(&rest[translations..]);
            turn_residual(target, &coords[translations..], scale, residual, derivative, translations);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::check_on_whole_rigs;
    use ikiru_testkit::rigs::random_pose;

    #[test]
    fn derivatives() {
        check_on_whole_rigs(|rig, random| {
            let joints: Vec<_> = rig.ids().filter(|j| rig.get(*j).is_some_and(|j| j.n_dofs() > 0)).collect();
            RestPose::new(&joints, random_pose(rig, random))
        });
    }
}
