//! Frame by frame: how far a solve goes by default, where it ends, and what it leaves alone.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::DVec3;
use ikiru_rig::{Joint, JointId, JointMotion, Pose, Rig, RigBuilder};
use ikiru_solve::objectives::{Bound, Distance, Position, RestPose};
use ikiru_solve::{Problem, Report, Search, Settle, Solver, SolverOptions, StopReason, TermId, Tolerance};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

fn fully() -> SolverOptions {
    SolverOptions { settle: Settle::Fully, ..SolverOptions::default() }
}

fn solve(options: SolverOptions, problem: &Problem, pose: &mut Pose) -> Report<'static> {
    let solver = Solver::new(options);
    solver.solve(problem, pose, &mut solver.workspace(problem)).into_owned()
}

/// A reach of the last joint, with a weak pull to the rest pose.
fn reach(rig: &Rig, target: DVec3) -> (Problem, TermId<Position>, JointId) {
    let tip = JointId::from_index(rig.n_joints() - 1);
    let mut problem = Problem::whole_body(rig);
    let id = problem.add(1.0, Position::new(tip, target));
    let joints: Vec<JointId> = problem.active().collect();
    let rest = problem.add(1e-4, RestPose::new(&joints, rig.rest_pose()));
    problem.term_mut(rest).mandatory = false;
    (problem, id, tip)
}

#[test]
fn a_target_that_moves_is_met_well_in_a_few_iterations_a_frame() {
    let mut random = Random::new(1);
    let (mut n_frames, mut n_lost, mut n_met, mut n_well, mut iterations, mut to_the_end) =
        (0, 0, 0, 0, 0, 0);
    for case in 0..30 {
        let rig = random_rig(5 + random.below(10), 300 + case);
        let [mut goal, mut other] = [(); 2].map(|()| random_pose(&rig, &mut random));
        goal.project();
        other.project();
        let (mut problem, id, tip) = reach(&rig, DVec3::ZERO);
        let mut pose = goal.clone();
        for frame in 0..40 {
            let at = goal.interpolate(&other, f64::from(frame) / 100.0).unwrap();
            problem[id].target = world_matrices(&at)[tip.index()].w_axis.truncate();
            let full = solve(fully(), &problem, &mut pose.clone());
            to_the_end += full.iterations;
            let report = solve(SolverOptions::default(), &problem, &mut pose);
            let missed = world_matrices(&pose)[tip.index()].w_axis.truncate().distance(problem[id].target);
            n_frames += 1;
            n_lost += usize::from(full.success && !report.success);
            iterations += report.iterations;
            if report.stop == StopReason::Reached {
                assert!(missed < 1e-3 && report.iterations >= 1, "case {case}, {frame}: {missed}");
                n_met += 1;
                // Well within its tolerance, but where the pull to the rest pose holds it at its edge.
                n_well += usize::from(missed < 0.3e-3);
            }
        }
    }
    assert!(
        n_met > 1100 && n_lost < 3 && n_well * 100 > n_met * 95,
        "{n_lost}, {n_well}, {n_met} of {n_frames}"
    );
    assert!(iterations < 4 * n_frames && to_the_end > 3 * iterations, "{iterations}, {to_the_end}");
}

#[test]
fn what_cannot_be_met_is_left_soon_and_costs_next_to_no_more() {
    let mut random = Random::new(2);
    let (mut n_missed, mut slow, mut least, mut settled) = (0, 0, 0.0, 0.0);
    for case in 0..40 {
        let rig = random_rig(4 + random.below(8), 500 + case);
        let (problem, ..) = reach(&rig, random.rotation() * DVec3::X * 20.0);
        let mut pose = rig.rest_pose();
        // The frame before was out of reach as well.
        if solve(fully(), &problem, &mut pose).success {
            continue;
        }
        n_missed += 1;
        pose.retract(&vec![0.01; rig.n_dofs()]).unwrap();
        least += solve(fully(), &problem, &mut pose.clone()).cost;
        let report = solve(SolverOptions::default(), &problem, &mut pose);
        assert_eq!(report.stop, StopReason::Converged, "case {case}");
        settled += report.cost;
        slow += usize::from(report.iterations > 12);
    }
    assert!(n_missed > 15 && settled < 1.001 * least && slow < 3, "{n_missed} {settled} {least} {slow}");
}

#[test]
fn a_frame_that_is_met_already_takes_one_step_towards_its_optimum() {
    let mut random = Random::new(3);
    for case in 0..20 {
        let rig = random_rig(8, 700 + case);
        let start = random_pose(&rig, &mut random);
        let tip = rig.n_joints() - 1;
        let (problem, ..) = reach(&rig, world_matrices(&start)[tip].w_axis.truncate());
        let (mut pose, mut cost) = (start.clone(), solve(fully_still(), &problem, &mut start.clone()).cost);
        for _ in 0..3 {
            let report = solve(SolverOptions::default(), &problem, &mut pose);
            assert!(report.success && report.iterations >= 1 && report.cost <= cost, "case {case}");
            cost = report.cost;
        }
    }
}

/// Looks and does nothing.
fn fully_still() -> SolverOptions {
    SolverOptions { max_iterations: 0, ..SolverOptions::default() }
}

