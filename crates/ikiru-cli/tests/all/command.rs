//! What a user meets: exit statuses, JSON keys, files, messages.

use std::io::Read;
use std::process::{Command, Stdio};

use crate::common::{ikiru, ikiru_in};
use glam::{DQuat, DVec3};
use ikiru_scenario::Scenario;
use serde_json::Value;

#[track_caller]
pub(crate) fn keys(object: &Value) -> Vec<&str> {
    object.as_object().expect("an object").keys().map(String::as_str).collect()
}

pub(crate) fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().expect("a list").iter().map(|n| n.as_f64().expect("a number")).collect()
}

const REACH: &str = "version = 1\nrig = \"builtin:human\"\nactive = [\"leftUpperArm\", \"leftLowerArm\"]\n\
                     [limits.leftLowerArm]\nmin_deg = [-80, -145, 0]\nmax_deg = [80, 0, 0]\n\
                     [[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0.35, 1.1, 0.3]\n";

#[test]
fn demo_writes_a_file_that_reads_back_as_the_reported_pose() {
    let folder = tempfile::tempdir().unwrap();
    let run = ikiru_in(folder.path(), &["demo", "--json"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let report = run.json();
    let written = ikiru_formats::read(folder.path().join("ikiru-demo.glb")).unwrap();
    let rest = ikiru_formats::builtin("human").unwrap().rig;
    let joints = report["pose"]["joints"].as_object().unwrap();
    for (name, value) in joints {
        let id = rest.joint(name).unwrap();
        let reported = DQuat::from_slice(&numbers(&value["rotation"]));
        let found =
            rest.get(id).unwrap().rest_rotation.inverse() * written.rig.get(id).unwrap().rest_rotation;
        assert!(found.angle_between(reported) < 1e-6, "{name}");
    }
    // And the objectives are met there, which is computed from the file alone.
    let pose = written.rig.rest_pose();
    let frame = |name: &str| pose.frame(written.rig.joint(name).unwrap()).unwrap();
    let target = DVec3::from_slice(&numbers(&report["objectives"][0]["target"]));
    let tip = frame("leftIndexDistal").rotation * DVec3::new(0.022, 0.0, 0.0);
    assert!((frame("leftIndexDistal").position + tip).distance(target) < 1e-3);
    assert!((frame("leftHand").rotation * DVec3::NEG_Y).angle_between(DVec3::NEG_Y) < 0.035);
    let gaze = target - frame("head").position;
    assert!((frame("head").rotation * DVec3::Z).angle_between(gaze) < 0.035);
    // The right arm hangs where the start has it.
    assert!(frame("rightHand").position.y < 0.95);
}

#[test]
fn reports_have_the_keys_that_other_programs_read() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("reach.toml"), REACH).unwrap();
    let run = ikiru_in(folder.path(), &["solve", "reach.toml", "--json"]);
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
    assert_eq!(run.stdout.lines().count(), 1);
    let report = run.json();
    let of_solve = ["success", "stop", "cost", "iterations", "restarts", "time_us"];
    let of_pose = ["objectives", "constraints", "obstacles", "hint", "warnings", "pose"];
    assert_eq!(keys(&report), [&of_solve[..], &of_pose].concat());
    assert!(report["time_us"].as_f64().unwrap() > 0.0);
    assert_eq!((&report["success"], &report["stop"]), (&Value::Bool(true), &Value::from("reached")));
    let objective = &report["objectives"][0];
    let of_objective =
        ["kind", "joint", "target", "weight", "level", "residual", "unit", "cost", "satisfied"];
    assert_eq!(keys(objective), of_objective);
    assert_eq!((&objective["joint"], &objective["unit"]), (&Value::from("hand_l"), &Value::from("m")));
    assert_eq!(numbers(&objective["target"]), [0.35, 1.1, 0.3]);
    assert_eq!((&objective["level"], &report["constraints"]), (&Value::from(1), &Value::Array(vec![])));
    let pose = &report["pose"];
    assert_eq!(keys(pose), ["root", "root_translation", "joints"]);
    assert_eq!(pose["root"], Value::Null);
    assert_eq!(numbers(&pose["root_translation"]), [0.0; 3]);
    assert_eq!(keys(&pose["joints"]), ["upperarm_l", "lowerarm_l"]);
    assert_eq!(keys(&pose["joints"]["upperarm_l"]), ["rotation"]);
    assert_eq!(keys(&pose["joints"]["lowerarm_l"]), ["rotation", "euler_deg"]);
    // The same pose as a file of its own.
    let written = ikiru_in(folder.path(), &["solve", "reach.toml", "--out", "pose.json"]);
    assert_eq!(written.code, 0);
    assert!(written.stdout.ends_with("wrote pose.json\n"), "{}", written.stdout);
    let file: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("pose.json")).unwrap()).unwrap();
    assert_eq!(&file, pose);
}

