//! What can be typed, and what it means.

#[cfg(feature = "bench")]
mod bench;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Args as Group, Parser, Subcommand};
use ikiru_formats::Format;

#[cfg(feature = "bench")]
pub(crate) use bench::{BenchCommand, MotionsArgs, PaperArgs, RobotsArgs, TrackArgs};

const EXAMPLES: &str = "\
Examples:
  ikiru demo                                  pose the built-in human, write ./ikiru-demo.glb
  ikiru inspect avatar.vrm                    show joints, where they are, their axes, limits, roles and clips
  ikiru solve reach.toml --out posed.glb      solve, write the posed character
  ikiru solve reach.toml --json | jq .cost    the same for programs
  ikiru plan wave.toml --out wave.glb         a smooth motion over time
  ikiru convert walk.bvh walk.glb --onto avatar.vrm    a motion onto a character
  ikiru bench paper                           the paper's tables, measured here

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
    /// Show what a rig has: joints, places, axes, degrees of freedom, limits, humanoid roles, height, facing, clips
    Inspect(InspectArgs),
    /// Solve a scenario and report every objective
    Solve(SolveArgs),
    /// Plan a scenario as a motion over time, and report every objective
    Plan(PlanArgs),
    /// Take a rig or motion from one format to another, or a motion onto another character
    Convert(ConvertArgs),
    /// Measure: the paper's evaluation, arms of robots, how good motions are (in a build with the feature 'bench')
    #[cfg(feature = "bench")]
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Measure: the paper's evaluation, arms of robots, how good motions are (in a build with the feature 'bench')
    #[cfg(not(feature = "bench"))]
    #[command(after_help = crate::features::how_to_build("bench"))]
    Bench(LeftOut),
}

impl Command {
    /// Whether one JSON object is to go to stdout.
    pub(crate) fn is_json(&self) -> bool {
        match self {
            Self::Demo(args) => args.json,
            Self::Inspect(args) => args.json,
            Self::Solve(args) => args.json,
            Self::Plan(args) => args.json,
            #[cfg(feature = "bench")]
            Self::Bench(BenchCommand::Motions(args)) => args.json,
            Self::Convert(_) | Self::Bench(_) => false,
        }
    }
}

/// Whether a command line that cannot be parsed asks for JSON on stdout; `bench` has a key `--json FILE`.
pub(crate) fn asks_for_json(typed: impl IntoIterator<Item = OsString>) -> bool {
    let typed: Vec<OsString> = typed.into_iter().collect();
    typed.get(1).is_some_and(|command| command != "bench") && typed.iter().any(|word| word == "--json")
}

/// Whatever is typed behind a command that this build leaves out: the answer is how to get it.
#[cfg(not(feature = "bench"))]
#[derive(Debug, Group)]
pub(crate) struct LeftOut {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    words: Vec<OsString>,
}

fn parse_scale(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(scale) if scale > 0.0 && scale <= 1e9 => Ok(scale),
        _ => Err("expected metres in a unit of the file, above 0".to_owned()),
    }
}

fn parse_rate(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(hz) if hz > 0.0 && hz <= 1e4 => Ok(hz),
        _ => Err("expected frames a second above 0, at most 10000".to_owned()),
    }
}

#[derive(Debug, Group)]
pub(crate) struct DemoArgs {
    /// Where the pose goes: .glb, .gltf, .vrm (posed, skinned), .bvh, .vrma or .json (joint rotations)
    #[arg(long, value_name = "FILE", default_value = "./ikiru-demo.glb", value_parser = parse_out)]
    pub(crate) out: Out,
    /// Print the report as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Group)]
#[command(after_help = "\
Examples:
  ikiru inspect builtin:human
  ikiru inspect avatar.vrm --json | jq '.joints[] | [.name, .rest.position]'
  ikiru inspect walk.bvh --scale 0.01
  ikiru inspect reach.toml                 the same, with the scenario's limits and root

Built in: builtin:human, builtin:reference, builtin:panda, builtin:ur5, builtin:xarm7, builtin:g1")]
pub(crate) struct InspectArgs {
    /// A .glb, .gltf, .vrm, .vrma, .bvh or .urdf file, or one of the built-in rigs; or a scenario, as a .toml file or - for stdin
    pub(crate) rig: PathBuf,
    /// Metres in a unit of the file, for .bvh files, which do not say; 1 otherwise
    #[arg(long, value_name = "S", value_parser = parse_scale, allow_negative_numbers = true)]
    pub(crate) scale: Option<f64>,
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
    /// A scenario, as a .toml file; - for stdin
    pub(crate) scenario: PathBuf,
    /// Print the report as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
    /// Where the pose goes: .glb, .gltf, .vrm (posed, skinned), .bvh, .vrma or .json (joint rotations)
    #[arg(long, value_name = "FILE", value_parser = parse_out)]
    pub(crate) out: Option<Out>,
}

#[derive(Debug, Group)]
#[command(after_help = "\
A scenario with a motion has, beside what 'ikiru solve' reads:
  [motion]
  duration_secs = 2.0      # at rate = 30 frames a second; or: points = 10
  smoothness = [0.001, 0.001, 0.001]    # weights of speed, acceleration, jerk

