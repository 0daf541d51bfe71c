//! What the command wrote it reads back, as itself or for other programs.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use std::path::Path;

use crate::common::ikiru_in;
use glam::DVec3;
use ikiru_formats::{Loaded, read};

fn run(folder: &Path, args: &[&str]) -> String {
    let run = ikiru_in(folder, args);
    assert_eq!(run.code, 0, "{args:?}: {}{}", run.stdout, run.stderr);
    run.stderr
}

/// A folder with the built-in human as a file, and a scenario whose root has to come along.
fn with_scenario() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let human = concat!(env!("CARGO_MANIFEST_DIR"), "/../ikiru-formats/assets/human.vrm");
    std::fs::copy(human, folder.path().join("human.vrm")).unwrap();
    let text = r#"
        version = 1
        rig = "human.vrm"
        root = "free"
        [[objective]]
        kind = "position"
        joint = "leftHand"
        target = [0.9, 1.3, 0.8]
        weight = 100
        [motion]
        duration_secs = 1
    "#;
    std::fs::write(folder.path().join("way.toml"), text).unwrap();
    folder
}

fn hand_at_the_end(loaded: &Loaded) -> DVec3 {
    let pose = loaded.clips[0].poses().last().unwrap();
    pose.frame(loaded.rig.joint("leftHand").unwrap()).unwrap().position
}

#[test]
fn the_way_of_a_root_is_kept_through_every_format() {
    let folder = with_scenario();
    let at = |name: &str| folder.path().join(name);
    let target = DVec3::new(0.9, 1.3, 0.8);
    for name in ["way.glb", "way.gltf", "way.vrm", "way.json", "way.bvh"] {
        run(folder.path(), &["plan", "way.toml", "--out", name]);
        for end in ["bvh", "vrm", "glb"].iter().filter(|end| name != "way.bvh" || **end == "bvh") {
            let out = format!("from_{name}.{end}");
            let said = run(folder.path(), &["convert", name, &out]);
            assert!(!said.contains("ignored"), "{said}");
            let off = hand_at_the_end(&read(at(&out)).unwrap().carrying_clips().unwrap()).distance(target);
            assert!(off < 0.01, "{out} is off by {off}");
        }
    }
    // A .json that names no rig is of the one that it goes onto.
    let mut motion: serde_json::Value =
        serde_json::from_slice(&std::fs::read(at("way.json")).unwrap()).unwrap();
    assert_eq!(motion["rig"], "human.vrm");
    motion.as_object_mut().unwrap().remove("rig");
    std::fs::write(at("bare.json"), motion.to_string()).unwrap();
    let told = ikiru_in(folder.path(), &["convert", "bare.json", "bare.bvh"]);
    told.fails(2, &["bare.json does not say which rig", "--onto RIG"]);
    run(folder.path(), &["convert", "bare.json", "bare.bvh", "--onto", "human.vrm"]);
    assert!(hand_at_the_end(&read(at("bare.bvh")).unwrap()).distance(target) < 0.01);
    // And found beside it, from wherever the command runs.
    let elsewhere = tempfile::tempdir().unwrap();
    run(elsewhere.path(), &["convert", at("way.json").to_str().unwrap(), "way.bvh"]);
}

#[test]
fn planning_again_shows_the_new_motion_and_keeps_one() {
    let folder = with_scenario();
    let at = |name: &str| folder.path().join(name);
    for _ in 0..3 {
        run(folder.path(), &["plan", "way.toml", "--out", "human.vrm"]);
    }
    let names: Vec<String> =
        read(at("human.vrm")).unwrap().clips.iter().map(|clip| clip.name().to_owned()).collect();
    assert_eq!(names, ["motion"]);
    // A pose of that file is not played over.
    let pose =
        std::fs::read_to_string(at("way.toml")).unwrap().replace("[motion]\n        duration_secs = 1", "");
    std::fs::write(at("pose.toml"), pose).unwrap();
    let said = run(folder.path(), &["solve", "pose.toml", "--out", "posed.vrm"]);
    assert!(said.contains("1 animation of the file left out"), "{said}");
    let posed = read(at("posed.vrm")).unwrap();
    assert!(posed.clips.is_empty());
    let hand = posed.rig.rest_pose().frame(posed.rig.joint("leftHand").unwrap()).unwrap().position;
    assert!(hand.distance(DVec3::new(0.9, 1.3, 0.8)) < 0.002, "{hand}");
}

#[test]
fn a_hinge_without_limits_goes_on_to_a_given_end() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let urdf = r#"<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
        <joint name="j1" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
        <joint name="f" type="fixed"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/></joint></robot>"#;
    std::fs::write(at("t.urdf"), urdf).unwrap();
    let text = r#"
        version = 1
        rig = "t.urdf"
        world = "file"
        [start]
        j1 = { angle_deg = 170 }
        [[objective]]
        kind = "position"
        joint = "c"
        target = [-1, 0.1, 0]
        at = 0.5
        [motion]
        duration_secs = 1
        [motion.end]
        j1 = { angle_deg = -170 }
    "#;
    std::fs::write(at("turn.toml"), text).unwrap();
    for name in ["turn.json", "turn.csv", "turn.bvh"] {
        ikiru_in(folder.path(), &["plan", "turn.toml", "--out", name]);
    }
    let motion: serde_json::Value = serde_json::from_slice(&std::fs::read(at("turn.json")).unwrap()).unwrap();
    let lists: Vec<f64> = serde_json::from_value(motion["angles"]["j1"]["angle_deg"].clone()).unwrap();
    let last_column = |name: &str, separator: char, skip: usize| -> Vec<f64> {
        let text = std::fs::read_to_string(at(name)).unwrap();
        text.lines().skip(skip).map(|line| line.rsplit(separator).next().unwrap().parse().unwrap()).collect()
    };
    let n_lines = std::fs::read_to_string(at("turn.bvh")).unwrap().lines().count();
    for column in
        [lists.clone(), last_column("turn.csv", ',', 1), last_column("turn.bvh", ' ', n_lines - lists.len())]
    {
        assert!(
            (column[0] - 170.0).abs() < 1e-6 && (column.last().unwrap() - 190.0).abs() < 1e-6,
            "{column:?}"
        );
        assert!(column.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 30.0), "{column:?}");
    }
}

#[test]
fn a_motion_in_json_keeps_the_scale_of_its_rig() {
    let folder = tempfile::tempdir().unwrap();
    let bvh = "HIERARCHY\nROOT hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation \
        Xrotation\nEnd Site\n{\nOFFSET 0 20 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.5\n\
        0 10 0 0 0 0\n0 10 40 0 0 0\n";
    std::fs::write(folder.path().join("walk.bvh"), bvh).unwrap();
    run(folder.path(), &["convert", "walk.bvh", "walk.json", "--scale", "0.05"]);
    let text = std::fs::read(folder.path().join("walk.json")).unwrap();
    let motion: serde_json::Value = serde_json::from_slice(&text).unwrap();
    assert_eq!((motion["rig"].as_str(), motion["rig_scale"].as_f64()), (Some("walk.bvh"), Some(0.05)));
    run(folder.path(), &["convert", "walk.json", "again.bvh"]);
    // A body that was read as BVH is written in the unit of its file.
    let again = ikiru_formats::read_scaled(folder.path().join("again.bvh"), 0.05).unwrap();
    let hips = again.rig.joint("hips").unwrap();
    let [first, last] = [0, 1].map(|pose| again.clips[0].poses()[pose].frame(hips).unwrap().position);
    assert!((last - first - DVec3::new(0.0, 0.0, 2.0)).length() < 1e-9, "{first} to {last}");
}
