//! What clips translate is carried where that is asked for, and what was written is read back.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::animation::Film;
use crate::common::bvh::Reference;
use crate::common::*;
use glam::DVec3;
use ikiru_formats::{Format, Loaded, Warning, read, read_glb, write_animated_glb, write_clip};
use ikiru_rig::{Clip, JointMotion};
use ikiru_testkit::rigs::{Random, random_pose};
use serde_json::json;

/// Adds a channel to the first animation of a film.
fn channel(film: &mut Film, node: usize, path: &str, times: usize, output: usize) {
    let animation = &mut film.document["animations"][0];
    let sampler = animation["samplers"].as_array().unwrap().len();
    animation["samplers"].as_array_mut().unwrap().push(json!({ "input": times, "output": output }));
    let channel = json!({ "sampler": sampler, "target": { "node": node, "path": path } });
    animation["channels"].as_array_mut().unwrap().push(channel);
}

#[test]
fn a_free_roots_way_comes_back_from_the_file_that_has_it() {
    for (name, ..) in FILES {
        let loaded = read(path(name)).unwrap();
        let mut builder = loaded.rig.to_builder();
        let root = builder.free_root().unwrap();
        // What carries a hand's bones may be a node that no skin uses.
        let turned = loaded.rig.get(root).unwrap().motion != JointMotion::Fixed;
        let loaded = loaded.with_rig(builder.build().unwrap()).unwrap();
        let mut random = Random::new(5);
        let poses: Vec<_> = (0..4).map(|_| random_pose(&loaded.rig, &mut random)).collect();
        let clip = Clip::new("way", vec![0.0, 0.5, 1.0, 1.5], poses).unwrap();
        let again = read_glb(&write_animated_glb(&loaded, &clip).unwrap(), name).unwrap();
        // A rig's joints do not translate unless asked.
        let ignored = |warning: &Warning| match warning {
            Warning::ChannelsIgnored { path, .. } => path.clone(),
            other => panic!("{other}"),
        };
        let ignored: Vec<String> = again.warnings.iter().map(ignored).collect();
        assert_eq!(
            ignored,
            if turned { vec!["translation"] } else { vec!["rotation", "translation"] },
            "{name}"
        );
        assert!(again.rig.joints().iter().all(|joint| !matches!(joint.motion, JointMotion::Free { .. })));
        let again = again.carrying_clips().unwrap();
        assert_eq!(again.warnings, [], "{name}");
        for (a, b) in clip.poses().iter().zip(again.clips[0].poses()) {
            assert_same_frames(name, &loaded.rig, &a.frames(), &b.frames());
        }
        // On to BVH, the way is kept.
        let written = write_clip(&again, &again.clips[0], Format::Bvh).unwrap();
        let reference = Reference::parse(std::str::from_utf8(&written.bytes).unwrap(), false);
        for (pose, frame) in clip.poses().iter().zip(&reference.frames) {
            for (joint, matrix) in reference.joints.iter().zip(reference.world(frame)) {
                let Ok(id) = loaded.rig.joint(&joint.name) else { continue };
                let off = matrix.w_axis.truncate().distance(pose.frame(id).unwrap().position);
                assert!(off < 1e-5, "{name}: {} is off by {off}", joint.name);
            }
        }
    }
}

#[test]
fn hips_below_a_root_and_what_carries_them_move_and_props_do_not() {
    let mut film = Film::new();
    // An armature in centimetres carries the leg; a lamp stands beside it.
    film.document["scenes"] = json!([{ "nodes": [3] }]);
    let nodes = film.document["nodes"].as_array_mut().unwrap();
    nodes.push(json!({ "name": "armature", "children": [0, 4], "scale": [0.01, 0.01, 0.01] }));
    nodes.push(json!({ "name": "lamp" }));
    let times = film.floats("SCALAR", &[0.0, 1.0]);
    let way = film.floats("VEC3", &[0.0, 1.0, 0.0, 50.0, 1.0, 20.0]);
    film.animate(0, "translation", "LINEAR", times, way);
    let on = film.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 2.0]);
    let turns = film.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
    channel(&mut film, 3, "translation", times, on);
    channel(&mut film, 3, "rotation", times, turns);
    channel(&mut film, 4, "translation", times, on);
    let loaded = film.read().carrying_clips().unwrap();
    let motion = |name: &str| loaded.rig.get(loaded.rig.joint(name).unwrap()).unwrap().motion;
    assert_eq!(motion("hip"), JointMotion::FREE);
    assert_eq!(motion("armature"), JointMotion::FREE);
    assert_eq!(motion("lamp"), JointMotion::Fixed);
    assert!(
        matches!(&loaded.warnings[..], [Warning::ChannelsIgnored { first, count: 1, .. }] if first == "lamp")
    );
    let hip = loaded.clips[0].poses()[1].frame(loaded.rig.joint("hip").unwrap()).unwrap().position;
    // Half a turn about y, then two metres on.
    assert!(hip.distance(DVec3::new(-0.5, 0.01, 2.0 - 0.2)) < 1e-6, "{hip}");
}

#[test]
fn a_clip_of_a_way_alone_is_a_clip() {
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0]);
    let way = film.floats("VEC3", &[0.0, 1.0, 0.0, 0.0, 1.0, 3.0]);
    film.animate(0, "translation", "LINEAR", times, way);
    assert!(film.read().clips.is_empty());
    let loaded = film.read().carrying_clips().unwrap();
    assert_eq!(loaded.warnings, []);
    let hip = loaded.rig.joint("hip").unwrap();
    assert!(
        loaded.clips[0].sample(0.5).frame(hip).unwrap().position.distance(DVec3::new(0.0, 1.0, 1.5)) < 1e-6
    );
}

#[test]
fn rigs_that_carry_their_clips_already_stay_as_they_are() {
    for name in ["mocap/cmu_01_01_30fps.bvh", "mh_female_mixamo.glb"] {
        let loaded = read(data(name)).unwrap();
        let same: Loaded = loaded.clone().carrying_clips().unwrap();
        assert_eq!(same.warnings, loaded.warnings);
        assert_eq!(same.clips.len(), loaded.clips.len());
        assert!(same.rig.joints() == loaded.rig.joints());
    }
}
