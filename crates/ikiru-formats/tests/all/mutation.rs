//! Broken files by the thousand: whatever comes in, there is an answer, and it is a valid rig or an error.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use ikiru_formats::{Loaded, read_glb, write_animated_glb, write_posed_glb};
use ikiru_testkit::rigs::{Random, random_pose};
use serde_json::{Value, json};

/// Small files with every feature that is read.
fn samples() -> Vec<Vec<u8>> {
    let reference = ikiru_formats::builtin("reference").unwrap();
    let mut random = Random::new(7);
    let poses = (0..3).map(|_| random_pose(&reference.rig, &mut random)).collect();
    let clip = ikiru_rig::Clip::new("clip", vec![0.0, 0.5, 1.0], poses).unwrap();
    let mut animated = leg();
    animated["nodes"][0]["scale"] = json!([-0.5, 0.5, 0.5]);
    animated["nodes"][2] = json!({ "matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 1, 2, 3, 1] });
    let bones = json!({ "hips": { "node": 0 }, "spine": { "node": 1 } });
    animated["extensions"] = json!({ "VRMC_vrm": { "humanoid": { "humanBones": bones } } });
    animated["buffers"] = json!([{ "byteLength": 136 }, { "byteLength": 3, "uri": "data:;base64,AAAA" }]);
    animated["bufferViews"] = json!([
        { "buffer": 0, "byteLength": 8 },
        { "buffer": 0, "byteOffset": 8, "byteLength": 96 },
        { "buffer": 0, "byteOffset": 104, "byteLength": 32, "byteStride": 16 },
        { "buffer": 1, "byteLength": 2 }
    ]);
    animated["accessors"] = json!([
        { "bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR" },
        { "bufferView": 1, "componentType": 5126, "count": 6, "type": "VEC4",
          "sparse": { "count": 1, "indices": { "bufferView": 3, "componentType": 5121 },
                      "values": { "bufferView": 2 } } },
        { "bufferView": 2, "componentType": 5122, "count": 2, "type": "VEC4", "normalized": true },
        { "bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3" }
    ]);
    animated["animations"] = json!([{
        "channels": [
            { "sampler": 0, "target": { "node": 0, "path": "rotation" } },
            { "sampler": 1, "target": { "node": 1, "path": "rotation" } },
            { "sampler": 2, "target": { "node": 1, "path": "translation" } },
            { "sampler": 2, "target": { "node": 2, "path": "scale" } }
        ],
        "samplers": [
            { "input": 0, "output": 1, "interpolation": "CUBICSPLINE" },
            { "input": 0, "output": 2, "interpolation": "STEP" },
            { "input": 0, "output": 3 }
        ]
    }]);
    let floats = [0.0f32, 1.0].iter().chain(std::iter::repeat_n(&0.5, 32));
    let mut bin: Vec<u8> = floats.flat_map(|v| v.to_le_bytes()).collect();
    bin[120..128].copy_from_slice(&[1, 0, 0, 64, 0, 0, 0, 64]);
    let animated = glb(&animated, Some(&bin));
    let loaded = read_glb(&animated, "sample.glb").unwrap();
    assert_eq!(loaded.clips.len(), 1, "{:?}", loaded.warnings);
    let mut old = leg();
    let bones = json!([{ "bone": "hips", "node": 0 }, { "bone": "leftThumbProximal", "node": -1 }]);
    old["extensions"] = json!({ "VRM": { "humanoid": { "humanBones": bones } } });
    let vrma = ikiru_formats::write_vrma(&clip).unwrap();
    vec![glb(&leg(), None), glb(&old, None), animated, write_animated_glb(&reference, &clip).unwrap(), vrma]
}

/// Reads, and writes what could be read.
fn exercise(bytes: &[u8], counts: &mut [usize; 2]) {
    match read_glb(bytes, "mutated.glb") {
        Ok(loaded) => {
            counts[0] += 1;
            assert!(loaded.rig.rest_pose().frames().iter().all(|f| f.position.is_finite()));
            assert!(loaded.clips.iter().flat_map(ikiru_rig::Clip::poses).all(ikiru_rig::Pose::is_valid));
            write_again(&loaded);
        }
        Err(error) => {
            counts[1] += 1;
            assert!(error.to_string().starts_with("mutated.glb"));
        }
    }
}

fn write_again(loaded: &Loaded) {
    let mut random = Random::new(3);
    let pose = random_pose(&loaded.rig, &mut random);
    if let Ok(written) = write_posed_glb(loaded, &pose) {
        let again = read_glb(&written, "written.glb").unwrap();
        assert_eq!(again.rig.n_joints(), loaded.rig.n_joints());
    }
    if let Some(clip) = loaded.clips.first()
        && let Ok(written) = write_animated_glb(loaded, clip)
    {
        assert!(read_glb(&written, "written.glb").unwrap().clips.len() > loaded.clips.len() - 1);
    }
}

#[test]
fn bytes_changed_cut_and_repeated() {
    let (mut random, mut counts) = (Random::new(11), [0; 2]);
    for sample in samples() {
        for _ in 0..3000 {
            let mut bytes = sample.clone();
            for _ in 0..=random.below(3) {
                let at = random.below(bytes.len());
                match random.below(6) {
                    0 => bytes.truncate(at),
                    1 => bytes[at] ^= 1 << random.below(8),
                    2 => bytes[at] = random.bits() as u8,
                    3 => bytes[at] = b"0123456789-[]{},:\"e."[random.below(20)],
                    4 => {
                        let end = (at + random.below(40)).min(bytes.len());
                        let part = bytes[at..end].to_vec();
                        let to = random.below(bytes.len());
                        bytes.splice(to..to, part);
                    }
                    _ => {
                        let end = (at + 4).min(bytes.len());
                        bytes[at..end].fill([0, 0x7f, 0x80, 0xff][random.below(4)]);
                    }
                }
                if bytes.is_empty() {
                    bytes.push(0);
                }
            }
            // Half of them with a header that is true, so that what follows is reached.
            if random.below(2) == 0 && bytes.len() > 12 {
                let length = bytes.len() as u32;
                bytes[8..12].copy_from_slice(&length.to_le_bytes());
            }
            exercise(&bytes, &mut counts);
        }
    }
    assert!(counts.iter().all(|n| *n > 500), "{counts:?}");
}

/// Pointers to all values of a document.
fn pointers(value: &Value, at: String, out: &mut Vec<String>) {
    match value {
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, v)| pointers(v, format!("{at}/{i}"), out));
        }
        Value::Object(map) => map.iter().for_each(|(k, v)| pointers(v, format!("{at}/{k}"), out)),
        _ => {}
    }
    out.push(at);
}

