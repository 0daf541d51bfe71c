//! An avatar stays an avatar, a text file stands alone, and what stands between two bones is not lost.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use std::path::Path;

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{
    Format, Loaded, Warning, motion_csv, motion_json, motion_rig, read, read_glb, read_gltf, read_motion,
    read_vrma, save, write_clip, write_pose,
};
use ikiru_rig::{Clip, EulerOrder, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder, Role};
use ikiru_testkit::rigs::{Random, random_pose};
use serde_json::{Value, json};

fn clip_of(rig: &Rig) -> Clip {
    let mut random = Random::new(77);
    let poses = (0..3).map(|_| random_pose(rig, &mut random)).collect();
    Clip::new("dance", vec![0.0, 0.5, 1.0], poses).unwrap()
}

#[test]
fn a_vrm_avatar_is_written_as_one() {
    for (name, extension) in [("mh_male_vrm0.vrm", "VRM"), ("mh_male_vrm1.vrm", "VRMC_vrm")] {
        let loaded = read(data(name)).unwrap();
        let before: Value = serde_json::from_str(loaded.source().unwrap().json()).unwrap();
        let clip = clip_of(&loaded.rig);
        for written in
            [write_pose(&loaded, &clip.poses()[1], Format::Vrm), write_clip(&loaded, &clip, Format::Vrm)]
        {
            let written = written.unwrap();
            let document = open(&written.bytes).0;
            assert_eq!(document["extensions"][extension], before["extensions"][extension], "{name}");
            assert_eq!(document["extensionsUsed"], before["extensionsUsed"]);
            let again = read_glb(&written.bytes, "again.vrm").unwrap();
            let roles = |rig: &Rig| -> Vec<_> { rig.joints().iter().map(|joint| joint.role).collect() };
            assert_eq!(roles(&again.rig), roles(&loaded.rig));
        }
        let again = read_glb(&write_clip(&loaded, &clip, Format::Vrm).unwrap().bytes, "again.vrm").unwrap();
        assert_eq!(again.clips[0].name(), "dance");
        assert_same_frames(name, &loaded.rig, &clip.poses()[2].frames(), &again.clips[0].poses()[2].frames());
    }
    let loaded = read(data("mh_female_mixamo.glb")).unwrap();
    let error = write_pose(&loaded, &loaded.rig.rest_pose(), Format::Vrm).unwrap_err().to_string();
    assert!(error.contains("no VRM extension") && error.contains("mh_female_mixamo.glb"), "{error}");
}

#[test]
fn a_text_file_holds_everything() {
    for name in ["builtin:human", "mh_female_mixamo.glb", "webxr_generic_hand_left.glb"] {
        let loaded = read(path(name)).unwrap();
        let clip = clip_of(&loaded.rig);
        let text = write_clip(&loaded, &clip, Format::Gltf).unwrap().bytes;
        let document: Value = serde_json::from_slice(&text).unwrap();
        assert!(document["buffers"][0]["uri"].as_str().unwrap().starts_with("data:"));
        let again = read_gltf(&text, None, "again.gltf").unwrap();
        let binary = read_glb(&write_clip(&loaded, &clip, Format::Glb).unwrap().bytes, "again.glb").unwrap();
        assert_eq!(again.warnings, binary.warnings);
        for (a, b) in again.clips[0].poses().iter().zip(binary.clips[0].poses()) {
            assert_eq!(a.coords(), b.coords(), "{name}");
        }
    }
}

#[test]
fn endings_name_their_format() {
    for (format, ending) in Format::ALL {
        assert_eq!(Format::of(Path::new(&format!("a.b/c.{}", ending.to_uppercase()))), Some(format));
    }
    assert_eq!(Format::of(Path::new("vrm")), None);
    assert_eq!(Format::of(Path::new("a.json")), None);
}

/// A human whose every arm has a joint without a role between forearm and hand, off the bone's line.
fn with_wrists() -> Loaded {
    let human = ikiru_formats::builtin("human").unwrap();
    let (arm, hand) = (human.rig.role(Role::LeftLowerArm).unwrap(), human.rig.role(Role::LeftHand).unwrap());
    let mut builder = RigBuilder::new();
    let mut wrist = None;
    for (id, joint) in human.rig.ids().zip(human.rig.joints()) {
        let mut joint = joint.clone();
        joint.parent = joint.parent.map(|parent| {
            JointId::from_index(parent.index() + usize::from(wrist.is_some_and(|wrist| parent >= wrist)))
        });
        if id == hand {
            let mut between = Joint::new("wrist", Some(arm));
            between.rest_translation = joint.rest_translation * 0.6;
            between.motion = JointMotion::BALL;
            joint.rest_translation *= 0.4;
            wrist = Some(id);
            joint.parent = Some(builder.add(between));
        }
        builder.add(joint);
    }
    Loaded::from_rig(builder.build().unwrap())
}

