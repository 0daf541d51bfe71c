//! Clips slowed down until limits hold: measured independently, along the same way, only where it is needed.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use std::cell::Cell;

use glam::{DQuat, DVec3};
use ikiru_rig::{
    Clip, ClipError, Cone, Joint, JointId, JointMotion, Pose, Range, Rate, RateLimit, RatePart, Retimed, Rig,
    RigBuilder,
};
use ikiru_testkit::rigs::{Random, random_rig, random_walk, rigs};
use proptest::prelude::*;

/// The first joint.
fn first() -> JointId {
    JointId::from_index(0)
}

fn without_cones(rig: &Rig) -> Rig {
    let mut builder = rig.to_builder();
    for joint in builder.joints_mut() {
        if let JointMotion::Ball { cone } | JointMotion::Free { cone } = &mut joint.motion {
            *cone = None;
        }
    }
    builder.build().unwrap()
}

/// Limits for all that moves, some below and some above what the clip does.
fn limits_of(clip: &Clip, rates: &[Rate], seed: u64) -> Vec<RateLimit> {
    let mut random = Random::new(seed ^ 0x77);
    let mut limits = vec![];
    for joint in clip.rig().ids() {
        for part in [RatePart::Rotation, RatePart::Translation] {
            for rate in rates.iter().copied() {
                let peak = match rate {
                    Rate::Speed => clip.peak_speed(joint, part).unwrap().value,
                    // Where a cone stops a ball at once, it is known to be large alone.
                    _ => clip.peak_acceleration(joint, part).unwrap().value.min(60.0),
                };
                if peak > 1e-6 {
                    limits.push(RateLimit { joint, part, rate, most: random.between(0.3, 1.3) * peak });
                }
            }
        }
    }
    limits
}

/// The largest speed or acceleration by differences of dense samples: nothing of the library's own measures.
fn dense_peaks(clip: &Clip, limits: &[RateLimit], n: u32) -> Vec<f64> {
    let rig = clip.rig();
    let mut peaks = vec![0.0_f64; limits.len()];
    let (start, duration, step) = (clip.times()[0], clip.duration_secs(), 1e-4);
    for i in 0..=n {
        // Inside: beyond its ends a clip holds still.
        let secs = start + step + (duration - 2.0 * step) * f64::from(i) / f64::from(n);
        let [a, b, c] = [-step, 0.0, step].map(|later| clip.sample_cubic(secs + later));
        let (before, after) = (a.difference(&b).unwrap(), b.difference(&c).unwrap());
        for (peak, limit) in peaks.iter_mut().zip(limits) {
            let is_free = matches!(rig.get(limit.joint).unwrap().motion, JointMotion::Free { .. });
            let mut dofs = rig.dofs_of(limit.joint);
            if is_free && limit.part == RatePart::Translation {
                dofs.end -= 3;
            } else if is_free {
                dofs.start += 3;
            }
            let length = |of: &dyn Fn(usize) -> f64| dofs.clone().map(|i| of(i).powi(2)).sum::<f64>().sqrt();
            *peak = peak.max(match limit.rate {
                Rate::Speed => length(&|i| after[i] / step),
                _ => length(&|i| (after[i] - before[i]) / (step * step)),
            });
        }
    }
    peaks
}

fn assert_kept(clip: &Clip, limits: &[RateLimit], n: u32) {
    assert!(clip.exceeded(limits).unwrap().is_empty());
    for (peak, limit) in dense_peaks(clip, limits, n).iter().zip(limits) {
        assert!(*peak <= limit.most * (1.0 + 1e-4) + 1e-5, "{peak} {limit:?}");
    }
}

