//! Frames that are given, joints that do not move, and terms that hold at neither: what stays, and what is refused.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use crate::common::{arm, place, plan};
use glam::DVec3;
use ikiru_rig::{Clip, Joint, JointId, JointMotion, Range, RigBuilder};
use ikiru_solve::objectives::{Position, RestPose};
use ikiru_solve::{
    Invalid, InvalidPose, InvalidTerm, MotionProblem, MotionWorkspace, Solver, SolverOptions, Timeline, When,
};

#[test]
fn what_given_frames_do_not_meet_is_named() {
    let (rig, hand) = arm(100.0);
    let rest = rig.rest_pose();
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
    motion.set_smoothness([1e-6; 3]).unwrap();
    motion.fix_start(&rest).unwrap();
    motion.fix_end(Some(&rest)).unwrap();
    motion.add(1.0, When::At(0.5), Position::new(hand, DVec3::new(0.5, 0.5, 0.0))).unwrap();
    let end = motion.add(1.0, When::End, Position::new(hand, DVec3::new(0.4, 0.5, 0.0))).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &rest);
    let Some(Invalid::Term(1, InvalidTerm::Settled)) = planned.report.invalid else {
        panic!("{:?}", planned.report)
    };
    // Met by what is given, or asked for by nobody, it is no conflict.
    motion[end].target = place(&rest, hand);
    assert!(plan(SolverOptions::default(), &motion, &rest).report.success);
    motion[end].target = DVec3::new(0.4, 0.5, 0.0);
    motion.term_mut(end).mandatory = false;
    let planned = plan(SolverOptions::default(), &motion, &rest);
    assert!(planned.report.success && !planned.report.terms[1].satisfied);
    // Over a span it says nothing of the frames that are given.
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
    motion.set_smoothness([1e-6; 3]).unwrap();
    motion.fix_start(&rest).unwrap();
    motion.add(1.0, When::Throughout, Position::new(hand, DVec3::new(0.5, 0.5, 0.0))).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &rest);
    assert!(planned.report.success, "{:?}", planned.report);
    assert!(place(&planned.clip.poses()[1], hand).distance(DVec3::new(0.5, 0.5, 0.0)) < 1e-3);
}

#[test]
fn what_does_not_move_is_judged_as_the_clip_has_it() {
    let (rig, hand) = arm(170.0);
    let first = JointId::from_index(0);
    let turned = |angle: f64| {
        let mut pose = rig.rest_pose();
        pose.set_euler(first, [0.0, 0.0, angle]).unwrap();
        pose
    };
    let guess = Clip::new("", vec![0.0, 1.0], vec![turned(0.0), turned(1.0)]).unwrap();
    let active: Vec<JointId> = rig.ids().filter(|joint| *joint != first).collect();
    let mut motion = MotionProblem::new(&rig, active, Timeline::seconds(1.0, 10.0).unwrap()).unwrap();
    motion.set_smoothness([1e-6; 3]).unwrap();
    let id = motion.add(1.0, When::End, Position::new(hand, DVec3::new(0.5, 0.4, 0.2))).unwrap();
    let planned = Solver::default().plan(&motion, &guess, &mut MotionWorkspace::default()).into_owned();
    let at = place(planned.clip.poses().last().unwrap(), hand);
    let residual = planned.report.terms[motion.terms().position(id).unwrap()].residual;
    assert!((at.distance(DVec3::new(0.5, 0.4, 0.2)) - residual).abs() < 1e-9, "{residual}");
    assert!(planned.report.success);
    // Given frames that differ there are refused.
    motion.fix_start(&turned(0.0)).unwrap();
    motion.fix_end(Some(&turned(1.0))).unwrap();
    let planned = Solver::default().plan(&motion, &guess, &mut MotionWorkspace::default()).into_owned();
    assert!(matches!(planned.report.invalid, Some(Invalid::Pose(InvalidPose::GivenDiffer))));
}

#[test]
fn an_active_joint_that_no_term_reads_stays_where_the_given_frame_has_it() {
    let mut builder = RigBuilder::new();
    let hinge = JointMotion::Hinge { axis: DVec3::Z, range: Range::new(-3.0, 3.0) };
    for name in ["a", "b"] {
        let mut joint = Joint::new(name, None);
        joint.motion = hinge;
        let joint = builder.add(joint);
        let mut tip = Joint::new(format!("{name}_tip"), Some(joint));
        tip.rest_translation = DVec3::X;
        builder.add(tip);
    }
    let rig = builder.build().unwrap();
    let (b, tip) = (rig.joint("b").unwrap(), rig.joint("a_tip").unwrap());
    let mut start = rig.rest_pose();
    start.set_value(b, 1.0).unwrap();
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
    motion.fix_start(&start).unwrap();
    motion.add(1.0, When::End, Position::new(tip, DVec3::Y)).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    assert!(planned.clip.poses().iter().all(|pose| pose.value(b) == Some(1.0)));
}