#[test]
fn it_is_solved_fully_where_no_tolerance_or_more_than_one_start_decides() {
    let mut random = Random::new(4);
    for case in 0..20 {
        let rig = random_rig(6, 800 + case);
        let target = world_matrices(&random_pose(&rig, &mut random))[5].w_axis.truncate();
        let (mut problem, id, _) = reach(&rig, target);
        let both = |options: SolverOptions, problem: &Problem| {
            [Settle::Tolerances, Settle::Fully].map(|settle| {
                let mut pose = rig.rest_pose();
                solve(SolverOptions { settle, ..options }, problem, &mut pose);
                pose
            })
        };
        let below = SolverOptions { cost_below: Some(1e-12), ..SolverOptions::default() };
        let global = SolverOptions { search: Search::Global { max_restarts: 2 }, ..SolverOptions::default() };
        for options in [below, global] {
            let [a, b] = both(options, &problem);
            assert_eq!(a, b, "case {case}");
        }
        problem.term_mut(id).mandatory = false;
        let [a, b] = both(SolverOptions::default(), &problem);
        assert_eq!(a, b, "case {case}");
    }
}

#[test]
fn constraints_of_a_frame_are_held_within_their_tolerance_too() {
    let mut random = Random::new(5);
    let mut n_held = 0;
    for case in 0..40 {
        let rig = random_rig(8, 900 + case);
        let feasible = random_pose(&rig, &mut random);
        let places = world_matrices(&feasible).into_iter().map(|m| m.w_axis.truncate()).collect::<Vec<_>>();
        let (mut problem, ..) = reach(&rig, places[7]);
        let (a, b) = (JointId::from_index(2), JointId::from_index(6));
        problem.add_hard(Distance::new([a, b], Bound::Exactly(places[2].distance(places[6]))));
        let mut pose = feasible.clone();
        pose.retract(&vec![0.05; rig.n_dofs()]).unwrap();
        pose.project();
        let report = solve(SolverOptions::default(), &problem, &mut pose);
        if report.success {
            let found = world_matrices(&pose);
            let apart = found[2].w_axis.truncate().distance(found[6].w_axis.truncate());
            assert!(
                (apart - places[2].distance(places[6])).abs() < 0.3 * Tolerance::HARD.metres,
                "case {case}"
            );
            n_held += 1;
        }
    }
    assert!(n_held > 35, "{n_held}");
}

/// Two arms of three balls each, to either side of a root; the joints at their ends.
fn arms() -> (Rig, [JointId; 2]) {
    let mut builder = RigBuilder::new();
    let root = builder.add(Joint::new("root", None));
    let ends = [1.0, -1.0].map(|side| {
        let mut parent = root;
        for number in 0..4 {
            let rest_translation = DVec3::X * side * if number == 0 { 0.2 } else { 0.3 };
            let motion = if number < 3 { JointMotion::BALL } else { JointMotion::Fixed };
            let name = format!("{side} {number}");
            parent = builder.add(Joint { rest_translation, motion, ..Joint::new(name, Some(parent)) });
        }
        parent
    });
    (builder.build().unwrap(), ends)
}

#[test]
fn a_frame_with_a_constraint_moves_on_from_a_pose_that_holds_it_exactly() {
    let (rig, [left, _]) = arms();
    let elbow = JointId::from_index(left.index() - 1);
    for max_iterations in [500, 2] {
        let mut start = rig.rest_pose();
        start.retract(&vec![0.2; rig.n_dofs()]).unwrap();
        let places = |pose: &Pose, joint: JointId| world_matrices(pose)[joint.index()].w_axis.truncate();
        let mut problem = Problem::whole_body(&rig);
        let from = places(&start, left);
        let id = problem.add(1.0, Position::new(left, from));
        let height = places(&start, elbow).distance(DVec3::ZERO);
        problem.add_hard(Distance::new([JointId::from_index(0), elbow], Bound::Exactly(height)));
        let options = SolverOptions { max_iterations, ..SolverOptions::default() };
        let (solver, mut pose) = (Solver::new(options), start);
        let mut workspace = solver.workspace(&problem);
        for frame in 1..200 {
            // Two millimetres a frame, there and back.
            let way = 0.002 * f64::from(if frame < 100 { frame } else { 200 - frame });
            problem[id].target = from - way * from.normalize();
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            assert!(report.success, "{max_iterations}, {frame}: {report:?}");
            assert!(places(&pose, left).distance(problem[id].target) < 1e-3);
            let apart = places(&pose, elbow).length();
            assert!((apart - height).abs() < Tolerance::HARD.metres, "{max_iterations}, {frame}");
        }
    }
}

#[test]
fn what_can_be_met_is_met_beside_what_is_far_out_of_reach() {
    let (rig, [left, right]) = arms();
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(left, DVec3::new(4.0, 1.0, 0.0)));
    let id = problem.add(1.0, Position::new(right, DVec3::ZERO));
    let solver = Solver::default();
    let mut workspace = solver.workspace(&problem);
    let mut pose = rig.rest_pose();
    pose.retract(&vec![0.3; rig.n_dofs()]).unwrap();
    for frame in 0..200 {
        let angle = 0.02 * f64::from(frame);
        problem[id].target = DVec3::new(-0.6 + 0.25 * angle.cos(), 0.25 * angle.sin(), 0.2);
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        let missed = world_matrices(&pose)[right.index()].w_axis.truncate().distance(problem[id].target);
        assert!(missed < 1e-3 && !report.success, "{frame}: {missed}");
        assert!(frame == 0 || report.iterations < 40, "{frame}: {}", report.iterations);
    }
    // The other arm is stretched towards where it cannot get.
    let place = world_matrices(&pose)[left.index()].w_axis.truncate();
    let way = DVec3::new(4.0, 1.0, 0.0) - DVec3::X * 0.2;
    assert!((place - DVec3::X * 0.2).angle_between(way) < 0.01, "{place}");
}
