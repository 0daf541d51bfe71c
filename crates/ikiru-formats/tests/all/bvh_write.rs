//! Any rig is written as BVH such that its world frames come back.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::bvh::{Reference, assert_same_frames_to, assert_strict};
use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{
    BvhOptions, Format, Loaded, Warning, Written, read, read_bvh, write_bvh_clip, write_bvh_pose, write_clip,
    write_pose,
};
use ikiru_rig::{Clip, EulerOrder, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// The joints of a rig that are in a file, with their places in it.
fn written_joints(loaded: &Loaded, written: &Written) -> Vec<(JointId, usize)> {
    let reference = Reference::parse(std::str::from_utf8(&written.bytes).unwrap(), false);
    let name = |joint: &Joint| {
        let renamed = written.warnings.iter().find_map(|warning| match warning {
            Warning::NameWritten { joint: own, written } if *own == joint.name => Some(written.clone()),
            _ => None,
        });
        renamed.unwrap_or_else(|| joint.name.clone())
    };
    let at = |joint: &Joint| reference.joints.iter().position(|found| found.name == name(joint));
    loaded.rig.ids().zip(loaded.rig.joints()).filter_map(|(id, joint)| Some((id, at(joint)?))).collect()
}

/// Asserts that what was written of a rig in a pose is where it is in a pose of what was read.
fn assert_same(pairs: &[(JointId, usize)], a: &Pose, b: &Pose, tolerance: f64) {
    let (a, b) = (a.frames(), b.frames());
    let (a, b): (Vec<_>, Vec<_>) = pairs.iter().map(|(id, at)| (a[id.index()], b[*at])).unzip();
    assert_same_frames_to(&a, &b, tolerance);
}

/// Writes a clip of random poses: strict readers take it, the rig's reader and the tests' own agree with the poses.
fn check(name: &str, loaded: &Loaded, random: &mut Random) -> String {
    let poses: Vec<Pose> = (0..6).map(|_| random_pose(&loaded.rig, random)).collect();
    let times: Vec<f64> = (0..6).map(|i| 2.0 + 0.04 * f64::from(i)).collect();
    let clip = Clip::new("random", times, poses.clone()).unwrap();
    let written = write_clip(loaded, &clip, Format::Bvh).unwrap();
    let pairs = written_joints(loaded, &written);
    let bytes = written.bytes;
    let text = String::from_utf8(bytes.clone()).unwrap();
    assert_strict(&text);
    assert!(text.contains("Frames: 6\nFrame Time: 0.04"), "{name}");
    let tolerance = 1e-8 * loaded.rig.size();
    let again = read_bvh(&bytes, name, &BvhOptions::default()).unwrap();
    for (id, joint) in
        loaded.rig.ids().zip(loaded.rig.joints()).filter(|(_, j)| j.motion != JointMotion::Fixed)
    {
        assert!(pairs.iter().any(|(written, _)| *written == id), "{name}: {} moves", joint.name);
    }
    for (a, b) in poses.iter().zip(again.clips[0].poses()) {
        assert_same(&pairs, a, b, tolerance.max(1e-8));
    }
    // However offsets and positions are combined.
    for in_place in [false, true] {
        let reference = Reference::parse(&text, in_place);
        for (pose, frame) in poses.iter().zip(&reference.frames) {
            let (world, frames) = (reference.world(frame), pose.frames());
            for (id, at) in &pairs {
                let distance = world[*at].w_axis.truncate().distance(frames[id.index()].position);
                assert!(distance < tolerance, "{name}: {distance}");
            }
        }
    }
    let one = write_bvh_pose(loaded, &poses[0]).unwrap();
    let again = read_bvh(&one, name, &BvhOptions::default()).unwrap();
    assert_same(&pairs, &poses[0], &again.clips[0].poses()[0], tolerance.max(1e-8));
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

fn joint(name: &str, parent: Option<usize>, motion: JointMotion) -> Joint {
    let mut joint = Joint::new(name, parent.map(JointId::from_index));
    joint.rest_translation = DVec3::new(0.0, 0.5, 0.0);
    joint.motion = motion;
    joint
}

fn rig_of_all_kinds() -> Rig {
    let hinge = |axis| JointMotion::Hinge { axis, range: Range::UNLIMITED };
    let euler = JointMotion::Euler { order: EulerOrder::Yzx, ranges: [Range::UNLIMITED; 3] };
    let mut turned = joint("turned tip", Some(1), JointMotion::Fixed);
    turned.rest_rotation = DQuat::from_rotation_x(1.0);
    let joints = [
        joint("root node", None, JointMotion::Fixed),
        joint("ball", Some(0), JointMotion::BALL),
        joint("hinge", Some(1), hinge(DVec3::NEG_Y)),
        joint("other hinge", Some(2), hinge(DVec3::new(0.6, 0.8, 0.0))),
        joint("other_hinge", Some(3), euler),
        joint("tip", Some(4), JointMotion::Fixed),
        joint("slider", Some(1), JointMotion::Slider { axis: DVec3::Z, range: Range::UNLIMITED }),
        turned,
        joint("free{}", Some(0), JointMotion::FREE),
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
        ("JOINT other_hinge_2", "OFFSET 0 0.5 0", "CHANNELS 3 Zrotation Xrotation Yrotation"),
        ("JOINT other_hinge", "OFFSET 0 0.5 0", "CHANNELS 3 Yrotation Zrotation Xrotation"),
        ("End Site", "OFFSET 0 0.5 0", "}"),
        ("JOINT slider", "OFFSET 0 0 0", six),
        ("End Site", "OFFSET 0 0.5 0", "}"),
        ("JOINT turned_tip", "OFFSET 0 0.5 0", "CHANNELS 3 Zrotation Xrotation Yrotation"),
        // On along the bone, in the tip's own axes.
        ("End Site", "OFFSET 0 0.270151152934 -0.420735492404", "}"),
        ("JOINT free__", "OFFSET 0 0 0", six),
        ("End Site", "OFFSET 0 0.5 0", "}"),
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
            builder.add(joint("root", None, JointMotion::Fixed));
            builder.add(joint("hinge", Some(0), motion));
            builder.add(joint("end", Some(1), JointMotion::Fixed));
            builder.build().unwrap()
        };
        let loaded = Loaded::from_rig(rig(JointMotion::Hinge { axis, range: Range::UNLIMITED }));
        let mut pose = rig(JointMotion::BALL).rest_pose();
        let hinge = loaded.rig.joint("hinge").unwrap();
        pose.set_rotation(hinge, EulerOrder::Xyz.quaternion([0.3, -0.5, 0.7])).unwrap();
        let written = write_pose(&loaded, &pose, Format::Bvh).unwrap();
        let again = read_bvh(&written.bytes, "again", &BvhOptions::default()).unwrap();
        let pairs = written_joints(&loaded, &written);
        assert_eq!(pairs.len(), 2);
        assert_same(&pairs, &pose, &again.clips[0].poses()[0], 1e-8);
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
            let written = write_pose(&loaded, &pose, Format::Bvh).unwrap();
            let again = read_bvh(&written.bytes, "again", &BvhOptions::default()).unwrap();
            // Within 1e-9 rad of the lock, two of the angles are one.
            assert_same(&written_joints(&loaded, &written), &pose, &again.clips[0].poses()[0], 4e-9);
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
    let pairs = written_joints(&loaded, &write_clip(&loaded, &uneven, Format::Bvh).unwrap());
    assert_eq!(again.times(), [0.0, 0.25, 0.5, 0.75, 1.0]);
    for time in [0.0, 0.25, 0.5, 0.75, 1.0] {
        assert_same(&pairs, &uneven.sample(1.0 + time), &again.sample(time), 1e-8);
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
        let written = write_pose(&loaded, &pose, Format::Bvh).unwrap();
        let again = read_bvh(&written.bytes, "again", &BvhOptions::default()).unwrap();
        let (before, after) = (pose.frames(), again.clips[0].poses()[0].frames());
        let pairs = written_joints(&loaded, &written);
        assert_eq!(pairs.len(), 8, "all but the end site");
        for (id, at) in pairs {
            assert!(before[id.index()].position.distance(after[at].position) < 1e-9 * size);
        }
    }
}

#[test]
fn other_rigs_and_invalid_poses_are_refused() {
    let loaded = Loaded::from_rig(rig_of_all_kinds());
    let other = random_rig(3, 1);
    let message = write_bvh_pose(&loaded, &other.rest_pose()).unwrap_err().to_string();
    assert_eq!(message, "rig: the pose does not fit the file: it has 3 joints, expected 9");
    let mut pose = loaded.rig.rest_pose();
    pose.coords_mut()[0] = f64::NAN;
    let message = write_bvh_pose(&loaded, &pose).unwrap_err().to_string();
    assert!(message.contains("the pose has numbers that are not finite"), "{message}");
}
