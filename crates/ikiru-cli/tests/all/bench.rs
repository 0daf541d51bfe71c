//! `ikiru bench`: rows, tables and figures, and what is said of wrong input.

use crate::command::{keys, numbers};
use crate::common::{ikiru, ikiru_in};
use serde_json::Value;

#[test]
fn paper_writes_rows_tables_and_figures() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("set.json"), "[[0.3, 0.2, 0.4], [0.2, 0.1, 0.45], [0.35, 0.1, 0.3]]").unwrap();
    let paper = |more: &[&str]| {
        let mut args = vec!["bench", "paper", "--targets", "set.json"];
        args.extend(more);
        ikiru_in(folder.path(), &args)
    };
    let run = paper(&[
        "--runs",
        "2",
        "--warmup",
        "1",
        "--methods",
        "lm-local,fabrik",
        "--json",
        "rows.json",
        "--out",
        "results",
    ]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("combined objective, set.json: 2 targets, 2 runs"), "{}", run.stdout);
    let rows: Value = serde_json::from_slice(&std::fs::read(at("rows.json")).unwrap()).unwrap();
    let rows = rows.as_array().unwrap();
    assert_eq!(rows.len(), 2 * 2 * 2 * 2);
    let expected = "method objective points run target success cost iterations time_us angles";
    assert_eq!(keys(&rows[0]).join(" "), expected);
    assert_eq!(numbers(&rows[0]["target"]), [0.2, 0.1, 0.45]);
    assert_eq!(numbers(&rows[0]["angles"]).len(), 12);
    let is_there = |name: &&str| at("results").join(name).is_file();
    assert!(["results.md", "results.csv"].iter().all(is_there));
    let figures = ["simple_times.svg", "combined_costs.png", "simple_success.png"];
    let n_figures = figures.iter().filter(|name| is_there(name)).count();
    assert_eq!(n_figures, if cfg!(feature = "plot") { 3 } else { 0 });
    assert_eq!(run.stderr.contains("--features plot"), n_figures == 0, "{}", run.stderr);

    paper(&["--methods", "simplex"]).fails(2, &["simplex", "lm, lm-local, adam"]);
    paper(&["--objective", "both"]).fails(2, &["both", "simple, combined"]);
    paper(&["--warmup", "3"]).fails(2, &["nothing to measure"]);
    paper(&["--runs", "0"]).fails(2, &["above 0"]);
    paper(&["--warmup", "1", "--runs", "1", "--json", "none/rows.json"]).fails(3, &["none/rows.json"]);
    ikiru_in(folder.path(), &["bench", "paper", "--targets", "none.json"]).fails(2, &["none.json"]);
    ikiru(&["bench", "paper", "--sample", "10"]).fails(2, &["of 10 sampled points", "sample about"]);
}

#[test]
fn arms_that_ship_and_others_are_solved() {
    let folder = tempfile::tempdir().unwrap();
    let robots = |more: &[&str]| {
        let mut args = vec!["bench", "robots", "--n", "20", "--time-limit-ms", "20000"];
        args.extend(more);
        ikiru_in(folder.path(), &args)
    };
    let run = robots(&["--robots", "panda,ur5", "--json", "rows.json", "--markdown"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("| panda | 7 | 20 | 100 |"), "{}", run.stdout);
    let rows: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("rows.json")).unwrap()).unwrap();
    assert_eq!(rows.as_array().unwrap().len(), 40);
    let expected = "robot base tip joints target success position_error rotation_error iterations restarts time_us values";
    assert_eq!(keys(&rows[0]).join(" "), expected);
    let arm = "<robot name='a'><link name='base'/><link name='tip'/><joint name='turn' type='revolute'>\
               <parent link='base'/><child link='tip'/><axis xyz='0 0 1'/>\
               <limit lower='-1' upper='1' effort='1' velocity='1'/></joint></robot>";
    std::fs::write(folder.path().join("arm.urdf"), arm).unwrap();
    let run = robots(&["--urdf", "arm.urdf", "--base", "base", "--tip", "tip"]);
    assert!(run.code == 0 && run.stdout.contains("arm"), "{}{}", run.stdout, run.stderr);
    robots(&["--urdf", "arm.urdf"]).fails(2, &["--base"]);
    robots(&["--robots", "pr2"]).fails(2, &["pr2", "panda, ur5, xarm7, g1"]);
    robots(&["--method", "ik"]).fails(2, &["'ik'", "lm, adam"]);
}

