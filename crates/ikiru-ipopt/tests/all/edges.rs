//! At the edges of cones an answer of lm is a minimum: Ipopt, which starts there, finds none that is lower.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![allow(clippy::print_stderr, reason = "a measurement prints what it finds")]

use ikiru_ipopt::IPOPT;
use ikiru_rig::JointId;
use ikiru_solve::objectives::{Position, RestPose};
use ikiru_solve::{Method, Problem, Settle, Solver, SolverOptions};
use ikiru_testkit::cones::without_centres;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// In how many of `n_cases` Ipopt finds a lower cost next to the answer, and the iterations that lm took. The pull is to the rest
/// pose, which lies outside the cones that have a centre of their own.
fn missed(n_cases: u64, has_centres: bool, pull: f64) -> (usize, usize) {
    let mut random = Random::new(11);
    let (mut n_missed, mut n_iterations) = (0, 0);
    for case in 0..n_cases {
        let rig = random_rig(3 + random.below(12), 7000 + case);
        let rig = if has_centres { rig } else { without_centres(&rig) };
        let hand = JointId::from_index(rig.n_joints() - 1);
        let mut problem = Problem::whole_body(&rig);
        let target = random_pose(&rig, &mut random).frame(hand).unwrap().position;
        problem.add(1.0, Position::new(hand, target));
        let joints: Vec<JointId> = problem.active().collect();
        problem.add(pull, RestPose::new(&joints, rig.rest_pose()));
        let mut pose = random_pose(&rig, &mut random);
        let mut solve = |method| {
            let solver =
                Solver::new(SolverOptions { method, settle: Settle::Fully, ..SolverOptions::default() });
            let mut workspace = solver.workspace(&problem);
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            let (cost, iterations) = (report.cost, report.iterations);
            (cost, iterations, pose.clone())
        };
        let (cost, iterations, answer) = solve(Method::Lm);
        let (lower, _, other) = solve(IPOPT);
        n_iterations += iterations;
        // Further away it is another minimum.
        let way = answer.coords().iter().zip(other.coords()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        n_missed += usize::from(cost - lower > 1e-5 * cost && way < 0.15);
    }
    (n_missed, n_iterations)
}

#[test]
fn answers_at_edges_are_minima() {
    for (has_centres, pull) in [(true, 0.5), (true, 0.05), (false, 0.5)] {
        let (n_missed, n_iterations) = missed(60, has_centres, pull);
        assert!(n_missed == 0 && n_iterations < 60 * 35, "{has_centres}, {pull}: {n_missed}, {n_iterations}");
    }
}

/// What ARCHITECTURE.md tells.
#[test]
#[ignore = "minutes"]
fn how_many_answers_at_edges_are_no_minima() {
    for (has_centres, pull) in [(true, 0.5), (true, 0.05), (false, 0.5), (false, 0.01)] {
        let found = missed(400, has_centres, pull);
        eprintln!("{has_centres}, {pull}: missed {}, iterations {}", found.0, found.1);
    }
}
