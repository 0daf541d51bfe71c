//! The pages that people read first: what they link is there, and the first one stays short.

use std::path::{Path, PathBuf};

const PAGES: [&str; 7] = [
    "README.md",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "docs/axes.md",
    "docs/scenario.md",
    "scenarios/README.md",
    "bench/peers/README.md",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn text(page: &str) -> String {
    std::fs::read_to_string(root().join(page)).unwrap_or_else(|error| panic!("{page}: {error}"))
}

#[test]
fn links_lead_to_files() {
    let mut n_links = 0;
    for page in PAGES {
        let text = text(page);
        let folder = root().join(Path::new(page).parent().unwrap_or(Path::new("")));
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for link in links.filter(|link| !link.starts_with("http") && !link.contains(char::is_whitespace)) {
            let file = link.split('#').next().unwrap_or_default();
            assert!(folder.join(file).exists(), "{page} links {link}, which is not there");
            n_links += 1;
        }
    }
    assert!(n_links > 30, "{n_links}");
}

/// The recipes name files by their path: who follows them finds them.
#[test]
fn recipes_name_files_that_are_there() {
    let recipes = text("CONTRIBUTING.md");
    let is_path = |word: &&str| ["crates/", "xtask/", ".cargo/"].iter().any(|start| word.starts_with(start));
    let mut n_paths = 0;
    for path in recipes.split('`').skip(1).step_by(2).filter(is_path).filter(|path| !path.contains("NAME")) {
        assert!(root().join(path).exists(), "CONTRIBUTING.md names {path}, which is not there");
        n_paths += 1;
    }
    assert!(n_paths > 15, "{n_paths}");
}

#[test]
fn every_scenario_is_listed() {
    let list = text("scenarios/README.md");
    for folder in ["", "motion/"] {
        let mut n_scenarios = 0;
        for entry in std::fs::read_dir(root().join("scenarios").join(folder)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            if name.ends_with(".toml") {
                assert!(
                    list.contains(&format!("]({folder}{name})")),
                    "scenarios/README.md lacks {folder}{name}"
                );
                n_scenarios += 1;
            }
        }
        assert!(n_scenarios > 3, "scenarios/{folder}");
    }
}

/// What is longer has a page of its own: a newcomer reads one screen or two.
#[test]
fn the_readme_is_short_and_names_every_example() {
    let readme = text("README.md");
    assert!(readme.lines().count() < 120);
    for entry in std::fs::read_dir(root().join("examples")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(readme.contains(&format!("(examples/{name})")), "README.md does not name {name}");
    }
}
