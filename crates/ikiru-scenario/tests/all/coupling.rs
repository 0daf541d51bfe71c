//! `coupling`: what its keys mean, on hinges, sliders, Euler joints and balls; and each fault alone.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{DQuat, DVec3};
use ikiru_rig::Pose;
use ikiru_scenario::Scenario;
use ikiru_solve::Unit;
use ikiru_solve::objectives::Coupling;
use serde_json::json;

use crate::wrong_input::refused_text;

const ROBOT: &str = "version = 1\nrig = \"builtin:panda\"\n";
const HUMAN: &str = "version = 1\nrig = \"builtin:human\"\n";

/// What the other joints do.
const REST: &str = "[[objective]]\nkind = \"rest_pose\"\nweight = 0.1\n";

/// A scenario whose first objective is a coupling, solved.
fn solved(head: &str, coupling: &str, more: &str) -> (Scenario, Pose) {
    let text =
        format!("{head}[[objective]]\nkind = \"coupling\"\n{coupling}\n{more}[stop]\nmax_restarts = 8\n");
    let scenario = Scenario::parse(&text, "test.toml", ".").unwrap_or_else(|error| panic!("{error}"));
    let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
    let report = scenario.solve(&mut pose, &mut workspace);
    assert!(report.success, "{:?}", report.terms);
    (scenario, pose)
}

/// The value of a hinge or slider.
fn value(pose: &Pose, name: &str) -> f64 {
    pose.value(pose.rig().joint(name).unwrap()).unwrap()
}

#[test]
fn hinges_add_up() {
    // The wish pulls the other way: the elbow wants to be at -60°.
    let wish = "[[objective]]\nkind = \"known_rotation\"\nmandatory = false\n\
                joints = { panda_joint2 = { angle_deg = 50 }, panda_joint4 = { angle_deg = -60 } }\n";
    let sum = "angles = [{ joint = \"panda_joint2\", factor = 1.0 }, { joint = \"panda_joint4\", factor = -0.5 }]\n";
    let of = |pose: &Pose| (value(pose, "panda_joint2") - 0.5 * value(pose, "panda_joint4")).to_degrees();
    let (scenario, pose) = solved(ROBOT, &format!("{sum}at_most_deg = 60\nhard = true"), wish);
    assert!((of(&pose) - 60.0).abs() < 0.0101, "{}", of(&pose));
    assert_eq!(scenario.target_json(0), json!({ "at_most_deg": 60.0 }));
    assert_eq!(scenario.target_text(0, |n| n.to_string()), "at most 60°");
    assert_eq!((scenario.objectives[0].kind, scenario.objectives[0].constraint), ("coupling", "coupling"));
    let term = scenario.problem.term(scenario.objectives[0].id::<Coupling>().unwrap());
    assert!(term.hard && term.tolerance == ikiru_solve::Tolerance::HARD);
    let (_, pose) = solved(ROBOT, &format!("{sum}at_least_deg = 90.5\nhard = true"), wish);
    assert!((of(&pose) - 90.5).abs() < 0.0101, "{}", of(&pose));
    let (_, pose) = solved(ROBOT, &format!("{sum}exactly_deg = 77\nweight = 1000"), wish);
    assert!((of(&pose) - 77.0).abs() < 0.5, "{}", of(&pose));
    // Nothing is asked of a bound that is kept.
    let (_, pose) = solved(ROBOT, &format!("{sum}at_most_deg = 85\nhard = true"), wish);
    assert!((of(&pose) - 80.0).abs() < 1e-3, "{}", of(&pose));
}

#[test]
fn offsets_of_sliders_are_metres() {
    let sum = "angles = [{ joint = \"panda_finger_joint1\", factor = 2.0 }]\nat_least = 0.05\nhard = true";
    let (scenario, pose) = solved(ROBOT, sum, REST);
    assert!((2.0 * value(&pose, "panda_finger_joint1") - 0.05).abs() < 1e-4);
    assert_eq!(scenario.target_json(0), json!({ "at_least": 0.05 }));
    assert_eq!(scenario.target_text(0, |n| n.to_string()), "at least 0.05 m");
    let coupling = &scenario.problem[scenario.objectives[0].id::<Coupling>().unwrap()];
    assert_eq!((coupling.unit(), scenario.joint_name(0)), (Unit::Metres, Some("panda_finger_joint1")));
}

