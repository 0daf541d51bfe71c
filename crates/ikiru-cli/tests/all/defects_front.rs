//! What was wrong in what people and programs are told, each named after its cause.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;

use crate::common::{Run, ikiru, ikiru_fed, ikiru_in, root};
use glam::{DQuat, DVec3};
use ikiru_rig::{Clip, Rig};
use ikiru_scenario::Scenario;
use ikiru_testkit::reference::world_matrices;
use serde_json::Value;

const ARM: &str = "version = 1\nrig = \"builtin:human\"\nactive = [\"leftUpperArm\", \"leftLowerArm\"]\n";
const REACH: &str = "[[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0.35, 1.1, 0.3]\n";

#[track_caller]
fn run(folder: &Path, command: &str, text: &str, more: &[&str]) -> Run {
    std::fs::write(folder.join("s.toml"), text).unwrap();
    ikiru_in(folder, &[&[command, "s.toml"], more].concat())
}

fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect()
}

fn vector(list: &Value) -> DVec3 {
    DVec3::from_slice(&numbers(list))
}

fn data(name: &str) -> String {
    format!("{}/../ikiru-formats/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn joint<'v>(report: &'v Value, name: &str) -> &'v Value {
    report["joints"].as_array().unwrap().iter().find(|j| j["name"] == name).unwrap()
}

/// A skinned chain of two nodes and so many animations whose channels a rig does not have.
fn with_scaled_clips(count: usize) -> String {
    let animation = |idx: usize| {
        format!(
            r#"{{"name":"clip{idx}","channels":[{{"sampler":0,"target":{{"node":1,"path":"scale"}}}}],
            "samplers":[{{"input":0,"output":1}}]}}"#
        )
    };
    let animations: Vec<String> = (0..count).map(animation).collect();
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"name":"a","children":[1]}},{{"name":"b","translation":[0,1,0]}}],
        "skins":[{{"joints":[0,1]}}],"animations":[{}],
        "buffers":[{{"byteLength":32,"uri":"data:application/octet-stream;base64,AAAAAAAAgD8AAIA/AACAPwAAgD8AAABAAAAAQAAAAEA="}}],
        "bufferViews":[{{"buffer":0,"byteLength":8}},{{"buffer":0,"byteOffset":8,"byteLength":24}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]}},
        {{"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"}}]}}"#,
        animations.join(",")
    )
}

#[test]
fn inspect_tells_where_joints_are_and_how_they_are_turned() {
    for name in ["builtin:human", "builtin:panda", &data("mh_male_vrm1.vrm")] {
        let report = ikiru(&["inspect", name, "--json"]).json();
        let loaded = ikiru_formats::read(name).unwrap();
        let matrices = world_matrices(&loaded.rig.rest_pose());
        let joints = report["joints"].as_array().unwrap();
        assert_eq!(joints.len(), loaded.rig.n_joints());
        for (told, matrix) in joints.iter().zip(&matrices) {
            let keys: Vec<&String> = told.as_object().unwrap().keys().collect();
            let expected = ["name", "parent", "motion", "role", "limits", "limits_from", "rest", "follows"];
            assert_eq!(keys, expected);
            let position = vector(&told["rest"]["position"]);
            assert!(position.distance(matrix.w_axis.truncate()) < 1e-9, "{told}");
            let rotation = DQuat::from_slice(&numbers(&told["rest"]["rotation"]));
            for (axis, column) in
                [(DVec3::X, matrix.x_axis), (DVec3::Y, matrix.y_axis), (DVec3::Z, matrix.z_axis)]
            {
                assert!((rotation * axis).distance(column.truncate()) < 1e-9, "{told}");
            }
            assert_eq!(told["limits"].is_null(), told["limits_from"].is_null(), "{told}");
        }
    }
    let human = ikiru(&["inspect", "builtin:human", "--json"]).json();
    assert!((1.4..1.8).contains(&human["height"].as_f64().unwrap()), "{}", human["height"]);
    assert!(vector(&human["facing"]).distance(DVec3::Z) < 0.05, "{}", human["facing"]);
    let panda = ikiru(&["inspect", "builtin:panda", "--json"]).json();
    assert!(panda["facing"].is_null());
    assert_eq!(joint(&panda, "panda_joint1")["limits_from"], "file");
    // The text has the same: what stands there is where a target can be.
    let text = ikiru(&["inspect", "builtin:human"]).stdout;
    let hand = vector(&joint(&human, "hand_l")["rest"]["position"]);
    let line = text.lines().find(|line| line.contains("hand_l")).unwrap();
    for metres in hand.to_array() {
        assert!(line.contains(format!("{metres:.3}").trim_end_matches('0')), "{metres} is not in {line}");
    }
    for word in ["position", "axes", "bone", "motion and limits", "m from the lowest joint", "faces +z"] {
        assert!(text.contains(word), "{word} is missing in {text}");
    }
}

