//! What a solve promises: limits at every iterate, the same bits twice, reasons for every end.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::time::Duration;

use glam::{DMat4, DQuat, DVec3, DVec4};
use ikiru_rig::{Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{
    Direction, Gaze, JointAngles, KnownRotation, LookAt, Orientation, PoseTarget, Position, RestPose,
};
use ikiru_solve::{
    ForceBy, Invalid, LimitKind, Loss, Method, Problem, Search, Settle, Solver, SolverOptions, StopReason,
    Tolerance, Unit,
};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::{Random, random_pose, random_rig, rigs};
use proptest::prelude::*;

/// Shoulder (Euler), elbow (hinge), hand: 0.3 m and 0.25 m long, along +x.
fn arm() -> Rig {
    let mut builder = RigBuilder::new();
    let mut shoulder = Joint::new("shoulder", None);
    shoulder.motion =
        JointMotion::Euler { order: Default::default(), ranges: [Range::degrees(-90.0, 90.0); 3] };
    let shoulder = builder.add(shoulder);
    let mut elbow = Joint::new("elbow", Some(shoulder));
    elbow.rest_translation = DVec3::new(0.3, 0.0, 0.0);
    elbow.motion = JointMotion::Hinge { axis: DVec3::Y, range: Range::degrees(-150.0, 0.0) };
    let elbow = builder.add(elbow);
    let mut hand = Joint::new("hand", Some(elbow));
    hand.rest_translation = DVec3::new(0.25, 0.0, 0.0);
    builder.add(hand);
    builder.build().unwrap()
}

fn global(max_restarts: usize) -> SolverOptions {
    SolverOptions { search: Search::Global { max_restarts }, ..SolverOptions::default() }
}

fn ignore<T>(_: T) {}

/// A frame of `random_pose` for one joint, as targets that can be reached.
fn reachable(rig: &Rig, joint: JointId, random: &mut Random) -> (DVec3, DQuat) {
    let frame = random_pose(rig, random).frame(joint).unwrap();
    (frame.position, frame.rotation)
}

/// Position and rotation of a joint, recomputed by matrices.
fn recomputed(pose: &Pose, joint: JointId) -> DMat4 {
    world_matrices(pose)[joint.index()]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn limits_hold_at_every_iterate_and_the_rest_stays((rig, seed) in rigs(24), which in 0..Method::ALL.len()) {
        let mut random = Random::new(seed);
        let joint = JointId::from_index(rig.n_joints() - 1);
        let active: Vec<JointId> = rig.ids().filter(|_| random.unit() < 0.8).collect();
        let mut problem = Problem::new(&rig, active).unwrap();
        let (position, rotation) = reachable(&rig, joint, &mut random);
        problem.add(1.0, PoseTarget::new(joint, position * 1.3, rotation));
        let start = random_pose(&rig, &mut random);
        let method = Method::ALL[which];
        let mut costs = Vec::new();
        // The pose after at most k iterations, for each k: all iterates, since a solve repeats itself.
        for max_iterations in 0..12 {
            let solver = Solver::new(SolverOptions { method, max_iterations, ..Default::default() });
            let mut pose = start.clone();
            let mut workspace = solver.workspace(&problem);
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            prop_assert!(pose.limit_violation() < 1e-9, "{}", pose.limit_violation());
            prop_assert!(pose.is_valid() && report.cost.is_finite());
            for id in rig.ids().filter(|j| !problem.is_active(*j)) {
                prop_assert_eq!(&pose.coords()[rig.coords_of(id)], &start.coords()[rig.coords_of(id)]);
            }
            costs.push(report.cost);
        }
        prop_assert!(costs.is_sorted_by(|a, b| a >= b), "the best pose comes back: {:?}", costs);
    }

    #[test]
    fn what_is_reported_is_what_matrices_say((rig, seed) in rigs(24)) {
        let mut random = Random::new(seed);
        let joint = JointId::from_index(random.below(rig.n_joints()));
        let (position, rotation) = reachable(&rig, joint, &mut random);
        let mut problem = Problem::whole_body(&rig);
        problem.add(2.0, PoseTarget::new(joint, position, rotation));
        problem.add(0.5, Direction::new(joint, DVec3::Y, rotation * DVec3::Y));
        let solver = Solver::new(global(8));
        let mut pose = rig.rest_pose();
        let mut workspace = solver.workspace(&problem);
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        let m = recomputed(&pose, joint);
        let distance = m.w_axis.truncate().distance(position);
        let turned = DQuat::from_mat4(&m).angle_between(rotation);
        let angle = m.transform_vector3(DVec3::Y).angle_between(rotation * DVec3::Y);
        prop_assert!((report.terms[0].residual - distance).abs() < 1e-9);
        prop_assert!((report.terms[0].others[0].residual - turned).abs() < 1e-6);
        prop_assert!((report.terms[1].residual - angle).abs() < 1e-6);
        let cost = 2.0 * (distance * distance + turned * turned) + 0.5 * angle * angle;
        prop_assert!((report.cost - cost).abs() < 1e-5 * (1.0 + cost));
        let met = distance <= 1e-3 && turned <= 0.5_f64.to_radians() && angle <= 0.5_f64.to_radians();
        prop_assert_eq!(report.success, met);
        prop_assert_eq!(report.stop == StopReason::Reached, met);
    }

    #[test]
    fn the_same_input_gives_the_same_bits((rig, seed) in rigs(24)) {
        let mut random = Random::new(seed);
        let joint = JointId::from_index(rig.n_joints() - 1);
        let mut problem = Problem::whole_body(&rig);
        let id = problem.add(1.0, Position::new(joint, random.vector(0.6)));
        let solver = Solver::new(global(4));
        let mut used = solver.workspace(&problem);
        let mut other = rig.rest_pose();
        solver.solve(&problem, &mut other, &mut used); // a workspace that has seen another target
        problem[id].target = random.vector(0.6);
        let (mut a, mut b) = (rig.rest_pose(), rig.rest_pose());
        let cost = solver.solve(&problem, &mut a, &mut used).cost;
        let again = solver.solve(&problem, &mut b, &mut solver.workspace(&problem)).cost;
        prop_assert_eq!(cost.to_bits(), again.to_bits());
        for (x, y) in a.coords().iter().zip(b.coords()) {
            prop_assert_eq!(x.to_bits(), y.to_bits());
        }
    }
}

#[test]
fn reachable_targets_are_reached_on_trees_with_every_motion() {
    let mut random = Random::new(11);
    let (mut solved, mut all) = (0, 0);
    for case in 0..400 {
        let rig = random_rig(2 + random.below(20), 900 + case);
        let joint = JointId::from_index(rig.n_joints() - 1);
        let (position, rotation) = reachable(&rig, joint, &mut random);
        let mut problem = Problem::whole_body(&rig);
        let id = problem.add(1.0, PoseTarget::new(joint, position, rotation));
        problem.term_mut(id).tolerance = Tolerance { metres: 1e-5, radians: 1e-5 };
        let solver = Solver::new(global(64));
        let mut pose = rig.rest_pose();
        let mut workspace = solver.workspace(&problem);
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        all += 1;
        if report.success {
            solved += 1;
            let m = recomputed(&pose, joint);
            assert!(m.w_axis.abs_diff_eq(DVec4::from((position, 1.0)), 2e-5));
            assert!(DQuat::from_mat4(&m).angle_between(rotation) < 2e-5);
        }
    }
    assert!(solved as f64 >= 0.99 * f64::from(all), "{solved} of {all}");
}

#[test]
fn a_pose_with_a_pull_to_rest_converges_to_the_minimum() {
    // At a minimum inside the limits the gradient is zero: no small change makes the cost smaller.
    let rig = arm();
    let hand = rig.joint("hand").unwrap();
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(hand, DVec3::new(0.2, 0.1, 0.3)));
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(0.05, RestPose::new(&joints, rig.rest_pose()));
    let solver = Solver::new(SolverOptions { settle: Settle::Fully, ..SolverOptions::default() });
    let mut pose = rig.rest_pose();
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    assert_eq!(report.stop, StopReason::Converged);
    let best = report.cost;
    let evaluate = Solver::new(SolverOptions { max_iterations: 0, ..Default::default() });
    let mut random = Random::new(5);
    for _ in 0..1000 {
        let mut near = pose.clone();
        let tangent: Vec<f64> = (0..rig.n_dofs()).map(|_| random.between(-1e-3, 1e-3)).collect();
        near.retract(&tangent).unwrap();
        near.project();
        assert!(evaluate.solve(&problem, &mut near, &mut workspace).cost >= best - 1e-12);
    }
}

