//! Why not: the forces of a report are what moving a limit, a bound or a target really saves.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::f64::consts::PI;

use crate::common::place;
use glam::{DQuat, DVec2, DVec3};
use ikiru_rig::{Cone, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{
    Bound, Coupling, Direction, Distance, Orientation, PoseTarget, Position, RestPose,
};
use ikiru_solve::{
    Force, ForceBy, LimitKind, Loss, Problem, Search, Settle, Solver, SolverOptions, StopReason, TermId, Unit,
};
use ikiru_testkit::allocations::count;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// Hinges about z along x, each with its length and range, and a tip.
pub(crate) fn chain(links: &[(f64, Range)]) -> (Rig, Vec<JointId>) {
    let mut builder = RigBuilder::new();
    let (mut ids, mut length) = (Vec::new(), 0.0);
    for (idx, (next, range)) in links.iter().enumerate() {
        let mut joint = Joint::new(format!("hinge_{idx}"), ids.last().copied());
        joint.rest_translation = DVec3::X * length;
        joint.motion = JointMotion::Hinge { axis: DVec3::Z, range: *range };
        ids.push(builder.add(joint));
        length = *next;
    }
    let mut tip = Joint::new("tip", ids.last().copied());
    tip.rest_translation = DVec3::X * length;
    ids.push(builder.add(tip));
    (builder.build().unwrap(), ids)
}

/// The cost, the forces and the pose after a solve from rest.
pub(crate) fn solved(problem: &Problem) -> (f64, Vec<Force>, Pose) {
    let solver = Solver::new(SolverOptions { settle: Settle::Fully, ..SolverOptions::default() });
    let mut workspace = solver.workspace(problem);
    let mut pose = problem.rig().rest_pose();
    let report = solver.solve(problem, &mut pose, &mut workspace);
    assert!(report.invalid.is_none(), "{:?}", report.invalid);
    (report.cost, report.forces.to_vec(), pose)
}

/// The one force on a term that comes from something.
#[track_caller]
pub(crate) fn force(forces: &[Force], on: usize, by: ForceBy) -> Force {
    let of = |force: &&Force| force.on == Some(on) && force.by == by;
    *forces.iter().find(of).unwrap_or_else(|| panic!("nothing by {by:?} on {on}: {forces:?}"))
}

/// Minus the slope of a function at 0.
pub(crate) fn saved(cost: impl Fn(f64) -> f64) -> f64 {
    let h = 1e-4;
    (cost(-h) - cost(h)) / (2.0 * h)
}

#[track_caller]
pub(crate) fn near(found: f64, wanted: f64) {
    assert!((found - wanted).abs() < 1e-4 * (1.0 + wanted.abs()), "{found} is not {wanted}");
}

#[test]
fn a_limit_that_alone_is_in_the_way_bears_all_of_it_and_costs_what_moving_it_saves() {
    for loss in [Loss::Squared, Loss::Norm, Loss::Huber { width: 0.05 }] {
        let problem = |limit: f64| {
            let (rig, ids) = chain(&[(0.4, Range::new(-PI, limit)), (0.3, Range::new(-0.2, 0.4))]);
            let mut problem = Problem::new(&rig, [ids[0]]).unwrap();
            let target = 0.7 * DVec3::new(1.1_f64.cos(), 1.1_f64.sin(), 0.0);
            let reach = problem.add(2.0, Position::new(ids[2], target));
            problem.term_mut(reach).loss = loss;
            (problem, ids)
        };
        let (problem_now, ids) = problem(0.5);
        let (_, forces, _) = solved(&problem_now);
        let [limit] = forces[..] else { panic!("{forces:?}") };
        assert_eq!(limit.by, ForceBy::Limit { joint: ids[0], kind: LimitKind::Value });
        assert_eq!((limit.on, limit.unit), (Some(0), Unit::Radians));
        near(limit.share, 1.0);
        near(limit.amount, saved(|d| solved(&problem(0.5 + d).0).0));
    }
}

#[test]
fn several_limits_share_and_each_costs_what_moving_it_saves() {
    let problem = |moved: [f64; 2]| {
        let ranges = [Range::new(-PI, 0.3 + moved[0]), Range::new(-PI, 0.4 + moved[1])];
        let (rig, ids) = chain(&[(0.4, ranges[0]), (0.3, ranges[1]), (0.2, Range::new(-0.2, 3.0))]);
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, Position::new(ids[3], DVec3::new(-0.3, 0.5, 0.0)));
        (problem, ids)
    };
    let (now, ids) = problem([0.0; 2]);
    let (_, forces, _) = solved(&now);
    let [a, b] = [0, 1].map(|i| force(&forces, 0, ForceBy::Limit { joint: ids[i], kind: LimitKind::Value }));
    near(a.share + b.share, 1.0);
    near(a.share / b.share, (a.amount / b.amount).powi(2));
    near(a.amount, saved(|d| solved(&problem([d, 0.0]).0).0));
    near(b.amount, saved(|d| solved(&problem([0.0, d]).0).0));
    assert_eq!(forces[0].by, if a.share > b.share { a.by } else { b.by }, "the strongest first");
}