#[test]
fn inspect_shows_the_limits_of_a_scenario_as_the_scenarios() {
    let folder = tempfile::tempdir().unwrap();
    let limits = "[limits.leftUpperArm]\naxis = [0, 1, 0]\nswing_deg = [70, 40]\n\
                  [limits.leftLowerArm]\nmin_deg = [-80, -145, 0]\nmax_deg = [80, 0, 0]\n";
    let text = format!("{ARM}{limits}{REACH}");
    let report = run(folder.path(), "inspect", &text, &["--json"]).json();
    let (elbow, hand) = (joint(&report, "lowerarm_l"), joint(&report, "hand_l"));
    assert_eq!((&elbow["motion"], &elbow["limits_from"]), (&"euler".into(), &"scenario".into()));
    assert_eq!(numbers(&elbow["limits"]["min_deg"]).iter().map(|d| d.round()).sum::<f64>(), -225.0);
    assert!(hand["limits"].is_null() && hand["limits_from"].is_null());
    let spoken = run(folder.path(), "inspect", &text, &[]).stdout;
    // Which half-width is about which axis.
    let cone = "cone about +y, swing 70° about +x and 40° about -z, twist -180° to 180° (of the scenario)";
    assert!(spoken.contains(cone), "{spoken}");
    run(folder.path(), "inspect", &text, &["--scale", "2"]).fails(2, &["s.toml is a scenario", "--scale"]);
}

#[test]
fn a_joint_that_follows_names_its_leader_in_json() {
    let report = ikiru(&["inspect", "builtin:panda", "--json"]).json();
    let follows = &joint(&report, "panda_finger_joint2")["follows"];
    assert_eq!(follows["joint"], "panda_finger_joint1");
    assert_eq!((follows["multiplier"].as_f64(), follows["offset"].as_f64()), (Some(1.0), Some(0.0)));
    assert!(joint(&report, "panda_finger_joint1")["follows"].is_null());
    assert!(ikiru(&["inspect", "builtin:panda"]).stdout.contains("follows panda_finger_joint1"));
}

#[test]
fn lengths_of_a_bvh_are_in_metres_where_a_scale_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let walk = data("mocap/cmu_01_01_30fps.bvh");
    let height = |more: &[&str]| {
        let run = ikiru_in(folder.path(), &[&["inspect", &walk, "--json"], more].concat());
        run.json()["height"].as_f64().unwrap()
    };
    assert!((height(&["--scale", "0.5"]) / height(&[]) - 0.5).abs() < 1e-9);
    // A scale that is likely meant comes with the place for it.
    let odd = ikiru_in(folder.path(), &["inspect", &walk]).stdout;
    assert!(odd.contains("a likely scale is 0.056444: --scale 0.056444"), "{odd}");
    let text = format!("version = 1\nrig = \"{walk}\"\n{}", REACH.replace("leftHand", "LeftHand"));
    let odd = run(folder.path(), "solve", &text, &[]).stderr;
    assert!(odd.contains("a likely scale is 0.056444: scale = 0.056444"), "{odd}");
    let root = |more: &[&str]| {
        let run = ikiru_in(folder.path(), &[&["convert", &walk, "w.json"], more].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        let json: Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("w.json")).unwrap()).unwrap();
        vector(&json["root_translation"][0])
    };
    assert!((root(&["--scale", "0.5"]) - 0.5 * root(&[])).length() < 1e-9);
    for wrong in ["0", "-1", "nan"] {
        ikiru_in(folder.path(), &["inspect", &walk, "--scale", wrong]).fails(2, &["above 0"]);
    }
    ikiru(&["inspect", "builtin:human", "--scale", "2"]).fails(2, &["builtin:human is in metres"]);
}

