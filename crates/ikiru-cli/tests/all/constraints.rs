//! Hard objectives: what `solve` says of them, to programs and to people.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use serde_json::Value;

use crate::command::{keys, numbers};
use crate::common::{Run, ikiru_fed, root};

/// A hand that reaches, and something that must hold beside it.
fn solve(hard: &str, options: &[&str]) -> Run {
    let text = format!(
        "version = 1\nrig = \"builtin:human\"\nactive = [\"leftShoulder\", \"leftUpperArm\", \"leftLowerArm\"]\n\
         [[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0.35, 1.1, 0.3]\n\
         [[objective]]\n{hard}\nhard = true\n[stop]\nmax_restarts = 4\n"
    );
    ikiru_fed(&root(), &[&["solve", "-"], options].concat(), &text)
}

fn constraint(run: &Run) -> Value {
    let report = run.json();
    assert_eq!(report["objectives"].as_array().map(Vec::len), Some(2));
    let [constraint] = report["constraints"].as_array().map(Vec::as_slice).unwrap_or_default() else {
        panic!("{}", report["constraints"])
    };
    constraint.clone()
}

/// How far apart hand and head are in the pose of a report, found from its file alone.
fn apart(report: &Value) -> f64 {
    let rig = ikiru_formats::builtin("human").unwrap().rig;
    let mut pose = rig.rest_pose();
    for (name, value) in report["pose"]["joints"].as_object().unwrap() {
        let turn = glam::DQuat::from_slice(&numbers(&value["rotation"]));
        pose.set_rotation(rig.joint(name).unwrap(), turn).unwrap();
    }
    let at = |name| pose.frame(rig.joint(name).unwrap()).unwrap().position;
    at("leftHand").distance(at("head"))
}

