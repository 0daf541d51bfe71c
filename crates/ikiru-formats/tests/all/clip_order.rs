//! What is new in a written file is what a viewer shows: the pose, or the first animation, each under one name.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::animation::Film;
use crate::common::*;
use glam::DQuat;
use ikiru_formats::{Format, Loaded, Warning, write_animated_glb, write_clip, write_pose};
use ikiru_rig::Clip;
use serde_json::{Value, json};

/// A file with animations of these names, the second time after each other the same pose; an empty one has none.
fn film(names: &[&str]) -> Loaded {
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0]);
    let turns = film.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8]);
    for (idx, name) in names.iter().enumerate() {
        film.animate(0, "rotation", "LINEAR", times, turns);
        if !name.is_empty() {
            film.document["animations"][idx]["name"] = json!(name);
        }
    }
    film.read()
}

fn names(loaded: &Loaded) -> Vec<&str> {
    loaded.clips.iter().map(Clip::name).collect()
}

fn bent(loaded: &Loaded, name: &str) -> Clip {
    let mut pose = loaded.rig.rest_pose();
    pose.set_rotation(loaded.rig.joint("knee").unwrap(), DQuat::from_rotation_x(0.5)).unwrap();
    Clip::new(name, vec![0.0, 1.0], vec![loaded.rig.rest_pose(), pose]).unwrap()
}

fn again(bytes: &[u8]) -> Loaded {
    ikiru_formats::read_glb(bytes, "again.glb").unwrap()
}

#[test]
fn a_new_clip_is_the_first() {
    let loaded = film(&["idle", "walk"]);
    let clip = bent(&loaded, "motion");
    let written = write_clip(&loaded, &clip, Format::Glb).unwrap();
    assert_eq!(written.warnings, []);
    let once = again(&written.bytes);
    assert_eq!(names(&once), ["motion", "idle", "walk"]);
    let knee = once.rig.joint("knee").unwrap();
    assert!(
        once.clips[0].sample(1.0).rotation(knee).unwrap().angle_between(DQuat::from_rotation_x(0.5)) < 1e-6
    );
    // Those of the file are what they were.
    assert_eq!(once.clips[2].poses()[1].coords(), loaded.clips[1].poses()[1].coords());
}

#[test]
fn writing_again_takes_the_place_of_what_was_written_before() {
    let loaded = film(&["idle", "motion"]);
    let clip = bent(&loaded, "motion");
    let written = write_clip(&loaded, &clip, Format::Glb).unwrap();
    assert_eq!(written.warnings, [Warning::ClipReplaced { clip: "motion".to_owned() }]);
    let once = again(&written.bytes);
    assert_eq!(names(&once), ["motion", "idle"]);
    let twice = again(&write_animated_glb(&once, &bent(&once, "motion")).unwrap());
    assert_eq!(names(&twice), ["motion", "idle"]);
    // The file's own clip, only written again, is no news.
    let written = write_clip(&loaded, &loaded.clips[0], Format::Glb).unwrap();
    assert_eq!(written.warnings, []);
    assert_eq!(names(&again(&written.bytes)), ["idle", "motion"]);
}

#[test]
fn names_are_told_apart() {
    let loaded = film(&["walk", "", "walk", "clip_1", "walk_2"]);
    assert_eq!(names(&loaded), ["walk", "clip_1_2", "walk_3", "clip_1", "walk_2"]);
    let renamed = Warning::ClipRenamed { clip: "walk".to_owned(), renamed: "walk_3".to_owned() };
    assert_eq!(loaded.warnings, [renamed]);
    // In what is written, too.
    let bytes = write_animated_glb(&loaded, &bent(&loaded, "walk")).unwrap();
    let names: Vec<Value> =
        open(&bytes).0["animations"].as_array().unwrap().iter().map(|a| a["name"].clone()).collect();
    assert_eq!(names, [json!("walk"), Value::Null, json!("walk_3"), json!("clip_1"), json!("walk_2")]);
}

#[test]
fn a_pose_is_not_played_over() {
    let mut film = Film::new();
    let times = film.floats("SCALAR", &[0.0, 1.0]);
    let turns = film.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8]);
    film.animate(0, "rotation", "LINEAR", times, turns);
    film.animate(1, "rotation", "LINEAR", times, turns);
    film.animate(0, "weights", "LINEAR", times, times);
    let loaded = film.read();
    let pose = &bent(&loaded, "").poses()[1].clone();
    let written = write_pose(&loaded, pose, Format::Glb).unwrap();
    assert_eq!(written.warnings, [Warning::ClipsLeftOut { count: 2 }]);
    assert!(written.warnings[0].to_string().starts_with("2 animations of the file left out"));
    // What moves a face alone stays.
    let animations = open(&written.bytes).0["animations"].clone();
    assert_eq!(animations.as_array().unwrap().len(), 1);
    assert_eq!(animations[0]["channels"][0]["target"]["path"], "weights");
    // At rest there is no pose to be played over, and the file stays what it was.
    let written = write_pose(&loaded, &loaded.rig.rest_pose(), Format::Glb).unwrap();
    assert_eq!(written.warnings, []);
    assert_eq!(open(&written.bytes).0["animations"].as_array().unwrap().len(), 3);
    // No list is better than an empty one, which the format does not have.
    let loaded = super::clip_order::film(&["idle"]);
    let pose = &bent(&loaded, "").poses()[1].clone();
    let written = write_pose(&loaded, pose, Format::Glb).unwrap();
    assert!(open(&written.bytes).0.get("animations").is_none());
}
