//! Planned motions: optima that are known by other means, what is given stays, limits hold, errors are precise.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use crate::common::{arm, place, plan, still};
use glam::{DQuat, DVec3};
use ikiru_rig::{Clip, Joint, JointId, JointMotion, Pose, RigBuilder};
use ikiru_solve::objectives::{Direction, LookAt, Orientation, Position, RestPose};
use ikiru_solve::{
    Invalid, Loss, Method, MotionError, MotionProblem, MotionWorkspace, Objective, Part, Problem, Reads,
    Rows, Search, Solver, SolverOptions, StopReason, Timeline, TimelineError, Unfit, Unit, View, When,
};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// Second and third differences of angles, and the first, summed up as equation 25 says, from the poses alone.
fn smoothness(clip: &Clip) -> [f64; 3] {
    let mut values: Vec<Vec<f64>> = clip.poses().iter().map(|p| p.coords().to_vec()).collect();
    [0; 3].map(|_| {
        values = values.windows(2).map(|w| w[1].iter().zip(&w[0]).map(|(a, b)| a - b).collect()).collect();
        values.iter().flatten().map(|v| v * v).sum()
    })
}

#[test]
fn one_end_objective_has_the_known_optimum() {
    let (rig, hand) = arm(100.0);
    let mut random = Random::new(5);
    for points in [0, 1, 3, 10] {
        for _ in 0..5 {
            let target = random.vector(1.0).normalize() * random.between(0.3, 0.8);
            let mut motion = MotionProblem::whole_body(&rig, Timeline::points(points).unwrap());
            motion.add(1.0, When::End, Position::new(hand, target)).unwrap();
            motion.fix_start(&rig.rest_pose()).unwrap();
            let mut start = rig.rest_pose();
            start.coords_mut().iter_mut().for_each(|c| *c += 0.05);
            let planned = plan(SolverOptions::default(), &motion, &start);
            assert_eq!(planned.clip.poses().len(), points + 2);
            assert_eq!(planned.clip.poses()[0], rig.rest_pose());
            // On the straight line from rest only the speed costs: a pose with a pull to rest of that weight.
            let mut pose = planned.clip.poses().last().unwrap().clone();
            let mut problem = Problem::whole_body(&rig);
            problem.add(1.0, Position::new(hand, target));
            let joints: Vec<JointId> = problem.active().collect();
            // That objective is divided by the number of its joints.
            let weight = 0.001 / (points as f64 + 1.0) * joints.len() as f64;
            problem.add(weight, RestPose::new(&joints, rig.rest_pose()));
            let solver = Solver::new(SolverOptions::default());
            let best = solver.solve(&problem, &mut pose, &mut solver.workspace(&problem)).cost;
            let cost = planned.report.cost;
            assert!((cost - best).abs() < 1e-6 * best, "{points} points: {cost} is not {best}");
            let [speed, acceleration, jerk] = smoothness(&planned.clip);
            assert!(acceleration < 1e-9 && jerk < 1e-9, "{acceleration} {jerk}");
            assert!((planned.report.smoothness[0] - 0.001 * speed).abs() < 1e-12);
        }
    }
}

#[test]
fn costs_are_those_of_equation_26() {
    let (rig, hand) = arm(60.0);
    let weights = [0.01, 0.002, 0.003];
    let target = DVec3::new(0.5, 0.4, 0.3);
    for method in [Method::Lm, Method::from_name("adam").unwrap()] {
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
        motion.set_smoothness(weights).unwrap();
        let reach = motion.add(1.0, When::At(0.5), Position::new(hand, target)).unwrap();
        motion.term_mut(reach).loss = Loss::Norm;
        motion.add(0.5, When::Span { from: 0.7, to: 0.9 }, Direction::new(hand, DVec3::X, DVec3::Y)).unwrap();
        let planned = plan(
            SolverOptions { method, max_iterations: 40, ..Default::default() },
            &motion,
            &rig.rest_pose(),
        );
        let poses = planned.clip.poses();
        let mut cost: f64 = smoothness(&planned.clip).iter().zip(weights).map(|(s, w)| s * w).sum();
        cost += place(&poses[5], hand).distance(target);
        for pose in &poses[7..=9] {
            let pointing = world_matrices(pose)[hand.index()].transform_vector3(DVec3::X);
            cost += 0.5 * pointing.angle_between(DVec3::Y).powi(2);
        }
        assert!((cost - planned.report.cost).abs() < 1e-7, "{cost} is not {}", planned.report.cost);
        assert!(poses.iter().all(|p| p.limit_violation() < 1e-9));
        let terms = &planned.report.terms;
        assert_eq!((terms[0].times.unwrap().from_secs, terms[0].times.unwrap().to_secs), (0.5, 0.5));
        assert!((terms[0].residual - place(&poses[5], hand).distance(target)).abs() < 1e-9);
        assert!((0.7..=0.9).contains(&(terms[1].times.unwrap().worst_secs + 1e-12)));
    }
}

