//! Motions under limits on speed and acceleration: none is exceeded anywhere on the curve, what can be reached is
//! reached, and what cannot names joint and time.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use glam::DVec3;
use ikiru_rig::{
    Clip, ClipError, EulerOrder, Joint, JointId, JointMotion, Pose, Range, Rate, RateLimit, RatePart, Rig,
    RigBuilder,
};
use ikiru_solve::objectives::{Orientation, Position};
use ikiru_solve::{
    AdamOptions, Invalid, Method, MotionError, MotionProblem, MotionWorkspace, PlannedMotion, Solver,
    SolverOptions, StopReason, Timeline, Watch, When,
};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// A joint of some motion, and a tip half a metre along x.
fn one(motion: JointMotion) -> (Rig, JointId, JointId) {
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("joint", None);
    joint.motion = motion;
    let joint = builder.add(joint);
    let mut tip = Joint::new("tip", Some(joint));
    tip.rest_translation = DVec3::X * 0.5;
    let tip = builder.add(tip);
    (builder.build().unwrap(), joint, tip)
}

fn hinge() -> JointMotion {
    JointMotion::Hinge { axis: DVec3::Z, range: Range::new(-3.0, 3.0) }
}

fn limit(joint: JointId, part: RatePart, rate: Rate, most: f64) -> RateLimit {
    RateLimit { joint, part, rate, most }
}

fn plan(motion: &MotionProblem, guess: &Pose) -> PlannedMotion<'static> {
    let still = Clip::still(guess.clone());
    let solver = Solver::new(SolverOptions { max_iterations: 200, ..SolverOptions::default() });
    solver.plan(motion, &still, &mut MotionWorkspace::default()).into_owned()
}

/// The largest speed and acceleration of a joint, by differences of poses on the curve.
fn measured(clip: &Clip, joint: JointId, part: RatePart) -> (f64, f64) {
    let rig = clip.rig();
    let own: Vec<usize> = rig.dofs_of(joint).collect();
    let is_free = matches!(rig.get(joint).unwrap().motion, JointMotion::Free { .. });
    let dofs = match (is_free, part) {
        (true, RatePart::Translation) => own[..3].to_vec(),
        (true, RatePart::Rotation) => own[3..].to_vec(),
        _ => own,
    };
    let h = 2e-5;
    let velocity = |secs: f64| -> Vec<f64> {
        let way = clip.sample_cubic(secs - h).difference(&clip.sample_cubic(secs + h)).unwrap();
        dofs.iter().map(|k| way[*k] / (2.0 * h)).collect()
    };
    let length = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let (mut speed, mut acceleration) = (0.0_f64, 0.0_f64);
    for pair in clip.times().windows(2) {
        // Inside of one piece of the curve, where both are smooth.
        for part in [0.02, 0.3, 0.5, 0.7, 0.98] {
            let secs = pair[0] + part * (pair[1] - pair[0]);
            let before = velocity(secs - 2.0 * h);
            let after = velocity(secs + 2.0 * h);
            speed = speed.max(length(&velocity(secs)));
            let rate: Vec<f64> = before.iter().zip(&after).map(|(a, b)| (b - a) / (4.0 * h)).collect();
            acceleration = acceleration.max(length(&rate));
        }
    }
    (speed, acceleration)
}

