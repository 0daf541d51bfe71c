//! Ipopt as a method: the minimum that Levenberg–Marquardt finds, limits, and every reason to stop.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::time::Duration;

use crate::hard_cases;
use glam::DVec3;
use ikiru_ipopt::IPOPT;
use ikiru_rig::{Cone, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{Bound, Distance, PoseTarget, Position, RestPose};
use ikiru_solve::{Invalid, Loss, Method, Problem, Search, Solver, SolverOptions, StopReason};
use ikiru_testkit::cones::{largest_cone_excess, without_centres};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// lm to the last digit, for minima.
const LM: SolverOptions = SolverOptions { method: Method::Lm, ..PEER };

const PEER: SolverOptions = SolverOptions {
    method: IPOPT,
    search: Search::Local,
    cost_below: None,
    settle: ikiru_solve::Settle::Fully,
    max_iterations: 500,
    max_time: None,
};

fn solve(options: SolverOptions, problem: &Problem, pose: &mut Pose) -> (f64, StopReason, usize) {
    let solver = Solver::new(options);
    let mut workspace = solver.workspace(problem);
    let report = solver.solve(problem, pose, &mut workspace);
    (report.cost, report.stop, report.iterations)
}

/// Balls with cones, 0.3 m long each, and a hand at the end.
fn arm() -> (Rig, JointId) {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    for idx in 0..4 {
        let mut joint = Joint::new(format!("joint_{idx}"), parent);
        joint.rest_translation = if idx == 0 { DVec3::ZERO } else { DVec3::X * 0.3 };
        if idx < 3 {
            let cone = Cone::new(DVec3::X, [1.0, 0.7], Range::degrees(-40.0, 60.0)).unwrap();
            joint.motion = JointMotion::Ball { cone: Some(cone) };
        }
        parent = Some(builder.add(joint));
    }
    (builder.build().unwrap(), parent.unwrap())
}

/// A hand that is wanted at a place, with a pull to the rest pose.
fn pulled(rig: &Rig, hand: JointId, target: DVec3, pull: f64) -> Problem {
    let mut problem = Problem::whole_body(rig);
    problem.add(1.0, Position::new(hand, target));
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(pull, RestPose::new(&joints, rig.rest_pose()));
    problem
}

#[test]
fn the_minimum_is_that_of_lm() {
    let mut random = Random::new(3);
    let (mut all, mut agreeing) = (0, 0);
    for case in 0..40 {
        // With cones about the rest pose, where a solve then begins in their midst.
        let rig = without_centres(&random_rig(3 + random.below(12), 500 + case));
        let hand = JointId::from_index(rig.n_joints() - 1);
        // A strong pull: there is one minimum near the rest pose.
        let target = rig.rest_pose().frame(hand).unwrap().position + random.vector(0.15);
        let problem = pulled(&rig, hand, target, 0.5);
        let (mut a, mut b) = (rig.rest_pose(), rig.rest_pose());
        let lm = solve(LM, &problem, &mut a).0;
        let (ipopt, stop, _) = solve(PEER, &problem, &mut b);
        assert!(b.limit_violation() < 1e-9);
        assert_ne!(stop, StopReason::IterationLimit);
        all += 1;
        let gap = (ipopt - lm) / lm.max(1e-9);
        assert!(gap < 1e-6, "case {case}: {ipopt}, lm {lm}");
        agreeing += usize::from(gap.abs() < 1e-6);
    }
    assert_eq!(agreeing, all);
}

#[test]
fn about_other_centres_the_minimum_is_one_for_lm_too() {
    let mut random = Random::new(4);
    for case in 0..40 {
        let rig = random_rig(3 + random.below(12), 500 + case);
        let hand = JointId::from_index(rig.n_joints() - 1);
        let target = rig.rest_pose().frame(hand).unwrap().position + random.vector(0.15);
        let problem = pulled(&rig, hand, target, 0.5);
        let (mut a, mut b) = (rig.rest_pose(), rig.rest_pose());
        let lm = solve(LM, &problem, &mut a).0;
        let (ipopt, stop, _) = solve(PEER, &problem, &mut b);
        assert!(b.limit_violation() < 1e-9 && largest_cone_excess(&b) < 1e-9);
        assert_ne!(stop, StopReason::IterationLimit);
        // The pull begins at corners of cones, from where another minimum may be nearer.
        let far = lm.max(1e-9);
        assert!((ipopt - lm) / far < 1e-6, "case {case}: {ipopt}, lm {lm}");
        let further = solve(LM, &problem, &mut b).0;
        assert!(further > ipopt - 1e-6 * far, "case {case}: {ipopt}, from there {further}");
    }
}

#[test]
fn limits_hold_and_reachable_targets_are_reached() {
    let mut random = Random::new(17);
    let (mut all, mut reached) = (0, 0);
    for case in 0..40 {
        let rig = random_rig(2 + random.below(16), 900 + case);
        let joint = JointId::from_index(rig.n_joints() - 1);
        let frame = random_pose(&rig, &mut random).frame(joint).unwrap();
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, PoseTarget::new(joint, frame.position, frame.rotation));
        let options = SolverOptions { search: Search::Global { max_restarts: 8 }, ..PEER };
        let mut pose = rig.rest_pose();
        pose.project(); // of joints, too, that the target does not see
        let (_, stop, _) = solve(options, &problem, &mut pose);
        assert!(pose.limit_violation() < 1e-9 && pose.is_valid());
        all += 1;
        if stop == StopReason::Reached {
            reached += 1;
            let found = world_matrices(&pose)[joint.index()].w_axis.truncate();
            assert!(found.distance(frame.position) < 1.001e-3);
        }
    }
    assert!(reached * 100 >= all * 97, "{reached} of {all}");
}

