//! What is in the way of motions, and what acts in nobody's way: when, and how much moving it saves.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::f64::consts::PI;

use crate::common::{place, plan};
use crate::forces::{chain, force, near, saved};
use glam::DVec3;
use ikiru_rig::{Clip, Joint, JointId, JointMotion, Pose, Range, Rate, RateLimit, RatePart, Rig, RigBuilder};
use ikiru_solve::objectives::{Bound, Coupling, Position, RestPose};
use ikiru_solve::{
    ForceBy, LimitKind, MotionProblem, MotionWorkspace, Solver, SolverOptions, Timeline, Tolerance, When,
};
use ikiru_testkit::rigs::Random;

#[test]
fn motions_tell_what_is_in_the_way_at_the_worst_sample() {
    let (rig, ids) = chain(&[(0.4, Range::new(-PI, 0.5)), (0.3, Range::new(-0.1, 0.1))]);
    let guess = rig.rest_pose();
    let line = Timeline::seconds(1.0, 10.0).unwrap();
    // Beyond the limits of both hinges.
    let mut motion = MotionProblem::whole_body(&rig, line);
    let target = DVec3::new(0.0, 0.7, 0.0);
    motion.add(1.0, When::At(1.0), Position::new(ids[2], target)).unwrap();
    motion.set_smoothness([1e-6; 3]).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &guess);
    let limits =
        planned.report.forces.iter().filter(|f| f.on == Some(0) && matches!(f.by, ForceBy::Limit { .. }));
    assert!(limits.map(|f| f.share).sum::<f64>() > 0.99, "{:?}", planned.report.forces);
    // A weight that smoothness outweighs.
    let mut motion = MotionProblem::whole_body(&rig, line);
    motion.fix_start(&guess).unwrap();
    motion.add(1e-3, When::At(0.1), Position::new(ids[2], DVec3::new(0.65, 0.2, 0.0))).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &guess);
    let smooth = force(&planned.report.forces, 0, ForceBy::Smoothness);
    assert!(smooth.share > 0.99 && planned.report.forces[0] == smooth, "{:?}", planned.report.forces);
    // Time that does not suffice.
    let mut motion = MotionProblem::whole_body(&rig, line);
    motion.fix_start(&guess).unwrap();
    motion.set_smoothness([1e-6; 3]).unwrap();
    motion.add(1.0, When::At(0.1), Position::new(ids[2], DVec3::new(0.65, 0.2, 0.0))).unwrap();
    let slow = ids[..2].iter().map(|joint| RateLimit {
        joint: *joint,
        part: RatePart::Rotation,
        rate: Rate::Speed,
        most: 0.2,
    });
    motion.set_rate_limits(&slow.collect::<Vec<_>>()).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &guess);
    let rates = force(&planned.report.forces, 0, ForceBy::RateLimits);
    assert!(rates.share > 0.9, "{:?}", planned.report.forces);
    // A constraint that holds throughout, and one that it contradicts.
    let mut motion = MotionProblem::whole_body(&rig, line);
    motion.set_smoothness([1e-6; 3]).unwrap();
    motion.add(1.0, When::At(1.0), Position::new(ids[2], DVec3::new(0.65, 0.2, 0.0))).unwrap();
    let coupling = |at: f64| Coupling::new(&rig, &[(ids[0], None, 1.0)], Bound::AtMost(at)).unwrap();
    let most = motion.add(1.0, When::Throughout, coupling(0.1)).unwrap();
    (motion.term_mut(most).hard, motion.term_mut(most).tolerance) = (true, Tolerance::HARD);
    let planned = plan(SolverOptions::default(), &motion, &guess);
    let held = force(&planned.report.forces, 0, ForceBy::Term(1));
    assert!(held.share > 0.5 && planned.report.forces[0] == held, "{:?}", planned.report.forces);
    let least = Coupling::new(&rig, &[(ids[0], None, 1.0)], Bound::AtLeast(0.3)).unwrap();
    let least = motion.add(1.0, When::At(1.0), least).unwrap();
    (motion.term_mut(least).hard, motion.term_mut(least).tolerance) = (true, Tolerance::HARD);
    let planned = plan(SolverOptions::default(), &motion, &guess);
    // Anywhere between the two they miss the same in sum; a third one says where, and each of the two names the other.
    let end = planned.clip.poses()[10].value(ids[0]).unwrap();
    assert!((0.1 - 1e-6..0.3 + 1e-6).contains(&end), "{end}");
    let between = Coupling::new(&rig, &[(ids[0], None, 1.0)], Bound::Exactly(0.2)).unwrap();
    motion.add_hard(When::At(1.0), between).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &guess);
    for (on, by) in [(1, 2), (2, 1)] {
        assert!(
            force(&planned.report.forces, on, ForceBy::Term(by)).share > 0.9,
            "{:?}",
            planned.report.forces
        );
    }
    // Out of reach by a known distance; of a motion that meets all, nothing is told.
    let mut motion = MotionProblem::whole_body(&rig, line);
    motion.add(1.0, When::Throughout, Position::new(ids[2], DVec3::X * 1.0)).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &guess);
    let reach = force(&planned.report.forces, 0, ForceBy::Reach { is_proven: true });
    assert!((reach.amount - 0.3).abs() < 1e-9 && reach.share > 0.99, "{reach:?}");
    assert_eq!(planned.report.hint, None, "a hinge that is the root cannot float");
    let mut motion = MotionProblem::whole_body(&rig, line);
    motion.add(1.0, When::At(1.0), Position::new(ids[2], DVec3::X * 0.7)).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &guess);
    assert!(planned.report.success && planned.report.forces.is_empty());
}

