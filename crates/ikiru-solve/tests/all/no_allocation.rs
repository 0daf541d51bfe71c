//! A warm solve does not allocate: every allocation of this process is counted.

use glam::{DQuat, DVec3};
use ikiru_rig::{Frame, JointId, JointMotion, Rig, Scalar};
use ikiru_solve::objectives::{
    Bound, Direction, Distance, JointAngles, KnownRotation, LookAt, Orientation, PoleVector, PoseTarget,
    Position, RelativePose, RestPose,
};
use ikiru_solve::{AdamOptions, Method, Problem, Residual, Search, Solver, SolverOptions};
use ikiru_testkit::allocations::count;
use ikiru_testkit::rigs::{Random, random_rig};

use crate::hard_cases::{self, Case};

#[derive(Clone, Debug)]
struct KeepApart {
    joints: [JointId; 2],
    distance: f64,
}

impl Residual for KeepApart {
    fn joints(&self) -> &[JointId] {
        &self.joints
    }
    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        residual[0] = frames[0].origin.distance(frames[1].origin) - S::from(self.distance);
    }
}

/// Some angles for a joint, of the form that its motion has.
fn angles_of(rig: &Rig, joint: JointId) -> JointAngles {
    match rig.get(joint).map(|joint| joint.motion) {
        Some(JointMotion::Euler { .. }) => JointAngles::Euler([Some(0.1), None, Some(-0.2)]),
        Some(JointMotion::Ball { .. } | JointMotion::Free { .. }) => {
            JointAngles::Rotation(DQuat::from_rotation_x(0.2))
        }
        _ => JointAngles::Value(0.1),
    }
}

#[test]
fn after_one_warm_up_nothing_allocates() {
    assert!(count(|| drop(std::hint::black_box(vec![1_u8; 100]))) > 0, "the counter counts");
    let mut random = Random::new(2);
    for case in 0..12 {
        let rig = random_rig(30, case);
        let [a, b] = [rig.n_joints() - 1, rig.n_joints() / 2].map(JointId::from_index);
        let mut problem = Problem::whole_body(&rig);
        let reach = problem.add(1.0, Position::new(a, DVec3::ZERO));
        problem.add(0.3, Orientation::new(b, DQuat::IDENTITY));
        problem.add(0.1, PoseTarget::new(b, DVec3::ONE, DQuat::IDENTITY));
        problem.add(0.1, LookAt::new(a, DVec3::Z, DVec3::ONE));
        problem.add(0.1, Direction::new(b, DVec3::Y, DVec3::X));
        problem.add(0.1, KeepApart { joints: [a, b], distance: 0.2 });
        problem.add(0.1, RelativePose::new(a, b, Some(DVec3::ONE), Some(DQuat::IDENTITY)));
        problem.add(0.1, Distance::new([a, b], Bound::AtLeast(0.5)));
        problem.add(0.1, PoleVector { joints: [JointId::from_index(0), b, a], target: DVec3::Y });
        let joints: Vec<JointId> = problem.active().collect();
        let given: Vec<_> = joints.iter().map(|joint| (*joint, angles_of(&rig, *joint))).collect();
        problem.add(0.1, KnownRotation::new(&given));
        problem.add(0.01, RestPose::new(&joints, rig.rest_pose()));
        for &method in Method::ALL.iter().filter(|m| m.name() != "ipopt") {
            for search in [Search::Local, Search::Global { max_restarts: 5 }] {
                let solver =
                    Solver::new(SolverOptions { method, search, max_iterations: 40, ..Default::default() });
                let mut workspace = solver.workspace(&problem);
                let mut pose = rig.rest_pose();
                solver.solve(&problem, &mut pose, &mut workspace);
                for _ in 0..5 {
                    problem[reach].target = random.vector(0.5);
                    let n = count(|| {
                        let report = solver.solve(&problem, &mut pose, &mut workspace);
                        assert!(report.cost.is_finite());
                    });
                    assert_eq!(n, 0, "case {case}, {method:?}, {search:?}");
                }
            }
        }
    }
}

#[test]
fn nor_does_it_with_hard_rows_that_come_in_and_give_way() {
    for number in 0..40 {
        let Case { mut problem, start, feasible } = hard_cases::case(number);
        let reach = problem.add(1.0, Position::new(JointId::from_index(1), DVec3::ZERO));
        // One that contradicts whatever is near.
        problem.add_hard(Position::new(JointId::from_index(1), DVec3::new(0.0, 30.0, 0.0)));
        let own = KeepApart { joints: [0, 1].map(JointId::from_index), distance: 0.1 };
        let id = problem.add_hard(own);
        let mut random = Random::new(number);
        for method in [Method::Lm, Method::Adam(AdamOptions::DEFAULT)] {
            for search in [Search::Local, Search::Global { max_restarts: 5 }] {
                let solver =
                    Solver::new(SolverOptions { method, search, max_iterations: 30, ..Default::default() });
                let mut workspace = solver.workspace(&problem);
                let mut pose = start.clone();
                solver.solve(&problem, &mut pose, &mut workspace);
                for solve in 0..4 {
                    problem[reach].target = random.vector(0.5);
                    problem.term_mut(id).is_on = solve % 2 == 0;
                    pose.clone_from(if solve == 2 { &feasible } else { &start });
                    let n = count(|| {
                        let report = solver.solve(&problem, &mut pose, &mut workspace);
                        assert!(report.cost.is_finite());
                    });
                    assert_eq!(n, 0, "case {number}, {method:?}, {search:?}");
                }
            }
        }
    }
}
