//! Poses and clips as data: they come back to the last bit, and what does not fit a rig is refused.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{DQuat, DVec3};
use ikiru_rig::{
    Clip, ClipData, ClipError, DataError, EulerOrder, Joint, JointData, JointId, JointMotion, Mimic,
    PoseData, Range, Rig, RigBuilder,
};
use ikiru_testkit::rigs::{Random, random_pose, rigs};
use proptest::prelude::*;

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

proptest! {
    #[test]
    fn poses_and_clips_come_back_to_the_last_bit((rig, seed) in rigs(30)) {
        let mut random = Random::new(seed);
        let poses: Vec<_> = (0..3).map(|_| random_pose(&rig, &mut random)).collect();
        let text = serde_json::to_string(&poses[0]).unwrap();
        let data: PoseData = serde_json::from_str(&text).unwrap();
        prop_assert_eq!(bits(data.pose(&rig).unwrap().coords()), bits(poses[0].coords()));
        let clip = Clip::new("a \"walk\"", vec![-0.1, 0.0, 1.0 / 3.0], poses).unwrap();
        let data: ClipData = serde_json::from_slice(&serde_json::to_vec(&clip).unwrap()).unwrap();
        let again = data.clip(&rig).unwrap();
        prop_assert_eq!(again.name(), clip.name());
        prop_assert_eq!(bits(again.times()), bits(clip.times()));
        for (a, b) in again.poses().iter().zip(clip.poses()) {
            prop_assert_eq!(bits(a.coords()), bits(b.coords()));
        }
    }
}

/// One joint of every kind, and a follower.
fn zoo() -> Rig {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    let mut add = |name: &str, motion: JointMotion, mimic: Option<Mimic>| {
        let mut joint = Joint::new(name, parent);
        (joint.motion, joint.mimic) = (motion, mimic);
        joint.aliases = vec![format!("{name} link")];
        let id = builder.add(joint);
        parent = Some(id);
    };
    let hinge = JointMotion::Hinge { axis: DVec3::X, range: Range::UNLIMITED };
    add("free", JointMotion::FREE, None);
    add("ball", JointMotion::BALL, None);
    add("euler", JointMotion::Euler { order: EulerOrder::Zyx, ranges: [Range::UNLIMITED; 3] }, None);
    add("hinge", hinge, None);
    add("slider", JointMotion::Slider { axis: DVec3::X, range: Range::UNLIMITED }, None);
    add("fixed", JointMotion::Fixed, None);
    add("follower", hinge, Some(Mimic { leader: JointId::from_index(3), multiplier: 2.0, offset: 0.0 }));
    builder.build().unwrap()
}

#[test]
fn every_kind_of_joint_has_its_word() {
    let rig = zoo();
    let mut pose = rig.rest_pose();
    let id = |name: &str| rig.joint(name).unwrap();
    pose.set_translation(id("free"), DVec3::new(0.5, 0.0, -0.0)).unwrap();
    pose.set_rotation(id("ball"), DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0)).unwrap();
    pose.set_euler(id("euler"), [0.25, -0.5, 7.0]).unwrap();
    pose.set_value(id("hinge"), 0.5).unwrap();
    pose.set_value(id("slider"), -2.0).unwrap();
    let expected = r#"{"joints":{"ball":{"rotation":[1.0,0.0,0.0,0.0]},"euler":{"euler":[0.25,-0.5,7.0]},"free":{"free":{"translation":[0.5,0.0,-0.0],"rotation":[0.0,0.0,0.0,1.0]}},"hinge":{"angle":0.5},"slider":{"offset":-2.0}}}"#;
    assert_eq!(serde_json::to_string(&pose).unwrap(), expected);
    let clip = Clip::still(pose);
    let expected = format!(r#"{{"name":"still","times":[0.0],"poses":[{expected}]}}"#);
    assert_eq!(serde_json::to_string(&clip).unwrap(), expected);
}

#[test]
fn what_does_not_fit_is_refused() {
    let rig = zoo();
    let good = PoseData::from(&rig.rest_pose());
    let refused = |change: &dyn Fn(&mut PoseData)| {
        let mut data = good.clone();
        change(&mut data);
        data.pose(&rig).unwrap_err()
    };
    let put = |name: &'static str, joint: JointData| {
        refused(&move |data| {
            data.joints.insert(name.to_owned(), joint);
        })
    };
    for (error, message) in [
        (
            put("hing", JointData::Angle(0.0)),
            "the rig has no such joint: there is no 'hing'; did you mean 'hinge'",
        ),
        // Only a joint's own name counts.
        (
            put("hinge link", JointData::Angle(0.0)),
            "the rig has no such joint: there is no 'hinge link'; did you mean 'hinge'?",
        ),
        (put("hinge", JointData::Offset(0.0)), "joint 'hinge' has an offset: expected an angle"),
        (put("ball", JointData::Euler([0.0; 3])), "joint 'ball' has Euler angles: expected a rotation"),
        (
            put("fixed", JointData::Rotation([0.0, 0.0, 0.0, 1.0])),
            "joint 'fixed' has a rotation: expected nothing, since it does not move by itself",
        ),
        (
            put("follower", JointData::Angle(0.0)),
            "joint 'follower' has an angle: expected nothing, since it does not move by itself",
        ),
        (
            put("hinge", JointData::Angle(f64::NAN)),
            "joint 'hinge': expected finite numbers, a rotation of length 1",
        ),
        (put("euler", JointData::Euler([0.0, f64::INFINITY, 0.0])), "joint 'euler': expected finite numbers"),
        (
            put("ball", JointData::Rotation([0.0; 4])),
            "joint 'ball': expected finite numbers, a rotation of length 1",
        ),
        (
            put("free", JointData::Free { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.1] }),
            "joint 'free': expected finite numbers, a rotation of length 1",
        ),
        (
            refused(&|data| {
                data.joints.remove("slider");
            }),
            "joint 'slider' is missing: expected an offset",
        ),
    ] {
        assert!(error.to_string().starts_with(message), "{error}\n{message}");
    }
    assert!(serde_json::from_str::<PoseData>(r#"{"joints":{},"joint":{}}"#).is_err());
    assert!(serde_json::from_str::<PoseData>(r#"{"joints":{"hinge":{"degrees":1.0}}}"#).is_err());
}

#[test]
fn a_clip_says_which_pose_does_not_fit() {
    let rig = zoo();
    let mut data = ClipData::from(&Clip::still(rig.rest_pose()));
    data.times.push(0.0);
    assert_eq!(data.clip(&rig), Err(DataError::Clip(ClipError::Count { times: 2, poses: 1 })));
    data.poses.push(PoseData::default());
    let error = data.clip(&rig).unwrap_err().to_string();
    assert!(error.starts_with("pose 1: joint 'free' is missing"), "{error}");
    data.poses[1] = data.poses[0].clone();
    assert_eq!(data.clip(&rig), Err(DataError::Clip(ClipError::Time { idx: 1, secs: 0.0 })));
}