#[test]
fn a_free_root_reports_its_translation() {
    let run = ikiru(&["solve", "scenarios/full_body.toml", "--json"]);
    let report = run.json();
    let y = numbers(&report["pose"]["root_translation"])[1];
    assert!((-0.12..-0.05).contains(&y), "{y}");
    assert_eq!(report["pose"]["root"], "pelvis");
    let pose = &report["objectives"][2];
    assert_eq!(pose["kind"], "pose");
    assert_eq!(pose["second_unit"], "rad");
}

#[test]
fn inspect_shows_everything() {
    let report = ikiru(&["inspect", "builtin:human", "--json"]).json();
    assert_eq!(keys(&report), ["joints", "n_dofs", "height", "facing", "clips", "warnings", "body"]);
    // Nothing is known of its masses.
    assert_eq!(report["body"].to_string(), r#"{"segments":[]}"#);
    let joints = report["joints"].as_array().unwrap();
    let of_joint = ["name", "parent", "motion", "role", "limits", "limits_from", "rest", "follows"];
    assert_eq!(keys(&joints[0]), of_joint);
    assert!(joints.iter().any(|j| j["parent"].is_null()));
    let hand = joints.iter().find(|j| j["role"] == "leftHand").unwrap();
    assert_eq!((&hand["name"], &hand["parent"]), (&Value::from("hand_l"), &Value::from("lowerarm_l")));
    assert_eq!((&hand["motion"], &hand["limits"]), (&Value::from("ball"), &Value::Null));
    let n_balls = joints.iter().filter(|j| j["motion"] == "ball").count();
    assert_eq!(report["n_dofs"], 3 * n_balls);
    let spoken = ikiru(&["inspect", "builtin:human"]);
    assert_eq!((spoken.code, spoken.stderr.as_str()), (0, ""));
    let line = spoken.stdout.lines().find(|line| line.contains("hand_l")).unwrap();
    assert!(line.contains("├─ hand_l") || line.contains("└─ hand_l"), "{line}");
    assert!(line.contains("leftHand") && line.contains("ball, 3 DoF"), "{line}");
    assert!(spoken.stdout.lines().last().unwrap().contains("joints"));
}

#[test]
fn best_efforts_end_with_1_and_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let text = REACH.replace("[0.35, 1.1, 0.3]", "[2.0, 1.1, 0.3]");
    std::fs::write(folder.path().join("far.toml"), text).unwrap();
    let run = ikiru_in(folder.path(), &["solve", "far.toml", "--out", "far.glb"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert!(run.stdout.contains("not reached") && run.stdout.contains("in the way"), "{}", run.stdout);
    assert!(ikiru_formats::read(folder.path().join("far.glb")).is_ok());
}

#[test]
fn what_is_in_the_way_is_told_with_shares_and_what_would_help() {
    let folder = tempfile::tempdir().unwrap();
    let solve = |text: &str| {
        std::fs::write(folder.path().join("s.toml"), text).unwrap();
        let [json, spoken] = [&["solve", "s.toml", "--json"][..], &["solve", "s.toml"]]
            .map(|args| ikiru_in(folder.path(), args));
        (json.json(), spoken.stdout)
    };
    let (report, _) = solve(REACH);
    assert_eq!((&report["obstacles"], &report["hint"]), (&Value::Array(Vec::new()), &Value::Null));
    // From the shoulder to the hand it is a known way, and the body could walk.
    let far = REACH.replace("[0.35, 1.1, 0.3]", "[2.0, 1.1, 0.3]");
    let (report, spoken) = solve(&far);
    let rig = ikiru_formats::builtin("human").unwrap().rig;
    let pose = rig.rest_pose();
    let at = |name: &str| pose.frame(rig.joint(name).unwrap()).unwrap().position;
    let [shoulder, elbow, hand] = ["leftUpperArm", "leftLowerArm", "leftHand"].map(at);
    let length = shoulder.distance(elbow) + elbow.distance(hand);
    let missing = DVec3::new(2.0, 1.1, 0.3).distance(shoulder) - length;
    let obstacles = report["obstacles"].as_array().unwrap();
    assert_eq!(keys(&obstacles[0]), ["objective", "kind", "name", "share", "amount", "unit"]);
    let reach = obstacles.iter().find(|o| o["kind"] == "reach").unwrap();
    assert_eq!(
        (&reach["objective"], &reach["name"], &reach["unit"]),
        (&0.into(), &"hand_l".into(), &"m".into())
    );
    assert!((reach["amount"].as_f64().unwrap() - missing).abs() < 1e-9, "{reach}");
    let sum: f64 = obstacles.iter().map(|o| o["share"].as_f64().unwrap()).sum();
    assert!(sum <= 1.0 + 1e-9 && reach["share"].as_f64().unwrap() > 0.5, "{obstacles:?}");
    let root = rig.get(rig.root().unwrap()).unwrap().name.clone();
    assert!(report["hint"].as_str().unwrap().contains(&format!("root = \"free\" lets '{root}' float")));
    let way = spoken.lines().find(|line| line.starts_with("in the way")).unwrap();
    assert!(way.contains(&format!("{missing:.3} m out of reach")), "{way}");
    assert!(spoken.lines().any(|line| line.starts_with("hint")), "{spoken}");
    // With that root it is reached; where it may not move, the hint is another one.
    let free = far.replace("active = [", "root = \"free\"\nactive = [");
    let (report, _) = solve(&free);
    assert!(report["hint"].as_str().unwrap().contains("'active'"), "{report}");
    let moves = free.replace("active = [", &format!("active = [\"{root}\", "));
    let (report, _) = solve(&moves);
    assert_eq!((&report["success"], &report["hint"]), (&true.into(), &Value::Null));
    // A constraint is told as one.
    let held = format!(
        "{REACH}[[objective]]\nkind = \"coupling\"\nhard = true\nat_most_deg = -100\n\
         angles = [{{ joint = \"leftLowerArm\", axis = [0, 1, 0], factor = 1.0 }}]\n"
    );
    let (report, spoken) = solve(&held);
    let obstacle = &report["obstacles"][0];
    assert_eq!((&obstacle["kind"], &obstacle["unit"]), (&"constraint".into(), &"rad".into()), "{obstacle}");
    assert!(spoken.contains("objective 2 (coupling") && spoken.contains("forbids it"), "{spoken}");
    // Two that pull against each other name each other.
    let both = format!(
        "{REACH}[[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0.35, 1.2, 0.3]\n"
    );
    let (report, spoken) = solve(&both);
    let name = |idx: usize| report["obstacles"][idx]["name"].as_str().unwrap().to_owned();
    assert_eq!(
        (report["obstacles"][0]["kind"].as_str(), name(0).contains("(position of hand_l)")),
        (Some("objective"), true)
    );
    assert_eq!(spoken.lines().filter(|line| line.starts_with("in the way")).count(), 2, "{spoken}");
}

#[test]
fn what_cannot_be_written_ends_with_3() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("reach.toml"), REACH).unwrap();
    let run = ikiru_in(folder.path(), &["solve", "reach.toml", "--json", "--out", "no/such/folder.glb"]);
    run.fails(3, &["no/such/folder.glb"]);
    assert_eq!(run.json()["success"], true, "the result is printed all the same");
    ikiru_in(folder.path(), &["demo", "--out", "no/such/folder.glb"]).fails(3, &["no/such/folder.glb"]);
}

