//! Hard rows: couplings, inequalities, contradictory and redundant ones, beside wishes on random rigs.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::time::Duration;

use glam::DVec3;
use ikiru_rig::{Cone, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{Bound, Coupling, Distance, Position, RestPose};
use ikiru_solve::{Problem, Solver, SolverOptions, StopReason};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

use crate::hard_cases::{Beside, Case, case, search, solve};

#[test]
fn the_known_pose_satisfies_every_case() {
    for number in 0..1000 {
        let Case { problem, mut feasible, .. } = case(number);
        let still = SolverOptions { max_iterations: 0, ..search(0) };
        let found = solve(still, &problem, &mut feasible);
        assert!(found.missed < 1e-9 && found.cost >= 0.0, "case {number}: {}", found.missed);
    }
}

#[test]
fn hard_rows_hold_wherever_they_can() {
    let n_cases = 1000;
    let (mut n_held, mut n_local) = (0, 0);
    for number in 0..n_cases {
        let Case { problem, start, .. } = case(number);
        let local = solve(search(0), &problem, &mut start.clone());
        let global = solve(search(16), &problem, &mut start.clone());
        // What does not hold is told.
        assert!(local.is_told && global.is_told, "case {number}");
        n_local += usize::from(local.missed < 1e-6);
        n_held += usize::from(global.missed < 1e-6);
    }
    assert!(n_held as f64 >= 0.995 * n_cases as f64, "{n_held} of {n_cases}, from one start {n_local}");
}

#[test]
fn constraints_hold_where_nothing_else_is_wanted() {
    let (mut n_held, mut most) = (0, 0);
    for number in 0..100 {
        let Case { mut problem, start, .. } = case(number);
        problem.terms_mut().iter_mut().for_each(|term| term.is_on = term.hard);
        let solver = Solver::new(search(0));
        let mut workspace = solver.workspace(&problem);
        let mut pose = start.clone();
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        n_held += usize::from(report.success);
        if report.success {
            most = most.max(report.iterations);
        }
    }
    assert!(n_held >= 95 && most < 60, "{n_held} of 100, in {most} iterations at most");
}

#[test]
fn a_constraint_that_nothing_moves_is_named_and_spoils_no_other() {
    for number in 0..30 {
        let mut random = Random::new(number);
        let rig = random_rig(10, number);
        let joint = JointId::from_index;
        // Nothing above the fifth joint moves.
        let mut problem = Problem::new(&rig, rig.ids().filter(|joint| joint.index() >= 5)).unwrap();
        let target = random_pose(&rig, &mut random).frame(joint(9)).unwrap().position;
        problem.add(1.0, Position::new(joint(9), target));
        let start = random_pose(&rig, &mut random);
        let apart = start.frame(joint(6)).unwrap().position.distance(start.frame(joint(9)).unwrap().position);
        problem.add_hard(Distance::new([joint(6), joint(9)], Bound::AtMost(apart)));
        let solver = Solver::new(search(0));
        let mut alone = start.clone();
        let mut workspace = solver.workspace(&problem);
        let expected = solver.solve(&problem, &mut alone, &mut workspace).cost;
        for bound in [Bound::AtLeast(50.0), Bound::Exactly(50.0)] {
            let mut problem = problem.clone();
            let idle = problem.add_hard(Distance::new([joint(0), joint(1)], bound));
            let mut pose = start.clone();
            let mut workspace = solver.workspace(&problem);
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            let term = report.terms[problem.position(idle).expect("it was added")];
            assert!(!report.success && !term.satisfied && term.residual > 40.0);
            let near = (report.cost - expected).abs() < 1e-9 * (1.0 + expected);
            assert!(near, "{number}: {} {expected}", report.cost);
        }
    }
}

/// A chain of balls in cones, 0.3 m long each, and a hand at its end.
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
fn reach(rig: &Rig, hand: JointId, target: DVec3) -> Problem {
    let mut problem = Problem::whole_body(rig);
    problem.add(1.0, Position::new(hand, target));
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(1e-3, RestPose::new(&joints, rig.rest_pose()));
    problem
}

/// Where the hand is, by what shares no code with the solver.
fn hand_of(pose: &Pose) -> DVec3 {
    world_matrices(pose)[3].w_axis.truncate()
}

const TARGET: DVec3 = DVec3::new(0.5, 0.5, 0.2);

/// The hand no higher than this.
fn below(joint: JointId, height: f64) -> Beside {
    Beside { joint, normal: DVec3::NEG_Y, least: -height }
}

#[test]
fn contradictory_rows_are_named_and_missed_as_little_as_can_be() {
    let (rig, hand) = arm();
    let mut problem = reach(&rig, hand, TARGET);
    // Three heights, of which the middle one misses least in all: 0.1 + 0.2.
    let ids = [0.1, 0.2, 0.4].map(|height| {
        let exactly = Beside { joint: hand, normal: DVec3::Y, least: height };
        [problem.add_hard(exactly), problem.add_hard(below(hand, height))]
    });
    for restarts in [0, 8] {
        let mut pose = rig.rest_pose();
        let solver = Solver::new(search(restarts));
        let mut workspace = solver.workspace(&problem);
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        assert!(!report.success && report.cost.is_finite());
        let height = hand_of(&pose).y;
        assert!((height - 0.2).abs() < 1e-3, "{restarts}: {height}");
        for (pair, wanted) in ids.iter().zip([0.1, 0.2, 0.4]) {
            for (id, sense) in pair.iter().zip([1.0, -1.0]) {
                let term = &report.terms[problem.position(*id).unwrap()];
                let missing = (sense * (height - wanted)).min(0.0).abs();
                assert!((term.residual - missing).abs() < 1e-9);
                assert_eq!(term.satisfied, missing < 1e-4, "{wanted}");
            }
        }
    }
}

#[test]
fn redundant_and_duplicate_rows_change_nothing() {
    let (rig, hand) = arm();
    let from = |n: usize, slacks: &[f64]| {
        let mut problem = reach(&rig, hand, TARGET);
        for _ in 0..n {
            problem.add_hard(below(hand, 0.25));
            problem.add_hard(Distance::new([JointId::from_index(0), hand], Bound::Exactly(0.7)));
        }
        for slack in slacks {
            problem.add_hard(below(hand, 0.25 + slack));
        }
        let mut pose = rig.rest_pose();
        let found = solve(search(0), &problem, &mut pose);
        assert!(found.missed < 1e-7, "{n}: {}", found.missed);
        (found.cost, hand_of(&pose))
    };
    let (cost, place) = from(1, &[]);
    assert!(place.y < 0.25 + 1e-7 && (place.length() - 0.7).abs() < 1e-7);
    for (n, slacks) in [(2, &[][..]), (5, &[]), (1, &[1e-9, 1e-3, 0.5])] {
        let (other, there) = from(n, slacks);
        assert!((other - cost).abs() < 1e-6 * cost && there.distance(place) < 1e-4, "{n}: {other}, {cost}");
    }
}

#[test]
fn a_start_far_outside_comes_in() {
    let (rig, hand) = arm();
    let mut problem = Problem::whole_body(&rig);
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(1e-3, RestPose::new(&joints, rig.rest_pose()));
    problem.add_hard(Distance::new([JointId::from_index(0), hand], Bound::AtMost(0.78)));
    problem.add_hard(Beside { joint: hand, normal: DVec3::Z, least: 0.25 });
    // Stretched out, where the distance has no derivative that bends an elbow, and beside it.
    for angle in [0.0, 0.05, -0.3] {
        let mut start = rig.rest_pose();
        start.set_rotation(JointId::from_index(1), glam::DQuat::from_rotation_z(angle)).unwrap();
        let found = solve(search(0), &problem, &mut start);
        assert!(found.missed < 1e-6, "{angle}: {}", found.missed);
        assert!(hand_of(&start).length() < 0.78 + 1e-6 && hand_of(&start).z > 0.25 - 1e-6);
    }
}

#[test]
fn rows_that_nothing_moves_are_judged_and_disturb_nothing() {
    let (rig, hand) = arm();
    let still = JointId::from_index(0);
    let mut problem = reach(&rig, hand, TARGET);
    let (mut plain, mut pose) = (rig.rest_pose(), rig.rest_pose());
    let cost = solve(search(0), &problem, &mut plain).cost;
    let met = problem.add_hard(below(still, 0.1));
    let unmet = problem.add_hard(below(still, -0.1));
    let solver = Solver::new(search(4));
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    let told = [met, unmet].map(|id| report.terms[problem.position(id).unwrap()].satisfied);
    assert!(told == [true, false] && !report.success);
    assert!((report.cost - cost).abs() < 1e-6 * cost, "{} {cost}", report.cost);
    // Nor does a problem in which nothing moves at all.
    let mut problem = Problem::new(&rig, []).unwrap();
    problem.add_hard(below(hand, -0.1));
    assert!((solve(search(4), &problem, &mut pose).missed - 0.1 - hand_of(&pose).y).abs() < 1e-9);
}

#[test]
fn hard_rows_need_nothing_soft_beside_them() {
    let (rig, hand) = arm();
    let mut problem = Problem::whole_body(&rig);
    problem.add_hard(Distance::new([JointId::from_index(0), hand], Bound::Exactly(0.75)));
    problem.add_hard(below(hand, -0.2));
    let mut pose = rig.rest_pose();
    pose.set_rotation(JointId::from_index(1), glam::DQuat::from_rotation_z(0.1)).unwrap();
    let solver = Solver::new(search(0));
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    assert!(report.success && report.stop == StopReason::Reached && report.cost == 0.0, "{report:?}");
    assert!(report.terms.iter().all(|t| t.residual < 1e-6), "{:?}", report.terms);
    assert!(report.iterations < 30, "{}", report.iterations);
}

#[test]
fn with_every_joint_at_a_limit_hard_rows_pull_away_or_are_told() {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    for idx in 0..4 {
        let mut joint = Joint::new(format!("joint_{idx}"), parent);
        joint.rest_translation = if idx == 0 { DVec3::ZERO } else { DVec3::X * 0.3 };
        if idx < 3 {
            joint.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::new(0.0, 1.0) };
        }
        parent = Some(builder.add(joint));
    }
    let (rig, hand) = (builder.build().unwrap(), parent.unwrap());
    for (height, holds) in [(0.3_f64, true), (-0.1, false)] {
        // The reach presses all of them against their lower ends.
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, Position::new(hand, DVec3::new(0.9, -0.5, 0.0)));
        problem.add_hard(Beside { joint: hand, normal: DVec3::Y * height.signum(), least: height.abs() });
        let mut pose = rig.rest_pose();
        let found = solve(search(0), &problem, &mut pose);
        assert_eq!(found.missed < 1e-7, holds, "{height}: {}", found.missed);
        let stays = pose.coords().iter().all(|angle| angle.abs() < 1e-9);
        assert_eq!(stays, !holds, "{height}: {:?}", pose.coords());
    }
}