#[test]
fn warnings_about_clips_are_counted_and_come_where_clips_are_used() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("many.gltf"), with_scaled_clips(40)).unwrap();
    let text = "version = 1\nrig = \"many.gltf\"\n[[objective]]\nkind = \"position\"\njoint = \"b\"\ntarget = [0, 0, 1]\n";
    let solved = run(folder.path(), "solve", text, &["--json"]);
    assert_eq!((solved.code, solved.stderr.as_str()), (0, ""));
    assert_eq!(solved.json()["warnings"].as_array().unwrap().len(), 0);
    let inspected = ikiru_in(folder.path(), &["inspect", "many.gltf", "--json"]).json();
    let warnings = inspected["warnings"].as_array().unwrap();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    let said = warnings[0].as_str().unwrap();
    assert!(said.contains("'clip0'") && said.ends_with("(39 more like this)"), "{said}");
    let spoken = ikiru_in(folder.path(), &["inspect", "many.gltf"]).stdout;
    assert_eq!(spoken.matches("warning: ").count(), 1, "{spoken}");
    let converted = ikiru_in(folder.path(), &["convert", "many.gltf", "many.bvh"]);
    assert_eq!(converted.stderr.matches("warning: ").count(), 1, "{}", converted.stderr);
}

#[test]
fn a_scenario_comes_from_stdin_with_paths_from_the_current_folder() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(data("mh_female_mixamo.glb"), folder.path().join("a.glb")).unwrap();
    let text = format!("{}{REACH}", ARM.replace("builtin:human", "a.glb"));
    let fed = |args: &[&str], text: &str| ikiru_fed(folder.path(), args, text);
    let solved = fed(&["solve", "-", "--json"], &text);
    assert_eq!(solved.code, 0, "{}", solved.stderr);
    assert_eq!(solved.json()["pose"], run(folder.path(), "solve", &text, &["--json"]).json()["pose"]);
    assert_eq!(fed(&["inspect", "-", "--json"], &text).code, 0);
    let planned = fed(&["plan", "-"], &format!("{text}weight = 100\n[motion]\nduration_secs = 1\n"));
    assert_eq!(planned.code, 0, "{}{}", planned.stdout, planned.stderr);
    let wrong = fed(&["solve", "-", "--json"], "version = 1\nrig =");
    wrong.fails(2, &["stdin:2:6: not valid TOML"]);
    assert_eq!(wrong.json()["error"]["file"], "stdin");
    ikiru_fed(folder.path(), &["convert", "-", "x.bvh"], "").fails(2, &["stdin", "expected a file"]);
}