/// One hinge that stops at 0.3, its tip, and the tip where the hinge has turned by so much.
fn stopped(limit: f64) -> (Rig, Vec<JointId>, impl Fn(f64) -> Pose) {
    let (rig, ids) = chain(&[(0.4, Range::new(-PI, limit))]);
    let (of, hinge) = (rig.clone(), ids[0]);
    let turned = move |angle: f64| {
        let mut pose = of.rest_pose();
        pose.set_value(hinge, angle).unwrap();
        pose
    };
    (rig, ids, turned)
}

#[test]
fn motions_tell_what_acts_in_nobodys_way_where_it_is_the_strongest() {
    let (rig, ids, turned) = stopped(0.3);
    let line = Timeline::seconds(1.0, 10.0).unwrap();
    let mut motion = MotionProblem::whole_body(&rig, line);
    motion.set_smoothness([0.0; 3]).unwrap();
    // Pulled beyond its limit from 0.3 s on, the furthest at 0.6 s.
    let further = |secs: f64| 0.5 - (secs - 0.6).abs();
    let pull = motion
        .add_moving(1e-3, When::Throughout, |secs| RestPose::new(&ids[..1], turned(further(secs))))
        .unwrap();
    motion.term_mut(pull).mandatory = false;
    motion.fix_end(Some(&turned(0.3))).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    assert!(planned.report.success);
    let [limit] = planned.report.forces[..] else { panic!("{:?}", planned.report.forces) };
    assert_eq!((limit.on, limit.by), (None, ForceBy::Limit { joint: ids[0], kind: LimitKind::Value }));
    near(limit.secs.unwrap(), 0.6);
    near(limit.share, 1.0);
    near(limit.amount, 2.0 * 1e-3 * 0.2);
    // A constraint that stops it before its limit does is told in its place, and what is in the way of a term is not told again.
    let coupling = Coupling::new(&rig, &[(ids[0], None, 1.0)], Bound::AtMost(0.2)).unwrap();
    let held = motion.add_hard(When::Span { from: 0.0, to: 0.9 }, coupling).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    assert!(planned.report.success);
    let [force] = planned.report.forces[..] else { panic!("{:?}", planned.report.forces) };
    assert_eq!((force.on, force.by), (None, ForceBy::Term(motion.terms().position(held).unwrap())));
    near(force.secs.unwrap(), 0.6);
    near(force.amount, 2.0 * 1e-3 * 0.3);
    motion.term_mut(pull).mandatory = true;
    let planned = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    let [force] = planned.report.forces[..] else { panic!("{:?}", planned.report.forces) };
    assert_eq!((force.on, force.by), (Some(0), ForceBy::Term(1)));
    near(force.secs.unwrap(), planned.report[pull].times.unwrap().worst_secs);
}

