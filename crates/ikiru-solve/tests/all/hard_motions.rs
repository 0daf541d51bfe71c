//! Hard rows in motions: at times, over spans and throughout, solved for exactly and iteratively.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
use glam::DVec3;
use ikiru_rig::{Clip, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{Bound, Coupling, Distance, Position};
use ikiru_solve::{
    AdamOptions, Invalid, Method, MotionProblem, MotionWorkspace, Objective, Part, PlannedMotion, Reads,
    Report, Rows, Solver, SolverOptions, StopReason, Timeline, Tolerance, Unfit, Unit, View, When,
};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// A motion problem whose constraints a motion is known to satisfy.
fn case(number: u64, n_samples: usize) -> (Rig, MotionProblem) {
    let mut random = Random::new(number);
    let rig = random_rig(4 + random.below(8), number);
    // A walk that keeps what is asked for.
    let mut poses = vec![random_pose(&rig, &mut random)];
    while poses.len() < n_samples {
        let mut pose = poses[poses.len() - 1].clone();
        let step: Vec<f64> = (0..rig.n_dofs()).map(|_| random.between(-0.2, 0.2)).collect();
        pose.retract(&step).unwrap();
        pose.project();
        poses.push(pose);
    }
    let timeline = Timeline::seconds(1.0, (n_samples - 1) as f64).unwrap();
    let mut motion = MotionProblem::whole_body(&rig, timeline);
    motion.set_smoothness([0.01; 3]).unwrap();
    if random.below(2) == 0 {
        motion.fix_start(&poses[0]).unwrap();
    }
    let tip = JointId::from_index(rig.n_joints() - 1);
    let end = random_pose(&rig, &mut random).frame(tip).unwrap().position;
    motion.add(1.0, When::End, Position::new(tip, end)).unwrap();
    for _ in 0..1 + random.below(4) {
        let [a, b] = [0, 1].map(|_| JointId::from_index(random.below(rig.n_joints())));
        let apart = |pose: &Pose| pose.frame(a).unwrap().position.distance(pose.frame(b).unwrap().position);
        let all = poses.iter().map(apart);
        let bound = match random.below(2) {
            0 => Bound::AtLeast((all.fold(f64::INFINITY, f64::min) - 0.01).max(0.0)),
            _ => Bound::AtMost(all.fold(0.0, f64::max) + 0.01),
        };
        if a != b {
            motion.add_hard(When::Throughout, Distance::new([a, b], bound)).unwrap();
        }
    }
    let hinge = |j: &JointId| {
        let joint = rig.get(*j).unwrap();
        matches!(joint.motion, JointMotion::Hinge { .. }) && joint.mimic.is_none()
    };
    if let Some(joint) = rig.ids().find(hinge) {
        let value = poses[n_samples / 2].value(joint).unwrap();
        let time = timeline.time(n_samples / 2);
        let coupling = Coupling::new(&rig, &[(joint, None, 1.0)], Bound::Exactly(value)).unwrap();
        motion.add_hard(When::At(time), coupling).unwrap();
    }
    (rig, motion)
}

fn plan(motion: &MotionProblem, rig: &Rig, options: SolverOptions) -> PlannedMotion<'static> {
    let mut still = rig.rest_pose();
    still.project();
    let guess = Clip::still(still);
    Solver::new(options).plan(motion, &guess, &mut MotionWorkspace::default()).into_owned()
}

fn missed(report: &Report) -> f64 {
    report.terms.iter().filter(|t| t.hard).map(|t| t.residual).fold(0.0, f64::max)
}

#[test]
fn constraints_hold_at_every_sample() {
    let (mut n_held, mut n_cases) = (0, 0);
    let mut unmet = Vec::new();
    for number in 0..200 {
        let (rig, motion) = case(number, 8);
        let planned = plan(&motion, &rig, SolverOptions::default());
        assert!(planned.report.invalid.is_none(), "{number}: {:?}", planned.report.invalid);
        n_cases += 1;
        if missed(&planned.report) < 1e-6 {
            n_held += 1;
        } else {
            unmet.push((number, missed(&planned.report), planned.report.stop, planned.report.iterations));
        }
        for pose in planned.clip.poses() {
            assert!(pose.limit_violation() < 1e-9);
        }
    }
    assert!(f64::from(n_held) >= 0.97 * f64::from(n_cases), "{n_held} of {n_cases}: {unmet:?}");
}