#[test]
fn a_pose_that_was_written_is_a_start_and_an_end() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{ARM}[limits.leftLowerArm]\nmin_deg = [-80, -145, 0]\nmax_deg = [80, 0, 0]\n{REACH}");
    let solved = run(folder.path(), "solve", &text, &["--json", "--out", "pose.json"]);
    assert_eq!(solved.code, 0);
    std::fs::write(folder.path().join("report.json"), &solved.stdout).unwrap();
    let pose = &solved.json()["pose"]["joints"];
    for file in ["pose.json", "report.json"] {
        let again = text.replace("[limits", &format!("start = \"{file}\"\n[limits"));
        let again = run(folder.path(), "solve", &again, &["--json"]).json();
        assert_eq!((&again["iterations"], &again["pose"]["joints"]), (&0.into(), pose), "{file}");
    }
    let motion = format!("{text}[motion]\nduration_secs = 1\nend = \"pose.json\"\n");
    let planned = run(folder.path(), "plan", &motion, &["--json"]);
    assert_eq!(planned.code, 0, "{}{}", planned.stdout, planned.stderr);
    let last = planned.json()["joints"]["upperarm_l"].as_array().unwrap().last().unwrap().clone();
    assert_eq!(last, pose["upperarm_l"]["rotation"]);

    // What cannot be is told, with both places.
    let refused = |json: &str, words: &[&str]| {
        std::fs::write(folder.path().join("bad.json"), json).unwrap();
        let bad = text.replace("[limits", "start = \"bad.json\"\n[limits");
        let run = run(folder.path(), "solve", &bad, &["--json"]);
        run.fails(2, &[&["s.toml:4:9: ", "because", "bad.json"], words].concat());
        assert_eq!(run.json()["error"]["line"], 4);
    };
    let rest = "\"root_translation\": [0, 0, 0]";
    refused("{", &["not valid JSON"]);
    refused("[]", &["line 1 column 2", "expected a pose object"]);
    refused("{\"joints\": {}}", &["root_translation"]);
    refused(
        &format!("{{{rest}, \"joints\": {{\"hand_x\": {{\"rotation\": [0, 0, 0, 1]}}}}}}"),
        &["/joints/hand_x", "hand_l"],
    );
    refused(
        &format!("{{{rest}, \"joints\": {{\"hand_l\": {{\"rotation\": [0, 0, 0]}}}}}}"),
        &["/joints/hand_l/rotation", "expected a list of 4 numbers"],
    );
    refused(
        &format!("{{{rest}, \"joints\": {{\"hand_l\": {{\"rotation\": [0, 0, 0, 0]}}}}}}"),
        &["/joints/hand_l"],
    );
    let bad = text.replace("[limits", "start = \"none.json\"\n[limits");
    run(folder.path(), "solve", &bad, &[]).fails(2, &["s.toml:4:9: ", "none.json", "because"]);
    let bad = text.replace("[limits", "start = 3\n[limits");
    run(folder.path(), "solve", &bad, &[]).fails(2, &["s.toml:4:9: ", "'start' is a number"]);
}

#[test]
fn an_objective_that_weighs_nothing_is_off() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{ARM}{REACH}weight = 0\n");
    let spoken = run(folder.path(), "solve", &text, &[]);
    assert_eq!(spoken.code, 0, "{}", spoken.stdout);
    assert!(spoken.stdout.contains(" off") && !spoken.stdout.contains("in the way"), "{}", spoken.stdout);
    assert!(!spoken.stdout.contains("ok"), "{}", spoken.stdout);
}

#[test]
fn what_no_active_joint_moves_is_not_out_of_reach() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{}{REACH}", ARM.replace("leftUpperArm\", \"leftLowerArm", "rightUpperArm"));
    let solved = run(folder.path(), "solve", &text, &[]);
    assert_eq!(solved.code, 1);
    let way = solved.stdout.lines().find(|line| line.starts_with("in the way")).unwrap();
    assert!(way.contains("no active joint moves 'hand_l'") && way.contains("'active'"), "{way}");
    assert!(!solved.stdout.contains("out of reach"), "{}", solved.stdout);
    let planned = run(folder.path(), "plan", &format!("{text}[motion]\nduration_secs = 1\n"), &[]);
    assert!(planned.stdout.contains("unmet: no active joint moves 'hand_l'"), "{}", planned.stdout);
    // One end of a distance that stays does not keep the other from moving.
    let apart = "[[objective]]\nkind = \"distance\"\njoints = [\"leftHand\", \"head\"]\nexactly = 0.5\n";
    let solved = run(folder.path(), "solve", &format!("{ARM}{apart}"), &["--json"]);
    assert_eq!((solved.code, solved.stderr.as_str()), (0, ""));
}

#[test]
fn a_fixed_joint_of_a_robot_is_not_said_to_lack_a_skin() {
    let folder = tempfile::tempdir().unwrap();
    let text = |joint: &str| {
        format!(
            "version = 1\nrig = \"builtin:panda\"\nactive = [\"{joint}\"]\n[[objective]]\nkind = \"position\"\n\
             joint = \"panda_link8\"\ntarget = [0.4, 0.4, 0.4]\n"
        )
    };
    let fixed = run(folder.path(), "solve", &text("panda_link8"), &[]);
    fixed.fails(2, &["s.toml:3:11: ", "'panda_joint8' does not move", "fixed in the file"]);
    assert!(!fixed.stderr.contains("skin"), "{}", fixed.stderr);
    run(folder.path(), "solve", &text("panda_finger_joint2"), &[])
        .fails(2, &["follows 'panda_finger_joint1'", "expected 'panda_finger_joint1'"]);
}

