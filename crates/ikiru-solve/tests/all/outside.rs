//! Methods from outside: what they are told, what is taken of them, and what ends them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::time::Duration;

use glam::DVec3;
use ikiru_rig::{JointId, Pose};
use ikiru_solve::objectives::{Position, RestPose};
use ikiru_solve::{
    Evaluation, Invalid, InvalidOptions, InvalidTerm, Method, MotionProblem, MotionWorkspace, PoseMethod,
    Problem, Search, Solver, SolverOptions, Start, StopReason, Timeline, When,
};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// Down the gradient, by steps that are halved until the cost falls.
#[derive(Debug)]
struct Downhill;

impl PoseMethod for Downhill {
    fn name(&self) -> &'static str {
        "downhill"
    }

    fn improve(&self, start: &mut Start<'_, '_>) -> bool {
        let (mut at, mut pose) = (Evaluation::default(), start.pose().clone());
        let mut rate = 0.5;
        while start.goes_on() {
            at.derivatives_at(start.problem(), &pose).unwrap();
            assert!((at.cost() - start.cost()).abs() <= 1e-12 * start.cost());
            loop {
                let step: Vec<f64> = at.gradient().iter().map(|g| -rate * g).collect();
                if step.iter().all(|s| s.abs() < 1e-9) {
                    return true;
                }
                let mut next = pose.clone();
                next.retract(&step).unwrap();
                next.project();
                let cost = start.offer(&next);
                if cost < at.cost() {
                    (pose, rate) = (next, 2.0 * rate);
                    break;
                }
                rate *= 0.5;
            }
        }
        false
    }
}

/// Offers what no method should.
#[derive(Debug)]
struct Careless;

impl PoseMethod for Careless {
    fn name(&self) -> &'static str {
        "careless"
    }

    fn improve(&self, start: &mut Start<'_, '_>) -> bool {
        assert!(start.goes_on() && start.pose().limit_violation() < 1e-9);
        let mut broken = start.pose().clone();
        broken.coords_mut()[0] = f64::NAN;
        let outside = random_rig(3, 99).rest_pose();
        assert!([&broken, &outside].iter().all(|pose| start.offer(pose) == f64::INFINITY));
        // Far outside its limits, and what must not move moved.
        let step: Vec<f64> = (0..start.pose().rig().n_dofs()).map(|k| (k as f64).sin() * 2.0).collect();
        let mut far = start.pose().clone();
        far.retract(&step).unwrap();
        let cost = start.offer(&far);
        assert!(cost.is_finite() && start.cost() <= cost);
        false
    }
}

fn options(method: &'static dyn PoseMethod) -> SolverOptions {
    SolverOptions { method: Method::Outside(method), ..SolverOptions::default() }
}

/// A hand wanted somewhere, with a pull to the rest pose.
fn problem(case: u64, random: &mut Random) -> (Problem, Pose) {
    let rig = random_rig(4 + random.below(6), 40 + case);
    let mut problem = Problem::whole_body(&rig);
    let tip = JointId::from_index(rig.n_joints() - 1);
    problem.add(1.0, Position::new(tip, random.vector(0.5)));
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(0.2, RestPose::new(&joints, rig.rest_pose()));
    let pose = random_pose(&rig, random);
    (problem, pose)
}

#[test]
fn a_method_from_outside_comes_down_to_where_lm_stays() {
    let mut random = Random::new(2);
    let mut n_low = 0;
    for case in 0..20 {
        let (problem, mut pose) = problem(case, &mut random);
        let solver = Solver::new(SolverOptions { max_iterations: 5000, ..options(&Downhill) });
        let mut workspace = solver.workspace(&problem);
        let report = solver.solve(&problem, &mut pose, &mut workspace).into_owned();
        assert!(report.iterations > 0 && pose.limit_violation() < 1e-9, "case {case}");
        let lm = Solver::default();
        let further = lm.solve(&problem, &mut pose, &mut lm.workspace(&problem)).cost;
        n_low += usize::from(report.cost < 1.05 * further + 1e-3);
    }
    // At corners of limits it stays behind.
    assert!(n_low >= 16, "{n_low}");
}

