//! Motions as JSON and CSV: what is written comes back, has the promised members, and wrong text is told precisely.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use glam::{DQuat, DVec3};
use ikiru_formats::{ErrorKind, Place, motion_csv, motion_json, read_motion_json};
use ikiru_rig::{Clip, EulerOrder, Joint, JointId, JointMotion, Mimic, Pose, Range, Rig, RigBuilder};
use ikiru_testkit::allocations::peak;
use ikiru_testkit::rigs::{Random, random_pose, rigs};
use proptest::prelude::*;
use serde_json::{Value, json};

fn random_clip(rig: &Rig, n: usize, seed: u64) -> Clip {
    let mut random = Random::new(seed);
    let poses = (0..n).map(|_| random_pose(rig, &mut random)).collect();
    let times = (0..n).map(|i| 0.1 * i as f64 + 0.05 * random.unit()).collect();
    Clip::new("motion", times, poses).unwrap()
}

fn apart(a: &Pose, b: &Pose) -> f64 {
    a.difference(b).unwrap().iter().fold(0.0, |most, d| d.abs().max(most))
}

fn all(rig: &Rig) -> Vec<JointId> {
    rig.ids().collect()
}

/// One joint of every motion: a free root, a hinge about y, its follower, a slider, an Euler joint, a ball, a
/// fixed one, and a free one that is no root.
fn sample() -> Rig {
    let mut builder = RigBuilder::new();
    let mut add = |name: &str, parent: Option<JointId>, motion: JointMotion, mimic: Option<Mimic>| {
        let mut joint = Joint::new(name, parent);
        joint.rest_translation = DVec3::Y;
        (joint.motion, joint.mimic) = (motion, mimic);
        builder.add(joint)
    };
    let root = add("root", None, JointMotion::FREE, None);
    let hinge =
        add("hinge", Some(root), JointMotion::Hinge { axis: DVec3::Y, range: Range::new(3.0, 9.0) }, None);
    let mimic = Mimic { leader: hinge, multiplier: 0.5, offset: 0.0 };
    let follower = JointMotion::Hinge { axis: DVec3::X, range: Range::UNLIMITED };
    add("follower", Some(hinge), follower, Some(mimic));
    add("slider", Some(root), JointMotion::Slider { axis: DVec3::X, range: Range::UNLIMITED }, None);
    add(
        "euler",
        Some(root),
        JointMotion::Euler { order: EulerOrder::Zyx, ranges: [Range::UNLIMITED; 3] },
        None,
    );
    add("ball", Some(root), JointMotion::BALL, None);
    add("fixed", Some(root), JointMotion::Fixed, None);
    add("loose", Some(root), JointMotion::FREE, None);
    builder.build().unwrap()
}

/// Two frames of [`sample`], with everything.
fn document() -> Value {
    let rig = sample();
    let id = |name: &str| rig.joint(name).unwrap();
    let mut pose = rig.rest_pose();
    pose.set_translation(id("root"), DVec3::new(0.5, 1.0, -2.0)).unwrap();
    pose.set_value(id("hinge"), 7.0).unwrap();
    pose.set_value(id("slider"), 0.25).unwrap();
    pose.set_euler(id("euler"), [0.1, 0.2, 4.0]).unwrap();
    pose.set_rotation(id("ball"), DQuat::from_rotation_x(1.0)).unwrap();
    pose.set_translation(id("loose"), DVec3::Z).unwrap();
    let clip = Clip::new("sample", vec![0.0, 0.5], vec![pose, rig.rest_pose()]).unwrap();
    motion_json(&clip, &all(&rig))
}