#[test]
fn an_unreachable_target_names_what_is_in_the_way() {
    let rig = arm();
    let [shoulder, elbow, hand] = ["shoulder", "elbow", "hand"].map(|n| rig.joint(n).unwrap());
    let solver = Solver::new(global(16));

    // Too far: nothing but reach.
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(hand, DVec3::new(2.0, 0.0, 0.0)));
    let mut pose = rig.rest_pose();
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    assert!(!report.success && report.stop == StopReason::Converged);
    assert!((report.terms[0].residual - 1.45).abs() < 1e-6, "stretched out");
    let [reach] = report.forces[..] else { panic!("{:?}", report.forces) };
    assert_eq!((reach.on, reach.by, reach.share), (Some(0), ForceBy::Reach { is_proven: true }, 1.0));
    assert!((reach.amount - 1.45).abs() < 1e-12 && reach.unit == Unit::Metres);

    // The elbow does not bend backwards.
    let mut problem = Problem::new(&rig, [elbow]).unwrap();
    problem.add(1.0, Position::new(hand, DVec3::new(0.3, 0.0, -0.25)));
    let mut pose = rig.rest_pose();
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    let [limit] = report.forces[..] else { panic!("{:?}", report.forces) };
    assert_eq!((limit.on, limit.by), (Some(0), ForceBy::Limit { joint: elbow, kind: LimitKind::Value }));
    assert_eq!(pose.value(elbow), Some(0.0));

    // Two terms that contradict each other.
    let mut problem = Problem::new(&rig, [shoulder]).unwrap();
    problem.add(1.0, Direction::new(shoulder, DVec3::X, DVec3::new(1.0, 0.5, 0.0)));
    problem.add(1.0, Direction::new(shoulder, DVec3::X, DVec3::new(1.0, -0.5, 0.0)));
    let mut pose = rig.rest_pose();
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    let [a, b] = report.forces[..] else { panic!("{:?}", report.forces) };
    assert_eq!((a.on, a.by, b.on, b.by), (Some(0), ForceBy::Term(1), Some(1), ForceBy::Term(0)));
}