#[test]
fn endings_are_checked_before_anything_is_solved() {
    for (out, word) in [("a.fbx", "'.fbx'"), ("a", "no ending")] {
        let run = ikiru(&["solve", "scenarios/demo.toml", "--out", out]);
        run.fails(2, &[word, ".glb"]);
        assert_eq!(run.stdout, "");
        ikiru(&["demo", "--out", out]).fails(2, &[word]);
    }
}

#[test]
fn bad_input_ends_with_2_and_says_where() {
    let folder = tempfile::tempdir().unwrap();
    let solve = |text: &str| {
        std::fs::write(folder.path().join("bad.toml"), text).unwrap();
        ikiru_in(folder.path(), &["solve", "bad.toml"])
    };
    solve(&REACH.replace("leftHand", "leftHnad")).fails(2, &["bad.toml:9:9: ", "did you mean 'leftHand'"]);
    solve(&REACH.replace("kind", "knd")).fails(2, &["bad.toml:7:1: objective 1 lacks 'kind'"]);
    solve(&REACH.replace("builtin:human", "none.glb")).fails(2, &["bad.toml:2:7: ", "because", "none.glb"]);
    solve(&REACH.replace("0.35", "nan")).fails(2, &["bad.toml:10:11: ", "finite"]);
    solve(&REACH.replace("0.35", "1e200")).fails(2, &["bad.toml:7:1: objective 1 (position)", "not finite"]);
    solve("version = 1\nrig =").fails(2, &["bad.toml:2:6: not valid TOML"]);
    ikiru(&["solve", "none.toml"]).fails(2, &["none.toml: the scenario cannot be read", "because"]);
    ikiru(&["inspect", "none.glb"]).fails(2, &["none.glb"]);
    ikiru(&["inspect", "builtin:humna"]).fails(2, &["builtin:human"]);
    ikiru(&["solve", "avatar.vrm"]).fails(2, &["is a rig", "ikiru inspect"]);
}