#[test]
fn a_hinge_goes_as_far_as_its_speed_lets_it() {
    let (rig, joint, tip) = one(hinge());
    let goal = |angle: f64| DVec3::new(0.5 * angle.cos(), 0.5 * angle.sin(), 0.0);
    for (most, reaches) in [(2.2, true), (1.5, false)] {
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
        motion.set_smoothness([0.0, 0.0, 1e-4]).unwrap();
        motion.fix_start(&rig.rest_pose()).unwrap();
        motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Speed, most)]).unwrap();
        let id = motion.add(1.0, When::End, Position::new(tip, goal(2.0))).unwrap();
        let planned = plan(&motion, &rig.rest_pose());
        let end = planned.clip.poses().last().unwrap().coords()[0];
        assert!(planned.report.exceeded.is_empty());
        assert_eq!(planned.report.success, reaches, "{:?}", planned.report);
        assert_eq!(planned.report.terms[motion.terms().position(id).unwrap()].satisfied, reaches);
        let (speed, _) = measured(&planned.clip, joint, RatePart::Rotation);
        assert!(speed <= most * (1.0 + 1e-6), "{speed} of {most}");
        // As far as full speed all the time gets it, but for the margin that is kept.
        let expected = f64::min(2.0, most);
        assert!((end - expected).abs() < 0.003 * expected, "{end} of {expected}");
    }
}

#[test]
fn a_budget_that_has_run_out_leaves_what_is_known_to_keep_the_limits() {
    let (rig, joint, tip) = one(hinge());
    let turned = |angle: f64| {
        let mut pose = rig.rest_pose();
        pose.set_value(joint, angle).unwrap();
        pose
    };
    let goal = DVec3::new(0.5 * 2.9_f64.cos(), 0.5 * 2.9_f64.sin(), 0.0);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
    motion.fix_start(&rig.rest_pose()).unwrap();
    motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Speed, 1.0)]).unwrap();
    motion.add(1.0, When::End, Position::new(tip, goal)).unwrap();
    // A guess that meets the target far too fast.
    let guess = Clip::new("", vec![0.0, 1.0], vec![turned(0.0), turned(2.9)]).unwrap();
    let flag = Arc::new(AtomicBool::new(true));
    for (max_time, watch, stop) in [
        (Some(Duration::ZERO), Watch::new(), StopReason::TimeBudget),
        (None, Watch::new().cancelled_by(flag), StopReason::Cancelled),
    ] {
        let solver = Solver::new(SolverOptions { max_time, ..SolverOptions::default() });
        let mut workspace = MotionWorkspace::default();
        workspace.watch(watch);
        let planned = solver.plan(&motion, &guess, &mut workspace).into_owned();
        assert_eq!((planned.report.stop, planned.report.iterations), (stop, 0));
        assert!(planned.report.exceeded.is_empty() && !planned.report.success);
        assert!(measured(&planned.clip, joint, RatePart::Rotation).0 <= 1.0);
        assert_eq!(planned.clip.poses()[0], rig.rest_pose());
    }
}

#[test]
fn accelerations_hold_and_what_can_be_reached_is() {
    // From rest (two frames of it) to rest, 1 rad in 1 s: at least 4 rad/s² are needed, 2 rad/s in between.
    let (rig, joint, tip) = one(hinge());
    let timeline = Timeline::seconds(1.0, 60.0).unwrap();
    for (most, reaches) in [(5.0, true), (2.0, false)] {
        let mut motion = MotionProblem::whole_body(&rig, timeline);
        motion.set_smoothness([0.0, 1e-4, 1e-4]).unwrap();
        motion.fix_history(&[rig.rest_pose(), rig.rest_pose()]).unwrap();
        motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Acceleration, most)]).unwrap();
        let goal = DVec3::new(0.5 * 1.0_f64.cos(), 0.5 * 1.0_f64.sin(), 0.0);
        // At rest there: the last four frames are at the goal.
        let span = When::Span { from: 57.0 / 60.0, to: 1.0 };
        motion.add(10.0, span, Position::new(tip, goal)).unwrap();
        let planned = plan(&motion, &rig.rest_pose());
        assert_eq!(planned.report.success, reaches, "{:?}", planned.report);
        let (_, acceleration) = measured(&planned.clip, joint, RatePart::Rotation);
        assert!(acceleration <= most * (1.0 + 1e-4), "{acceleration} of {most}");
        assert!(acceleration > 0.9 * most.min(4.6), "what is allowed is used: {acceleration}");
    }
}