/// A ball with a stick along x.
fn ball(cone: Cone) -> (Rig, JointId) {
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("ball", None);
    joint.motion = JointMotion::Ball { cone: Some(cone) };
    let ball = builder.add(joint);
    let mut tip = Joint::new("tip", Some(ball));
    tip.rest_translation = DVec3::X;
    builder.add(tip);
    (builder.build().unwrap(), ball)
}

#[test]
fn the_swing_and_the_twist_of_a_cone_cost_what_moving_them_saves() {
    // An edge in a corner: both act at once, and their normals are not perpendicular.
    let target = DQuat::from_scaled_axis(DVec3::new(0.0, 1.1, 0.9)) * DQuat::from_rotation_x(0.9);
    let problem = |moved: [f64; 3]| {
        let widths = [0.8 + moved[0], 0.6 + moved[1]];
        let (rig, ball) = ball(Cone::new(DVec3::X, widths, Range::new(-0.5, 0.4 + moved[2])).unwrap());
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.5, Orientation::new(ball, target));
        (problem, ball)
    };
    let (now, joint) = problem([0.0; 3]);
    let (_, forces, pose) = solved(&now);
    let [swing, twist] =
        [LimitKind::Swing, LimitKind::Twist].map(|kind| force(&forces, 0, ForceBy::Limit { joint, kind }));
    near(swing.share + twist.share, 1.0);
    near(twist.amount, saved(|d| solved(&problem([0.0, 0.0, d]).0).0));
    // Each width moves the edge outwards by so much where the swing is.
    let cone = now.rig().get(joint).unwrap().motion.cone().copied().unwrap();
    let (widths, at) = (DVec2::new(0.8, 0.6), DVec2::from(cone.decompose(pose.rotation(joint).unwrap()).0));
    let out = (at / (widths * widths)).normalize();
    near(swing.amount * out.x * at.x / widths.x, saved(|d| solved(&problem([d, 0.0, 0.0]).0).0));
    near(swing.amount * out.y * at.y / widths.y, saved(|d| solved(&problem([0.0, d, 0.0]).0).0));
}

#[test]
fn two_wishes_that_pull_against_each_other_name_each_other() {
    let (rig, ids) = chain(&[(1.0, Range::UNLIMITED)]);
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Direction::new(ids[0], DVec3::X, DVec3::new(0.6_f64.cos(), 0.6_f64.sin(), 0.0)));
    problem.add(3.0, Direction::new(ids[0], DVec3::X, DVec3::X));
    let (_, forces, pose) = solved(&problem);
    near(pose.value(ids[0]).unwrap(), 0.15);
    let (a, b) = (force(&forces, 0, ForceBy::Term(1)), force(&forces, 1, ForceBy::Term(0)));
    assert_eq!(forces, [a, b], "the first costs more");
    for force in [a, b] {
        near(force.share, 1.0);
        // 2 λ r of the other one.
        near(force.amount, 2.0 * 0.45);
    }
}