#[test]
fn a_limit_that_smoothness_alone_runs_into_is_told_between_the_keys() {
    // What moves goes on for a while: past the limit, were it not there.
    let cost = |limit: f64| {
        let (rig, ids, turned) = stopped(limit);
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(0.7, 10.0).unwrap());
        motion.set_smoothness([0.0, 1e-2, 0.0]).unwrap();
        motion.fix_history(&[turned(0.0), turned(0.2)]).unwrap();
        let reach = Position::new(ids[1], place(&turned(0.1), ids[1]));
        motion.add(10.0, When::At(0.6), reach).unwrap();
        (plan(SolverOptions::default(), &motion, &turned(0.2)), ids)
    };
    let (planned, ids) = cost(0.3);
    assert!(planned.report.success, "{:?}", planned.report);
    let hinge = ids[0];
    let at_limit = |pose: &Pose| pose.value(hinge).unwrap() > 0.3 - 1e-9;
    assert_eq!(planned.clip.poses().iter().filter(|pose| at_limit(pose)).count(), 1);
    let [limit] = planned.report.forces[..] else { panic!("{:?}", planned.report.forces) };
    assert_eq!((limit.on, limit.by), (None, ForceBy::Limit { joint: hinge, kind: LimitKind::Value }));
    assert!(at_limit(&planned.clip.sample(limit.secs.unwrap())), "{limit:?}");
    near(limit.amount, saved(|d| cost(0.3 + d).0.report.cost));
    // A sample that is given stays wherever smoothness would have it, so that no limit acts there.
    let (rig, ids, turned) = stopped(0.3);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(0.7, 10.0).unwrap());
    motion.set_smoothness([0.0, 1e-2, 0.0]).unwrap();
    motion.fix_history(&[turned(0.3), turned(0.1)]).unwrap();
    motion.add(10.0, When::At(0.3), Position::new(ids[1], 1.5 * place(&turned(-1.5), ids[1]))).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &turned(0.1));
    assert!(planned.clip.poses()[2].value(ids[0]).unwrap() < -0.1);
    assert!(!planned.report.forces.is_empty(), "the target is out of reach");
    let is_given = |secs: Option<f64>| secs.is_some_and(|secs| secs < 0.15);
    assert!(planned.report.forces.iter().all(|force| !is_given(force.secs)), "{:?}", planned.report.forces);
}

#[test]
fn what_limits_a_motion_that_takes_longer_is_told_at_the_time_that_it_then_has() {
    let (rig, ids, turned) = stopped(0.3);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
    motion.set_smoothness([1e-6; 3]).unwrap();
    motion.fix_start(&turned(-1.0)).unwrap();
    motion.add(1.0, When::End, Position::new(ids[1], place(&turned(0.6), ids[1]))).unwrap();
    let speed = RateLimit { joint: ids[0], part: RatePart::Rotation, rate: Rate::Speed, most: 0.5 };
    motion.set_rate_limits(&[speed]).unwrap();
    motion.set_free_duration(true);
    let planned = plan(SolverOptions::default(), &motion, &turned(-1.0));
    let end = planned.clip.duration_secs();
    let limit = force(&planned.report.forces, 0, ForceBy::Limit { joint: ids[0], kind: LimitKind::Value });
    assert!(end > 2.0 && limit.secs == Some(end), "{limit:?}, {end}");
    let mut report = planned.report;
    report.map_times(|secs| 2.0 * secs);
    assert_eq!(report.forces[0].secs, Some(2.0 * end));
    assert_eq!(report.terms[0].times.unwrap().worst_secs, 2.0 * end);
}

#[test]
fn what_is_first_in_the_way_of_a_motion_that_is_planned_on_stays_so() {
    // Two limits that share the load almost evenly: either may be the stronger one.
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("hinge", None);
    joint.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::new(-PI, 0.3) };
    let hinge = builder.add(joint);
    let mut slider = Joint::new("slider", Some(hinge));
    slider.rest_translation = DVec3::X * 0.7;
    slider.motion = JointMotion::Slider { axis: DVec3::Y, range: Range::new(-0.6, 0.25) };
    let slider = builder.add(slider);
    let mut tip = Joint::new("tip", Some(slider));
    tip.rest_translation = DVec3::X * 0.3;
    let tip = builder.add(tip);
    let rig = builder.build().unwrap();
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 4.0).unwrap());
    motion.set_smoothness([1e-6; 3]).unwrap();
    let at = DVec3::new(0.761, 0.924, 0.0);
    let reach = motion.add(1.0, When::End, Position::new(tip, at)).unwrap();
    let solver = Solver::default();
    let mut workspace = MotionWorkspace::default();
    let mut clip = solver.plan(&motion, &Clip::still(rig.rest_pose()), &mut workspace).clip.into_owned();
    let (mut random, mut first, mut n_crossed) = (Random::new(8), None, 0);
    for frame in 0..60 {
        motion[reach].target = at + random.vector(1e-3);
        let planned = solver.plan(&motion, &clip, &mut workspace).into_owned();
        let forces = &planned.report.forces;
        assert!(first.is_none_or(|by| by == forces[0].by), "frame {frame}: {forces:?}");
        n_crossed += usize::from(forces[1].on == Some(0) && forces[1].share > forces[0].share);
        (first, clip) = (Some(forces[0].by), planned.clip.into_owned());
    }
    assert!(n_crossed > 5, "{n_crossed}");
}
