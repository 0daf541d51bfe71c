//! Arms of robots: 1,000 random reachable poses each, cold from the middle of the ranges, position within 1e-5 m and
//! rotation within 1e-5 rad, limits held.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::DQuat;
use ikiru_rig::{JointId, Pose};
use ikiru_solve::objectives::PoseTarget;
use ikiru_solve::{Problem, Search, Solver, SolverOptions, Tolerance};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::{Random, random_pose};

fn check(file: &str, base: &str, tip: &str) {
    let path = format!("{}/../ikiru-formats/assets/robots/{file}.urdf", env!("CARGO_MANIFEST_DIR"));
    let rig = ikiru_formats::read(path).unwrap().rig;
    let tip = rig.joint(tip).unwrap();
    let name = |j: JointId| rig.get(j).unwrap().name.clone();
    let mut problem = Problem::new(&rig, rig.chain(base, &name(tip)).unwrap()).unwrap();
    let id = problem.add(1.0, PoseTarget::new(tip, glam::DVec3::ZERO, DQuat::IDENTITY));
    problem.term_mut(id).tolerance = Tolerance { metres: 1e-5, radians: 1e-5 };
    let mut middle = rig.rest_pose();
    for joint in problem.active() {
        middle.set_value(joint, rig.get(joint).unwrap().motion.ranges()[0].middle()).unwrap();
    }
    let search = Search::Global { max_restarts: 200 };
    let solver = Solver::new(SolverOptions { search, ..SolverOptions::default() });
    let mut workspace = solver.workspace(&problem);
    let mut random = Random::new(17);
    let mut reached = 0;
    for _ in 0..1000 {
        let random_all = random_pose(&rig, &mut random);
        let mut goal = middle.clone();
        for joint in problem.active() {
            goal.set_value(joint, random_all.value(joint).unwrap()).unwrap();
        }
        let wanted = goal.frame(tip).unwrap();
        problem[id].position = wanted.position;
        problem[id].rotation = wanted.rotation;
        let mut pose: Pose = middle.clone();
        let success = solver.solve(&problem, &mut pose, &mut workspace).success;
        assert!(pose.limit_violation() < 1e-9);
        let found = world_matrices(&pose)[tip.index()];
        let near = found.w_axis.truncate().distance(wanted.position) <= 1.001e-5
            && DQuat::from_mat4(&found).angle_between(wanted.rotation) <= 1.2e-5;
        assert_eq!(near, success, "{file}");
        reached += usize::from(near);
    }
    assert!(reached >= 999, "{file}: {reached} of 1000");
}

#[test]
fn panda() {
    check("panda", "panda_link1", "panda_link8");
}

#[test]
fn ur5() {
    check("ur5_robot", "shoulder_link", "tool0");
}

#[test]
fn xarm7() {
    check("xarm7", "link1", "link7");
}

#[test]
fn g1_arm() {
    check("g1_29dof_rev_1_0", "left_shoulder_pitch_link", "left_rubber_hand");
}