#[test]
fn members_replaced() {
    let replacements = [
        json!(null),
        json!(0),
        json!(1),
        json!(-1),
        json!(3),
        json!(99),
        json!(u32::MAX),
        json!(u64::MAX),
        json!(0.5),
        json!(1e-300),
        json!(1e300),
        json!(-1e308),
        json!(""),
        json!("hip"),
        json!("rotation"),
        json!([]),
        json!({}),
        json!([0, 0, 0]),
        json!([0, 0, 0, 0]),
        json!([-1, 1, 1]),
        json!([1e40, 1, 0, 0]),
        json!([0, 1, 2]),
        json!(true),
        json!("CUBICSPLINE"),
        json!("STEP"),
        json!("VEC4"),
        json!(5120),
    ];
    let (mut random, mut counts) = (Random::new(13), [0; 2]);
    for sample in samples() {
        let (document, bin) = open(&sample);
        let mut all = Vec::new();
        pointers(&document, String::new(), &mut all);
        for _ in 0..3000 {
            let mut document = document.clone();
            for _ in 0..=random.below(2) {
                let new = replacements[random.below(replacements.len())].clone();
                if let Some(value) = document.pointer_mut(&all[random.below(all.len())]) {
                    *value = new;
                }
            }
            exercise(&glb(&document, bin.as_deref()), &mut counts);
        }
    }
    assert!(counts.iter().all(|n| *n > 500), "{counts:?}");
}
