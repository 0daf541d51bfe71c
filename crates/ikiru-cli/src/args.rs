//! What can be typed, and what it means.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Args as Group, Parser, Subcommand};
use ikiru_formats::Format;

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
    /// Measure: the paper's evaluation, arms of robots, and how good planned motions are
    #[command(subcommand)]
    Bench(BenchCommand),
}

impl Command {
    /// Whether one JSON object is to go to stdout.
    pub(crate) fn is_json(&self) -> bool {
        match self {
            Self::Demo(args) => args.json,
            Self::Inspect(args) => args.json,
            Self::Solve(args) => args.json,
            Self::Plan(args) => args.json,
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

#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    /// The paper's evaluation: every method on its two tasks, with the paper's own figures beside ours
    Paper(PaperArgs),
    /// Arms of robots: random reachable poses, cold, to 1e-5 m and 1e-5 rad inside the limits
    Robots(RobotsArgs),
    /// Planned motions: how smooth they are beside poses solved one by one, and within limits on speed
    Motions(MotionsArgs),
}

#[derive(Debug, Group)]
#[command(after_help = "\
Examples:
  ikiru bench paper                                   both tasks, all methods, five runs
  ikiru bench paper --objective simple --methods lm,ccd --runs 1
  ikiru bench paper --points 5,10                     trajectories instead of poses
  ikiru bench paper --out results                     tables, rows and figures as files
  ikiru bench paper --sample 100000 --seed 1 --out results   targets made anew by the paper's protocol

Every solve starts from the rest pose; success is a cost below 0.005, at most 500 iterations a start. 'lm'
starts again where a start fails (--restarts), all others have one start, as in the paper.")]
pub(crate) struct PaperArgs {
    /// Another rig with joints of the same names
    #[arg(long, value_name = "FILE")]
    pub(crate) rig: Option<PathBuf>,
    /// A JSON list of [x, y, z] in metres, in place of the sets that ship
    #[arg(long, value_name = "FILE.json", conflicts_with = "sample")]
    pub(crate) targets: Option<PathBuf>,
    /// Make the targets anew: so many points of the paper's cube, those that can be solved, thinned to 1,010
    #[arg(long, value_name = "N")]
    pub(crate) sample: Option<usize>,
    /// Seed of the sampled points
    #[arg(long, value_name = "S", default_value_t = 1, requires = "sample")]
    pub(crate) seed: u64,
    /// Which methods: lm, lm-local, adam, ccd, fabrik, ipopt (in a build that has it); all of this build by default
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) methods: Vec<String>,
    /// Which task: simple or combined; both by default
    #[arg(long, value_name = "NAME")]
    pub(crate) objective: Option<String>,
    /// How many points lie between the first and the last frame of a trajectory; 0 for single poses (5,10: the paper's
    /// tables 3 and 4)
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "0", conflicts_with = "sample")]
    pub(crate) points: Vec<usize>,
    /// Most restarts of lm
    #[arg(long, value_name = "N", default_value_t = 400)]
    pub(crate) restarts: usize,
    /// How often each set is solved
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = parse_count)]
    pub(crate) runs: usize,
    /// How many targets at the head of each set are solved and left out
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub(crate) warmup: usize,
    /// Where every solve goes as a JSON object (those of the 'reachable' set only where --targets names it)
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// A folder for tables (Markdown), rows (CSV) and figures (SVG, PNG)
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Group)]
#[command(after_help = "\
Examples:
  ikiru bench robots
  ikiru bench robots --robots panda,ur5 --n 1000
  ikiru bench robots --urdf arm.urdf --base base_link --tip tool0      any other arm

Targets are forward kinematics of poses drawn evenly from the ranges; every solve starts from the middle of the
ranges. Success: within 1e-5 m and 1e-5 rad, every limit held, recomputed from the pose.")]
pub(crate) struct RobotsArgs {
    /// Which robots: panda, ur5, xarm7, g1 (its left arm); all by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', conflicts_with = "urdf")]
    pub(crate) robots: Vec<String>,
    /// Another robot's file
    #[arg(long, value_name = "FILE", requires = "base", requires = "tip")]
    pub(crate) urdf: Option<PathBuf>,
    /// The link that its arm hangs on
    #[arg(long, value_name = "LINK", requires = "urdf")]
    pub(crate) base: Option<String>,
    /// The link that is brought to the targets
    #[arg(long, value_name = "LINK", requires = "urdf")]
    pub(crate) tip: Option<String>,
    /// Targets a robot
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = parse_count)]
    pub(crate) n: usize,
    /// Seed of the targets
    #[arg(long, value_name = "S", default_value_t = 17)]
    pub(crate) seed: u64,
    /// Most time of one solve, in milliseconds
    #[arg(long, value_name = "MS", default_value_t = 5.0, value_parser = parse_millis)]
    pub(crate) time_limit_ms: f64,
    /// How a start is improved: lm, adam, ccd or fabrik
    #[arg(long, value_name = "NAME", default_value = "lm")]
    pub(crate) method: String,
    /// Where every solve goes as a JSON object
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// Print the table as Markdown
    #[arg(long)]
    pub(crate) markdown: bool,
}

#[derive(Debug, Group)]
#[command(after_help = "\
Examples:
  ikiru bench motions
  ikiru bench motions three_points wave.toml
  ikiru bench motions --json | jq '.[] | [.scenario, .way, .total_jerk]'
  ikiru bench motions --out motions.md

Each scenario's motion is got in six ways: its keys solved one by one with the straight way between them; by the
paper's method; by 'lm' with the paper's smoothness; as the scenario says; the same with every speed limited to 0.7 of
the peak; and with as much time as that limit takes.")]
pub(crate) struct MotionsArgs {
    /// Scenarios with [motion]: .toml files, or reach_palm_down, three_points, panda_arc; all these three by default
    #[arg(value_name = "SCENARIO")]
    pub(crate) scenarios: Vec<PathBuf>,
    /// Print the rows as one JSON list
    #[arg(long)]
    pub(crate) json: bool,
    /// Where the result goes too: .json (the rows) or .md (the tables)
    #[arg(long, value_name = "FILE", value_parser = parse_table_out)]
    pub(crate) out: Option<PathBuf>,
    /// How often each motion is planned; the median time counts
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = parse_count)]
    pub(crate) runs: usize,
}

fn parse_table_out(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if has_ending(&path, &["json", "md"]) {
        Ok(path)
    } else {
        Err("expected a name that ends in .json or .md".to_owned())
    }
}

fn parse_count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n > 0 => Ok(n),
        _ => Err("expected a whole number above 0".to_owned()),
    }
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

fn parse_millis(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(ms) if ms > 0.0 && ms <= 1e6 => Ok(ms),
        _ => Err("expected milliseconds above 0, at most 1000000".to_owned()),
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
    /// A figure of angles, speeds, jerk and the effector's way over time: .svg or .png
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
