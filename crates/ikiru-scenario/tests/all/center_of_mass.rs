//! `center_of_mass`: what its keys mean, in whatever world, by whosoever's masses; and each fault alone.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{DQuat, DVec3};
use ikiru_rig::Pose;
use ikiru_rig::body::{Segment, center_of_mass};
use ikiru_scenario::{Scenario, TargetError};
use ikiru_solve::Tolerance;
use ikiru_solve::objectives::CenterOfMass;
use serde_json::json;

use crate::wrong_input::refused_text;

const G1: &str = "version = 1\nrig = \"builtin:g1\"\n";
const HUMAN: &str = "version = 1\nrig = \"builtin:human\"\n";
const REST: &str = "[[objective]]\nkind = \"rest_pose\"\nweight = 0.001\n";

fn scenario(head: &str, keys: &str) -> Scenario {
    let text =
        format!("{head}[[objective]]\nkind = \"center_of_mass\"\n{keys}\n{REST}[stop]\nmax_restarts = 4\n");
    Scenario::parse(&text, "test.toml", ".").unwrap_or_else(|error| panic!("{error}"))
}

fn solved(head: &str, keys: &str) -> (Scenario, Pose) {
    let scenario = scenario(head, keys);
    let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
    let report = scenario.solve(&mut pose, &mut workspace);
    assert!(report.success, "{:?}", report.terms);
    (scenario, pose)
}

/// The centre of mass of a robot's own masses, in the axes of its file.
fn in_file(scenario: &Scenario, pose: &Pose) -> DVec3 {
    let center = center_of_mass(pose, scenario.loaded.segments()).unwrap();
    scenario.loaded.world_from_file().inverse() * center
}

#[test]
fn a_robot_brings_its_own_masses() {
    let keys = "target = [0.01, -0.05, 0.03]\ntolerance = 0.0005\nweight = 10";
    let (scenario, pose) = solved(G1, keys);
    let center = center_of_mass(&pose, scenario.loaded.segments()).unwrap();
    assert!(center.distance(DVec3::new(0.01, -0.05, 0.03)) < 0.0005, "{center}");
    assert_eq!(scenario.target_json(0).to_string(), "[0.01,-0.05,0.03]");
    assert_eq!((scenario.objectives[0].constraint, scenario.joint_name(0)), ("objective", None));
}

#[test]
fn the_ground_of_a_file_is_what_is_not_up_in_it() {
    // Forward by 4 to 6 cm, left by 2 to 3: the centre is at 2 and 0 at rest.
    let file = "world = \"file\"\n";
    let hard = "margin = 0.002\nhard = true";
    let (there, pose) = solved(
        &format!("{G1}{file}"),
        &format!("inside = [[0.04, 0.02], [0.06, 0.02], [0.06, 0.03], [0.04, 0.03]]\n{hard}"),
    );
    let center = in_file(&there, &pose);
    assert!((0.0419..0.0581).contains(&center.x) && (0.0219..0.0281).contains(&center.y), "{center}");
    // It is moved no further than it has to be: to the nearest corner.
    assert!((center.x - 0.042).abs() < 3e-4 && (center.y - 0.022).abs() < 3e-4, "{center}");
    assert_eq!(there.target_text(0, |n| n.to_string()), "over 4 corners, 0.002 m inside");
    // The same in the scene: left is x, forward is z.
    let inside = "inside = [[0.02, 0.04], [0.02, 0.06], [0.03, 0.06], [0.03, 0.04]]";
    let (here, other) = solved(G1, &format!("{inside}\n{hard}"));
    let apart = pose.coords().iter().zip(other.coords()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-6, "{apart}");
    let corners = |scenario: &Scenario| {
        let target = scenario.target_json(0);
        assert_eq!(target["margin"], 0.002);
        let mut corners: Vec<[f64; 2]> = serde_json::from_value(target["inside"].clone()).unwrap();
        corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
        corners
    };
    assert_eq!(corners(&there), [[0.04, 0.02], [0.04, 0.03], [0.06, 0.02], [0.06, 0.03]]);
    assert_eq!(corners(&here), [[0.02, 0.04], [0.02, 0.06], [0.03, 0.04], [0.03, 0.06]]);
    // So is a point.
    let (there, pose) = solved(&format!("{G1}{file}"), "target = [0.03, 0.01, -0.05]\nhard = true");
    assert!(in_file(&there, &pose).distance(DVec3::new(0.03, 0.01, -0.05)) < 0.0001);
    assert_eq!(there.target_json(0).to_string(), "[0.03,0.01,-0.05]");
}

#[test]
fn an_avatar_that_looks_the_other_way_has_its_ground_turned() {
    let rig = concat!(env!("CARGO_MANIFEST_DIR"), "/../ikiru-formats/tests/data/mh_male_vrm0.vrm");
    let head =
        format!("version = 1\nrig = {rig:?}\nactive = [\"spine\", \"leftUpperArm\", \"rightUpperArm\"]\n");
    let masses =
        "masses = { chest = { kg = 30 }, leftHand = { kg = 4 }, rightHand = { kg = 4 } }\nhard = true";
    // To its left and forward: +x and +z in the scene, -x and -z in the file.
    let here = format!("inside = [[0.05, 0.05], [0.05, 0.1], [0.1, 0.05]]\n{masses}");
    let there = format!("inside = [[-0.05, -0.05], [-0.05, -0.1], [-0.1, -0.05]]\n{masses}");
    let (scenario, pose) = solved(&head, &here);
    let (_, other) = solved(&format!("{head}world = \"file\"\n"), &there);
    let apart = pose.coords().iter().zip(other.coords()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-6, "{apart}");
    let joint = |name| scenario.rig.joint(name).unwrap();
    let segment = |(name, kg)| Segment { joint: joint(name), kg, center: DVec3::ZERO };
    let segments = [("chest", 30.0), ("leftHand", 4.0), ("rightHand", 4.0)].map(segment);
    let center = center_of_mass(&pose, &segments).unwrap();
    assert!(center.x > 0.0499 && center.z > 0.0499 && center.x + center.z < 0.1501, "{center}");
}

