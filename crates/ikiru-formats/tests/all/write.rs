//! What is written shows the pose, reads back to it, and is otherwise the file that was read.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{Loaded, Warning, read, read_glb, read_gltf, write_posed_glb};
use ikiru_rig::{EulerOrder, Joint, JointMotion, Range, RigBuilder};
use ikiru_testkit::rigs::{Random, random_pose};
use serde_json::{Value, json};

fn bytes_of(name: &str) -> Vec<u8> {
    match name {
        "builtin:human" => include_bytes!("../../assets/human.vrm").to_vec(),
        "builtin:reference" => include_bytes!("../../assets/reference_human.glb").to_vec(),
        name => std::fs::read(data(name)).unwrap(),
    }
}

#[test]
fn random_poses_come_back_and_all_else_is_as_it_was() {
    let mut random = Random::new(1);
    for (name, ..) in FILES {
        let loaded = read(path(name)).unwrap();
        let (before, bin) = open(&bytes_of(name));
        for _ in 0..5 {
            let pose = random_pose(&loaded.rig, &mut random);
            let written = write_posed_glb(&loaded, &pose).unwrap();
            let again = read_glb(&written, name).unwrap();
            // A body whose rest is a random pose may lie on its back.
            assert!(again.warnings.iter().all(|w| matches!(w, Warning::Role(_))), "{:?}", again.warnings);
            assert_same_frames(name, &loaded.rig, &pose.frames(), &again.rig.rest_pose().frames());

            let (mut after, bin_after) = open(&written);
            assert_eq!(bin_after, bin, "{name}: the BIN chunk");
            assert_eq!(matrices(&after).len(), loaded.rig.n_joints());
            let keys = |document: &Value| document.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
            assert_eq!(keys(&after), keys(&before), "{name}: members in their order");
            let mut turned = 0;
            for node in 0..before["nodes"].as_array().unwrap().len() {
                let (old, new) = (&before["nodes"][node]["rotation"], &mut after["nodes"][node]);
                turned += usize::from(new["rotation"] != *old);
                match old {
                    Value::Null => _ = new.as_object_mut().unwrap().shift_remove("rotation"),
                    old => new["rotation"] = old.clone(),
                }
            }
            assert_eq!(after, before, "{name}: all but the rotations");
            assert_eq!(turned, loaded.rig.joints().iter().filter(|j| j.motion == JointMotion::BALL).count());
        }
    }
}

#[test]
fn the_rest_pose_leaves_every_node_as_it_is() {
    for (name, ..) in FILES {
        let loaded = read(path(name)).unwrap();
        let written = write_posed_glb(&loaded, &loaded.rig.rest_pose()).unwrap();
        assert_eq!(open(&written), open(&bytes_of(name)), "{name}");
    }
}

/// A leg below an armature in centimetres, turned and scaled as exporters do, with all kinds of transforms.
fn scaled_leg() -> Value {
    let mut document = leg();
    document["scenes"] = json!([{ "nodes": [3] }]);
    document["nodes"][0]["scale"] = json!([-2.0, 2.0, 2.0]);
    document["nodes"].as_array_mut().unwrap().push(json!({
        "name": "armature", "children": [0],
        "matrix": [0.01, 0, 0, 0, 0, 0, -0.01, 0, 0, 0.01, 0, 0, 0.2, 0.1, 0, 1],
        "extras": { "kept": [1, 2] }
    }));
    document
}