#[test]
fn a_constraint_that_opposes_a_wish_costs_what_moving_its_bound_saves() {
    for is_exact in [false, true] {
        let problem = |moved: f64| {
            let (rig, ids) = chain(&[(0.4, Range::UNLIMITED), (0.3, Range::UNLIMITED)]);
            let mut problem = Problem::whole_body(&rig);
            problem.add(1.0, Position::new(ids[2], DVec3::new(0.1, 0.5, 0.0)));
            let at = 0.9 + moved;
            let bound = if is_exact { Bound::Exactly(at) } else { Bound::AtMost(at) };
            problem
                .add_hard(Coupling::new(&rig, &[(ids[0], None, 1.0), (ids[1], None, 0.5)], bound).unwrap());
            problem
        };
        let (_, forces, _) = solved(&problem(0.0));
        let [coupling] = forces[..] else { panic!("{forces:?}") };
        assert_eq!((coupling.on, coupling.by), (Some(0), ForceBy::Term(1)));
        near(coupling.share, 1.0);
        near(coupling.amount, saved(|d| solved(&problem(d)).0));
    }
}

#[test]
fn constraints_that_contradict_each_other_name_each_other() {
    let (rig, ids) = chain(&[(0.4, Range::UNLIMITED), (0.3, Range::UNLIMITED)]);
    let mut problem = Problem::whole_body(&rig);
    let mut wished = rig.rest_pose();
    wished.set_value(ids[0], 0.9).unwrap();
    problem.add(1.0, Position::new(ids[2], place(&wished, ids[2])));
    for at in [0.2, 0.5] {
        problem.add_hard(Coupling::new(&rig, &[(ids[0], None, 1.0)], Bound::Exactly(at)).unwrap());
    }
    let (_, forces, pose) = solved(&problem);
    assert!(forces[0].on != Some(0), "what is hard comes first: {forces:?}");
    // Anywhere between the two they miss the same in sum: the wish decides which of them gives way, and that one names the other.
    near(pose.value(ids[0]).unwrap(), 0.5);
    near(force(&forces, 1, ForceBy::Term(2)).share, 1.0);
    // The wish is held by both.
    assert!(forces.iter().any(|force| force.on == Some(0) && force.by == ForceBy::Term(1)), "{forces:?}");
}

#[test]
fn what_acts_although_all_is_met_is_told_without_a_term() {
    let (rig, ids) = chain(&[(0.4, Range::new(-PI, 0.3)), (0.3, Range::UNLIMITED)]);
    let mut problem = Problem::whole_body(&rig);
    // The pull of one that shapes the pose holds the hinge at its limit.
    let end = Pose::clone(&{
        let mut pose = rig.rest_pose();
        pose.set_value(ids[0], 0.3).unwrap();
        pose
    });
    problem.add(1.0, Position::new(ids[1], place(&end, ids[1])));
    let mut far = rig.rest_pose();
    far.set_value(ids[0], 0.5).unwrap();
    let pull = problem.add(1e-3, RestPose::new(&ids[..1], far));
    assert!(!problem.term(pull).mandatory);
    let (_, forces, _) = solved(&problem);
    let [limit] = forces[..] else { panic!("{forces:?}") };
    assert_eq!((limit.on, limit.by), (None, ForceBy::Limit { joint: ids[0], kind: LimitKind::Value }));
    near(limit.share, 1.0);
    near(limit.amount, 2.0 * 1e-3 * 0.2);
    // Where nothing pushes, nothing acts although the limit is touched.
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(ids[1], place(&end, ids[1])));
    assert_eq!(solved(&problem).1, []);
}

/// Random rigs with wishes that cannot all be met, and constraints on some.
fn random_problem(case: u64, random: &mut Random) -> (Problem, TermId<PoseTarget>) {
    let rig = random_rig(3 + random.below(14), case);
    let mut problem = Problem::whole_body(&rig);
    let joint = |random: &mut Random| JointId::from_index(random.below(rig.n_joints()));
    let last = JointId::from_index(rig.n_joints() - 1);
    let first = problem.add(1.0, PoseTarget::new(last, random.vector(1.0), random.rotation()));
    problem.add(0.3, Position::new(joint(random), random.vector(0.6)));
    problem.add(0.1, Direction::new(joint(random), DVec3::Y, random.rotation() * DVec3::X));
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(0.02, RestPose::new(&joints, rig.rest_pose()));
    let pair = [joint(random), joint(random)];
    if pair[0] != pair[1] && case.is_multiple_of(2) {
        let apart = random_pose(&rig, random);
        let apart = place(&apart, pair[0]).distance(place(&apart, pair[1]));
        problem.add_hard(Distance::new(pair, Bound::AtMost(apart)));
    }
    (problem, first)
}

