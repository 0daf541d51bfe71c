//! VRM animations: what is written comes back, fits every avatar, and is what the format asks for.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{ErrorKind, Warning, read, read_glb, read_vrma, write_animated_glb, write_vrma};
use ikiru_rig::humanoid::{Reference, t_pose, transfer};
use ikiru_rig::{Clip, JointMotion, Pose, Rig, Role};
use ikiru_testkit::rigs::{Random, random_pose};
use serde_json::{Value, json};

/// A rig with hips that translate.
fn free(name: &str) -> Rig {
    let rig = read(path(name)).unwrap().rig;
    let mut builder = rig.to_builder();
    builder.set_motion(rig.role(Role::Hips).unwrap(), JointMotion::FREE).unwrap();
    builder.build().unwrap()
}

fn random_clip(rig: &Rig) -> Clip {
    let mut random = Random::new(31);
    let poses = (0..4).map(|_| random_pose(rig, &mut random)).collect();
    Clip::new("random", vec![0.0, 0.25, 0.5, 1.0], poses).unwrap()
}

fn frame(pose: &Pose, role: Role) -> (DQuat, DVec3) {
    let frame = pose.frame(pose.rig().role(role).unwrap()).unwrap();
    (frame.rotation, frame.position)
}

/// Roles that a VRM animation can move and that the rig has.
fn roles(rig: &Rig) -> impl Iterator<Item = Role> {
    let eyes = [Role::LeftEye, Role::RightEye];
    Role::ALL.into_iter().filter(move |role| rig.role(*role).is_some() && !eyes.contains(role))
}

#[test]
fn a_clip_comes_back_through_a_file() {
    for name in ["mh_male_vrm1.vrm", "mh_male_vrm0.vrm", "mh_female_mixamo.glb", "builtin:reference"] {
        let rig = free(name);
        let clip = random_clip(&rig);
        let loaded = read_vrma(&write_vrma(&clip).unwrap(), "random.vrma").unwrap();
        assert_eq!(loaded.warnings, []);
        assert_eq!(loaded.clips.len(), 1);
        assert_eq!((loaded.clips[0].name(), loaded.clips[0].times()), (clip.name(), clip.times()));
        let again = transfer(&loaded.clips[0], &rig, Reference::TPose).unwrap().clip;
        for (a, b) in clip.poses().iter().zip(again.poses()) {
            for role in roles(&rig) {
                // Numbers in the file have 32 bits; joints without a role between two with one are still.
                let joint = rig.role(role).unwrap();
                let (angle, distance) = apart(&a.frame(joint).unwrap(), &b.frame(joint).unwrap());
                assert!(angle < 1e-5 && distance < 1e-5, "{name}: {role} {angle} {distance}");
            }
        }
    }
}

#[test]
fn the_files_skeleton_rests_in_t_pose_with_axes_along_the_worlds() {
    let clip = random_clip(&free("mh_female_default163.glb"));
    let bytes = write_vrma(&clip).unwrap();
    let rig = read_vrma(&bytes, "t.vrma").unwrap().rig;
    assert_eq!(rig.n_joints(), 53);
    for (id, joint) in rig.ids().zip(rig.joints()) {
        assert_eq!(joint.rest_rotation, DQuat::IDENTITY, "{}", joint.name);
        assert_eq!(joint.role.unwrap().name(), joint.name);
        let expected = if joint.role == Some(Role::Hips) { JointMotion::FREE } else { JointMotion::BALL };
        assert_eq!(joint.motion, expected);
        let above = joint.role.unwrap().ancestors().find_map(|role| rig.role(role));
        assert_eq!(joint.parent, above, "{}", joint.name);
        let turned = t_pose(&rig).rotation(id).unwrap();
        assert!(turned.w.abs() > 1.0 - 1e-12, "'{}' is in T-pose", joint.name);
    }
    let (document, _) = open(&bytes);
    let extension = &document["extensions"]["VRMC_vrm_animation"];
    assert_eq!(extension["specVersion"], "1.0");
    let bones = extension["humanoid"]["humanBones"].as_object().unwrap();
    assert!(Role::REQUIRED.iter().all(|role| bones.contains_key(role.name())));
    assert!(!bones.contains_key("leftEye"), "the gaze is no bone's");
    for channel in document["animations"][0]["channels"].as_array().unwrap() {
        let target = &channel["target"];
        let is_hips = target["node"] == bones["hips"]["node"];
        assert!(target["path"] == "rotation" || (is_hips && target["path"] == "translation"));
    }
    let times = &document["accessors"][0];
    assert_eq!((&times["min"], &times["max"]), (&json!([0.0]), &json!([1.0])));
}

#[test]
fn a_clip_written_from_one_character_moves_another_alike() {
    let (source, target) = (free("mh_female_mixamo.glb"), free("mh_male_vrm0.vrm"));
    let clip = random_clip(&source);
    let direct = transfer(&clip, &target, Reference::TPose).unwrap().clip;
    let file = read_vrma(&write_vrma(&clip).unwrap(), "clip.vrma").unwrap();
    let through = transfer(&file.clips[0], &target, Reference::TPose).unwrap().clip;
    for (a, b) in direct.poses().iter().zip(through.poses()) {
        for role in roles(&source) {
            assert!(frame(a, role).1.distance(frame(b, role).1) < 1e-5, "{role}");
        }
    }
}

