//! `ikiru plan`: motions that are written are judged by matrices made from what was written alone.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use crate::common::{ikiru, ikiru_in};
use glam::{DQuat, DVec3};
use ikiru_formats::{read, read_motion_json};
use ikiru_rig::{Clip, JointId, Rig};
use ikiru_scenario::Scenario;
use ikiru_testkit::reference::world_matrices;
use serde_json::Value;

const SCENARIOS: [&str; 3] = ["reach_palm_down", "three_points", "panda_arc"];

fn path(name: &str) -> String {
    format!("{}/../../scenarios/motion/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

fn place(clip: &Clip, joint: JointId, secs: f64) -> DVec3 {
    let frame = clip.times().iter().position(|t| (t - secs).abs() < 1e-6).unwrap();
    world_matrices(&clip.poses()[frame])[joint.index()].w_axis.truncate()
}

fn vector(value: &Value) -> DVec3 {
    let numbers: Vec<f64> = value.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect();
    DVec3::from_slice(&numbers)
}

/// Every position objective of a report is met at its time, as matrices say.
fn judge(report: &Value, clip: &Clip, rig: &Rig, world_from_targets: DQuat, within: f64) -> usize {
    let positions = report["objectives"].as_array().unwrap().iter().filter(|o| o["kind"] == "position");
    let mut n = 0;
    for objective in positions {
        let joint = rig.joint(objective["joint"].as_str().unwrap()).unwrap();
        let found = place(clip, joint, objective["to"].as_f64().unwrap());
        let distance = found.distance(world_from_targets * vector(&objective["target"]));
        assert!(distance <= within, "{distance} m from {objective}");
        n += 1;
    }
    n
}

#[test]
fn motions_that_ship_reach_their_keys_on_three_rigs() {
    let folder = tempfile::tempdir().unwrap();
    for name in SCENARIOS {
        let run = ikiru_in(folder.path(), &["plan", &path(name), "--json", "--out", "motion.json"]);
        assert_eq!(run.code, 0, "{name}: {}", run.stderr);
        let report = run.json();
        assert!(report["success"].as_bool().unwrap() && report["stop"] == "reached");
        let scenario = Scenario::read(path(name)).unwrap();
        let bytes = std::fs::read(folder.path().join("motion.json")).unwrap();
        let clip = read_motion_json(&bytes, "motion.json", &scenario.rig).unwrap();
        assert!(judge(&report, &clip, &scenario.rig, scenario.world_from_targets(), 1.001e-3) > 0);
        let n_frames = report["times"].as_array().unwrap().len();
        assert_eq!(clip.poses().len(), n_frames);
        let joints = report["joints"].as_object().unwrap();
        assert!(joints.values().all(|list| list.as_array().unwrap().len() == n_frames));
        for pose in clip.poses() {
            assert!(pose.limit_violation() < 1e-7, "{name}: {}", pose.limit_violation());
        }
        // It begins at the start, and ends at the end that is given.
        let same = |a: &ikiru_rig::Pose, b: &ikiru_rig::Pose| {
            let of = |joint: &JointId| scenario.rig.coords_of(*joint);
            let near = |joint: &JointId| {
                a.coords()[of(joint)].iter().zip(&b.coords()[of(joint)]).all(|(a, b)| (a - b).abs() < 1e-9)
            };
            scenario.active.iter().all(near)
        };
        assert!(same(&clip.poses()[0], &scenario.start), "{name}");
        if let Some(end) = &scenario.motion.as_ref().unwrap().end {
            assert!(same(clip.poses().last().unwrap(), end), "{name}");
        }
    }
}

#[test]
fn exported_animations_are_the_planned_motion() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for out in ["motion.glb", "motion.bvh", "motion.vrma", "motion.csv"] {
        let run = ikiru_in(folder.path(), &["plan", &path("three_points"), "--json", "--out", out]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        assert!(run.stderr.contains(out));
        let report = run.json();
        match out {
            "motion.csv" => {
                let text = std::fs::read_to_string(at(out)).unwrap();
                assert_eq!(text.lines().count(), 1 + report["times"].as_array().unwrap().len());
            }
            // A VRM animation is of a skeleton of its own; that its poses are right is tested where it is written.
            "motion.vrma" => assert_eq!(read(at(out)).unwrap().clips.len(), 1),
            _ => {
                let loaded = read(at(out)).unwrap();
                let clip = loaded.clips.last().unwrap();
                assert_eq!(judge(&report, clip, &loaded.rig, DQuat::IDENTITY, 1.1e-3), 3, "{out}");
            }
        }
    }
    let run = ikiru_in(folder.path(), &["plan", &path("three_points")]);
    assert!(run.code == 0 && run.stdout.contains("reached"), "{}", run.stderr);
    assert!(run.stdout.contains("peak speed"), "{}", run.stdout);
}

#[test]
fn what_cannot_be_planned_says_where_and_why() {
    let folder = tempfile::tempdir().unwrap();
    let arm = "version = 1\nrig = \"builtin:human\"\nactive = [\"leftUpperArm\", \"leftLowerArm\"]\n\
               [[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0.35, 1.1, 0.3]\n";
    let plan = |text: &str| {
        std::fs::write(folder.path().join("m.toml"), text).unwrap();
        ikiru_in(folder.path(), &["plan", "m.toml"])
    };
    plan(arm).fails(2, &["m.toml", "no [motion]", "duration_secs"]);
    plan(&format!("{arm}at = 1.0\n")).fails(2, &["m.toml:8:1: ", "'at'", "[motion]"]);
    let with = |motion: &str| format!("{arm}[motion]\n{motion}\n");
    plan(&with("")).fails(2, &["m.toml:8", "[motion] has neither", "'points'"]);
    plan(&with("points = 3\nrate = 30")).fails(2, &["'rate' and 'points'"]);
    plan(&with("duration_secs = 0")).fails(2, &["m.toml:9:17: ", "above 0 s, not 0 s"]);
    plan(&with("duration_secs = -2")).fails(2, &["not -2 s"]);
    plan(&with("duration_secs = nan")).fails(2, &["m.toml:9:17: ", "finite"]);
    plan(&with("duration_secs = 0.01")).fails(2, &["1 samples: a motion has at least 2"]);
    plan(&with("duration_secs = 1\nrate = 0")).fails(2, &["'rate' is 0"]);
    plan(&with("points = 2\nsmoothness = [1, -1, 0]")).fails(2, &["at least 0, not [1.0, -1.0, 0.0]"]);
    plan(&with("points = 0\n[motion.end]\nleftUpperArm = { euler_deg = [0, 0, -60] }"))
        .fails(2, &["1 samples are given at the end, but the timeline has 2 in all"]);
    plan(&with("points = 2\n[motion.end]\nleftArm = { euler_deg = [0, 0, -60] }")).fails(2, &["leftArm"]);
    plan(&with("seconds = 2")).fails(2, &["m.toml:9:1: ", "seconds"]);
    let timed = |when: &str| format!("{arm}{when}\n[motion]\nduration_secs = 2\n");
    plan(&timed("at = 2.5"))
        .fails(2, &["m.toml:8:6: ", "2.5 s is not on the timeline, which goes from 0 to 2 s"]);
    plan(&timed("from = 1.5\nto = 1.0")).fails(2, &["m.toml:9:6: ", "1.5", "expected"]);
    plan(&timed("from = 1.5")).fails(2, &["'at', or both 'from' and 'to'"]);
    plan(&format!("method = \"ccd\"\n{}", timed("at = 1"))).fails(2, &["plan motions by lm or adam"]);
    // Out of reach: the best motion, status 1, and which term failed when.
    let far = timed("at = 1").replace("0.35, 1.1, 0.3", "3, 1, 1");
    std::fs::write(folder.path().join("far.toml"), far).unwrap();
    let run = ikiru_in(folder.path(), &["plan", "far.toml"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert!(run.stdout.contains("unmet, worst at 1 s"), "{}", run.stdout);
    ikiru(&["plan", &path("three_points"), "--out", "m.fbx"]).fails(2, &[".vrma"]);
    ikiru(&["plan", &path("three_points"), "--plot", "m.pdf"]).fails(2, &[".svg or .png"]);
    ikiru(&["solve", &path("three_points")]).fails(2, &["has a [motion]", "ikiru plan"]);
}

/// Largest speed and acceleration of a hinge, by differences of the angles that were written.
fn rates_of(report: &Value, joint: &str, axis: usize) -> (f64, f64) {
    let numbers =
        |list: &Value| -> Vec<f64> { list.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect() };
    let times = numbers(&report["times"]);
    let turns = report["joints"][joint].as_array().unwrap();
    let angles: Vec<f64> = turns
        .iter()
        .map(|turn| {
            let q = numbers(turn);
            2.0 * q[axis].atan2(q[3])
        })
        .collect();
    let speeds: Vec<f64> =
        (1..times.len()).map(|i| (angles[i] - angles[i - 1]) / (times[i] - times[i - 1])).collect();
    let accelerations =
        (1..speeds.len()).map(|i| (speeds[i] - speeds[i - 1]) * 2.0 / (times[i + 1] - times[i - 1]));
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |a, v| a.max(v.abs()));
    (largest(&mut speeds.iter().copied()).to_degrees(), largest(&mut accelerations.into_iter()).to_degrees())
}

#[test]
fn limits_on_rates_hold_in_what_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(path("panda_limits")).unwrap();
    let free = ikiru_in(folder.path(), &["plan", &path("panda_limits"), "--json"]);
    assert_eq!(free.code, 0, "{}", free.stderr);
    // The same in the time that is wished for: limits hold, a target is missed, and the report says which and when.
    std::fs::write(folder.path().join("fixed.toml"), text.replace("free_duration = true", "")).unwrap();
    let fixed = ikiru_in(folder.path(), &["plan", "fixed.toml", "--json"]);
    assert_eq!(fixed.code, 1, "{}", fixed.stderr);
    // Without limits, they would not hold.
    let unlimited: String = text
        .lines()
        .filter(|line| {
            !line.starts_with("max_") && !line.starts_with("[motion.limits") && !line.starts_with("free")
        })
        .map(|line| format!("{line}\n"))
        .collect();
    std::fs::write(folder.path().join("unlimited.toml"), unlimited).unwrap();
    let unlimited = ikiru_in(folder.path(), &["plan", "unlimited.toml", "--json"]);
    assert_eq!(unlimited.code, 0, "{}", unlimited.stderr);
    let mut exceeded = 0;
    for (number, most_speed, most_acceleration) in
        [(1, 124.6, 859.4), (2, 124.6, 429.7), (3, 124.6, 573.0), (4, 124.6, 716.2), (6, 149.5, 859.4)]
    {
        let joint = format!("panda_joint{number}");
        for report in [free.json(), fixed.json()] {
            assert!(report["exceeded"].as_array().unwrap().is_empty());
            let (speed, acceleration) = rates_of(&report, &joint, 2);
            // Differences are means of what the curve does, and so never above it.
            assert!(speed <= most_speed * (1.0 + 1e-6), "{joint}: {speed}");
            assert!(acceleration <= most_acceleration * (1.0 + 1e-3), "{joint}: {acceleration}");
        }
        let (speed, acceleration) = rates_of(&unlimited.json(), &joint, 2);
        exceeded += usize::from(speed > most_speed || acceleration > most_acceleration);
    }
    assert!(exceeded >= 2, "{exceeded}");
    let (free, fixed) = (free.json(), fixed.json());
    let last = |report: &Value| report["times"].as_array().unwrap().last().unwrap().as_f64().unwrap();
    assert!(last(&free) > 1.2 && (last(&fixed) - 0.9).abs() < 1e-9);
    assert!(free["objectives"][1]["at"].as_f64().unwrap() == last(&free));
    let unmet = fixed["objectives"].as_array().unwrap().iter().position(|o| o["satisfied"] == false).unwrap();
    // What is in its way are those limits.
    let obstacle = &fixed["obstacles"][0];
    assert_eq!((&obstacle["objective"], &obstacle["kind"]), (&unmet.into(), &"limit".into()), "{obstacle}");
    assert_eq!(obstacle["name"], "speed and acceleration", "{}", fixed["obstacles"]);
    assert!(free["obstacles"].as_array().unwrap().is_empty() && free["hint"].is_null());
    // Given frames too far apart: the joint, the time, and by how much.
    let far = "version = 1\nrig = \"builtin:panda\"\n[[objective]]\nkind = \"rest_pose\"\nat = 0.5\n\
               [motion]\nduration_secs = 1\nmax_speed_deg = 20\n[motion.end]\npanda_joint1 = { angle_deg = 90 }\n";
    std::fs::write(folder.path().join("far.toml"), far).unwrap();
    let run = ikiru_in(folder.path(), &["plan", "far.toml", "--json"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let report = run.json();
    assert_eq!(report["exceeded"][0]["joint"], "panda_joint1");
    assert_eq!(
        (&report["exceeded"][0]["kind"], &report["exceeded"][0]["unit"]),
        (&"speed".into(), &"deg/s".into())
    );
    assert!(report["exceeded"][0]["value"].as_f64().unwrap() > 80.0);
    let run = ikiru_in(folder.path(), &["plan", "far.toml"]);
    assert!(run.stdout.contains("exceeded") && run.stdout.contains("at most 20.0000°/s"), "{}", run.stdout);
}

#[test]
fn what_an_objective_finds_odd_is_a_warning_of_the_plan() {
    let folder = tempfile::tempdir().unwrap();
    let text = "version = 1\nrig = \"builtin:panda\"\nworld = \"file\"\n\
                [[objective]]\nkind = \"position\"\njoint = \"panda_link8\"\ntarget = [0.45, 0.3, 0.4]\n\
                [[objective]]\nkind = \"look_at\"\njoint = \"panda_link0\"\naxis = [1, 0, 0]\ntarget = [0, 0, 0]\nat = 0.5\n\
                [motion]\nduration_secs = 1\nrate = 10\n";
    std::fs::write(folder.path().join("odd.toml"), text).unwrap();
    let run = ikiru_in(folder.path(), &["plan", "odd.toml", "--json"]);
    let (report, said) = (run.json(), "objective 2 (look_at) looks at a point in the joint's own origin");
    let warnings = report["warnings"].as_array().unwrap();
    // After what the scenario is warned of.
    assert!(warnings.last().unwrap().as_str().unwrap().starts_with(said), "{warnings:?}");
    let told = run.stderr.lines().filter(|line| line.starts_with("warning: ")).count();
    assert_eq!(told, warnings.len(), "{}", run.stderr);
    assert_eq!(run.stderr.matches(&format!("warning: {said}")).count(), 1, "{}", run.stderr);
}
