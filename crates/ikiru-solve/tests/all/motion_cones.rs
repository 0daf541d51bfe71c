//! Motions of balls in cones: they slide along edges, and reach what single poses reach.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use crate::common::plan;
use glam::DVec3;
use ikiru_rig::{Cone, Joint, JointId, JointMotion, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{Orientation, Position, RestPose};
use ikiru_solve::{MotionProblem, Problem, Solver, SolverOptions, Timeline, When};
use ikiru_testkit::rigs::{Random, random_pose};

/// Three balls in narrow cones.
fn in_cones() -> (Rig, JointId) {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    for i in 0..4 {
        let mut joint = Joint::new(format!("ball{i}"), parent);
        joint.rest_translation = if i == 0 { DVec3::ZERO } else { DVec3::X * 0.3 };
        if i < 3 {
            let cone = Cone::new(DVec3::X, [0.8, 0.4], Range::new(-0.3, 0.3)).unwrap();
            joint.motion = JointMotion::Ball { cone: Some(cone) };
        }
        parent = Some(builder.add(joint));
    }
    (builder.build().unwrap(), JointId::from_index(3))
}

#[test]
fn motions_slide_along_the_edges_of_cones() {
    let (rig, tip) = in_cones();
    let mut random = Random::new(1);
    let options = SolverOptions { max_iterations: 100, ..SolverOptions::default() };
    let mut reached = 0;
    for _ in 0..100 {
        // Poses of random cones: many of them on an edge.
        let goal = random_pose(&rig, &mut random).frame(tip).unwrap();
        let mut motion = MotionProblem::whole_body(&rig, Timeline::points(6).unwrap());
        motion.set_smoothness([1e-6; 3]).unwrap();
        motion.fix_start(&rig.rest_pose()).unwrap();
        motion.add(1.0, When::End, Position::new(tip, goal.position)).unwrap();
        motion.add(0.1, When::End, Orientation::new(tip, goal.rotation)).unwrap();
        let planned = plan(options, &motion, &rig.rest_pose());
        assert!(planned.clip.poses().iter().all(|p| p.limit_violation() < 1e-9));
        reached += usize::from(planned.report.success);
    }
    assert!(reached >= 95, "{reached} of 100");
}

#[test]
fn at_the_edge_of_a_cone_too_the_optimum_is_met() {
    let (rig, tip) = in_cones();
    for case in 0..6 {
        let a = f64::from(case);
        // Out of reach: the best lies on edges.
        let target = DVec3::new(0.3 * a.cos(), 0.5 + 0.1 * (2.0 * a).sin(), 0.6 * (1.3 * a).sin());
        let mut motion = MotionProblem::whole_body(&rig, Timeline::points(8).unwrap());
        motion.fix_start(&rig.rest_pose()).unwrap();
        motion.add(1.0, When::End, Position::new(tip, target)).unwrap();
        let planned = plan(SolverOptions::default(), &motion, &rig.rest_pose());
        // As in the test of the known optimum: the single pose with a pull to rest.
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, Position::new(tip, target));
        let joints: Vec<JointId> = problem.active().collect();
        problem.add(0.001 / 9.0 * joints.len() as f64, RestPose::new(&joints, rig.rest_pose()));
        let solver = Solver::new(SolverOptions::default());
        let mut pose = planned.clip.poses().last().unwrap().clone();
        let best = solver.solve(&problem, &mut pose, &mut solver.workspace(&problem)).cost;
        let cost = planned.report.cost;
        assert!((cost - best).abs() < 1e-4 * best, "case {case}: {cost} is not {best}");
    }
}
