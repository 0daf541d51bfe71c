//! Every scenario of the suite comes to what `scenarios/expected/outcomes.toml` says.

use std::collections::BTreeSet;

use crate::common::{ikiru, root};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    exit: i32,
    stop: Option<String>,
    residuals: Vec<f64>,
    in_the_way: Option<String>,
}

#[test]
fn every_scenario_comes_to_what_is_expected() {
    let folder = root().join("scenarios");
    let text = std::fs::read_to_string(folder.join("expected/outcomes.toml")).unwrap();
    let expected: std::collections::BTreeMap<String, Expected> = toml::from_str(&text).unwrap();
    let files: BTreeSet<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".toml"))
        .collect();
    assert_eq!(files, expected.keys().cloned().collect(), "scenarios, and outcomes that are known");
    for (name, expected) in &expected {
        let path = format!("scenarios/{name}");
        let run = ikiru(&["solve", &path, "--json"]);
        assert_eq!(run.code, expected.exit, "{name}: {}{}", run.stdout, run.stderr);
        let report = run.json();
        assert_eq!(report["success"], expected.exit == 0, "{name}");
        if let Some(stop) = &expected.stop {
            assert_eq!(report["stop"], stop.as_str(), "{name}");
        }
        let objectives = report["objectives"].as_array().unwrap();
        assert_eq!(objectives.len(), expected.residuals.len(), "{name}");
        for (objective, bound) in objectives.iter().zip(&expected.residuals) {
            let residual = objective["residual"].as_f64().unwrap();
            assert!(residual <= *bound, "{name}: {residual} is above {bound} in {objective}");
        }
        let spoken = ikiru(&["solve", &path]);
        assert_eq!(spoken.code, expected.exit, "{name}");
        let way = spoken.stdout.lines().find(|line| line.starts_with("in the way"));
        assert_eq!(way.is_some(), expected.exit == 1, "{name}: {}", spoken.stdout);
        if let Some(words) = &expected.in_the_way {
            assert!(way.is_some_and(|way| way.contains(words)), "{name}: {}", spoken.stdout);
        }
    }
}
