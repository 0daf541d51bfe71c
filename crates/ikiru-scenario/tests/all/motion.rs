//! Scenarios with `[motion]`: paths of targets, limits on speed and acceleration, and what is wrong with them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::DVec3;
use ikiru_rig::{Rate, RatePart};
use ikiru_scenario::{MotionScenario, Scenario};
use ikiru_solve::{MotionWorkspace, When};

/// A scenario of an arm; the objective begins in line 11, the motion after it.
fn text(objective: &str, motion: &str) -> String {
    format!(
        "version = 1\nrig = \"builtin:panda\"\nworld = \"file\"\n\
         [start]\npanda_joint2 = {{ angle_deg = -45 }}\npanda_joint4 = {{ angle_deg = -135 }}\n\
         panda_joint6 = {{ angle_deg = 90 }}\n\
         [[objective]]\nkind = \"position\"\njoint = \"panda_link8\"\n{objective}\n\
         [motion]\n{motion}\n[stop]\nmax_restarts = 4\n"
    )
}

fn read(objective: &str, motion: &str) -> MotionScenario {
    let scenario = Scenario::parse(&text(objective, motion), "test.toml", ".").unwrap();
    scenario.into_motion().unwrap()
}

/// What is refused, at which line, says all of `words`.
#[track_caller]
fn refused(objective: &str, motion: &str, line: usize, words: &[&str]) {
    let error = Scenario::parse(&text(objective, motion), "test.toml", ".").map(drop).expect_err("accepted");
    let message = error.to_string();
    assert_eq!(error.line(), Some(line), "{message}");
    for word in words {
        assert!(message.contains(word), "'{word}' is missing in: {message}");
    }
}

const TARGET: &str = "target = [0.45, 0.3, 0.4]";
const SECONDS: &str = "duration_secs = 2";

#[test]
fn a_target_follows_its_path() {
    let path = "path = [[0.5, 0.45, 0.3, 0.4], [1.0, 0.5, 0.0, 0.45], [2.0, 0.45, -0.3, 0.4]]\nweight = 10";
    let mut scenario = read(path, "duration_secs = 2\nsmoothness = [0, 1e-4, 1e-4]");
    assert_eq!(scenario.objectives[0].when, When::Span { from: 0.5, to: 2.0 });
    let planned = scenario.plan(&mut MotionWorkspace::default());
    assert!(planned.report.success, "{:?}", planned.report);
    let joint = scenario.rig.joint("panda_link8").unwrap();
    // The file's axes: x forward, z up; the rig's: z forward, y up.
    let world = |p: [f64; 3]| DVec3::new(p[1], p[2], p[0]);
    for (secs, point) in [(0.5, [0.45, 0.3, 0.4]), (1.0, [0.5, 0.0, 0.45]), (2.0, [0.45, -0.3, 0.4])] {
        let at = planned.clip.sample(secs).frame(joint).unwrap().position;
        assert!(at.distance(world(point)) < 1.5e-3, "{at} at {secs} s");
    }
    // Between its points the target is on a smooth way, not on the straight one.
    let way = scenario.objectives[0].path.clone().unwrap();
    let at = planned.clip.sample(1.5).frame(joint).unwrap().position;
    assert!(at.distance(way.at(1.5)) < 1.5e-3);
}

#[test]
fn limits_of_all_joints_and_of_one() {
    let motion = "duration_secs = 2\nmax_speed_deg = 30\n[motion.limits.panda_joint1]\nmax_speed_deg = 90\n\
                  max_acceleration_deg = 400";
    let mut scenario = read(TARGET, motion);
    let limits = scenario.motion.rate_limits().to_vec();
    assert_eq!(
        limits.len(),
        scenario.active.iter().filter(|j| RatePart::Rotation.is_of(&scenario.rig, **j)).count() + 1
    );
    let first = scenario.rig.joint("panda_joint1").unwrap();
    for limit in &limits {
        let expected = match (limit.joint == first, limit.rate) {
            (true, Rate::Speed) => 90.0_f64,
            (true, _) => 400.0,
            (false, Rate::Speed) => 30.0,
            _ => panic!("{limit:?}"),
        };
        assert!((limit.most - expected.to_radians()).abs() < 1e-12 && limit.part == RatePart::Rotation);
    }
    let planned = scenario.plan(&mut MotionWorkspace::default());
    assert!(planned.report.exceeded.is_empty());
    assert!(planned.clip.exceeded(&limits).unwrap().is_empty());
    // Ten times too slow for that: the best motion, and which objective fails when.
    let slow = read(TARGET, "duration_secs = 2\nmax_speed_deg = 3").plan(&mut MotionWorkspace::default());
    assert!(!slow.report.success && slow.report.exceeded.is_empty());
    assert!(!slow.report.terms[0].satisfied && slow.report.terms[0].times.unwrap().worst_secs == 2.0);
    // With time as free, it takes the time that it needs.
    let mut free = read(TARGET, "duration_secs = 2\nmax_speed_deg = 3\nfree_duration = true");
    let planned = free.plan(&mut MotionWorkspace::default());
    assert!(planned.report.success && planned.report.exceeded.is_empty());
    assert!(planned.clip.duration_secs() > 10.0, "{}", planned.clip.duration_secs());
    assert!(planned.clip.exceeded(free.motion.rate_limits()).unwrap().is_empty());
}