#[test]
fn what_is_offered_is_kept_inside_limits_and_only_where_it_is_better() {
    let mut random = Random::new(3);
    for case in 0..40 {
        let (whole, mut pose) = problem(case, &mut random);
        let held = whole.active().next().unwrap();
        let mut problem = Problem::new(whole.rig(), whole.active().skip(1)).unwrap();
        problem.add(1.0, Position::new(JointId::from_index(whole.rig().n_joints() - 1), random.vector(0.5)));
        let before = pose.clone();
        let solver = Solver::new(options(&Careless));
        let report = solver.solve(&problem, &mut pose, &mut solver.workspace(&problem)).into_owned();
        assert_eq!(report.stop, StopReason::NoProgress);
        let held = problem.rig().coords_of(held);
        assert_eq!(pose.coords()[held.clone()], before.coords()[held], "case {case}");
        let mut evaluation = Evaluation::default();
        evaluation.at(&problem, &pose).unwrap();
        assert!((evaluation.cost() - report.cost).abs() < 1e-12 * (1.0 + report.cost), "case {case}");
        evaluation.at(&problem, &before).unwrap();
        let mut start = before.clone();
        if !start.project() {
            assert!(report.cost <= (1.0 + 1e-12) * evaluation.cost(), "case {case}");
        }
    }
}

#[test]
fn stopping_rules_restarts_and_refusals_are_those_of_all_methods() {
    let mut random = Random::new(4);
    let (mut problem, start) = problem(1, &mut random);
    let solve = |options: SolverOptions, problem: &Problem| {
        let solver = Solver::new(options);
        let mut workspace = solver.workspace(problem);
        solver.solve(problem, &mut start.clone(), &mut workspace).into_owned()
    };
    for max_iterations in [0, 1, 3] {
        let report = solve(SolverOptions { max_iterations, ..options(&Downhill) }, &problem);
        assert_eq!((report.stop, report.iterations), (StopReason::IterationLimit, max_iterations));
    }
    let none = SolverOptions { max_time: Some(Duration::ZERO), ..options(&Downhill) };
    assert_eq!(solve(none, &problem).stop, StopReason::TimeBudget);
    let bar = SolverOptions { cost_below: Some(f64::MAX), ..options(&Downhill) };
    let report = solve(bar, &problem);
    assert_eq!((report.stop, report.iterations), (StopReason::Reached, 0));
    let search = Search::Global { max_restarts: 3 };
    let report = solve(SolverOptions { search, max_iterations: 2, ..options(&Downhill) }, &problem);
    assert_eq!(report.restarts, 3);
    // It does not say that it holds constraints.
    problem.add_hard(Position::new(JointId::from_index(2), DVec3::ZERO));
    let report = solve(options(&Downhill), &problem);
    assert_eq!(report.invalid, Some(Invalid::Term(2, InvalidTerm::Hard)));
    let rig = problem.rig().clone();
    let timeline = Timeline::seconds(1.0, 4.0).unwrap();
    let motion = MotionProblem::from_problem(Problem::whole_body(&rig), timeline, &[] as &[When]).unwrap();
    let clip = ikiru_rig::Clip::still(start.clone());
    let solver = Solver::new(options(&Downhill));
    let report = solver.plan(&motion, &clip, &mut MotionWorkspace::default()).report.into_owned();
    assert_eq!(report.invalid, Some(Invalid::Options(InvalidOptions::MethodOfPoses)));
    assert!(
        Method::Outside(&Downhill) == Method::Outside(&Downhill) && Method::Outside(&Downhill) != Method::Lm
    );
    assert_ne!(Method::Outside(&Downhill), Method::Outside(&Careless));
}
