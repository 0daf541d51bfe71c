//! Scenarios as data: document → TOML → document is the identity, and both texts solve to the same bits.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use ikiru_rig::Pose;
use ikiru_scenario::kinds::{Kind, PositionKeys};
use ikiru_scenario::{
    Document, ErrorKind, GivenPose, JointKeys, LengthKeys, LimitKeys, MotionKeys, ObjectiveEntry, Scenario,
    TargetKeys,
};
use ikiru_solve::{Invalid, MotionWorkspace, Solver, SolverOptions};
use ikiru_testkit::rigs::Random;

use crate::random_document::{POSES, random_document};

/// All bits of a document: a zero with a sign is equal to one without, and is not the same.
fn bits(document: &Document) -> String {
    format!("{document:?}")
}

/// The way there and back again.
#[track_caller]
fn assert_comes_back(document: &Document) -> String {
    let text = document.to_toml();
    let again = Document::parse(&text, "again.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(&again, document, "{text}");
    assert_eq!(bits(&again), bits(document), "{text}");
    assert_eq!(again.to_toml(), text);
    // As JSON too, which viewers and bindings speak.
    let json = serde_json::to_string(document).unwrap();
    assert_eq!(bits(&serde_json::from_str(&json).unwrap()), bits(document), "{json}");
    text
}

/// What came of a scenario, to the bit.
#[derive(PartialEq)]
struct Answer {
    /// Of its pose, or of all poses of its motion.
    coords: Vec<u64>,
    success: bool,
    invalid: Option<Invalid>,
}

fn solved(mut scenario: Scenario) -> Answer {
    let options = SolverOptions { max_time: None, ..*scenario.solver.options() };
    scenario.solver = Solver::new(options);
    let coords = |pose: &Pose| pose.coords().iter().map(|c| c.to_bits()).collect::<Vec<_>>();
    if scenario.motion.is_some() {
        let planned = scenario.into_motion().unwrap().plan(&mut MotionWorkspace::default());
        let coords = planned.clip.poses().iter().flat_map(coords).collect();
        return Answer { coords, success: planned.report.success, invalid: planned.report.invalid };
    }
    let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
    let report = scenario.solve(&mut pose, &mut workspace);
    let (success, invalid) = (report.success, report.invalid);
    Answer { coords: coords(&pose), success, invalid }
}

/// Every scenario file below a folder of the repository.
fn shipped() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folders = ["scenarios", "scenarios/motion"];
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap());
    let mut files: Vec<PathBuf> = files.map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|ending| ending == "toml"));
    files.sort();
    files
}

#[test]
fn every_scenario_that_ships_comes_back_and_solves_to_the_same_bits() {
    let files = shipped();
    assert!(files.len() >= 16, "{files:?}");
    for file in files {
        let document = Document::read(&file).unwrap_or_else(|error| panic!("{error}"));
        let text = assert_comes_back(&document);
        let folder = file.parent().unwrap();
        let again = Scenario::parse(&text, "again.toml", folder).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let first = Scenario::read(&file).unwrap();
        assert_eq!(first.warnings, again.warnings);
        let answer = solved(first);
        assert!(answer.invalid.is_none() && answer == solved(again), "{}", file.display());
    }
}

