//! Clips as smooth curves: through their poses, without jumps of velocity, inside limits; and their edits.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use glam::{DQuat, DVec3};
use ikiru_rig::{
    Clip, ClipError, Cone, Joint, JointId, JointMotion, Pose, Range, Rate, RatePart, Rig, RigBuilder,
    rotation_vector,
};
use ikiru_testkit::rigs::{Random, random_pose, random_rig, random_walk, rigs};
use proptest::prelude::*;

fn without_cones(rig: &Rig) -> Rig {
    let mut builder = rig.to_builder();
    for (id, joint) in rig.ids().zip(rig.joints()) {
        match joint.motion {
            JointMotion::Ball { .. } => drop(builder.set_motion(id, JointMotion::BALL).unwrap()),
            JointMotion::Free { .. } => drop(builder.set_motion(id, JointMotion::FREE).unwrap()),
            _ => {}
        }
    }
    builder.build().unwrap()
}

fn without_limits(rig: &Rig) -> Rig {
    let mut builder = without_cones(rig).to_builder();
    for joint in builder.joints_mut() {
        match &mut joint.motion {
            JointMotion::Hinge { range, .. } | JointMotion::Slider { range, .. } => *range = Range::UNLIMITED,
            JointMotion::Euler { ranges, .. } => *ranges = [Range::UNLIMITED; 3],
            _ => {}
        }
    }
    builder.build().unwrap()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, v| v.abs().max(most))
}

fn apart(a: &Pose, b: &Pose) -> f64 {
    largest(&a.difference(b).unwrap())
}

/// The velocity at a time by small steps to either side.
fn numeric_velocity(clip: &Clip, secs: f64, before: f64, after: f64) -> Vec<f64> {
    let (a, b) = (clip.sample_cubic(secs - before), clip.sample_cubic(secs + after));
    a.difference(&b).unwrap().iter().map(|d| d / (before + after)).collect()
}

