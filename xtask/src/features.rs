//! The features of the façade, each alone and none at all: what is off is neither compiled nor missed.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::cargo;

/// What a build of the façade asks for, and what must then not come along: dependencies that a feature drops.
const BUILDS: [(&str, &[&str]); 5] = [
    ("", &["ikiru-formats", "ikiru-scenario", "serde", "serde_json", "toml", "quick-xml"]),
    ("serde", &["ikiru-formats", "ikiru-scenario", "serde_json", "toml", "quick-xml"]),
    ("formats", &["ikiru-scenario", "toml"]),
    ("builtin", &["ikiru-scenario", "toml"]),
    ("scenario", &[]),
];

/// Compiles each of the builds, and looks at what they depend on.
pub(crate) fn run(root: &Path) -> Result<()> {
    for (features, dropped) in BUILDS {
        let args = ["-p", "ikiru", "--no-default-features", "--features", features];
        cargo::finish(cargo::command(root).arg("check").args(args))?;
        let mut tree = cargo::command(root);
        tree.args(["tree", "--edges", "normal", "--prefix", "none"]).args(args);
        let output = tree.output().context("cargo could not be started")?;
        ensure!(output.status.success(), "`{tree:?}` failed ({})", output.status);
        let found = dependencies(&String::from_utf8_lossy(&output.stdout));
        let left: Vec<&str> = dropped.iter().copied().filter(|name| found.contains(*name)).collect();
        ensure!(
            left.is_empty(),
            "ikiru with the features [{features}] depends on {}: expected a build without",
            left.join(", ")
        );
    }
    println!("the façade builds with no feature and with each alone");
    Ok(())
}

/// The packages of a tree that cargo printed one a line.
fn dependencies(tree: &str) -> BTreeSet<String> {
    tree.lines().filter_map(|line| line.split_whitespace().next().map(str::to_owned)).collect()
}