#[test]
fn random_documents_come_back_and_solve_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    for (rig, file) in POSES {
        let rig = ikiru_formats::builtin(rig.trim_start_matches("builtin:")).unwrap().rig;
        let joints: Vec<_> = rig.ids().filter(|id| rig.get(*id).unwrap().n_dofs() > 0).collect();
        let json = ikiru_formats::pose_json(&rig.rest_pose(), &joints);
        std::fs::write(folder.path().join(file), json.to_string()).unwrap();
    }
    let (mut seen, mut n_valid) = (BTreeSet::new(), 0);
    for seed in 0..240 {
        let document = random_document(seed);
        let text = assert_comes_back(&document);
        keys_of_objectives(&text, &mut seen);
        let made = |result: Result<Scenario, _>| result.unwrap_or_else(|e| panic!("{seed}: {e}\n{text}"));
        let first = made(Scenario::from_document(&document, folder.path()));
        let again = made(Scenario::parse(&text, "again.toml", folder.path()));
        for (entry, term) in document.objectives.iter().zip(first.problem.terms()) {
            assert_eq!((entry.loss, entry.weight.unwrap_or(1.0)), (term.loss, term.weight));
            let [metres, degrees] = if entry.hard { [0.0001, 0.01] } else { [0.001, 0.5] };
            let radians = entry.tolerance_deg.unwrap_or(degrees).to_radians();
            let found = term.tolerance;
            assert_eq!((entry.tolerance.unwrap_or(metres), entry.hard), (found.metres, term.hard));
            assert!((radians - found.radians).abs() <= f64::EPSILON * radians);
        }
        let targets = |scenario: &Scenario| [0, 1, 2].map(|idx| scenario.target_json(idx).to_string());
        assert_eq!(targets(&first), targets(&again));
        if seed % 3 != 2 {
            let answer = solved(first);
            // Some ask for what chance has given otherwise: an objective at the end of a motion whose end is given.
            n_valid += usize::from(answer.invalid.is_none());
            assert!(answer == solved(again), "{seed}\n{text}");
        }
    }
    assert!(n_valid > 120, "{n_valid} of 160");
    // Nothing was left out by the generator.
    let common = ["kind", "weight", "loss", "mandatory", "hard", "at", "from", "to"];
    for kind in Kind::NAMES {
        for key in Kind::keys_of(kind).iter().map(|key| key.name).chain(common) {
            assert!(seen.contains(&((*kind).to_owned(), key.to_owned())), "no {kind} with '{key}'");
        }
    }
}

/// The keys that a text's objectives have, by kind.
fn keys_of_objectives(text: &str, seen: &mut BTreeSet<(String, String)>) {
    let table: toml::Table = text.parse().unwrap();
    for objective in table["objective"].as_array().unwrap() {
        let objective = objective.as_table().unwrap();
        let kind = objective["kind"].as_str().unwrap();
        seen.extend(objective.keys().map(|key| (kind.to_owned(), key.clone())));
    }
}

#[test]
fn whatever_can_be_read_comes_back() {
    let mut random = Random::new(7);
    let (mut n_read, pieces) =
        (0, ["0", "-", ".", "\"", "\\", "\n", "[", "]", "=", "a", "_", "é", "1e5", "'", "0x1f", " "]);
    for file in shipped() {
        let good = std::fs::read_to_string(file).unwrap();
        for _ in 0..225 {
            let mut text: Vec<char> = good.chars().collect();
            for _ in 0..1 + random.below(3) {
                let at = random.below(text.len());
                let until = (at + random.below(3)).min(text.len());
                text.splice(at..until, pieces[random.below(pieces.len())].chars());
            }
            if let Ok(document) = Document::parse(&text.iter().collect::<String>(), "mutated.toml") {
                assert_comes_back(&document);
                n_read += 1;
            }
        }
    }
    assert!(n_read > 500, "{n_read}");
}

fn reach() -> ObjectiveEntry {
    let (joint, target) = ("left_wrist".to_owned(), TargetKeys::Target([0.4, 0.1, 0.3]));
    ObjectiveEntry::new(PositionKeys { joint, point: [0.0; 3], target })
}

fn document() -> Document {
    let mut document = Document::new("builtin:reference");
    document.objectives.push(reach());
    document
}