fn read(document: &Value) -> Result<Clip, ikiru_formats::Error> {
    read_motion_json(document.to_string().as_bytes(), "sample.json", &sample())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_motion_comes_back((rig, seed) in rigs(20), n in 1..5usize) {
        let clip = random_clip(&rig, n, seed);
        let document = motion_json(&clip, &all(&rig));
        let again = read_motion_json(document.to_string().as_bytes(), "a/motion.json", &rig).unwrap();
        prop_assert_eq!((again.name(), again.times()), ("motion", clip.times()));
        for (a, b) in clip.poses().iter().zip(again.poses()) {
            prop_assert!(apart(a, b) < 1e-9);
        }
        // Rotations alone tell everything but whole turns, offsets, and where loose joints are.
        let mut bare = document.clone();
        bare.as_object_mut().unwrap().remove("angles");
        bare.as_object_mut().unwrap().remove("translations");
        let bare = read_motion_json(bare.to_string().as_bytes(), "motion.json", &rig).unwrap();
        for (a, b) in clip.poses().iter().zip(bare.poses()) {
            for id in rig.ids() {
                if rig.get(id).unwrap().mimic.is_none() {
                    prop_assert!(a.rotation(id).unwrap().dot(b.rotation(id).unwrap()).abs() > 1.0 - 1e-12);
                }
            }
        }
    }

    #[test]
    fn tables_have_a_number_for_everything((rig, seed) in rigs(20), n in 1..5usize) {
        let clip = random_clip(&rig, n, seed);
        let table = motion_csv(&clip, &all(&rig)).unwrap();
        let mut reader = csv::Reader::from_reader(table.as_slice());
        let names: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
        let rows: Vec<Vec<f64>> =
            reader.records().map(|row| row.unwrap().iter().map(|cell| cell.parse().unwrap()).collect()).collect();
        prop_assert_eq!(rows.len(), n);
        let mut unique = names.clone();
        unique.sort();
        unique.dedup();
        prop_assert_eq!(unique.len(), names.len());
        // Angles without limits go on from row to row.
        let clip = clip.unwrapped();
        for (row, (secs, pose)) in rows.iter().zip(clip.times().iter().zip(clip.poses())) {
            let of = |name: String| row[names.iter().position(|n| *n == name).unwrap()];
            prop_assert_eq!(of("time_secs".to_owned()), *secs);
            for id in rig.ids() {
                let joint = rig.get(id).unwrap();
                let name = &joint.name;
                let parts = |parts: &[&str]| -> Vec<f64> { parts.iter().map(|p| of(format!("{name}.{p}"))).collect() };
                match joint.motion {
                    JointMotion::Fixed => {
                        let prefix = format!("{name}.");
                        prop_assert!(names.iter().all(|name| !name.starts_with(&prefix)));
                    }
                    JointMotion::Hinge { .. } => prop_assert_eq!(parts(&["angle_deg"])[0], pose.value(id).unwrap().to_degrees()),
                    JointMotion::Slider { .. } => prop_assert_eq!(parts(&["offset"])[0], pose.value(id).unwrap()),
                    JointMotion::Euler { .. } => prop_assert_eq!(
                        parts(&["x_deg", "y_deg", "z_deg"]), pose.euler(id).unwrap().map(f64::to_degrees)),
                    JointMotion::Ball { .. } | JointMotion::Free { .. } => {
                        let q = DQuat::from_slice(&parts(&["x", "y", "z", "w"]));
                        prop_assert!(q == pose.rotation(id).unwrap() || q == -pose.rotation(id).unwrap());
                        let at = pose.translation(id).unwrap().to_array();
                        if rig.root() == Some(id) {
                            let root = ["x", "y", "z"].map(|axis| of(format!("root_translation.{axis}")));
                            prop_assert_eq!(root, at);
                        } else if matches!(joint.motion, JointMotion::Free { .. }) {
                            prop_assert_eq!(parts(&["translation.x", "translation.y", "translation.z"]), at);
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_motion_has_the_promised_members() {
    let document = document();
    let keys: Vec<&String> = document.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["times", "root_translation", "joints", "angles", "translations"]);
    assert_eq!(document["times"], json!([0.0, 0.5]));
    assert_eq!(document["root_translation"], json!([[0.5, 1.0, -2.0], [0.0, 0.0, 0.0]]));
    assert_eq!(document["joints"].as_object().unwrap().len(), 8);
    assert_eq!(document["joints"]["ball"][0], json!([0.5_f64.sin(), 0.0, 0.0, 0.5_f64.cos()]));
    assert_eq!(document["joints"]["fixed"], json!([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]));
    assert_eq!(document["angles"].as_object().unwrap().len(), 4);
    assert_eq!(document["angles"]["hinge"], json!({ "angle_deg": [7.0_f64.to_degrees(), 0.0] }));
    assert_eq!(document["angles"]["slider"], json!({ "offset": [0.25, 0.0] }));
    // An angle without limits goes on instead of beginning anew.
    assert_eq!(document["angles"]["euler"]["euler_deg"][1], json!([0.0, 0.0, 360.0]));
    assert_eq!(document["translations"], json!({ "loose": [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]] }));
    // Only what is asked for, and no empty members.
    let human = ikiru_formats::builtin("human").unwrap().rig;
    let clip = Clip::still(human.rest_pose()).with_name("");
    let hand = motion_json(&clip, &[human.joint("leftHand").unwrap(), JointId::from_index(9999)]);
    let expected = json!({
        "times": [0.0], "root_translation": [[0.0, 0.0, 0.0]], "joints": { "hand_l": [[0.0, 0.0, 0.0, 1.0]] }
    });
    assert_eq!(hand, expected);
}

#[test]
fn neighbours_lie_on_the_same_side() {
    let rig = sample();
    let ball = rig.joint("ball").unwrap();
    let pose = |sign: f64| {
        let mut pose = rig.rest_pose();
        pose.set_rotation(ball, DQuat::from_rotation_z(3.0) * sign).unwrap();
        pose
    };
    let clip = Clip::new("", vec![0.0, 1.0, 2.0], vec![pose(1.0), pose(-1.0), pose(1.0)]).unwrap();
    let document = motion_json(&clip, &[ball]);
    let turns = document["joints"]["ball"].as_array().unwrap();
    assert!(turns.iter().all(|q| *q == turns[0]), "{turns:?}");
    let table = String::from_utf8(motion_csv(&clip, &[ball]).unwrap()).unwrap();
    let ends: Vec<&str> = table.lines().skip(1).map(|row| row.split_once(',').unwrap().1).collect();
    assert!(ends.iter().all(|end| *end == ends[0]), "{table}");
}

#[test]
fn reading_takes_roles_turns_and_what_is_left_out() {
    let human = ikiru_formats::builtin("human").unwrap().rig;
    let text = r#"{"success": true, "stop": "reached", "times": [0, 1], "root_translation": [[0,0,0],[0,0,0]],
        "joints": {"leftHand": [[0,0,2,0],[0,0,0,-1e300]]}, "objectives": [{"kind": "position"}]}"#;
    let clip = read_motion_json(text.as_bytes(), "wave.v2.json", &human).unwrap();
    assert_eq!((clip.name(), clip.times()), ("wave.v2", [0.0, 1.0].as_slice()));
    let hand = human.joint("hand_l").unwrap();
    assert_eq!(clip.poses()[0].rotation(hand).unwrap(), DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0));
    assert_eq!(clip.poses()[1].rotation(hand).unwrap().w.abs(), 1.0);
    // A hinge without its angle: in its range, then each as near as can be to the one before.
    let about_y = |angle: f64| DQuat::from_rotation_y(angle).to_array();
    let document = json!({
        "times": [0, 1, 2], "root_translation": [[0, 0, 0], [0, 0, 0], [0, 0, 0]],
        "joints": { "hinge": [about_y(6.0 - std::f64::consts::TAU), about_y(8.0), about_y(10.0)] }
    });
    let clip = read(&document).unwrap();
    let hinge = clip.rig().joint("hinge").unwrap();
    for (pose, expected) in clip.poses().iter().zip([6.0, 8.0, 10.0]) {
        assert!((pose.value(hinge).unwrap() - expected).abs() < 1e-12);
    }
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    assert!(read(&document()).is_ok());
    // (what is set, to what, where the fault is, what the message says)
    let far = "expected the rotation that its \"angles\" give";
    for (at, value, place, message) in [
        ("/times", json!([]), "/times", "found no times, expected at least one"),
        ("/times", json!([0.5, 0.5]), "/times/1", "found 0.5 s after 0.5 s, expected times that increase"),
        ("/times", json!([0]), "/angles/hinge/angle_deg", "found 2 entries, expected 1"),
        ("/times/1", json!("late"), "/times/1", "invalid type: string \"late\""),
        ("/times/1", json!(null), "/times/1", "invalid type: null"),
        ("/times", json!(7), "/times", "expected a list with one entry a frame"),
        ("/root_translation", json!([[0, 0, 0]]), "/root_translation", "found 1 entries, expected 2"),
        (
            "/root_translation/1",
            json!([0, 0]),
            "/root_translation/1",
            "invalid length 2, expected a list of 3 numbers",
        ),
        ("/joints", json!([]), "/joints", "expected an object with the names of joints"),
        ("/joints/ball", json!([]), "/joints/ball", "found 0 entries, expected 2: one for each of \"times\""),
        ("/joints/ball/1", json!([0, 0, 0, 0]), "/joints/ball/1", "has the length 0: expected a quaternion"),
        (
            "/joints/ball/1",
            json!([0, 0, 0, 1, 0]),
            "/joints/ball/1",
            "invalid length 5, expected a list of 4 numbers",
        ),
        ("/joints/ball/1/2", json!([]), "/joints/ball/1/2", "invalid type: sequence, expected f64"),
        ("/joints/bal", json!([[0, 0, 0, 1], [0, 0, 0, 1]]), "/joints/bal", "'ball'"),
        (
            "/joints/fixed/1",
            json!([1, 0, 0, 0]),
            "/joints/fixed/1",
            "joint 'fixed' is fixed: found [1.0, 0.0, 0.0, 0.0], expected no rotation",
        ),
        ("/joints/hinge/1", json!([0, 1, 0, 0]), "/joints/hinge/1", far),
        ("/joints/slider/0", json!([0, 1, 0, 0]), "/joints/slider/0", far),
        ("/angles/hinge", json!({ "angle_deg": [1] }), "/angles/hinge/angle_deg", "found 1 entries"),
        (
            "/angles/hinge",
            json!({ "offset": [1, 2] }),
            "/angles/hinge",
            "found \"offset\", expected \"angle_deg\" alone",
        ),
        (
            "/angles/hinge",
            json!({ "angle_deg": [1, 2], "offset": [1, 2] }),
            "/angles/hinge",
            "found \"angle_deg\" and \"offset\"",
        ),
        ("/angles/hinge", json!({}), "/angles/hinge", "found no key"),
        (
            "/angles/hinge",
            json!({ "angle": [1, 2] }),
            "/angles/hinge/angle",
            "unknown field `angle`, expected one of",
        ),
        (
            "/angles/euler/euler_deg/0",
            json!([1]),
            "/angles/euler/euler_deg/0",
            "expected a list of 3 numbers",
        ),
        (
            "/angles/ball",
            json!({ "euler_deg": [[0, 0, 0], [0, 0, 0]] }),
            "/angles/ball",
            "expected rotations alone",
        ),
        ("/angles/fixed", json!({}), "/angles/fixed", "expected nothing, as the joint is fixed"),
        ("/translations/ball", json!([[0, 0, 0], [0, 0, 0]]), "/translations/ball", "expected a free joint"),
        (
            "/translations/root",
            json!([[0, 0, 0], [0, 0, 0]]),
            "/translations/root",
            "expected \"root_translation\"",
        ),
        ("/translations/loose", json!([]), "/translations/loose", "found 0 entries"),
    ] {
        let mut wrong = document();
        let (parent, key) = at.rsplit_once('/').unwrap();
        match wrong.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            member => member[key] = value,
        }
        let error = read(&wrong).unwrap_err();
        let found = match error.place() {
            Place::Pointer(pointer) | Place::Text { pointer, .. } => pointer.clone(),
            other => panic!("{at}: {other:?}"),
        };
        assert_eq!(found, place, "{at}: {error}");
        assert!(error.to_string().contains(message), "{at}: {error}");
        assert!(error.to_string().starts_with("sample.json, "), "{error}");
    }
    for member in ["times", "root_translation", "joints"] {
        let mut wrong = document();
        wrong.as_object_mut().unwrap().remove(member);
        assert!(read(&wrong).unwrap_err().to_string().contains(&format!("missing field `{member}`")));
    }
}

#[test]
fn joints_that_do_not_turn_or_translate_so_are_told() {
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("arm", None);
    joint.motion = JointMotion::Hinge { axis: DVec3::Y, range: Range::UNLIMITED };
    builder.add(joint);
    let rig = builder.build().unwrap();
    let read = |translation: [f64; 3], turn: [f64; 4]| {
        let document =
            json!({ "times": [0], "root_translation": [translation], "joints": { "arm": [turn] } });
        read_motion_json(document.to_string().as_bytes(), "arm.json", &rig)
    };
    assert!(read([0.0; 3], [0.0, 1.0, 0.0, 1.0]).is_ok());
    let error = read([0.0; 3], [1.0, 0.0, 0.0, 1.0]).unwrap_err().to_string();
    assert!(
        error.contains("/joints/arm/0") && error.contains("expected a rotation about its axis"),
        "{error}"
    );
    let error = read([0.0, 0.1, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap_err().to_string();
    assert!(error.contains("/root_translation/0") && error.contains("it cannot translate"), "{error}");
    // The same joint under two names: a key that a parser would silently replace, and a role beside a name.
    let twice =
        br#"{"times":[0],"root_translation":[[0,0,0]],"joints":{"arm":[[0,0,0,1]],"arm":[[0,0,0,1]]}}"#;
    let error = read_motion_json(twice, "arm.json", &rig).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Repeated { joint, .. } if joint == "arm"), "{error}");
}

#[test]
fn what_is_no_json_and_what_is_too_much_is_refused() {
    let rig = sample();
    let read = |bytes: &[u8]| read_motion_json(bytes, "x.json", &rig).unwrap_err();
    for bytes in [b"".as_slice(), b"{", b"\xff\xfe", b"{\"times\": [1e999]}", b"{\"times\": [NaN]}"] {
        assert!(matches!(read(bytes).kind(), ErrorKind::Syntax { .. }), "{}", read(bytes));
    }
    for bytes in [b"[]".as_slice(), b"7", b"null", b"{}"] {
        assert!(matches!(read(bytes).kind(), ErrorKind::MotionShape { .. }), "{}", read(bytes));
    }
    // Times alone, where each frame is a pose of a large rig.
    let human = ikiru_formats::builtin("human").unwrap().rig;
    let times: Vec<u32> = (0..60_000).collect();
    let text = json!({ "times": times, "root_translation": [], "joints": {} }).to_string();
    let error = read_motion_json(text.as_bytes(), "x.json", &human).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::LongMotion { frames: 60_000, .. }), "{error}");
}

