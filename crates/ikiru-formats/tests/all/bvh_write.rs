//! Any rig is written as BVH such that its world frames come back.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::bvh::{Reference, assert_same_frames_to};
use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{BvhOptions, Loaded, read, read_bvh, write_bvh_clip, write_bvh_pose};
use ikiru_rig::{Clip, EulerOrder, Joint, Motion, Pose, Range, Rig, RigBuilder};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// The joints of a rig in the order in which a file has them.
fn depth_first(rig: &Rig) -> Vec<usize> {
    fn visit(rig: &Rig, idx: usize, out: &mut Vec<usize>) {
        out.push(idx);
        let is_child = |j: &Joint| j.parent.is_some_and(|p| p.index() == idx);
        rig.joints().iter().enumerate().filter(|(_, j)| is_child(j)).for_each(|(i, _)| visit(rig, i, out));
    }
    let mut out = Vec::new();
    rig.ids().filter(|j| rig.get(*j).unwrap().parent.is_none()).for_each(|j| visit(rig, j.index(), &mut out));
    out
}

/// Writes a clip of random poses; the rig's reader and the tests' own agree with the poses.
fn check(name: &str, loaded: &Loaded, random: &mut Random) -> String {
    let poses: Vec<Pose> = (0..6).map(|_| random_pose(&loaded.rig, random)).collect();
    let times: Vec<f64> = (0..6).map(|i| 2.0 + 0.04 * f64::from(i)).collect();
    let clip = Clip::new("random", times, poses.clone()).unwrap();
    let bytes = write_bvh_clip(loaded, &clip).unwrap();
    let text = String::from_utf8(bytes.clone()).unwrap();
    assert!(text.contains("Frames: 6\nFrame Time: 0.04"), "{name}");
    let order = depth_first(&loaded.rig);
    let tolerance = 1e-8 * loaded.rig.size();
    let again = read_bvh(&bytes, name, &BvhOptions::default()).unwrap();
    let sorted = |pose: &Pose| -> Vec<_> {
        let frames = pose.frames();
        order.iter().map(|idx| frames[*idx]).collect()
    };
    for (a, b) in poses.iter().zip(again.clips[0].poses()) {
        assert_same_frames_to(&sorted(a), &b.frames(), tolerance.max(1e-8));
    }
    // However offsets and positions are combined.
    for in_place in [false, true] {
        let reference = Reference::parse(&text, in_place);
        for (pose, frame) in poses.iter().zip(&reference.frames) {
            for (matrix, frame) in reference.world(frame).iter().zip(sorted(pose)) {
                let distance = matrix.w_axis.truncate().distance(frame.origin.value());
                assert!(distance < tolerance, "{name}: {distance}");
            }
        }
    }
    let one = write_bvh_pose(loaded, &poses[0]).unwrap();
    let again = read_bvh(&one, name, &BvhOptions::default()).unwrap();
    assert_same_frames_to(&sorted(&poses[0]), &again.clips[0].poses()[0].frames(), tolerance.max(1e-8));
    text
}

#[test]
fn characters_in_random_poses() {
    let mut random = Random::new(23);
    for (name, ..) in FILES {
        let loaded = read(path(name)).unwrap();
        check(name, &loaded, &mut random);
        let mut builder = loaded.rig.to_builder();
        builder.free_root().unwrap();
        let free = loaded.clone().with_rig(builder.build().unwrap()).unwrap();
        check(name, &free, &mut random);
    }
}

#[test]
fn random_rigs_with_every_kind_of_joint() {
    for seed in 0..60 {
        let rig = random_rig(1 + seed as usize, seed);
        check(&format!("rig {seed}"), &Loaded::from_rig(rig), &mut Random::new(seed));
    }
}

fn joint(name: &str, parent: Option<usize>, motion: Motion) -> Joint {
    let mut joint = Joint::new(name, parent.map(ikiru_rig::JointId::from_index));
    joint.rest_translation = DVec3::new(0.0, 0.5, 0.0);
    joint.motion = motion;
    joint
}

