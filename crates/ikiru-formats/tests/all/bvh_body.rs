//! A body as BVH is what the strictest readers take, and what is put between its frames goes the short way.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::bvh::{Reference, assert_strict};
use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{
    BvhOptions, Format, Loaded, Warning, read, read_bvh, read_glb, write_bvh_clip, write_bvh_pose,
    write_clip, write_pose,
};
use ikiru_rig::humanoid::{Reference as Stance, transfer};
use ikiru_rig::{Clip, EulerOrder, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};
use serde_json::{Value, json};

fn text_of(loaded: &Loaded, pose: &Pose) -> String {
    String::from_utf8(write_bvh_pose(loaded, pose).unwrap()).unwrap()
}

/// Names of a text's joints, end sites among them as empty ones.
fn names(text: &str) -> Vec<String> {
    Reference::parse(text, false).joints.into_iter().map(|joint| joint.name).collect()
}

#[test]
fn a_skinned_avatar_is_one_root_without_its_meshes() {
    for (name, n_joints, n_turning) in FILES {
        let loaded = read(path(name)).unwrap();
        let text = text_of(&loaded, &loaded.rig.rest_pose());
        assert_strict(&text);
        let named = names(&text).into_iter().filter(|name| !name.is_empty()).count();
        assert!((n_turning..=n_joints).contains(&named), "{name}: {named} of {n_joints}");
        // Nodes that show a mesh, by the document itself.
        let document: Value = serde_json::from_str(loaded.source().unwrap().json()).unwrap();
        for node in document["nodes"].as_array().unwrap().iter().filter(|node| !node["mesh"].is_null()) {
            let mesh = node["name"].as_str().unwrap();
            assert!(!text.contains(&format!(" {mesh}\n")), "{name}: {mesh}");
        }
        // The root stands for all above it.
        let reference = Reference::parse(&text, false);
        let root = loaded.rig.joint(&reference.joints[0].name).unwrap();
        let at = reference.world(&reference.frames[0])[0].w_axis.truncate();
        assert!(at.distance(loaded.rig.rest_pose().frame(root).unwrap().position) < 1e-9, "{name}: {at}");
    }
}

#[test]
fn robots_and_rigs_of_all_kinds_are_strict_too() {
    for name in ["builtin:panda", "builtin:g1", "builtin:ur5", "builtin:xarm7"] {
        let loaded = read(name).unwrap();
        assert_strict(&text_of(&loaded, &loaded.rig.rest_pose()));
    }
    for seed in 0..60 {
        let loaded = Loaded::from_rig(random_rig(1 + seed as usize, 100 + seed));
        let pose = random_pose(&loaded.rig, &mut Random::new(seed));
        assert_strict(&text_of(&loaded, &pose));
    }
}

#[test]
fn an_arm_of_hinges_keeps_the_one_channel_of_each() {
    let loaded = read("builtin:panda").unwrap();
    let text = text_of(&loaded, &loaded.rig.rest_pose());
    let reference = Reference::parse(&text, false);
    assert_eq!(reference.joints[0].channels.len(), 6);
    let first = reference.joints.iter().find(|joint| joint.name == "panda_joint1").unwrap();
    assert_eq!(first.channels.len(), 1);
}

#[test]
fn several_topmost_joints_are_held_together_by_a_root_that_stays() {
    let mut document = leg();
    document["scenes"] = json!([{ "nodes": [3, 0, 4] }]);
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes.push(json!({ "name": "Mesh", "mesh": 0 }));
    nodes.push(json!({ "name": "root", "translation": [1.0, 0.0, 0.0] }));
    document["skins"] = json!([{ "joints": [0, 1, 4] }]);
    let loaded = read_glb(&glb(&document, None), "two.glb").unwrap();
    let pose = random_pose(&loaded.rig, &mut Random::new(3));
    let written = write_pose(&loaded, &pose, Format::Bvh).unwrap();
    let text = String::from_utf8(written.bytes).unwrap();
    assert_strict(&text);
    // "root" is a joint's name already.
    assert_eq!(names(&text), ["root_2", "hip", "knee", "", "root", ""]);
    let reference = Reference::parse(&text, false);
    assert!(reference.frames[0][..6].iter().all(|number| *number == 0.0));
    let world = reference.world(&reference.frames[0]);
    for (at, name) in [(1, "hip"), (2, "knee"), (4, "root")] {
        let frame = pose.frame(loaded.rig.joint(name).unwrap()).unwrap();
        assert!(world[at].w_axis.truncate().distance(frame.position) < 1e-9, "{name}");
    }
}

