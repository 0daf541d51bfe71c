//! Scales that differ between the axes: exact by the file's own matrices, or refused where a joint turns below.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::DVec3;
use ikiru_formats::{Error, ErrorKind, Loaded, Place, Warning, read_glb, write_posed_glb};
use ikiru_rig::{JointMotion, Role};
use ikiru_testkit::rigs::{Random, random_pose};
use serde_json::{Value, json};

/// Five joints, 0.3 m apart along y; node 5 stands above them, node 6 is a tip that no skin uses.
fn chain() -> Value {
    let mut nodes: Vec<Value> = (0..5)
        .map(|i| json!({ "name": format!("j{i}"), "translation": [0.0, 0.3, 0.0], "children": [i + 1] }))
        .collect();
    nodes[4]["children"] = json!([6]);
    nodes.push(json!({ "name": "armature", "children": [0] }));
    nodes.push(json!({ "name": "tip", "translation": [0.1, 0.3, 0.2], "rotation": [0.0, 0.6, 0.0, 0.8] }));
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [5] }], "nodes": nodes,
        "skins": [{ "joints": [0, 1, 2, 3, 4] }]
    })
}

fn load(document: &Value) -> Result<Loaded, Error> {
    read_glb(&glb(document, None), "chain.glb")
}

/// Asserts that random poses lie where the matrices of the written file have them.
fn assert_exact(document: &Value, tolerance: f64) -> Loaded {
    let loaded = load(document).unwrap();
    let mut random = Random::new(5);
    for _ in 0..20 {
        let pose = random_pose(&loaded.rig, &mut random);
        let (written, _) = open(&write_posed_glb(&loaded, &pose).unwrap());
        for (frame, (name, matrix)) in pose.frames().iter().zip(matrices(&written)) {
            let found = frame.position;
            assert!(found.distance(matrix.w_axis.truncate()) < tolerance, "{name}: {found} {matrix}");
        }
    }
    loaded
}

#[test]
fn what_turns_below_a_scale_that_differs_between_the_axes_is_refused() {
    for scale in [[1.0, 3.0, 0.5], [1.0, 1.1, 1.0], [1.0, 1.0, 1.002]] {
        let mut document = chain();
        document["nodes"][0]["scale"] = json!(scale);
        let error = load(&document).unwrap_err();
        assert_eq!(error.place(), &Place::Pointer("/nodes/0".to_owned()));
        assert!(matches!(error.kind(), ErrorKind::TurnsBelowScale { .. }), "{error}");
        for words in ["'j0' has the scale", "'j1' turns below it", "one scale for all axes"] {
            assert!(error.to_string().contains(words), "{error}");
        }
    }
    // That the next node undoes it helps at rest alone: between the two, a turn shears.
    let mut document = chain();
    document["nodes"][0]["scale"] = json!([1.0, 2.0, 1.0]);
    document["nodes"][1]["scale"] = json!([1.0, 0.5, 1.0]);
    assert!(load(&document).unwrap_err().to_string().contains("'j1' turns below it"));
}

#[test]
fn scales_that_undo_each_other_above_all_that_turns_are_exact() {
    let mut document = chain();
    let root = json!({ "name": "scene", "children": [5], "scale": [1.0, 4.0, 2.0], "rotation": [0.0, 0.6, 0.0, 0.8] });
    document["nodes"].as_array_mut().unwrap().push(root);
    document["scenes"][0]["nodes"] = json!([7]);
    // A quarter turn about z exchanges x and y.
    let half = 0.5_f64.sqrt();
    document["nodes"][5]["rotation"] = json!([0.0, 0.0, half, half]);
    document["nodes"][5]["scale"] = json!([0.25, 1.0, 0.5]);
    document["nodes"][5]["translation"] = json!([0.3, 0.2, 0.1]);
    let loaded = assert_exact(&document, 1e-12);
    assert_eq!(loaded.warnings, []);
    // Not quite undone: an error that names the node which is off the most.
    document["nodes"][5]["scale"] = json!([0.25, 1.01, 0.5]);
    let error = load(&document).unwrap_err().to_string();
    assert!(error.contains("'scene' has the scale") || error.contains("'armature' has the scale"), "{error}");
}

#[test]
fn a_thousandth_is_the_same_scale_and_offsets_are_exact_all_the_same() {
    let mut document = chain();
    document["nodes"][5]["scale"] = json!([100.0, 100.05, 100.0]);
    document["nodes"][0]["scale"] = json!([0.01, 0.01, 0.01]);
    let loaded = load(&document).unwrap();
    for (frame, (_, matrix)) in loaded.rig.rest_pose().frames().iter().zip(matrices(&document)) {
        assert!(frame.position.distance(matrix.w_axis.truncate()) < 1e-12);
    }
}

#[test]
fn below_the_last_joint_that_turns_any_scale_is_exact() {
    let mut document = chain();
    document["nodes"][4]["scale"] = json!([1.0, 3.0, -0.5]);
    let loaded = assert_exact(&document, 1e-12);
    assert_eq!(loaded.warnings.len(), 2, "{:?}", loaded.warnings);
    assert!(loaded.warnings.contains(&Warning::Mirrored { joint: "j4".to_owned() }));
    // The tip is turned against the scale, so that its axes are not perpendicular.
    assert!(loaded.warnings.contains(&Warning::Sheared { joint: "tip".to_owned() }));
}

#[test]
fn a_joint_that_is_made_to_turn_below_such_a_scale_is_refused_then() {
    let mut document = chain();
    document["nodes"][4]["scale"] = json!([1.0, 3.0, 0.5]);
    let loaded = load(&document).unwrap();
    let mut builder = loaded.rig.to_builder();
    builder.set_motion(loaded.rig.joint("tip").unwrap(), JointMotion::BALL).unwrap();
    let turning = builder.build().unwrap();
    let error = write_posed_glb(&loaded, &turning.rest_pose()).unwrap_err();
    assert!(error.to_string().contains("'j4' has the scale [1.0, 3.0, 0.5], and 'tip' turns below it"));
    assert!(matches!(loaded.with_rig(turning).unwrap_err().kind(), ErrorKind::TurnsBelowScale { .. }));
}

#[test]
fn a_root_below_a_scale_translates_in_the_files_unit() {
    let mut document = chain();
    document["nodes"][5]["scale"] = json!([0.01, 0.01, 0.01]);
    document["nodes"][5]["rotation"] = json!([-0.6, 0.0, 0.0, 0.8]);
    let loaded = load(&document).unwrap();
    let mut builder = loaded.rig.to_builder();
    builder.free_root().unwrap();
    let free = builder.build().unwrap();
    let mut pose = free.rest_pose();
    pose.set_root_translation(DVec3::new(1.0, 2.0, 3.0)).unwrap();
    let (written, _) = open(&write_posed_glb(&loaded, &pose).unwrap());
    for ((_, before), (name, after)) in matrices(&document).iter().zip(matrices(&written)).skip(1) {
        let way = (after.w_axis - before.w_axis).truncate();
        assert!(way.distance(DVec3::new(1.0, 2.0, 3.0)) < 1e-12, "{name} {way}");
    }
    assert_eq!(free.role(Role::Hips), None);
}