/// A file of another maker: rest rotations other than the identity, hips below a scaled node, expressions.
fn foreign(interpolation: &str) -> Vec<u8> {
    let clip = random_clip(&free("mh_male_vrm1.vrm"));
    let (mut document, bin) = open(&write_vrma(&clip).unwrap());
    let n_nodes = document["nodes"].as_array().unwrap().len();
    let turn = DQuat::from_rotation_x(0.5);
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes[0]["translation"] = json!([0.0, 2.0, 0.0]);
    nodes[0]["rotation"] = json!(turn.to_array());
    nodes.push(json!({ "name": "armature", "scale": [0.5, 0.5, 0.5], "children": [0] }));
    nodes.push(json!({ "name": "happy" }));
    document["scenes"][0]["nodes"] = json!([n_nodes, n_nodes + 1]);
    document["extensions"]["VRMC_vrm_animation"]["expressions"] =
        json!({ "preset": { "happy": { "node": n_nodes + 1 } } });
    let mut bin = bin.unwrap();
    let mut floats = |kind: &str, width: usize, values: &[f32]| {
        let offset = bin.len();
        bin.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        let views = document["bufferViews"].as_array_mut().unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": 4 * values.len() }));
        let view = views.len() - 1;
        let accessors = document["accessors"].as_array_mut().unwrap();
        let count = values.len() / width;
        accessors.push(json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind }));
        accessors.len() - 1
    };
    let input = floats("SCALAR", 1, &[0.0, 2.0]);
    let keys = [[0.0, 2.0, 0.0], [0.0, 4.0, 0.0]];
    let output = match interpolation {
        // Tangents of zero: in, value, out of each key.
        "CUBICSPLINE" => {
            let values: Vec<f32> = keys.iter().flat_map(|k| [[0.0; 3], *k, [0.0; 3]].concat()).collect();
            floats("VEC3", 3, &values)
        }
        _ => floats("VEC3", 3, &keys.concat()),
    };
    document["buffers"][0]["byteLength"] = json!(bin.len());
    document["animations"] = json!([{
        "channels": [
            { "sampler": 0, "target": { "node": 0, "path": "translation" } },
            { "sampler": 1, "target": { "node": n_nodes + 1, "path": "translation" } }
        ],
        "samplers": [
            { "input": input, "output": output, "interpolation": interpolation },
            { "input": input, "output": output, "interpolation": interpolation }
        ]
    }]);
    glb(&document, Some(&bin))
}

#[test]
fn the_hips_move_in_the_world_whatever_lies_above_them() {
    for (interpolation, at_half) in [("LINEAR", 1.25), ("CUBICSPLINE", 1.15625), ("STEP", 1.0)] {
        let loaded = read_vrma(&foreign(interpolation), "foreign.vrma").unwrap();
        let [Warning::ChannelsIgnored { path, count: 1, first, .. }] = &loaded.warnings[..] else {
            panic!("{:?}", loaded.warnings);
        };
        assert_eq!((path.as_str(), first.as_str()), ("translation", "happy"));
        let clip = &loaded.clips[0];
        let height = |secs: f64| frame(&clip.sample(secs), Role::Hips).1;
        assert!(height(0.0).distance(DVec3::Y) < 1e-6);
        assert!(height(2.0).distance(2.0 * DVec3::Y) < 1e-6);
        let found = height(0.5);
        assert!(found.distance(at_half * DVec3::Y) < 1e-6, "{interpolation}: {found}");
        assert!(frame(&clip.sample(1.0), Role::Hips).0.angle_between(DQuat::from_rotation_x(0.5)) < 1e-6);
    }
}

#[test]
fn it_is_a_gltf_file_as_well_and_is_written_as_one() {
    let loaded = read_glb(&foreign("LINEAR"), "foreign.glb").unwrap();
    let written = write_animated_glb(&loaded, &loaded.clips[0]).unwrap();
    let again = read_vrma(&written, "again.vrma").unwrap();
    assert_eq!(again.clips.len(), 1, "it took the place of the one that it was read from");
    for (a, b) in loaded.clips[0].poses().iter().zip(again.clips[0].poses()) {
        assert_same_frames("again", &loaded.rig, &a.frames(), &b.frames());
    }
}

#[test]
fn a_way_too_long_for_32_bits_is_refused() {
    let rig = free("mh_male_vrm1.vrm");
    let mut pose = rig.rest_pose();
    pose.set_translation(rig.role(Role::Hips).unwrap(), DVec3::new(0.0, 1e39, 0.0)).unwrap();
    let clip = Clip::new("jump", vec![0.0, 1.0], vec![rig.rest_pose(), pose]).unwrap();
    let loaded = read(path("mh_male_vrm1.vrm")).unwrap().with_rig(rig).unwrap();
    for error in [write_vrma(&clip).unwrap_err(), write_animated_glb(&loaded, &clip).unwrap_err()] {
        assert!(error.to_string().contains("is too large for the format's 32-bit numbers"), "{error}");
    }
}

#[test]
fn what_is_no_vrm_animation_is_refused_and_what_cannot_be_one() {
    let error = read_vrma(&glb(&leg(), None), "leg.glb").unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::NotVrma));
    assert!(error.to_string().starts_with("leg.glb, /extensions: not a VRM animation"), "{error}");
    assert!(read_vrma(b"glTF", "short.vrma").unwrap_err().to_string().contains("cut short"));

    let rig = read(path("mh_male_vrm1.vrm")).unwrap().rig;
    let mut builder = rig.to_builder();
    builder.joints_mut()[rig.role(Role::Head).unwrap().index()].role = None;
    let rig = builder.build().unwrap();
    let headless = Clip::still(rig.rest_pose()).with_name("walk");
    let error = write_vrma(&headless).unwrap_err();
    assert!(error.to_string().contains("humanoid roles head, which"), "{error}");

    let mut document: Value = open(&foreign("LINEAR")).0;
    document["accessors"].as_array_mut().unwrap().pop();
    let loaded = read_vrma(&glb(&document, None), "broken.vrma").unwrap();
    assert!(matches!(loaded.warnings[..], [Warning::ClipDropped { .. }]), "{:?}", loaded.warnings);
}