proptest! {
    #[test]
    fn the_curve_goes_through_every_pose_and_holds_still_outside((rig, seed) in rigs(20), n in 1..7usize) {
        let clip = random_walk(&rig, n, seed);
        for (secs, pose) in clip.times().iter().zip(clip.poses()) {
            prop_assert_eq!(&clip.sample_cubic(*secs), pose);
            // Also when it is only approached.
            prop_assert!(apart(&clip.sample_cubic(secs - 1e-9), pose) < 1e-6);
            prop_assert!(apart(&clip.sample_cubic(secs + 1e-9), pose) < 1e-6);
        }
        prop_assert_eq!(&clip.sample_cubic(-9.0), &clip.poses()[0]);
        prop_assert_eq!(&clip.sample_cubic(f64::NAN), &clip.poses()[0]);
        prop_assert_eq!(&clip.sample_cubic(f64::NEG_INFINITY), &clip.poses()[0]);
        prop_assert_eq!(&clip.sample_cubic(f64::INFINITY), &clip.poses()[n - 1]);
        prop_assert!(largest(&clip.velocity_cubic(-9.0)) == 0.0 && largest(&clip.velocity_cubic(f64::NAN)) == 0.0);
        // The caller's memory, also one that held a pose of another rig, gives the same.
        let middle = clip.times()[0] + 0.37 * clip.duration_secs();
        let mut pose = random_rig(3, seed).rest_pose();
        clip.sample_cubic_into(middle, &mut pose);
        prop_assert_eq!(pose, clip.sample_cubic(middle));
    }

    #[test]
    fn velocity_has_no_jumps_and_is_what_it_says((rig, seed) in rigs(16), n in 2..7usize) {
        let clip = random_walk(&without_cones(&rig), n, seed);
        let times = clip.times();
        for i in 0..n {
            let here = clip.velocity_cubic(times[i]);
            let step = 1e-6;
            for (is_there, (before, after)) in [(i > 0, (step, 0.0)), (i + 1 < n, (0.0, step))] {
                if is_there {
                    let beside = numeric_velocity(&clip, times[i], before, after);
                    for (a, b) in here.iter().zip(&beside) {
                        prop_assert!((a - b).abs() < 1e-3, "pose {} of {}: {} {}", i, n, a, b);
                    }
                }
            }
            if i + 1 < n {
                for part in [0.2, 0.5, 0.9] {
                    let secs = times[i] + part * (times[i + 1] - times[i]);
                    let numeric = numeric_velocity(&clip, secs, 1e-5, 1e-5);
                    for (a, b) in clip.velocity_cubic(secs).iter().zip(&numeric) {
                        prop_assert!((a - b).abs() < 1e-5, "{} {}", a, b);
                    }
                }
            }
        }
    }

    #[test]
    fn constant_velocity_comes_out_exactly((rig, seed) in rigs(16), n in 2..7usize) {
        let rig = without_limits(&rig);
        let mut random = Random::new(seed);
        let start = random_pose(&rig, &mut random);
        let velocity: Vec<f64> = (0..rig.n_dofs()).map(|_| random.between(-1.7, 1.7)).collect();
        let at = |secs: f64| {
            let mut pose = start.clone();
            pose.retract(&velocity.iter().map(|v| v * secs).collect::<Vec<_>>()).unwrap();
            pose
        };
        let times: Vec<f64> =
            std::iter::successors(Some(0.0), |t| Some(t + random.between(0.01, 0.8))).take(n).collect();
        let clip = Clip::new("", times.clone(), times.iter().map(|t| at(*t)).collect()).unwrap();
        for _ in 0..10 {
            let secs = random.between(0.0, times[n - 1]);
            prop_assert!(apart(&clip.sample_cubic(secs), &at(secs)) < 1e-12);
            for (a, b) in clip.velocity_cubic(secs).iter().zip(&velocity) {
                prop_assert!((a - b).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn the_curve_stays_inside_limits_that_its_poses_keep((rig, seed) in rigs(20), n in 2..7usize) {
        let mut random = Random::new(seed);
        // Far apart: the curve swings out as wide as it can.
        let poses: Vec<Pose> = (0..n).map(|_| random_pose(&rig, &mut random)).collect();
        let clip = Clip::new("", (0..n).map(|i| i as f64).collect(), poses).unwrap();
        for i in 0..=20 * (n - 1) {
            let pose = clip.sample_cubic(i as f64 / 20.0);
            prop_assert!(pose.is_valid() && pose.limit_violation() < 1e-9, "{}", pose.limit_violation());
        }
        let margin = clip.limit_margin();
        for margin in margin.rotation.iter().chain(&margin.translation) {
            prop_assert!(margin.value > -1e-9);
            let again = clip.sample_cubic(margin.secs).limit_margin_of(margin.joint).unwrap();
            prop_assert!((again - margin.value).abs() < 1e-9);
        }
    }

    #[test]
    fn signs_of_quaternions_do_not_matter((rig, seed) in rigs(16), n in 2..6usize) {
        let clip = random_walk(&rig, n, seed);
        let mut random = Random::new(seed);
        let mut poses = clip.poses().to_vec();
        for pose in &mut poses {
            for id in rig.ids() {
                if matches!(rig.get(id).unwrap().motion, JointMotion::Ball { .. } | JointMotion::Free { .. })
                    && random.unit() < 0.5
                {
                    pose.set_rotation(id, -pose.rotation(id).unwrap()).unwrap();
                }
            }
        }
        let flipped = Clip::new("", clip.times().to_vec(), poses).unwrap();
        for i in 0..=30 {
            let secs = clip.times()[0] + clip.duration_secs() * f64::from(i) / 30.0;
            prop_assert!(apart(&clip.sample_cubic(secs), &flipped.sample_cubic(secs)) < 1e-12);
        }
        let (a, b) = (clip.measure(), flipped.measure());
        prop_assert!((a.rotation.jerk.integral - b.rotation.jerk.integral).abs() <= 1e-9 * a.rotation.jerk.integral);
    }

    #[test]
    fn resampling_keeps_ends_steps_and_the_curve((rig, seed) in rigs(10), n in 2..6usize, rate in 5.0..100.0f64) {
        let clip = random_walk(&without_cones(&rig), n, seed);
        let dense = clip.resample(rate).unwrap();
        let (times, n_steps) = (dense.times(), dense.times().len() - 1);
        prop_assert_eq!(dense.name(), "walk");
        prop_assert_eq!(&dense.poses()[0], &clip.poses()[0]);
        prop_assert_eq!(&dense.poses()[n_steps], &clip.poses()[n - 1]);
        prop_assert_eq!((times[0], times[n_steps]), (clip.times()[0], clip.times()[n - 1]));
        let step = clip.duration_secs() / n_steps as f64;
        prop_assert!((n_steps as f64 - clip.duration_secs() * rate).abs() <= 0.5 || n_steps == 1);
        for pair in times.windows(2) {
            prop_assert!((pair[1] - pair[0] - step).abs() < 1e-12);
        }
        for (secs, pose) in times.iter().zip(dense.poses()) {
            prop_assert_eq!(pose, &clip.sample_cubic(*secs));
        }
        // Dense poses tell the curve: back at the old times it is the old clip.
        let again = clip.resample(1000.0).unwrap().resample_at(clip.times().to_vec()).unwrap();
        for (a, b) in again.poses().iter().zip(clip.poses()) {
            prop_assert!(apart(a, b) < 1e-3, "{}", apart(a, b));
        }
    }

    #[test]
    fn one_clip_behind_another((rig, seed) in rigs(10), n in 1..5usize) {
        let (a, b) = (random_walk(&rig, n, seed), random_walk(&rig, 3, seed ^ 7));
        let end = a.times()[n - 1];
        // The other begins elsewhere: one frame later.
        let both = a.concat(&b, 0.0).unwrap();
        let step = if n > 1 { end - a.times()[n - 2] } else { b.times()[1] - b.times()[0] };
        let jump = apart(&a.poses()[n - 1], &b.poses()[0]) > 1e-9;
        prop_assert_eq!(both.poses().len(), n + 2 + usize::from(jump));
        prop_assert_eq!(both.name(), "walk");
        if jump {
            prop_assert!((both.times()[n] - end - step).abs() < 1e-12);
        }
        let pause = f64::from(u8::from(jump)) * step;
        prop_assert!((both.duration_secs() - a.duration_secs() - b.duration_secs() - pause).abs() < 1e-12);
        // It begins where this one ends: they share that pose.
        let mut poses = b.poses().to_vec();
        poses[0] = a.poses()[n - 1].clone();
        let c = Clip::new("other", b.times().to_vec(), poses).unwrap();
        let met = a.concat(&c, 0.0).unwrap();
        prop_assert_eq!(met.poses().len(), n + 2);
        prop_assert!((met.duration_secs() - a.duration_secs() - b.duration_secs()).abs() < 1e-12);
        // A pause is kept, and one below a frame becomes a frame.
        let paused = a.concat(&c, 2.0).unwrap();
        prop_assert!((paused.times()[n] - end - 2.0).abs() < 1e-12);
        let short = a.concat(&c, 1e-6).unwrap();
        prop_assert!((short.times()[n] - end - step).abs() < 1e-12);
        let unnamed = a.clone().with_name("").concat(&c, 0.0).unwrap();
        prop_assert_eq!(unnamed.name(), "other");
    }

    #[test]
    fn peaks_of_the_curve_are_found((rig, seed) in rigs(10), n in 1..6usize) {
        let clip = random_walk(&without_cones(&rig), n, seed);
        let dense: Vec<Vec<f64>> = (0..=400)
            .map(|i| clip.velocity_cubic(clip.times()[0] + clip.duration_secs() * f64::from(i) / 400.0))
            .collect();
        for joint in rig.ids() {
            for part in [RatePart::Rotation, RatePart::Translation] {
                let (speed, acceleration) = (clip.peak_speed(joint, part).unwrap(), clip.peak_acceleration(joint, part).unwrap());
                let length = |velocity: &[f64]| {
                    let own = &velocity[rig.dofs_of(joint)];
                    let own = match (&rig.get(joint).unwrap().motion, part) {
                        (JointMotion::Free { .. }, RatePart::Translation) => &own[..3],
                        (JointMotion::Free { .. }, RatePart::Rotation) => &own[3..],
                        (JointMotion::Slider { .. }, RatePart::Translation) => own,
                        (JointMotion::Slider { .. }, RatePart::Rotation) | (_, RatePart::Translation) => &[],
                        (_, RatePart::Rotation) => own,
                    };
                    own.iter().map(|v| v * v).sum::<f64>().sqrt()
                };
                let most = dense.iter().map(|velocity| length(velocity)).fold(0.0, f64::max);
                prop_assert!(speed.value >= most * (1.0 - 1e-5), "{} {}", speed.value, most);
                let there = length(&clip.velocity_cubic(speed.secs));
                prop_assert!((there - speed.value).abs() <= 1e-6 * speed.value.max(1e-6));
                prop_assert!(speed.value > 0.0 || acceleration.value == 0.0);
            }
        }
    }
}

fn hinge(range: Range) -> (Rig, JointId) {
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("hinge", None);
    joint.motion = JointMotion::Hinge { axis: DVec3::Z, range };
    let id = builder.add(joint);
    let mut tip = Joint::new("tip", Some(id));
    tip.rest_translation = DVec3::X * 0.5;
    builder.add(tip);
    (builder.build().unwrap(), id)
}

/// A clip of a hinge that moves as a function says.
fn moving_hinge(range: Range, times: Vec<f64>, angle: impl Fn(f64) -> f64) -> Clip {
    let (rig, id) = hinge(range);
    let poses = times
        .iter()
        .map(|secs| {
            let mut pose = rig.rest_pose();
            pose.set_value(id, angle(*secs)).unwrap();
            pose
        })
        .collect();
    Clip::new("hinge", times, poses).unwrap()
}

fn even(n: u32, step: f64) -> Vec<f64> {
    (0..n).map(|i| f64::from(i) * step).collect()
}

#[test]
fn a_parabola_comes_out_exactly_at_any_spacing() {
    let wide = Range::new(-100.0, 100.0);
    let clip = moving_hinge(wide, vec![0.0, 0.1, 0.7, 0.8, 1.5], |t| 0.3 + t - 2.0 * t * t);
    for i in 0..=150 {
        let secs = f64::from(i) / 100.0;
        let found = clip.sample_cubic(secs).coords()[0];
        assert!((found - (0.3 + secs - 2.0 * secs * secs)).abs() < 1e-12);
    }
    // Its measures at any spacing as well: the fastest at the end, always as strongly accelerated, no jerk.
    let hinge = JointId::from_index(0);
    assert!((clip.peak_speed(hinge, RatePart::Rotation).unwrap().value - 5.0).abs() < 1e-6);
    assert!((clip.peak_acceleration(hinge, RatePart::Rotation).unwrap().value - 4.0).abs() < 1e-6);
    assert!(clip.rates(Rate::Acceleration).of_dof(0).all(|a| (a + 4.0).abs() < 1e-10));
    let measure = clip.measure();
    assert!((measure.rotation.acceleration.rms - 4.0).abs() < 1e-10);
    assert!(measure.rotation.jerk.peak < 1e-9);
    assert_eq!(measure.translation.speed.peak_joint, None);
    assert_eq!((measure.duration_secs, measure.n_poses), (1.5, 5));
    // A cubic's jerk likewise.
    let clip = moving_hinge(wide, vec![0.0, 0.1, 0.7, 0.8, 1.5], |t| t * t * t);
    assert!(clip.rates(Rate::Jerk).of_dof(0).all(|j| (j - 6.0).abs() < 1e-9));
}

#[test]
fn rates_of_a_sine_are_those_of_a_sine() {
    // Two whole turns of the phase in two seconds: ω = 2π.
    let (omega, amplitude) = (std::f64::consts::TAU, 0.3);
    let clip = moving_hinge(Range::new(-1.0, 1.0), even(2001, 1e-3), |t| amplitude * (omega * t).sin());
    for rate in Rate::ALL {
        let order = i32::try_from(rate.order()).unwrap();
        let (rates, most) = (clip.rates(rate), amplitude * omega.powi(order));
        assert_eq!((rates.rate(), rates.times().len()), (rate, 2001 - rate.order()));
        assert_eq!(rates.row(0).len(), 1);
        assert!(rates.row(5000).is_empty());
        assert!((rates.peak_of(0).value / most - 1.0).abs() < 1e-4, "{rate:?}");
        assert!((rates.rms_of(0) / (most / 2.0_f64.sqrt()) - 1.0).abs() < 1e-3, "{rate:?}");
        // ∫ over two seconds of a squared sine of that size.
        assert!((rates.integral_of(0) / (most * most) - 1.0).abs() < 3e-3, "{rate:?}");
        let phase = f64::from(order) * std::f64::consts::FRAC_PI_2;
        for (secs, value) in rates.times().iter().zip(rates.of_dof(0)) {
            assert!((value - most * (omega * secs + phase).sin()).abs() < 1e-4 * most, "{rate:?}");
        }
        let summary =
            rates.summary(&[JointId::from_index(0), JointId::from_index(1)], RatePart::Rotation).unwrap();
        assert_eq!(
            (summary.peak, summary.peak_joint),
            (rates.peak_of(0).value, Some(JointId::from_index(0)))
        );
        assert_eq!((summary.rms, summary.integral), (rates.rms_of(0), rates.integral_of(0)));
    }
    let peak = clip.peak_speed(JointId::from_index(0), RatePart::Rotation).unwrap();
    assert!((peak.value / (amplitude * omega) - 1.0).abs() < 1e-4);
    // The tip, half a metre out, swings over four amplitudes a second.
    let travelled = clip.path_length(JointId::from_index(1)).unwrap();
    assert!((travelled - 8.0 * amplitude * 0.5).abs() < 1e-5, "{travelled}");
    assert_eq!(clip.path_length(JointId::from_index(0)).unwrap(), 0.0);
    assert!(clip.path_length(JointId::from_index(7)).is_err());
    let margin = clip.limit_margin().rotation.unwrap();
    assert!((margin.value - 0.7).abs() < 1e-5, "{margin:?}");
    assert_eq!(clip.limit_margin().translation, None);
}

#[test]
fn a_turn_about_a_moving_axis_is_measured_on_the_manifold() {
    // A free joint that turns at 2 rad/s about y and moves at 3 m/s: nothing else, wherever it is turned to.
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("free", None);
    joint.motion = JointMotion::FREE;
    joint.rest_rotation = DQuat::from_rotation_x(0.7);
    let id = builder.add(joint);
    let rig = builder.build().unwrap();
    let times = vec![0.0, 0.2, 0.3, 0.9, 1.4, 2.9];
    let poses = times
        .iter()
        .map(|t| {
            let mut pose = rig.rest_pose();
            pose.set_translation(id, DVec3::new(1.0, 2.0, 2.0) * *t).unwrap();
            pose.set_rotation(id, DQuat::from_rotation_z(1.0) * DQuat::from_rotation_y(2.0 * t)).unwrap();
            pose
        })
        .collect();
    let clip = Clip::new("", times, poses).unwrap();
    let measure = clip.measure();
    assert!((measure.rotation.speed.peak - 2.0).abs() < 1e-12);
    assert!((measure.translation.speed.rms - 3.0).abs() < 1e-12);
    assert!((measure.translation.speed.integral - 9.0 * 2.9).abs() < 1e-12);
    assert!(measure.rotation.acceleration.peak < 1e-10 && measure.translation.jerk.peak < 1e-10);
    assert!((clip.path_length(id).unwrap() - 8.7).abs() < 1e-9);
    assert!((clip.peak_speed(id, RatePart::Rotation).unwrap().value - 2.0).abs() < 1e-10);
    assert!((clip.peak_speed(id, RatePart::Translation).unwrap().value - 3.0).abs() < 1e-10);
    assert_eq!(clip.limit_margin(), ikiru_rig::LimitMargin::default());
}

#[test]
fn a_ball_is_smooth_where_its_quaternion_changes_sign() {
    // A whole turn and a half, in steps of 100°, the quaternions all with w ≥ 0.
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("ball", None);
    joint.motion = JointMotion::BALL;
    let id = builder.add(joint);
    let rig = builder.build().unwrap();
    let axis = DVec3::new(0.6, 0.0, 0.8);
    let poses = (0..7)
        .map(|i| {
            let q = DQuat::from_axis_angle(axis, f64::from(i) * 100.0_f64.to_radians());
            let mut pose = rig.rest_pose();
            pose.set_rotation(id, if q.w < 0.0 { -q } else { q }).unwrap();
            pose
        })
        .collect();
    let clip = Clip::new("", even(7, 1.0), poses).unwrap();
    for i in 0..600 {
        let [a, b] =
            [0.0, 0.01].map(|later| clip.sample_cubic(f64::from(i) / 100.0 + later).rotation(id).unwrap());
        assert!((rotation_vector(a.inverse() * b) - axis * 1.0_f64.to_radians()).length() < 1e-12);
    }
}

#[test]
fn curves_of_ranges_and_cones_stop_at_the_limit() {
    // Up to the limit and back: a free curve would swing over it between the second and the third pose.
    let angles = [0.0, 1.0, 1.0, 0.0];
    let clip = moving_hinge(Range::new(-1.0, 1.0), even(4, 1.0), |t| angles[t as usize]);
    let free = moving_hinge(Range::new(-9.0, 9.0), even(4, 1.0), |t| angles[t as usize]);
    assert!(free.sample_cubic(1.5).coords()[0] > 1.1);
    assert!(clip.sample_cubic(1.5).coords()[0] <= 1.0);
    // Poses that are outside already are left alone.
    let outside = moving_hinge(Range::new(-1.0, 0.5), even(4, 1.0), |t| angles[t as usize]);
    assert_eq!(outside.sample_cubic(1.0).coords()[0], 1.0);
    assert!(outside.limit_margin().rotation.unwrap().value <= -0.5);

    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("ball", None);
    let cone = Cone::new(DVec3::Y, [1.0, 1.0], Range::new(-0.5, 0.5)).unwrap();
    joint.motion = JointMotion::Ball { cone: Some(cone) };
    let id = builder.add(joint);
    let rig = builder.build().unwrap();
    let poses = angles
        .map(|angle| {
            let mut pose = rig.rest_pose();
            pose.set_rotation(id, DQuat::from_rotation_x(angle)).unwrap();
            pose
        })
        .to_vec();
    let clip = Clip::new("", even(4, 1.0), poses).unwrap();
    let mut previous = clip.sample_cubic(0.0);
    for i in 1..=300 {
        let pose = clip.sample_cubic(f64::from(i) / 100.0);
        assert!(pose.limit_violation() < 1e-9);
        assert!(apart(&previous, &pose) < 0.03, "no leap");
        previous = pose;
    }
    let margin = clip.limit_margin().rotation.unwrap();
    assert!(margin.joint == id && margin.value.abs() < 1e-9, "{margin:?}");
    // On the cone it stands still.
    assert!(largest(&clip.velocity_cubic(1.5)) < 1e-6);
}

#[test]
fn a_single_pose_is_a_clip_in_all_of_this() {
    let clip = moving_hinge(Range::UNLIMITED, vec![2.0], |_| 0.4);
    assert_eq!(clip.sample_cubic(2.0), clip.poses()[0]);
    assert_eq!(clip.velocity_cubic(2.0), [0.0]);
    assert_eq!(clip.resample(60.0).unwrap(), clip);
    for rate in Rate::ALL {
        let rates = clip.rates(rate);
        assert!(rates.times().is_empty() && rates.rms_of(0) == 0.0 && rates.peak_of(0).value == 0.0);
    }
    assert_eq!(clip.measure().rotation.speed, ikiru_rig::RateSummary::default());
    assert_eq!(clip.path_length(JointId::from_index(1)).unwrap(), 0.0);
    // Behind another single pose, a thirtieth of a second later; behind itself it is itself.
    let other = Clip::new("", vec![7.0], vec![clip.rig().rest_pose()]).unwrap();
    let both = clip.concat(&other, 0.0).unwrap();
    assert!((both.duration_secs() - 1.0 / 30.0).abs() < 1e-12);
    assert_eq!(clip.concat(&clip, 0.0).unwrap(), clip);
}

#[test]
fn edits_refuse_what_makes_no_clip() {
    let clip = moving_hinge(Range::UNLIMITED, even(3, 0.5), |t| t);
    let other = moving_hinge(Range::UNLIMITED, even(3, 0.5), |t| t);
    for rate in [0.0, -30.0, f64::INFINITY] {
        assert_eq!(clip.resample(rate), Err(ClipError::Rate(rate)));
    }
    assert!(matches!(clip.resample(f64::NAN), Err(ClipError::Rate(_))));
    assert!(matches!(clip.resample(1e12), Err(ClipError::TooLong { .. })));
    assert_eq!(clip.resample_at(vec![]), Err(ClipError::Empty));
    assert!(matches!(clip.resample_at(vec![0.0, 0.0]), Err(ClipError::Time { idx: 1, .. })));
    assert!(matches!(clip.resample_at(vec![f64::NAN]), Err(ClipError::Time { idx: 0, .. })));
    assert_eq!(clip.concat(&other, 0.0), Err(ClipError::OtherRig));
    assert_eq!(clip.concat(&clip, -0.1), Err(ClipError::Gap(-0.1)));
    assert!(matches!(clip.concat(&clip, f64::NAN), Err(ClipError::Gap(_))));
    assert!(matches!(clip.concat(&clip, 1e300), Err(ClipError::Time { .. })));
}

#[test]
fn poses_with_numbers_that_are_not_finite_do_not_panic() {
    let mut clip = random_walk(&random_rig(14, 3), 4, 3);
    let mut poses = clip.poses().to_vec();
    poses[2].coords_mut().fill(f64::NAN);
    poses[1].coords_mut().fill(f64::INFINITY);
    clip = Clip::new("", clip.times().to_vec(), poses).unwrap();
    let _ = (clip.sample_cubic(clip.times()[1] + 0.01), clip.velocity_cubic(clip.times()[2]), clip.measure());
    for joint in clip.rig().ids() {
        let _ = (clip.peak_speed(joint, RatePart::Rotation).unwrap(), clip.path_length(joint).unwrap());
    }
}