#[test]
fn a_cone_stops_what_is_out_of_reach_as_it_stops_lm() {
    let (rig, hand) = arm();
    for target in [DVec3::new(-0.5, 0.4, 0.2), DVec3::new(0.0, -1.0, 0.3), DVec3::new(2.0, 0.5, 0.0)] {
        let problem = pulled(&rig, hand, target, 1e-3);
        let (mut a, mut b) = (rig.rest_pose(), rig.rest_pose());
        let lm = solve(LM, &problem, &mut a).0;
        let (ipopt, stop, _) = solve(PEER, &problem, &mut b);
        assert_eq!(stop, StopReason::Converged, "{target}");
        assert!((ipopt - lm).abs() < 1e-6 * lm, "{target}: {ipopt}, lm {lm}");
        assert!(b.limit_violation() < 1e-9);
    }
}

#[test]
fn hard_rows_are_its_own_constraints() {
    let (rig, hand) = arm();
    let elbow = JointId::from_index(2);
    let far = DVec3::new(0.2, 0.9, 0.1);
    // An equality, an inequality that binds, one that does not, and a wish that wants to be at least something.
    let mut problem = pulled(&rig, hand, far, 1e-3);
    problem.add_hard(Distance::new([JointId::from_index(0), hand], Bound::Exactly(0.8)));
    problem.add_hard(Distance::new([JointId::from_index(0), elbow], Bound::AtMost(0.56)));
    problem.add_hard(Distance::new([JointId::from_index(1), hand], Bound::AtLeast(0.1)));
    problem.add(0.1, Distance::new([elbow, hand], Bound::AtLeast(0.4)));
    let found = [LM, PEER].map(|options| {
        let mut pose = rig.rest_pose();
        let found = hard_cases::solve(options, &problem, &mut pose);
        let place = |joint: usize| world_matrices(&pose)[joint].w_axis.truncate();
        assert!(
            (place(0).distance(place(3)) - 0.8).abs() < 1e-7 && place(0).distance(place(2)) < 0.56 + 1e-7
        );
        found.cost
    });
    assert!((found[0] - found[1]).abs() < 1e-6 * found[0], "{found:?}");
    // More equalities than variables, all of which a pose meets.
    let mut random = Random::new(8);
    let meets = random_pose(&rig, &mut random);
    let mut problem = pulled(&rig, hand, far, 1e-3);
    for joint in [1, 2, 3].map(JointId::from_index) {
        let frame = meets.frame(joint).unwrap();
        problem.add_hard(PoseTarget::new(joint, frame.position, frame.rotation));
    }
    let found = hard_cases::solve(PEER, &problem, &mut rig.rest_pose());
    assert!(found.missed < 1e-6, "{}", found.missed);
    // What contradicts is told, and the pose misses no more than it has to.
    let mut problem = pulled(&rig, hand, far, 1e-3);
    for least in [0.85, 0.75] {
        problem.add_hard(Distance::new([JointId::from_index(0), hand], Bound::Exactly(least)));
    }
    let mut pose = rig.rest_pose();
    let found = hard_cases::solve(PEER, &problem, &mut pose);
    let reach = world_matrices(&pose)[3].w_axis.truncate().length();
    assert!(
        found.is_told && found.missed > 0.04 && (0.74..0.86).contains(&reach),
        "{} {reach}",
        found.missed
    );
}

