//! Animations become clips, clips become animations, and both say the same.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::gltf::DataProblem;
use ikiru_formats::{Loaded, Warning, read, read_glb, write_animated_glb};
use ikiru_rig::{Clip, EulerOrder, JointMotion, Range};
use ikiru_testkit::rigs::{Random, random_pose};
use serde_json::{Value, json};

/// A document under construction, with its buffer.
pub(crate) struct Film {
    pub(crate) document: Value,
    bin: Vec<u8>,
}

impl Film {
    pub(crate) fn new() -> Self {
        let mut document = leg();
        for list in ["accessors", "bufferViews", "animations"] {
            document[list] = json!([]);
        }
        Self { document, bin: Vec::new() }
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.document[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len();
        self.bin.extend(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        self.push("bufferViews", view)
    }

    fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let normalized = component != 5126;
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": component, "count": count, "type": kind,
                    "normalized": normalized }),
        )
    }

    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(kind, 5126, values.len() / width, &bytes)
    }

    /// One animation of one channel.
    pub(crate) fn animate(
        &mut self,
        node: usize,
        path: &str,
        interpolation: &str,
        input: usize,
        output: usize,
    ) {
        let animation = json!({
            "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
            "samplers": [{ "input": input, "output": output, "interpolation": interpolation }]
        });
        self.push("animations", animation);
    }

    pub(crate) fn read(&self) -> Loaded {
        let mut document = self.document.clone();
        document["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        read_glb(&glb(&document, Some(&self.bin)), "film.glb").unwrap()
    }
}

fn turn(degrees: f32) -> [f32; 4] {
    glam::Quat::from_rotation_z(degrees.to_radians()).to_array()
}

/// Degrees about z that the hip has turned at each of some times.
fn hip_degrees(clip: &Clip, times: &[f64]) -> Vec<f64> {
    let hip = clip.poses()[0].rig().joint("hip").unwrap();
    times
        .iter()
        .map(|t| {
            let q = clip.sample(*t).rotation(hip).unwrap();
            (2.0 * q.z.atan2(q.w)).to_degrees()
        })
        .collect()
}

fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() < tolerance, "{found:?} is not {expected:?}");
    }
}

#[test]
fn linear_channels_are_sampled_on_top_of_rest() {
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.5, 1.0, 2.0]);
    let turns = film.floats("VEC4", &[turn(0.0), turn(20.0), turn(40.0)].concat());
    film.animate(0, "rotation", "LINEAR", times, turns);
    film.document["animations"][0]["name"] = json!("bend");
    // The knee at other times, and its rest rotation taken off.
    let times = film.floats("SCALAR", &[0.5, 1.5]);
    let rest = glam::Quat::from_xyzw(0.0, 0.0, 0.6, 0.8);
    let bent = (rest * glam::Quat::from_rotation_x(1.0)).to_array();
    let turns = film.floats("VEC4", &[rest.to_array(), bent].concat());
    let animation = &mut film.document["animations"][0];
    animation["samplers"].as_array_mut().unwrap().push(json!({ "input": times, "output": turns }));
    let channel = json!({ "sampler": 1, "target": { "node": 1, "path": "rotation" } });
    animation["channels"].as_array_mut().unwrap().push(channel);

    let loaded = film.read();
    assert_eq!(loaded.warnings, []);
    let clip = &loaded.clips[0];
    assert_eq!(clip.name(), "bend");
    assert_eq!(clip.times(), [0.5, 1.0, 1.5, 2.0]);
    assert_near(&hip_degrees(clip, &[0.5, 0.75, 1.0, 1.5, 2.0]), &[0.0, 10.0, 20.0, 30.0, 40.0], 1e-4);
    let knee = loaded.rig.joint("knee").unwrap();
    assert!(clip.sample(0.5).rotation(knee).unwrap().angle_between(DQuat::IDENTITY) < 1e-6);
    assert!(clip.sample(9.0).rotation(knee).unwrap().angle_between(DQuat::from_rotation_x(1.0)) < 1e-6);
}

#[test]
fn steps_hold_until_the_next_key() {
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0, 2.0]);
    let turns = film.floats("VEC4", &[turn(0.0), turn(30.0), turn(60.0)].concat());
    film.animate(0, "rotation", "STEP", times, turns);
    let loaded = film.read();
    let times = [0.0, 0.5, 0.999, 1.0, 1.7, 1.999, 2.0];
    let found = hip_degrees(&loaded.clips[0], &times);
    assert_near(&found, &[0.0, 0.0, 0.0, 30.0, 30.0, 30.0, 60.0], 1e-4);
    assert_eq!(loaded.clips[0].name(), "clip_0");
}