#[test]
fn what_a_joint_without_a_role_does_is_in_the_bones_around_it() {
    let loaded = with_wrists();
    let rig = &loaded.rig;
    let wrist = rig.joint("wrist").unwrap();
    let bend = |degrees: f64| {
        let mut pose = random_pose(rig, &mut Random::new(9));
        pose.set_rotation(wrist, DQuat::from_rotation_z(degrees.to_radians())).unwrap();
        pose
    };
    let check = |pose: Pose, within: f64| -> Vec<Warning> {
        let clip = Clip::still(pose.clone()).with_name("bend");
        let written = write_clip(&loaded, &clip, Format::Vrma).unwrap();
        let again = read_vrma(&written.bytes, "again.vrma").unwrap();
        let found = &again.clips[0].poses()[0];
        for role in
            [Role::LeftUpperArm, Role::LeftLowerArm, Role::LeftHand, Role::LeftIndexDistal, Role::RightHand]
        {
            let at = |pose: &Pose| pose.frame(pose.rig().role(role).unwrap()).unwrap().position;
            let off = at(&pose).distance(at(found));
            assert!(off < within, "{role} is off by {off}");
        }
        written.warnings
    };
    // Still, and turned about the bone: nothing is lost.
    assert_eq!(check(bend(0.0), 1e-5), []);
    let along = rig.get(wrist).unwrap().rest_translation.normalize();
    let mut twisted = bend(0.0);
    twisted.set_rotation(wrist, DQuat::from_axis_angle(along, 1.0)).unwrap();
    assert_eq!(check(twisted, 1e-5), []);
    // A little: the hand is where it was, but for the bone that is a hair shorter.
    assert_eq!(check(bend(2.0), 1e-4), []);
    // Much: the bone is too long by what the corner saves, and that is told.
    let warnings = check(bend(60.0), 0.04);
    let [Warning::BoneOff { bone, metres }] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(bone.starts_with("left") && (0.01..0.04).contains(metres), "{bone} {metres}");
}

#[test]
fn a_motion_comes_back_onto_the_file_of_its_rig() {
    let human = ikiru_formats::builtin("human").unwrap();
    let mut builder = human.rig.to_builder();
    builder.free_root().unwrap();
    let elbow = human.rig.role(Role::LeftLowerArm).unwrap();
    let ranges = [Range::degrees(-10.0, 10.0), Range::degrees(-150.0, 5.0), Range::degrees(-30.0, 30.0)];
    builder.set_motion(elbow, JointMotion::Euler { order: EulerOrder::default(), ranges }).unwrap();
    let rig = builder.build().unwrap();
    let clip = clip_of(&rig);
    let joints: Vec<JointId> = rig.ids().collect();
    let mut document = motion_json(&clip, &joints);
    assert_eq!(motion_rig(document.to_string().as_bytes()), None);
    document["rig"] = json!("builtin:human");
    let text = document.to_string();
    assert_eq!(
        motion_rig(text.as_bytes()).map(|rig| (rig.name, rig.scale)),
        Some(("builtin:human".to_owned(), 1.0))
    );
    // Neither the root floats in the file nor is the elbow Euler.
    let again = read_motion(text.as_bytes(), "dance.json", human).unwrap();
    assert_eq!(again.clips.len(), 1);
    for (a, b) in clip.poses().iter().zip(again.clips[0].poses()) {
        assert_same_frames("human", &rig, &a.frames(), &b.frames());
        let degrees = |pose: &Pose| pose.euler(elbow).unwrap();
        assert!((0..3).all(|axis| (degrees(a)[axis] - degrees(b)[axis]).abs() < 1e-9));
    }
    // It has the file's body, to be written with.
    let written = write_clip(&again, &again.clips[0], Format::Vrm).unwrap();
    let moved = read_glb(&written.bytes, "dance.vrm").unwrap().carrying_clips().unwrap();
    for (a, b) in clip.poses().iter().zip(moved.clips[0].poses()) {
        assert_same_frames("human", &rig, &a.frames(), &b.frames());
    }
}

#[test]
fn an_angle_without_limits_goes_on_past_half_a_turn() {
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("j1", None);
    joint.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED };
    let id = builder.add(joint);
    let rig = builder.build().unwrap();
    let poses = [170.0, 180.0, -170.0, -160.0].map(|degrees: f64| {
        let mut pose = rig.rest_pose();
        pose.set_value(id, degrees.to_radians()).unwrap();
        pose
    });
    let clip = Clip::new("turn", vec![0.0, 1.0, 2.0, 3.0], poses.to_vec()).unwrap();
    let expected = [170.0, 180.0, 190.0, 200.0];
    let document = motion_json(&clip, &[id]);
    let angles: Vec<f64> = serde_json::from_value(document["angles"]["j1"]["angle_deg"].clone()).unwrap();
    let table = motion_csv(&clip, &[id]).unwrap();
    let mut rows = csv::Reader::from_reader(table.as_slice());
    let at = rows.headers().unwrap().iter().position(|name| name == "j1.angle_deg").unwrap();
    let column: Vec<f64> = rows.records().map(|row| row.unwrap()[at].parse().unwrap()).collect();
    for found in [angles, column] {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_link_is_written_through_be_its_file_there_or_not() {
    use std::os::unix::fs::symlink;
    let folder = std::env::temp_dir().join(format!("ikiru-formats-links-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("there")).unwrap();
    let is_link = |name: &str| folder.join(name).symlink_metadata().unwrap().file_type().is_symlink();
    symlink("there/file", folder.join("link")).unwrap();
    symlink("link", folder.join("link to a link")).unwrap();
    for bytes in [b"one", b"two"] {
        save(folder.join("link to a link"), bytes).unwrap();
        assert_eq!(std::fs::read(folder.join("there/file")).unwrap(), bytes);
        assert!(is_link("link") && is_link("link to a link"));
    }
    assert_eq!(std::fs::read_dir(folder.join("there")).unwrap().count(), 1);
    std::fs::remove_dir_all(&folder).unwrap();
}
