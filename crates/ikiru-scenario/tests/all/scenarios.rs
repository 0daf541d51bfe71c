//! What a scenario means: rig, start, objectives, stopping rules.

use glam::{DQuat, DVec3};
use ikiru_rig::{EulerOrder, JointMotion};
use ikiru_scenario::{BUILTINS, Scenario, ScenarioPose, TargetError, Warning};
use ikiru_solve::objectives::{Gaze, LookAt, PoseTarget, Position};
use ikiru_solve::{Loss, Search, Unit};

fn parse(text: &str) -> Scenario {
    Scenario::parse(text, "test.toml", ".").unwrap_or_else(|error| panic!("{error}"))
}

const HEAD: &str = "version = 1\nrig = \"builtin:reference\"\n";
const REACH: &str = "[[objective]]\nkind = \"position\"\njoint = \"left_wrist\"\ntarget = [0.4, 0.1, 0.3]\n";

#[test]
fn everything_left_out_has_its_default() {
    let scenario = parse(&format!("{HEAD}{REACH}"));
    let options = scenario.solver.options();
    assert_eq!((options.cost_below, options.max_iterations, options.max_time), (None, 500, None));
    assert_eq!(options.search, Search::Global { max_restarts: 64 });
    assert_eq!(scenario.active.len(), scenario.rig.joints().iter().filter(|j| j.n_dofs() > 0).count());
    assert_eq!(scenario.start, scenario.rig.rest_pose());
    let id = scenario.objectives[0].id::<Position>().unwrap();
    assert_eq!((scenario.problem.term(id).loss, scenario.problem[id].point), (Loss::Squared, DVec3::ZERO));
    assert_eq!(scenario.problem.terms()[0].weight, 1.0);
    assert!(scenario.loaded.rig.is_same(&scenario.rig) && scenario.warnings.is_empty());
}

#[test]
fn stopping_rules_arrive() {
    let stop = "[stop]\ncost_below = 0.005\nmax_iterations = 7\nmax_restarts = 0\nmax_time_ms = 1.5\n";
    let scenario = parse(&format!("{HEAD}method = \"adam\"\n{REACH}{stop}"));
    let options = scenario.solver.options();
    assert_eq!((options.cost_below, options.max_iterations, options.search), (Some(0.005), 7, Search::Local));
    assert_eq!(options.max_time.unwrap().as_micros(), 1500);
    assert_eq!(scenario.method(), "adam");
}

#[test]
fn limits_and_root_make_the_rig() {
    let limits = "root = \"free\"\n[limits.left_elbow]\nmin_deg = [-45, -180, -10]\nmax_deg = [90, 5, 10]\n\
                  [limits.left_hip]\naxis = [0, 2, 0]\nswing_deg = [70, 40]\n";
    let scenario = parse(&format!("{HEAD}{limits}{REACH}"));
    let motion = |name: &str| scenario.rig.get(scenario.rig.joint(name).unwrap()).unwrap().motion;
    let JointMotion::Euler { order: EulerOrder::Zyx, ranges } = motion("left_elbow") else { panic!() };
    assert!(
        (ranges[1].min + std::f64::consts::PI).abs() < 1e-12
            && (ranges[0].max.to_degrees() - 90.0).abs() < 1e-9
    );
    let JointMotion::Ball { cone: Some(cone) } = motion("left_hip") else { panic!() };
    assert_eq!(cone.axis(), DVec3::Y);
    assert!((cone.twist().max.to_degrees() - 180.0).abs() < 1e-9);
    assert!(matches!(motion("pelvis"), JointMotion::Free { cone: None }));
    assert!(scenario.loaded.rig.is_same(&scenario.rig));
}

