//! glTF, GLB and VRMA that were not made in good faith: whatever comes in, there is an answer, with bounded work
//! and memory.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use std::fmt::Write;

use crate::common::bounds::{self, MIB};
use crate::common::glb_of_text;
use ikiru_formats::{Error, Loaded, read_glb, read_gltf, read_vrma};

/// Reads, and asserts that work and memory are within what is promised. The reader's own copy of the file is
/// part of what is counted.
#[track_caller]
fn bounded(bytes: &[u8], read: fn(&[u8]) -> Result<Loaded, Error>) -> Result<Loaded, Error> {
    bounds::bounded(bytes.len(), 0, || read(bytes))
}

#[track_caller]
fn gltf(text: &str) -> Result<Loaded, Error> {
    bounded(text.as_bytes(), |bytes| read_gltf(bytes, None, "hostile.gltf"))
}

#[track_caller]
fn glb(text: &str, bin: &[u8]) -> Result<Loaded, Error> {
    bounded(&glb_of_text(text.as_bytes(), Some(bin)), |bytes| read_glb(bytes, "hostile.glb"))
}

/// The message of an error, which may not be long.
#[track_caller]
fn message(text: &str) -> String {
    let message = gltf(text).unwrap_err().to_string();
    assert!(message.len() < 1500, "{}", message.len());
    message
}

/// A document with some members besides its version.
fn document(members: &str) -> String {
    format!(r#"{{"asset":{{"version":"2.0"}},{members}}}"#)
}

/// `n` times a text that knows its place, with commas between.
fn list(n: usize, element: impl Fn(usize) -> String) -> String {
    (0..n).map(element).collect::<Vec<_>>().join(",")
}

/// Buffer and accessors of two keys: 0 holds their times, 1 and 2 hold rotations and translations.
const KEYS: &str = r#""buffers":[{"byteLength":40}],"bufferViews":[{"buffer":0,"byteLength":40}],"accessors":[
    {"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR"},
    {"bufferView":0,"byteOffset":8,"componentType":5126,"count":2,"type":"VEC4"},
    {"bufferView":0,"byteOffset":8,"componentType":5126,"count":2,"type":"VEC3"}]"#;