#[test]
fn a_bvh_whose_root_has_only_rotations_can_float() {
    let folder = tempfile::tempdir().unwrap();
    let chain = "HIERARCHY\nROOT b0\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT b1\n{\n\
                 OFFSET 0 0.5 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 0.5 0\n}\n}\n}\n\
                 MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0 0 0 0\n";
    std::fs::write(folder.path().join("c.bvh"), chain).unwrap();
    let text = "version = 1\nrig = \"c.bvh\"\nroot = \"free\"\n[[objective]]\nkind = \"position\"\njoint = \"b1\"\n\
                target = [3, 3, 3]\n";
    let solved = run(folder.path(), "solve", text, &["--json"]);
    assert_eq!(solved.code, 0, "{}", solved.stderr);
    assert!(vector(&solved.json()["pose"]["root_translation"]).length() > 2.0);
    // Ranges that the user gave it are still refused, where they stand.
    let limited = format!("{text}[limits.b0]\nmin_deg = [-1, -1, -1]\nmax_deg = [1, 1, 1]\n");
    run(folder.path(), "solve", &limited, &[]).fails(2, &["s.toml:8:9: ", "'b0' is the free root"]);
}

#[test]
fn an_end_outside_its_limits_is_not_called_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "{ARM}[limits.leftLowerArm]\nmin_deg = [-80, -145, 0]\nmax_deg = [80, 0, 0]\n{REACH}at = 0.5\nmandatory = false\n\
         [motion]\nduration_secs = 1\n[motion.end]\nleftLowerArm = {{ euler_deg = [0, 60, 0] }}\n"
    );
    let planned = run(folder.path(), "plan", &text, &[]);
    assert!(planned.stderr.contains("the end of 'lowerarm_l' lies 60.000° outside"), "{}", planned.stderr);
    assert!(!planned.stderr.contains("start"), "{}", planned.stderr);
}

#[test]
fn what_has_no_mesh_is_not_told_to_have_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let walk = data("mocap/cmu_01_01_30fps.bvh");
    let run = ikiru_in(folder.path(), &["convert", &walk, "w.glb", "--scale", "0.056444"]);
    run.fails(2, &["w.glb cannot be written", "--onto", "expected a rig that was read from a .glb"]);
    // A robot's motion goes onto nobody.
    let run = ikiru_in(folder.path(), &["convert", "builtin:panda", "p.glb"]);
    run.fails(2, &["p.glb cannot be written", "expected a rig that was read from a .glb"]);
    assert!(!run.stderr.contains("--onto"), "{}", run.stderr);
}

#[test]
fn a_limit_at_zero_is_told_without_what_rounding_left() {
    let folder = tempfile::tempdir().unwrap();
    // The elbow alone, which is stretched already where the hand is wanted further back.
    let text = format!(
        "{}[limits.leftLowerArm]\nmin_deg = [-80, -145, 0]\nmax_deg = [80, 0, 0]\n{}",
        ARM.replace("leftUpperArm\", \"leftLowerArm", "leftLowerArm"),
        REACH.replace("[0.35, 1.1, 0.3]", "[0.5, 1.4, -0.3]")
    );
    let solved = run(folder.path(), "solve", &text, &[]).stdout;
    assert!(solved.contains("limit of lowerarm_l angle y 0°"), "{solved}");
    for line in solved.lines().filter(|line| line.starts_with("at limits") || line.starts_with("in the way"))
    {
        assert!(!line.contains("e-") && !line.contains("-0°"), "{line}");
    }
}