#[test]
fn euler_joints_have_three_angles() {
    let limits = "[limits.leftLowerArm]\nmin_deg = [-80, -145, -20]\nmax_deg = [80, 0, 20]\n";
    let sum = "angles = [{ joint = \"leftLowerArm\", axis = [0, 1, 0], factor = -1 }, \
               { joint = \"leftLowerArm\", axis = [0, 0, 1], factor = 2 }]\nexactly_deg = 70\nhard = true";
    let (scenario, pose) = solved(&format!("{HUMAN}{limits}"), sum, REST);
    let angles = pose.euler(scenario.rig.joint("leftLowerArm").unwrap()).unwrap();
    assert!((2.0 * angles[2] - angles[1] - 70_f64.to_radians()).abs() < 2e-4, "{angles:?}");
    assert_eq!(scenario.joint_name(0), None);
}

/// The angle by which a rotation swings about an axis: without its twist about another.
fn swing_about(rotation: DQuat, axis: DVec3, twist: DVec3) -> f64 {
    let along = twist * rotation.xyz().dot(twist);
    let twisted = DQuat::from_xyzw(along.x, along.y, along.z, rotation.w).normalize();
    (rotation * twisted.inverse()).to_scaled_axis().dot(axis)
}

#[test]
fn balls_swing_about_an_axis_of_their_parent() {
    // The hip bends half as much as the knee, about the line through both hips, whatever axes the file has.
    let rig = ikiru_formats::builtin("human").unwrap().rig;
    let (hip, knee) = (rig.joint("leftUpperLeg").unwrap(), rig.joint("leftLowerLeg").unwrap());
    let parent_of = |joint| rig.rest_pose().frame(rig.get(joint).unwrap().parent.unwrap()).unwrap().rotation;
    let axes = [hip, knee].map(|joint| parent_of(joint).inverse() * DVec3::X);
    let [a, b] = axes.map(|axis| axis.to_array());
    let limits = "[limits.leftUpperLeg]\naxis = [0, 1, 0]\nswing_deg = [120, 60]\n\
                  [limits.leftLowerLeg]\naxis = [0, 1, 0]\nswing_deg = [150, 20]\n";
    let sum = format!(
        "angles = [{{ joint = \"leftUpperLeg\", axis = {a:?}, factor = 2 }}, \
         {{ joint = \"leftLowerLeg\", axis = {b:?}, factor = 1 }}]\nexactly_deg = 0\nhard = true"
    );
    let more = "[[objective]]\nkind = \"position\"\njoint = \"leftFoot\"\ntarget = [0.1, 0.5, 0.05]\nmandatory = false\n";
    let head = format!("{HUMAN}active = [\"leftUpperLeg\", \"leftLowerLeg\"]\n{limits}");
    let (scenario, pose) = solved(&head, &sum, more);
    let swing = |joint, axis: DVec3| {
        let rest = rig.get(joint).unwrap().rest_rotation;
        swing_about(pose.rotation(joint).unwrap(), rest.inverse() * axis, DVec3::Y)
    };
    let (at_hip, at_knee) = (swing(hip, axes[0]), swing(knee, axes[1]));
    assert!((2.0 * at_hip + at_knee).abs() < 2e-4, "{at_hip}, {at_knee}");
    assert!(at_knee.abs() > 0.5 && scenario.warnings.is_empty(), "{at_knee}");
}

