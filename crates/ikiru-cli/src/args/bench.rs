//! What can be typed behind `ikiru bench`.

use std::path::PathBuf;

use clap::{Args as Group, Subcommand};

use super::has_ending;

#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    /// The paper's evaluation: every method on its two tasks, with the paper's own figures beside ours
    Paper(PaperArgs),
    /// Arms of robots: random reachable poses, cold, to 1e-5 m and 1e-5 rad inside the limits
    Robots(RobotsArgs),
    /// Whole bodies that follow targets frame by frame: time, iterations, error and turns of joints
    Track(TrackArgs),
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
    /// A folder for tables (Markdown), rows (CSV) and, in a build with the feature 'plot', figures (SVG, PNG)
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
  ikiru bench track
  ikiru bench track --bodies g1 --rates 60 --frames 599
  ikiru bench track --bodies human --clips walk,my_take.bvh --runs 7
  ikiru bench track --away                       targets that jump out of reach each other second, and back

The G1 follows sines of its own 29 hinges and base, the human (20 joints) and the reference human (55 joints, fingers
and all) recorded motions, played to and fro. Each frame is solved from the pose of the frame before, with the defaults of
the library. A frame is met where every target is within 1 mm and 0.5° and every limit holds, recomputed from the
pose. The last two columns: the largest turn of a joint within a frame, and that of the motion behind the targets.")]
pub(crate) struct TrackArgs {
    /// Which bodies: g1, human, reference; all by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "g1,human,reference")]
    pub(crate) bodies: Vec<String>,
    /// What the humans follow: cmu_01_01, walk, run, dance, or files with a motion; these four by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "cmu_01_01,walk,run,dance")]
    pub(crate) clips: Vec<PathBuf>,
    /// Frames a second
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "30,60,90", value_parser = parse_rate)]
    pub(crate) rates: Vec<f64>,
    /// Frames of each course
    #[arg(long, value_name = "N", default_value_t = 3000, value_parser = parse_count)]
    pub(crate) frames: usize,
    /// Seed of the G1's sines
    #[arg(long, value_name = "S", default_value_t = 2)]
    pub(crate) seed: u64,
    /// How often each course is followed; the least time of a frame counts
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_count)]
    pub(crate) runs: usize,
    /// Move the targets out of reach each other second, and back
    #[arg(long)]
    pub(crate) away: bool,
    /// Where every frame goes as a JSON object
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

fn parse_rate(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(hz) if hz > 0.0 && hz <= 1e4 => Ok(hz),
        _ => Err("expected frames a second, above 0 and at most 10000".to_owned()),
    }
}

fn parse_millis(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(ms) if ms > 0.0 && ms <= 1e6 => Ok(ms),
        _ => Err("expected milliseconds above 0, at most 1000000".to_owned()),
    }
}