#[test]
fn constraints_hold_where_steps_are_solved_for_iteratively() {
    for number in 0..6 {
        let (rig, mut motion) = case(number, 151);
        let tip = JointId::from_index(rig.n_joints() - 1);
        let from = rig.rest_pose().frame(tip).unwrap().position;
        // Targets at every sample: too many rows to solve over.
        let way = DVec3::new(0.1, -0.05, 0.1);
        for joint in 0..2 {
            let joint = JointId::from_index(rig.n_joints() - 1 - joint);
            motion.add_moving(0.1, When::Throughout, |secs| Position::new(joint, from + way * secs)).unwrap();
        }
        let planned = plan(&motion, &rig, SolverOptions::default());
        assert!(planned.report.invalid.is_none(), "{number}: {:?}", planned.report.invalid);
        assert!(missed(&planned.report) < 1e-5, "case {number}: {}", missed(&planned.report));
    }
}

#[test]
fn what_is_hard_is_kept_at_a_cost_and_changes_nothing_where_it_does_not_bind() {
    for number in 0..30 {
        let (rig, mut motion) = case(number, 6);
        let bound = plan(&motion, &rig, SolverOptions::default());
        let is_hard: Vec<bool> = bound.report.terms.iter().map(|t| t.hard).collect();
        assert!(bound.report.terms.iter().filter(|t| t.hard).all(|t| t.cost == 0.0 && t.mandatory));
        motion.terms_mut().iter_mut().zip(&is_hard).for_each(|(term, hard)| term.is_on = !hard);
        // From there, so that both are in one valley.
        let free =
            Solver::default().plan(&motion, &bound.clip, &mut MotionWorkspace::default()).into_owned().report;
        let (bound, slack) = (bound.report, 1e-9);
        if missed(&bound) < 1e-6 {
            assert!(bound.cost >= free.cost * (1.0 - 1e-6) - slack, "{number}: {} {}", bound.cost, free.cost);
        }
        if missed(&free) == 0.0 {
            assert!((bound.cost - free.cost).abs() < 1e-3 * free.cost + slack, "case {number}");
        }
    }
}

#[test]
fn constraints_that_contradict_each_other_are_named() {
    let rig = random_rig(6, 3);
    let [a, b] = [0, 5].map(JointId::from_index);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 5.0).unwrap());
    let apart =
        rig.rest_pose().frame(a).unwrap().position.distance(rig.rest_pose().frame(b).unwrap().position);
    motion.add_hard(When::Throughout, Distance::new([a, b], Bound::AtMost(apart))).unwrap();
    motion.add_hard(When::At(0.6), Distance::new([a, b], Bound::AtLeast(apart + 0.1))).unwrap();
    for method in [Method::Lm, Method::Adam(AdamOptions::DEFAULT)] {
        let report =
            plan(&motion, &rig, SolverOptions { method, max_iterations: 200, ..Default::default() }).report;
        assert!(!report.success && report.stop != StopReason::Reached && report.cost.is_finite());
        let missed: Vec<f64> = report.terms.iter().map(|t| t.residual).collect();
        assert!(report.terms.iter().any(|t| t.hard && !t.satisfied), "{missed:?}");
        // What is missed is shared: no way there is to miss less in all.
        assert!((missed[0] + missed[1] - 0.1).abs() < 0.02, "{missed:?}");
        assert!((report.terms[1].times.unwrap().worst_secs - 0.6).abs() < 1e-9);
    }
    // A constraint that given samples do not meet, and nothing else can.
    let mut settled = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 5.0).unwrap());
    settled.fix_start(&rig.rest_pose()).unwrap();
    settled.add_hard(When::At(0.0), Distance::new([a, b], Bound::AtLeast(apart + 0.1))).unwrap();
    let report = plan(&settled, &rig, SolverOptions::default()).report;
    assert!(matches!(report.invalid, Some(Invalid::Term(0, _))));
}

