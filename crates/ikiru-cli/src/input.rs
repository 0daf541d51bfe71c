//! What comes in: rigs with a user's word on scale and roles, and scenarios, from files or from stdin.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;

use anyhow::{Context, anyhow};
use ikiru_formats::{Loaded, lacks_unit, read_scaled};
use ikiru_rig::Role;
use ikiru_scenario::Scenario;

use crate::failure::Failure;

/// Whether an argument means standard input.
pub(crate) fn is_stdin(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Reads a scenario; `-` is standard input, where paths inside it are relative to the current folder.
pub(crate) fn read_scenario(path: &Path) -> Result<Scenario, Failure> {
    if !is_stdin(path) {
        return Scenario::read(path).map_err(Failure::input);
    }
    let mut text = String::new();
    std::io::stdin()
        .read_to_string(&mut text)
        .context("stdin: the scenario cannot be read")
        .map_err(Failure::input)?;
    Scenario::parse(&text, "stdin", "").map_err(Failure::input)
}

/// Reads a rig: `scale` is metres in a unit of the file, for a format that does not say, and `roles` a file of lines such
/// as `leftHand = "Bip01_Hand.L"`, which count more than the roles that the rig has.
pub(crate) fn read_rig(path: &Path, roles: Option<&Path>, scale: Option<f64>) -> Result<Loaded, Failure> {
    if is_stdin(path) {
        return Err(Failure::input(anyhow!(
            "a rig cannot be read from stdin, which has no ending to tell its format: expected a file"
        )));
    }
    if scale.is_some_and(|scale| scale != 1.0) && !lacks_unit(path) {
        return Err(Failure::input(anyhow!(
            "{} is in metres: expected no --scale, which is for .bvh files",
            path.display()
        )));
    }
    let loaded = read_scaled(path, scale.unwrap_or(1.0)).map_err(Failure::input)?;
    match roles {
        Some(roles) => with_roles(loaded, roles),
        None => Ok(loaded),
    }
}

fn with_roles(loaded: Loaded, path: &Path) -> Result<Loaded, Failure> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("{name} cannot be read"))
        .map_err(Failure::input)?;
    let lines: BTreeMap<String, String> = toml::from_str(&text)
        .map_err(|error| anyhow!("{name}: {error}expected lines such as leftHand = \"NAME OF A JOINT\""))
        .map_err(Failure::input)?;
    let mut pairs = Vec::with_capacity(lines.len());
    for (role, joint) in &lines {
        let role: Role = role.parse().map_err(|error| Failure::input(anyhow!("{name}: {error}")))?;
        pairs.push((role, joint.as_str()));
    }
    let rig = loaded.rig.with_roles(pairs).map_err(|error| Failure::input(anyhow!("{name}: {error}")))?;
    loaded.with_rig(rig).map_err(Failure::input)
}
