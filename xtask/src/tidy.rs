//! `cargo xtask tidy`: the project's own rules, each one a file beside this one.

mod architecture;
mod catch_all;
mod circles;
mod code;
mod copies;
mod defaults;
mod dependencies;
mod floors;
mod foreign;
mod growth;
mod kinds;
mod paths;
mod project;
mod rust_files;
mod type_names;
mod words;

use std::fmt;
use std::path::Path;

use anyhow::{Result, bail};

pub(crate) use project::Project;
#[cfg(test)]
pub(crate) use project::Tree;

/// Something that a rule has to say about a place.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Finding {
    /// From the project's root, with forward slashes.
    pub file: String,
    /// From 1.
    pub line: usize,
    /// What is there.
    pub what: String,
    /// What was expected.
    pub expected: String,
    /// Whether it fails the check; a warning is only printed.
    pub fails: bool,
}

impl Finding {
    fn new(file: &str, line: usize, what: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { file: file.into(), line, what: what.into(), expected: expected.into(), fails: true }
    }

    fn warning(self) -> Self {
        Self { fails: false, ..self }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, what, expected, fails } = self;
        let head = if *fails { "" } else { "warning: " };
        write!(f, "{file}:{line}: {head}{what}, expected {expected}")
    }
}

/// Checks the project, prints every finding, and fails if there is more than warnings.
pub(crate) fn run(root: &Path) -> Result<()> {
    let project = Project::open(root)?;
    let findings = check(&project)?;
    for finding in &findings {
        println!("{finding}");
    }
    let n_failing = findings.iter().filter(|finding| finding.fails).count();
    if n_failing > 0 {
        bail!("tidy found {n_failing} violations of the project's rules, listed above");
    }
    println!("tidy: {} files, {} warnings", project.files().len(), findings.len());
    Ok(())
}

/// Every finding of every rule, by file and line.
fn check(project: &Project) -> Result<Vec<Finding>> {
    let rules = [
        rust_files::check,
        architecture::check,
        dependencies::check,
        foreign::check,
        type_names::check,
        catch_all::check,
        circles::check,
        copies::check,
        defaults::check,
        floors::check,
        growth::check,
        kinds::check,
        words::check,
    ];
    let mut findings = Vec::new();
    for rule in rules {
        findings.extend(rule(project)?);
    }
    findings.sort_by(|a, b| (&a.file, a.line).cmp(&(&b.file, b.line)));
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rule_is_asked_and_one_violation_fails() {
        let tree = Tree::new(&[
            ("ARCHITECTURE.md", "`crates/none/`\n"),
            ("Cargo.toml", "[workspace.dependencies]\nglam = \"0.34\"\n"),
            ("src/lib.rs", "fn f() {}\n"),
            ("words.txt", concat!("see ..", "/shared\n")),
        ]);
        let findings = check(&tree.open()).unwrap();
        let files: Vec<&str> = findings.iter().map(|finding| finding.file.as_str()).collect();
        assert_eq!(files, ["ARCHITECTURE.md", "Cargo.toml", "src/lib.rs", "words.txt"]);
        assert!(run(tree.root()).is_err());
    }

    #[test]
    fn warnings_alone_pass() {
        let long = format!("//! Long.\n{}", "fn f() {}\n".repeat(600));
        let tree = Tree::new(&[
            ("ARCHITECTURE.md", ""),
            ("Cargo.toml", "[workspace.dependencies]\n"),
            ("src/lib.rs", &long),
        ]);
        assert_eq!(check(&tree.open()).unwrap().len(), 1);
        assert!(run(tree.root()).is_ok());
    }

    #[test]
    fn findings_read_as_place_fact_and_expectation() {
        let finding = Finding::new("a.rs", 3, "it is blue", "green");
        assert_eq!(finding.to_string(), "a.rs:3: it is blue, expected green");
        assert_eq!(finding.warning().to_string(), "a.rs:3: warning: it is blue, expected green");
    }
}