#[test]
fn memory_is_bounded_by_the_size_of_the_text() {
    let rig = sample();
    let many = |n: usize, entry: &dyn Fn(usize) -> String| -> String {
        (0..n).map(entry).collect::<Vec<_>>().join(",")
    };
    let document = |times: &str, joints: &str, angles: &str| {
        format!(r#"{{"times":[{times}],"root_translation":[],"joints":{{{joints}}},"angles":{{{angles}}}}}"#)
    };
    for text in [
        document(&many(8_000_000, &|_| "0".to_owned()), "", ""),
        document(&many(2_000_000, &|i| i.to_string()), "", ""),
        document("0", &format!("\"ball\":[{}]", many(2_000_000, &|_| "[0,0,0,1]".to_owned())), ""),
        document("0", &many(900_000, &|_| "\"\":[]".to_owned()), ""),
        document("0", &many(900_000, &|_| "\"\":[[0,0,0,1]]".to_owned()), ""),
        document("0", "", &many(900_000, &|_| "\"\":{}".to_owned())),
    ] {
        let mut result = None;
        let found = peak(|| result = Some(read_motion_json(text.as_bytes(), "x.json", &rig)));
        assert!(found <= (64 << 20) + 8 * text.len(), "{found} bytes for a text of {}", text.len());
        assert!(result.unwrap().is_err());
    }
}

#[test]
fn mutated_text_gives_a_motion_or_an_error() {
    let text = document().to_string();
    let rig = sample();
    let mut random = Random::new(3);
    let words =
        ["", "0", "-1", "1e308", "[", "]", "{", "}", "null", "\"", ",", "[0,0,0,0]", "\"hinge\"", "1e-320"];
    let mut fine = 0;
    for _ in 0..4000 {
        let mut bytes = text.clone().into_bytes();
        for _ in 0..=random.below(3) {
            let (start, length) = (random.below(bytes.len()), random.below(6));
            let end = (start + length).min(bytes.len());
            bytes.splice(start..end, words[random.below(words.len())].bytes());
        }
        match read_motion_json(&bytes, "x.json", &rig) {
            Ok(clip) => {
                fine += 1;
                assert!(clip.poses().iter().all(Pose::is_valid));
            }
            Err(error) => assert!(error.to_string().starts_with("x.json")),
        }
    }
    assert!(fine > 20, "{fine}");
}

#[test]
fn a_table_of_a_broken_clip_is_refused() {
    let rig = sample();
    let mut pose = rig.rest_pose();
    pose.coords_mut()[0] = f64::NAN;
    let clip = Clip::still(pose).with_name("broken");
    let error = motion_csv(&clip, &all(&rig)).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::InvalidPose { .. }));
    assert!(error.to_string().starts_with("broken: "), "{error}");
}
