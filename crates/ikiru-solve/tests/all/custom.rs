//! Custom residuals: exact derivatives on every tree, and solved like any other objective.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use ikiru_rig::{Dual, Frame, JointId, Scalar, Vec3};
use ikiru_solve::{
    CheckError, Evaluation, Problem, Residual, Search, Solver, SolverOptions, Unit, check_jacobian,
};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// Three joints form a triangle of a given area, and the first looks away from the plane of the others by a
/// given angle: products, quotients, roots and arc tangents in one.
#[derive(Clone, Debug)]
struct Triangle {
    joints: [JointId; 3],
    area: f64,
    angle: f64,
}

impl Residual for Triangle {
    fn joints(&self) -> &[JointId] {
        &self.joints
    }
    fn n_rows(&self) -> usize {
        2
    }
    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        let (u, v) = (frames[1].origin - frames[0].origin, frames[2].origin - frames[0].origin);
        let normal = u.cross(v);
        residual[0] = normal.length() * 0.5 - self.area;
        let gaze = frames[0].rotation.apply(Vec3::new(S::zero(), S::zero(), S::one()));
        residual[1] = gaze.cross(normal).length().atan2(gaze.dot(normal)) - self.angle;
    }
}

/// Wrong on purpose: a number so large that rounding swallows what the derivative still sees.
#[derive(Clone, Debug)]
struct Swallowed([JointId; 1]);

impl Residual for Swallowed {
    fn joints(&self) -> &[JointId] {
        &self.0
    }
    fn unit(&self) -> Unit {
        Unit::Metres
    }
    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        residual[0] = (frames[0].origin.x + 1e15) - 1e15;
    }
}

/// Keeps a joint out of a capsule between two others: the depth inside, 0 outside. Which of the ends, or which point
/// between them, is nearest is a branch on each side of another one.
#[derive(Clone, Debug)]
struct KeepOut {
    joints: [JointId; 3],
    radius: f64,
}

impl Residual for KeepOut {
    fn joints(&self) -> &[JointId] {
        &self.joints
    }
    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        let [point, from, to] = [0, 1, 2].map(|i| frames[i].origin);
        let (line, arm) = (to - from, point - from);
        let share = arm.dot(line) / line.dot(line);
        // A line without length has no share: NaN is neither side of a comparison, and the first end is nearest.
        let between = Vec3::select(share.gt(0.0), from + line * share, from);
        let nearest = Vec3::select(share.ge(1.0), to, between);
        let depth = -point.distance(nearest) + self.radius;
        residual[0] = S::select(depth.gt(0.0), depth, S::zero());
    }
}

#[test]
fn derivatives_on_random_trees_with_every_motion() {
    let mut random = Random::new(4);
    let mut checked = 0;
    for case in 0..300 {
        let rig = random_rig(3 + random.below(12), 5000 + case);
        let joints = [0, 1, 2].map(|_| JointId::from_index(random.below(rig.n_joints())));
        if joints[0] == joints[1] || joints[0] == joints[2] || joints[1] == joints[2] {
            continue;
        }
        let mut problem = Problem::whole_body(&rig);
        problem.add(0.7, Triangle { joints, area: 0.1, angle: 0.5 });
        let pose = random_pose(&rig, &mut random);
        let frames = joints.map(|j| pose.frame(j).unwrap());
        let normal = (frames[1].position - frames[0].position).cross(frames[2].position - frames[0].position);
        let gaze = frames[0].rotation * DVec3::Z;
        if normal.length() < 1e-3 || gaze.cross(normal).length() < 1e-2 * normal.length() {
            continue; // the residual itself has a corner here
        }
        check_jacobian(&problem, &pose, 1e-4).unwrap();
        checked += 1;
    }
    assert!(checked > 100);
}

/// Where a point is beside a segment, by plain numbers: the share of the way, and how far away.
fn beside(point: DVec3, from: DVec3, to: DVec3) -> (f64, f64) {
    let line = to - from;
    let share = (point - from).dot(line) / line.length_squared();
    (share, point.distance(from + line * share.clamp(0.0, 1.0)))
}

