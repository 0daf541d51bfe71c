//! What the contract of objectives promises: potentials, rows that come and go, objectives that give up.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use ikiru_rig::{Clip, JointId, JointMotion, Pose};
use ikiru_solve::objectives::Position;
use ikiru_solve::{
    AdamOptions, CheckError, Invalid, InvalidTerm, Method, MotionProblem, MotionWorkspace, Objective, Part,
    Problem, Reads, Rows, Search, Solver, SolverOptions, StopReason, Timeline, Unfit, Unit, View, When,
    check_jacobian,
};
use ikiru_testkit::allocations;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// A valley along angles and offsets: `Σ √(1 + (x − a)²) − 1`, whose curvature is at most 1.
#[derive(Clone, Debug)]
struct Valley {
    joints: Vec<JointId>,
    center: f64,
    /// What the derivative and the curvature are said to be, relative to what they are.
    slope: f64,
    curvature: f64,
}

impl Objective for Valley {
    fn kind(&self) -> &'static str {
        "valley"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        self.joints.iter().try_for_each(|joint| reads.motion(*joint))?;
        reads.potential();
        Ok(())
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        for motion in 0..self.joints.len() {
            let coords = view.motion(motion).coords.to_vec();
            for (k, x) in coords.iter().enumerate() {
                let way = x - self.center;
                let root = (1.0 + way * way).sqrt();
                rows.add_value(root - 1.0);
                let (slope, curvature) = rows.slope(motion);
                slope[k] += self.slope * way / root;
                curvature[k] += self.curvature;
            }
        }
    }
    fn mandatory(&self) -> bool {
        false
    }
}

fn scalar_joints(rig: &ikiru_rig::Rig) -> Vec<JointId> {
    let is_plain = |joint: &JointId| {
        let joint = rig.get(*joint).unwrap();
        let motion = &joint.motion;
        joint.mimic.is_none()
            && matches!(
                motion,
                JointMotion::Hinge { .. } | JointMotion::Slider { .. } | JointMotion::Euler { .. }
            )
    };
    rig.ids().filter(is_plain).collect()
}

#[test]
fn potentials_have_the_slope_and_no_more_than_the_curvature_that_they_say() {
    let mut n_checked = 0;
    for number in 0..30 {
        let rig = random_rig(10, number);
        let joints = scalar_joints(&rig);
        if joints.is_empty() {
            continue;
        }
        let pose = random_pose(&rig, &mut Random::new(number));
        let check = |slope: f64, curvature: f64| {
            let mut problem = Problem::whole_body(&rig);
            problem.add(0.7, Valley { joints: joints.clone(), center: 0.3, slope, curvature });
            check_jacobian(&problem, &pose, 1e-6)
        };
        assert_eq!(check(1.0, 1.0), Ok(()));
        assert!(matches!(check(1.001, 1.0), Err(CheckError::Gradient { .. })));
        assert!(matches!(check(1.0, 0.1), Err(CheckError::Curvature { .. })));
        n_checked += 1;
    }
    assert!(n_checked > 20);
}

#[test]
fn a_potential_pulls_to_its_least_value_in_poses_and_motions() {
    let rig = random_rig(10, 4);
    let joints = scalar_joints(&rig);
    let center = 0.05;
    let valley = Valley { joints: joints.clone(), center, slope: 1.0, curvature: 1.0 };
    let is_there = |pose: &Pose| {
        joints.iter().all(|joint| {
            let at = rig.coords_of(*joint);
            let ranges = rig.get(*joint).unwrap().motion.ranges();
            pose.coords()[at]
                .iter()
                .zip(ranges)
                .all(|(x, range)| (x - center.clamp(range.min, range.max)).abs() < 1e-4)
        })
    };
    for method in [Method::Lm, Method::Adam(AdamOptions::DEFAULT)] {
        let mut problem = Problem::whole_body(&rig);
        problem.add(2.0, valley.clone());
        let options = SolverOptions { method, max_iterations: 2000, ..SolverOptions::default() };
        let solver = Solver::new(options);
        let mut workspace = solver.workspace(&problem);
        let mut pose = random_pose(&rig, &mut Random::new(2));
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        assert!((report.cost - report.terms[0].cost).abs() < 1e-12 && report.success);
        assert!(is_there(&pose), "{}: {:?}", method.name(), report.stop);
    }
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 4.0).unwrap());
    let valley = motion.add(2.0, When::Throughout, valley).unwrap();
    let guess = Clip::still(random_pose(&rig, &mut Random::new(2)));
    let planned = Solver::default().plan(&motion, &guess, &mut MotionWorkspace::default()).into_owned();
    let report = &planned.report;
    assert!(planned.clip.poses().iter().all(is_there), "{report:?}");
    // What the potential costs is told of its term: some joints stop short of it.
    let of_smoothness: f64 = report.smoothness.iter().sum();
    assert!((report.cost - of_smoothness - report[valley].cost).abs() < 1e-12 * report.cost);
}

/// Keeps a joint out of balls: a row for each that is near, and none for the others.
#[derive(Clone, Debug)]
struct KeepOut {
    joint: JointId,
    balls: Vec<(DVec3, f64)>,
    /// How near is near; without end, every row is open always.
    near: f64,
}

impl Objective for KeepOut {
    fn kind(&self) -> &'static str {
        "keep_out"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.part(Part::at_least(self.balls.len(), Unit::Metres))
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        for (center, radius) in &self.balls {
            let away = view.frame(0).origin.value() - *center;
            let distance = away.length();
            if distance - radius > self.near {
                continue;
            }
            let row = rows.open(0, [distance - radius]);
            if rows.wants_jacobian() {
                rows.by_frame(row, 0)[..3].copy_from_slice(&(away / distance.max(1e-9)).to_array());
            }
        }
    }
}

