//! Hard rows: couplings, inequalities, contradictory and redundant ones, beside wishes on random rigs.

use glam::DVec3;
use ikiru_rig::{JointId, JointMotion, Pose, Rig};
use ikiru_solve::objectives::{Bound, Coupling, Distance, Position, RestPose};
use ikiru_solve::{Problem, Report, Search, Solver, SolverOptions};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// A problem whose hard rows a pose is known to satisfy, and where a solve starts.
pub(crate) struct Case {
    pub(crate) problem: Problem,
    pub(crate) start: Pose,
}

/// A sum of random angles of a rig, as a constraint that `pose` keeps: exactly, or with something to spare.
fn coupling(rig: &Rig, random: &mut Random, pose: &Pose) -> Option<Coupling> {
    let mut angles = Vec::new();
    for _ in 0..1 + random.below(3) {
        let joint = JointId::from_index(random.below(rig.n_joints()));
        let factor = random.between(-1.0, 1.0);
        let axis = match rig.get(joint)?.motion {
            JointMotion::Fixed | JointMotion::Slider { .. } => continue,
            JointMotion::Hinge { .. } => None,
            JointMotion::Euler { .. } => Some(DVec3::AXES[random.below(3)]),
            JointMotion::Ball { .. } | JointMotion::Free { .. } => Some(random.vector(1.0)),
        };
        if rig.get(joint)?.mimic.is_none() {
            angles.push((joint, axis, factor));
        }
    }
    let mut coupling = Coupling::new(rig, &angles, Bound::AtMost(-FAR)).ok()?;
    let value = residual(rig, coupling.clone(), pose) - FAR;
    coupling.bound = match random.below(3) {
        0 => Bound::Exactly(value),
        1 => Bound::AtLeast(value - random.between(0.0, 0.1)),
        _ => Bound::AtMost(value + random.between(0.0, 0.1)),
    };
    Some(coupling)
}

/// Below every sum of angles, so that the length of a residual has no sign to lose.
const FAR: f64 = 100.0;

/// The length of the residual of an objective at a pose.
fn residual<T: ikiru_solve::Objective + Clone>(rig: &Rig, objective: T, pose: &Pose) -> f64 {
    let mut problem = Problem::new(rig, []);
    problem.add(1.0, objective);
    let solver = Solver::default();
    let mut workspace = solver.workspace(&problem);
    solver.solve(&problem, &mut pose.clone(), &mut workspace).terms[0].residual
}

/// One to ten constraints that one random pose satisfies; a reach and a rest pose as wishes; the start is another pose.
pub(crate) fn case(number: u64) -> Case {
    let mut random = Random::new(number);
    let rig = random_rig(4 + random.below(10), number);
    let feasible = random_pose(&rig, &mut random);
    let mut problem = Problem::whole_body(&rig);
    let joint = |random: &mut Random| JointId::from_index(random.below(rig.n_joints()));
    let target = random_pose(&rig, &mut random).frame(JointId::from_index(rig.n_joints() - 1)).origin.value();
    problem.add(1.0, Position::new(JointId::from_index(rig.n_joints() - 1), target));
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(0.05, RestPose::new(&joints, rig.rest_pose()));
    for _ in 0..1 + random.below(10) {
        if random.below(2) == 0 {
            let (a, b) = (joint(&mut random), joint(&mut random));
            if a == b {
                continue;
            }
            let frames = [a, b].map(|joint| feasible.frame(joint).origin.value());
            let apart = frames[0].distance(frames[1]);
            let bound = if random.below(2) == 0 {
                Bound::AtLeast((apart - random.between(0.0, 0.05)).max(0.0))
            } else {
                Bound::AtMost(apart + random.between(0.0, 0.05))
            };
            problem.add_hard(Distance::new([a, b], bound));
        } else if let Some(coupling) = coupling(&rig, &mut random, &feasible) {
            problem.add_hard(coupling);
        }
    }
    let start = random_pose(&rig, &mut random);
    Case { problem, start }
}

/// The most that a hard term misses (metres or radians).
pub(crate) fn missed(report: &Report<'_>) -> f64 {
    report.terms.iter().filter(|t| t.hard).map(|t| t.residual).fold(0.0, f64::max)
}

#[test]
fn hard_rows_hold_wherever_they_can() {
    let n_cases = 1000;
    let (mut n_held, mut n_local) = (0, 0);
    for number in 0..n_cases {
        let Case { problem, start } = case(number);
        for search in [Search::Local, Search::Global { max_restarts: 16 }] {
            let solver = Solver::new(SolverOptions { search, ..SolverOptions::default() });
            let mut workspace = solver.workspace(&problem);
            let mut pose = start.clone();
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            assert!(report.invalid.is_none(), "{:?}", report.invalid);
            let held = missed(&report) < 1e-6;
            match search {
                Search::Local => n_local += usize::from(held),
                Search::Global { .. } => n_held += usize::from(held),
            }
            assert!(pose.limit_violation() < 1e-9);
        }
    }
    assert!(n_held as f64 >= 0.995 * n_cases as f64, "{n_held} of {n_cases}, from one start {n_local}");
}

#[test]
fn constraints_hold_where_nothing_else_is_wanted() {
    let (mut n_held, mut most) = (0, 0);
    for number in 0..100 {
        let Case { mut problem, start } = case(number);
        problem.terms_mut().iter_mut().for_each(|term| term.is_on = term.hard);
        let solver = Solver::default();
        let mut workspace = solver.workspace(&problem);
        let mut pose = start.clone();
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        n_held += usize::from(report.success);
        if report.success {
            most = most.max(report.iterations);
        }
    }
    assert!(n_held >= 97 && most < 60, "{n_held} of 100, in {most} iterations at most");
}

#[test]
fn a_constraint_that_nothing_moves_is_named_and_spoils_no_other() {
    for number in 0..30 {
        let mut random = Random::new(number);
        let rig = random_rig(10, number);
        let joint = JointId::from_index;
        // Nothing above the fifth joint moves.
        let mut problem = Problem::new(&rig, rig.ids().filter(|joint| joint.index() >= 5));
        let target = random_pose(&rig, &mut random).frame(joint(9)).origin.value();
        problem.add(1.0, Position::new(joint(9), target));
        let start = random_pose(&rig, &mut random);
        let apart = start.frame(joint(6)).origin.value().distance(start.frame(joint(9)).origin.value());
        problem.add_hard(Distance::new([joint(6), joint(9)], Bound::AtMost(apart)));
        let solver = Solver::default();
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