#[test]
fn names_and_numbers_of_any_sort_come_back() {
    let mut document = document();
    let names = ["a b", "a.b", "\"", "'", "", "ü€\u{7f}", "a\nb\\", "[x]", "#", "'''\"\"\"", "true", "1"];
    document.rig = names.concat();
    document.active = Some(names.map(str::to_owned).to_vec());
    let numbers = [
        0.0,
        -0.0,
        0.1 + 0.2,
        1e-310,
        f64::MIN_POSITIVE,
        1e300,
        1e15,
        -1e15,
        123_456_789_012_345_680.0,
        1e-7,
    ];
    let turn = |(idx, name): (usize, &&str)| {
        let at = |more: usize| numbers[(idx + more) % numbers.len()];
        ((*name).to_owned(), JointKeys::EulerDeg([at(0), at(1), at(2)]))
    };
    let joints: Vec<_> = names.iter().enumerate().map(turn).collect();
    let limit = LimitKeys::Ranges { min_deg: [-0.0, 0.0, -1e-320], max_deg: [0.0, 1.0 / 3.0, 2.0] };
    document.limits = names.map(|name| (name.to_owned(), limit)).to_vec();
    document.start = Some(GivenPose::Joints { root_translation: Some([-0.0, 1.0, f64::MAX]), joints });
    document.objectives[0].weight = Some(f64::from_bits(0x3fb9_9999_9999_999b));
    // What no solver does yet, a document holds all the same.
    (document.objectives[0].hard, document.objectives[0].level) = (true, 7);
    (document.scale, document.method) = (0.0254, "ccd".to_owned());
    document.motion = Some(MotionKeys::new(LengthKeys::Points { points: 7 }));
    assert_comes_back(&document);
}

#[test]
fn a_text_is_as_a_person_would_write_it() {
    let path = format!("{}/../../scenarios/motion/panda_limits.toml", env!("CARGO_MANIFEST_DIR"));
    let text = Document::read(path).unwrap().to_toml();
    let expected = r#"version = 1
rig = "builtin:panda"
world = "file"
active = [
    "panda_joint1", "panda_joint2", "panda_joint3", "panda_joint4", "panda_joint5", "panda_joint6", "panda_joint7",
]

[start]
panda_joint1 = { angle_deg = 40 }
panda_joint2 = { angle_deg = -10 }
panda_joint4 = { angle_deg = -135 }
panda_joint6 = { angle_deg = 125 }
panda_joint7 = { angle_deg = 45 }

[[objective]]
kind = "position"
joint = "panda_link8"
path = [[0.3, 0.4, 0.2, 0.45], [0.45, 0.48, 0, 0.5], [0.6, 0.4, -0.2, 0.45]]
weight = 10

[[objective]]
kind = "position"
joint = "panda_link8"
target = [0.35, -0.35, 0.3]
weight = 10
at = 0.9

[[objective]]
kind = "direction"
joint = "panda_link8"
axis = [0, 0, 1]
target = [0, 0, -1]
weight = 1
tolerance_deg = 3
from = 0.3
to = 0.9

[motion]
duration_secs = 0.9
rate = 60
smoothness = [0, 0.01, 0.1]
start_at_rest = true
end_at_rest = true
free_duration = true
max_speed_deg = 149.5
max_acceleration_deg = 859.4

[motion.limits.panda_joint1]
max_speed_deg = 124.6
"#;
    assert!(text.starts_with(expected), "{text}");
    // Lists are as wide as fits.
    let mut long = document();
    long.active = Some((0..40).map(|idx| format!("joint_{idx}")).collect());
    let text = long.to_toml();
    assert!(
        text.contains("active = [\n    \"joint_0\", \"joint_1\",") && text.lines().all(|l| l.len() <= 120)
    );
    assert_comes_back(&long);
}

#[test]
fn documents_are_changed_by_their_fields() {
    let mut document = document();
    document.stop.max_restarts = Some(0);
    document.objectives[0].tolerance = Some(0.002);
    let Kind::Position(keys) = &mut document.objectives[0].kind else { panic!() };
    keys.target = TargetKeys::Target([0.3, 0.0, 0.3]);
    let scenario = Scenario::from_document(&document, ".").unwrap();
    assert_eq!(scenario.target_json(0), serde_json::json!([0.3, 0.0, 0.3]));
    assert_eq!((scenario.objectives[0].place, scenario.name.as_str()), (None, "document"));
    assert!(solved(scenario).success);
}