#[test]
fn several_keys_given_ends_and_a_direction_throughout() {
    for case in 0..6 {
        let rig = random_rig(24, case);
        let mut random = Random::new(case);
        let tip = JointId::from_index(rig.n_joints() - 1);
        let (start, end) = (random_pose(&rig, &mut random), random_pose(&rig, &mut random));
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(2.0, 20.0).unwrap());
        motion.fix_start(&start).unwrap();
        motion.fix_end(Some(&end)).unwrap();
        let targets: Vec<DVec3> =
            (0..3).map(|_| random_pose(&rig, &mut random).frame(tip).unwrap().position).collect();
        for (i, target) in targets.iter().enumerate() {
            motion.add(10.0, When::At(0.5 * (i as f64 + 1.0)), Position::new(tip, *target)).unwrap();
        }
        let options = SolverOptions {
            search: Search::Global { max_restarts: 20 },
            max_iterations: 60,
            ..Default::default()
        };
        let planned = plan(options, &motion, &start);
        let poses = planned.clip.poses();
        let same =
            |a: &Pose, b: &Pose| a.coords().iter().zip(b.coords()).all(|(a, b)| a.to_bits() == b.to_bits());
        assert!(same(&poses[0], &start) && same(&poses[40], &end), "what is given stays");
        assert!(poses.iter().all(|p| p.limit_violation() < 1e-9 && p.is_valid()));
        for (i, target) in targets.iter().enumerate() {
            let distance = place(&poses[10 * (i + 1)], tip).distance(*target);
            assert!((distance - planned.report.terms[i].residual).abs() < 1e-9);
            assert_eq!(planned.report.terms[i].satisfied, distance <= 1e-3);
        }
        assert_eq!(planned.report.success, planned.report.terms.iter().all(|t| t.satisfied));
    }
}

#[test]
fn targets_that_move_are_followed() {
    let (rig, hand) = arm(120.0);
    let at = |secs: f64| DVec3::new(0.5, 0.3 * (3.0 * secs).sin(), 0.3 * (3.0 * secs).cos());
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
    motion.set_smoothness([1e-6, 1e-6, 1e-6]).unwrap();
    motion.add_moving(1.0, When::Throughout, |secs| Position::new(hand, at(secs))).unwrap();
    let mut start = rig.rest_pose();
    start.coords_mut().iter_mut().for_each(|c| *c += 0.1);
    let planned = plan(SolverOptions::default(), &motion, &start);
    assert!(planned.report.success, "{:?}", planned.report.terms);
    for (secs, pose) in planned.clip.times().iter().zip(planned.clip.poses()) {
        assert!(place(pose, hand).distance(at(*secs)) <= 1.001e-3);
    }
}

#[test]
fn a_long_motion_with_wishes_at_every_frame_is_followed() {
    let (rig, hand) = arm(120.0);
    // 1,500 rows: far too many for a matrix over all of them.
    let at = |secs: f64| DVec3::new(0.5, 0.3 * (3.0 * secs).sin(), 0.3 * (3.0 * secs).cos());
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(5.0, 100.0).unwrap());
    motion.set_smoothness([1e-5, 1e-4, 1e-4]).unwrap();
    motion.add_moving(1.0, When::Throughout, |secs| Position::new(hand, at(secs))).unwrap();
    let mut start = rig.rest_pose();
    start.coords_mut().iter_mut().for_each(|c| *c += 0.1);
    let planned = plan(SolverOptions { max_iterations: 60, ..Default::default() }, &motion, &start);
    assert!(planned.report.success, "{:?}", planned.report.terms);
    for (secs, pose) in planned.clip.times().iter().zip(planned.clip.poses()) {
        assert!(place(pose, hand).distance(at(*secs)) <= 1.001e-3 && pose.limit_violation() < 1e-9);
    }
    // As smooth as the path itself: the hand's own acceleration is 2.7 m/s², and nothing jumps from frame to frame.
    let second: f64 = smoothness(&planned.clip)[1];
    assert!(second < 1e-3, "{second}");
}