#[test]
fn starts_are_set_and_projected_with_a_warning() {
    let text = "root = \"free\"\n[limits.left_elbow]\nmin_deg = [0, -100, 0]\nmax_deg = [0, 0, 0]\n\
                [start]\nroot_translation = [0, 1, 0]\nleft_elbow = { euler_deg = [0, -130, 0] }\n\
                left_wrist = { euler_deg = [0, 0, 90] }\nhead = { rotation = [0, 3, 0, 4] }\n";
    let scenario = parse(&format!("{HEAD}{text}{REACH}"));
    let (rig, start) = (&scenario.rig, &scenario.start);
    assert_eq!(start.translation(rig.joint("pelvis").unwrap()).unwrap(), DVec3::Y);
    assert!((start.euler(rig.joint("left_elbow").unwrap()).unwrap()[1].to_degrees() + 100.0).abs() < 1e-9);
    let wrist = start.rotation(rig.joint("left_wrist").unwrap()).unwrap();
    assert!((wrist * DVec3::X - DVec3::Y).length() < 1e-12);
    assert!((start.rotation(rig.joint("head").unwrap()).unwrap().w - 0.8).abs() < 1e-12);
    let [Warning::Projected { pose: ScenarioPose::Start, joint, distance, is_slider: false }] =
        &scenario.warnings[..]
    else {
        panic!("{:?}", scenario.warnings)
    };
    assert!(joint == "left_elbow" && (distance.to_degrees() - 30.0).abs() < 1e-9);
}

#[test]
fn a_rotation_for_an_euler_joint_takes_the_angles_inside_its_ranges() {
    let text = "[limits.left_elbow]\nmin_deg = [-10, -180, -10]\nmax_deg = [10, 0, 10]\n\
                [start]\nleft_elbow = { rotation = [0, -0.8660254037844386, 0, 0.5] }\n";
    let scenario = parse(&format!("{HEAD}{text}{REACH}"));
    let angles = scenario.start.euler(scenario.rig.joint("left_elbow").unwrap()).unwrap();
    assert!((angles[1].to_degrees() + 120.0).abs() < 1e-6, "{angles:?}");
    assert_eq!(scenario.warnings, []);
}

#[test]
fn a_rest_pose_outside_the_limits_is_said_so() {
    let text = "[limits.left_elbow]\nmin_deg = [0, -100, 0]\nmax_deg = [0, -10, 0]\n";
    let scenario = parse(&format!("{HEAD}{text}{REACH}"));
    assert!(matches!(scenario.warnings[..], [Warning::Projected { pose: ScenarioPose::Rest, .. }]));
    assert!(scenario.warnings[0].to_string().contains("the rest pose of 'left_elbow' lies 10.000° outside"));
}

#[test]
fn what_nothing_moves_is_said_so() {
    let scenario = parse(&format!("{HEAD}active = [\"right_elbow\"]\n{REACH}"));
    let [warning] = &scenario.warnings[..] else { panic!("{:?}", scenario.warnings) };
    assert!(warning.to_string().contains("no active joint moves 'left_wrist'"), "{warning}");
}

#[test]
fn objectives_carry_what_the_text_says() {
    let text = r#"
[[objective]]
kind = "pose"
joint = "left_wrist"
point = [0.1, 0, 0]
target = [0.4, 0.1, 0.3]
euler_deg = [0, 90, 0]
loss = { huber = 0.1 }
[[objective]]
kind = "look_at"
joint = "head"
axis = [0, 0, 1]
target = [1, 2, 3]
mandatory = false
[[objective]]
kind = "look_at"
joint = "left_wrist"
axis = [0, 1, 0]
length = 0.0915
offset_from_tip = [0, 1, 0]
[[objective]]
kind = "direction"
joint = "left_wrist"
axis = [0, -1, 0]
target = [0, -2, 0]
[[objective]]
kind = "known_rotation"
joints = { left_elbow = { euler_deg = [0, -90, 0] } }
[[objective]]
kind = "rest_pose"
weight = 0.01
joints = ["spine1", "spine2"]
"#;
    let scenario = parse(&format!("{HEAD}{text}"));
    let p = &scenario.problem;
    let kinds: Vec<_> = scenario.objectives.iter().map(|o| o.kind).collect();
    assert_eq!(kinds, ["pose", "look_at", "look_at", "direction", "known_rotation", "rest_pose"]);
    let id = scenario.objectives[0].id::<PoseTarget>().unwrap();
    assert_eq!((p.term(id).loss, p[id].point.x), (Loss::Huber { width: 0.1 }, 0.1));
    assert!((p[id].rotation * DVec3::Z - DVec3::X).length() < 1e-12);
    let id = scenario.objectives[2].id::<LookAt>().unwrap();
    assert_eq!(p[id].gaze, Gaze::OffsetFromTip { length: 0.0915, offset: DVec3::Y });
    assert_eq!(scenario.target_json(0), serde_json::json!([0.4, 0.1, 0.3]));
    assert_eq!(
        scenario.target_json(2),
        serde_json::json!({ "length": 0.0915, "offset_from_tip": [0.0, 1.0, 0.0] })
    );
    assert!(scenario.target_json(4)["left_elbow"]["rotation"].is_array());
    assert!(scenario.target_json(5).is_null() && scenario.target_json(99).is_null());
    let texts: Vec<String> = (0..7).map(|idx| scenario.target_text(idx, |n| n.to_string())).collect();
    let expected = [
        "0.4, 0.1, 0.3, turned",
        "1, 2, 3",
        "tip + 0, 1, 0",
        "along 0, -2, 0",
        "given angles",
        "the rest pose",
        "",
    ];
    assert_eq!(texts, expected);
    assert_eq!(scenario.joint_name(4), Some("left_elbow"));
    assert_eq!(scenario.joint_name(5), None);
    let mut pose = scenario.start.clone();
    let mut workspace = scenario.workspace();
    let report = scenario.solve(&mut pose, &mut workspace);
    let mandatory: Vec<_> = report.terms.iter().map(|t| t.mandatory).collect();
    assert_eq!(mandatory, [true, false, true, true, true, false]);
}

