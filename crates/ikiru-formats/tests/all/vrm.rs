//! VRM, old and new: a 0.x file is the same character turned round, and what is written is of its own version.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{Loaded, Warning, read, read_glb, write_animated_glb, write_posed_glb};
use ikiru_rig::{Clip, Role};
use ikiru_testkit::rigs::{Random, random_pose};
use serde_json::json;

fn both() -> [Loaded; 2] {
    ["mh_male_vrm0.vrm", "mh_male_vrm1.vrm"].map(|name| read(data(name)).unwrap())
}

#[test]
fn an_old_file_is_the_same_character_in_the_same_world() {
    let [old, new] = both();
    assert_eq!(old.warnings, []);
    assert_eq!(new.world_from_file(), DQuat::IDENTITY);
    let turn = old.world_from_file();
    assert!((turn * DVec3::Z).distance(DVec3::NEG_Z) < 1e-15);
    let (a, b) = (old.rig.rest_pose(), new.rig.rest_pose());
    for role in Role::ALL {
        assert_eq!(old.rig.role(role), new.rig.role(role), "{role}");
    }
    for (joint, id) in old.rig.joints().iter().zip(old.rig.ids()) {
        let (a, b) = (a.frame(id).unwrap(), b.frame(id).unwrap());
        assert!(a.position.distance(b.position) < 1e-9, "{}", joint.name);
        // The axes of the joints as well, so that whatever is said in them means the same.
        assert!(a.rotation.angle_between(b.rotation) < 1e-6, "{}", joint.name);
    }
    let toes = |role| old.rig.rest_pose().frame(old.rig.role(role).unwrap()).unwrap().position;
    assert!(toes(Role::LeftToes).z > toes(Role::LeftFoot).z + 0.05, "it faces +z");
    assert!(toes(Role::LeftToes).x > 0.0, "the left is at +x");
}

#[test]
fn an_old_file_is_written_in_its_own_world() {
    let old = read(data("mh_male_vrm0.vrm")).unwrap();
    let mut random = Random::new(5);
    for _ in 0..20 {
        let pose = random_pose(&old.rig, &mut random);
        let written = write_posed_glb(&old, &pose).unwrap();
        let (document, _) = open(&written);
        for (frame, (name, matrix)) in pose.frames().iter().zip(matrices(&document)) {
            let in_file = old.world_from_file().inverse() * frame.position;
            assert!(in_file.distance(matrix.w_axis.truncate()) < 1e-6, "{name}");
        }
        let again = read_glb(&written, "again.vrm").unwrap();
        assert_eq!(again.world_from_file(), old.world_from_file());
        assert_same_frames("again", &old.rig, &pose.frames(), &again.rig.rest_pose().frames());
    }
}

#[test]
fn a_root_that_moves_is_turned_back_and_a_clip_comes_back() {
    let old = read(data("mh_male_vrm0.vrm")).unwrap();
    let mut builder = old.rig.to_builder();
    let root = ikiru_rig::JointId::from_index(0);
    // The very root of the file, where the turn is; the body stands apart from it.
    builder.joints_mut()[0].motion = ikiru_rig::JointMotion::FREE;
    let old = old.with_rig(builder.build().unwrap()).unwrap();
    let mut pose = old.rig.rest_pose();
    let rest = pose.frame(root).unwrap().position;
    pose.set_translation(root, DVec3::new(0.1, 0.2, 0.3)).unwrap();
    pose.set_rotation(root, DQuat::from_rotation_y(0.4)).unwrap();
    let moved = pose.frame(root).unwrap().position - rest;
    let (document, _) = open(&write_posed_glb(&old, &pose).unwrap());
    let (_, matrix) = &matrices(&document)[0];
    let in_file = matrix.w_axis.truncate() - old.world_from_file().inverse() * rest;
    assert!((old.world_from_file() * in_file).distance(moved) < 1e-9);

    let old = read(data("mh_male_vrm0.vrm")).unwrap();
    let mut random = Random::new(6);
    let poses: Vec<_> = (0..3).map(|_| random_pose(&old.rig, &mut random)).collect();
    let clip = Clip::new("random", vec![0.0, 0.5, 1.0], poses).unwrap();
    let again = read_glb(&write_animated_glb(&old, &clip).unwrap(), "again.vrm").unwrap();
    assert_eq!(again.warnings, []);
    for (a, b) in clip.poses().iter().zip(again.clips[0].poses()) {
        assert_same_frames("clip", &old.rig, &a.frames(), &b.frames());
    }
}