#[test]
fn wrong_commands_get_suggestions() {
    ikiru(&["slove", "a.toml"]).fails(2, &["solve"]);
    ikiru(&["solve", "a.toml", "--jsn"]).fails(2, &["--json"]);
    let help = ikiru(&["--help"]);
    assert_eq!(help.code, 0);
    for word in ["demo", "inspect", "solve", "plan", "convert", "bench", "Examples:", "Exit status"] {
        assert!(help.stdout.contains(word), "{}", help.stdout);
    }
    assert!(!help.stdout.contains("view "), "it is not there yet: {}", help.stdout);
}

#[test]
fn a_reader_who_stops_is_no_failure() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_ikiru"))
        .args(["inspect", "builtin:human", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    assert_eq!((child.wait().unwrap().code(), stderr.as_str()), (Some(0), ""));
}

#[test]
fn the_command_gives_what_the_library_gives() {
    let run = ikiru(&["solve", "scenarios/demo.toml", "--json"]);
    let scenario = Scenario::builtin("demo").unwrap();
    let mut workspace = scenario.workspace();
    let mut pose = scenario.start.clone();
    scenario.solve(&mut pose, &mut workspace);
    // Same input, same bits: compared as text, since reading a number may round it.
    let pose = ikiru_formats::pose_json(&pose, &scenario.active).to_string();
    assert!(run.stdout.contains(&format!("\"pose\":{pose}}}")), "{pose} is not in {}", run.stdout);
}

#[test]
fn a_motion_goes_from_format_to_format_and_onto_a_character() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let data = |name: &str| format!("{}/../ikiru-formats/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let walk = data("mocap/cmu_01_01_30fps.bvh");
    for (input, output, onto) in [
        (&walk, at("walk.vrma"), None),
        (&walk, at("walk.glb"), Some("builtin:human".to_owned())),
        (&at("walk.vrma"), at("again.bvh"), Some(data("mh_female_mixamo.glb"))),
        (&data("mh_female_mixamo.glb"), at("rest.bvh"), None),
    ] {
        let mut args = vec!["convert".to_owned(), input.clone(), output.clone()];
        args.extend(onto.map(|rig| ["--onto".to_owned(), rig]).into_iter().flatten());
        let run = Command::new(env!("CARGO_BIN_EXE_ikiru")).args(&args).output().unwrap();
        assert!(run.status.success(), "{args:?}: {}", String::from_utf8_lossy(&run.stderr));
    }
    // The walk is 22.9 s long wherever it went, and the figure on the character walks as far as its legs are long.
    let animated = ikiru_formats::read(at("walk.glb")).unwrap();
    assert!((animated.clips[0].duration_secs() - 22.9).abs() < 0.05);
    let again = ikiru_formats::read(at("again.bvh")).unwrap();
    assert!((again.clips[0].duration_secs() - 22.9).abs() < 0.05);
    let hips: Vec<_> = again.clips[0]
        .poses()
        .iter()
        .map(|pose| {
            pose.frame(again.rig.joint("Hips").or(again.rig.joint("mixamorig:Hips")).unwrap())
                .unwrap()
                .position
        })
        .collect();
    let way: f64 = hips.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    assert!((5.0..30.0).contains(&way), "the hips stay in place: {way} m");
    assert!(hips.iter().all(|at| (0.3..2.5).contains(&at.y)), "the figure is not on the ground");
    // A .bvh file has no skin: the error says what to do.
    let run =
        Command::new(env!("CARGO_BIN_EXE_ikiru")).args(["convert", &walk, &at("bare.glb")]).output().unwrap();
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("--onto"));
}