#[test]
fn splines_are_followed_between_their_keys() {
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0]);
    let zero = [0.0; 4];
    let keys = film.floats("VEC4", &[zero, turn(0.0), zero, zero, turn(60.0), zero].concat());
    film.animate(0, "rotation", "CUBICSPLINE", times, keys);
    let clip = &film.read().clips[0];
    assert!(clip.poses().len() >= 16);
    // With flat tangents the quaternion goes by 3t² − 2t³.
    let expected: Vec<f64> = [0.0, 0.25, 0.5, 1.0]
        .iter()
        .map(|t: &f64| {
            let s = 3.0 * t * t - 2.0 * t * t * t;
            let (a, b) = (DQuat::IDENTITY, DQuat::from_rotation_z(60f64.to_radians()));
            let q = (a * (1.0 - s) + b * s).normalize();
            (2.0 * q.z.atan2(q.w)).to_degrees()
        })
        .collect();
    assert_near(&hip_degrees(clip, &[0.0, 0.25, 0.5, 1.0]), &expected, 0.01);
}

#[test]
fn integers_and_sparse_accessors_are_understood() {
    let q = turn(50.0);
    let as_bytes = |scale: f32, width: usize| -> Vec<u8> {
        [turn(0.0), q]
            .concat()
            .iter()
            .flat_map(|c| ((c * scale).round() as i32).to_le_bytes()[..width].to_vec())
            .collect()
    };
    for (component, scale, width, tolerance) in
        [(5120, 127.0, 1, 1.0), (5121, 255.0, 1, 1.0), (5122, 32_767.0, 2, 0.01), (5123, 65_535.0, 2, 0.01)]
    {
        let mut film = Film::new();
        let times = film.floats("SCALAR", &[0.0, 1.0]);
        let turns = film.accessor("VEC4", component, 2, &as_bytes(scale, width));
        film.animate(0, "rotation", "LINEAR", times, turns);
        let loaded = film.read();
        assert_eq!(loaded.warnings, [], "{component}");
        assert_near(&hip_degrees(&loaded.clips[0], &[1.0]), &[50.0], tolerance);
    }
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0, 2.0]);
    let turns = film.floats("VEC4", &[turn(0.0), turn(0.0), turn(0.0)].concat());
    let (indices, values) = (film.view(&[1]), film.floats("VEC4", &q));
    film.document["accessors"][turns]["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": indices, "componentType": 5121 },
        "values": { "bufferView": film.document["accessors"][values]["bufferView"] }
    });
    film.animate(0, "rotation", "LINEAR", times, turns);
    assert_near(&hip_degrees(&film.read().clips[0], &[0.0, 1.0, 2.0]), &[0.0, 50.0, 0.0], 1e-4);
}

#[test]
fn channels_that_a_rig_has_no_use_for_are_one_warning_each() {
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0]);
    let turns = film.floats("VEC4", &[turn(0.0), turn(9.0)].concat());
    let rest = film.floats("VEC3", &[0.0, -0.4, 0.0, 0.0, -0.4, 0.0]);
    let moves = film.floats("VEC3", &[0.0, -0.4, 0.0, 0.0, -0.5, 0.0]);
    let ones = film.floats("VEC3", &[1.0; 6]);
    film.animate(0, "rotation", "LINEAR", times, turns);
    let outputs = [rest, moves, ones, turns, moves];
    let targets = [(1, "translation"), (0, "translation"), (0, "scale"), (2, "rotation"), (2, "translation")];
    for ((node, path), output) in targets.into_iter().zip(outputs) {
        let animation = &mut film.document["animations"][0];
        let sampler = animation["samplers"].as_array().unwrap().len();
        animation["samplers"].as_array_mut().unwrap().push(json!({ "input": times, "output": output }));
        let channel = json!({ "sampler": sampler, "target": { "node": node, "path": path } });
        animation["channels"].as_array_mut().unwrap().push(channel);
    }
    let loaded = film.read();
    assert_eq!(loaded.clips.len(), 1);
    let ignored = |path: &str, count, first: &str| Warning::ChannelsIgnored {
        clip: "clip_0".to_owned(),
        path: path.to_owned(),
        count,
        first: first.to_owned(),
    };
    assert_eq!(loaded.warnings, [ignored("rotation", 1, "foot"), ignored("translation", 2, "hip")]);
    let text = loaded.warnings[1].to_string();
    assert!(text.starts_with("animation 'clip_0': 2 translation channels were ignored"), "{text}");
}

