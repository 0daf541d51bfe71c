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
    let at = |name| pose.frame(rig.joint(name).unwrap()).origin.value();
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
fn an_optional_objective_has_no_level() {
    let run = solve("kind = \"rest_pose\"\nmandatory = false", &["--json"]);
    assert_eq!(run.json()["objectives"][1]["level"], 1, "a hard one is not optional");
    let text = "version = 1\nrig = \"builtin:human\"\n[[objective]]\nkind = \"rest_pose\"\n";
    let run = ikiru_fed(&root(), &["solve", "-", "--json"], text);
    assert_eq!(run.json()["objectives"][0]["level"], Value::Null);
}