fn rig_of_all_kinds() -> Rig {
    let hinge = |axis| Motion::Hinge { axis, range: Range::UNLIMITED };
    let euler = Motion::Euler { order: EulerOrder::Yzx, ranges: [Range::UNLIMITED; 3] };
    let mut turned = joint("turned tip", Some(1), Motion::Fixed);
    turned.rest_rotation = DQuat::from_rotation_x(1.0);
    let joints = [
        joint("root node", None, Motion::Fixed),
        joint("ball", Some(0), Motion::BALL),
        joint("hinge", Some(1), hinge(DVec3::NEG_Y)),
        joint("other hinge", Some(2), hinge(DVec3::new(0.6, 0.8, 0.0))),
        joint("other_hinge", Some(3), euler),
        joint("tip", Some(4), Motion::Fixed),
        joint("slider", Some(1), Motion::Slider { axis: DVec3::Z, range: Range::UNLIMITED }),
        turned,
        joint("free{}", Some(0), Motion::FREE),
    ];
    let mut builder = RigBuilder::new();
    joints.into_iter().for_each(|j| _ = builder.add(j));
    builder.build().unwrap()
}

#[test]
fn channels_follow_the_joints() {
    let text = check("kinds", &Loaded::from_rig(rig_of_all_kinds()), &mut Random::new(29));
    let six = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation";
    let expected = [
        ("ROOT root_node", "OFFSET 0 0 0", six),
        ("JOINT ball", "OFFSET 0 0.5 0", "CHANNELS 3 Zrotation Xrotation Yrotation"),
        ("JOINT hinge", "OFFSET 0 0.5 0", "CHANNELS 1 Yrotation"),
        // The name must be one word, and another joint is called other_hinge.
        ("JOINT other_hinge", "OFFSET 0 0.5 0", "CHANNELS 3 Zrotation Xrotation Yrotation"),
        ("JOINT other_hinge_2", "OFFSET 0 0.5 0", "CHANNELS 3 Yrotation Zrotation Xrotation"),
        ("End Site", "OFFSET 0 0.5 0", "}"),
        ("JOINT slider", "OFFSET 0 0 0", six),
        ("JOINT turned_tip", "OFFSET 0 0.5 0", "CHANNELS 3 Zrotation Xrotation Yrotation"),
        ("JOINT free__", "OFFSET 0 0 0", six),
    ];
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let blocks: Vec<_> = lines.windows(4).filter(|w| w[1] == "{").map(|w| (w[0], w[2], w[3])).collect();
    assert_eq!(blocks, expected);
}

#[test]
fn hinges_that_a_pose_turns_about_other_axes_have_channels_in_the_order_of_their_angles() {
    for axis in DVec3::AXES {
        let rig = |motion| {
            let mut builder = RigBuilder::new();
            builder.add(joint("root", None, Motion::Fixed));
            builder.add(joint("hinge", Some(0), motion));
            builder.add(joint("end", Some(1), Motion::Fixed));
            builder.build().unwrap()
        };
        let loaded = Loaded::from_rig(rig(Motion::Hinge { axis, range: Range::UNLIMITED }));
        let mut pose = rig(Motion::BALL).rest_pose();
        let hinge = loaded.rig.joint("hinge").unwrap();
        pose.set_rotation(hinge, EulerOrder::Xyz.quaternion([0.3, -0.5, 0.7])).unwrap();
        let again =
            read_bvh(&write_bvh_pose(&loaded, &pose).unwrap(), "again", &BvhOptions::default()).unwrap();
        assert_same_frames_to(&pose.frames(), &again.clips[0].poses()[0].frames(), 1e-8);
    }
}

#[test]
fn angles_of_more_than_a_turn_stay() {
    let loaded = Loaded::from_rig(rig_of_all_kinds());
    let mut pose = loaded.rig.rest_pose();
    pose.set_value(loaded.rig.joint("hinge").unwrap(), -450f64.to_radians()).unwrap();
    pose.set_euler(loaded.rig.joint("other_hinge").unwrap(), [1.0, 720.0, -300.0].map(f64::to_radians))
        .unwrap();
    let text = String::from_utf8(write_bvh_pose(&loaded, &pose).unwrap()).unwrap();
    let frame = text.lines().last().unwrap();
    assert_eq!(
        frame,
        "0 0.5 0 0 0 0 0 0 0 450 0 0 0 720 -300 1 0 0.5 0 0 0 0 0 57.295779513 0 0 0.5 0 0 0 0"
    );
}

