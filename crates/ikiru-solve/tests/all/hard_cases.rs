//! Problems with hard rows of every kind on random rigs, of which a pose is known that satisfies all of them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::DVec3;
use ikiru_rig::{Frame, JointId, JointMotion, Pose, Rig, Scalar, Segment, Vec3};
use ikiru_solve::objectives::{
    Bound, CenterOfMass, Coupling, Distance, JointAngles, KnownRotation, Position, RestPose,
};
use ikiru_solve::{
    Problem, Report, Residual, Search, Sense, Settle, Solver, SolverOptions, TermReport, Tolerance, Unit,
};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// A problem whose hard rows a pose satisfies, and where a solve starts.
pub(crate) struct Case {
    pub(crate) problem: Problem,
    pub(crate) start: Pose,
    pub(crate) feasible: Pose,
}

/// A joint stays on one side of a plane, written as users do.
#[derive(Clone, Debug)]
pub(crate) struct Beside {
    pub(crate) joint: JointId,
    pub(crate) normal: DVec3,
    /// Least way along the normal, metres.
    pub(crate) least: f64,
}

impl Residual for Beside {
    fn joints(&self) -> &[JointId] {
        std::slice::from_ref(&self.joint)
    }

    fn sense(&self) -> Sense {
        Sense::AtLeast
    }

    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        let [x, y, z] = self.normal.to_array().map(S::from);
        residual[0] = frames[0].origin.dot(Vec3::new(x, y, z)) - S::from(self.least);
    }
}

/// Below every sum of angles, so that the length of a residual has no sign to lose.
const FAR: f64 = 100.0;

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

/// The length of the residual of an objective at a pose.
fn residual<T: ikiru_solve::Objective + Clone>(rig: &Rig, objective: T, pose: &Pose) -> f64 {
    let mut problem = Problem::new(rig, []).unwrap();
    problem.add(1.0, objective);
    let solver = Solver::default();
    let mut workspace = solver.workspace(&problem);
    solver.solve(&problem, &mut pose.clone(), &mut workspace).terms[0].residual
}

/// The distance of two joints, as a constraint that `pose` keeps.
fn distance(joints: [JointId; 2], random: &mut Random, pose: &Pose) -> Distance {
    let [a, b] = joints.map(|joint| pose.frame(joint).unwrap().position);
    let apart = a.distance(b);
    let bound = match random.below(2) {
        0 => Bound::AtLeast((apart - random.between(0.0, 0.05)).max(0.0)),
        _ => Bound::AtMost(apart + random.between(0.0, 0.05)),
    };
    Distance::new(joints, bound)
}

/// The centre of mass of a few segments: where `pose` has it, or over an area around that.
fn center_of_mass(rig: &Rig, random: &mut Random, pose: &Pose) -> Option<CenterOfMass> {
    let mut segments: Vec<Segment> = Vec::new();
    for joint in rig.ids() {
        if random.below(2) == 0 {
            segments.push(Segment { joint, kg: random.between(0.5, 2.0), center: random.vector(0.1) });
        }
    }
    let kg: f64 = segments.iter().map(|segment| segment.kg).sum();
    let weighed = segments.iter().map(|segment| {
        let frame = pose.frame(segment.joint).unwrap();
        segment.kg * (frame.position + frame.rotation * segment.center)
    });
    let center = weighed.sum::<DVec3>() / kg;
    if segments.is_empty() {
        return None;
    }
    if random.below(2) == 0 {
        return Some(CenterOfMass::at(&segments, center));
    }
    let size = random.between(0.02, 0.1);
    let around = [DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 0.3, -0.5), DVec3::Z];
    CenterOfMass::over(&segments, &around.map(|corner| center + size * corner), DVec3::Y, 0.1 * size).ok()
}

