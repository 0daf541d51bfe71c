//! A warm solve does not allocate: every allocation of this process is counted.

use glam::{DQuat, DVec3};
use ikiru_rig::{Clip, Frame, JointId, JointMotion, Rig, Scalar};
use ikiru_solve::objectives::{
    Bound, Direction, Distance, JointAngles, KnownRotation, LookAt, Orientation, PoleVector, PoseTarget,
    Position, RelativePose, RestPose,
};
use ikiru_solve::{
    AdamOptions, Method, MotionProblem, MotionWorkspace, Problem, Residual, Search, Solver, SolverOptions,
    Timeline, When,
};
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
        for &method in Method::ALL {
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

#[test]
fn nor_does_a_second_plan_of_a_motion_of_the_same_shape() {
    let mut random = Random::new(7);
    for case in 0..8 {
        let rig = random_rig(12, case);
        let tip = JointId::from_index(rig.n_joints() - 1);
        // Targets at all samples: too many rows to solve over in case 3, in case 6 only as long as all guards act.
        let rate = [8.0, 30.0, 8.0, 220.0, 8.0, 30.0, 160.0, 30.0][case as usize];
        let timeline = Timeline::seconds(1.0, rate).unwrap();
        let mut motion = MotionProblem::whole_body(&rig, timeline);
        let reach = motion.add(1.0, When::End, Position::new(tip, DVec3::ONE)).unwrap();
        let led = JointId::from_index(rig.n_joints() / 2);
        motion.add_moving(0.3, When::Throughout, |secs| Position::new(led, DVec3::X * secs)).unwrap();
        let joints: Vec<JointId> = motion.terms().active().collect();
        motion.add(0.01, When::Throughout, RestPose::new(&joints, rig.rest_pose())).unwrap();
        let ahead = Distance::new([tip, led], Bound::AtLeast(0.1));
        if case % 3 == 0 {
            let when = if case == 6 { When::Throughout } else { When::At(0.5) };
            motion.add_hard(when, ahead).unwrap();
        } else {
            motion.add(1.0, When::At(0.5), ahead).unwrap();
        }
        motion.set_even_spacing(if case % 4 == 1 { 0.1 } else { 0.0 }).unwrap();
        motion.fix_start(&rig.rest_pose()).unwrap();
        let guess = Clip::still(rig.rest_pose());
        for method in [Method::Lm, Method::Adam(AdamOptions::DEFAULT)] {
            for search in [Search::Local, Search::Global { max_restarts: 2 }] {
                let options = SolverOptions { method, search, max_iterations: 12, ..Default::default() };
                let solver = Solver::new(options);
                let mut workspace = MotionWorkspace::default();
                // One plan finds all memory, even one that is over before its first step: what acts and holds differs from
                // plan to plan.
                let idle = SolverOptions { cost_below: Some(1e9), ..options };
                Solver::new(idle).plan(&motion, &guess, &mut workspace);
                for plan in 0..4 {
                    motion[reach].target = random.vector(0.5);
                    let n = count(|| {
                        let planned = solver.plan(&motion, &guess, &mut workspace);
                        assert!(planned.report.cost.is_finite());
                    });
                    assert_eq!(n, 0, "case {case}, {method:?}, {search:?}, plan {plan}");
                }
                // What a workspace has seen before has no say.
                let used = solver.plan(&motion, &guess, &mut workspace).into_owned();
                let fresh = solver.plan(&motion, &guess, &mut MotionWorkspace::default()).into_owned();
                assert_eq!((used.clip, used.report), (fresh.clip, fresh.report), "case {case}, {method:?}");
            }
        }
    }
}