#[test]
fn motions_are_got_in_six_ways() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let motions =
        |more: &[&str]| ikiru_in(folder.path(), &[&["bench", "motions", "--runs", "1"], more].concat());
    let run = motions(&["panda_arc", "--json", "--out", "tables.md"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let rows: Value = serde_json::from_str(&run.stdout).unwrap();
    let ways: Vec<&str> = rows.as_array().unwrap().iter().map(|row| row["way"].as_str().unwrap()).collect();
    let expected =
        ["straight", "paper", "lm_paper_smoothness", "plan", "plan_speed_limited", "plan_time_free"];
    assert_eq!(ways, expected);
    let expected = "scenario way met unmet frames duration_secs peak_speed_deg end_speed_deg \
                    peak_acceleration_deg peak_jerk_deg total_jerk path_joint path_length limit_margin_deg \
                    limit_margin_joint part_of_limit speed_limit_deg time_ms";
    assert_eq!(keys(&rows[0]).join(" "), expected);
    // What cannot be reached that fast is named; the bench itself has done what it should.
    let unmet = &rows[4]["unmet"];
    assert_eq!(keys(unmet).join(" "), "objective kind joint at_secs residual unit");
    assert!(unmet["joint"] == "panda_joint8" && unmet["unit"] == "m" && rows[4]["met"] == false, "{unmet}");
    assert!(rows[3]["met"] == true && rows[3]["unmet"].is_null() && rows[3]["part_of_limit"].is_null());
    let tables = std::fs::read_to_string(at("tables.md")).unwrap();
    assert!(tables.contains("### panda_arc") && tables.contains("| plan, time free | yes |"), "{tables}");

    // A file of one's own, as a table and as rows.
    let arm = "version = 1\nrig = \"builtin:panda\"\n[[objective]]\nkind = \"position\"\njoint = \"panda_link8\"\n\
               target = [0.4, 0.5, 0.1]\n";
    std::fs::write(at("reach.toml"), format!("{arm}[motion]\nduration_secs = 1\n")).unwrap();
    let run = motions(&["reach.toml", "--out", "rows.json"]);
    assert!(run.code == 0 && run.stderr.contains("wrote rows.json"), "{}", run.stderr);
    for words in ["Six ways", "reach, path of panda_joint8", "lm, paper's smoothness", "°/s³"] {
        assert!(run.stdout.contains(words), "{words} is missing in: {}", run.stdout);
    }
    let rows: Value = serde_json::from_slice(&std::fs::read(at("rows.json")).unwrap()).unwrap();
    assert!(rows.as_array().unwrap().len() == 6 && rows[0]["scenario"] == "reach");

    std::fs::write(at("still.toml"), arm).unwrap();
    motions(&["still.toml"]).fails(2, &["still.toml", "no [motion]", "duration_secs"]);
    motions(&["two_points"]).fails(2, &["two_points", "reach_palm_down, three_points, panda_arc"]);
    motions(&["none.toml"]).fails(2, &["none.toml", "cannot be read"]);
    motions(&["reach.toml", "--out", "none/rows.json"]).fails(3, &["none/rows.json"]);
    motions(&["--out", "rows.csv"]).fails(2, &[".json or .md"]);
    ikiru(&["bench", "motions", "--runs", "0"]).fails(2, &["above 0"]);
    let help = motions(&["--help"]);
    assert!(help.code == 0 && help.stdout.contains("three_points wave.toml"), "{}", help.stdout);
    assert!(ikiru(&["bench", "--help"]).stdout.contains("motions"));
}
