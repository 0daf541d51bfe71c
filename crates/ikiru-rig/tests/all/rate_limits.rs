//! Limits of speed and acceleration: where a clip does not keep them, and what is no limit.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use glam::{DQuat, DVec3};
use ikiru_rig::{
    Clip, ClipError, Joint, JointId, JointMotion, Mimic, Range, Rate, RateLimit, RatePart, Rig, RigBuilder,
};

/// A hinge, a slider, one that follows the hinge, a fixed joint and a free one.
fn rig() -> Rig {
    let mut builder = RigBuilder::new();
    let range = Range::new(-100.0, 100.0);
    let motions = [
        JointMotion::Hinge { axis: DVec3::Z, range },
        JointMotion::Slider { axis: DVec3::X, range },
        JointMotion::Hinge { axis: DVec3::X, range: Range::UNLIMITED },
        JointMotion::Fixed,
        JointMotion::FREE,
    ];
    for (name, motion) in ["hinge", "slider", "follower", "fixed", "free"].into_iter().zip(motions) {
        let mut joint = Joint::new(name, None);
        joint.motion = motion;
        if name == "follower" {
            joint.mimic = Some(Mimic { leader: JointId::from_index(0), multiplier: 2.0, offset: 0.0 });
        }
        builder.add(joint);
    }
    builder.build().unwrap()
}

/// The hinge moves as `t²` until 2 s, the slider at 3 m/s, the free joint at 5 m/s and 0.5 rad/s.
fn clip(rig: &Rig) -> Clip {
    let times: Vec<f64> = (0..=20).map(|i| f64::from(i) / 10.0).collect();
    let poses = times.iter().map(|t| {
        let mut pose = rig.rest_pose();
        pose.set_value(JointId::from_index(0), t * t).unwrap();
        pose.set_value(JointId::from_index(1), 3.0 * t).unwrap();
        pose.set_translation(JointId::from_index(4), DVec3::new(3.0, 0.0, 4.0) * *t).unwrap();
        pose.set_rotation(JointId::from_index(4), DQuat::from_rotation_y(0.5 * t)).unwrap();
        pose
    });
    let poses = poses.collect();
    Clip::new("clip", times, poses).unwrap()
}

fn limit(joint: usize, part: RatePart, rate: Rate, most: f64) -> RateLimit {
    RateLimit { joint: JointId::from_index(joint), part, rate, most }
}

#[test]
fn what_is_exceeded_is_told_with_its_peak_the_worst_first() {
    let clip = clip(&rig());
    let limits = [
        limit(0, RatePart::Rotation, Rate::Speed, 3.0),
        limit(0, RatePart::Rotation, Rate::Acceleration, 2.1),
        limit(1, RatePart::Translation, Rate::Speed, 1.0),
        limit(1, RatePart::Translation, Rate::Acceleration, 1e-6),
        limit(4, RatePart::Translation, Rate::Speed, 4.0),
        limit(4, RatePart::Rotation, Rate::Speed, 0.6),
        limit(4, RatePart::Rotation, Rate::Speed, 0.45),
    ];
    let excesses = clip.exceeded(&limits).unwrap();
    assert_eq!(
        excesses.iter().map(|excess| excess.limit).collect::<Vec<_>>(),
        [limits[2], limits[0], limits[4], limits[6]]
    );
    for (excess, (value, ratio)) in
        excesses.iter().zip([(3.0, 3.0), (4.0, 4.0 / 3.0), (5.0, 1.25), (0.5, 1.0 / 0.9)])
    {
        assert!((excess.peak.value - value).abs() < 1e-6 && (excess.ratio() - ratio).abs() < 1e-6);
        assert_eq!(excess.peak.value, clip_peak(&clip, excess.limit));
    }
    // The hinge is fastest at its end.
    assert!((excesses[1].peak.secs - 2.0).abs() < 1e-6);
    assert!(clip.exceeded(&[]).unwrap().is_empty());
}

fn clip_peak(clip: &Clip, limit: RateLimit) -> f64 {
    clip.peak_speed(limit.joint, limit.part).unwrap().value
}

#[test]
fn rounding_is_no_excess() {
    let clip = clip(&rig());
    let peak = clip.peak_speed(JointId::from_index(1), RatePart::Translation).unwrap().value;
    for (share, n) in [(1.0, 0), (1.0 - 1e-10, 0), (1.0 - 1e-8, 1)] {
        let limit = limit(1, RatePart::Translation, Rate::Speed, peak * share);
        assert_eq!(clip.exceeded(&[limit]).unwrap().len(), n, "{share}");
    }
}

#[test]
fn what_is_no_limit_is_refused_and_says_why() {
    let rig = rig();
    let clip = clip(&rig);
    let good = limit(0, RatePart::Rotation, Rate::Speed, 1e9);
    let refused = |limit: RateLimit| {
        let error = clip.exceeded(&[good, limit]).unwrap_err();
        // Of a clip that is retimed as well.
        assert_eq!(format!("{:?}", clip.retime(&[good, limit], 60.0).unwrap_err()), format!("{error:?}"));
        error
    };
    for most in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        let error = refused(limit(1, RatePart::Translation, Rate::Acceleration, most));
        assert!(matches!(&error, ClipError::RateLimitMost { joint, .. } if joint == "slider"));
        assert_eq!(
            error.to_string(),
            format!(
                "joint 'slider': its largest acceleration must be a finite number of m/s² above 0, not {most}; leave \
                 the limit out where there is none"
            )
        );
    }
    let error = refused(limit(0, RatePart::Rotation, Rate::Jerk, 1.0));
    assert_eq!(error, ClipError::RateLimitJerk { joint: "hinge".into() });
    let error = refused(limit(5, RatePart::Rotation, Rate::Speed, 1.0));
    assert_eq!(
        error.to_string(),
        "there is no joint 5 among the 5 of this rig: expected an id that comes from it"
    );
    for (joint, part, message) in [
        (0, RatePart::Translation, "joint 'hinge' is hinge: it has no translation of its own to limit"),
        (1, RatePart::Rotation, "joint 'slider' is slider: it has no rotation of its own to limit"),
        (
            2,
            RatePart::Rotation,
            "joint 'follower' is a follower of another: it has no rotation of its own to limit",
        ),
        (3, RatePart::Rotation, "joint 'fixed' is fixed: it has no rotation of its own to limit"),
    ] {
        let error = refused(limit(joint, part, Rate::Speed, 1.0));
        assert!(matches!(error, ClipError::RateLimitPart { .. }));
        assert_eq!(error.to_string(), message);
    }
}

#[test]
fn numbers_that_are_not_finite_are_not_measured() {
    let rig = rig();
    let clip = clip(&rig);
    for value in [f64::NAN, f64::INFINITY] {
        let mut poses = clip.poses().to_vec();
        poses[7].coords_mut()[0] = value;
        let broken = Clip::new("", clip.times().to_vec(), poses).unwrap();
        let error = ClipError::NotFinite { pose: 7, joint: "hinge".into() };
        assert_eq!(broken.exceeded(&[limit(0, RatePart::Rotation, Rate::Speed, 1.0)]), Err(error));
        // Joints without limits do not matter.
        assert!(broken.exceeded(&[limit(1, RatePart::Translation, Rate::Speed, 9.0)]).unwrap().is_empty());
    }
}