#[test]
fn a_bound_that_is_kept_says_what_is_left() {
    let hard = "kind = \"distance\"\njoints = [\"leftHand\", \"head\"]\nat_least = 0.5";
    let run = solve(hard, &["--json"]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    let constraint = constraint(&run);
    assert_eq!(keys(&constraint), ["kind", "a", "b", "value", "bound", "unit", "satisfied"]);
    assert_eq!(constraint["kind"], "objective");
    assert_eq!((&constraint["a"], &constraint["b"]), (&Value::from("hand_l"), &Value::from("head")));
    assert_eq!((&constraint["unit"], &constraint["satisfied"]), (&Value::from("m"), &Value::Bool(true)));
    let left = constraint["value"].as_f64().unwrap() - constraint["bound"].as_f64().unwrap();
    assert!((left - (apart(&run.json()) - 0.5)).abs() < 1e-9 && left > 0.01, "{left}");
    let spoken = solve(hard, &[]).stdout;
    assert!(spoken.contains("\nconstraints  it holds\n") && spoken.contains(" mm left"), "{spoken}");
    assert!(spoken.lines().any(|line| line.contains("distance") && line.contains("hard")), "{spoken}");
}

#[test]
fn a_constraint_goes_before_wishes_and_a_missed_one_is_told() {
    // The target is 0.56 m from the head.
    let far = "kind = \"distance\"\njoints = [\"leftHand\", \"head\"]\nat_least = 0.65";
    let run = solve(far, &["--json"]);
    assert_eq!(run.code, 1, "{}{}", run.stdout, run.stderr);
    assert_eq!(constraint(&run)["satisfied"], true);
    assert!((apart(&run.json()) - 0.65).abs() < 1e-4, "{}", apart(&run.json()));
    // Nothing that is active moves it.
    let other = "kind = \"pose\"\njoint = \"rightHand\"\ntarget = [-0.6, 1.1, 0.3]\neuler_deg = [0, 0, 0]\nweight = 0";
    let run = solve(other, &["--json"]);
    assert_eq!(run.code, 1);
    let report = run.json();
    let constraints = report["constraints"].as_array().unwrap();
    let units: Vec<_> = constraints.iter().map(|c| (&c["unit"], &c["satisfied"], &c["b"])).collect();
    let (metres, radians) = (Value::from("m"), Value::from("rad"));
    let (yes, no) = (Value::Bool(true), Value::Bool(false));
    assert_eq!(units, [(&metres, &no, &Value::Null), (&radians, &yes, &Value::Null)]);
    assert_eq!(constraints[0]["value"], report["objectives"][1]["residual"]);
    let spoken = solve(other, &[]).stdout;
    let line = spoken.lines().find(|line| line.starts_with("constraints")).unwrap();
    assert!(line.starts_with("constraints  1 of 2 hold: objective 2 (pose) is missed by 32"), "{line}");
}

#[test]
fn a_body_in_balance_lists_its_feet_its_centre_and_its_hips() {
    let run = ikiru_fed(&root(), &["solve", "scenarios/balance.toml", "--json"], "");
    let report = run.json();
    let constraints = report["constraints"].as_array().unwrap();
    let kinds: Vec<&str> = constraints.iter().map(|c| c["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, [&["objective"; 5][..], &["coupling"; 2]].concat());
    let couplings = &constraints[5..];
    let ends = couplings.iter().map(|c| (&c["a"], &c["b"], &c["unit"])).collect::<Vec<_>>();
    let [a, b, unit] = ["thigh_l", "calf_l", "rad"].map(Value::from);
    assert_eq!(ends[0], (&a, &b, &unit));
    assert_eq!(report["objectives"][5]["target"].to_string(), r#"{"at_most_deg":50.0}"#);
    // Many joints have a centre.
    assert_eq!((&constraints[4]["a"], &constraints[4]["b"]), (&Value::Null, &Value::Null));
    assert!(constraints.iter().all(|c| c["satisfied"] == true && c["bound"] == 0.0));
    let spoken = ikiru_fed(&root(), &["solve", "scenarios/balance.toml"], "").stdout;
    assert!(spoken.contains("\nconstraints  all 7 hold\n"), "{spoken}");
}

#[test]
fn a_motion_tells_where_a_constraint_has_the_least_left() {
    let text = "version = 1\nrig = \"builtin:panda\"\n[motion]\nduration_secs = 1\nrate = 20\n\
                [[objective]]\nkind = \"known_rotation\"\njoints = { panda_joint2 = { angle_deg = 50 } }\nat = 0.5\n\
                mandatory = false\n\
                [[objective]]\nkind = \"known_rotation\"\njoints = { panda_joint2 = { angle_deg = 0 } }\n\
                [[objective]]\nkind = \"coupling\"\nangles = [{ joint = \"panda_joint2\", factor = 1 }]\n\
                at_most_deg = 30\nhard = true\nfrom = 0.05\nto = 1\n";
    let run = ikiru_fed(&root(), &["plan", "-", "--json"], text);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    let report = run.json();
    let [constraint] = &report["constraints"].as_array().unwrap()[..] else { panic!("{report}") };
    assert_eq!(keys(constraint), ["kind", "a", "b", "value", "bound", "unit", "satisfied", "at"]);
    assert_eq!((&constraint["kind"], &constraint["a"]), (&"coupling".into(), &"panda_joint2".into()));
    let value = constraint["value"].as_f64().unwrap();
    assert!(value.abs() < 0.01_f64.to_radians() && constraint["satisfied"] == true, "{constraint}");
    assert_eq!(constraint["at"], 0.5);
    // Read off the motion itself, a hinge's turn about its axis.
    let joint = report["joints"]["panda_joint2"].as_array().unwrap();
    let highest = joint.iter().map(|q| 2.0 * glam::DQuat::from_slice(&numbers(q)).w.acos().to_degrees());
    let highest = highest.fold(0.0, f64::max);
    assert!((highest - 30.0).abs() < 0.011, "{highest}");
    let spoken = ikiru_fed(&root(), &["plan", "-"], text).stdout;
    assert!(spoken.contains("\nconstraints  it holds\n"), "{spoken}");
}

#[test]
fn a_body_without_masses_says_what_to_write() {
    let text = "version = 1\nrig = \"builtin:human\"\n[[objective]]\nkind = \"center_of_mass\"\ntarget = [0, 1, 0]\n";
    let run = ikiru_fed(&root(), &["solve", "-"], text);
    run.fails(2, &[":3:1: ", "lacks 'masses'", "kg = 1.0", "<inertial>"]);
}

#[test]
fn an_optional_objective_has_no_level() {
    let run = solve("kind = \"rest_pose\"\nmandatory = false", &["--json"]);
    assert_eq!(run.json()["objectives"][1]["level"], 1, "a hard one is not optional");
    let text = "version = 1\nrig = \"builtin:human\"\n[[objective]]\nkind = \"rest_pose\"\n";
    let run = ikiru_fed(&root(), &["solve", "-", "--json"], text);
    assert_eq!(run.json()["objectives"][0]["level"], Value::Null);
}