#[test]
fn every_joint_of_any_rig_keeps_its_limits() {
    let mut random = Random::new(11);
    let mut limited = 0;
    for case in 0..12 {
        let rig = random_rig(7, case);
        let start = random_pose(&rig, &mut random);
        let goal = random_pose(&rig, &mut random);
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 20.0).unwrap());
        motion.set_smoothness([1e-4; 3]).unwrap();
        motion.fix_start(&start).unwrap();
        let tip = JointId::from_index(rig.n_joints() - 1);
        let frame = goal.frame(tip).unwrap();
        motion.add(1.0, When::End, Position::new(tip, frame.position)).unwrap();
        motion.add(0.1, When::At(0.5), Orientation::new(tip, goal.frame(tip).unwrap().rotation)).unwrap();
        let free = plan(&motion, &start);
        assert!(free.report.exceeded.is_empty());
        // Half of what each joint would like.
        let mut limits = Vec::new();
        for joint in rig.ids() {
            for part in [RatePart::Rotation, RatePart::Translation] {
                let (peak, bend) = (
                    free.clip.peak_speed(joint, part).unwrap(),
                    free.clip.peak_acceleration(joint, part).unwrap(),
                );
                // A ball that its cone stops at once has no acceleration to speak of.
                let has_cone = rig.get(joint).unwrap().motion.cone().is_some();
                if peak.value > 0.05 {
                    limits.push(limit(joint, part, Rate::Speed, 0.5 * peak.value));
                    if bend.value > 0.05 && !has_cone {
                        limits.push(limit(joint, part, Rate::Acceleration, 0.5 * bend.value));
                    }
                }
            }
        }
        motion.set_rate_limits(&limits).unwrap();
        let planned = plan(&motion, &start);
        assert!(planned.report.exceeded.is_empty(), "case {case}: {:?}", planned.report.exceeded);
        for limit in &limits {
            let (speed, acceleration) = measured(&planned.clip, limit.joint, limit.part);
            let value = if limit.rate == Rate::Speed { speed } else { acceleration };
            assert!(value <= limit.most * (1.0 + 1e-4) + 1e-6, "case {case}: {value} is above {limit:?}");
        }
        assert!(planned.clip.poses().iter().all(|p| p.limit_violation() <= 1e-9));
        limited += limits.len();
    }
    assert!(limited > 40, "{limited}");
}

#[test]
fn limits_that_do_not_bind_change_nothing() {
    let (rig, joint, tip) = one(hinge());
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
    motion.fix_start(&rig.rest_pose()).unwrap();
    motion.add(1.0, When::End, Position::new(tip, DVec3::new(0.4, 0.3, 0.0))).unwrap();
    let free = plan(&motion, &rig.rest_pose());
    motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Speed, 50.0)]).unwrap();
    let limited = plan(&motion, &rig.rest_pose());
    assert_eq!((free.clip, free.report), (limited.clip, limited.report));
}

#[test]
fn what_is_given_too_far_apart_names_joint_and_time() {
    let (rig, joint, _) = one(hinge());
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
    motion.fix_start(&rig.rest_pose()).unwrap();
    let mut end = rig.rest_pose();
    end.set_value(joint, 2.0).unwrap();
    motion.fix_end(Some(&end)).unwrap();
    motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Speed, 1.0)]).unwrap();
    let planned = plan(&motion, &rig.rest_pose());
    assert!(!planned.report.success);
    let [excess] = planned.report.exceeded[..] else { panic!("{:?}", planned.report.exceeded) };
    assert_eq!(excess.limit.joint, joint);
    assert!(excess.peak.value > 1.9 && (0.0..=1.0).contains(&excess.peak.secs), "{excess:?}");
    // With as much speed as it takes they are kept.
    motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Speed, 2.02)]).unwrap();
    let planned = plan(&motion, &rig.rest_pose());
    assert!(planned.report.success, "{:?}", planned.report);
}