#[test]
fn a_motion_goes_on_from_its_history_without_a_kick() {
    let (rig, hand) = arm(120.0);
    // The first joint has been turning at a constant speed.
    let history: Vec<Pose> = (0..4)
        .map(|t| {
            let mut pose = rig.rest_pose();
            pose.set_euler(JointId::from_index(0), [0.0, 0.0, 0.05 * f64::from(t)]).unwrap();
            pose
        })
        .collect();
    let jump = |poses: &[Pose]| {
        let z = |p: &Pose| p.euler(JointId::from_index(0)).unwrap()[2];
        (z(&poses[4]) - 2.0 * z(&poses[3]) + z(&poses[2])).abs()
    };
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 20.0).unwrap());
    motion.set_smoothness([0.0, 0.001, 0.01]).unwrap();
    motion.add(1.0, When::End, Position::new(hand, DVec3::new(0.4, -0.5, 0.2))).unwrap();
    motion.fix_history(&history).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &history[3]);
    assert!(planned.report.success);
    assert_eq!(planned.clip.poses()[..4], history[..]);
    let kick = jump(planned.clip.poses());
    let mut forgetful = MotionProblem::whole_body(&rig, Timeline::seconds(0.85, 20.0).unwrap());
    forgetful.set_smoothness([0.0, 0.001, 0.01]).unwrap();
    forgetful.add(1.0, When::End, Position::new(hand, DVec3::new(0.4, -0.5, 0.2))).unwrap();
    forgetful.fix_start(&history[3]).unwrap();
    let other = plan(SolverOptions::default(), &forgetful, &history[3]);
    let joined: Vec<Pose> = history[..3].iter().chain(other.clip.poses()).cloned().collect();
    assert!(kick < 0.3 * jump(&joined), "{kick} against {}", jump(&joined));
}

#[test]
fn a_warm_plan_takes_fewer_iterations_and_repeats_itself() {
    let (rig, hand) = arm(120.0);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
    let reach = motion.add(1.0, When::End, Position::new(hand, DVec3::new(0.3, 0.5, 0.3))).unwrap();
    motion.fix_start(&rig.rest_pose()).unwrap();
    let solver = Solver::new(SolverOptions::default());
    let mut workspace = MotionWorkspace::default();
    let mut start = rig.rest_pose();
    start.coords_mut().iter_mut().for_each(|c| *c += 0.02);
    let cold = solver.plan(&motion, &still(&start), &mut workspace).into_owned();
    let again = solver.plan(&motion, &still(&start), &mut MotionWorkspace::default()).into_owned();
    assert_eq!(cold.report, again.report);
    assert_eq!(cold.clip, again.clip);
    motion[reach].target += DVec3::splat(0.01);
    let warm = solver.plan(&motion, &cold.clip, &mut workspace).into_owned();
    let cold = solver.plan(&motion, &still(&start), &mut workspace).into_owned();
    assert!(warm.report.success && warm.report.iterations < cold.report.iterations);
    assert!((warm.report.cost - cold.report.cost).abs() < 1e-6 * cold.report.cost);
}

