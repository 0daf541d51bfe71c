//! One scenario, one result: on VRM 1.0, on VRM 0.x, and under a node that is turned, of the same character.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use std::path::Path;

use glam::{DQuat, DVec3};
use ikiru_rig::{JointFrame, Role};
use ikiru_scenario::Scenario;
use serde_json::{Value, json};

fn data(name: &str) -> String {
    format!("{}/../ikiru-formats/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// Everything that is said in axes: of the world, and of joints.
const WISHES: &str = r#"
root = "free"
method = "lm"

[limits.leftUpperArm]
axis = [1, 0, 0]
swing_deg = [80, 50]
twist_deg = [-60, 60]
[limits.rightLowerArm]
min_deg = [-10, -30, -10]
max_deg = [10, 140, 10]

[start]
root_translation = [0.1, -0.05, 0.2]
hips = { euler_deg = [5, 20, 0] }
leftUpperArm = { euler_deg = [0, 0, -40] }
rightLowerArm = { euler_deg = [0, 60, 0] }

[[objective]]
kind = "look_at"
joint = "head"
axis = [0, 0, 1]
target = [0.4, 1.5, 2]
[[objective]]
kind = "orientation"
joint = "rightHand"
euler_deg = [0, 30, 20]
[[objective]]
kind = "position"
joint = "leftHand"
point = [0.02, -0.01, 0.03]
target = [0.35, 1.1, 0.4]
[[objective]]
kind = "direction"
joint = "spine"
axis = [0, 0, 1]
target = [0.3, 0, 1]
[[objective]]
kind = "known_rotation"
joints = { leftUpperLeg = { euler_deg = [-30, 10, 0] } }
[[objective]]
kind = "rest_pose"
weight = 0.01

[stop]
max_restarts = 0
"#;

/// World frames of the humanoid bones where the solve ends, and the root's way.
fn solved(rig: &str, wishes: &str) -> (Vec<JointFrame>, DVec3) {
    let text = format!("version = 1\nrig = {rig:?}\n{wishes}");
    let scenario = Scenario::parse(&text, "test.toml", "").unwrap();
    let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
    assert!(scenario.solve(&mut pose, &mut workspace).success, "{rig}");
    let bones = Role::ALL.into_iter().filter_map(|role| scenario.rig.role(role));
    (bones.map(|joint| pose.frame(joint).unwrap()).collect(), pose.root_translation())
}

fn assert_same((frames, way): &(Vec<JointFrame>, DVec3), (others, other_way): &(Vec<JointFrame>, DVec3)) {
    assert!(way.distance(*other_way) < 1e-6, "{way} {other_way}");
    assert_eq!(frames.len(), others.len());
    for (a, b) in frames.iter().zip(others) {
        let turn = a.rotation.inverse() * b.rotation;
        assert!(a.position.distance(b.position) < 1e-6);
        assert!(turn.xyz().length() < 1e-6, "{turn}");
    }
}

#[test]
fn an_old_avatar_does_what_the_new_one_does() {
    let [new, old] = ["mh_male_vrm1.vrm", "mh_male_vrm0.vrm"].map(|name| solved(&data(name), WISHES));
    assert_same(&new, &old);
    assert!(new.1.length() > 0.05, "the root has moved: {}", new.1);
}

/// The new avatar with the node above its pelvis turned, and the pelvis turned back.
fn turned(folder: &Path) -> String {
    let bytes = std::fs::read(data("mh_male_vrm1.vrm")).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut document: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let turn = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let nodes = document["nodes"].as_array_mut().unwrap();
    let root = nodes.iter().position(|node| node["name"] == "Root").unwrap();
    let children = nodes[root]["children"].as_array().unwrap().clone();
    assert!(nodes[root].get("rotation").is_none());
    nodes[root]["rotation"] = json!(turn.to_array());
    for child in children {
        let node = &mut nodes[child.as_u64().unwrap() as usize];
        let at: Vec<f64> = serde_json::from_value(node["translation"].clone()).unwrap();
        assert!(node.get("rotation").is_none());
        node["translation"] = json!((turn.inverse() * DVec3::from_slice(&at)).to_array());
        node["rotation"] = json!(turn.inverse().to_array());
    }
    let mut text = document.to_string();
    text.push_str(&" ".repeat(text.len().next_multiple_of(4) - text.len()));
    let mut out = bytes[..12].to_vec();
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(text.as_bytes());
    out.extend(&bytes[20 + length..]);
    let total = (out.len() as u32).to_le_bytes();
    out[8..12].copy_from_slice(&total);
    let path = folder.join("turned.vrm");
    std::fs::write(&path, out).unwrap();
    path.display().to_string()
}

#[test]
fn under_a_node_that_is_turned_the_root_moves_along_the_axes_of_the_world() {
    let folder = tempfile::tempdir().unwrap();
    let turned = turned(folder.path());
    assert_same(&solved(&data("mh_male_vrm1.vrm"), WISHES), &solved(&turned, WISHES));
}

#[test]
fn in_the_files_world_an_old_avatar_turned_round_is_asked_for_what_faces_back() {
    // The same wishes, said in the axes of a file whose character faces -z.
    let wishes = |root: &str, head: &str, hand: &str| {
        format!(
            "root = \"free\"\n{root}\n[[objective]]\nkind = \"orientation\"\njoint = \"head\"\n{head}\n\
             [[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = {hand}\n[[objective]]\n\
             kind = \"rest_pose\"\nweight = 0.01\n[stop]\nmax_restarts = 0\n"
        )
    };
    let scene =
        wishes("[start]\nroot_translation = [0.1, 0, 0.2]", "euler_deg = [10, 20, 0]", "[0.3, 1.2, 0.4]");
    let file = wishes(
        "world = \"file\"\n[start]\nroot_translation = [-0.1, 0, -0.2]",
        "euler_deg = [-10, 20, 0]",
        "[-0.3, 1.2, -0.4]",
    );
    assert_same(&solved(&data("mh_male_vrm0.vrm"), &scene), &solved(&data("mh_male_vrm0.vrm"), &file));
}