/// A slowed clip is the old one at other times, which only get longer.
fn assert_same_way(clip: &Clip, retimed: &Retimed, rate_hz: f64) {
    let (times, new) = (clip.times(), &retimed.clip);
    let (last, new_last) = (times.len() - 1, new.times().len() - 1);
    assert_eq!((new.name(), new.times()[0]), (clip.name(), times[0]));
    assert_eq!(&new.poses()[0], &clip.poses()[0]);
    assert_eq!(&new.poses()[new_last], &clip.poses()[last]);
    let step = new.duration_secs() / new_last as f64;
    assert!((new_last as f64 - new.duration_secs() * rate_hz).abs() <= 0.5 + 1e-9 || new_last == 1);
    for (secs, pair) in new.times().iter().zip(new.times().windows(2)) {
        assert!((pair[1] - pair[0] - step).abs() < 1e-9 && *secs == pair[0]);
    }
    for (secs, pose) in new.times().iter().zip(new.poses()) {
        assert_eq!(pose, &clip.sample_cubic(retimed.was_at(*secs)));
    }
    // The map rises, never faster than time itself, and has an inverse.
    assert_eq!((retimed.at(times[0]), retimed.at(times[last])), (new.times()[0], new.times()[new_last]));
    let (mut before, mut now) = (times[0], new.times()[0]);
    for i in 1..=300 {
        let secs = times[0] + clip.duration_secs() * (f64::from(i) / 300.0);
        let later = retimed.at(secs);
        assert!(later - now >= (secs - before) * (1.0 - 1e-9), "{later} {now}");
        assert!((retimed.was_at(later) - secs).abs() < 1e-9);
        (before, now) = (secs, later);
    }
    let outside = [f64::NEG_INFINITY, f64::NAN, times[0] - 1.0].map(|secs| retimed.at(secs));
    assert_eq!(outside, [new.times()[0]; 3]);
    assert_eq!(retimed.was_at(f64::INFINITY), times[last]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn limits_hold_everywhere_along_the_same_way((rig, seed) in rigs(7), n in 2..7usize, rate in 20.0..120.0f64) {
        let clip = random_walk(&without_cones(&rig), n, seed);
        let limits = limits_of(&clip, &[Rate::Speed, Rate::Acceleration], seed);
        let retimed = clip.retime(&limits, rate).unwrap();
        assert_kept(&retimed.clip, &limits, 3000);
        if clip.exceeded(&limits).unwrap().is_empty() {
            prop_assert_eq!(&retimed.clip, &clip);
        } else {
            assert_same_way(&clip, &retimed, rate);
        }
        // Ranges hold as they did.
        for i in 0..=200 {
            let secs = retimed.clip.times()[0] + retimed.clip.duration_secs() * f64::from(i) / 200.0;
            prop_assert!(retimed.clip.sample_cubic(secs).limit_violation() < 1e-9);
        }
        prop_assert_eq!(&clip.retime(&limits, rate).unwrap(), &retimed);
    }

    #[test]
    fn speeds_hold_where_cones_do((rig, seed) in rigs(7), n in 2..6usize) {
        let clip = random_walk(&rig, n, seed);
        let limits = limits_of(&clip, &[Rate::Speed], seed);
        match clip.retime(&limits, 60.0) {
            Ok(retimed) => {
                prop_assert!(retimed.clip.exceeded(&limits).unwrap().is_empty());
                for i in 0..=300 {
                    let secs = retimed.clip.times()[0] + retimed.clip.duration_secs() * f64::from(i) / 300.0;
                    prop_assert!(retimed.clip.sample_cubic(secs).limit_violation() < 1e-9);
                }
            }
            // A cone whose edge leaps.
            Err(error) => prop_assert!(matches!(error, ClipError::Unkept { .. }), "{}", error),
        }
    }
}

fn hinge(range: Range) -> Rig {
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("hinge", None);
    joint.motion = JointMotion::Hinge { axis: DVec3::Z, range };
    builder.add(joint);
    builder.build().unwrap()
}

/// A clip of a hinge that moves as a function says, 60 poses a second.
fn moving_hinge(n: u32, angle: impl Fn(f64) -> f64) -> Clip {
    let rig = hinge(Range::new(-100.0, 100.0));
    let times: Vec<f64> = (0..=n).map(|i| f64::from(i) / 60.0).collect();
    let at = |secs: &f64| {
        let mut pose = rig.rest_pose();
        pose.set_value(first(), angle(*secs)).unwrap();
        pose
    };
    let poses = times.iter().map(at).collect();
    Clip::new("hinge", times, poses).unwrap()
}

fn limit(rate: Rate, most: f64) -> RateLimit {
    RateLimit { joint: first(), part: RatePart::Rotation, rate, most }
}

/// From rest to rest within a second, by one radian.
fn quintic(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
}

#[test]
fn a_constant_speed_becomes_the_largest_allowed() {
    let clip = moving_hinge(60, |t| 2.0 * t);
    for most in [1.9, 0.7, 0.03] {
        let limits = [limit(Rate::Speed, most), limit(Rate::Acceleration, 0.1)];
        let retimed = clip.retime(&limits, 60.0).unwrap();
        assert!((retimed.clip.duration_secs() / (2.0 / most) - 1.0).abs() < 1e-9);
        assert_same_way(&clip, &retimed, 60.0);
    }
}

#[test]
fn a_clip_that_keeps_its_limits_stays_as_it_is() {
    let clip = random_walk(&random_rig(7, 5), 6, 5);
    let limits: Vec<RateLimit> = limits_of(&clip, &[Rate::Speed], 5)
        .into_iter()
        .map(|limit| RateLimit { most: clip.peak_speed(limit.joint, limit.part).unwrap().value, ..limit })
        .collect();
    assert!(limits.len() > 3);
    for limits in [limits.as_slice(), &[]] {
        let retimed = clip.retime(limits, 17.0).unwrap();
        assert_eq!(retimed.clip, clip);
        let (start, end) = (clip.times()[0], clip.times()[5]);
        for secs in clip.times().iter().copied().chain([start + 0.1, start + 0.123_456_789]) {
            assert_eq!((retimed.at(secs), retimed.was_at(secs)), (secs, secs));
        }
        let outside = [f64::NEG_INFINITY, f64::NAN, f64::INFINITY];
        assert_eq!(outside.map(|secs| retimed.at(secs)), [start, start, end]);
        assert_eq!(outside.map(|secs| retimed.was_at(secs)), [start, start, end]);
    }
}

#[test]
fn a_limit_of_acceleration_costs_no_more_than_an_even_tempo() {
    let clip = moving_hinge(60, quintic);
    let peak = clip.peak_acceleration(first(), RatePart::Rotation).unwrap().value;
    for share in [0.9, 0.5, 0.1, 0.01] {
        for rate in [30.0, 60.0, 240.0] {
            let limits = [limit(Rate::Acceleration, share * peak)];
            let retimed = clip.retime(&limits, rate).unwrap();
            assert_kept(&retimed.clip, &limits, 3000);
            let even = share.sqrt().recip();
            let secs = retimed.clip.duration_secs();
            // As fast as can be is full acceleration and then full braking: 2 √(1 / a).
            let least = 2.0 / (share * peak).sqrt();
            assert!(secs < even && secs > least, "{share} {rate}: {secs} {even} {least}");
            if share < 0.2 && rate > 100.0 {
                assert!(secs < 1.03 * least, "{share}: {secs} {least}");
            }
        }
    }
}

#[test]
fn a_turning_point_is_taken_slowly_without_stopping() {
    // Where it turns, it has no speed: no tempo changes its acceleration but by its square.
    let clip = moving_hinge(180, |t| (5.0 * t).sin());
    let limits = [limit(Rate::Acceleration, 10.0)];
    let retimed = clip.retime(&limits, 120.0).unwrap();
    assert_kept(&retimed.clip, &limits, 3000);
    let even = 3.0 * 2.5_f64.sqrt();
    assert!(retimed.clip.duration_secs() < 0.95 * even, "{}", retimed.clip.duration_secs() / even);
}

#[test]
fn only_the_fast_moment_of_a_long_clip_is_slowed_down() {
    let clip = moving_hinge(1200, |t| quintic(t - 10.0) + 0.01 * t);
    for limits in [[limit(Rate::Acceleration, 1.0)], [limit(Rate::Speed, 0.6)]] {
        let retimed = clip.retime(&limits, 60.0).unwrap();
        assert_kept(&retimed.clip, &limits, 9000);
        assert_same_way(&clip, &retimed, 60.0);
        let end = retimed.clip.times()[retimed.clip.times().len() - 1];
        // Half a second before and after the moment, nothing has changed.
        assert!((retimed.at(9.5) - 9.5).abs() < 1e-9);
        assert!((end - retimed.at(11.5) - 8.5).abs() < 1e-9);
        assert!(end > 20.5 && end < 22.0, "{end}");
    }
}

#[test]
fn slowing_down_takes_the_least_time_that_accelerations_allow() {
    // One hinge goes on at 1 rad/s, 2 rad/s² at most; another moves for one second alone, twice as fast as it may.
    let mut builder = RigBuilder::new();
    for name in ["steady", "sudden"] {
        let mut joint = Joint::new(name, None);
        joint.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::new(-100.0, 100.0) };
        builder.add(joint);
    }
    let rig = builder.build().unwrap();
    let times: Vec<f64> = (0..=600).map(|i| f64::from(i) / 60.0).collect();
    let poses = times.iter().map(|t| {
        let mut pose = rig.rest_pose();
        pose.set_value(first(), *t).unwrap();
        pose.set_value(JointId::from_index(1), (t - 4.0).clamp(0.0, 1.0)).unwrap();
        pose
    });
    let clip = Clip::new("", times.clone(), poses.collect()).unwrap();
    let sudden = RateLimit { joint: JointId::from_index(1), ..limit(Rate::Speed, 0.5) };
    let limits = [limit(Rate::Acceleration, 2.0), sudden];
    let retimed = clip.retime(&limits, 60.0).unwrap();
    assert_kept(&retimed.clip, &limits, 6000);
    // The second takes one more; from 1 to 1/2 rad/s takes 1/4 s, for a way of 3/16 s, before and after.
    let least = 10.0 + 1.0 + 2.0 * (0.25 - 0.1875);
    let secs = retimed.clip.duration_secs();
    assert!(secs > least && secs < least * 1.015, "{secs} {least}");
}

