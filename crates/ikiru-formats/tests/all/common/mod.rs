//! What the tests of this crate share: sample files, small documents, and kinematics straight from JSON.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

pub(crate) mod bounds;
pub(crate) mod bvh;

use std::path::PathBuf;

use glam::{DMat4, DQuat, DVec3};
use ikiru_rig::{JointFrame, Rig};
use serde_json::{Value, json};

/// A file of `tests/data`.
pub(crate) fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// A robot, by the name of its file: one that the library embeds, or one that is here for the tests.
pub(crate) fn robot_file(name: &str) -> PathBuf {
    let file = format!("{name}.urdf");
    let shipped = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets/robots").join(&file);
    if shipped.exists() { shipped } else { data("robots").join(file) }
}

/// Every file that ships, with its number of joints and of those that turn.
pub(crate) const FILES: [(&str, usize, usize); 10] = [
    ("builtin:human", 55, 53),
    ("builtin:reference", 57, 57),
    ("mh_female_default163.glb", 165, 163),
    ("mh_female_mixamo.glb", 54, 52),
    ("mh_male_gameengine.glb", 55, 53),
    ("mh_male_gameengine_lod10pc.glb", 55, 53),
    ("mh_male_vrm0.vrm", 55, 53),
    ("mh_male_vrm1.vrm", 55, 53),
    ("webxr_generic_hand_left.glb", 30, 25),
    ("webxr_generic_hand_right.glb", 27, 25),
];

/// The path of a file of [`FILES`].
pub(crate) fn path(name: &str) -> PathBuf {
    if name.starts_with("builtin:") { PathBuf::from(name) } else { data(name) }
}

/// A binary file of a document and an optional BIN chunk.
pub(crate) fn glb(document: &Value, bin: Option<&[u8]>) -> Vec<u8> {
    glb_of_text(document.to_string().as_bytes(), bin)
}

/// The same of any text.
pub(crate) fn glb_of_text(text: &[u8], bin: Option<&[u8]>) -> Vec<u8> {
    let mut chunks = Vec::new();
    let mut chunk = |kind: &[u8; 4], data: &[u8], fill: u8| {
        let padded = data.len().next_multiple_of(4);
        chunks.extend((padded as u32).to_le_bytes());
        chunks.extend(kind);
        chunks.extend(data);
        chunks.resize(chunks.len() + padded - data.len(), fill);
    };
    chunk(b"JSON", text, b' ');
    if let Some(bin) = bin {
        chunk(b"BIN\0", bin, 0);
    }
    let mut out = b"glTF".to_vec();
    out.extend(2u32.to_le_bytes());
    out.extend((chunks.len() as u32 + 12).to_le_bytes());
    out.extend(chunks);
    out
}

/// The document and the BIN chunk of a binary file.
pub(crate) fn open(bytes: &[u8]) -> (Value, Option<Vec<u8>>) {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(&bytes[..4], b"glTF");
    assert_eq!(word(8), bytes.len());
    assert_eq!(bytes.len() % 4, 0);
    let end = 20 + word(12);
    assert_eq!(end % 4, 0);
    let document = serde_json::from_slice(&bytes[20..end]).unwrap();
    let bin = (end < bytes.len()).then(|| bytes[end + 8..end + 8 + word(end)].to_vec());
    (document, bin)
}

/// Three nodes in a row with a skin: hip, knee, and a foot that is no part of the skin.
pub(crate) fn leg() -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "name": "hip", "children": [1], "translation": [0.0, 1.0, 0.0] },
            { "name": "knee", "children": [2], "translation": [0.0, -0.4, 0.0],
              "rotation": [0.0, 0.0, 0.6, 0.8] },
            { "name": "foot", "translation": [0.0, -0.5, 0.1] }
        ],
        "skins": [{ "joints": [0, 1] }]
    })
}

fn floats<const N: usize>(value: &Value, default: [f64; N]) -> [f64; N] {
    match value.as_array() {
        Some(list) => std::array::from_fn(|i| list[i].as_f64().unwrap()),
        None => default,
    }
}

/// World matrices of all nodes of a document, by name, straight from its JSON.
pub(crate) fn matrices(document: &Value) -> Vec<(String, DMat4)> {
    fn visit(document: &Value, node: usize, parent: DMat4, out: &mut Vec<(String, DMat4)>) {
        let value = &document["nodes"][node];
        let local = if value["matrix"].is_array() {
            DMat4::from_cols_array(&floats(&value["matrix"], [0.0; 16]))
        } else {
            DMat4::from_scale_rotation_translation(
                DVec3::from_array(floats(&value["scale"], [1.0; 3])),
                DQuat::from_array(floats(&value["rotation"], [0.0, 0.0, 0.0, 1.0])).normalize(),
                DVec3::from_array(floats(&value["translation"], [0.0; 3])),
            )
        };
        let world = parent * local;
        out.push((value["name"].as_str().map_or_else(|| format!("node_{node}"), str::to_owned), world));
        for child in value["children"].as_array().into_iter().flatten() {
            visit(document, child.as_u64().unwrap() as usize, world, out);
        }
    }
    let mut out = Vec::new();
    let scene = document["scene"].as_u64().unwrap_or(0) as usize;
    for root in document["scenes"][scene]["nodes"].as_array().unwrap() {
        visit(document, root.as_u64().unwrap() as usize, DMat4::IDENTITY, &mut out);
    }
    out
}

/// Angle of the rotation between two frames, radians, and the distance of their origins.
pub(crate) fn apart(a: &JointFrame, b: &JointFrame) -> (f64, f64) {
    let turn = a.rotation.inverse() * b.rotation;
    let angle = 2.0 * DVec3::new(turn.x, turn.y, turn.z).length().atan2(turn.w.abs());
    (angle, a.position.distance(b.position))
}

/// Asserts that both have the same world frames: within 1e-5 of the size, and 1e-5 rad.
pub(crate) fn assert_same_frames(what: &str, rig: &Rig, a: &[JointFrame], b: &[JointFrame]) {
    assert_eq!(a.len(), b.len(), "{what}");
    let size = rig.size();
    for (joint, (a, b)) in rig.joints().iter().zip(a.iter().zip(b)) {
        let (angle, distance) = apart(a, b);
        assert!(angle < 1e-5, "{what}: '{}' is turned by {angle}", joint.name);
        assert!(distance < 1e-5 * size, "{what}: '{}' is off by {distance}", joint.name);
    }
}

/// Every robot, by [`robot_file`], with its number of links and of degrees of freedom.
pub(crate) const ROBOTS: [(&str, usize, usize); 10] = [
    ("allegro_right_hand", 21, 16),
    ("deepmimic_humanoid", 16, 28),
    ("g1_29dof_rev_1_0", 39, 29),
    ("g1_29dof_with_hand_rev_1_0", 53, 43),
    ("human", 37, 36),
    ("kinds", 11, 13),
    ("panda", 13, 8),
    ("simple_humanoid", 31, 29),
    ("ur5_robot", 11, 6),
    ("xarm7", 10, 7),
];