#[test]
fn what_cannot_be_planned_says_why() {
    let (rig, hand) = arm(90.0);
    let (other, _) = arm(80.0);
    let rest = rig.rest_pose();
    let timeline = Timeline::seconds(1.0, 10.0).unwrap();
    let mut motion = MotionProblem::whole_body(&rig, timeline);
    let reach = Position::new(hand, DVec3::new(0.2, 0.3, 0.4));
    for secs in [-0.1, 1.2, f64::NAN] {
        let refused = motion.add(1.0, When::At(secs), reach).map(|_| ());
        assert!(matches!(refused, Err(MotionError::Timeline(TimelineError::Time { .. }))), "{secs}");
    }
    let backwards = motion.add(1.0, When::Span { from: 0.5, to: 0.2 }, reach).map(|_| ());
    assert!(matches!(backwards, Err(MotionError::Timeline(TimelineError::Span { .. }))));
    assert_eq!(motion.set_smoothness([1.0, -1.0, 0.0]), Err(MotionError::Smoothness([1.0, -1.0, 0.0])));
    assert!(motion.set_smoothness([f64::NAN; 3]).is_err());
    assert_eq!(motion.fix_start(&other.rest_pose()), Err(MotionError::OtherRig));
    let mut broken = rest.clone();
    broken.coords_mut()[0] = f64::NAN;
    assert_eq!(motion.fix_start(&broken), Err(MotionError::Pose));
    let all = vec![rest.clone(); 11];
    assert!(matches!(motion.fix_history(&all), Err(MotionError::GivenSamples { given: 11, .. })));
    motion.fix_history(&all[..10]).unwrap();
    let message = motion.fix_end(Some(&rest)).unwrap_err().to_string();
    assert!(message.contains("11 in all, 10 of them"), "{message}");
    motion.fix_start(&rest).unwrap();

    let id = motion.add(1.0, When::End, reach).unwrap();
    let look = motion.add_moving(1.0, When::Throughout, |secs| {
        LookAt::new(if secs < 0.5 { hand } else { JointId::from_index(1) }, DVec3::X, DVec3::Y)
    });
    assert!(matches!(look, Err(MotionError::Changes(secs)) if (secs - 0.5).abs() < 1e-9));
    motion[id].target = DVec3::NAN;
    let planned = plan(SolverOptions::default(), &motion, &rest);
    assert!(matches!(planned.report.invalid, Some(Invalid::Term(0, _))));
    assert_eq!(planned.report.stop, StopReason::InvalidInput);
    motion[id].target = DVec3::ONE;
    let planned = plan(SolverOptions { method: Method::Ccd, ..Default::default() }, &motion, &rest);
    assert!(matches!(planned.report.invalid, Some(Invalid::Options(_))));
    let planned = plan(SolverOptions::default(), &motion, &other.rest_pose());
    assert!(matches!(planned.report.invalid, Some(Invalid::Pose(_))));
    // Out of reach: the best motion, and which term failed when.
    motion[id].target = DVec3::new(3.0, 0.0, 0.1);
    let planned = plan(SolverOptions { max_iterations: 100, ..Default::default() }, &motion, &rest);
    let term = planned.report.terms[0];
    assert!(
        !planned.report.success
            && !term.satisfied
            && term.times.unwrap().worst_secs == 1.0
            && term.residual > 1.9
    );
}

#[test]
fn rotations_of_balls_and_a_free_root_go_the_short_way() {
    let mut builder = RigBuilder::new();
    let mut root = Joint::new("root", None);
    root.motion = JointMotion::FREE;
    let root = builder.add(root);
    let rig = builder.build().unwrap();
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 2.5);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::points(8).unwrap());
    motion.fix_start(&rig.rest_pose()).unwrap();
    motion.add(10.0, When::End, Orientation { joint: root, target: turn }).unwrap();
    motion.add(10.0, When::End, Position::new(root, DVec3::new(1.0, -2.0, 0.5))).unwrap();
    let planned = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    assert!(planned.report.success, "{:?}", planned.report);
    let poses = planned.clip.poses();
    for (t, pose) in poses.iter().enumerate() {
        let part = t as f64 / 9.0;
        let angle = pose.rotation(root).unwrap().angle_between(DQuat::IDENTITY.slerp(turn, part));
        let way = pose.translation(root).unwrap().distance(DVec3::new(1.0, -2.0, 0.5) * part);
        assert!(angle < 0.01 && way < 0.01, "frame {t}: {angle} rad, {way} m off the straight way");
    }
}

#[test]
fn joints_that_no_term_reads_are_led_from_one_given_frame_to_the_other() {
    let (rig, hand) = arm(100.0);
    let mut end = rig.rest_pose();
    end.coords_mut().iter_mut().enumerate().for_each(|(i, c)| *c = 0.1 * i as f64 - 0.4);
    for with_term in [false, true] {
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
        motion.set_smoothness([1.0, 0.0, 0.0]).unwrap();
        motion.fix_start(&rig.rest_pose()).unwrap();
        motion.fix_end(Some(&end)).unwrap();
        if with_term {
            // Reads the first joint alone.
            let elbow = JointId::from_index(1);
            motion.add(1e-9, When::At(0.5), Position::new(elbow, DVec3::X)).unwrap();
        }
        let planned = plan(SolverOptions::default(), &motion, &rig.rest_pose());
        for (t, pose) in planned.clip.poses().iter().enumerate() {
            for (c, whole) in pose.coords().iter().zip(end.coords()) {
                let expected = 0.1 * t as f64 * whole;
                assert!((c - expected).abs() < 1e-5, "frame {t}: {c} is not {expected}");
            }
        }
        assert!(place(planned.clip.poses().last().unwrap(), hand).distance(place(&end, hand)) < 1e-12);
    }
}