  [[objective]]
  at = 1.0                 # seconds; or: from = 0.5 and to = 1.5; the end by default")]
pub(crate) struct PlanArgs {
    /// A scenario with [motion], as a .toml file; - for stdin
    pub(crate) scenario: PathBuf,
    /// Print the report and the motion as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
    /// Where the motion goes: .glb, .gltf, .vrm (animated, skinned), .bvh, .vrma, .json or .csv
    #[arg(long, value_name = "FILE", value_parser = parse_motion_out)]
    pub(crate) out: Option<MotionOut>,
    /// A figure of angles, speeds, jerk and the effector's way over time: .svg or .png (in a build with the
    /// feature 'plot')
    #[arg(long, value_name = "FILE", value_parser = parse_plot)]
    pub(crate) plot: Option<PathBuf>,
}

/// A file for a motion and how it is written, which its ending decides.
#[derive(Clone, Debug)]
pub(crate) struct MotionOut {
    pub(crate) path: PathBuf,
    pub(crate) format: MotionFormat,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MotionFormat {
    /// What shows a body that moves.
    Body(Format),
    /// The report and the motion.
    Json,
    /// A table.
    Csv,
}

fn parse_motion_out(text: &str) -> Result<MotionOut, String> {
    let path = PathBuf::from(text);
    let format = if has_ending(&path, &["json"]) {
        MotionFormat::Json
    } else if has_ending(&path, &["csv"]) {
        MotionFormat::Csv
    } else {
        let expected = "expected a name that ends in .glb, .gltf, .vrm, .bvh, .vrma, .json or .csv";
        MotionFormat::Body(Format::of(&path).ok_or(expected)?)
    };
    Ok(MotionOut { path, format })
}

fn parse_plot(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if has_ending(&path, &["svg", "png"]) {
        Ok(path)
    } else {
        Err("expected a name that ends in .svg or .png".to_owned())
    }
}

#[derive(Debug, Group)]
#[command(after_help = "\
Examples:
  ikiru convert walk.bvh walk.vrma                       for any VRM avatar
  ikiru convert walk.bvh walk.glb --onto avatar.vrm      on that avatar, skinned and animated
  ikiru convert walk.bvh walk.csv --rate 30              its numbers as a table, 30 rows a second
  ikiru convert walk.bvh walk.json --onto builtin:human  as joint rotations of that rig
  ikiru convert cmu.bvh walk.csv --scale 0.056444        lengths in metres, where the file's unit is another
  ikiru convert avatar.vrm skeleton.bvh                  its skeleton at rest
  ikiru convert motion.json motion.glb --onto avatar.vrm what 'ikiru plan --out motion.json' wrote for that avatar

A .csv file has a row a frame: time_secs, root_translation.x to .z, then each moving joint's rotation on top of
rest as NAME.x, .y, .z, .w (a quaternion), or its NAME.x_deg to .z_deg, NAME.angle_deg or NAME.offset. A .json
file has the same as lists: times, root_translation and joints, and the rig that it is of. Where a clip of a .glb, .gltf
or .vrm file translates joints, the way of the hips in a walk, they do so in what is written. A motion becomes the
first animation of such a file; one of its name gives way to it.")]
pub(crate) struct ConvertArgs {
    /// A .glb, .gltf, .vrm, .vrma, .bvh or .urdf file, a motion's .json, or one of the built-in rigs
    pub(crate) input: PathBuf,
    /// A .glb, .gltf, .vrm (only from or onto a glTF or VRM file), .bvh, .vrma, .json or .csv file
    pub(crate) output: PathBuf,
    /// The character that the motion goes onto, through humanoid roles; for a .json that names no rig, the rig that it
    /// is of
    #[arg(long, value_name = "RIG")]
    pub(crate) onto: Option<PathBuf>,
    /// Which motion, where there are several; the first one otherwise
    #[arg(long, value_name = "NAME")]
    pub(crate) clip: Option<String>,
    /// Frames a second, evenly, along a smooth curve through the motion's own; as near as first and last frame allow
    #[arg(long, value_name = "HZ", value_parser = parse_rate)]
    pub(crate) rate: Option<f64>,
    /// Metres in a unit of the input, for .bvh files, which do not say; 1 otherwise
    #[arg(long, value_name = "S", value_parser = parse_scale, allow_negative_numbers = true)]
    pub(crate) scale: Option<f64>,
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
    /// What shows a body.
    Body(Format),
    /// The pose alone.
    Json,
}

fn parse_out(text: &str) -> Result<Out, String> {
    const EXPECTED: &str = "expected .glb, .gltf, .vrm, .bvh, .vrma or .json";
    let path = PathBuf::from(text);
    let format = match (path.extension(), Format::of(&path)) {
        (_, Some(format)) => OutFormat::Body(format),
        (Some(_), None) if has_ending(&path, &["json"]) => OutFormat::Json,
        (None, None) => return Err(format!("the file's name has no ending: {EXPECTED}")),
        (Some(other), None) => {
            let other = other.to_string_lossy().to_ascii_lowercase();
            return Err(format!("the ending '.{other}' is not one that can be written: {EXPECTED}"));
        }
    };
    Ok(Out { path, format })
}

/// Whether a path ends so, in whatever case.
pub(crate) fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|found| endings.iter().any(|ending| found.eq_ignore_ascii_case(ending)))
}