#[test]
fn limits_that_mean_nothing_are_refused() {
    let (rig, joint, _) = one(hinge());
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
    for most in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Speed, most)]);
        assert!(matches!(refused, Err(MotionError::RateLimit(ClipError::RateLimitMost { .. }))), "{most}");
    }
    let refused = motion.set_rate_limits(&[limit(joint, RatePart::Translation, Rate::Speed, 1.0)]);
    assert!(matches!(refused, Err(MotionError::RateLimit(ClipError::RateLimitPart { .. }))));
    let refused = motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Jerk, 1.0)]);
    assert!(matches!(refused, Err(MotionError::RateLimit(ClipError::RateLimitJerk { .. }))));
    let unknown = JointId::from_index(99);
    let refused = motion.set_rate_limits(&[limit(unknown, RatePart::Rotation, Rate::Speed, 1.0)]);
    assert!(matches!(refused, Err(MotionError::RateLimit(ClipError::NoJoint { .. }))));
    motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Speed, 1.0)]).unwrap();
    let still = Clip::still(rig.rest_pose());
    let options = SolverOptions { method: Method::Adam(AdamOptions::default()), ..SolverOptions::default() };
    let planned = Solver::new(options).plan(&motion, &still, &mut MotionWorkspace::default()).into_owned();
    assert_eq!(planned.report.stop, StopReason::InvalidInput);
    assert!(matches!(planned.report.invalid, Some(Invalid::Options(_))));
}

#[test]
fn a_ball_and_a_slider_keep_theirs() {
    let slider = JointMotion::Slider { axis: DVec3::X, range: Range::new(-2.0, 2.0) };
    let ranges = [Range::new(-2.0, 2.0); 3];
    let euler = JointMotion::Euler { order: EulerOrder::Zyx, ranges };
    for (motion, part) in [
        (slider, RatePart::Translation),
        (JointMotion::Ball { cone: None }, RatePart::Rotation),
        (euler, RatePart::Rotation),
    ] {
        let (rig, joint, tip) = one(motion);
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
        motion.set_smoothness([0.0, 1e-5, 1e-5]).unwrap();
        motion.fix_start(&rig.rest_pose()).unwrap();
        let goal =
            if part == RatePart::Translation { DVec3::X * 1.4 } else { DVec3::new(-0.2, 0.3, 0.34641) };
        motion.add(1.0, When::End, Position::new(tip, goal)).unwrap();
        let most = if part == RatePart::Translation { 0.6 } else { 1.2 };
        motion.set_rate_limits(&[limit(joint, part, Rate::Speed, most)]).unwrap();
        let planned = plan(&motion, &rig.rest_pose());
        let (speed, _) = measured(&planned.clip, joint, part);
        assert!(speed <= most * (1.0 + 1e-6) && speed > 0.98 * most, "{speed} of {most}");
        assert!(planned.report.exceeded.is_empty() && !planned.report.success);
    }
}