#[test]
fn shares_are_parts_of_a_whole() {
    let mut random = Random::new(77);
    let (mut n_forces, mut n_whole, mut n_terms) = (0, 0, 0);
    for case in 0..300 {
        let (problem, _) = random_problem(case, &mut random);
        let search = Search::Global { max_restarts: 2 };
        let solver = Solver::new(SolverOptions { search, settle: Settle::Fully, ..SolverOptions::default() });
        let mut workspace = solver.workspace(&problem);
        let mut pose = problem.rig().rest_pose();
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        for (idx, term) in report.terms.iter().enumerate() {
            let shares: Vec<f64> =
                report.forces.iter().filter(|f| f.on == Some(idx)).map(|f| f.share).collect();
            let sum: f64 = shares.iter().sum();
            assert!(shares.is_sorted_by(|a, b| *a >= b * (1.0 - 1e-5)), "{shares:?}");
            assert!(sum <= 1.0 + 1e-9 && shares.iter().all(|share| *share > 0.0), "case {case}: {shares:?}");
            assert_eq!(shares.is_empty(), term.satisfied || !term.mandatory, "case {case}: {report:?}");
            n_terms += usize::from(!shares.is_empty());
            // A best pose leaves nothing unexplained; what each bears below a hundredth is not told.
            n_whole += usize::from(sum > 0.9);
        }
        let finite = |f: &Force| f.share.is_finite() && f.amount.is_finite() && f.amount >= 0.0;
        assert!(report.forces.iter().all(finite), "case {case}: {:?}", report.forces);
        n_forces += report.forces.len();
        assert!(report.success || report.stop != StopReason::Reached);
    }
    assert!(n_terms > 300 && n_forces > 600, "{n_terms} {n_forces}");
    assert!(n_whole as f64 > 0.97 * n_terms as f64, "{n_whole} of {n_terms}");
}

#[test]
fn a_world_that_is_moved_and_turned_has_the_same_forces() {
    let mut random = Random::new(5);
    let mut n_compared = 0;
    for case in 0..60 {
        let (problem, first) = random_problem(2 * case + 1, &mut random);
        let (turn, way) = (random.rotation(), random.vector(2.0));
        let moved = |p: DVec3| turn * p + way;
        let rig = ikiru_testkit::cones::without_centres(problem.rig());
        let mut builder = rig.to_builder();
        for joint in builder.joints_mut().iter_mut().filter(|joint| joint.parent.is_none()) {
            joint.rest_translation = moved(joint.rest_translation);
            joint.rest_rotation = (turn * joint.rest_rotation).normalize();
        }
        let elsewhere = builder.build().unwrap();
        let PoseTarget { joint, position, rotation, .. } = problem[first];
        let mut own = Problem::new(&rig, problem.active()).unwrap();
        own.add(1.0, PoseTarget::new(joint, position, rotation));
        let mut others = Problem::new(&elsewhere, problem.active()).unwrap();
        others.add(1.0, PoseTarget::new(joint, moved(position), turn * rotation));
        let ((cost, forces, _), (cost_moved, forces_moved, _)) = (solved(&own), solved(&others));
        if (cost - cost_moved).abs() > 1e-9 {
            continue; // Rounding may lead to another of several best poses.
        }
        n_compared += 1;
        assert_eq!(forces.len(), forces_moved.len(), "case {case}: {forces:?} {forces_moved:?}");
        for (a, b) in forces.iter().zip(&forces_moved) {
            let same = (a.on, a.by) == (b.on, b.by) && (a.share - b.share).abs() < 1e-3;
            assert!(
                same && (a.amount - b.amount).abs() < 1e-3 * (1.0 + a.amount),
                "case {case}: {a:?} {b:?}"
            );
        }
    }
    assert!(n_compared > 20, "{n_compared}");
}