#[test]
fn a_hard_term_that_is_off_asks_for_nothing() {
    let (rig, hand) = arm();
    let mut problem = reach(&rig, hand, TARGET);
    let plain = solve(search(0), &problem, &mut rig.rest_pose()).cost;
    let id = problem.add_hard(below(hand, 0.1));
    let solver = Solver::new(search(0));
    let mut workspace = solver.workspace(&problem);
    for is_on in [true, false, true, false] {
        problem.term_mut(id).is_on = is_on;
        let mut pose = rig.rest_pose();
        let cost = solver.solve(&problem, &mut pose, &mut workspace).cost;
        let height = hand_of(&pose).y;
        if is_on {
            assert!(height < 0.1 + 1e-7 && cost > 2.0 * plain, "{height}, {cost}");
        } else {
            assert!(height > 0.3 && (cost - plain).abs() < 1e-9 * plain, "{height}, {cost}, {plain}");
        }
    }
}

#[test]
fn the_best_pose_so_far_comes_back_when_time_or_iterations_are_over() {
    let mut n_cut = 0;
    for number in 0..60 {
        let Case { problem, start, .. } = case(number);
        let to_the_end = solve(search(0), &problem, &mut start.clone()).missed;
        let mut missed = f64::INFINITY;
        for max_iterations in [0, 1, 2, 4, 8, 16, 64] {
            let few = SolverOptions { max_iterations, ..search(0) };
            let found = solve(few, &problem, &mut start.clone());
            n_cut += usize::from(found.missed > to_the_end + 1e-6);
            if max_iterations == 0 {
                missed = found.missed;
            }
        }
        // What is hard comes first: in sum it is missed no more than at the start.
        assert!(to_the_end <= 30.0 * missed.max(1e-6), "case {number}: {to_the_end}, at the start {missed}");
        let none = SolverOptions { max_time: Some(Duration::ZERO), ..search(16) };
        let mut pose = start.clone();
        let solver = Solver::new(none);
        let mut workspace = solver.workspace(&problem);
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        assert!(matches!(report.stop, StopReason::TimeBudget | StopReason::Reached), "{:?}", report.stop);
        assert_eq!(report.iterations, 0);
        let short = SolverOptions { max_time: Some(Duration::from_millis(2)), ..search(1_000_000) };
        // A million restarts would go on for minutes.
        let report = Solver::new(short).solve(&problem, &mut start.clone(), &mut workspace);
        assert!(report.success || report.stop == StopReason::TimeBudget, "case {number}: {:?}", report.stop);
    }
    assert!(n_cut > 60, "{n_cut}");
}