#[test]
fn a_broken_animation_is_left_out_and_the_others_stay() {
    fn problem(edit: impl Fn(&mut Film)) -> (String, DataProblem) {
        let mut film = Film::new();
        let times = film.floats("SCALAR", &[0.0, 1.0]);
        let turns = film.floats("VEC4", &[turn(0.0), turn(9.0)].concat());
        film.animate(0, "rotation", "LINEAR", times, turns);
        edit(&mut film);
        let mut loaded = film.read();
        assert_eq!(loaded.rig.n_joints(), 3);
        assert_eq!((loaded.clips.len(), loaded.warnings.len()), (0, 1), "{:?}", loaded.warnings);
        match loaded.warnings.remove(0) {
            Warning::ClipDropped { place, problem, .. } | Warning::Animations { place, problem } => {
                (place, problem)
            }
            other => panic!("{other}"),
        }
    }
    let (place, found) = problem(|f| f.document["animations"][0]["samplers"][0]["output"] = json!(9));
    assert_eq!(place, "/accessors/9");
    assert_eq!(found, DataProblem::OutOfRange { what: "accessor", found: 9, count: 2 });
    let (_, found) = problem(|f| f.document["animations"][0]["channels"][0]["sampler"] = json!(3));
    assert_eq!(found, DataProblem::OutOfRange { what: "sampler", found: 3, count: 1 });
    let (_, found) = problem(|f| f.document["animations"][0]["channels"][0]["target"]["node"] = json!(7));
    assert_eq!(found, DataProblem::OutOfRange { what: "node", found: 7, count: 3 });
    let (_, found) = problem(|f| f.document["bufferViews"][0]["buffer"] = json!(4));
    assert_eq!(found, DataProblem::OutOfRange { what: "buffer", found: 4, count: 1 });
    let (_, found) = problem(|f| f.document["accessors"][1]["bufferView"] = json!(4));
    assert_eq!(found, DataProblem::OutOfRange { what: "buffer view", found: 4, count: 2 });
    let (_, found) = problem(|f| f.document["accessors"][1]["byteOffset"] = json!(8));
    assert_eq!(found, DataProblem::Bounds { needed: 40, available: 32 });
    let (_, found) = problem(|f| f.document["bufferViews"][1]["byteOffset"] = json!(u64::MAX));
    assert_eq!(found, DataProblem::Bounds { needed: u64::MAX, available: 40 });
    let (_, found) = problem(|f| f.document["bufferViews"][1]["byteStride"] = json!(0));
    assert_eq!(found, DataProblem::Stride(0));
    let (_, found) = problem(|f| f.document["accessors"][1]["count"] = json!(u64::MAX));
    assert_eq!(found, DataProblem::Claims(u64::MAX));
    let (_, found) = problem(|f| f.document["accessors"][1]["count"] = json!(1));
    assert_eq!(found, DataProblem::Count { found: 1, expected: 2 });
    let (_, found) = problem(|f| f.document["accessors"][1]["type"] = json!("VEC3"));
    assert!(matches!(&found, DataProblem::Type { found, .. } if found == "Vec3 of component type 5126"));
    let (_, found) = problem(|f| f.bin[4..8].copy_from_slice(&f32::NAN.to_le_bytes()));
    assert!(matches!(found, DataProblem::Time { at: 1, .. }));
    let (_, found) = problem(|f| f.bin[4..8].copy_from_slice(&0f32.to_le_bytes()));
    assert_eq!(found, DataProblem::Time { at: 1, secs: 0.0 });
    let (_, found) = problem(|f| f.bin[8..24].fill(0));
    assert_eq!(found, DataProblem::Rotation { at: 0 });
    let (_, found) = problem(|f| {
        let channel = f.document["animations"][0]["channels"][0].clone();
        f.document["animations"][0]["channels"].as_array_mut().unwrap().push(channel);
    });
    assert_eq!(found, DataProblem::Repeated);
    let (_, found) = problem(|f| f.document["animations"][0]["channels"] = json!([]));
    assert_eq!(found, DataProblem::Still);
    let (place, found) = problem(|f| f.document["animations"][0]["samplers"] = json!(5));
    assert!(
        place == "/animations/0/samplers"
            && matches!(&found, DataProblem::Shape(m) if m.contains("expected a sequence"))
    );
    let (place, found) = problem(|f| f.document["accessors"][1]["count"] = json!("two"));
    assert!(
        place == "/accessors/1/count"
            && matches!(&found, DataProblem::Shape(m) if m.contains("expected u64"))
    );

    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0]);
    let turns = film.floats("VEC4", &[turn(0.0), turn(9.0)].concat());
    film.animate(0, "rotation", "LINEAR", times, 99);
    film.animate(0, "rotation", "LINEAR", times, turns);
    let loaded = film.read();
    assert_eq!(loaded.clips[0].name(), "clip_1");
    let text = loaded.warnings[0].to_string();
    assert_eq!(
        text,
        "animation 'clip_0' was left out, /accessors/99: accessor 99 does not exist, there are 2"
    );
}