#[test]
fn a_coupling_is_the_same_in_any_world() {
    let sum = "angles = [{ joint = \"panda_joint2\", factor = 1 }]\nexactly_deg = 33.3";
    let (here, pose) = solved(ROBOT, sum, "");
    let (there, other) = solved(&format!("{ROBOT}world = \"file\"\n"), sum, "");
    assert_eq!(pose.coords(), other.coords());
    assert_eq!(here.target_json(0), there.target_json(0));
    assert_eq!(there.target_json(0).to_string(), r#"{"exactly_deg":33.3}"#);
}

#[test]
fn a_sum_is_in_hand_as_long_as_one_of_its_joints_is() {
    let text = |active: &str| {
        format!(
            "{ROBOT}active = [\"{active}\"]\n[[objective]]\nkind = \"coupling\"\nat_most_deg = 9\n\
             angles = [{{ joint = \"panda_joint2\", factor = 1 }}, {{ joint = \"panda_joint4\", factor = 1 }}]\n"
        )
    };
    let out_of_hand = |active| {
        let scenario = Scenario::parse(&text(active), "test.toml", ".").unwrap();
        scenario.out_of_hand(0).map(str::to_owned)
    };
    assert_eq!(out_of_hand("panda_joint4"), None);
    assert_eq!(out_of_hand("panda_joint1").as_deref(), Some("panda_joint2"));
}

#[test]
fn each_fault_alone() {
    let of = |head: &str, keys: &str| format!("{head}[[objective]]\nkind = \"coupling\"\n{keys}\n");
    let refused = |keys: &str, at, words: &[&str]| refused_text(&of(ROBOT, keys), at, words);
    let good = "angles = [{ joint = \"panda_joint2\", factor = 1 }]";
    assert_eq!(refused("at_most_deg = 3", (3, 1), &["lacks 'angles'", "factor = 1.0"]), "MissingKey");
    assert_eq!(refused(good, (3, 1), &["neither", "one of 'at_most_deg'"]), "Alternatives");
    let both = format!("{good}\nat_most_deg = 3\nat_least_deg = 1");
    refused(&both, (3, 1), &["'at_least_deg' and 'at_most_deg'", "one of"]);
    let kind = refused(
        &format!("{good}\nat_most = 3"),
        (6, 1),
        &["has 'at_most'", "'at_most_deg'", "sum of angles"],
    );
    assert_eq!(kind, "Alternatives");
    let slides = "angles = [{ joint = \"panda_finger_joint1\", factor = 1 }]\nat_most_deg = 3";
    refused(slides, (6, 1), &["has 'at_most_deg'", "'at_most', 'at_least' or 'exactly' (metres)"]);
    refused("angles = [{ joint = \"panda_joint2\" }]\nat_most_deg = 3", (5, 11), &["lacks 'factor'"]);
    refused("angles = [{ factor = 1 }]\nat_most_deg = 3", (5, 11), &["lacks 'joint'"]);
    refused("angles = 3\nat_most_deg = 3", (5, 10), &["'angles' is a number", "[{ joint"]);
    refused("angles = [3]\nat_most_deg = 3", (5, 11), &["a number", "a table"]);
    let near = &["did you mean 'factor'"];
    refused("angles = [{ joint = \"panda_joint2\", facto = 1 }]\nat_most_deg = 3", (5, 37), near);
    assert_eq!(
        refused("angles = []\nat_most_deg = 3", (5, 10), &["objective 1 couples no angle"]),
        "Objective"
    );
    let unknown = "angles = [{ joint = \"panda_joint_2\", factor = 1 }]\nat_most_deg = 3";
    assert_eq!(refused(unknown, (5, 21), &["did you mean 'panda_joint2'"]), "UnknownJoint");
    refused(&format!("{good}\nat_most_deg = inf"), (6, 15), &["finite"]);
    // What does not fit is the second angle, and is named.
    let second = |angle: &str| {
        format!(
            "angles = [{{ joint = \"panda_joint2\", factor = 1 }},\n{{ {angle}, factor = 1 }}]\nat_most_deg = 3"
        )
    };
    let kind = refused(&second("joint = \"panda_joint8\""), (6, 1), &["does not move: joint 'panda_joint8'"]);
    assert_eq!(kind, "Objective");
    refused(&second("joint = \"panda_joint4\", axis = [1, 0, 0]"), (6, 1), &["gives an axis to a hinge"]);
    refused(&second("joint = \"panda_joint4\", axis = [0, 0, 0]"), (6, 34), &["length 0"]);
    refused(&second("joint = \"panda_finger_joint1\""), (6, 1), &["objective 1 adds angles and offsets"]);
    let follower = "angles = [{ joint = \"panda_finger_joint2\", factor = 1 }]\nat_most = 3";
    refused(follower, (5, 11), &["follows another", "joint 'panda_finger_joint2'"]);
    let ball = of(HUMAN, "angles = [{ joint = \"leftUpperArm\", factor = 1 }]\nat_most_deg = 3");
    refused_text(&ball, (5, 11), &["leaves out the axis", "'upperarm_l'"]);
}