#[test]
fn wrong_paths_say_where_and_why() {
    refused("path = [[0, 1, 2]]", SECONDS, 11, &["'path' has 3 entries", "[secs, x, y, z]"]);
    refused("path = []", SECONDS, 11, &["at least one", "0 points"]);
    refused("path = [[1, 0, 0, 0], [1, 1, 0, 0]]", SECONDS, 11, &["time 1", "later than the one before"]);
    refused("path = [[0, 0, 0, 0], [3, 1, 0, 0]]", SECONDS, 11, &["3 s is not on the timeline", "0 to 2 s"]);
    refused("path = [[0, nan, 0, 0]]", SECONDS, 11, &["finite"]);
    refused("path = 3", SECONDS, 11, &["a number", "points at times"]);
    refused(&format!("{TARGET}\npath = [[0, 0, 0, 0]]"), SECONDS, 8, &["'target'", "'path'"]);
    let still = text("path = [[0, 0, 0, 0]]", "").replace("[motion]\n", "");
    let error = Scenario::parse(&still, "test.toml", ".").map(drop).expect_err("accepted").to_string();
    assert!(error.contains("'path' is about time") && error.contains("[motion]"), "{error}");
}

#[test]
fn wrong_limits_say_where_and_why() {
    let with = |lines: &str| format!("{SECONDS}\n{lines}");
    for value in ["0", "-3", "nan", "inf"] {
        refused(TARGET, &with(&format!("max_speed_deg = {value}")), 14, &["'max_speed_deg'"]);
    }
    refused(TARGET, &with("max_speed = \"fast\""), 14, &["a string"]);
    refused(TARGET, &with("max_sped_deg = 3"), 14, &["no key 'max_sped_deg'", "'max_speed_deg'"]);
    refused(TARGET, &with("free_duration = true"), 14, &["no limits on rates", "'max_speed_deg'"]);
    refused(TARGET, &with("free_duration = 1"), 14, &["true or false"]);
    let of = |joint: &str, line: &str| with(&format!("[motion.limits.{joint}]\n{line}"));
    refused(TARGET, &of("panda_joint0", "max_speed_deg = 3"), 14, &["no joint", "panda_joint"]);
    refused(TARGET, &of("panda_joint1", "max_speed = 3"), 15, &["a hinge", "'max_speed'"]);
    refused(TARGET, &with("max_speed_deg = 1e-323"), 14, &["'max_speed_deg'", "above 0"]);
    let still = text(TARGET, &of("panda_joint1", "max_speed_deg = 3"))
        .replace("[start]", "active = [\"panda_joint2\"]\n[start]");
    let error = Scenario::parse(&still, "test.toml", ".").map(drop).expect_err("accepted").to_string();
    assert!(error.contains("'panda_joint1' is not active"), "{error}");
    let hinge =
        text(TARGET, &with("max_speed = 1")).replace("[start]", "active = [\"panda_joint2\"]\n[start]");
    let error = Scenario::parse(&hinge, "test.toml", ".").map(drop).expect_err("accepted").to_string();
    assert!(error.contains("'max_speed'") && error.contains("slides"), "{error}");
    refused(TARGET, &of("panda_joint1", "max_jerk_deg = 3"), 15, &["no key 'max_jerk_deg'"]);
}

#[test]
fn weights_and_rest_are_taken_over() {
    let motion = "duration_secs = 2\nsmoothness = [0, 1e-4, 1e-4]\neven_spacing = 0.25\nend_at_rest = true";
    let scenario = read(TARGET, motion);
    assert_eq!(scenario.motion.even_spacing(), 0.25);
    assert_eq!(scenario.motion.at_rest(), [false, true]);
    refused(TARGET, "duration_secs = 2\neven_spacing = -1", 14, &["'even_spacing'", "at least 0"]);
    refused(TARGET, "duration_secs = 2\nstart_at_rest = 1", 14, &["true or false"]);
}
