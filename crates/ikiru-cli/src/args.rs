//! What can be typed, and what it means.

use std::path::{Path, PathBuf};

use clap::{Args as Group, Parser, Subcommand};

const EXAMPLES: &str = "\
Examples:
  ikiru demo                                  pose the built-in human, write ./ikiru-demo.glb
  ikiru inspect avatar.vrm                    show joints, limits, roles and clips
  ikiru solve reach.toml --out posed.glb      solve, write the posed character
  ikiru solve reach.toml --json | jq .cost    the same for programs
  ikiru convert walk.bvh walk.glb --onto avatar.vrm    a motion onto a character

Exit status: 0 reached, 1 best effort below the bar (the report says why), 2 bad input,
3 could not write.";

/// Inverse kinematics for virtual humans and any other rig.
#[derive(Debug, Parser)]
#[command(name = "ikiru", version, arg_required_else_help = true, after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Pose the built-in human: a multi-constraint reach, written as a skinned .glb that any viewer opens
    Demo(DemoArgs),
    /// Show what a rig has: joints, degrees of freedom, limits, humanoid roles, clips, warnings
    Inspect(InspectArgs),
    /// Solve a scenario and report every objective
    Solve(SolveArgs),
    /// Take a rig or motion from one format to another, or a motion onto another character
    Convert(ConvertArgs),
}

#[derive(Debug, Group)]
pub(crate) struct DemoArgs {
    /// Where the pose goes: .glb (posed, skinned), .bvh or .json (joint rotations)
    #[arg(long, value_name = "FILE", default_value = "./ikiru-demo.glb", value_parser = parse_out)]
    pub(crate) out: Out,
    /// Print the report as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Group)]
#[command(
    after_help = "Examples:\n  ikiru inspect builtin:human\n  ikiru inspect avatar.vrm --json | jq '.joints[].role'"
)]
pub(crate) struct InspectArgs {
    /// A .glb, .gltf, .vrm, .vrma, .bvh or .urdf file, or builtin:human, builtin:reference
    pub(crate) rig: PathBuf,
    /// Humanoid roles that count more than those found: lines such as leftHand = "Bip01_Hand.L"
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) roles: Option<PathBuf>,
    /// Print everything as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Group)]
#[command(after_help = "\
A scenario, in full:
  version = 1
  rig = \"builtin:human\"
  active = [\"leftShoulder\", \"leftUpperArm\", \"leftLowerArm\", \"leftHand\"]

  [[objective]]
  kind = \"position\"
  joint = \"leftHand\"
  target = [0.35, 1.1, 0.35]")]
pub(crate) struct SolveArgs {
    /// A scenario, as a .toml file
    pub(crate) scenario: PathBuf,
    /// Print the report as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
    /// Where the pose goes: .glb (posed, skinned), .bvh or .json (joint rotations)
    #[arg(long, value_name = "FILE", value_parser = parse_out)]
    pub(crate) out: Option<Out>,
}

#[derive(Debug, Group)]
#[command(after_help = "\
Examples:
  ikiru convert walk.bvh walk.vrma                       for any VRM avatar
  ikiru convert walk.bvh walk.glb --onto avatar.vrm      on that avatar, skinned and animated
  ikiru convert avatar.vrm skeleton.bvh                  its skeleton at rest")]
pub(crate) struct ConvertArgs {
    /// A .glb, .gltf, .vrm, .vrma, .bvh or .urdf file, or builtin:human, builtin:reference
    pub(crate) input: PathBuf,
    /// A .glb (only from or onto a glTF or VRM file), .bvh or .vrma file
    pub(crate) output: PathBuf,
    /// The character that the motion goes onto, through humanoid roles
    #[arg(long, value_name = "RIG")]
    pub(crate) onto: Option<PathBuf>,
    /// Which motion, where there are several; the first one otherwise
    #[arg(long, value_name = "NAME")]
    pub(crate) clip: Option<String>,
    /// Humanoid roles that count more than those found in the input
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) roles: Option<PathBuf>,
}

/// A file to write and how, which its ending decides.
#[derive(Clone, Debug)]
pub(crate) struct Out {
    pub(crate) path: PathBuf,
    pub(crate) format: OutFormat,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OutFormat {
    /// The rig's own file, posed.
    Glb,
    /// A skeleton with one frame.
    Bvh,
    /// The pose alone.
    Json,
}

fn parse_out(text: &str) -> Result<Out, String> {
    let path = PathBuf::from(text);
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let format = match ending.as_str() {
        "glb" => OutFormat::Glb,
        "json" => OutFormat::Json,
        "bvh" => OutFormat::Bvh,
        "" => return Err("the file's name has no ending: expected .glb, .bvh or .json".to_owned()),
        other => {
            return Err(format!(
                "the ending '.{other}' is not one that can be written: expected .glb, .bvh or .json"
            ));
        }
    };
    Ok(Out { path, format })
}

/// Whether a path ends so, in whatever case.
pub(crate) fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|found| endings.iter().any(|ending| found.eq_ignore_ascii_case(ending)))
}