#[test]
fn every_pose_and_the_curve_between_lie_on_the_old_curve() {
    let clip = random_walk(&without_cones(&random_rig(7, 9)), 6, 9);
    let limits = limits_of(&clip, &[Rate::Speed, Rate::Acceleration], 9);
    let retimed = clip.retime(&limits, 120.0).unwrap();
    assert!(retimed.clip.duration_secs() > 1.2 * clip.duration_secs());
    let n = 20_000;
    let old: Vec<Pose> = (0..=n)
        .map(|i| clip.sample_cubic(clip.times()[0] + clip.duration_secs() * f64::from(i) / f64::from(n)))
        .collect();
    let apart =
        |a: &Pose, b: &Pose| a.difference(b).unwrap().iter().fold(0.0, |most: f64, d| most.max(d.abs()));
    let mut passed = 0;
    for i in 0..=1000 {
        let secs = retimed.clip.times()[0] + retimed.clip.duration_secs() * f64::from(i) / 1000.0;
        let pose = retimed.clip.sample_cubic(secs);
        // Both go the same way: the nearest lies at or shortly after the one of the pose before.
        let nearest = (passed..(passed + 400).min(old.len()))
            .map(|i| (apart(&pose, &old[i]), i))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap();
        assert!(nearest.0 < 1e-3, "{} rad or m from the old curve", nearest.0);
        passed = nearest.1;
    }
}