#[test]
fn rows_come_and_go_without_anything_being_laid_out_anew() {
    let (mut n_held, mut n_cases) = (0, 0);
    for number in 0..40 {
        let mut random = Random::new(number);
        let rig = random_rig(9, number);
        let tip = JointId::from_index(8);
        let target = random_pose(&rig, &mut random).frame(tip).unwrap().position;
        let start = random_pose(&rig, &mut random);
        let balls: Vec<(DVec3, f64)> =
            (0..8).map(|_| (target + random.vector(0.5), random.between(0.02, 0.2))).collect();
        let solve = |near: f64, hard: bool| {
            let mut problem = Problem::whole_body(&rig);
            problem.add(1.0, Position::new(tip, target));
            let out = problem.add(100.0, KeepOut { joint: tip, balls: balls.clone(), near });
            problem.term_mut(out).hard = hard;
            let solver = Solver::default();
            let mut workspace = solver.workspace(&problem);
            let mut pose = start.clone();
            let mut missed = 0.0;
            let allocated = allocations::count(|| {
                missed = solver.solve(&problem, &mut pose, &mut workspace).terms[1].residual;
            });
            assert_eq!(allocated, 0, "case {number}");
            let at = pose.frame(tip).unwrap().position;
            let deepest = balls.iter().map(|(center, r)| r - at.distance(*center)).fold(0.0, f64::max);
            assert!((deepest - missed).abs() < 1e-9 || missed > deepest, "{deepest}, {missed}");
            (pose, deepest)
        };
        // Rows far away matter to nobody, whether or not they are open.
        let (_, near) = solve(0.5, true);
        let (_, all) = solve(f64::INFINITY, true);
        n_held += usize::from(near < 1e-6) + usize::from(all < 1e-6);
        n_cases += 2;
        let (_, soft) = solve(0.5, false);
        assert!(soft < 0.2);
    }
    assert!(n_held as f64 > 0.9 * f64::from(n_cases), "{n_held} of {n_cases}");
}

/// A wish that gives up after so many evaluations.
#[derive(Clone, Debug)]
struct Tires {
    inner: Position,
    left: Arc<AtomicUsize>,
    opens_too_many: bool,
}

impl Objective for Tires {
    fn kind(&self) -> &'static str {
        "tires"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        self.inner.reads(reads)
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        self.inner.evaluate(view, rows);
        let left = self.left.load(Ordering::Relaxed);
        if left > 0 {
            self.left.store(left - 1, Ordering::Relaxed);
        } else if self.opens_too_many {
            rows.open(0, [1.0]);
        } else {
            rows.fail("has had enough");
        }
    }
}

#[test]
fn an_objective_that_gives_up_ends_the_solve_and_is_named() {
    let rig = random_rig(8, 5);
    let tip = JointId::from_index(7);
    let far = DVec3::splat(3.0);
    let methods = [Method::Lm, Method::Adam(AdamOptions::DEFAULT), Method::Ccd, Method::Fabrik];
    for (method, opens_too_many) in methods.into_iter().flat_map(|method| [(method, false), (method, true)]) {
        let solve = |left: usize| {
            let mut problem = Problem::whole_body(&rig);
            problem.add(1.0, Position::new(tip, far));
            let left = Arc::new(AtomicUsize::new(left));
            problem.add(1.0, Tires { inner: Position::new(tip, far), left, opens_too_many });
            let search = Search::Global { max_restarts: 5 };
            let solver = Solver::new(SolverOptions { method, search, ..SolverOptions::default() });
            let mut workspace = solver.workspace(&problem);
            let mut pose = rig.rest_pose();
            pose.project();
            let before = pose.frame(tip).unwrap().position.distance(far);
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            let after = pose.frame(tip).unwrap().position.distance(far);
            let is_invalid = report.stop == StopReason::InvalidInput;
            assert!(report.cost.is_finite() || is_invalid, "{}: {:?}", method.name(), report.stop);
            (report.stop, report.invalid, before, after)
        };
        let expected = |invalid: Option<Invalid>| {
            let Some(Invalid::Term(1, InvalidTerm::GaveUp(reason))) = invalid else { panic!("{invalid:?}") };
            assert!(reason == "has had enough" || reason.starts_with("opened more rows"));
        };
        // From the first evaluation on: nothing is touched.
        let (stop, invalid, before, after) = solve(0);
        assert_eq!((stop, before), (StopReason::InvalidInput, after));
        expected(invalid);
        // Later: what was found so far comes back.
        let (stop, invalid, before, after) = solve(12);
        assert_eq!(stop, StopReason::ObjectiveFailed, "{}", method.name());
        assert!(after < before, "{}: {after} from {before}", method.name());
        expected(invalid);
    }
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 4.0).unwrap());
    let left = Arc::new(AtomicUsize::new(12));
    let tires = Tires { inner: Position::new(tip, far), left, opens_too_many: false };
    motion.add(1.0, When::Throughout, tires).unwrap();
    let guess = Clip::still(rig.rest_pose());
    let report = Solver::default().plan(&motion, &guess, &mut MotionWorkspace::default()).into_owned().report;
    assert_eq!(report.stop, StopReason::ObjectiveFailed);
    assert!(matches!(report.invalid, Some(Invalid::Term(0, _))));
}
