//! CCD and FABRIK: what is known of them, recomputed by other means.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::DVec3;
use ikiru_rig::{EulerOrder, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{Direction, Position};
use ikiru_solve::{Invalid, InvalidOptions, Loss, Method, Problem, Solver, SolverOptions, StopReason};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::Random;

/// A chain of `n` segments of 0.2 m along x, and a last joint at its end.
fn chain(n: usize, motion: &JointMotion) -> Rig {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    for i in 0..=n {
        let mut joint = Joint::new(format!("joint{i}"), parent);
        joint.rest_translation = if i == 0 { DVec3::ZERO } else { DVec3::X * 0.2 };
        joint.motion = if i < n { *motion } else { JointMotion::Fixed };
        parent = Some(builder.add(joint));
    }
    builder.build().unwrap()
}

fn place(pose: &Pose, joint: JointId) -> DVec3 {
    world_matrices(pose)[joint.index()].w_axis.truncate()
}

fn solve(
    method: Method,
    problem: &Problem,
    pose: &mut Pose,
    max_iterations: usize,
) -> (f64, StopReason, usize) {
    let solver = Solver::new(SolverOptions { method, max_iterations, ..SolverOptions::default() });
    let mut workspace = solver.workspace(problem);
    let report = solver.solve(problem, pose, &mut workspace);
    (report.cost, report.stop, report.iterations)
}

#[test]
fn both_reach_what_a_free_chain_can_reach() {
    let rig = chain(5, &JointMotion::BALL);
    let tip = JointId::from_index(5);
    let mut random = Random::new(7);
    for method in [Method::Ccd, Method::Fabrik] {
        for _ in 0..200 {
            let target = random.vector(1.0).normalize() * random.between(0.15, 0.9);
            let mut problem = Problem::whole_body(&rig);
            problem.add(1.0, Position::new(tip, target));
            let mut pose = rig.rest_pose();
            solve(method, &problem, &mut pose, 500);
            let distance = place(&pose, tip).distance(target);
            assert!(distance < 1e-3, "{}: {distance} m from {target}", method.name());
        }
    }
}

#[test]
fn fabrik_straightens_towards_what_is_out_of_reach() {
    let rig = chain(4, &JointMotion::BALL);
    let tip = JointId::from_index(4);
    let target = DVec3::new(0.0, 2.0, 1.0);
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(tip, target));
    let mut pose = rig.rest_pose();
    let (_, stop, _) = solve(Method::Fabrik, &problem, &mut pose, 500);
    assert_eq!(stop, StopReason::NoProgress);
    assert!(place(&pose, tip).distance(target.normalize() * 0.8) < 1e-4);
}

#[test]
fn fabrik_reaches_with_two_hands_from_one_trunk() {
    let mut builder = RigBuilder::new();
    let mut add = |name: &str, parent, offset: DVec3, motion| {
        let mut joint = Joint::new(name, parent);
        (joint.rest_translation, joint.motion) = (offset, motion);
        builder.add(joint)
    };
    let hips = add("hips", None, DVec3::Y, JointMotion::BALL);
    let chest = add("chest", Some(hips), DVec3::Y * 0.4, JointMotion::BALL);
    let mut hands = Vec::new();
    for side in [1.0, -1.0] {
        let shoulder = add(&format!("shoulder{side}"), Some(chest), DVec3::X * 0.2 * side, JointMotion::BALL);
        let elbow = add(&format!("elbow{side}"), Some(shoulder), DVec3::X * 0.3 * side, JointMotion::BALL);
        hands.push(add(&format!("hand{side}"), Some(elbow), DVec3::X * 0.3 * side, JointMotion::Fixed));
    }
    let rig = builder.build().unwrap();
    let targets = [DVec3::new(0.35, 1.3, 0.35), DVec3::new(-0.1, 1.5, 0.45)];
    let mut problem = Problem::whole_body(&rig);
    for (hand, target) in hands.iter().zip(targets) {
        problem.add(1.0, Position::new(*hand, target));
    }
    for method in [Method::Fabrik, Method::Ccd] {
        let mut pose = rig.rest_pose();
        let (_, stop, _) = solve(method, &problem, &mut pose, 500);
        assert_eq!(stop, StopReason::Reached, "{}", method.name());
        for (hand, target) in hands.iter().zip(targets) {
            assert!(place(&pose, *hand).distance(target) < 1.001e-3);
        }
    }
}