/// A joint's own motion as `pose` has it.
fn known(rig: &Rig, joint: JointId, pose: &Pose) -> Option<KnownRotation> {
    let data = rig.get(joint).filter(|data| data.mimic.is_none())?;
    let angles = match data.motion {
        JointMotion::Fixed => return None,
        JointMotion::Hinge { .. } | JointMotion::Slider { .. } => JointAngles::Value(pose.value(joint)?),
        JointMotion::Euler { .. } => JointAngles::Euler(pose.euler(joint)?.map(Some)),
        JointMotion::Ball { .. } | JointMotion::Free { .. } => {
            JointAngles::Rotation(pose.rotation(joint).unwrap())
        }
    };
    Some(KnownRotation::new(&[(joint, angles)]))
}

/// One to ten constraints that one random pose satisfies; a reach and a rest pose as wishes; the start is another pose.
pub(crate) fn case(number: u64) -> Case {
    let mut random = Random::new(number);
    let rig = random_rig(4 + random.below(10), number);
    let feasible = random_pose(&rig, &mut random);
    let mut problem = Problem::whole_body(&rig);
    let joint = |random: &mut Random| JointId::from_index(random.below(rig.n_joints()));
    let tip = JointId::from_index(rig.n_joints() - 1);
    let target = random_pose(&rig, &mut random).frame(tip).unwrap().position;
    problem.add(1.0, Position::new(tip, target));
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(0.05, RestPose::new(&joints, rig.rest_pose()));
    for _ in 0..1 + random.below(10) {
        match random.below(10) {
            0..4 => {
                let joints = [joint(&mut random), joint(&mut random)];
                if joints[0] != joints[1] {
                    problem.add_hard(distance(joints, &mut random, &feasible));
                }
            }
            4..7 => {
                coupling(&rig, &mut random, &feasible).map(|coupling| problem.add_hard(coupling));
            }
            7 => {
                let (joint, normal) = (joint(&mut random), random.rotation() * DVec3::X);
                let least = feasible.frame(joint).unwrap().position.dot(normal) - random.between(0.0, 0.05);
                problem.add_hard(Beside { joint, normal, least });
            }
            8 => {
                center_of_mass(&rig, &mut random, &feasible).map(|center| problem.add_hard(center));
            }
            _ => {
                known(&rig, joint(&mut random), &feasible).map(|known| problem.add_hard(known));
            }
        }
    }
    let start = random_pose(&rig, &mut random);
    Case { problem, start, feasible }
}

/// With so many restarts.
pub(crate) fn search(max_restarts: usize) -> SolverOptions {
    let search = if max_restarts == 0 { Search::Local } else { Search::Global { max_restarts } };
    SolverOptions { search, settle: Settle::Fully, ..SolverOptions::default() }
}

/// The most that a hard term misses (metres or radians).
pub(crate) fn missed(report: &Report<'_>) -> f64 {
    let lengths = |t: &TermReport| t.others.iter().map(|o| o.residual).fold(t.residual, f64::max);
    report.terms.iter().filter(|t| t.hard).map(lengths).fold(0.0, f64::max)
}

/// What came of a solve from a pose, which is improved.
pub(crate) struct Found {
    pub(crate) cost: f64,
    pub(crate) missed: f64,
    /// Whether the report says of every hard term whether it holds, and of no such end that it is a success.
    pub(crate) is_told: bool,
}

pub(crate) fn solve(options: SolverOptions, problem: &Problem, pose: &mut Pose) -> Found {
    let solver = Solver::new(options);
    let mut workspace = solver.workspace(problem);
    let report = solver.solve(problem, pose, &mut workspace);
    assert!(report.invalid.is_none(), "{:?}", report.invalid);
    assert!(report.cost.is_finite() && pose.limit_violation() < 1e-9 && pose.is_valid());
    let is_told = |t: &TermReport| {
        let within = |length: f64, unit| match unit {
            Unit::Metres => length <= Tolerance::HARD.metres,
            Unit::Radians => length <= Tolerance::HARD.radians,
        };
        let holds = within(t.residual, t.unit) && t.others.iter().all(|o| within(o.residual, o.unit));
        t.satisfied == holds && (holds || !report.success)
    };
    let is_told = report.terms.iter().filter(|t| t.hard).all(is_told);
    Found { cost: report.cost, missed: missed(&report), is_told }
}