#[test]
fn bad_input_is_one_object_with_its_place_wherever_json_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let reach = format!("{ARM}{REACH}");
    let at = |run: Run, file: Value, line: Value, column: Value| {
        assert_eq!(run.code, 2, "{}", run.stderr);
        let report = run.json();
        assert_eq!(report.as_object().unwrap().len(), 1, "{report}");
        let error = report["error"].as_object().unwrap();
        let keys: Vec<&String> = error.keys().collect();
        assert_eq!(keys, ["message", "file", "line", "column"]);
        assert_eq!((&error["file"], &error["line"], &error["column"]), (&file, &line, &column), "{report}");
        assert!(run.stderr.contains("error: "));
    };
    let bad = |text: &str| run(folder.path(), "solve", text, &["--json"]);
    let file = || Value::from("s.toml");
    at(bad("version = 1\nrig ="), file(), 2.into(), 6.into());
    at(bad(&reach.replace("leftHand", "leftHnad")), file(), 6.into(), 9.into());
    // What the solver refuses has the place of its objective.
    at(bad(&reach.replace("0.35", "1e200")), file(), 4.into(), 1.into());
    let motion = format!("{}[motion]\nduration_secs = 1\n", reach.replace("0.35", "1e200"));
    at(run(folder.path(), "plan", &motion, &["--json"]), file(), 4.into(), 1.into());
    at(
        ikiru_in(folder.path(), &["solve", "none.toml", "--json"]),
        "none.toml".into(),
        Value::Null,
        Value::Null,
    );
    at(
        ikiru_in(folder.path(), &["inspect", "none.glb", "--json"]),
        "none.glb".into(),
        Value::Null,
        Value::Null,
    );
    std::fs::write(folder.path().join("bad.gltf"), "{\n  \"asset\": 3\n}").unwrap();
    let inspected = ikiru_in(folder.path(), &["inspect", "bad.gltf", "--json"]);
    let line = inspected.json()["error"]["line"].clone();
    let column = inspected.json()["error"]["column"].clone();
    assert_eq!(line, 2, "{}", inspected.stdout);
    at(inspected, "bad.gltf".into(), line, column);
    at(ikiru(&["solve", "--json"]), Value::Null, Value::Null, Value::Null);
    at(ikiru(&["solve", "a.toml", "--json", "--out", "a.fbx"]), Value::Null, Value::Null, Value::Null);
}

#[test]
fn a_span_that_is_stretched_is_on_one_clock_with_its_path_and_keeps_the_rate() {
    let report = ikiru(&["plan", "scenarios/motion/panda_limits.toml", "--json"]).json();
    let times = numbers(&report["times"]);
    // 60 samples a second, although the motion takes longer than was wished for.
    assert!(times.last().unwrap() > &1.2, "{times:?}");
    for pair in times.windows(2) {
        assert!((pair[1] - pair[0] - 1.0 / 60.0).abs() < 1e-9, "{pair:?}");
    }
    let way = &report["objectives"][0];
    let path = way["target"].as_array().unwrap();
    assert_eq!((&path[0][0], &path[2][0]), (&way["from"], &way["to"]), "{way}");
    assert_eq!(report["objectives"][1]["at"].as_f64(), times.last().copied());
    // Targets as they were written, although the solver's world has other axes.
    let written = [[0.40, 0.20, 0.45], [0.48, 0.00, 0.50], [0.40, -0.20, 0.45]];
    for (point, written) in path.iter().zip(written) {
        assert_eq!(numbers(point)[1..], written);
    }
    assert_eq!(numbers(&report["objectives"][1]["target"]), [0.35, -0.35, 0.30]);
    // What is called reached is reached by what is written: at its time, on the curve through its samples.
    let scenario = Scenario::read(root().join("scenarios/motion/panda_limits.toml")).unwrap();
    let text = report.to_string();
    let clip = ikiru_formats::read_motion_json(text.as_bytes(), "m.json", &scenario.rig).unwrap();
    for point in path {
        let target = scenario.world_from_targets() * DVec3::from_slice(&numbers(point)[1..]);
        let found = place(&clip, &scenario.rig, "panda_link8", point[0].as_f64().unwrap());
        assert!(found.distance(target) < 1.0e-3, "{} m at {point}", found.distance(target));
    }
}

#[test]
fn a_motion_that_is_stretched_far_still_has_its_samples_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "{ARM}{REACH}weight = 100\n[motion]\nduration_secs = 1\nrate = 30\nmax_speed_deg = 10\nfree_duration = true\n"
    );
    let report = run(folder.path(), "plan", &text, &["--json"]).json();
    let times = numbers(&report["times"]);
    assert!(*times.last().unwrap() > 3.0, "{:?}", times.last());
    assert_eq!(times.len() as f64, (times.last().unwrap() * 30.0).round() + 1.0);
    assert!(report["exceeded"].as_array().unwrap().is_empty());
}