#[test]
fn even_spacing_makes_steps_of_one_length() {
    let (rig, hand) = arm(100.0);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(2.0, 20.0).unwrap());
    motion.set_smoothness([1e-5, 1e-4, 0.0]).unwrap();
    motion.fix_start(&rig.rest_pose()).unwrap();
    // Near at half time, far at the end: without more, slow first and fast then.
    motion.add(10.0, When::At(1.0), Position::new(hand, DVec3::new(0.9, 0.15, 0.0))).unwrap();
    motion.add(10.0, When::End, Position::new(hand, DVec3::new(0.1, 0.5, 0.3))).unwrap();
    let uneven = |clip: &Clip| {
        let length = |w: &[Pose]| w[0].difference(&w[1]).unwrap().iter().map(|d| d * d).sum::<f64>().sqrt();
        let lengths: Vec<f64> = clip.poses().windows(2).map(length).collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        (lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>(), mean)
    };
    let before = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    assert_eq!(before.report.spacing, 0.0);
    motion.set_even_spacing(0.5).unwrap();
    let after = plan(SolverOptions { max_iterations: 300, ..Default::default() }, &motion, &rig.rest_pose());
    let ((was, _), (is, mean)) = (uneven(&before.clip), uneven(&after.clip));
    assert!(after.report.success);
    assert!((after.report.spacing - 0.5 * is).abs() < 1e-12, "{} is not {}", after.report.spacing, 0.5 * is);
    assert!(is < 0.02 * was, "{is} of {was}");
    assert!(mean > 0.01);
    for weight in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(motion.set_even_spacing(weight), Err(MotionError::EvenSpacing(_))), "{weight}");
    }
}

#[test]
fn a_target_can_go_another_way_without_being_added_anew() {
    let (rig, hand) = arm(100.0);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 20.0).unwrap());
    motion.set_smoothness([1e-5; 3]).unwrap();
    let way = |secs: f64, side: f64| DVec3::new(0.6, side * (0.2 + 0.1 * secs), 0.1 * secs);
    let id = motion.add_moving(1.0, When::Throughout, |t| Position::new(hand, way(t, 1.0))).unwrap();
    let first = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    motion.set_moving(id, |t| Position::new(hand, way(t, -1.0))).unwrap();
    assert_eq!(motion[id].target, way(0.0, -1.0));
    // Warm: from the motion that there was.
    let solver = Solver::new(SolverOptions::default());
    let second = solver.plan(&motion, &first.clip, &mut MotionWorkspace::default()).into_owned();
    assert!(first.report.success && second.report.success);
    for (clip, side) in [(&first.clip, 1.0), (&second.clip, -1.0)] {
        for (secs, pose) in clip.times().iter().zip(clip.poses()) {
            assert!(place(pose, hand).distance(way(*secs, side)) < 1e-3, "{side} at {secs}");
        }
    }
    // What reads something else is refused, and the motion stays as it was.
    let refused = motion.set_moving(id, |t| Position::new(JointId::from_index(2), way(t, 1.0)));
    assert_eq!(refused, Err(MotionError::Changes(0.0)));
    assert_eq!(motion[id].target, way(0.0, -1.0));
    let still = motion.add(1.0, When::At(0.5), LookAt::new(hand, DVec3::X, DVec3::Y)).unwrap();
    let mut other = MotionProblem::whole_body(&rig, *motion.timeline());
    assert_eq!(other.set_moving(still, |_| LookAt::new(hand, DVec3::X, DVec3::Z)), Err(MotionError::Term));
}