#[test]
fn invalid_input_stops_at_once_and_leaves_the_pose() {
    let rig = arm();
    let hand = rig.joint("hand").unwrap();
    let solver = Solver::new(SolverOptions::default());
    let invalid = |change: &dyn Fn(&mut Problem)| {
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, Position::new(hand, DVec3::new(0.3, 0.2, 0.1)));
        change(&mut problem);
        let mut pose = rig.rest_pose();
        let mut workspace = solver.workspace(&problem);
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        assert_eq!((report.stop, report.success, report.iterations), (StopReason::InvalidInput, false, 0));
        assert_eq!(pose, rig.rest_pose());
        report.invalid.unwrap()
    };
    let term = |i: Invalid| if let Invalid::Term(idx, _) = i { idx } else { panic!("{i:?}") };
    let joint = |idx| JointId::from_index(idx);
    assert_eq!(term(invalid(&|p| ignore(p.add(1.0, Position::new(hand, DVec3::NAN))))), 1);
    assert_eq!(term(invalid(&|p| ignore(p.add(f64::NAN, Position::new(hand, DVec3::ZERO))))), 1);
    assert_eq!(term(invalid(&|p| ignore(p.add(-1.0, Position::new(hand, DVec3::ZERO))))), 1);
    assert_eq!(term(invalid(&|p| ignore(p.add(1.0, Position::new(joint(77), DVec3::ZERO))))), 1);
    assert_eq!(
        term(invalid(&|p| ignore(p.add(1.0, Orientation::new(hand, DQuat::from_array([0.0; 4])))))),
        1
    );
    assert_eq!(term(invalid(&|p| ignore(p.add(1.0, LookAt::new(hand, DVec3::ZERO, DVec3::X))))), 1);
    let gaze = Gaze::OffsetFromTip { length: f64::NAN, offset: DVec3::X };
    assert_eq!(
        term(invalid(&|p| ignore(p.add(1.0, LookAt { gaze, ..LookAt::new(hand, DVec3::X, DVec3::X) })))),
        1
    );
    let huber = Loss::Huber { width: 0.0 };
    assert_eq!(
        term(invalid(&|p| {
            let id = p.add(1.0, Position::new(hand, DVec3::ZERO));
            p.term_mut(id).loss = huber;
        })),
        1
    );
    // An angle for a joint that has none.
    assert_eq!(
        term(invalid(&|p| ignore(p.add(1.0, KnownRotation::new(&[(joint(0), JointAngles::Value(0.0))]))))),
        1
    );
    let nan = [(joint(1), JointAngles::Value(f64::NAN))];
    assert_eq!(term(invalid(&|p| ignore(p.add(1.0, KnownRotation::new(&nan))))), 1);
    let other = arm();
    let rest = RestPose::new(&[joint(0)], random_rig(3, 2).rest_pose());
    assert_eq!(term(invalid(&|p| ignore(p.add(1.0, rest.clone())))), 1);

    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(hand, DVec3::X));
    let mut foreign = other.rest_pose();
    let mut workspace = solver.workspace(&problem);
    assert!(matches!(solver.solve(&problem, &mut foreign, &mut workspace).invalid, Some(Invalid::Pose(_))));
    let mut broken = rig.rest_pose();
    broken.coords_mut()[1] = f64::NAN;
    assert!(matches!(solver.solve(&problem, &mut broken, &mut workspace).invalid, Some(Invalid::Pose(_))));
    let bad = Solver::new(SolverOptions { cost_below: Some(f64::NAN), ..Default::default() });
    assert!(matches!(
        bad.solve(&problem, &mut rig.rest_pose(), &mut workspace).invalid,
        Some(Invalid::Options(_))
    ));
    let adam = ikiru_solve::AdamOptions { beta2: 1.0, ..Default::default() };
    let bad = Solver::new(SolverOptions { method: Method::Adam(adam), ..Default::default() });
    assert!(matches!(
        bad.solve(&problem, &mut rig.rest_pose(), &mut workspace).invalid,
        Some(Invalid::Options(_))
    ));
}