/// What is wrong with a document is said by its keys: there is no text.
#[track_caller]
fn refused(change: impl FnOnce(&mut Document), key: &str, words: &[&str]) {
    let mut document = document();
    change(&mut document);
    let error = Scenario::from_document(&document, ".").map(drop).expect_err("it was accepted");
    assert_eq!((error.key(), error.line()), (Some(key), None), "{error}");
    let text = error.to_string();
    assert!(text.starts_with(&format!("document: {key}: ")), "{text}");
    for word in words {
        assert!(text.contains(word), "'{word}' is missing in: {text}");
    }
}

#[test]
fn what_no_scenario_can_be_made_of() {
    refused(|d| d.version = 2, "version", &["expected version = 1"]);
    refused(|d| d.method = "ml".to_owned(), "method", &["'lm'"]);
    refused(|d| d.scale = 0.0, "scale", &["above 0"]);
    refused(|d| d.objectives.clear(), "objective", &["at least one"]);
    refused(|d| d.active = Some(vec!["head".to_owned(), "heat".to_owned()]), "active[1]", &["'head'"]);
    refused(|d| d.stop.max_iterations = Some(0), "stop.max_iterations", &["at least 1"]);
    refused(|d| d.objectives[0].weight = Some(-1.0), "objective[0].weight", &["at least 0"]);
    refused(|d| d.objectives[0].weight = Some(f64::NAN), "objective[0].weight", &["NaN", "finite"]);
    refused(
        |d| d.objectives[0].tolerance_deg = Some(1.0),
        "objective[0].tolerance_deg",
        &["objective 1 (position)", "'tolerance'"],
    );
    let limit = LimitKeys::Ranges { min_deg: [0.0; 3], max_deg: [0.0, f64::INFINITY, 0.0] };
    refused(|d| d.limits.push(("head".to_owned(), limit)), "limits.head.max_deg[1]", &["inf"]);
    let path = TargetKeys::Path(vec![[0.0; 4], [1.0; 4]]);
    let moving = PositionKeys { joint: "left_wrist".to_owned(), point: [0.0; 3], target: path };
    refused(|d| d.objectives[0].kind = moving.into(), "objective[0].path", &["[motion]"]);
}

#[test]
fn what_a_text_refuses_json_refuses_too() {
    let json = |text: &str| serde_json::from_str::<Document>(text).map(drop).unwrap_err().to_string();
    let rig = r#""version": 1, "rig": "builtin:human""#;
    let unknown = json(&format!(r#"{{ {rig}, "metod": "lm", "objective": [] }}"#));
    assert!(unknown.contains("did you mean 'method'"), "{unknown}");
    let kind = json(&format!(r#"{{ {rig}, "objective": [{{ "kind": "positon" }}] }}"#));
    assert!(kind.starts_with("objective[0].kind: ") && kind.contains("'position'"), "{kind}");
}

#[test]
fn a_document_may_hold_what_makes_no_sense_yet() {
    let text = "version = 1\nrig = \"no/such.glb\"\n[[objective]]\nkind = \"position\"\njoint = \"nobody\"\n\
                target = [0, 0, 0]\nweight = -1\n";
    let document = Document::parse(text, "test.toml").unwrap();
    assert_eq!(document.objectives[0].weight, Some(-1.0));
    assert!(matches!(Scenario::parse(text, "test.toml", ".").unwrap_err().kind(), ErrorKind::Rig(_)));
    let missing = Document::read("none.toml").unwrap_err();
    assert!(matches!(missing.kind(), ErrorKind::Io(_)));
}
