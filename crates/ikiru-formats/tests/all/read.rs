//! Files that ship are read as they are: joints, kinematics, roles; and the rules of what a rig becomes.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::DVec3;
use ikiru_formats::{BoneProblem, Warning, read, read_glb, read_gltf};
use ikiru_rig::{JointMotion, Role};
use serde_json::{Value, json};

#[test]
fn every_file_that_ships_loads_without_warnings() {
    for (name, n_joints, n_balls) in FILES {
        let loaded = read(path(name)).unwrap();
        assert_eq!(loaded.rig.n_joints(), n_joints, "{name}");
        let balls = loaded.rig.joints().iter().filter(|j| j.motion == JointMotion::BALL).count();
        assert_eq!(balls, n_balls, "{name}");
        let others = loaded.rig.joints().iter().filter(|j| j.motion == JointMotion::Fixed).count();
        assert_eq!(others, n_joints - n_balls, "{name}");
        assert_eq!(loaded.warnings, [], "{name}");
        assert!(loaded.clips.is_empty(), "{name}");
        assert!(loaded.source().is_some());
    }
}

#[test]
fn rest_frames_are_those_of_the_matrices_in_the_file() {
    for (name, ..) in FILES {
        let loaded = read(path(name)).unwrap();
        let document: Value = serde_json::from_str(loaded.source().unwrap().json()).unwrap();
        let matrices = matrices(&document);
        let (frames, size) = (loaded.rig.rest_pose().frames(), loaded.rig.size());
        assert_eq!(matrices.len(), frames.len());
        for ((joint, frame), (of, matrix)) in loaded.rig.joints().iter().zip(&frames).zip(&matrices) {
            assert_eq!(&joint.name, of);
            let world_from_file = loaded.world_from_file();
            let distance = frame.position.distance(world_from_file * matrix.w_axis.truncate());
            assert!(distance < 1e-5 * size, "{name}: '{of}' is off by {distance}");
            let (_, rotation, _) = matrix.to_scale_rotation_translation();
            let turned = world_from_file * rotation * loaded.joint_from_file().inverse();
            assert!(frame.rotation.angle_between(turned) < 1e-5, "{name}: '{of}'");
        }
    }
}

#[test]
fn the_human_has_the_bones_that_vrm_requires() {
    let human = read("builtin:human").unwrap().rig;
    for role in Role::ALL {
        let optional = matches!(role, Role::LeftEye | Role::RightEye | Role::Jaw);
        assert_eq!(human.role(role).is_some(), !optional, "{role}");
    }
    let left_hand = human.role(Role::LeftHand).unwrap();
    assert_eq!(human.get(left_hand).unwrap().name, "hand_l");
    assert!(human.rest_pose().frame(left_hand).unwrap().position.x > 0.2, "the left is at +x");
}

#[test]
fn names_are_found_for_the_unnamed_and_the_repeated() {
    let document = json!({
        "asset": { "version": "2.0" },
        "nodes": [
            { "children": [1, 2, 3, 4, 5] }, { "name": "arm" }, { "name": "arm" }, { "name": "arm_2" },
            { "name": "node_5" }, { "name": "" }
        ]
    });
    let loaded = read_glb(&glb(&document, None), "names.glb").unwrap();
    let names: Vec<&str> = loaded.rig.joints().iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["node_0", "arm", "arm_3", "arm_2", "node_5", "node_5_2"]);
    assert_eq!(loaded.warnings.len(), 2);
    assert_eq!(loaded.warnings[0].to_string(), "2 nodes have no name, they are called 'node_0' and so on");
    assert_eq!(loaded.warnings[1].to_string(), "node 2: the name 'arm' is taken, it is called 'arm_3'");
}