#[test]
fn what_is_first_in_the_way_stays_so_while_a_target_trembles() {
    // Two limits on either side of the arm that share the load almost evenly, and two targets that miss by the same.
    let mut builder = RigBuilder::new();
    let mut tips = Vec::new();
    for (idx, side) in [1.0, -1.0].into_iter().enumerate() {
        let mut joint = Joint::new(format!("hinge_{idx}"), None);
        joint.rest_translation = DVec3::Z * side;
        joint.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::new(-PI, 0.3) };
        let hinge = builder.add(joint);
        let mut slider = Joint::new(format!("slider_{idx}"), Some(hinge));
        slider.rest_translation = DVec3::X * 0.7;
        slider.motion = JointMotion::Slider { axis: DVec3::Y, range: Range::new(-0.6, 0.25) };
        let slider = builder.add(slider);
        let mut tip = Joint::new(format!("tip_{idx}"), Some(slider));
        tip.rest_translation = DVec3::X * 0.3;
        tips.push(builder.add(tip));
    }
    let rig = builder.build().unwrap();
    let mut problem = Problem::whole_body(&rig);
    let at = |side: f64| DVec3::new(0.761, 0.924, side);
    let ids = [0, 1].map(|i| problem.add(1.0, Position::new(tips[i], at(1.0 - 2.0 * i as f64))));
    let solver = Solver::default();
    let mut workspace = solver.workspace(&problem);
    let mut pose = rig.rest_pose();
    let mut random = Random::new(8);
    let (mut before, mut last) = (Vec::new(), rig.rest_pose());
    let (mut n_crossed, mut n_names_crossed) = (0, 0);
    for frame in 0..200 {
        for (i, id) in ids.into_iter().enumerate() {
            problem[id].target = at(1.0 - 2.0 * i as f64) + random.vector(1e-3);
        }
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        // The first of each term.
        let mut first: Vec<(Option<usize>, ForceBy)> = report.forces.iter().map(|f| (f.on, f.by)).collect();
        first.dedup_by_key(|(on, _)| *on);
        assert_eq!(first.len(), 2, "{:?}", report.forces);
        let by_cost = report.terms[0].cost > report.terms[1].cost;
        n_crossed += usize::from(by_cost != (first[0].0 == Some(0)));
        let forces = report.forces.iter();
        n_names_crossed +=
            forces.clone().zip(forces.skip(1)).filter(|(a, b)| a.on == b.on && a.share < b.share).count();
        if frame > 0 {
            assert_eq!(before, first, "frame {frame}: {:?}", report.forces);
            let step = last.difference(&pose).unwrap();
            assert!(step.iter().all(|d| d.abs() < 0.02), "{step:?}");
        }
        (before, last) = (first, pose.clone());
    }
    // Without the frame before, both the worst term and what is first in its way would have flickered.
    assert!(n_crossed > 20 && n_names_crossed > 20, "{n_crossed} {n_names_crossed}");
    // A target that goes elsewhere for good changes the names.
    let other = usize::from(before[0].0 == Some(0));
    problem[ids[other]].target.y += 0.5;
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    assert_eq!(report.forces[0].on, Some(other), "{:?}", report.forces);
}

#[test]
fn the_order_does_not_depend_on_what_a_workspace_saw_before_another_start() {
    let mut random = Random::new(12);
    for case in 0..40 {
        let (mut problem, first) = random_problem(case, &mut random);
        let solver = Solver::default();
        let mut used = solver.workspace(&problem);
        let mut pose = problem.rig().rest_pose();
        solver.solve(&problem, &mut pose, &mut used);
        problem[first].position = random.vector(1.0);
        let (mut a, mut b) = (problem.rig().rest_pose(), problem.rig().rest_pose());
        let mut fresh = solver.workspace(&problem);
        let (a, b) = (solver.solve(&problem, &mut a, &mut used), solver.solve(&problem, &mut b, &mut fresh));
        assert_eq!(a.forces, b.forces, "case {case}");
    }
}

#[test]
fn explaining_does_not_allocate() {
    let mut random = Random::new(4);
    for case in 0..30 {
        let (mut problem, first) = random_problem(case, &mut random);
        let solver = Solver::default();
        let mut workspace = solver.workspace(&problem);
        let mut pose = problem.rig().rest_pose();
        solver.solve(&problem, &mut pose, &mut workspace);
        let mut n_forces = 0;
        for _ in 0..4 {
            problem[first].position = random.vector(1.5);
            let n = count(|| n_forces += solver.solve(&problem, &mut pose, &mut workspace).forces.len());
            assert_eq!(n, 0, "case {case}");
        }
        assert!(n_forces > 0, "case {case}");
    }
}