#[test]
fn a_free_duration_takes_as_long_as_the_limits_ask_for() {
    let (rig, joint, tip) = one(hinge());
    let goal = |angle: f64| DVec3::new(0.5 * angle.cos(), 0.5 * angle.sin(), 0.0);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(4.0, 30.0).unwrap());
    motion.set_smoothness([0.0, 1e-4, 1e-3]).unwrap();
    motion.fix_start(&rig.rest_pose()).unwrap();
    let near = motion.add(1.0, When::At(3.0), Position::new(tip, goal(0.1))).unwrap();
    let far = motion.add(1.0, When::End, Position::new(tip, goal(2.2))).unwrap();
    let free = plan(&motion, &rig.rest_pose());
    let limits = [
        limit(joint, RatePart::Rotation, Rate::Speed, 1.0),
        limit(joint, RatePart::Rotation, Rate::Acceleration, 6.0),
    ];
    motion.set_rate_limits(&limits).unwrap();
    motion.set_free_duration(true);
    let planned = plan(&motion, &rig.rest_pose());
    assert!(planned.report.success && planned.report.exceeded.is_empty(), "{:?}", planned.report);
    // The same poses, later: all terms hold as they did.
    assert_eq!(planned.clip.poses(), free.clip.poses());
    assert_eq!(planned.report.cost, free.report.cost);
    let (speed, acceleration) = measured(&planned.clip, joint, RatePart::Rotation);
    assert!(speed <= 1.0 + 1e-6 && acceleration <= 6.0 + 1e-3, "{speed} {acceleration}");
    assert!(speed > 0.95, "no slower than it must be: {speed}");
    let (near, far) = (
        &planned.report.terms[motion.terms().position(near).unwrap()],
        &planned.report.terms[motion.terms().position(far).unwrap()],
    );
    assert_eq!(far.times.unwrap().to_secs, *planned.clip.times().last().unwrap());
    assert!(planned.clip.times().contains(&near.times.unwrap().from_secs));
    // What was slow enough keeps its tempo: the fast part lies behind the first key.
    assert!(
        (near.times.unwrap().from_secs - 3.0).abs() < 0.35 && far.times.unwrap().to_secs > 4.8,
        "{near:?} {far:?}"
    );
    // Adam plans as if there were no limits, so that it knows free durations too.
    let still = Clip::still(rig.rest_pose());
    let options = SolverOptions { method: Method::Adam(AdamOptions::default()), ..SolverOptions::default() };
    let planned = Solver::new(options).plan(&motion, &still, &mut MotionWorkspace::default()).into_owned();
    assert!(planned.report.exceeded.is_empty() && planned.report.invalid.is_none());
}

#[test]
fn limits_above_what_a_motion_needs_are_kept_from_a_moving_history() {
    // Smooth motions that exist, their first frames given: limits a little above their peaks can be kept.
    let mut random = Random::new(3);
    let mut n_limits = 0;
    for case in 0..30 {
        let rig = random_rig(5, 100 + case);
        if rig.ids().any(|joint| rig.get(joint).unwrap().motion.cone().is_some()) {
            continue;
        }
        let middle = random_pose(&rig, &mut random);
        let way: Vec<f64> = (0..rig.n_dofs()).map(|_| random.between(-0.25, 0.25)).collect();
        let timeline = Timeline::seconds(0.8, 20.0).unwrap();
        let poses: Vec<Pose> = (0..timeline.n_samples())
            .map(|t| {
                let part = (2.5 * timeline.time(t)).sin();
                let mut pose = middle.clone();
                pose.retract(&way.iter().map(|w| w * part).collect::<Vec<_>>()).unwrap();
                pose.project();
                pose
            })
            .collect();
        let clip = Clip::new("", timeline.times(), poses.clone()).unwrap();
        let mut motion = MotionProblem::whole_body(&rig, timeline);
        motion.set_smoothness([1e-4; 3]).unwrap();
        motion.fix_history(&poses[..3]).unwrap();
        let tip = JointId::from_index(rig.n_joints() - 1);
        let far = poses.last().unwrap().frame(tip).unwrap().position * 1.5;
        motion.add(1.0, When::End, Position::new(tip, far)).unwrap();
        let mut limits = Vec::new();
        for joint in rig.ids() {
            for part in [RatePart::Rotation, RatePart::Translation] {
                let (speed, bend) = (
                    clip.peak_speed(joint, part).unwrap().value,
                    clip.peak_acceleration(joint, part).unwrap().value,
                );
                if speed > 0.01 {
                    limits.push(limit(joint, part, Rate::Speed, 1.3 * speed));
                    limits.push(limit(joint, part, Rate::Acceleration, 1.3 * bend.max(0.1)));
                }
            }
        }
        motion.set_rate_limits(&limits).unwrap();
        n_limits += limits.len();
        let planned = plan(&motion, &poses[2]);
        assert!(planned.report.exceeded.is_empty(), "case {case}: {:?}", planned.report.exceeded);
    }
    assert!(n_limits > 40, "{n_limits}");
}