#[test]
fn a_missing_buffer_costs_the_clips_alone() {
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0]);
    film.animate(0, "rotation", "LINEAR", times, times);
    film.document["buffers"] = json!([{ "byteLength": 8 }]);
    let loaded = read_glb(&glb(&film.document, None), "film.glb").unwrap();
    assert_eq!(loaded.rig.n_joints(), 3);
    let text = loaded.warnings[0].to_string();
    assert!(text.contains("/bufferViews/0: buffer 0 is missing"), "{text}");
}

#[test]
fn numbers_used_again_and_again_do_not_fill_the_memory() {
    // Every animation asks for the same many keys, each within what the file holds.
    let mut film = Film::new();
    let n = 20_000;
    let times: Vec<f32> = (0..n).map(|i| i as f32).collect();
    let times = film.floats("SCALAR", &times);
    let turns = film.accessor("VEC4", 5120, n, &[127, 0, 0, 0].repeat(n));
    for _ in 0..1000 {
        film.animate(0, "rotation", "LINEAR", times, turns);
    }
    let loaded = film.read();
    let poses: usize = loaded.clips.iter().map(|c| c.poses().len()).sum();
    assert!(poses < 500_000, "{poses}");
    assert!(!loaded.clips.is_empty() && loaded.warnings.len() == 101);
}

#[test]
fn clips_written_and_read_again_move_the_same() {
    let mut random = Random::new(5);
    for name in ["builtin:human", "builtin:reference", "mh_female_mixamo.glb", "webxr_generic_hand_left.glb"]
    {
        let loaded = read(path(name)).unwrap();
        let times = vec![0.0, 0.25, 1.0, 1.5];
        let poses: Vec<_> = times.iter().map(|_| random_pose(&loaded.rig, &mut random)).collect();
        let clip = Clip::new("dance \"1\"", times, poses).unwrap();
        let written = write_animated_glb(&loaded, &clip).unwrap();
        let again = read_glb(&written, name).unwrap();
        assert_eq!(again.warnings, [], "{name}");
        assert_eq!((again.clips.len(), again.clips[0].name()), (1, "dance \"1\""));
        assert_eq!(again.clips[0].times(), clip.times());
        for secs in [0.0, 0.1, 0.25, 0.7, 1.0, 1.4, 1.5] {
            let (a, b) = (clip.sample(secs), again.clips[0].sample(secs));
            assert_same_frames(name, &loaded.rig, &a.frames(), &b.frames());
        }
        // The pose at rest, and all else, is as it was.
        assert_same_frames(
            name,
            &loaded.rig,
            &loaded.rig.rest_pose().frames(),
            &again.rig.rest_pose().frames(),
        );
        let (before, after) = (loaded.source().unwrap().json(), open(&written));
        let before: Value = serde_json::from_str(before).unwrap();
        for member in ["nodes", "skins", "meshes", "materials", "extensions", "scenes"] {
            assert_eq!(before.get(member), after.0.get(member), "{name}");
        }
        let buffer = after.0["buffers"][0]["byteLength"].as_u64().unwrap() as usize;
        assert_eq!(buffer, after.1.as_ref().unwrap().len());
        let n_balls = loaded.rig.joints().iter().filter(|j| j.motion == JointMotion::BALL).count();
        assert_eq!(after.0["animations"][0]["channels"].as_array().unwrap().len(), n_balls);
        // A second one of another name goes before the first.
        let other = again.clips[0].clone().with_name("other");
        let twice = read_glb(&write_animated_glb(&again, &other).unwrap(), name).unwrap();
        assert_eq!(twice.clips.iter().map(Clip::name).collect::<Vec<_>>(), ["other", "dance \"1\""]);
        assert_eq!(twice.clips[1].poses()[3].coords(), again.clips[0].poses()[3].coords());
    }
}