#[test]
fn a_corner_at_the_edge_of_a_cone_is_passed_slowly() {
    // Along the edge after running into it: its velocity outwards ends at once.
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("ball", None);
    let cone = Cone::new(DVec3::Y, [0.5, 0.5], Range::new(-0.5, 0.5)).unwrap();
    joint.motion = JointMotion::Ball { cone: Some(cone) };
    builder.add(joint);
    let rig = builder.build().unwrap();
    let poses = (0..=20).map(|i| {
        let mut pose = rig.rest_pose();
        pose.set_rotation(first(), DQuat::from_rotation_x(0.04 * f64::from(i))).unwrap();
        pose.project();
        pose
    });
    let clip = Clip::new("", (0..=20).map(|i| f64::from(i) / 30.0).collect(), poses.collect()).unwrap();
    let limits = [limit(Rate::Acceleration, 20.0)];
    assert!(!clip.exceeded(&limits).unwrap().is_empty());
    let retimed = clip.retime(&limits, 60.0).unwrap();
    assert_kept(&retimed.clip, &limits, 3000);
    assert_same_way(&clip, &retimed, 60.0);
    assert!(retimed.clip.limit_margin().rotation.unwrap().value > -1e-9);
}

#[test]
fn what_cannot_be_retimed_is_told() {
    let clip = moving_hinge(60, |t| 2.0 * t);
    let slow = [limit(Rate::Speed, 0.5)];
    for rate in [0.0, -30.0, f64::INFINITY] {
        assert_eq!(clip.retime(&slow, rate), Err(ClipError::Rate(rate)));
    }
    assert!(matches!(clip.retime(&slow, f64::NAN), Err(ClipError::Rate(_))));
    for (most, rate) in [(0.5, 1e12), (0.5, 2e7), (1e-12, 60.0)] {
        let error = clip.retime(&[limit(Rate::Speed, most)], rate).unwrap_err();
        assert!(matches!(error, ClipError::TooLong { .. }), "{error}");
    }
    let single = Clip::new("", vec![2.0], vec![clip.poses()[0].clone()]).unwrap();
    let retimed = single.retime(&slow, 60.0).unwrap();
    assert_eq!((&retimed.clip, retimed.at(7.0), retimed.was_at(-7.0)), (&single, 2.0, 2.0));
    // Absurd numbers are an error, never a panic.
    for size in [1e20, 1e160, 1e300] {
        let absurd = moving_hinge(6, |t| size * t);
        assert!(absurd.retime(&[limit(Rate::Acceleration, 1.0), limit(Rate::Speed, 1.0)], 60.0).is_err());
    }
    // Two poses in one step, and a rate below one pose a clip: still a clip that keeps its limits.
    for rate in [1e-9, 0.5, 3.0] {
        let retimed = clip.retime(&slow, rate).unwrap();
        assert_kept(&retimed.clip, &slow, 100);
    }
}

