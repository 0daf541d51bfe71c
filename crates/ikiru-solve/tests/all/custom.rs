//! Custom residuals: exact derivatives on every tree, and solved like any other objective.

use ikiru_rig::{Frame, JointId, Scalar, Vec3};
use ikiru_solve::{CheckError, Problem, Residual, Search, Solver, SolverOptions, Unit, check_jacobian};
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

/// Wrong on purpose: it hides its derivative from the solver by going through the plain value.
#[derive(Clone, Debug)]
struct Opaque([JointId; 1]);

impl Residual for Opaque {
    fn joints(&self) -> &[JointId] {
        &self.0
    }
    fn unit(&self) -> Unit {
        Unit::Metres
    }
    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        residual[0] = S::from(frames[0].origin.x.value());
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
        let frames = joints.map(|j| pose.frame(j));
        let normal = (frames[1].origin - frames[0].origin).cross(frames[2].origin - frames[0].origin);
        let gaze = frames[0].rotation.z;
        if normal.length() < 1e-3 || gaze.cross(normal).length() < 1e-2 * normal.length() {
            continue; // the residual itself has a corner here
        }
        check_jacobian(&problem, &pose, 1e-4).unwrap();
        checked += 1;
    }
    assert!(checked > 100);
}

#[test]
fn the_check_finds_a_wrong_derivative() {
    let rig = random_rig(12, 3);
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Opaque([JointId::from_index(11)]));
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
    let [a, b, c] = joints.map(|j| pose.frame(j).origin);
    assert!(((b - a).cross(c - a).length() * 0.5 - 0.05).abs() < 1e-3);
    // Its own numbers change between solves like any target.
    problem[id].area = 0.08;
    assert!(solver.solve(&problem, &mut pose, &mut workspace).success);
}