#[test]
fn a_given_frame_outside_its_range_does_not_spoil_the_rest() {
    let (rig, hand) = arm(60.0);
    let mut start = rig.rest_pose();
    start.set_euler(JointId::from_index(1), [0.0, 0.0, 1.5]).unwrap();
    assert!(start.limit_violation() > 0.4);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 20.0).unwrap());
    motion.set_smoothness([1e-6; 3]).unwrap();
    motion.fix_start(&start).unwrap();
    motion.add(1.0, When::End, Position::new(hand, DVec3::new(0.6, 0.4, 0.1))).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    assert!(planned.report.success, "{:?}", planned.report);
    assert_eq!(planned.clip.poses()[0], start);
    assert!(planned.clip.poses()[1..].iter().all(|pose| pose.limit_violation() < 1e-9));
}

#[test]
fn terms_of_joint_motions_alone_move_without_smoothness() {
    let (rig, _) = arm(100.0);
    let joints: Vec<JointId> = rig.ids().take(4).collect();
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
    motion.set_smoothness([0.0; 3]).unwrap();
    motion.add(1.0, When::Throughout, RestPose::new(&joints, rig.rest_pose())).unwrap();
    let mut start = rig.rest_pose();
    start.coords_mut().iter_mut().for_each(|c| *c = 0.4);
    let planned = plan(SolverOptions::default(), &motion, &start);
    assert!(planned.report.cost < 1e-12, "{:?}", planned.report);
}

/// Two units of way on a hinge, from and to given angles, with a target at the end that the given end meets or misses
/// by a little: the same constant whatever the plan does.
fn turn_with_settled_term(weight: f64, smoothness: f64, miss: f64) -> (Vec<f64>, f64) {
    let mut builder = RigBuilder::new();
    let mut hinge = Joint::new("hinge", None);
    hinge.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED };
    let hinge = builder.add(hinge);
    let mut tip = Joint::new("tip", Some(hinge));
    tip.rest_translation = DVec3::X;
    let tip = builder.add(tip);
    let rig = builder.build().unwrap();
    let turned = |angle: f64| {
        let mut pose = rig.rest_pose();
        pose.set_value(hinge, angle).unwrap();
        pose
    };
    let (from, to) = (10_f64.to_radians(), 50_f64.to_radians());
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
    motion.set_smoothness([smoothness; 3]).unwrap();
    motion.fix_start(&turned(from)).unwrap();
    motion.fix_end(Some(&turned(to))).unwrap();
    let target = DVec3::new(to.cos(), to.sin(), miss);
    motion.add(weight, When::End, Position::new(tip, target)).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &turned(from));
    assert!(planned.report.success, "{:?}", planned.report);
    let cost_of_miss = weight * miss * miss;
    assert!((planned.report.terms[0].cost - cost_of_miss).abs() < 1e-12 * (1.0 + cost_of_miss));
    let angles = planned.clip.poses().iter().map(|pose| pose.value(hinge).unwrap()).collect();
    (angles, planned.report.cost - cost_of_miss)
}

#[test]
fn a_term_that_given_frames_settle_changes_nothing() {
    let (even, least) = turn_with_settled_term(1.0, 0.001, 0.0);
    for (t, angle) in even.iter().enumerate() {
        let straight = (10.0 + 40.0 * t as f64 / 30.0).to_radians();
        assert!((angle - straight).abs() < 1e-6, "{t}: {}", angle.to_degrees());
    }
    for (weight, smoothness, miss) in
        [(3.0, 0.001, 0.0), (1000.0, 0.001, 0.0), (1.0, 1e-5, 0.0), (1.0, 0.001, 5e-4), (1e6, 0.001, 5e-4)]
    {
        let (angles, cost) = turn_with_settled_term(weight, smoothness, miss);
        let furthest = angles.iter().zip(&even).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(furthest < 1e-6, "weight {weight}, smoothness {smoothness}, miss {miss}: {furthest}");
        assert!((cost * 0.001 / smoothness - least).abs() < 1e-9, "{cost} beside {least}");
    }
}

#[test]
fn what_given_samples_settle_costs_what_each_of_them_does() {
    let timeline = Timeline::points(5).unwrap();
    let (rig, hand) = arm(100.0);
    let root = JointId::from_index(0);
    // Only the hand may move: the root is read at every sample, and its target goes away from it.
    let mut motion = MotionProblem::new(&rig, [hand], timeline).unwrap();
    let when = When::Span { from: timeline.time(0), to: timeline.time(2) };
    let at = rig.rest_pose().frame(root).unwrap().position;
    let away = DVec3::new(0.3, 0.1, -0.2);
    let settled = motion.add_moving(1.0, when, |secs| Position::new(root, at + secs * away)).unwrap();
    motion.fix_history(&vec![rig.rest_pose(); 3]).unwrap();
    // A bar of the cost, so that what is settled need not be met.
    let solver = Solver::new(SolverOptions { cost_below: Some(1e9), ..SolverOptions::default() });
    let mut workspace = MotionWorkspace::default();
    let planned = solver.plan(&motion, &Clip::still(rig.rest_pose()), &mut workspace);
    let wanted: f64 = (0..3).map(|sample| (timeline.time(sample) * away).length_squared()).sum();
    let report = &planned.report;
    assert!((report[settled].cost - wanted).abs() < 1e-12 * wanted, "{report:?}");
    assert!(
        (report.cost - report.smoothness.iter().sum::<f64>() - wanted).abs() < 1e-12 * wanted,
        "{report:?}"
    );
}