#[test]
fn what_was_executed_is_not_judged_and_does_not_slow_down_what_is_planned() {
    let (rig, joint, tip) = one(hinge());
    let timeline = Timeline::seconds(2.0, 30.0).unwrap();
    let mut motion = MotionProblem::whole_body(&rig, timeline);
    motion.set_smoothness([0.0, 1e-5, 1e-5]).unwrap();
    // Too fast at first (6 rad/s), then at rest.
    let mut angle = 0.0;
    let history: Vec<Pose> = (0..12)
        .map(|t| {
            let mut pose = rig.rest_pose();
            pose.set_value(joint, angle).unwrap();
            angle += if t < 3 { 0.2 } else { 0.0 };
            pose
        })
        .collect();
    motion.fix_history(&history).unwrap();
    let goal = DVec3::new(0.5 * 1.4_f64.cos(), 0.5 * 1.4_f64.sin(), 0.0);
    motion.add(1.0, When::End, Position::new(tip, goal)).unwrap();
    motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Speed, 1.0)]).unwrap();
    let planned = plan(&motion, &history[11]);
    assert!(planned.report.success, "{:?}", planned.report);
    // A free duration would give executed frames new times.
    motion.set_free_duration(true);
    assert!(matches!(plan(&motion, &history[11]).report.invalid, Some(Invalid::Options(_))));
}

#[test]
fn even_spacing_and_limits_go_together() {
    let (rig, joint, tip) = one(hinge());
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
    motion.set_smoothness([0.0, 1e-5, 1e-5]).unwrap();
    motion.set_even_spacing(1.0).unwrap();
    motion.fix_start(&rig.rest_pose()).unwrap();
    let goal = DVec3::new(0.5 * 1.5_f64.cos(), 0.5 * 1.5_f64.sin(), 0.0);
    motion.add(1.0, When::End, Position::new(tip, goal)).unwrap();
    let free = plan(&motion, &rig.rest_pose());
    assert!(free.report.success, "{:?}", free.report);
    motion.set_rate_limits(&[limit(joint, RatePart::Rotation, Rate::Speed, 1.6)]).unwrap();
    let limited = plan(&motion, &rig.rest_pose());
    assert!(limited.report.success && limited.report.exceeded.is_empty(), "{:?}", limited.report);
    let (speed, _) = measured(&limited.clip, joint, RatePart::Rotation);
    assert!(speed <= 1.6 * (1.0 + 1e-6), "{speed}");
}

#[test]
fn a_start_has_its_iterations_in_each_round_that_it_takes() {
    let (rig, joint, tip) = one(hinge());
    let goal = DVec3::new(0.5 * 2.2_f64.cos(), 0.5 * 2.2_f64.sin(), 0.0);
    // As the options say: one round, one before even spacing, and 40 where limits bind.
    for (spacing, most, n_rounds) in
        [(0.0, None, 1), (0.1, None, 2), (0.0, Some(0.5), 41), (0.1, Some(0.5), 42)]
    {
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
        motion.set_smoothness([0.0, 1e-5, 1e-5]).unwrap();
        motion.set_even_spacing(spacing).unwrap();
        motion.fix_start(&rig.rest_pose()).unwrap();
        motion.add(1.0, When::End, Position::new(tip, goal)).unwrap();
        let limits: Vec<RateLimit> =
            most.iter().map(|most| limit(joint, RatePart::Rotation, Rate::Speed, *most)).collect();
        motion.set_rate_limits(&limits).unwrap();
        let solver = Solver::new(SolverOptions { max_iterations: 1, ..SolverOptions::default() });
        let still = Clip::still(rig.rest_pose());
        let n = solver.plan(&motion, &still, &mut MotionWorkspace::default()).report.iterations;
        let without = if spacing > 0.0 { 2 } else { 1 };
        let is_within = if most.is_some() { without < n && n <= n_rounds } else { n == n_rounds };
        assert!(is_within, "{spacing}, {most:?}: {n} iterations");
    }
}