#[test]
fn what_slides_has_a_tolerance_in_metres() {
    // The finger goes to 4 cm, no further.
    let text = "version = 1\nrig = \"builtin:panda\"\n[[objective]]\nkind = \"known_rotation\"\n\
                joints = { panda_finger_joint1 = { offset = 0.05 } }\n";
    for (tolerance, satisfied) in [("0.009", false), ("0.011", true)] {
        let scenario = parse(&format!("{text}tolerance = {tolerance}\n"));
        let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
        let report = scenario.solve(&mut pose, &mut workspace);
        assert_eq!((report.terms[0].satisfied, report.terms[0].unit), (satisfied, Unit::Metres));
    }
}

#[test]
fn targets_can_be_changed() {
    let more = "[[objective]]\nkind = \"orientation\"\njoint = \"head\"\ntarget_rotation = [0, 0, 0, 1]\n";
    let mut scenario = parse(&format!("{HEAD}{REACH}{more}"));
    let (wrist, head) = (scenario.rig.joint("left_wrist").unwrap(), scenario.rig.joint("head").unwrap());
    let mut workspace = scenario.workspace();
    let mut pose = scenario.start.clone();
    for x in [0.3, 0.35, 0.4] {
        let (target, turn) = (DVec3::new(x, 0.0, 0.3), DQuat::from_rotation_y(x));
        scenario.set_target(0, target).unwrap();
        scenario.set_target_rotation(1, turn).unwrap();
        assert!(scenario.solve(&mut pose, &mut workspace).success);
        assert!(pose.frame(wrist).unwrap().position.distance(target) < 1e-3);
        assert!(pose.frame(head).unwrap().rotation.angle_between(turn) < 0.01);
    }
    assert_eq!(scenario.set_target(1, DVec3::ZERO), Err(TargetError::Kind(1, "orientation", "point")));
    assert_eq!(scenario.set_target_rotation(7, DQuat::IDENTITY), Err(TargetError::NoObjective(7, 2)));
}

#[test]
fn paths_are_relative_to_the_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let human = ikiru_formats::builtin("reference").unwrap();
    let bytes = ikiru_formats::write_posed_glb(&human, &human.rig.rest_pose()).unwrap();
    std::fs::create_dir(folder.path().join("rigs")).unwrap();
    std::fs::write(folder.path().join("rigs/own.glb"), bytes).unwrap();
    let path = folder.path().join("reach.toml");
    std::fs::write(&path, format!("version = 1\nrig = \"rigs/own.glb\"\n{REACH}")).unwrap();
    assert_eq!(Scenario::read(&path).unwrap().rig.n_joints(), human.rig.n_joints());
}