#[test]
fn a_joint_that_leaps_has_no_tempo_that_is_slow_enough() {
    // From one swing to another far beside it a free ball would twist; its cone holds the twist, and where the swing
    // passes half a turn it goes from one end of its range to the other at once.
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("ball", None);
    let cone = Cone::new(DVec3::Y, [3.13, 3.13], Range::new(-0.1, 0.1)).unwrap();
    joint.motion = JointMotion::Ball { cone: Some(cone) };
    builder.add(joint);
    let rig = builder.build().unwrap();
    let leaping = |swing: f64, turn: f64| {
        let poses = [DVec3::X, DVec3::new(turn.cos(), 0.0, turn.sin())].map(|axis| {
            let mut pose = rig.rest_pose();
            pose.set_rotation(first(), DQuat::from_axis_angle(axis, swing)).unwrap();
            pose
        });
        Clip::new("", vec![0.0, 1.0], poses.to_vec()).unwrap()
    };
    for (swing, turn) in [(2.0, 2.0), (2.9, 3.0)] {
        let error = leaping(swing, turn).retime(&[limit(Rate::Speed, 0.5)], 20.0).unwrap_err();
        let ClipError::Unkept { joint, excess } = &error else { panic!("{error}") };
        assert!(joint == "ball" && excess.limit.most == 0.5 && excess.ratio() > 1.0);
        let message = error.to_string();
        assert!(message.starts_with("joint 'ball' still reaches "), "{message}");
        assert!(
            message.contains(" rad/s, above its largest speed of 0.5 rad/s: raise that limit"),
            "{message}"
        );
    }
}

#[test]
fn who_is_told_to_stop_measures_nothing_more_and_names_a_limit_that_is_not_kept() {
    let rig = random_rig(6, 2);
    let clip = random_walk(&rig, 8, 5);
    let limits = limits_of(&clip, &[Rate::Speed, Rate::Acceleration], 3);
    let asked = Cell::new(0);
    let stopped_at = |most: usize| {
        asked.set(0);
        clip.retime_while(&limits, 20.0, || {
            asked.set(asked.get() + 1);
            asked.get() < most
        })
    };
    assert!(stopped_at(usize::MAX).is_ok());
    let all = asked.get();
    // Several rounds, each of which asks before every limit.
    assert!(limits.len() > 3 && all > 2 * limits.len(), "{all}");
    for most in [1, 2, limits.len(), limits.len() + 1, limits.len() + 2, all / 2, all] {
        let error = stopped_at(most).unwrap_err();
        assert_eq!(asked.get(), most, "it goes on after it was told to stop");
        let ClipError::Unkept { excess, .. } = &error else { panic!("{error}") };
        assert!(limits.contains(&excess.limit) && excess.ratio() > 1.0);
    }
}