#[test]
fn each_side_of_a_selection_has_its_own_derivative() {
    let mut random = Random::new(11);
    // Outside, and inside at the first end, between the two, and at the second.
    let mut seen = [0; 4];
    for case in 0..600 {
        let rig = random_rig(4 + random.below(10), 9000 + case);
        let joints = [0, 1, 2].map(|_| JointId::from_index(random.below(rig.n_joints())));
        let pose = random_pose(&rig, &mut random);
        let [point, from, to] = joints.map(|joint| pose.frame(joint).unwrap().position);
        if from.distance(to) < 0.05 || point.distance(from).min(point.distance(to)) < 0.05 {
            continue;
        }
        let (share, away) = beside(point, from, to);
        let radius = away * random.between(0.5, 2.0);
        if share.abs().min((share - 1.0).abs()) < 1e-2 || (radius - away).abs() < 1e-3 || away < 0.01 {
            continue; // the residual itself has a corner here
        }
        let objective = KeepOut { joints, radius };
        let side = if radius < away { 0 } else { 1 + usize::from(share > 0.0) + usize::from(share > 1.0) };
        let mut residual = [f64::NAN];
        Residual::evaluate(&objective, &joints.map(|joint| pose.frame(joint).unwrap().into()), &mut residual);
        assert!((residual[0] - (radius - away).max(0.0)).abs() < 1e-12, "{side}: {residual:?}");
        assert_eq!(residual[0] == 0.0, side == 0);
        let mut problem = Problem::whole_body(&rig);
        problem.add(0.7, objective);
        check_jacobian(&problem, &pose, 1e-4)
            .unwrap_or_else(|error| panic!("case {case}, side {side}: {error}"));
        seen[side] += 1;
    }
    assert!(seen.into_iter().all(|n| n > 20), "{seen:?}");
}

#[test]
fn what_is_not_selected_may_be_no_number() {
    let joints = [0, 1, 2].map(JointId::from_index);
    let objective = KeepOut { joints, radius: 1.0 };
    let at = |x: f64| Frame {
        origin: Vec3::new(Dual::<1>::from(x), Dual::from(0.0), Dual::from(0.0)),
        ..Frame::identity()
    };
    let mut point = at(0.25);
    point.origin.x.derivatives[0] = 1.0;
    let mut residual = [Dual::from(0.0)];
    Residual::evaluate(&objective, &[point, at(0.0), at(0.0)], &mut residual);
    assert_eq!((residual[0].value, residual[0].derivatives), (0.75, [-1.0]));
}

#[test]
fn the_check_finds_a_wrong_derivative() {
    let rig = random_rig(12, 3);
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Swallowed([JointId::from_index(11)]));
    let pose = random_pose(&rig, &mut Random::new(1));
    assert!(matches!(
        check_jacobian(&problem, &pose, 1e-6),
        Err(CheckError::Differs { term: 0, row: 0, .. })
    ));
}

#[test]
fn a_custom_objective_is_solved() {
    let rig = random_rig(20, 8);
    let joints = [5, 12, 19].map(JointId::from_index);
    let mut problem = Problem::whole_body(&rig);
    let id = problem.add(1.0, Triangle { joints, area: 0.05, angle: 1.0 });
    let solver =
        Solver::new(SolverOptions { search: Search::Global { max_restarts: 32 }, ..Default::default() });
    let mut workspace = solver.workspace(&problem);
    let mut pose = rig.rest_pose();
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    assert!(report.success && report.terms[0].kind == "custom");
    let [a, b, c] = joints.map(|j| pose.frame(j).unwrap().position);
    assert!(((b - a).cross(c - a).length() * 0.5 - 0.05).abs() < 1e-3);
    // Its own numbers change between solves like any target.
    problem[id].area = 0.08;
    assert!(solver.solve(&problem, &mut pose, &mut workspace).success);
}

/// The volume that the origins of neighbours span with the axes of each, over any number of joints: how often it
/// is computed with derivatives is counted.
#[derive(Clone, Debug)]
struct Chain {
    joints: Vec<JointId>,
    n_evaluations: Arc<AtomicUsize>,
}

impl Residual for Chain {
    fn joints(&self) -> &[JointId] {
        &self.joints
    }
    fn n_rows(&self) -> usize {
        2
    }
    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        let is_plain = size_of::<S>() == size_of::<f64>();
        self.n_evaluations.fetch_add(usize::from(!is_plain), Ordering::Relaxed);
        residual.fill(S::zero());
        for (idx, frame) in frames.iter().enumerate() {
            let next = &frames[(idx + 1) % frames.len()];
            residual[0] += frame.rotation.x.cross(next.rotation.y).dot(frame.origin);
            residual[1] += next.rotation.z.dot(frame.origin) * (idx as f64 + 1.0);
        }
    }
}

#[test]
fn a_residual_is_computed_once_for_four_frames() {
    let rig = random_rig(14, 6);
    let pose = random_pose(&rig, &mut Random::new(2));
    let mut of_one = 0;
    for n_frames in 1..=9 {
        let (joints, n_evaluations) = (rig.ids().rev().take(n_frames).collect(), Arc::default());
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, Chain { joints, n_evaluations: Arc::clone(&n_evaluations) });
        check_jacobian(&problem, &pose, 1e-6).unwrap_or_else(|error| panic!("{n_frames}: {error}"));
        let mut evaluation = Evaluation::default();
        n_evaluations.store(0, Ordering::Relaxed);
        evaluation.at(&problem, &pose).unwrap();
        let counted = n_evaluations.load(Ordering::Relaxed);
        if n_frames == 1 {
            of_one = counted;
        }
        assert!(of_one > 0);
        // Once for each four frames, or what is left of them.
        assert_eq!(counted, of_one * n_frames.div_ceil(4), "{n_frames}");
    }
}
