//! Rest pose: a gentle pull of every joint towards a given pose.

use glam::DQuat;
use ikiru_rig::{JointId, JointMotion, Pose, difference_joint};

use crate::objective::{JointCoords, Objective, Part, Reads, Rows, Unfit, UnfitReason, View};
use crate::objectives::known_rotation::{SLIDING, TURNING, open_turn};
use crate::words::Unit;

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

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        let own = self.pose.rig();
        let (mut n_turning, mut n_sliding) = (0, 0);
        for &joint in &self.joints {
            reads.motion(joint)?;
            let rig = reads.rig();
            let motion = &rig.joints()[joint.index()].motion;
            let kind = own.get(joint).map(|joint| std::mem::discriminant(&joint.motion));
            if kind != Some(std::mem::discriminant(motion)) || own.coords_of(joint) != rig.coords_of(joint) {
                return Err(Unfit::of_joint(UnfitReason::PoseOfOtherRig, joint));
            }
            let n_translations = motion.n_translations();
            n_sliding += n_translations;
            n_turning += motion.n_dofs() - n_translations;
        }
        reads.part(Part::separable(n_turning, Unit::Radians))?;
        reads.part(Part::separable(n_sliding, Unit::Metres))
    }

    fn check(&self) -> Result<(), Unfit> {
        if self.pose.is_valid() { Ok(()) } else { Err(UnfitReason::Pose.into()) }
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let scale = 1.0 / (self.joints.len() as f64).sqrt();
        for (idx, &joint) in self.joints.iter().enumerate() {
            let JointCoords { motion, coords } = view.motion(idx);
            let Some(rest) = self.pose.coords().get(self.pose.rig().coords_of(joint)) else { continue };
            let mut difference = |part: usize, dof: usize, difference: f64| {
                let row = rows.open(part, [scale * difference]);
                if rows.wants_jacobian() {
                    rows.by_motion(row, idx)[dof] = scale;
                }
            };
            match motion {
                JointMotion::Fixed => {}
                JointMotion::Hinge { .. } | JointMotion::Euler { .. } => {
                    let mut way = [0.0; 3];
                    difference_joint(motion, rest, coords, &mut way[..coords.len()]);
                    (0..coords.len()).for_each(|dof| difference(TURNING, dof, way[dof]));
                }
                JointMotion::Slider { .. } => difference(SLIDING, 0, coords[0] - rest[0]),
                JointMotion::Ball { .. } => open_turn(DQuat::from_slice(rest), coords, scale, idx, rows),
                JointMotion::Free { .. } => {
                    (0..3).for_each(|dof| difference(SLIDING, dof, coords[dof] - rest[dof]));
                    open_turn(DQuat::from_slice(&rest[3..]), coords, scale, idx, rows);
                }
            }
        }
    }

    fn mandatory(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::check_on_whole_rigs;
    use ikiru_testkit::rigs::random_pose;

    #[test]
    fn derivatives() {
        check_on_whole_rigs(|rig, random| {
            let joints: Vec<_> = rig.ids().filter(|j| rig.get(*j).is_some_and(|j| j.n_dofs() > 0)).collect();
            RestPose::new(&joints, random_pose(rig, random))
        });
    }
}
