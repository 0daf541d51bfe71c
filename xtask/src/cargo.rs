//! Calls to cargo: run a command, ask for the workspace's metadata.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use serde::Deserialize;

/// A cargo command in a folder: the same cargo that runs this program.
pub(crate) fn command(folder: &Path) -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo"));
    let mut command = Command::new(cargo);
    command.current_dir(folder);
    command
}

/// Runs cargo with its output visible; an exit status other than 0 is an error.
pub(crate) fn run(folder: &Path, args: &[&str]) -> Result<()> {
    finish(command(folder).args(args))
}

/// Runs a prepared command (cargo, or rustup that starts it) with its output visible; an exit status other than 0
/// is an error.
pub(crate) fn finish(command: &mut Command) -> Result<()> {
    let program = Path::new(command.get_program()).file_stem().unwrap_or_default();
    let words = std::iter::once(program).chain(command.get_args()).map(|word| word.to_string_lossy());
    let line = words.collect::<Vec<_>>().join(" ");
    println!("$ {line}");
    if cfg!(test) {
        // Failures that tests provoke on purpose would read like real ones.
        command.stdout(Stdio::null()).stderr(Stdio::null());
    }
    let status = command.status().with_context(|| format!("`{line}` could not be started"))?;
    if !status.success() {
        bail!("`{line}` failed ({status})");
    }
    Ok(())
}

/// Runs a build and gives the programs that it made (or found made), by name.
pub(crate) fn executables(command: &mut Command) -> Result<BTreeMap<String, PathBuf>> {
    #[derive(Deserialize)]
    struct Message {
        target: Option<MadeTarget>,
        executable: Option<PathBuf>,
    }
    #[derive(Deserialize)]
    struct MadeTarget {
        name: String,
    }
    let output = command
        .arg("--message-format=json-render-diagnostics")
        .stderr(Stdio::inherit())
        .output()
        .context("cargo could not be started")?;
    if !output.status.success() {
        bail!("`{command:?}` failed ({})", output.status);
    }
    let mut executables = BTreeMap::new();
    for line in output.stdout.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()) {
        let message: Message = serde_json::from_slice(line).context("a message of cargo cannot be read")?;
        if let Message { target: Some(target), executable: Some(program) } = message {
            executables.insert(target.name, program);
        }
    }
    Ok(executables)
}

/// Whether a command of cargo's is installed.
pub(crate) fn has(folder: &Path, subcommand: &str) -> Result<bool> {
    let status = command(folder)
        .args([subcommand, "--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .context("cargo could not be started")?;
    Ok(status.success())
}

/// Fails with the command that installs what is missing, if a component of the toolchain is.
pub(crate) fn require_components(folder: &Path) -> Result<()> {
    let mut missing = Vec::new();
    for (subcommand, component) in [("fmt", "rustfmt"), ("clippy", "clippy")] {
        if !has(folder, subcommand)? {
            missing.push(component);
        }
    }
    if missing.is_empty() {
        return Ok(());
    }
    let missing = missing.join(" ");
    bail!("the toolchain lacks {missing}: run `rustup component add {missing}`")
}

/// What `cargo metadata` tells of the workspace.
#[derive(Deserialize)]
pub(crate) struct Metadata {
    pub packages: Vec<Package>,
    pub target_directory: PathBuf,
}

/// A package of the workspace, or one that it depends on.
#[derive(Deserialize)]
pub(crate) struct Package {
    pub name: String,
    pub version: String,
    /// The registries that it may go to: `None` is all, an empty list is none.
    pub publish: Option<Vec<String>>,
    pub targets: Vec<Target>,
    /// An SPDX expression.
    pub license: Option<String>,
    /// The least compiler, as it says itself.
    pub rust_version: Option<String>,
}

/// A library, binary, example or test of a package.
#[derive(Deserialize)]
pub(crate) struct Target {
    pub name: String,
    pub kind: Vec<String>,
    pub src_path: PathBuf,
}

impl Package {
    /// Whether it may be published.
    pub(crate) fn is_publishable(&self) -> bool {
        self.publish.as_ref().is_none_or(|registries| !registries.is_empty())
    }
}

/// The workspace's packages.
pub(crate) fn metadata(root: &Path) -> Result<Metadata> {
    metadata_with(root, &["--no-deps"])
}

/// The workspace's packages and all that any feature of theirs depends on, on any platform, in the locked versions.
pub(crate) fn whole_metadata(root: &Path) -> Result<Metadata> {
    metadata_with(root, &["--all-features", "--locked"])
}

fn metadata_with(root: &Path, args: &[&str]) -> Result<Metadata> {
    let output = command(root)
        .args(["metadata", "--format-version", "1"])
        .args(args)
        .stderr(Stdio::inherit())
        .output()
        .context("cargo could not be started")?;
    if !output.status.success() {
        bail!("`cargo metadata` failed ({})", output.status);
    }
    serde_json::from_slice(&output.stdout).context("the answer of `cargo metadata` cannot be read")
}