#[test]
fn names_that_are_no_single_word_are_told_with_what_they_became() {
    let mut builder = RigBuilder::new();
    for (name, parent) in
        [("Left elbow", None), ("Left_elbow", Some(0)), ("tip{}", Some(1)), ("plain", Some(2))]
    {
        let mut joint = Joint::new(name, parent.map(JointId::from_index));
        joint.motion = JointMotion::BALL;
        builder.add(joint);
    }
    let loaded = Loaded::from_rig(builder.build().unwrap());
    let written = write_pose(&loaded, &loaded.rig.rest_pose(), Format::Bvh).unwrap();
    assert_eq!(
        names(std::str::from_utf8(&written.bytes).unwrap()),
        ["Left_elbow_2", "Left_elbow", "tip__", "plain", ""]
    );
    let told =
        |joint: &str, written: &str| Warning::NameWritten { joint: joint.into(), written: written.into() };
    assert_eq!(written.warnings, [told("Left elbow", "Left_elbow_2"), told("tip{}", "tip__")]);
    assert!(written.warnings[0].to_string().contains("'Left elbow' is called 'Left_elbow_2'"));
}

/// How many angles of a text change by more than some degrees from one frame to the next.
fn n_jumps(text: &str, degrees: f64) -> usize {
    let reference = Reference::parse(text, false);
    let angles =
        reference.joints.iter().flat_map(|joint| &joint.channels).filter(|(_, name)| name.contains("rot"));
    let angles: Vec<usize> = angles.map(|(at, _)| *at).collect();
    let jumps = |pair: &[Vec<f64>]| {
        angles.iter().filter(|at| (pair[1][**at] - pair[0][**at]).abs() > degrees).count()
    };
    reference.frames.windows(2).map(jumps).sum()
}

#[test]
fn angles_go_on_from_frame_to_frame() {
    let source = read(data("mocap/cmu_01_01_30fps.bvh")).unwrap();
    let target = read("builtin:human").unwrap();
    let clip = transfer(&source.clips[0], &target.rig, Stance::TPose).unwrap().clip;
    let bytes = write_bvh_clip(&target, &clip).unwrap();
    let text = std::str::from_utf8(&bytes).unwrap();
    assert!(n_jumps(text, 90.0) <= 23, "{}", n_jumps(text, 90.0));
    // And still are the same rotations.
    let again = read_bvh(&bytes, "again", &BvhOptions::default()).unwrap();
    for (a, b) in clip.poses().iter().zip(again.clips[0].poses()) {
        for (id, joint) in target.rig.ids().zip(target.rig.joints()) {
            let Ok(other) = again.rig.joint(&joint.name) else { continue };
            let (angle, distance) = apart(&a.frame(id).unwrap(), &b.frame(other).unwrap());
            assert!(angle < 1e-8 && distance < 1e-8, "{}", joint.name);
        }
    }
}

#[test]
fn a_joint_that_turns_and_turns_has_angles_that_grow() {
    let rig = |motion: JointMotion| -> Rig {
        let mut builder = RigBuilder::new();
        builder.add(Joint::new("base", None));
        let mut wheel = Joint::new("wheel", Some(JointId::from_index(0)));
        wheel.rest_translation = DVec3::Y;
        wheel.motion = motion;
        builder.add(wheel);
        builder.build().unwrap()
    };
    let euler = JointMotion::Euler { order: EulerOrder::Zxy, ranges: [Range::UNLIMITED; 3] };
    let hinge = JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED };
    for motion in [JointMotion::BALL, JointMotion::FREE, euler, hinge] {
        let rig = rig(motion);
        let wheel = rig.joint("wheel").unwrap();
        let poses = (0..40).map(|idx| {
            let mut pose = rig.rest_pose();
            // Within a turn, as most programs have them.
            let angle = (f64::from(idx) * 0.5 + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
                - std::f64::consts::PI;
            match motion {
                JointMotion::Euler { .. } => pose.set_euler(wheel, [0.0, 0.0, angle]),
                JointMotion::Hinge { .. } => pose.set_value(wheel, angle),
                _ => pose.set_rotation(wheel, DQuat::from_rotation_z(angle)),
            }
            .unwrap();
            pose
        });
        let times = (0..40).map(|idx| f64::from(idx) * 0.1).collect();
        let clip = Clip::new("wheel", times, poses.collect()).unwrap();
        let written = write_clip(&Loaded::from_rig(rig), &clip, Format::Bvh).unwrap();
        let reference = Reference::parse(std::str::from_utf8(&written.bytes).unwrap(), false);
        let wheel = reference.joints.iter().find(|joint| joint.name == "wheel").unwrap();
        let at = wheel.channels.iter().find(|(_, name)| name == "Zrotation").unwrap().0;
        for (idx, frame) in reference.frames.iter().enumerate() {
            assert!(
                (frame[at] - (idx as f64 * 0.5).to_degrees()).abs() < 1e-6,
                "{}: {}",
                motion.name(),
                frame[at]
            );
        }
    }
}