#[test]
fn built_in_scenarios_are_those_of_the_suite() {
    for (name, text) in BUILTINS {
        Scenario::builtin(name).unwrap_or_else(|error| panic!("{error}"));
        let suite = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/");
        assert_eq!(std::fs::read_to_string(format!("{suite}{name}.toml")).unwrap(), text, "{name}");
    }
}

#[test]
fn an_end_of_a_bone_that_stays_still_moves_the_other() {
    // A distance or a place beside a joint is in hand as soon as one of its joints is.
    let apart = "[[objective]]\nkind = \"distance\"\njoints = [\"left_wrist\", \"head\"]\nexactly = 0.4\n";
    let scenario = parse(&format!("{HEAD}active = [\"left_elbow\"]\n{apart}"));
    assert!(scenario.warnings.is_empty() && scenario.out_of_hand(0).is_none(), "{:?}", scenario.warnings);
    let scenario = parse(&format!("{HEAD}active = [\"right_elbow\"]\n{apart}"));
    assert_eq!(scenario.out_of_hand(0), Some("left_wrist"));
}

#[test]
fn targets_come_back_as_they_were_written_until_they_are_changed() {
    let text = "version = 1\nrig = \"builtin:panda\"\nworld = \"file\"\n[[objective]]\nkind = \"position\"\n\
                joint = \"panda_link8\"\ntarget = [0.35, -0.35, 0.4]\n[[objective]]\nkind = \"known_rotation\"\n\
                joints = { panda_joint1 = { angle_deg = 33 } }\n";
    let mut scenario = parse(text);
    assert_eq!(scenario.target_json(0).to_string(), "[0.35,-0.35,0.4]");
    assert_eq!(scenario.target_json(1)["panda_joint1"]["angle_deg"].to_string(), "33.0");
    scenario.set_target(0, DVec3::new(0.5, 0.25, 0.5)).unwrap();
    let changed: Vec<f64> =
        scenario.target_json(0).as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect();
    assert!(DVec3::from_slice(&changed).distance(DVec3::new(0.5, 0.25, 0.5)) < 1e-12);
    // A term that is taken out of the problem aims at nothing, whatever became of the others.
    let reach = scenario.objectives[0].id::<Position>().unwrap();
    assert!(scenario.problem.remove(reach).is_some());
    assert!(scenario.target_json(0).is_null() && scenario.target_json(1).is_object());
    assert!(scenario.set_target(0, DVec3::X).is_err());
}

#[test]
fn half_widths_of_cones_are_about_the_axes_that_the_documents_draw() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/axes.md")).unwrap();
    let word = |v: DVec3| {
        let (idx, part) = v.to_array().into_iter().enumerate().find(|(_, part)| part.abs() > 0.999).unwrap();
        format!("{}{}", if part < 0.0 { '−' } else { '+' }, ["x", "y", "z"][idx])
    };
    for (axis, name) in [(DVec3::X, "[1, 0, 0]"), (DVec3::Y, "[0, 1, 0]"), (DVec3::Z, "[0, 0, 1]")] {
        let limits = format!("[limits.head]\naxis = {name}\nswing_deg = [50, 20]\n");
        let scenario = parse(&format!("{HEAD}{limits}{REACH}"));
        let head = scenario.rig.joint("head").unwrap();
        let cone = *scenario.rig.get(head).unwrap().motion.cone().unwrap();
        // What is inside the first half-width is beyond the second.
        let row = |about: DVec3, width: f64| {
            let turn = DQuat::from_axis_angle(about, width.to_radians());
            assert!(cone.distance(turn)[0] < 1e-9, "{name} about {about}");
            let towards = (turn * axis).reject_from(axis).normalize();
            format!("{} | ±{}", word(about), word(towards).trim_start_matches(['−', '+']))
        };
        let (first, second) = (cone.first_swing_axis(), cone.second_swing_axis());
        let line = format!("| `{name}` | {} | {} |", row(first, 49.0), row(second, 19.0));
        assert!(text.contains(&line), "{line}");
        for about in [second, -second] {
            assert!(cone.distance(DQuat::from_axis_angle(about, 0.7))[0] > 0.1);
        }
    }
}