#[test]
fn at_rest_a_motion_sets_in_and_ends_softly() {
    let (rig, hand) = arm(100.0);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 30.0).unwrap());
    motion.set_smoothness([0.0, 0.01, 0.1]).unwrap();
    motion.fix_start(&rig.rest_pose()).unwrap();
    motion.add(10.0, When::End, Position::new(hand, DVec3::new(0.3, 0.5, 0.3))).unwrap();
    let largest = |clip: &Clip, step: usize| {
        let way = clip.poses()[step].difference(&clip.poses()[step + 1]).unwrap();
        way.iter().fold(0.0_f64, |a, d| a.max(d.abs()))
    };
    let sudden = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    motion.set_at_rest(true, true);
    let soft = plan(SolverOptions::default(), &motion, &rig.rest_pose());
    assert!(sudden.report.success && soft.report.success);
    for step in [0, 29] {
        assert!(largest(&soft.clip, step) < 0.1 * largest(&soft.clip, 15));
        assert!(largest(&sudden.clip, step) > 0.5 * largest(&sudden.clip, 15));
    }
    // The cost is that of equation 25 on the clip with frames before and behind it that stand still.
    let mut poses = soft.clip.poses().to_vec();
    poses.splice(0..0, vec![soft.clip.poses()[0].clone(); 3]);
    poses.extend(vec![soft.clip.poses()[30].clone(); 3]);
    let padded = Clip::new("", (0..poses.len()).map(|t| t as f64).collect(), poses).unwrap();
    let [_, acceleration, jerk] = smoothness(&padded);
    let [_, of_acceleration, of_jerk] = soft.report.smoothness;
    assert!((of_acceleration - 0.01 * acceleration).abs() < 1e-9 * of_acceleration);
    assert!((of_jerk - 0.1 * jerk).abs() < 1e-9 * of_jerk);
}

#[test]
fn what_an_objective_finds_odd_is_told_of_motions_as_of_poses() {
    let (rig, hand) = arm(100.0);
    let root = JointId::from_index(0);
    let at_root = rig.rest_pose().frame(root).unwrap().position;
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
    motion.set_smoothness([1e-6; 3]).unwrap();
    // The root's own origin at 0.5 s alone, and never.
    let passes = |secs: f64| if (secs - 0.5).abs() < 0.01 { at_root } else { at_root + DVec3::X };
    let odd =
        motion.add_moving(1.0, When::Throughout, |secs| LookAt::new(root, DVec3::X, passes(secs))).unwrap();
    let plain = motion.add(1.0, When::End, LookAt::new(hand, DVec3::X, DVec3::Y * 2.0)).unwrap();
    // Found odd at samples that are given, and where it is switched off, as well.
    motion.fix_start(&rig.rest_pose()).unwrap();
    let settled = motion.add(1.0, When::At(0.0), LookAt::new(root, DVec3::X, at_root)).unwrap();
    let off = motion.add(1.0, When::At(0.3), LookAt::new(root, DVec3::X, at_root)).unwrap();
    motion.term_mut(off).is_on = false;
    let report = plan(SolverOptions::default(), &motion, &rig.rest_pose()).report;
    let told = [report[odd].warning, report[settled].warning, report[off].warning];
    assert!(told.iter().all(Option::is_some) && report[plain].warning.is_none(), "{:?}", report.terms);
    // What was odd on the way, and is so no more at the end, is not told.
    let mut moved = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
    moved.set_smoothness([1e-6; 3]).unwrap();
    let from = rig.rest_pose().frame(hand).unwrap().position;
    let id = moved.add(1e-6, When::End, LookAt::new(hand, DVec3::X, from)).unwrap();
    moved.add(1.0, When::End, Position::new(hand, DVec3::new(0.4, 0.5, 0.2))).unwrap();
    let report =
        plan(SolverOptions { max_iterations: 0, ..Default::default() }, &moved, &rig.rest_pose()).report;
    assert!(report[id].warning.is_some());
    let report = plan(SolverOptions::default(), &moved, &rig.rest_pose()).report;
    assert_eq!(report[id].warning, None);
}

/// Gives up wherever it is asked.
#[derive(Clone, Debug)]
struct GivesUp(JointId);

impl Objective for GivesUp {
    fn kind(&self) -> &'static str {
        "gives_up"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.0)?;
        reads.part(Part::new(1, Unit::Metres))
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, _: &View<'_>, rows: &mut Rows<'_>) {
        rows.fail("gave up");
    }
}

#[test]
fn what_is_switched_off_may_give_up_without_spoiling_the_next_plan() {
    let (rig, hand) = arm(100.0);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
    let off = motion.add(1.0, When::End, GivesUp(hand)).unwrap();
    motion.term_mut(off).is_on = false;
    motion.add(1.0, When::End, Position::new(hand, DVec3::new(0.4, 0.5, 0.2))).unwrap();
    let mut workspace = MotionWorkspace::default();
    for _ in 0..3 {
        let planned = Solver::default().plan(&motion, &still(&rig.rest_pose()), &mut workspace);
        assert!(planned.report.success, "{:?}", planned.report);
    }
}
