//! What may go to another thread, and be looked at from several: everything that a user keeps.

use ikiru::rig::{ClipError, PoseError, RigError};
use ikiru::{
    Clip, ForeignJoint, JointFrame, Loaded, MotionProblem, MotionWorkspace, PlannedMotion, Pose, Problem,
    Report, Rig, RigBuilder, Scenario, Solver, SolverOptions, Workspace, formats, scenario,
};

fn may_be_sent_and_shared<T: Send + Sync>() {}

#[test]
fn what_a_user_keeps_may_be_sent_and_shared() {
    may_be_sent_and_shared::<(Rig, RigBuilder, Pose, Clip, JointFrame)>();
    may_be_sent_and_shared::<(Problem, Solver, SolverOptions, Workspace)>();
    may_be_sent_and_shared::<(MotionProblem, MotionWorkspace, PlannedMotion<'static>, Report<'static>)>();
    may_be_sent_and_shared::<(Loaded, Scenario, scenario::Document)>();
    may_be_sent_and_shared::<(RigError, PoseError, ClipError, ForeignJoint, formats::Error, scenario::Error)>(
    );
}