#[test]
fn every_stop_rule_stops() {
    let (rig, hand) = arm();
    let mut problem = Problem::whole_body(&rig);
    let id = problem.add(1.0, Position::new(hand, DVec3::new(0.5, 0.4, 0.2)));
    problem.term_mut(id).loss = Loss::Norm;
    let run = |options: SolverOptions, problem: &Problem| solve(options, problem, &mut rig.rest_pose());
    let bar = SolverOptions { cost_below: Some(0.005), ..PEER };
    let (cost, stop, iterations) = run(bar, &problem);
    assert!(cost < 0.005 && stop == StopReason::Reached && iterations < 100, "{cost} {stop:?} {iterations}");
    for max_iterations in [0, 1, 2, 5] {
        let few = SolverOptions { max_iterations, cost_below: Some(1e-300), ..PEER };
        let (_, stop, iterations) = run(few, &problem);
        assert_eq!((stop, iterations), (StopReason::IterationLimit, max_iterations));
    }
    let none = SolverOptions { max_time: Some(Duration::ZERO), ..bar };
    assert_eq!(run(none, &problem).1, StopReason::TimeBudget);
    problem[id].target = DVec3::new(9.0, 0.0, 1.0);
    assert_eq!(run(PEER, &problem).1, StopReason::Converged);
    let endless = SolverOptions {
        max_time: Some(Duration::from_millis(20)),
        search: Search::Global { max_restarts: 100_000_000 },
        ..bar
    };
    assert_eq!(run(endless, &problem).1, StopReason::TimeBudget);
}

#[test]
fn what_cannot_move_has_converged() {
    let (rig, hand) = arm();
    let mut problem = Problem::new(&rig, []).unwrap();
    problem.add(1.0, Position::new(hand, DVec3::ZERO));
    let (cost, stop, _) = solve(PEER, &problem, &mut rig.rest_pose());
    assert!(stop == StopReason::Converged && (cost - 0.81).abs() < 1e-12);
}

#[test]
fn invalid_input_is_not_touched() {
    let (rig, hand) = arm();
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(hand, DVec3::NAN));
    let solver = Solver::new(PEER);
    let mut workspace = solver.workspace(&problem);
    let mut pose = rig.rest_pose();
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    assert_eq!((report.stop, report.iterations), (StopReason::InvalidInput, 0));
    assert!(matches!(report.invalid, Some(Invalid::Term(0, _))));
    assert_eq!(pose, rig.rest_pose());
}

#[test]
fn the_same_input_gives_the_same_bits_on_any_thread() {
    let run = || {
        let rig = random_rig(12, 41);
        let hand = JointId::from_index(11);
        let problem = pulled(&rig, hand, DVec3::new(0.3, 0.2, -0.4), 0.01);
        let mut pose = rig.rest_pose();
        let (cost, ..) = solve(PEER, &problem, &mut pose);
        (cost.to_bits(), pose.coords().iter().map(|c| c.to_bits()).collect::<Vec<_>>())
    };
    let threads: Vec<_> = (0..4).map(|_| std::thread::spawn(run)).collect();
    let here = run();
    for thread in threads {
        assert_eq!(thread.join().unwrap(), here);
    }
}