#[test]
fn a_free_root_below_a_scale_moves_in_the_nodes_own_unit() {
    let loaded = read_glb(&glb(&scaled_leg(), None), "leg.glb").unwrap();
    let mut builder = loaded.rig.to_builder();
    builder.free_root().unwrap();
    let loaded = loaded.with_rig(builder.build().unwrap()).unwrap();
    let hip = loaded.rig.joint("hip").unwrap();
    let mut pose = loaded.rig.rest_pose();
    pose.set_translation(hip, DVec3::new(0.03, -0.02, 0.05)).unwrap();
    let (document, _) = open(&write_posed_glb(&loaded, &pose).unwrap());
    let translation: Vec<f64> =
        document["nodes"][0]["translation"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    // The hip's half turn about x (the even part of its mirrored scale) turns the motion; 1 unit is 0.01 m.
    assert!(DVec3::from_slice(&translation).distance(DVec3::new(3.0, 3.0, -5.0)) < 1e-9, "{translation:?}");

    let mut random = Random::new(2);
    for _ in 0..50 {
        let pose = random_pose(&loaded.rig, &mut random);
        let written = write_posed_glb(&loaded, &pose).unwrap();
        let again = read_glb(&written, "again.glb").unwrap();
        assert_same_frames("leg", &loaded.rig, &pose.frames(), &again.rig.rest_pose().frames());
        // And by the file's own matrices.
        for (frame, (name, matrix)) in pose.frames().iter().zip(matrices(&open(&written).0)) {
            assert!(frame.position.distance(matrix.w_axis.truncate()) < 1e-9, "{name}");
        }
    }
}

#[test]
fn a_node_with_a_matrix_is_turned_and_keeps_its_scale() {
    let mut document = scaled_leg();
    document["skins"][0]["joints"] = json!([3, 0, 1]);
    let loaded = read_glb(&glb(&document, None), "leg.glb").unwrap();
    let mut random = Random::new(3);
    for _ in 0..20 {
        let pose = random_pose(&loaded.rig, &mut random);
        let written = write_posed_glb(&loaded, &pose).unwrap();
        let again = read_glb(&written, "again.glb").unwrap();
        assert_same_frames("leg", &loaded.rig, &pose.frames(), &again.rig.rest_pose().frames());
        let armature = &open(&written).0["nodes"][3];
        assert!(armature["matrix"].is_null() && armature["rotation"].is_array());
        assert!((armature["scale"][0].as_f64().unwrap() - 0.01).abs() < 1e-12);
        assert_eq!(armature["extras"]["kept"], json!([1, 2]));
    }
}

#[test]
fn other_motions_are_written_as_well() {
    let loaded = read(path("mh_female_mixamo.glb")).unwrap();
    let mut builder = loaded.rig.to_builder();
    let n_joints = loaded.rig.n_joints();
    for (idx, joint) in builder.joints_mut().iter_mut().enumerate() {
        joint.motion = match idx % 4 {
            0 => JointMotion::Euler { order: EulerOrder::ALL[idx % 6], ranges: [Range::UNLIMITED; 3] },
            1 => JointMotion::Hinge { axis: DVec3::Z, range: Range::degrees(-90.0, 90.0) },
            2 => JointMotion::Slider { axis: DVec3::Y, range: Range::new(-0.1, 0.1) },
            _ => JointMotion::FREE,
        };
    }
    let loaded = loaded.with_rig(builder.build().unwrap()).unwrap();
    let mut random = Random::new(4);
    for _ in 0..10 {
        let pose = random_pose(&loaded.rig, &mut random);
        let again = read_glb(&write_posed_glb(&loaded, &pose).unwrap(), "again.glb").unwrap();
        assert_eq!(again.rig.n_joints(), n_joints);
        assert_same_frames("mixamo", &loaded.rig, &pose.frames(), &again.rig.rest_pose().frames());
    }
}

#[test]
fn a_text_file_becomes_a_binary_one_that_stands_alone() {
    let folder = std::env::temp_dir().join(format!("ikiru-formats-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("more here")).unwrap();
    std::fs::write(folder.join("a.bin"), [1, 2, 3, 4, 5]).unwrap();
    std::fs::write(folder.join("more here/b.bin"), [6, 7, 8]).unwrap();
    std::fs::write(folder.join("skin.png"), [9, 9]).unwrap();
    let mut document = leg();
    document["buffers"] = json!([
        { "uri": "a.bin", "byteLength": 5, "name": "first" },
        { "byteLength": 3, "uri": "more%20here/b.bin" },
        { "byteLength": 2, "uri": "data:application/octet-stream;base64,AAE=" }
    ]);
    document["images"] = json!([{ "uri": "skin.png" }, { "uri": "gone.png" }]);
    let text = serde_json::to_string_pretty(&document).unwrap();
    std::fs::write(folder.join("leg.gltf"), &text).unwrap();
    let loaded = read(folder.join("leg.gltf")).unwrap();
    let written = write_posed_glb(&loaded, &loaded.rig.rest_pose()).unwrap();
    let (after, bin) = open(&written);
    assert_eq!(bin.unwrap(), [1, 2, 3, 4, 5, 0, 0, 0]);
    assert_eq!(after["buffers"][0], json!({ "byteLength": 5, "name": "first" }));
    assert_eq!(after["buffers"][1]["uri"], "data:application/octet-stream;base64,BgcI");
    assert_eq!(after["buffers"][2], document["buffers"][2]);
    assert_eq!(after["images"], json!([{ "uri": "data:image/png;base64,CQk=" }, { "uri": "gone.png" }]));
    assert_eq!(read_glb(&written, "alone.glb").unwrap().rig.n_joints(), 3);

    // Without its folder it reads as well, and says what is missing when it is to be written.
    let loaded = read_gltf(text.as_bytes(), None, "leg.gltf").unwrap();
    assert_eq!(loaded.warnings, []);
    let error = write_posed_glb(&loaded, &loaded.rig.rest_pose()).unwrap_err().to_string();
    assert!(error.contains("leg.gltf, /buffers/0: buffer 0 cannot be embedded: 'a.bin'"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn saving_replaces_a_file_as_a_whole() {
    let folder = std::env::temp_dir().join(format!("ikiru-formats-save-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("out.glb");
    ikiru_formats::save(&file, b"one").unwrap();
    ikiru_formats::save(&file, b"two").unwrap();
    assert_eq!(std::fs::read(&file).unwrap(), b"two");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside it");
    let error = ikiru_formats::save(folder.join("no/such/out.glb"), b"x").unwrap_err().to_string();
    assert!(error.contains("no/such/out.glb: cannot write"), "{error}");
    let error = ikiru_formats::save(&folder, b"x").unwrap_err().to_string();
    assert!(error.contains("cannot write the file"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_does_not_fit_the_file_is_refused() {
    let loaded = read_glb(&glb(&leg(), None), "leg.glb").unwrap();
    let error = |rig: RigBuilder| {
        let pose = rig.build().unwrap().rest_pose();
        write_posed_glb(&loaded, &pose).unwrap_err().to_string()
    };
    let mut builder = loaded.rig.to_builder();
    builder.joints_mut()[1].name = "elbow".to_owned();
    assert_eq!(
        error(builder),
        "leg.glb: the pose does not fit the file: joint 1 is 'elbow', expected 'knee'"
    );
    let mut builder = loaded.rig.to_builder();
    builder.add(Joint::new("toe", None));
    assert!(error(builder).contains("it has 4 joints, expected 3"));
    let mut builder = loaded.rig.to_builder();
    builder.joints_mut()[1].rest_translation.x += 0.1;
    assert!(error(builder).contains("joint 'knee' has another rest transform"));

    let mut pose = loaded.rig.rest_pose();
    pose.coords_mut()[0] = f64::NAN;
    let error = write_posed_glb(&loaded, &pose).unwrap_err().to_string();
    assert!(error.contains("not finite"), "{error}");

    let mut builder = RigBuilder::new();
    builder.add(Joint::new("alone", None));
    let loaded = Loaded::from_rig(builder.build().unwrap());
    let error = write_posed_glb(&loaded, &loaded.rig.rest_pose()).unwrap_err().to_string();
    assert!(error.contains("expected a rig that was read from a .glb"), "{error}");
}

#[test]
fn chunks_that_nobody_knows_are_kept() {
    let mut bytes = glb(&leg(), Some(&[1, 2, 3, 4]));
    bytes.extend([8, 0, 0, 0, b'X', b'T', b'R', b'A', 1, 2, 3, 4, 5, 6, 7, 8]);
    let length = bytes.len() as u32;
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    let loaded = read_glb(&bytes, "extra.glb").unwrap();
    assert_eq!(loaded.warnings, []);
    let written = write_posed_glb(&loaded, &loaded.rig.rest_pose()).unwrap();
    assert_eq!(written, bytes);
}

#[test]
fn poses_as_json_have_the_members_of_each_motion() {
    let rig = read_glb(&glb(&leg(), None), "leg.glb").unwrap().rig;
    let ids: Vec<_> = rig.ids().collect();
    let mut builder = rig.to_builder();
    builder.set_motion(ids[0], JointMotion::FREE).unwrap();
    builder.set_motion(ids[1], JointMotion::Hinge { axis: DVec3::X, range: Range::UNLIMITED }).unwrap();
    let euler = JointMotion::Euler { order: EulerOrder::Zyx, ranges: [Range::UNLIMITED; 3] };
    builder.set_motion(ids[2], euler).unwrap();
    let mut slider = Joint::new("rail", Some(ids[0]));
    slider.motion = JointMotion::Slider { axis: DVec3::X, range: Range::UNLIMITED };
    let rail = builder.add(slider);
    let rig = builder.build().unwrap();
    let mut pose = rig.rest_pose();
    pose.set_translation(ids[0], DVec3::new(1.0, 2.0, 3.0)).unwrap();
    pose.set_value(ids[1], std::f64::consts::PI).unwrap();
    pose.set_euler(ids[2], [0.0, std::f64::consts::FRAC_PI_2, 0.0]).unwrap();
    pose.set_value(rail, 0.25).unwrap();
    let value = ikiru_formats::pose_json(&pose, &[ids[2], ids[0], ids[1], rail]);
    assert_eq!((&value["root"], &value["root_translation"]), (&json!("hip"), &json!([1.0, 2.0, 3.0])));
    let joints = value["joints"].as_object().unwrap();
    assert_eq!(joints.keys().collect::<Vec<_>>(), ["foot", "hip", "knee", "rail"]);
    assert_eq!(joints["hip"], json!({ "rotation": [0.0, 0.0, 0.0, 1.0] }));
    assert_eq!(joints["knee"]["angle_deg"], 180.0);
    assert_eq!(joints["foot"]["euler_deg"], json!([0.0, 90.0, 0.0]));
    assert_eq!(joints["rail"], json!({ "rotation": [0.0, 0.0, 0.0, 1.0], "offset": 0.25 }));
    let knee: Vec<f64> = serde_json::from_value(joints["knee"]["rotation"].clone()).unwrap();
    assert!(DQuat::from_slice(&knee).dot(DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0)).abs() > 1.0 - 1e-12);
}

#[test]
fn what_floats_beside_the_root_keeps_its_translation_in_json() {
    // Two trees: nothing carries both, so there is no root of the body.
    let mut builder = RigBuilder::new();
    for name in ["figure", "ball"] {
        let mut joint = Joint::new(name, None);
        joint.motion = JointMotion::FREE;
        builder.add(joint);
    }
    let rig = builder.build().unwrap();
    let mut pose = rig.rest_pose();
    for (id, x) in rig.ids().zip([1.0, 2.0]) {
        pose.set_translation(id, DVec3::new(x, 0.0, 0.0)).unwrap();
    }
    let value = ikiru_formats::pose_json(&pose, &rig.ids().collect::<Vec<_>>());
    assert_eq!((&value["root"], &value["root_translation"]), (&Value::Null, &json!([0.0, 0.0, 0.0])));
    assert_eq!(value["joints"]["figure"]["translation"], json!([1.0, 0.0, 0.0]));
    assert_eq!(value["joints"]["ball"]["translation"], json!([2.0, 0.0, 0.0]));
}
