//! `inspect` of a scenario: what its cones are about, and the roles that it gives.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::f64::consts::FRAC_1_SQRT_2;

use ikiru_scenario::Scenario;
use serde_json::Value;

use crate::common::{Run, ikiru_in, root};

/// Runs `inspect` on a scenario of an arm that rests lower than a T-pose, whose joints have axes of many kinds.
fn inspect(more: &str, options: &[&str]) -> Run {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), scenario(more)).unwrap();
    ikiru_in(folder.path(), &[&["inspect", "s.toml"], options].concat())
}

fn scenario(more: &str) -> String {
    let rig = root().join("crates/ikiru-formats/tests/data/mh_female_mixamo.glb");
    format!(
        "version = 1\nrig = {rig:?}\n{more}\
         [[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0.35, 1.1, 0.3]\n"
    )
}

fn cone(report: &Value) -> &Value {
    let joints = report["joints"].as_array().unwrap();
    &joints.iter().find(|joint| joint["role"] == "leftUpperArm").unwrap()["limits"]
}

#[track_caller]
fn same(found: &Value, expected: [f64; 4]) {
    let found: Vec<f64> = found.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect();
    assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?} {expected:?}");
    assert_eq!(found.len(), 4);
}

#[test]
fn a_cone_about_the_rest_pose_is_told_as_one_about_the_rest_rotation() {
    let limits = "[limits.leftUpperArm]\naxis = [0, 1, 0]\nswing_deg = [70, 40]\n";
    let rig = Scenario::parse(&scenario(limits), "s.toml", "").unwrap().rig;
    let at_rest = rig.joints()[rig.joint("leftUpperArm").unwrap().index()].rest_rotation.to_array();
    let report = inspect(limits, &["--json"]).json();
    same(&cone(&report)["parent_rotation"], at_rest);
    same(&cone(&report)["joint_rotation"], [0.0, 0.0, 0.0, 1.0]);
    assert!(!inspect(limits, &[]).stdout.contains("parent_rotation"));
    // What is told can be written, and is the same limit.
    let again = format!("{limits}parent_rotation = {at_rest:?}\njoint_rotation = [0, 0, 0, 1]\n");
    assert_eq!(cone(&inspect(&again, &["--json"]).json()), cone(&report));
}

#[test]
fn a_cone_about_another_centre_is_told_with_it() {
    let limits =
        "[limits.leftUpperArm]\naxis = [0, 1, 0]\nswing_deg = [70, 40]\nparent_rotation = [0, 0, -1, 1]\n";
    let report = inspect(limits, &["--json"]).json();
    same(&cone(&report)["parent_rotation"], [0.0, 0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2]);
    same(&cone(&report)["joint_rotation"], [0.0, 0.0, 0.0, 1.0]);
    let text = inspect(limits, &[]).stdout;
    let centre =
        "180°, parent_rotation [0, 0, -0.7071, 0.7071], joint_rotation [0, 0, 0, 1] (of the scenario)";
    assert!(text.contains(centre), "{text}");
}

#[test]
fn roles_of_the_scenario_are_shown() {
    let role_of = |report: &Value, name: &str| {
        let joints = report["joints"].as_array().unwrap();
        joints.iter().find(|joint| joint["name"] == name).unwrap()["role"].clone()
    };
    let before = inspect("", &["--json"]).json();
    assert_eq!(role_of(&before, "mixamorig:LeftHand"), "leftHand");
    let roles = "[roles]\nleftHand = \"mixamorig:LeftForeArm\"\n";
    let after = inspect(roles, &["--json"]).json();
    assert_eq!(role_of(&after, "mixamorig:LeftForeArm"), "leftHand");
    assert_eq!(role_of(&after, "mixamorig:LeftHand"), Value::Null);
    let text = inspect(roles, &[]).stdout;
    let is_hand = |line: &&str| line.split_whitespace().any(|word| word == "leftHand");
    assert!(text.lines().find(is_hand).unwrap().contains("LeftForeArm"), "{text}");
    assert!(text.contains("no joint is leftLowerArm"), "{text}");
}

#[test]
fn masses_of_a_robot_are_shown() {
    let report = ikiru_in(&root(), &["inspect", "builtin:g1", "--json"]).json();
    let segments = report["body"]["segments"].as_array().unwrap();
    // Added up by another program.
    let total: f64 = segments.iter().map(|segment| segment["kg"].as_f64().unwrap()).sum();
    assert!((total - 33.341_142_02).abs() < 1e-9, "{total}");
    let expected = r#"{"joint":"pelvis","kg":3.813,"center":[0.0,0.0,-0.07605]}"#;
    assert_eq!(segments[0].to_string(), expected);
    let text = ikiru_in(&root(), &["inspect", "builtin:g1"]).stdout;
    let line = text.lines().find(|line| line.contains("centre of mass")).unwrap();
    assert_eq!(line, "33.341 kg in 35 segments, centre of mass at rest: 0 -0.089 0.02");
    assert!(!ikiru_in(&root(), &["inspect", "builtin:human"]).stdout.contains("centre of mass"));
}