#[test]
fn near_gimbal_lock_frames_hold() {
    let loaded = Loaded::from_rig(rig_of_all_kinds());
    let ball = loaded.rig.joint("ball").unwrap();
    let mut random = Random::new(31);
    for exponent in 0..18 {
        let mut pose = loaded.rig.rest_pose();
        let middle = std::f64::consts::FRAC_PI_2 - 10f64.powi(-exponent) * random.between(0.5, 1.0);
        for sign in [1.0, -1.0] {
            let angles = [sign * middle, random.between(-3.0, 3.0), random.between(-3.0, 3.0)];
            pose.set_rotation(ball, EulerOrder::Zxy.quaternion(angles)).unwrap();
            let bytes = write_bvh_pose(&loaded, &pose).unwrap();
            let again = read_bvh(&bytes, "again", &BvhOptions::default()).unwrap();
            // Within 1e-9 rad of the lock, two of the angles are one.
            assert_same_frames_to(&pose.frames(), &again.clips[0].poses()[0].frames(), 4e-9);
        }
    }
}

#[test]
fn uneven_times_are_sampled() {
    let loaded = Loaded::from_rig(rig_of_all_kinds());
    let mut random = Random::new(37);
    let clip = |times: &[f64], random: &mut Random| {
        let poses = times.iter().map(|_| random_pose(&loaded.rig, random)).collect();
        Clip::new("", times.to_vec(), poses).unwrap()
    };
    let read = |clip: &Clip| {
        let bytes = write_bvh_clip(&loaded, clip).unwrap();
        read_bvh(&bytes, "again", &BvhOptions::default()).unwrap().clips.remove(0)
    };
    let uneven = clip(&[1.0, 1.5, 1.75, 2.0], &mut random);
    let again = read(&uneven);
    assert_eq!(again.times(), [0.0, 0.25, 0.5, 0.75, 1.0]);
    for time in [0.0, 0.25, 0.5, 0.75, 1.0] {
        assert_same_frames_to(&uneven.sample(1.0 + time).frames(), &again.sample(time).frames(), 1e-8);
    }
    // Two poses that almost coincide do not make a million frames.
    assert_eq!(read(&clip(&[0.0, 1e-9, 1.0], &mut random)).poses().len(), 21);
    // Times as single-precision numbers are even.
    let thirds: Vec<f64> = (0..50u8).map(|i| f64::from(f32::from(i) / 30.0)).collect();
    assert_eq!(read(&clip(&thirds, &mut random)).poses().len(), 50);
    assert_eq!(read(&clip(&[5.0], &mut random)).times(), [0.0]);
}

#[test]
fn small_and_large_units() {
    for size in [1e-9, 1e-3, 1e6, 1e30] {
        let mut builder = rig_of_all_kinds().to_builder();
        builder.joints_mut().iter_mut().for_each(|j| j.rest_translation *= size);
        let loaded = Loaded::from_rig(builder.build().unwrap());
        let pose = loaded.rig.rest_pose();
        let bytes = write_bvh_pose(&loaded, &pose).unwrap();
        let again = read_bvh(&bytes, "again", &BvhOptions::default()).unwrap();
        for (a, b) in pose.frames().iter().zip(again.clips[0].poses()[0].frames()) {
            assert!(a.origin.value().distance(b.origin.value()) < 1e-9 * size);
        }
    }
}

#[test]
fn other_rigs_and_invalid_poses_are_refused() {
    let loaded = Loaded::from_rig(rig_of_all_kinds());
    let other = random_rig(3, 1);
    let message = write_bvh_pose(&loaded, &other.rest_pose()).unwrap_err().to_string();
    assert_eq!(message, "rig: the pose does not fit the file: it has 3 joints, the file 9");
    let mut pose = loaded.rig.rest_pose();
    pose.coords_mut()[0] = f64::NAN;
    let message = write_bvh_pose(&loaded, &pose).unwrap_err().to_string();
    assert!(message.contains("the pose has numbers that are not finite"), "{message}");
}
