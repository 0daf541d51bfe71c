//! Each way in which a file can be wrong, alone: the message names file, place, what was found and expected.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use ikiru_formats::{ErrorKind, Place, builtin, read, read_glb, read_gltf};
use ikiru_testkit::allocations::peak;
use serde_json::{Value, json};

/// The message for a binary file.
fn of_bytes(bytes: &[u8]) -> String {
    let message = read_glb(bytes, "bad.glb").unwrap_err().to_string();
    assert!(message.starts_with("bad.glb"), "{message}");
    message
}

/// The message for the leg with a change.
fn of(edit: impl FnOnce(&mut Value)) -> String {
    let mut document = leg();
    edit(&mut document);
    of_bytes(&glb(&document, None))
}

fn of_text(text: &str) -> String {
    read_gltf(text.as_bytes(), None, "bad.gltf").unwrap_err().to_string()
}

#[test]
fn truncated_files() {
    let whole = glb(&leg(), Some(&[0; 8]));
    for length in 0..whole.len() {
        let message = of_bytes(&whole[..length]);
        assert!(message.contains("cut short"), "{length}: {message}");
    }
    assert_eq!(
        of_bytes(&whole[..100]),
        format!(
            "bad.glb, byte 100: the file is cut short: the length in the header needs {} bytes, 100 are there",
            whole.len()
        )
    );
    assert_eq!(
        of_bytes(b"glTF\x02\0"),
        "bad.glb, byte 6: the file is cut short: the header needs 12 bytes, 6 are there"
    );
}

