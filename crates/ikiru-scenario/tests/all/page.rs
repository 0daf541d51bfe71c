//! `docs/scenario.md`: it is what the tables of the format say, and its examples do what they show.

use ikiru_scenario::Scenario;
use ikiru_scenario::kinds::Kind;
use ikiru_solve::MotionWorkspace;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scenario.md");

/// Set by `cargo xtask page`: the page is then written rather than compared.
const WRITE: &str = "IKIRU_WRITE_PAGE";

#[test]
fn the_page_is_what_the_tables_say() {
    let page = ikiru_scenario::page();
    if std::env::var_os(WRITE).is_some() {
        return std::fs::write(PAGE, page).unwrap();
    }
    let committed = std::fs::read_to_string(PAGE).unwrap_or_default();
    assert!(committed == page, "docs/scenario.md is stale: `cargo xtask page` writes it anew");
}

/// The examples of the page, each as a whole scenario.
fn examples() -> Vec<String> {
    let page = ikiru_scenario::page();
    let blocks = page.split("```toml\n").skip(1).filter_map(|block| block.split("```").next());
    let complete = |block: &str| {
        let mut text = block.to_owned();
        if !text.contains("[[objective]]") {
            text +=
                "\n[[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0.35, 1.1, 0.35]\n";
        }
        if text.contains("version = 1") {
            text
        } else {
            format!("version = 1\nrig = \"builtin:human\"\n{text}")
        }
    };
    blocks.map(complete).collect()
}

#[test]
fn examples_are_met_without_a_warning() {
    let examples = examples();
    for text in &examples {
        let scenario = Scenario::parse(text, "example.toml", ".").unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert_eq!(scenario.warnings, [], "{text}");
        if scenario.motion.is_some() {
            let mut motion = scenario.into_motion().unwrap();
            let report = motion.plan(&mut MotionWorkspace::default()).report;
            assert!(report.success, "{report:?}\n{text}");
        } else {
            let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
            let report = scenario.solve(&mut pose, &mut workspace);
            assert!(report.success, "{report:?}\n{text}");
        }
    }
    for kind in Kind::NAMES {
        let of_kind = |text: &&String| text.contains(&format!("kind = \"{kind}\""));
        assert!(examples.iter().any(|text| of_kind(&text)), "no example of {kind}");
    }
}

/// Success asks for every kind but a pull to rest, as the page says.
#[test]
fn every_kind_but_a_pull_to_rest_is_mandatory() {
    for text in examples() {
        let scenario = Scenario::parse(&text, "example.toml", ".").unwrap();
        for (objective, term) in scenario.objectives.iter().zip(scenario.problem.terms()) {
            assert_eq!(term.mandatory, objective.kind != "rest_pose", "{}", objective.kind);
        }
    }
}

#[test]
fn every_key_stands_on_the_page_under_its_kind() {
    let page = ikiru_scenario::page();
    for kind in Kind::NAMES {
        let section = page.split(&format!("\n### `{kind}`\n")).nth(1).unwrap();
        let section = section.split("\n### ").next().unwrap();
        for key in Kind::keys_of(kind) {
            assert!(
                section.contains(&format!("\n| `{}` | {} |", key.name, key.takes)),
                "{kind}: {}",
                key.name
            );
        }
    }
}