#[test]
fn couplings_meet_at_their_corners() {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    for idx in 0..3 {
        let mut joint = Joint::new(format!("joint_{idx}"), parent);
        joint.rest_translation = DVec3::X * 0.3;
        joint.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::new(-1.0, 2.0) };
        parent = Some(builder.add(joint));
    }
    let (rig, ids) = (builder.build().unwrap(), [0, 1, 2].map(JointId::from_index));
    let mut problem = Problem::whole_body(&rig);
    let mut up = rig.rest_pose();
    ids.iter().for_each(|joint| up.set_value(*joint, 1.5).unwrap());
    problem.add(1.0, RestPose::new(&ids, up));
    // a + b ≤ 1, b + c ≤ 1, a = 2 c: the least squares are at a corner of the first two.
    for (angles, bound) in [
        ([(ids[0], None, 1.0), (ids[1], None, 1.0)], Bound::AtMost(1.0)),
        ([(ids[1], None, 1.0), (ids[2], None, 1.0)], Bound::AtMost(1.0)),
        ([(ids[0], None, 1.0), (ids[2], None, -2.0)], Bound::Exactly(0.0)),
    ] {
        problem.add_hard(Coupling::new(&rig, &angles, bound).unwrap());
    }
    let mut pose = rig.rest_pose();
    let found = solve(search(0), &problem, &mut pose);
    // With c = t, a = 2 t, b ≤ 1 − 2 t: (2t − 1.5)² + (−0.5 − 2t)² + (t − 1.5)² has its least value at 7/18.
    let t = 7.0 / 18.0;
    let wanted = [2.0 * t, 1.0 - 2.0 * t, t];
    assert!(found.missed < 1e-7, "{}", found.missed);
    for (joint, wanted) in ids.into_iter().zip(wanted) {
        assert!((pose.value(joint).unwrap() - wanted).abs() < 1e-5, "{:?} {wanted}", pose.coords());
    }
}