#[test]
fn wrong_magic_and_version() {
    let message = of_bytes(b"{\"asset\":{}}");
    assert!(message.contains(r#"begins with "{\"as", expected "glTF""#), "{message}");
    let mut bytes = glb(&leg(), None);
    bytes[4] = 1;
    assert_eq!(of_bytes(&bytes), "bad.glb, byte 4: glTF version 1 cannot be read, expected version 2.0");
    let message = of(|d| d["asset"]["version"] = json!("1.0"));
    assert_eq!(message, "bad.glb, /asset/version: glTF version 1.0 cannot be read, expected version 2.0");
    let message = of(|d| d["asset"]["minVersion"] = json!("2.7"));
    assert!(message.contains("/asset/minVersion: glTF version 2.7"), "{message}");
}

#[test]
fn lengths_that_lie() {
    let whole = glb(&leg(), Some(&[0; 8]));
    let mut bytes = whole.clone();
    bytes[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    let message = of_bytes(&bytes);
    assert!(message.contains("byte 12: the JSON chunk claims 4294967295 bytes, where"), "{message}");
    let mut bytes = whole.clone();
    let at = whole.len() - 16;
    bytes[at] = 9;
    let message = of_bytes(&bytes);
    assert_eq!(message, format!("bad.glb, byte {at}: the BIN chunk claims 9 bytes, where 8 are available"));
    let mut bytes = whole.clone();
    bytes[at] = 4;
    assert!(of_bytes(&bytes).contains("the header of a chunk needs 8 bytes, 4 are there"));
    let mut bytes = whole;
    bytes[16..20].copy_from_slice(b"BIN\0");
    assert!(
        of_bytes(&bytes)
            .contains("byte 16: the first chunk is of type 0x004e4942, expected JSON (0x4e4f534a)")
    );
}

#[test]
fn texts_that_are_not_json() {
    assert_eq!(
        of_text("{\n  \"nodes\": [}\n"),
        "bad.gltf, /nodes/0 (line 2 column 13 of the JSON text): not valid JSON: expected value"
    );
    assert!(of_text("").contains("not valid JSON: EOF while parsing"));
    assert!(of_text("{} x").contains("trailing characters"));
    let message = of_bytes(&glb_of_text(b"{\"a\":\"\xff\"}", None));
    assert_eq!(message, "bad.glb, byte 26: the JSON text is not UTF-8");
    let deep = "[".repeat(1_000_000);
    let message = of_text(&format!("{{\"extras\":{deep}"));
    assert!(message.contains("EOF"), "{message}");
    let message = of_text(&format!("{{\"nodes\":{deep}"));
    assert!(message.contains("/nodes/0"), "{message}");
}

#[test]
fn members_of_the_wrong_type() {
    let message = of(|d| d["nodes"][1]["rotation"] = json!([0, 0, 1]));
    assert!(message.contains("/nodes/1/rotation (line 1 column"), "{message}");
    assert!(message.ends_with("invalid length 3, expected an array of length 4"), "{message}");
    let message = of(|d| d["nodes"][1]["translation"] = json!([0, null, 1]));
    assert!(message.contains("/nodes/1/translation/1"), "{message}");
    assert!(message.contains("not as glTF has it: invalid type: null, expected f64"), "{message}");
    let message = of(|d| d["nodes"] = json!({ "0": {} }));
    assert!(message.contains("/nodes (") && message.contains("expected a list"), "{message}");
    let message = of(|d| d["nodes"][2]["children"] = json!([-1]));
    assert!(message.contains("/nodes/2/children/0") && message.contains("`-1`"), "{message}");
    let message = of_text(r#"{"nodes":[{"translation":[1e999,0,0]}]}"#);
    assert!(message.contains("/nodes/0/translation") && message.contains("number out of range"), "{message}");
    let message = of(|d| d["nodes"][2] = json!("foot"));
    assert!(message.ends_with("invalid type: string \"foot\", expected a node object"), "{message}");
    let message = of(|d| d["skins"][0] = json!({}));
    assert!(message.contains("/skins/0") && message.contains("missing field `joints`"), "{message}");
}

#[test]
fn indices_out_of_range() {
    assert_eq!(
        of(|d| d["nodes"][1]["children"] = json!([2, 3])),
        "bad.glb, /nodes/1/children/1: node 3 does not exist: there are numbers 0 to 2"
    );
    assert_eq!(
        of(|d| d["scenes"][0]["nodes"] = json!([0, 99])),
        "bad.glb, /scenes/0/nodes/1: node 99 does not exist: there are numbers 0 to 2"
    );
    assert_eq!(
        of(|d| d["scene"] = json!(1)),
        "bad.glb, /scene: scene 1 does not exist: there is only number 0"
    );
    assert_eq!(
        of(|d| d["skins"][0]["joints"] = json!([0, 4_294_967_295u32])),
        "bad.glb, /skins/0/joints/1: node 4294967295 does not exist: there are numbers 0 to 2"
    );
}

#[test]
fn nodes_that_are_no_tree() {
    assert_eq!(
        of(|d| d["nodes"][2]["children"] = json!([1])),
        "bad.glb, /nodes/2/children/0: node 1 is a child of node 0 and again of node 2: expected one parent"
    );
    assert!(
        of(|d| d["nodes"][0]["children"] = json!([1, 1])).contains("child of node 0 and again of node 0")
    );
    let message = of(|d| d["nodes"][2]["children"] = json!([0]));
    assert!(message.contains("is its own ancestor: expected a tree"), "{message}");
    let cycle = of(|d| {
        d["nodes"].as_array_mut().unwrap().extend([json!({ "children": [4] }), json!({ "children": [3] })]);
    });
    assert!(
        cycle.contains("/nodes/4: node 4 is its own") || cycle.contains("/nodes/3: node 3 is its own"),
        "{cycle}"
    );
    assert!(of(|d| d["nodes"][2]["children"] = json!([2])).contains("node 2"));
    assert_eq!(
        of(|d| d["scenes"][0]["nodes"] = json!([0, 1])),
        "bad.glb, /scenes/0/nodes/1: node 1 is listed as a root but is a child of node 0"
    );
    let twice = of(|d| d["scenes"][0]["nodes"] = json!([0, 0]));
    assert_eq!(twice, "bad.glb, /scenes/0/nodes/1: node 0 is listed as a root twice");
    assert_eq!(of(|d| d["nodes"] = json!([])), "bad.glb: the document has no nodes, expected at least one");
    let message = of(|d| d["scenes"][0] = json!({}));
    assert_eq!(message, "bad.glb: the default scene has no nodes, expected at least one");
}

#[test]
fn transforms_that_are_none() {
    assert_eq!(
        of(|d| d["nodes"][1]["rotation"] = json!([0.0, 0.0, 0.0, 0.0])),
        "bad.glb, /nodes/1/rotation: the rotation [0.0, 0.0, 0.0, 0.0] has the length 0: expected a unit quaternion"
    );
    let message = of(|d| d["nodes"][1]["scale"] = json!([1, 0, 1]));
    assert_eq!(
        message,
        "bad.glb, /nodes/1/scale: the scale [1.0, 0.0, 1.0] has the length 0: expected a scale other than 0"
    );
    let message = of(|d| d["nodes"][1]["translation"] = json!([1e300, 0, 1]));
    assert!(
        message.contains("/nodes/1/translation: the translation [1e300, 0.0, 1.0] is too large"),
        "{message}"
    );
    let message = of(|d| d["nodes"][1]["scale"] = json!([1e-200, 1e-200, 1e-200]));
    assert!(message.contains("/nodes/1/scale"), "{message}");
    let message = of(|d| {
        d["nodes"][0]["scale"] = json!([1e90, 1e90, 1e90]);
        d["nodes"][1]["scale"] = json!([1e90, 1e90, 1e90]);
    });
    assert!(message.contains("/nodes/1: with the scale of its parents, the scale"), "{message}");
    let matrix = |matrix: [f64; 16]| {
        of(|d| {
            d["nodes"][1] = json!({ "matrix": matrix, "children": [2] });
        })
    };
    let mut shear = glam::DMat4::IDENTITY.to_cols_array();
    shear[4] = 0.5;
    let message = matrix(shear);
    assert!(message.contains("/nodes/1/matrix: the matrix [1.0, 0.0,"), "{message}");
    assert!(message.contains("has a shear: expected perpendicular axes"), "{message}");
    assert!(matrix([0.0; 16]).contains("is no affine transform: expected the last row 0, 0, 0, 1"));
    let mut flat = glam::DMat4::IDENTITY.to_cols_array();
    flat[10] = 0.0;
    assert!(matrix(flat).contains("has the length 0: expected three axes"));
}

#[test]
fn references_out_of_the_folder() {
    let folder = std::env::temp_dir().join(format!("ikiru-formats-uri-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("inside")).unwrap();
    std::fs::write(folder.join("secret.bin"), [1; 4]).unwrap();
    let message = |uri: &str| {
        let mut document = leg();
        document["buffers"] = json!([{ "byteLength": 4, "uri": uri }]);
        let text = document.to_string();
        read_gltf(text.as_bytes(), Some(&folder.join("inside")), "bad.gltf")
            .map(|_| ())
            .map_err(|e| e.to_string())
    };
    for (uri, reason) in [
        ("../secret.bin", "leaves the folder"),
        ("%2e%2E/secret.bin", "leaves the folder"),
        ("..%2Fsecret.bin", "leaves the folder"),
        ("a/../../secret.bin", "leaves the folder"),
        ("..\\secret.bin", "leaves the folder"),
        ("/etc/passwd", "is absolute"),
        ("%2Fetc/passwd", "is absolute"),
        ("\\\\server\\share", "is absolute"),
        ("file:///etc/passwd", "names a scheme or a drive"),
        ("https://example.org/a.bin", "names a scheme or a drive"),
        ("C:\\a.bin", "names a scheme or a drive"),
        ("C%3A/a.bin", "has characters that no file name has"),
        ("a%00.bin", "has characters that no file name has"),
        ("%ff.bin", "is not UTF-8"),
        ("", "names no file"),
    ] {
        let found = message(uri).unwrap_err();
        assert!(found.starts_with("bad.gltf, /buffers/0/uri: the reference '"), "{found}");
        assert!(found.contains(reason) && found.contains("expected a file in the folder"), "{uri}: {found}");
    }
    // A file that is missing, and data that is broken, matter only to who needs them.
    for uri in ["gone.bin", "data:application/octet-stream;base64,@@@", "data:nothing"] {
        assert_eq!(message(uri), Ok(()), "{uri}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(folder.join("secret.bin"), folder.join("inside/link.bin")).unwrap();
        let mut document = leg();
        document["buffers"] = json!([{ "byteLength": 4, "uri": "link.bin" }]);
        let text = document.to_string();
        let loaded = read_gltf(text.as_bytes(), Some(&folder.join("inside")), "bad.gltf").unwrap();
        let error = ikiru_formats::write_posed_glb(&loaded, &loaded.rig.rest_pose()).unwrap_err().to_string();
        assert!(error.contains("'link.bin' leads out of the folder by a link"), "{error}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn more_nodes_than_a_rig_may_have_are_refused_at_once() {
    let mut text = String::from(r#"{"asset":{"version":"2.0"},"nodes":[{}"#);
    text.push_str(&",{}".repeat(10_000_000));
    text.push_str("]}");
    let mut result = None;
    // The nodes of a rig, and not the ten million that there are: those would take gigabytes.
    let held = peak(|| result = Some(read_gltf(text.as_bytes(), None, "bad.gltf")));
    assert!(held < text.len() + (64 << 20), "{held} bytes");
    let error = result.unwrap().unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::TooMany { most: 100_000 }), "{error}");
    assert!(matches!(error.place(), Place::Text { pointer, .. } if pointer == "/nodes"), "{error}");
    let text = error.to_string();
    assert!(text.contains("/nodes") && text.contains("more than 100000 elements"), "{text}");
}

#[test]
fn names_of_files_and_rigs() {
    let message = read("nowhere/rig.glb").unwrap_err().to_string();
    assert!(message.starts_with("nowhere/rig.glb: cannot read the file:"), "{message}");
    let message = read("rig.fbx").unwrap_err().to_string();
    assert_eq!(
        message,
        "rig.fbx: the ending '.fbx' is not one that can be read: expected .glb, .gltf, .vrm, .vrma, .bvh or .urdf"
    );
    assert!(read("rig").unwrap_err().to_string().contains("the ending '' is not one"));
    let expected = "builtin:hooman: there is no built-in rig 'hooman': \
                    expected one of builtin:human, builtin:reference, \
                    builtin:panda, builtin:ur5, builtin:xarm7, builtin:g1";
    assert_eq!(builtin("hooman").unwrap_err().to_string(), expected);
    assert_eq!(read("builtin:hooman").unwrap_err().to_string(), expected);
}