#[test]
fn a_free_root_is_written_in_its_own_unit() {
    let mut document = leg();
    document["nodes"][0]["scale"] = json!([0.01, 0.01, 0.01]);
    document["skins"][0]["joints"] = json!([1]);
    let loaded = read_glb(&glb(&document, Some(&[7, 7])), "leg.glb").unwrap();
    let mut builder = loaded.rig.to_builder();
    let knee = builder.free_root().unwrap();
    let loaded = loaded.with_rig(builder.build().unwrap()).unwrap();
    let mut poses = vec![loaded.rig.rest_pose(); 2];
    poses[1].set_translation(knee, DVec3::new(0.0, 0.0, 0.5)).unwrap();
    let clip = Clip::new("", vec![-1.0, 1.0], poses).unwrap();
    let (document, bin) = open(&write_animated_glb(&loaded, &clip).unwrap());
    let bin = bin.unwrap();
    assert_eq!(bin[..4], [7, 7, 0, 0]);
    let animation = &document["animations"][0];
    assert_eq!(animation["channels"].as_array().unwrap().len(), 1, "nothing turns");
    assert_eq!(animation["channels"][0]["target"], json!({ "node": 1, "path": "translation" }));
    assert!(animation.get("name").is_none());
    let values = |accessor: usize| -> Vec<f32> {
        let view = &document["bufferViews"]
            [document["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize];
        let [from, length] = ["byteOffset", "byteLength"].map(|m| view[m].as_u64().unwrap() as usize);
        bin[from..from + length].chunks(4).map(|c| f32::from_le_bytes(c.try_into().unwrap())).collect()
    };
    assert_eq!(values(0), [0.0, 2.0], "times begin at 0");
    let expected = [0.0, -0.4, 0.0, 0.0, -0.4, 50.0];
    assert!(values(1).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{:?}", values(1));
    assert_eq!(document["accessors"][0]["min"], json!([0.0]));
    assert_eq!(document["accessors"][0]["max"], json!([2.0]));
}

#[test]
fn a_clip_that_stands_still_keeps_its_length() {
    let loaded = read_glb(&glb(&leg(), None), "leg.glb").unwrap();
    let clip = Clip::new("still", vec![0.0, 3.0], vec![loaded.rig.rest_pose(); 2]).unwrap();
    let again = read_glb(&write_animated_glb(&loaded, &clip).unwrap(), "again.glb").unwrap();
    assert_eq!((again.clips[0].name(), again.clips[0].duration_secs()), ("still", 3.0));
}

#[test]
fn clips_follow_a_changed_rig_where_they_can() {
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0, 2.0]);
    let turns = film.floats("VEC4", &[turn(0.0), turn(120.0), turn(240.0)].concat());
    film.animate(0, "rotation", "LINEAR", times, turns);
    let loaded = film.read();
    let hip = loaded.rig.joint("hip").unwrap();
    let with = |motion: JointMotion| {
        let mut builder = loaded.rig.to_builder();
        builder.set_motion(hip, motion).unwrap();
        loaded.clone().with_rig(builder.build().unwrap()).unwrap()
    };
    let euler = with(JointMotion::Euler { order: EulerOrder::Zyx, ranges: [Range::UNLIMITED; 3] });
    assert_eq!(euler.warnings, []);
    let angles = euler.clips[0].poses()[2].euler(hip).unwrap().map(f64::to_degrees);
    assert_near(&angles, &[0.0, 0.0, 240.0], 1e-4);
    for (a, b) in euler.clips[0].poses().iter().zip(loaded.clips[0].poses()) {
        assert!(a.rig().is_same(&euler.rig));
        assert_same_frames("euler", &loaded.rig, &a.frames(), &b.frames());
    }
    assert_eq!(with(JointMotion::FREE).clips.len(), 1);
    let fixed = with(JointMotion::Fixed);
    assert!(fixed.clips.is_empty());
    assert_eq!(
        fixed.warnings[0].to_string(),
        "clip 'clip_0' was left out: joint 'hip' cannot move as it does"
    );
}