#[test]
fn every_stop_rule_stops() {
    let rig = arm();
    let hand = rig.joint("hand").unwrap();
    let mut problem = Problem::whole_body(&rig);
    let id = problem.add(1.0, Position::new(hand, DVec3::new(0.2, 0.1, 0.3)));
    problem.term_mut(id).loss = Loss::Norm;
    let run = |options: SolverOptions, problem: &Problem| {
        let solver = Solver::new(options);
        let mut pose = rig.rest_pose();
        let mut workspace = solver.workspace(problem);
        let report = solver.solve(problem, &mut pose, &mut workspace);
        (report.stop, report.iterations, report.cost)
    };
    let bar = SolverOptions { cost_below: Some(0.005), ..Default::default() };
    let (stop, _, cost) = run(bar, &problem);
    assert!(stop == StopReason::Reached && cost < 0.005);
    let few = SolverOptions { max_iterations: 2, cost_below: Some(1e-9), ..Default::default() };
    assert_eq!(run(few, &problem).0, StopReason::IterationLimit);
    assert_eq!(run(few, &problem).1, 2);
    let adam = SolverOptions { method: Method::Adam(Default::default()), ..few };
    assert_eq!((run(adam, &problem).0, run(adam, &problem).1), (StopReason::IterationLimit, 2));
    problem[id].target = DVec3::new(9.0, 0.0, 1.0);
    assert_eq!(run(SolverOptions::default(), &problem).0, StopReason::Converged);
    // A budget that is over before the first iteration still gives an answer, and one of a few
    // milliseconds ends a search that would go on for much longer.
    let none = SolverOptions { max_time: Some(Duration::ZERO), ..bar };
    assert_eq!((run(none, &problem).0, run(none, &problem).1), (StopReason::TimeBudget, 0));
    let endless = SolverOptions { max_time: Some(Duration::from_millis(5)), ..global(100_000_000) };
    assert_eq!(run(endless, &problem).0, StopReason::TimeBudget);
}

