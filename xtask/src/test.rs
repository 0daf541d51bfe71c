//! `cargo xtask test`: everything that must pass, in order, each step named and timed.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};

use crate::cargo::{self, Target};
use crate::{api, deny, features, ipopt, package, tidy};

/// A step: its name and what it does in the project's root.
type Step = (&'static str, fn(&Path) -> Result<()>);

/// The cheap ones first, so that a slip shows within seconds. What is compiled is compiled once: all tests and examples
/// in one go with every feature, and checks of other features share what they have in common with the lints.
const STEPS: [Step; 13] = [
    ("components", cargo::require_components),
    ("format", |root| cargo::run(root, &["fmt", "--all", "--check"])),
    ("tidy", tidy::run),
    ("dependencies", deny::run),
    ("libraries", ipopt::provide),
    ("clippy", clippy),
    ("tests", |root| {
        cargo::finish(cargo::command(root).args(["test", "--workspace"]).args(ipopt::features()))
    }),
    ("examples", examples),
    ("left out", left_out),
    ("features", features::run),
    ("docs", docs),
    ("interfaces", api::check),
    ("package", package::run),
];

/// Runs all steps; the error names the one that failed.
pub(crate) fn run(root: &Path) -> Result<()> {
    run_steps(root, &STEPS)
}

fn run_steps(root: &Path, steps: &[Step]) -> Result<()> {
    let start = Instant::now();
    let mut times = Vec::new();
    for (idx, (name, step)) in steps.iter().enumerate() {
        let place = format!("step {} of {}, {name}", idx + 1, steps.len());
        println!("\n=== {place}");
        let step_start = Instant::now();
        let outcome = step(root);
        let step_secs = step_start.elapsed().as_secs_f64();
        outcome.with_context(|| format!("test FAILED at {place}, after {step_secs:.1} s"))?;
        println!("=== {name} passed in {step_secs:.1} s");
        times.push(format!("{name} {step_secs:.1} s"));
    }
    println!("\nxtask: test passed in {:.1} s ({})", start.elapsed().as_secs_f64(), times.join(", "));
    Ok(())
}

fn clippy(root: &Path) -> Result<()> {
    let mut command = cargo::command(root);
    command.args(["clippy", "--workspace", "--all-targets"]);
    cargo::finish(ipopt::check_all(&mut command).args(["--", "-D", "warnings"]))
}

fn docs(root: &Path) -> Result<()> {
    let mut command = cargo::command(root);
    command.args(["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings");
    cargo::finish(ipopt::check_all(&mut command))
}

/// What the command and the readers say of features that a build does not have: the tests before this step have them all. Little runs
/// and most is compiled for it alone, so that nothing is optimised.
fn left_out(root: &Path) -> Result<()> {
    let mut command = cargo::command(root);
    command.args(["test", "-p", "ikiru-cli", "--test", "all", "--", "left_out"]);
    cargo::finish(plain(&mut command))?;
    let mut command = cargo::command(root);
    command.args(["test", "-p", "ikiru-formats", "--no-default-features", "--lib", "--", "left_out"]);
    cargo::finish(plain(&mut command))
}

fn plain(command: &mut Command) -> &mut Command {
    command.env("CARGO_PROFILE_TEST_OPT_LEVEL", "0").env("CARGO_PROFILE_DEV_OPT_LEVEL", "0")
}

/// Runs every example. The step before has built them together with the tests.
fn examples(root: &Path) -> Result<()> {
    let metadata = cargo::metadata(root)?;
    let facade = metadata.packages.iter().find(|package| package.name == "ikiru");
    let targets = &facade.context("the workspace has no crate `ikiru`")?.targets;
    let examples: Vec<&Target> = targets.iter().filter(|target| target.kind == ["example"]).collect();
    every_file_is_registered(&root.join("examples"), &examples)?;
    let mut command = cargo::command(root);
    command.args(["build", "--workspace", "--examples"]).args(ipopt::features());
    let built = cargo::executables(&mut command)?;
    for Target { name, .. } in &examples {
        let program = built.get(name).with_context(|| format!("cargo built no example `{name}`"))?;
        cargo::finish(Command::new(program).current_dir(root))?;
    }
    println!("{} examples ran", examples.len());
    Ok(())
}

/// An example that no manifest names would neither be built nor run.
fn every_file_is_registered(folder: &Path, examples: &[&Target]) -> Result<()> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    for entry in entries {
        let path = entry?.path();
        if path.extension().is_none_or(|extension| extension != "rs") {
            continue;
        }
        let registered = examples.iter().any(|example| example.src_path.file_name() == path.file_name());
        ensure!(registered, "{}: not run by anyone, expected an [[example]] in crates/ikiru", path.display());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use anyhow::bail;

    use super::*;

    #[test]
    fn stops_at_the_first_failure_and_names_it() {
        let steps: [Step; 3] = [
            ("fine", |_| Ok(())),
            ("broken", |_| bail!("a reason")),
            ("never", |_| panic!("a step after a failure was run")),
        ];
        let error = run_steps(Path::new("."), &steps).unwrap_err();
        let line = format!("{error:#}");
        assert!(line.starts_with("test FAILED at step 2 of 3, broken, after"), "{line}");
        assert!(line.ends_with("a reason"), "{line}");
    }

    #[test]
    fn example_that_is_not_registered_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("01_reach.rs"), "fn main() {}").unwrap();
        let example = Target {
            name: "01_reach".into(),
            kind: vec!["example".into()],
            src_path: "crates/ikiru/../../examples/01_reach.rs".into(),
        };
        assert!(every_file_is_registered(folder.path(), &[&example]).is_ok());
        assert!(every_file_is_registered(folder.path(), &[]).is_err());
    }
}