#[test]
fn masses_of_the_text_take_the_place_of_all() {
    let keys = "target = [0.4, 1.2, 0.3]\nmasses = { hand_l = { kg = 3, center = [0.1, 0, 0] }, head = { kg = 1 } }\n\
                hard = true";
    let (scenario, pose) = solved(HUMAN, keys);
    let frame = |name| pose.frame(scenario.rig.joint(name).unwrap()).unwrap();
    let hand = frame("leftHand").position + frame("leftHand").rotation * DVec3::X * 0.1;
    let center = 0.75 * hand + 0.25 * frame("head").position;
    assert!(center.distance(DVec3::new(0.4, 1.2, 0.3)) < 1e-4, "{center}");
    let id = scenario.objectives[0].id::<CenterOfMass>().unwrap();
    assert_eq!(
        (scenario.problem[id].segments().len(), scenario.problem.term(id).tolerance),
        (2, Tolerance::HARD)
    );
    // A robot's own masses are left out where the text has some.
    let robot = self::scenario(G1, "target = [0, 0, 0]\nmasses = { pelvis = { kg = 2 } }");
    assert_eq!(robot.problem[robot.objectives[0].id::<CenterOfMass>().unwrap()].segments().len(), 1);
}

#[test]
fn a_point_moves_and_an_area_stays() {
    let mut point = scenario(&format!("{G1}world = \"file\"\n"), "target = [0, 0, 0]");
    point.set_target(0, DVec3::new(0.25, 0.5, 0.75)).unwrap();
    assert_eq!(point.target_json(0), json!([0.25, 0.5, 0.75]));
    let kind = |word| Err(TargetError::Kind(0, "center_of_mass", word));
    assert_eq!(point.set_target_rotation(0, DQuat::IDENTITY), kind("rotation"));
    let mut area = scenario(G1, "inside = [[0, 0], [1, 0], [0, 1]]");
    assert_eq!(area.target_text(0, |n| n.to_string()), "over 3 corners");
    assert_eq!(area.set_target(0, DVec3::ZERO), kind("point"));
}

#[test]
fn each_fault_alone() {
    let of = |head: &str, keys: &str| format!("{head}[[objective]]\nkind = \"center_of_mass\"\n{keys}\n");
    let refused = |keys: &str, at, words: &[&str]| refused_text(&of(G1, keys), at, words);
    let none = of(HUMAN, "target = [0, 1, 0]");
    let says = ["objective 1 lacks 'masses'", "{ NAME = { kg = 1.0, center = [x, y, z] } }", "<inertial>"];
    assert_eq!(refused_text(&none, (3, 1), &says), "MissingKey");
    let kind = refused("masses = {}\ntarget = [0, 1, 0]", (5, 10), &["'masses' has 0", "at least one joint"]);
    assert_eq!(kind, "Length");
    assert_eq!(refused("", (3, 1), &["neither", "either 'target'", "'inside'"]), "Alternatives");
    refused("target = [0, 1, 0]\nmargin = 0.1", (3, 1), &["'target' and 'margin'", "either 'target'"]);
    refused("target = [0, 1, 0]\ninside = [[0, 0], [1, 0], [0, 1]]", (3, 1), &["'target' and 'inside'"]);
    refused("target = [0, 1]", (5, 10), &["2 entries", "a point of the world in metres"]);
    refused("inside = [[0, 0, 0]]", (5, 11), &["3 entries", "[x, z]"]);
    refused("inside = 1", (5, 10), &["'inside' is a number", "[[x, z], …]"]);
    let line =
        refused("inside = [[0, 0], [1, 1], [2, 2]]", (5, 10), &["objective 1 has an area without extent"]);
    assert_eq!(line, "Objective");
    let area = "inside = [[0, 0], [1, 0], [0, 1]]";
    refused(&format!("{area}\nmargin = 0.3"), (5, 10), &["objective 1 has a margin that leaves nothing"]);
    assert_eq!(
        refused(&format!("{area}\nmargin = -0.1"), (6, 10), &["'margin' is -0.1", "at least 0"]),
        "OutOfRange"
    );
    refused(&format!("{area}\nmargin = nan"), (6, 10), &["finite"]);
    let masses = |inside: &str| format!("{area}\nmasses = {{ {inside} }}");
    refused(&masses("pelvis = { kg = 0 }"), (6, 28), &["'kg' is 0", "above 0"]);
    refused(&masses("pelvis = { center = [0, 0, 0] }"), (6, 21), &["lacks 'kg'", "kilograms"]);
    refused(&masses("pelvis = { kg = 1, centre = [0, 0, 0] }"), (6, 31), &["did you mean 'center'"]);
    refused(&masses("pelvis = 3"), (6, 21), &["a number", "a table"]);
    assert_eq!(refused(&masses("pelvs = { kg = 1 }"), (6, 12), &["did you mean 'pelvis'"]), "UnknownJoint");
    let twice =
        refused(&masses("pelvis = { kg = 1 }, hips = { kg = 1 }"), (6, 33), &["'hips' is the same joint"]);
    assert_eq!(twice, "Twice");
    refused("target = [0, 1, 0]\ntolerance_deg = 1", (6, 1), &["(center_of_mass)", "'tolerance'"]);
}