#[test]
fn the_default_scene_decides_what_is_a_joint_and_in_which_order() {
    let mut document = json!({
        "asset": { "version": "2.0" },
        "scene": 1,
        "scenes": [{ "nodes": [4] }, { "nodes": [3, 0] }],
        "nodes": [
            { "name": "a", "children": [2, 1] }, { "name": "b" }, { "name": "c" },
            { "name": "d" }, { "name": "e" }
        ]
    });
    let names = |document: &Value| {
        let rig = read_glb(&glb(document, None), "scene.glb").unwrap().rig;
        rig.joints().iter().map(|j| j.name.clone()).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(names(&document), "d a c b");
    document.as_object_mut().unwrap().remove("scene");
    assert_eq!(names(&document), "e");
    document.as_object_mut().unwrap().remove("scenes");
    assert_eq!(names(&document), "a c b d e");
}

#[test]
fn scales_are_baked_into_the_offsets_below() {
    let mut document = leg();
    document["nodes"][0]["scale"] = json!([0.01, 0.01, 0.01]);
    document["nodes"][1]["scale"] = json!([2.0, 2.0, 2.001]);
    let loaded = read_glb(&glb(&document, None), "scaled.glb").unwrap();
    assert_eq!(loaded.warnings, []);
    let joints = loaded.rig.joints();
    assert_eq!(joints[0].rest_translation, DVec3::new(0.0, 1.0, 0.0));
    assert!(joints[1].rest_translation.distance(DVec3::new(0.0, -0.004, 0.0)) < 1e-12);
    assert!(joints[2].rest_translation.distance(DVec3::new(0.0, -0.5, 0.1) * 0.02) < 1e-5);
}

#[test]
fn what_a_rig_cannot_have_is_mended_with_a_warning() {
    let warning = |edit: fn(&mut Value)| {
        let mut document = leg();
        edit(&mut document["nodes"][1]);
        let mut warnings = read_glb(&glb(&document, None), "mended.glb").unwrap().warnings;
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        warnings.remove(0)
    };
    let knee = || "knee".to_owned();
    let found = warning(|node| node["rotation"] = json!([0.0, 0.0, 0.0, 2.0]));
    assert_eq!(found, Warning::RotationLength { joint: knee(), length: 2.0 });
    let found = warning(|node| node["scale"] = json!([-1.0, -1.0, -1.0]));
    assert_eq!(found, Warning::Mirrored { joint: knee() });
    assert!(found.to_string().contains("'knee' is mirrored"));
    let found = warning(|node| {
        node["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    });
    assert_eq!(found, Warning::MatrixAndParts { joint: knee() });
    // Slightly off: nothing to say.
    let mut document = leg();
    document["nodes"][1]["rotation"] = json!([0.0, 0.0, 0.6002, 0.8002]);
    let loaded = read_glb(&glb(&document, None), "mended.glb").unwrap();
    assert_eq!(loaded.warnings, []);
    assert!((loaded.rig.joints()[1].rest_rotation.length() - 1.0).abs() < 1e-15);
}

#[test]
fn mirrored_nodes_keep_all_positions() {
    for scale in
        [[-1.0, 1.0, 1.0], [1.0, -2.0, 1.0], [-1.5, -1.5, -1.5], [-1.0, -1.0, 1.0], [0.5, -0.5, -0.5]]
    {
        let mut document = leg();
        document["nodes"][1]["scale"] = json!(scale);
        let mut even = document.clone();
        if scale[1] == -2.0 {
            even["nodes"][1]["scale"] = json!([2.0, -2.0, 2.0]);
        }
        let loaded = read_glb(&glb(&even, None), "mirrored.glb").unwrap();
        for (frame, (name, matrix)) in loaded.rig.rest_pose().frames().iter().zip(matrices(&even)) {
            let found = frame.position;
            assert!(found.distance(matrix.w_axis.truncate()) < 1e-12, "{scale:?} {name}: {found}");
        }
        assert_eq!(loaded.warnings.is_empty(), scale.iter().product::<f64>() > 0.0);
    }
}

#[test]
fn matrices_are_taken_apart() {
    let mut document = leg();
    let matrix = glam::DMat4::from_scale_rotation_translation(
        DVec3::splat(0.5),
        glam::DQuat::from_rotation_y(0.7),
        DVec3::new(0.1, 0.2, 0.3),
    );
    document["nodes"][0]["matrix"] = json!(matrix.to_cols_array());
    document["nodes"][0].as_object_mut().unwrap().remove("translation");
    let loaded = read_glb(&glb(&document, None), "matrix.glb").unwrap();
    assert_eq!(loaded.warnings, []);
    for (frame, (_, matrix)) in loaded.rig.rest_pose().frames().iter().zip(matrices(&document)) {
        assert!(frame.position.distance(matrix.w_axis.truncate()) < 1e-12);
    }
}

#[test]
fn humanoid_bones_that_cannot_be_used_are_warnings() {
    let mut document = leg();
    let bones = json!({ "hips": { "node": 0 }, "tail": { "node": 1 }, "spine": { "node": 9 }, "chest": { "node": 0 } });
    document["extensions"] = json!({ "VRMC_vrm": { "humanoid": { "humanBones": bones } } });
    let loaded = read_glb(&glb(&document, None), "bones.vrm").unwrap();
    assert_eq!(loaded.rig.joints()[0].role, Some(Role::Hips));
    let reasons: Vec<BoneProblem> = loaded
        .warnings
        .iter()
        .map(|w| match w {
            Warning::HumanoidBone { reason, .. } => reason.clone(),
            other => panic!("{other}"),
        })
        .collect();
    let taken = BoneProblem::Taken { joint: "hip".to_owned(), bone: "hips" };
    assert_eq!(reasons, [BoneProblem::UnknownBone, BoneProblem::NoNode(9), taken]);

    document["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]["hips"] = json!({ "node": -1 });
    let loaded = read_glb(&glb(&document, None), "bones.vrm").unwrap();
    let text = loaded.warnings[0].to_string();
    assert!(text.contains("/extensions/VRMC_vrm/humanoid/humanBones/hips/node"), "{text}");
}

#[test]
fn containers_may_be_untidy() {
    let mut bytes = glb(&leg(), Some(&[1, 2, 3, 4]));
    bytes.extend([0; 5]);
    assert_eq!(read_glb(&bytes, "t.glb").unwrap().warnings, [Warning::TrailingBytes { count: 5 }]);
    let mut text = leg().to_string().into_bytes();
    text.extend([0, 0, b' ', 0]);
    assert_eq!(read_glb(&glb_of_text(&text, None), "zeros.glb").unwrap().rig.n_joints(), 3);
    let mut text = b"\xef\xbb\xbf".to_vec();
    text.extend(leg().to_string().bytes());
    assert_eq!(read_gltf(&text, None, "bom.gltf").unwrap().rig.n_joints(), 3);
    let mut document = leg();
    document.as_object_mut().unwrap().remove("asset");
    assert_eq!(read_glb(&glb(&document, None), "v.glb").unwrap().warnings, [Warning::NoVersion]);
}

#[test]
fn a_chain_of_as_many_nodes_as_a_rig_may_have_loads() {
    let mut text = String::from(r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":["#);
    let n_nodes = ikiru_rig::RigBuilder::MOST_JOINTS;
    for node in 1..n_nodes {
        text.push_str(&format!(r#"{{"name":"n{node}","children":[{node}],"translation":[0,1e-3,0]}},"#));
    }
    text.push_str(r#"{"name":"end"}]}"#);
    let loaded = read_gltf(text.as_bytes(), None, "deep.gltf").unwrap();
    assert_eq!((loaded.rig.n_joints(), loaded.warnings.len()), (n_nodes, 0));
    let end = loaded.rig.joint("end").unwrap();
    assert!((loaded.rig.rest_pose().frame(end).unwrap().position.y - 99.999).abs() < 1e-6);
    assert!(ikiru_formats::write_posed_glb(&loaded, &loaded.rig.rest_pose()).is_ok());
}