/// A chain of hinges, 0.3 m long each.
fn hinges() -> Rig {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    for idx in 0..4 {
        let mut joint = Joint::new(format!("joint_{idx}"), parent);
        joint.rest_translation = if idx == 0 { DVec3::ZERO } else { DVec3::X * 0.3 };
        if idx < 3 {
            joint.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::degrees(-90.0, 90.0) };
        }
        parent = Some(builder.add(joint));
    }
    builder.build().unwrap()
}

/// The hinges reach somewhere in so many samples, solved for iteratively where there is a target at each, while the middle one is to
/// have all of some values at once.
fn torn(rig: &Rig, n_samples: u32, is_iterative: bool, values: &[f64]) -> MotionProblem {
    let [middle, tip] = [1, 3].map(JointId::from_index);
    let timeline = Timeline::seconds(1.0, f64::from(n_samples - 1)).unwrap();
    let mut motion = MotionProblem::whole_body(rig, timeline);
    motion.set_smoothness([0.01; 3]).unwrap();
    let from = rig.rest_pose().frame(tip).unwrap().position;
    let way = DVec3::new(-0.1, 0.2, 0.0);
    if is_iterative {
        motion.add_moving(0.1, When::Throughout, |secs| Position::new(tip, from + way * secs)).unwrap();
    } else {
        motion.add(1.0, When::End, Position::new(tip, from + way)).unwrap();
    }
    for value in values {
        let exactly = Coupling::new(rig, &[(middle, None, 1.0)], Bound::Exactly(*value)).unwrap();
        motion.add_hard(When::At(0.6), exactly).unwrap();
    }
    motion
}

#[test]
fn constraints_that_contradict_each_other_are_missed_by_least_in_sum() {
    let rig = hinges();
    // Steps that are solved for exactly, and too many rows to do so.
    for (n_samples, is_iterative) in [(6, false), (251, true)] {
        for wanted in [[0.1, 0.2, 0.4], [0.4, 0.1, 0.2], [-0.3, 0.5, 0.0], [0.7, -0.2, 0.6]] {
            let motion = torn(&rig, n_samples, is_iterative, &wanted);
            let planned = plan(&motion, &rig, SolverOptions::default());
            let sample = (0.6 * f64::from(n_samples - 1)).round() as usize;
            let found = planned.clip.poses()[sample].value(JointId::from_index(1)).unwrap();
            let mut sorted = wanted;
            sorted.sort_by(f64::total_cmp);
            // The middle one holds, and each of the others is missed by its own way to it.
            assert!((found - sorted[1]).abs() < 1e-4, "{n_samples} samples, {wanted:?}: {found}");
            let missed: f64 = planned.report.terms.iter().filter(|t| t.hard).map(|t| t.residual).sum();
            assert!((missed - (sorted[2] - sorted[0])).abs() < 1e-3, "{wanted:?}: {missed}");
        }
    }
}

#[test]
fn beside_constraints_that_contradict_each_other_wishes_settle_as_beside_the_one_that_holds() {
    let rig = hinges();
    for (n_samples, is_iterative) in [(6, false), (251, true)] {
        for (wanted, held) in [([0.1, 0.2, 0.4], 0.2), ([0.4, 0.1, 0.2], 0.2), ([0.7, -0.2, 0.6], 0.6)] {
            let [cost, best] = [&wanted[..], &[held]].map(|values| {
                let motion = torn(&rig, n_samples, is_iterative, values);
                plan(&motion, &rig, SolverOptions::default()).report.cost
            });
            assert!(cost < 1.05 * best + 1e-12, "{n_samples} samples, {wanted:?}: {cost} is not {best}");
        }
    }
}