fn keys() -> Vec<u8> {
    let numbers = [0.0f32, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

#[test]
fn many_nodes() {
    for node in ["{}", r#"{"name":"a"}"#, r#"{"scale":[2,2,2]}"#, r#"{"scale":[1,2,3],"rotation":[0,0,2,2]}"#]
    {
        let loaded =
            gltf(&document(&format!(r#""nodes":[{}]"#, list(100_000, |_| node.to_owned())))).unwrap();
        assert_eq!(loaded.rig.n_joints(), 100_000);
        assert!(loaded.warnings.len() <= 101);
    }
    let many = message(&document(&format!(r#""nodes":[{}]"#, list(2_000_000, |_| "{}".to_owned()))));
    assert!(many.contains("more than 100000 elements"), "{many}");
    // All of them skinned, so that each has coordinates.
    let (nodes, joints) = (list(100_000, |_| "{}".to_owned()), list(100_000, |n| n.to_string()));
    let skinned = document(&format!(r#""nodes":[{nodes}],"skins":[{{"joints":[{joints}]}}]"#));
    assert_eq!(gltf(&skinned).unwrap().rig.n_coords(), 400_000);
}

#[test]
fn deep_trees() {
    let node =
        |n: usize| if n == 99_999 { "{}".to_owned() } else { format!(r#"{{"children":[{}]}}"#, n + 1) };
    let loaded = gltf(&document(&format!(r#""nodes":[{}]"#, list(100_000, node)))).unwrap();
    assert_eq!(loaded.rig.n_joints(), 100_000);
    let grows = |n: usize| format!(r#"{{"scale":[2,2,2],{}"#, &node(n)[1..]);
    let text = document(&format!(r#""nodes":[{}]"#, list(99_999, grows) + ",{}"));
    assert!(message(&text).contains("with the scale of its parents"));
    let circle = list(100_000, |n| format!(r#"{{"children":[{}]}}"#, (n + 1) % 100_000));
    assert!(message(&document(&format!(r#""nodes":[{circle}]"#))).contains("own ancestor"));
}

#[test]
fn deep_and_wide_members_that_nobody_reads() {
    let deep = format!("{}{}", "[".repeat(5 * MIB), "]".repeat(5 * MIB));
    for place in [
        format!(r#""nodes":[{{}}],"extras":{deep}"#),
        format!(r#""nodes":[{{"extras":{deep}}}]"#),
        format!(r#""nodes":[{{}}],"accessors":{deep},"bufferViews":{deep}"#),
        format!(r#""nodes":[{{}}],"animations":[{deep}]"#),
        format!(r#""nodes":[{{}}],"extensions":{{"VRMC_vrm":{deep}}}"#),
        format!(r#""nodes":[{{}}],"meshes":[{{"primitives":[{{"attributes":{}}}]}}]"#, attributes(500_000)),
        format!(r#""nodes":[{}]"#, attributes(500_000).replacen('{', r#"{"name":"a","#, 1)),
    ] {
        assert_eq!(gltf(&document(&place)).unwrap().rig.n_joints(), 1);
    }
    for open in ["[", r#"{"a":"#, r#"{"nodes":[{"extras":["#] {
        assert!(gltf(&open.repeat(3 * MIB)).is_err());
    }
}

fn attributes(n: usize) -> String {
    format!("{{{}}}", list(n, |n| format!(r#""_{n}":{n}"#)))
}

#[test]
fn long_lists_of_numbers() {
    let zeros = list(10_000_000, |_| "0".to_owned());
    assert!(
        message(&document(&format!(r#""nodes":[{{}}],"scenes":[{{"nodes":[{zeros}]}}]"#))).contains("twice")
    );
    assert!(
        message(&document(&format!(r#""nodes":[{{"children":[{zeros}]}}]"#))).contains("/nodes/0/children/1")
    );
    gltf(&document(&format!(r#""nodes":[{{}}],"skins":[{{"joints":[{zeros}]}}]"#))).unwrap();
    assert!(gltf(&document(&format!(r#""nodes":[{{"translation":[{zeros}]}}]"#))).is_err());
    assert!(
        message(&document(&format!(r#""nodes":[{{"scale":[1,1,{}]}}]"#, "9".repeat(MIB)))).contains("range")
    );
}

#[test]
fn long_names() {
    let long = "n".repeat(20 * MIB);
    let one = gltf(&document(&format!(r#""nodes":[{{"name":"{long}"}}]"#))).unwrap();
    assert_eq!(one.rig.joints()[0].name.len(), long.len());
    let name = "n".repeat(MIB);
    let same = list(30, |_| format!(r#"{{"name":"{name}"}}"#));
    assert_eq!(gltf(&document(&format!(r#""nodes":[{same}]"#))).unwrap().rig.n_joints(), 30);
    let escaped = r"\u0001".repeat(4 * MIB);
    gltf(&document(&format!(r#""nodes":[{{"name":"{escaped}"}}]"#))).unwrap();
    assert!(gltf(&document(&format!(r#""{long}":[{{]"#))).is_err());
    assert!(message(&format!(r#"{{"asset":{{"version":"{long}"}},"nodes":[{{}}]}}"#)).contains("version"));
    assert!(
        message(&document(&format!(r#""nodes":[{{}}],"buffers":[{{"byteLength":0,"uri":"/{long}"}}]"#)))
            .contains("is absolute")
    );
}

#[test]
fn errors_below_long_names_are_short() {
    let long = "n".repeat(MIB);
    let bones = format!(
        r#""nodes":[{{}}],"extensions":{{"VRMC_vrm":{{"humanoid":{{"humanBones":{{"{long}":0}}}}}}}}"#
    );
    let loaded = gltf(&document(&bones)).unwrap();
    assert!(loaded.warnings.iter().all(|warning| warning.to_string().len() < 1500));
    message(&document(&format!(r#""{long}":{{"nodes":]"#)));
}

#[test]
fn claims_of_what_is_not_there() {
    let most = u64::MAX;
    let claims = [
        format!(r#""nodes":[{{}}],"buffers":[{{"byteLength":{most}}}]"#),
        format!(r#""nodes":[{{}}],"buffers":[{{"byteLength":{most},"uri":"data:;base64,AAAA"}}]"#),
        moving(&format!(r#""accessors":[{{"componentType":5126,"count":{most},"type":"SCALAR"}}]"#)),
        moving(
            r#""accessors":[{"componentType":5126,"count":65000,"type":"SCALAR"},{"componentType":5126,"count":65000,"type":"VEC4"}]"#,
        ),
        moving(&format!(
            r#""accessors":[{{"bufferView":0,"byteOffset":{most},"componentType":5126,"count":{most},"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteOffset":{most},"byteLength":{most},"byteStride":{most}}}],
            "buffers":[{{"byteLength":{most}}}]"#
        )),
        moving(&format!(
            r#""accessors":[{{"componentType":5126,"count":1,"type":"SCALAR","sparse":{{"count":{most},
            "indices":{{"bufferView":{0},"byteOffset":{most},"componentType":5125}},"values":{{"bufferView":{0}}}}}}}]"#,
            u32::MAX
        )),
    ];
    for members in claims {
        assert_eq!(gltf(&document(&members)).unwrap().clips.len(), 0, "{members}");
    }
    for at in [8, 12, 28] {
        let mut bytes = glb_of_text(document(r#""nodes":[{}]"#).as_bytes(), Some(&[0; 8]));
        bytes[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        let _ = bounded(&bytes, |bytes| read_glb(bytes, "hostile.glb"));
    }
}

/// A skinned node with an animation, and some more members.
fn moving(members: &str) -> String {
    format!(
        r#""nodes":[{{}}],"skins":[{{"joints":[0]}}],"animations":[{{"channels":[{{"sampler":0,
        "target":{{"node":0,"path":"rotation"}}}}],"samplers":[{{"input":0,"output":1}}]}}],{members}"#
    )
}

#[test]
fn many_accessors_views_and_buffers() {
    let n = 300_000;
    let accessors = list(n, |_| r#"{"componentType":1,"count":1,"type":"VEC4"}"#.to_owned());
    gltf(&document(&moving(&format!(r#""accessors":[{accessors}]"#)))).unwrap();
    let views = list(n, |_| r#"{"buffer":0,"byteLength":0}"#.to_owned());
    gltf(&document(&moving(&format!(r#""bufferViews":[{views}],"accessors":[{accessors}]"#)))).unwrap();
    let sparse = list(n, |_| {
        r#"{"componentType":1,"count":1,"type":"VEC4","sparse":{"count":0,"indices":{"bufferView":0,"componentType":1},"values":{"bufferView":0}}}"#.to_owned()
    });
    gltf(&document(&moving(&format!(r#""accessors":[{sparse}]"#)))).unwrap();
    for buffer in [
        r#"{"byteLength":0}"#,
        r#"{"byteLength":0,"uri":"a"}"#,
        r#"{"byteLength":0,"uri":"data:,"}"#,
        r#"{"byteLength":9,"uri":"data:;base64,AAAAAAAA"}"#,
    ] {
        let buffers = list(100_000, |_| buffer.to_owned());
        gltf(&document(&moving(&format!(r#""buffers":[{buffers}],{}"#, KEYS.split_once("],").unwrap().1))))
            .unwrap();
    }
    let named = list(100_000, |n| format!(r#"{{"byteLength":0,"uri":"{n}"}}"#));
    gltf(&document(&moving(&format!(r#""buffers":[{named}]"#)))).unwrap();
    let data = "A".repeat(30 * MIB);
    gltf(&document(&moving(&format!(r#""buffers":[{{"byteLength":0,"uri":"data:;base64,{data}"}}]"#))))
        .unwrap();
    gltf(&document(&moving(&format!(
        r#""buffers":[{{"byteLength":0,"uri":"data:,{}"}}]"#,
        "%41".repeat(9 * MIB)
    ))))
    .unwrap();
}

#[test]
fn a_long_reference_named_by_many_animations() {
    let animation = r#"{"channels":[{"sampler":0,"target":{"node":0,"path":"rotation"}}],"samplers":[{"input":0,"output":1}]}"#;
    let long = "u".repeat(30 * MIB);
    let members = format!(
        r#""nodes":[{{}}],"skins":[{{"joints":[0]}}],"animations":[{}],"buffers":[{{"byteLength":40,"uri":"{long}"}}],{}"#,
        list(200, |_| animation.to_owned()),
        KEYS.split_once("],").unwrap().1
    );
    let text = document(&members);
    let loaded = gltf(&text).unwrap();
    assert_eq!(loaded.warnings.len(), 101);
    assert!(loaded.warnings.iter().all(|warning| warning.to_string().len() < 1500));
    let folder = std::env::temp_dir();
    bounds::bounded(text.len(), 0, || read_gltf(text.as_bytes(), Some(&folder), "hostile.gltf").unwrap());
}

#[test]
fn many_animations_of_many_nodes() {
    let nodes = list(100_000, |_| "{}".to_owned());
    let animations = |n: usize, path: &str, output: u32| {
        list(n, |_| {
            format!(
                r#"{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"{path}"}}}}],"samplers":[{{"input":0,"output":{output}}}]}}"#
            )
        })
    };
    // What is asked of the whole rig is asked once a file, not once a clip.
    for (path, output, n_clips) in [("translation", 2, 0), ("rotation", 1, 50_000)] {
        let animations = animations(50_000, path, output);
        let members =
            format!(r#""nodes":[{nodes}],"skins":[{{"joints":[0]}}],"animations":[{animations}],{KEYS}"#);
        let loaded = glb(&document(&members), &keys()).unwrap();
        assert_eq!(loaded.clips.len(), n_clips);
    }
    let tiny = list(2_000_000, |_| "0".to_owned());
    // That the node has no name, and that there are too many.
    assert_eq!(
        gltf(&document(&format!(r#""nodes":[{{}}],"animations":[{tiny}]"#))).unwrap().warnings.len(),
        2
    );
    let empty = list(100_000, |_| r#"{"channels":[],"samplers":[]}"#.to_owned());
    gltf(&document(&format!(r#""nodes":[{{}}],"animations":[{empty}]"#))).unwrap();
}

#[test]
fn many_channels() {
    let nodes = list(100_000, |_| "{}".to_owned());
    let joints = list(100_000, |n| n.to_string());
    let channels = list(100_000, |n| format!(r#"{{"sampler":0,"target":{{"node":{n},"path":"rotation"}}}}"#));
    let members = format!(
        r#""nodes":[{nodes}],"skins":[{{"joints":[{joints}]}}],"animations":[{{"channels":[{channels}],
        "samplers":[{{"input":0,"output":1}}]}}],{KEYS}"#
    );
    assert_eq!(glb(&document(&members), &keys()).unwrap().clips[0].poses().len(), 2);
    let without_node = list(400_000, |_| r#"{"sampler":0,"target":{"path":""}}"#.to_owned());
    let other = list(400_000, |n| format!(r#"{{"sampler":0,"target":{{"node":0,"path":"{n}"}}}}"#));
    for channels in [without_node, other] {
        let samplers = list(400_000, |_| r#"{"input":0,"output":0}"#.to_owned());
        let members =
            format!(r#""nodes":[{{}}],"animations":[{{"channels":[{channels}],"samplers":[{samplers}]}}]"#);
        assert_eq!(gltf(&document(&members)).unwrap().clips.len(), 0);
    }
}

#[test]
fn sparse_accessors_that_are_long() {
    let n = 1_000_000u32;
    let bin: Vec<u8> = (0..n).flat_map(u32::to_le_bytes).collect();
    let accessor = format!(
        r#"{{"componentType":5126,"count":{n},"type":"SCALAR","sparse":{{"count":{n},
        "indices":{{"bufferView":0,"componentType":5125}},"values":{{"bufferView":0}}}}}}"#
    );
    let animations = list(20_000, |idx| {
        let input = idx % 100;
        format!(
            r#"{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}],"samplers":[{{"input":{input},"output":{input}}}]}}"#
        )
    });
    let members = format!(
        r#""nodes":[{{}}],"skins":[{{"joints":[0]}}],"buffers":[{{"byteLength":{0}}}],"animations":[{animations}],
        "bufferViews":[{{"buffer":0,"byteLength":{0}}}],"accessors":[{1}]"#,
        bin.len(),
        list(100, |_| accessor.clone())
    );
    assert_eq!(glb(&document(&members), &bin).unwrap().clips.len(), 0);
}

#[test]
fn dense_keys() {
    // The same bytes are times and, as small integers, rotations.
    for (n, steps) in [
        (100_000u32, "LINEAR"),
        (450_000, "LINEAR"),
        (2_000_000, "LINEAR"),
        (300_000, "STEP"),
        (100_000, "CUBICSPLINE"),
    ] {
        let bin: Vec<u8> = (1..=n).flat_map(|n| (n as f32).to_le_bytes()).collect();
        let (bytes, rotations) = (bin.len(), if steps == "CUBICSPLINE" { 3 * (n / 3) } else { n });
        let times = if steps == "CUBICSPLINE" { n / 3 } else { n };
        let members = format!(
            r#""nodes":[{{"name":"{}"}}],"skins":[{{"joints":[0]}}],"buffers":[{{"byteLength":{bytes}}}],
            "bufferViews":[{{"buffer":0,"byteLength":{bytes}}}],"accessors":[
            {{"bufferView":0,"componentType":5126,"count":{times},"type":"SCALAR"}},
            {{"bufferView":0,"componentType":5121,"count":{rotations},"type":"VEC4"}}],
            "animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}],
            "samplers":[{{"input":0,"output":1,"interpolation":"{steps}"}}]}}]"#,
            "n".repeat(MIB)
        );
        let loaded = glb(&document(&members), &bin).unwrap();
        assert_eq!(loaded.clips.len() + loaded.warnings.len(), 1, "{:?}", loaded.warnings);
    }
}

#[test]
fn animations_of_avatars() {
    let vrma = |text: &str, bin: &[u8]| {
        bounded(&glb_of_text(text.as_bytes(), Some(bin)), |bytes| read_vrma(bytes, "hostile.vrma"))
    };
    let humanoid = |bones: &str| {
        format!(r#""extensions":{{"VRMC_vrm_animation":{{"humanoid":{{"humanBones":{{{bones}}}}}}}}}"#)
    };
    let nodes = list(100_000, |_| "{}".to_owned());
    // Bones that do not exist, by the hundred thousand, and long ones.
    let unknown = list(200_000, |n| format!(r#""{n}":{{"node":{n}}}"#));
    let loaded = vrma(&document(&format!(r#""nodes":[{nodes}],{}"#, humanoid(&unknown))), &[]).unwrap();
    assert_eq!(loaded.warnings.len(), 101);
    let long = list(30, |n| format!(r#""{n}{}":{{"node":0}}"#, "b".repeat(MIB)));
    let loaded = vrma(&document(&format!(r#""nodes":[{nodes}],{}"#, humanoid(&long))), &[]).unwrap();
    assert!(loaded.warnings.iter().all(|warning| warning.to_string().len() < 1500));
    // Hips that move, in many clips.
    let mut animations = String::new();
    for path in ["rotation", "translation"] {
        for _ in 0..20_000 {
            let output = if path == "rotation" { 1 } else { 2 };
            let comma = if animations.is_empty() { "" } else { "," };
            write!(
                animations,
                r#"{comma}{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"{path}"}}}}],"samplers":[{{"input":0,"output":{output}}}]}}"#
            )
            .unwrap();
        }
    }
    let hips = humanoid(r#""hips":{"node":0}"#);
    let members = format!(r#""nodes":[{nodes}],{hips},"animations":[{animations}],{KEYS}"#);
    assert_eq!(vrma(&document(&members), &keys()).unwrap().clips.len(), 40_000);
    assert!(vrma(&document(r#""nodes":[{}]"#), &[]).is_err());
}
