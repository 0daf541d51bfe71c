//! What is called reached, the written file reaches: its tip by plain products of the matrices of its nodes.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use glam::{DMat4, DQuat, DVec3};
use ikiru_formats::write_posed_glb;
use ikiru_scenario::Scenario;
use serde_json::{Value, json};

/// Five joints along y below two nodes with a scale each, and a tip that no skin uses.
fn chain(scales: [[f64; 3]; 2], last: [f64; 3]) -> Value {
    let joint =
        |i: usize| json!({ "name": format!("j{i}"), "translation": [0.0, 0.3, 0.0], "children": [i + 1] });
    let mut nodes: Vec<Value> = (0..5).map(joint).collect();
    nodes[4]["scale"] = json!(last);
    nodes.push(json!({ "name": "tip", "translation": [0.0, 0.3, 0.1] }));
    nodes.push(
        json!({ "name": "scene", "scale": scales[0], "rotation": [0.0, 0.6, 0.0, 0.8], "children": [7] }),
    );
    nodes.push(json!({ "name": "armature", "scale": scales[1], "children": [0] }));
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [6] }], "nodes": nodes,
        "skins": [{ "joints": [0, 1, 2, 3, 4] }]
    })
}

/// Where a node is, by the document of a binary file.
fn place(bytes: &[u8], name: &str) -> DVec3 {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let document: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let nodes = document["nodes"].as_array().unwrap();
    let numbers = |node: &Value, member: &str, default: &[f64]| -> Vec<f64> {
        node.get(member).map_or_else(|| default.to_vec(), |v| serde_json::from_value(v.clone()).unwrap())
    };
    let mut world = DMat4::IDENTITY;
    let mut at = nodes.iter().position(|node| node["name"] == name);
    while let Some(idx) = at {
        let node = &nodes[idx];
        let local = DMat4::from_scale_rotation_translation(
            DVec3::from_slice(&numbers(node, "scale", &[1.0; 3])),
            DQuat::from_slice(&numbers(node, "rotation", &[0.0, 0.0, 0.0, 1.0])),
            DVec3::from_slice(&numbers(node, "translation", &[0.0; 3])),
        );
        world = local * world;
        let holds = |node: &Value| node["children"].as_array().is_some_and(|c| c.contains(&json!(idx)));
        at = nodes.iter().position(holds);
    }
    world.w_axis.truncate()
}

#[test]
fn a_target_that_is_reached_is_reached_in_the_written_file() {
    let folder = tempfile::tempdir().unwrap();
    let none = [1.0; 3];
    for (scales, last) in [
        ([none, none], none),
        ([none, none], [1.0, 3.0, 0.5]),
        ([[1.0, 4.0, 2.0], [1.0, 0.25, 0.5]], none),
        ([[100.0; 3], [0.01; 3]], [1.0, 2.0, 1.0]),
    ] {
        std::fs::write(folder.path().join("chain.gltf"), chain(scales, last).to_string()).unwrap();
        let target = DVec3::new(0.3, 1.0, 0.4);
        let text = "version = 1\nrig = \"chain.gltf\"\n[[objective]]\nkind = \"position\"\njoint = \"tip\"\n\
                    target = [0.3, 1.0, 0.4]\n";
        let scenario = Scenario::parse(text, "test.toml", folder.path()).unwrap();
        let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
        assert!(scenario.solve(&mut pose, &mut workspace).success, "{scales:?} {last:?}");
        let found = place(&write_posed_glb(&scenario.loaded, &pose).unwrap(), "tip");
        assert!(found.distance(target) < 1.001e-3, "{scales:?} {last:?}: {found}");
    }
    // A scale that a turn below would shear is none of a rig's.
    let mut sheared = chain([none, none], none);
    sheared["nodes"][0]["scale"] = json!([1.0, 3.0, 0.5]);
    std::fs::write(folder.path().join("chain.gltf"), sheared.to_string()).unwrap();
    let text = "version = 1\nrig = \"chain.gltf\"\n[[objective]]\nkind = \"rest_pose\"\n";
    let error = Scenario::parse(text, "test.toml", folder.path()).unwrap_err();
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(cause.contains("/nodes/0") && cause.contains("'j0' has the scale [1.0, 3.0, 0.5]"), "{cause}");
}