#[test]
fn one_hinge_is_at_its_best_angle_after_one_sweep() {
    let mut random = Random::new(11);
    for _ in 0..100 {
        let range = Range { min: -random.between(0.1, 3.0), max: random.between(0.1, 3.0) };
        let rig = chain(1, &JointMotion::Hinge { axis: DVec3::Z, range });
        let (joint, tip) = (JointId::from_index(0), JointId::from_index(1));
        let target = random.vector(0.5);
        let mut problem = Problem::whole_body(&rig);
        let reach = problem.add(1.0, Position::new(tip, target));
        problem.term_mut(reach).loss = Loss::Norm;
        let mut pose = rig.rest_pose();
        let (cost, ..) = solve(Method::Ccd, &problem, &mut pose, 1);
        for i in 0..=1000 {
            let angle = range.min + (range.max - range.min) * f64::from(i) / 1000.0;
            let mut other = rig.rest_pose();
            other.set_value(joint, angle).unwrap();
            assert!(cost <= place(&other, tip).distance(target) + 1e-9);
        }
    }
}

#[test]
fn ccd_minimises_a_cost_that_is_not_about_points_alone() {
    let ranges = [Range::degrees(-80.0, 80.0); 3];
    let rig = chain(4, &JointMotion::Euler { order: EulerOrder::Zyx, ranges });
    let tip = JointId::from_index(4);
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(tip, DVec3::new(0.3, 0.15, 0.2)));
    problem.add(0.1, Direction::new(tip, DVec3::X, DVec3::NEG_Y));
    let mut pose = rig.rest_pose();
    let (cost, ..) = solve(Method::Ccd, &problem, &mut pose, 500);
    let distance = place(&pose, tip).distance(DVec3::new(0.3, 0.15, 0.2));
    let pointing = world_matrices(&pose)[tip.index()].transform_vector3(DVec3::X);
    assert!(distance < 5e-3 && pointing.angle_between(DVec3::NEG_Y) < 0.05, "cost {cost}");
}

#[test]
fn sliders_followers_and_a_free_root_take_part() {
    let mut builder = RigBuilder::new();
    let mut rail = Joint::new("rail", None);
    rail.motion = JointMotion::Slider { axis: DVec3::Z, range: Range { min: -0.1, max: 0.4 } };
    let rail = builder.add(rail);
    let mut arm = Joint::new("arm", Some(rail));
    arm.motion = JointMotion::BALL;
    let arm = builder.add(arm);
    let mut tip = Joint::new("tip", Some(arm));
    tip.rest_translation = DVec3::X * 0.3;
    let tip = builder.add(tip);
    let rig = builder.build().unwrap();
    let target = DVec3::new(0.1, 0.2, 0.5);
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(tip, target));
    for method in [Method::Ccd, Method::Fabrik] {
        let mut pose = rig.rest_pose();
        solve(method, &problem, &mut pose, 500);
        assert!(place(&pose, tip).distance(target) < 1e-3, "{}", method.name());
    }
    let mut builder = chain(2, &JointMotion::BALL).to_builder();
    builder.free_root().unwrap();
    let free = builder.build().unwrap();
    let target = DVec3::new(5.0, 1.0, -2.0);
    let tip = JointId::from_index(2);
    let mut problem = Problem::whole_body(&free);
    problem.add(1.0, Position::new(tip, target));
    for method in [Method::Ccd, Method::Fabrik] {
        let mut pose = free.rest_pose();
        solve(method, &problem, &mut pose, 500);
        assert!(place(&pose, tip).distance(target) < 1e-3, "{}", method.name());
    }
}

#[test]
fn fabrik_without_a_point_to_reach_for_says_so() {
    let rig = chain(2, &JointMotion::BALL);
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Direction::new(JointId::from_index(2), DVec3::X, DVec3::Y));
    let solver = Solver::new(SolverOptions { method: Method::Fabrik, ..Default::default() });
    let mut workspace = solver.workspace(&problem);
    let mut pose = rig.rest_pose();
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    assert_eq!(report.stop, StopReason::InvalidInput);
    assert!(matches!(report.invalid, Some(Invalid::Options(InvalidOptions::NothingToReach))));
}
