//! `--roles FILE.toml`: a user's word on which joint is which humanoid bone.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, anyhow};
use ikiru_formats::Loaded;
use ikiru_rig::Role;

use crate::failure::Failure;

/// Reads a rig, and gives its joints the roles of a file of lines such as `leftHand = "Bip01_Hand.L"`, on top of
/// those that it has.
pub(crate) fn read_with_roles(rig: &Path, roles: Option<&Path>) -> Result<Loaded, Failure> {
    let loaded = ikiru_formats::read(rig).map_err(Failure::input)?;
    let Some(path) = roles else { return Ok(loaded) };
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
    let mut builder = loaded.rig.to_builder();
    builder.set_roles(pairs).map_err(|error| Failure::input(anyhow!("{name}: {error}")))?;
    let rig = builder.build().map_err(Failure::input)?;
    loaded.with_rig(rig).map_err(Failure::input)
}
