//! What tests of motions share.
#![allow(dead_code, unreachable_pub, reason = "each test file uses some of it")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::DVec3;
use ikiru_rig::{Clip, EulerOrder, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_solve::{MotionProblem, MotionWorkspace, PlannedMotion, Solver, SolverOptions};
use ikiru_testkit::reference::world_matrices;

/// A chain of four segments of 0.25 m along x with three angles each, and a hand at its end.
pub fn arm(limit_deg: f64) -> (Rig, JointId) {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    for i in 0..5 {
        let mut joint = Joint::new(format!("joint{i}"), parent);
        joint.rest_translation = if i == 0 { DVec3::ZERO } else { DVec3::X * 0.25 };
        if i < 4 {
            let ranges = [Range::degrees(-limit_deg, limit_deg); 3];
            joint.motion = JointMotion::Euler { order: EulerOrder::Zyx, ranges };
        }
        parent = Some(builder.add(joint));
    }
    (builder.build().unwrap(), JointId::from_index(4))
}

pub fn still(pose: &Pose) -> Clip {
    Clip::still(pose.clone())
}

pub fn plan(options: SolverOptions, motion: &MotionProblem, guess: &Pose) -> PlannedMotion<'static> {
    Solver::new(options).plan(motion, &still(guess), &mut MotionWorkspace::default()).into_owned()
}

pub fn place(pose: &Pose, joint: JointId) -> DVec3 {
    world_matrices(pose)[joint.index()].w_axis.truncate()
}