#[test]
fn a_start_outside_its_limits_is_moved_inside_and_said_so() {
    let rig = arm();
    let (elbow, hand) = (rig.joint("elbow").unwrap(), rig.joint("hand").unwrap());
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(hand, DVec3::new(0.2, 0.1, 0.3)));
    let solver = Solver::new(SolverOptions::default());
    let mut workspace = solver.workspace(&problem);
    let mut pose = rig.rest_pose();
    pose.set_value(elbow, 1.0).unwrap();
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    assert!(report.start_projected && report.success && pose.limit_violation() == 0.0);
    assert!(!solver.solve(&problem, &mut pose, &mut workspace).start_projected);
}

#[test]
fn optional_terms_shape_the_pose_and_do_not_decide() {
    let rig = arm();
    let hand = rig.joint("hand").unwrap();
    let mut problem = Problem::whole_body(&rig);
    let reach = problem.add(1.0, Position::new(hand, DVec3::new(0.2, 0.1, 0.3)));
    let wish = problem.add(1e-7, Direction::new(hand, DVec3::X, DVec3::NEG_X));
    let solver = Solver::new(SolverOptions::default());
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut rig.rest_pose(), &mut workspace);
    assert!(
        !report.success
            && report.terms[problem.position(reach).unwrap()].satisfied
            && !report.terms[problem.position(wish).unwrap()].satisfied
    );
    assert_eq!(report.terms[problem.position(wish).unwrap()].unit, Unit::Radians);
    problem.term_mut(wish).mandatory = false;
    assert!(solver.solve(&problem, &mut rig.rest_pose(), &mut workspace).success);
}

#[test]
fn a_changed_problem_is_planned_anew_by_the_same_workspace() {
    let rig = arm();
    let [elbow, hand] = ["elbow", "hand"].map(|n| rig.joint(n).unwrap());
    let mut problem = Problem::whole_body(&rig);
    let id = problem.add(1.0, Position::new(hand, DVec3::new(0.2, 0.1, 0.3)));
    let solver = Solver::new(SolverOptions::default());
    let mut workspace = solver.workspace(&problem);
    assert!(solver.solve(&problem, &mut rig.rest_pose(), &mut workspace).success);
    problem[id].joint = elbow;
    problem[id].target = DVec3::new(0.0, 0.3, 0.0);
    let mut pose = rig.rest_pose();
    assert!(solver.solve(&problem, &mut pose, &mut workspace).success);
    assert!(pose.frame(elbow).unwrap().position.distance(DVec3::new(0.0, 0.3, 0.0)) < 1e-3);
    // And a workspace that has never seen a problem works too.
    let mut fresh = Default::default();
    assert!(solver.solve(&problem, &mut rig.rest_pose(), &mut fresh).success);
}

#[test]
fn a_problem_without_terms_or_joints_is_met_as_it_is() {
    let rig = arm();
    let solver = Solver::new(SolverOptions::default());
    let empty = Problem::whole_body(&rig);
    let mut workspace = solver.workspace(&empty);
    assert!(solver.solve(&empty, &mut rig.rest_pose(), &mut workspace).success);
    let mut still = Problem::new(&rig, []).unwrap();
    still.add(1.0, Position::new(rig.joint("hand").unwrap(), DVec3::ZERO));
    let report = solver.solve(&still, &mut rig.rest_pose(), &mut workspace);
    assert!(
        !report.success && report.stop == StopReason::Converged && (report.cost - 0.55 * 0.55).abs() < 1e-12
    );
}

#[test]
fn more_starts_do_not_make_an_answer_worse() {
    // Out of reach, so that every start is used up. Starts are given up early and the best is followed to its
    // end, which now and then is another basin's bottom: rarely a higher one.
    let mut random = Random::new(21);
    let (mut all, mut as_good) = (0, 0);
    for case in 0..150 {
        let rig = random_rig(4 + random.below(14), 7000 + case);
        let joint = JointId::from_index(rig.n_joints() - 1);
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, PoseTarget::new(joint, random.vector(3.0), random.rotation()));
        let cost = |max_restarts| {
            let solver = Solver::new(global(max_restarts));
            let mut pose = rig.rest_pose();
            let mut workspace = solver.workspace(&problem);
            solver.solve(&problem, &mut pose, &mut workspace).cost
        };
        let (one, many) = (cost(0), cost(20));
        if one > 1e-6 {
            all += 1;
            as_good += usize::from(many <= one * (1.0 + 1e-6));
        }
    }
    assert!(all > 50 && as_good * 100 >= all * 97, "{as_good} of {all}");
}
