//! Frame by frame: the answer stays in the start's basin, and joints move no faster than the target asks.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::f64::consts::TAU;

use glam::DVec3;
use ikiru_rig::{Cone, EulerOrder, Joint, JointId, JointMotion, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{Position, RestPose};
use ikiru_solve::{Problem, Solver, SolverOptions};

/// A joint turns by at most this many radians while the target moves by one arm's length. A stretched arm is singular:
/// there the elbow turns with the root of the way, which a pull to rest keeps bounded.
const STATED_MULTIPLE: f64 = 8.0;

fn arm(shoulder: JointMotion, elbow: JointMotion) -> (Rig, JointId) {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    for (name, length, motion) in
        [("shoulder", 0.0, shoulder), ("elbow", 0.3, elbow), ("hand", 0.25, JointMotion::Fixed)]
    {
        let mut joint = Joint::new(name, parent);
        joint.rest_translation = DVec3::new(length, 0.0, 0.0);
        joint.motion = motion;
        parent = Some(builder.add(joint));
    }
    let rig = builder.build().unwrap();
    (rig, parent.unwrap())
}

#[test]
fn a_target_that_circles_out_of_reach_and_back_moves_no_joint_too_fast() {
    let euler = JointMotion::Euler { order: EulerOrder::Zyx, ranges: [Range::degrees(-100.0, 100.0); 3] };
    let cone = Cone::new(DVec3::X, [1.9, 1.9], Range::new(-1.0, 1.0)).unwrap();
    let hinge = JointMotion::Hinge { axis: DVec3::Y, range: Range::degrees(-150.0, 0.0) };
    for shoulder in [euler, JointMotion::BALL, JointMotion::Ball { cone: Some(cone) }] {
        let (rig, hand) = arm(shoulder, hinge);
        let mut problem = Problem::whole_body(&rig);
        let reach = problem.add(1.0, Position::new(hand, DVec3::ZERO));
        let joints: Vec<JointId> = problem.active().collect();
        problem.add(0.01, RestPose::new(&joints, rig.rest_pose()));
        let solver = Solver::new(SolverOptions::default());
        let mut workspace = solver.workspace(&problem);
        let mut pose = rig.rest_pose();
        // Around (0.45, 0, 0.1) with a radius of 0.3 m: from well inside the arm's 0.55 m to far outside.
        let at = |angle: f64| DVec3::new(0.45 + 0.3 * angle.cos(), 0.3 * angle.sin(), 0.1);
        let frames = 2000;
        let mut previous: Option<(ikiru_rig::Pose, DVec3)> = None;
        let (mut fastest, mut outside) = (0.0_f64, 0);
        for frame in 0..3 * frames {
            let target = at(TAU * f64::from(frame) / f64::from(frames));
            problem[reach].target = target;
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            outside += usize::from(report.terms[0].residual > 0.1);
            assert!(pose.limit_violation() < 1e-9);
            if let Some((before, from)) = &previous
                && frame > frames / 10
            {
                let moved = before.difference(&pose).unwrap();
                let turned = moved.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
                fastest = fastest.max(turned / (target.distance(*from) / 0.55));
            }
            previous = Some((pose.clone(), target));
        }
        assert!(outside > 1000, "the target leaves the arm's reach");
        assert!(fastest < STATED_MULTIPLE, "{fastest} with a shoulder that is {}", shoulder.name());
    }
}