#[test]
fn adam_presses_constraints_too() {
    let mut n_near = 0;
    for number in 0..20 {
        let (rig, motion) = case(number, 6);
        let method = Method::Adam(AdamOptions::DEFAULT);
        let options = SolverOptions { method, max_iterations: 400, ..Default::default() };
        n_near += usize::from(missed(&plan(&motion, &rig, options).report) < 0.02);
    }
    assert!(n_near >= 15, "{n_near} of 20");
}

/// A point of a joint where it was a sample ago: a foot that does not slide.
#[derive(Clone, Debug)]
struct Still {
    joint: JointId,
    point: DVec3,
}

impl Objective for Still {
    fn kind(&self) -> &'static str {
        "still"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.earlier(1)?;
        reads.part(Part::new(3, Unit::Metres))
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let arms = [view.frame(0), view.earlier(1, 0)]
            .map(|frame| (frame.origin.value(), frame.rotation.apply_constant(self.point).value()));
        let slip = arms[0].0 + arms[0].1 - arms[1].0 - arms[1].1;
        let first = rows.open(0, slip.to_array());
        if rows.wants_jacobian() {
            for (back, sign) in [(0, 1.0), (1, -1.0)] {
                for (i, axis) in DVec3::AXES.into_iter().enumerate() {
                    let out = rows.by_earlier_frame(first + i, back, 0);
                    out[..3].copy_from_slice(&(sign * axis).to_array());
                    out[3..].copy_from_slice(&(sign * arms[back].1.cross(axis)).to_array());
                }
            }
        }
    }
}

#[test]
fn what_reads_earlier_samples_holds_between_them() {
    let (mut n_held, mut n_moved) = (0, 0);
    for number in 0..24 {
        let mut random = Random::new(number);
        let rig = random_rig(10, number);
        let mut start = random_pose(&rig, &mut random);
        let [foot, hand] = [4, 9].map(JointId::from_index);
        let still = Still { joint: foot, point: DVec3::new(0.1, 0.0, 0.05) };
        let timeline = Timeline::seconds(1.0, 10.0).unwrap();
        let mut motion = MotionProblem::whole_body(&rig, timeline);
        motion.set_smoothness([0.01; 3]).unwrap();
        if number % 2 == 0 {
            motion.fix_start(&start).unwrap();
        }
        let reach = random_pose(&rig, &mut random).frame(hand).unwrap().position;
        motion.add(1.0, When::End, Position::new(hand, reach)).unwrap();
        let id = motion.add(1.0, When::Span { from: 0.3, to: 0.8 }, still.clone()).unwrap();
        let term = motion.term_mut(id);
        (term.hard, term.tolerance) = (true, Tolerance::HARD);
        start.project();
        let guess = Clip::still(start.clone());
        let planned = Solver::default().plan(&motion, &guess, &mut MotionWorkspace::default()).into_owned();
        assert!(planned.report.invalid.is_none(), "{:?}", planned.report.invalid);
        let at = |sample: usize| {
            let frame = planned.clip.poses()[sample].frame(foot).unwrap();
            frame.position + frame.rotation * still.point
        };
        // From the sample before the first that it holds at, to the last.
        let slip = (3..=8).map(|sample| at(sample).distance(at(sample - 1))).fold(0.0, f64::max);
        n_held += usize::from(slip < 1e-6);
        n_moved += usize::from(at(10).distance(at(8)) > 1e-3);
        assert!((planned.report.terms[1].residual - slip).abs() < 1e-9);
        // It is no part of a single pose.
        assert_eq!(motion.at(5).terms().len(), 0);
    }
    assert!(n_held >= 23 && n_moved > 3, "{n_held}, {n_moved}");
    let rig = random_rig(10, 1);
    let mut problem = ikiru_solve::Problem::whole_body(&rig);
    problem.add_hard(Still { joint: JointId::from_index(4), point: DVec3::ZERO });
    let mut workspace = Solver::default().workspace(&problem);
    let report = Solver::default().solve(&problem, &mut rig.rest_pose(), &mut workspace);
    let Some(Invalid::Term(0, unfit)) = report.invalid else { panic!("{:?}", report.invalid) };
    assert!(unfit.to_string().contains("belongs in a motion"));
}