#[test]
fn thumbs_of_old_files_have_moved_up_by_one_and_missing_bones_are_below_0() {
    let mut document = leg();
    let bones = json!([
        { "bone": "leftThumbProximal", "node": 0 }, { "bone": "leftThumbIntermediate", "node": 1 },
        { "bone": "leftThumbDistal", "node": 2 }, { "bone": "jaw", "node": -1 }
    ]);
    document["extensions"] = json!({ "VRM": { "humanoid": { "humanBones": bones } } });
    let loaded = read_glb(&glb(&document, None), "old.vrm").unwrap();
    assert_eq!(loaded.warnings, []);
    let roles: Vec<Option<Role>> = loaded.rig.joints().iter().map(|j| j.role).collect();
    let thumb = [Role::LeftThumbMetacarpal, Role::LeftThumbProximal, Role::LeftThumbDistal];
    assert_eq!(roles, thumb.map(Some));
    assert!((loaded.world_from_file() * DVec3::X).distance(DVec3::NEG_X) < 1e-15);
}

#[test]
fn bones_that_cannot_be_read_leave_the_names() {
    let (mut document, bin) = open(&std::fs::read(data("mh_male_vrm0.vrm")).unwrap());
    document["extensions"]["VRM"]["humanoid"]["humanBones"] = json!("none");
    let loaded = read_glb(&glb(&document, bin.as_deref()), "old.vrm").unwrap();
    let [Warning::HumanoidMap { reason }] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(reason.starts_with("/extensions/VRM/humanoid/humanBones: "), "{reason}");
    assert_eq!(
        loaded.rig.role(Role::LeftHand),
        read(data("mh_male_vrm1.vrm")).unwrap().rig.role(Role::LeftHand)
    );
}

#[test]
fn what_vrm_adds_beside_the_bones_is_kept() {
    let mut document = leg();
    document["nodes"][1]["extensions"] = json!({ "VRMC_node_constraint": {
        "specVersion": "1.0", "constraint": { "roll": { "source": 0, "rollAxis": "X", "weight": 0.5 } } } });
    document["extensionsUsed"] = json!(["VRMC_vrm", "VRMC_springBone", "VRMC_node_constraint"]);
    document["extensions"] = json!({
        "VRMC_vrm": {
            "specVersion": "1.0",
            "humanoid": { "humanBones": { "hips": { "node": 0 } } },
            "lookAt": { "type": "bone", "offsetFromHeadBone": [0, 0.06, 0.01] },
            "expressions": { "preset": { "happy": { "isBinary": false, "overrideBlink": "none" } } },
            "firstPerson": { "meshAnnotations": [] }
        },
        "VRMC_springBone": {
            "specVersion": "1.0", "colliders": [],
            "springs": [{ "name": "tail", "joints": [{ "node": 2, "hitRadius": 0.02, "stiffness": 1.0 }] }]
        }
    });
    let loaded = read_glb(&glb(&document, None), "kept.vrm").unwrap();
    let mut pose = loaded.rig.rest_pose();
    for joint in [0, 1] {
        pose.set_rotation(ikiru_rig::JointId::from_index(joint), DQuat::from_rotation_z(0.7)).unwrap();
    }
    let clip = Clip::new("still", vec![0.0, 1.0], vec![pose.clone(), pose.clone()]).unwrap();
    for written in [write_posed_glb(&loaded, &pose).unwrap(), write_animated_glb(&loaded, &clip).unwrap()] {
        let (after, _) = open(&written);
        for member in ["extensions", "extensionsUsed"] {
            assert_eq!(after[member], document[member]);
        }
        assert_eq!(after["nodes"][1]["extensions"], document["nodes"][1]["extensions"]);
    }
    let (mut after, _) = open(&write_posed_glb(&loaded, &pose).unwrap());
    assert_ne!(after["nodes"][1]["rotation"], document["nodes"][1]["rotation"]);
    after["nodes"][1]["rotation"] = document["nodes"][1]["rotation"].clone();
    after["nodes"][0].as_object_mut().unwrap().shift_remove("rotation");
    assert_eq!(after, document);
}