fn place(clip: &Clip, rig: &Rig, joint: &str, secs: f64) -> DVec3 {
    let id = rig.joint(joint).unwrap();
    world_matrices(&clip.sample_cubic(secs))[id.index()].w_axis.truncate()
}

#[test]
fn targets_of_a_motion_without_a_weight_are_met_to_their_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let path = "path = [[0.5, 0.45, 1.3, 0.25], [1.0, 0.3, 1.4, 0.35], [2.0, 0.35, 1.05, 0.3]]";
    let text = |key: &str, weight: &str, motion: &str| {
        let reach = REACH.replace("target = [0.35, 1.1, 0.3]", key);
        format!("{ARM}{reach}{weight}\n[motion]\n{motion}\n")
    };
    let planned = |text: &str| run(folder.path(), "plan", text, &["--json"]);
    let cases = [
        (path, "duration_secs = 2"),
        (path, "duration_secs = 2\nrate = 7"),
        (path, "duration_secs = 2\nsmoothness = [0, 0.1, 1]"),
        ("target = [0.35, 1.1, 0.3]\nat = 0.5", "duration_secs = 1\nrate = 7\n[motion.end]"),
        ("target = [0.35, 1.1, 0.3]\nfrom = 0.2\nto = 0.5", "duration_secs = 1\nsmoothness = [1, 1, 1]"),
    ];
    for (key, motion) in cases {
        let report = planned(&text(key, "", motion));
        assert_eq!(report.code, 0, "{key} {motion}: {}{}", report.stdout, report.stderr);
        let residual = report.json()["objectives"][0]["residual"].as_f64().unwrap();
        assert!(residual <= 1e-3, "{key} {motion}: {residual} m");
    }
    // A weight that is written means what it says: so much of a target, and no more.
    let report = planned(&text(path, "weight = 1", "duration_secs = 2")).json();
    assert_eq!(
        (report["success"].as_bool(), report["objectives"][0]["weight"].as_f64()),
        (Some(false), Some(1.0))
    );
    // All plans together keep the time that is given, but for what the last of them takes to lay out.
    let text_of_budget =
        format!("{}[stop]\nmax_time_ms = 20\n", text("target = [3, 1, 1]", "", "duration_secs = 20"));
    let late = planned(&text_of_budget).json();
    assert_eq!(late["stop"], "time_budget");
    // What is out of reach stays so, and is told as before.
    let far = planned(&text("target = [3, 1, 1]", "", "duration_secs = 1"));
    assert_eq!((far.code, &far.json()["objectives"][0]["satisfied"]), (1, &Value::Bool(false)));
    // Hard limits on speed forbid it: they hold, and the target is missed.
    let slow =
        planned(&text("target = [0.35, 1.1, 0.3]", "", "duration_secs = 1\nmax_speed_deg = 20")).json();
    assert_eq!(slow["success"], false);
    assert!(slow["exceeded"].as_array().unwrap().is_empty());
}

#[test]
fn a_path_that_begins_where_the_start_is_not_is_said_so() {
    let folder = tempfile::tempdir().unwrap();
    let from = |secs: &str| {
        let path = format!("path = [[{secs}, 0.45, 1.3, 0.25], [2.0, 0.35, 1.05, 0.3]]");
        format!("{ARM}{}[motion]\nduration_secs = 2\n", REACH.replace("target = [0.35, 1.1, 0.3]", &path))
    };
    let jumps = run(folder.path(), "plan", &from("0"), &["--json"]);
    let said = jumps.json()["warnings"][0].as_str().unwrap().to_owned();
    assert!(said.contains("holds from 0 s on") && said.contains("'hand_l' 0.274 m"), "{said}");
    for text in [from("0.5"), format!("{}fixed_start = false\n", from("0"))] {
        let calm = run(folder.path(), "plan", &text, &["--json"]);
        assert_eq!((calm.code, calm.stderr.as_str()), (0, ""));
    }
}
