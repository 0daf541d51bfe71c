//! Balls in cones about other centres than their rest pose: what is in reach is reached, and no pose leaves a cone, as an
//! independent judge has it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use crate::common::plan;
use glam::DVec3;
use ikiru_rig::{Cone, ConeCentre, Joint, JointId, JointMotion, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{Orientation, Position};
use ikiru_solve::{
    Force, ForceBy, Method, MotionProblem, Problem, Search, Solver, SolverOptions, Timeline, When,
};
use ikiru_testkit::cones::largest_cone_excess;
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::{Random, random_pose};

/// Four balls with random rest rotations, whose cones are about random centres, and a tip.
fn arm(random: &mut Random) -> (Rig, JointId) {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    for idx in 0..5 {
        let mut joint = Joint::new(format!("ball_{idx}"), parent);
        joint.rest_translation = if idx == 0 { DVec3::ZERO } else { DVec3::X * 0.3 };
        joint.rest_rotation = random.rotation();
        if idx < 4 {
            let cone = Cone::new(DVec3::X, [0.9, 0.5], Range::new(-0.4, 0.3)).unwrap();
            let centre = ConeCentre { parent_rotation: random.rotation(), joint_rotation: random.rotation() };
            joint.motion = JointMotion::Ball { cone: Some(cone.with_centre(centre).unwrap()) };
        }
        parent = Some(builder.add(joint));
    }
    (builder.build().unwrap(), parent.unwrap())
}

#[test]
fn every_method_stays_inside_and_lm_reaches_what_can_be_reached() {
    let mut random = Random::new(1);
    let mut reached = 0;
    for case in 0..100 {
        let (rig, tip) = arm(&mut random);
        let target = random_pose(&rig, &mut random).frame(tip).unwrap().position;
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, Position::new(tip, target));
        for &method in Method::ALL {
            let search = Search::Global { max_restarts: 16 };
            let solver = Solver::new(SolverOptions { method, search, ..SolverOptions::default() });
            let mut pose = rig.rest_pose();
            let mut workspace = solver.workspace(&problem);
            let success = solver.solve(&problem, &mut pose, &mut workspace).success;
            let excess = largest_cone_excess(&pose);
            assert!(excess < 1e-9, "case {case}, {}: {excess}", method.name());
            let missed = world_matrices(&pose)[tip.index()].w_axis.truncate().distance(target);
            assert_eq!(success, missed < 1e-3, "case {case}, {}: {missed}", method.name());
            reached += usize::from(method == Method::Lm && success);
        }
    }
    assert!(reached >= 99, "{reached} of 100");
}

#[test]
fn motions_stay_inside_between_poses_too() {
    let mut random = Random::new(2);
    let mut reached = 0;
    for case in 0..40 {
        let (rig, tip) = arm(&mut random);
        let (start, goal) =
            (random_pose(&rig, &mut random), random_pose(&rig, &mut random).frame(tip).unwrap());
        let mut motion = MotionProblem::whole_body(&rig, Timeline::points(6).unwrap());
        motion.set_smoothness([1e-6; 3]).unwrap();
        motion.fix_start(&start).unwrap();
        motion.add(1.0, When::End, Position::new(tip, goal.position)).unwrap();
        motion.add(0.1, When::End, Orientation::new(tip, goal.rotation)).unwrap();
        let planned = plan(SolverOptions::default(), &motion, &start);
        for pose in planned.clip.poses() {
            assert!(largest_cone_excess(pose) < 1e-9, "case {case}: {}", largest_cone_excess(pose));
        }
        let (first, last) = (planned.clip.times()[0], planned.clip.times()[5]);
        for i in 0..=50 {
            let pose = planned.clip.sample_cubic(first + (last - first) * f64::from(i) / 50.0);
            assert!(largest_cone_excess(&pose) < 1e-9, "case {case}: {}", largest_cone_excess(&pose));
        }
        reached += usize::from(planned.report.success);
    }
    assert!(reached >= 32, "{reached} of 40");
}

#[test]
fn the_limit_in_the_way_is_named() {
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("ball", None);
    let cone = Cone::new(DVec3::X, [0.5, 0.5], Range::new(-0.1, 0.1)).unwrap();
    // The middle of the cone has the arm along +z, turned about itself by nothing.
    let parent_rotation = glam::DQuat::from_rotation_arc(DVec3::X, DVec3::Z);
    let centre = ConeCentre { parent_rotation, ..ConeCentre::default() };
    joint.motion = JointMotion::Ball { cone: Some(cone.with_centre(centre).unwrap()) };
    let ball = builder.add(joint);
    let mut tip = Joint::new("tip", Some(ball));
    tip.rest_translation = DVec3::X;
    let tip = builder.add(tip);
    let rig = builder.build().unwrap();
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(tip, DVec3::X));
    let solver = Solver::new(SolverOptions::default());
    let mut pose = rig.rest_pose();
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    let is_held = |force: &Force| matches!(force.by, ForceBy::Limit { joint, .. } if joint == ball);
    assert!(!report.success && report.forces.iter().any(is_held));
    // 0.5 rad from +z towards +x is as near as it gets.
    let wanted = DVec3::new(0.5_f64.sin(), 0.0, 0.5_f64.cos());
    let found = world_matrices(&pose)[tip.index()].w_axis.truncate();
    assert!(found.distance(wanted) < 1e-6, "{found}");
}