#[test]
fn a_motion_becomes_a_table_or_lists_at_any_rate() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let data = |name: &str| format!("{}/../ikiru-formats/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let walk = data("mocap/cmu_01_01_30fps.bvh");
    let convert = |input: &str, output: &str, more: &[&str]| {
        let run = Command::new(env!("CARGO_BIN_EXE_ikiru"))
            .args([&["convert", input, output], more].concat())
            .output()
            .unwrap();
        (run.status.code(), String::from_utf8(run.stderr).unwrap())
    };
    let clip = &ikiru_formats::read(&walk).unwrap().clips[0];
    let frames = clip.times().len();
    assert_eq!(convert(&walk, &at("walk.csv"), &[]).0, Some(0));
    let table = std::fs::read_to_string(at("walk.csv")).unwrap();
    assert!(table.starts_with("time_secs,root_translation.x,root_translation.y,root_translation.z,"));
    assert_eq!(table.lines().count(), frames + 1);
    // Half as many, evenly, from the first to the last.
    assert_eq!(convert(&walk, &at("slow.csv"), &["--rate", "15"]).0, Some(0));
    let slow = std::fs::read_to_string(at("slow.csv")).unwrap();
    let n_steps = (clip.duration_secs() * 15.0).round();
    assert_eq!(slow.lines().count(), n_steps as usize + 2);
    assert_eq!(slow.lines().nth(1), table.lines().nth(1));
    assert_eq!(slow.lines().last(), table.lines().last());

    // As lists it comes back as the same motion of the same rig.
    let rig = clip.rig();
    assert_eq!(convert(&walk, &at("walk.json"), &[]).0, Some(0));
    let text = std::fs::read(at("walk.json")).unwrap();
    let again = ikiru_formats::read_motion_json(&text, "walk.json", rig).unwrap();
    assert_eq!(again.times(), clip.times());
    for (a, b) in again.poses().iter().zip(clip.poses()).step_by(100) {
        assert!(a.difference(b).unwrap().iter().all(|d| d.abs() < 1e-9));
    }
    let run = convert(&walk, &at("human.json"), &["--onto", "builtin:human", "--rate", "10"]);
    assert_eq!(run.0, Some(0), "{}", run.1);
    let json: Value = serde_json::from_slice(&std::fs::read(at("human.json")).unwrap()).unwrap();
    let n = (clip.duration_secs() * 10.0).round() as usize + 1;
    for list in [&json["times"], &json["root_translation"], &json["joints"]["hand_l"]] {
        assert_eq!(list.as_array().unwrap().len(), n);
    }

    // What cannot be is told.
    for (output, more, word) in [
        ("rest.csv", &[][..], "has no motion, and a .csv file is one"),
        ("rest.json", &[], "has no motion, and a .json file is one"),
        ("rest.bvh", &["--rate", "30"], "has no motion, and --rate is for one"),
        ("rest.txt", &[], "expected .glb, .gltf, .vrm, .bvh, .vrma, .json or .csv"),
        ("rest.csv", &["--rate", "0"], "expected frames a second above 0"),
        ("rest.csv", &["--rate", "NaN"], "expected frames a second above 0"),
    ] {
        let (code, said) = convert("builtin:human", &at(output), more);
        assert_eq!(code, Some(2), "{output} {more:?}");
        assert!(said.contains(word), "{output} {more:?}: {said}");
    }
}

#[test]
fn roles_of_a_file_count_more() {
    let folder = tempfile::tempdir().unwrap();
    let roles = folder.path().join("roles.toml");
    let inspect = |text: &str| {
        std::fs::write(&roles, text).unwrap();
        Command::new(env!("CARGO_BIN_EXE_ikiru"))
            .args(["inspect", "builtin:human", "--json", "--roles", &roles.display().to_string()])
            .output()
            .unwrap()
    };
    let run = inspect("jaw = \"hand_l\"\n");
    let json: Value = serde_json::from_slice(&run.stdout).unwrap();
    let hand = json["joints"].as_array().unwrap().iter().find(|j| j["name"] == "hand_l").unwrap().clone();
    assert_eq!(hand["role"], "jaw");
    for (text, word) in
        [("jaw = \"hand_x\"\n", "hand_l"), ("jow = \"hand_l\"\n", "jaw"), ("jaw = 3\n", "leftHand =")]
    {
        let run = inspect(text);
        assert_eq!(run.status.code(), Some(2), "{text}");
        assert!(
            String::from_utf8_lossy(&run.stderr).contains(word),
            "{}",
            String::from_utf8_lossy(&run.stderr)
        );
    }
}
