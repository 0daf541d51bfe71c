//! Arms of robots, by the protocol by which arms are compared: random reachable poses, cold starts, and a bar of
//! 1e-5 m and 1e-5 rad.

use std::f64::consts::PI;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use ikiru_formats::Loaded;
use ikiru_rig::{JointId, JointMotion, Pose};
use ikiru_solve::objectives::PoseTarget;
use ikiru_solve::{Method, Problem, Search, Solver, SolverOptions, TermId};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use crate::error::Error;
use crate::statistics::Summary;
use crate::table::{Texts, percent, short};

/// How near a position must be (metres), and a rotation (radians).
pub const BAR: f64 = 1e-5;

/// How far outside a limit still counts as inside (radians).
const LIMIT_SLACK: f64 = 1e-9;

/// Which robot, and between which links its arm lies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arm {
    /// A short name.
    pub robot: String,
    /// `builtin:…`, or the path of a file.
    pub rig: PathBuf,
    /// The link that the arm hangs on, which does not move.
    pub base: String,
    /// The link that is brought to a target.
    pub tip: String,
}

/// Name, base and tip of the arms that ship.
const ARMS: [[&str; 3]; 4] = [
    ["panda", "panda_link0", "panda_link8"],
    ["ur5", "base_link", "tool0"],
    ["xarm7", "link_base", "link7"],
    ["g1", "torso_link", "left_rubber_hand"],
];

impl Arm {
    /// The arms that ship: `panda`, `ur5`, `xarm7` and the left arm of `g1`.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let arm = |[robot, base, tip]: [&str; 3]| Self {
            robot: robot.to_owned(),
            rig: format!("builtin:{robot}").into(),
            base: base.to_owned(),
            tip: tip.to_owned(),
        };
        ARMS.map(arm).into()
    }

    /// The arm of that name.
    ///
    /// # Errors
    /// An unknown name, which is answered with those that exist.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::all().into_iter().find(|arm| arm.robot == name).ok_or_else(|| Error::Unknown {
            what: "robot",
            name: name.to_owned(),
            known: ARMS.map(|arm| arm[0]).join(", "),
        })
    }
}

/// What the protocol leaves open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Targets a robot; 10,000 by default.
    pub n: usize,
    /// Seed of the targets; 17 by default.
    pub seed: u64,
    /// Most time of one solve; 5 ms by default.
    pub time_limit: Duration,
    /// How many targets are solved before time is taken; 100 by default.
    pub warmup: usize,
    /// How a start is improved; `lm` by default.
    pub method: Method,
}

impl Default for Settings {
    fn default() -> Self {
        Self { n: 10_000, seed: 17, time_limit: Duration::from_millis(5), warmup: 100, method: Method::Lm }
    }
}

/// Where the tip should be, in the world of the robot's own file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Target {
    /// Metres.
    pub position: [f64; 3],
    /// Unit quaternion, x y z w.
    pub rotation: [f64; 4],
}

/// One solve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The robot's name.
    pub robot: String,
    /// The arm's base link.
    pub base: String,
    /// The arm's tip link.
    pub tip: String,
    /// The joints that move, from the base to the tip.
    pub joints: Vec<String>,
    /// Where the tip should be.
    pub target: Target,
    /// Whether the tip is there within the bar, and all limits hold; recomputed from the pose.
    pub success: bool,
    /// Distance of the tip from its target, metres.
    pub position_error: f64,
    /// Angle of the tip from its target, radians.
    pub rotation_error: f64,
    /// Iterations over all starts.
    pub iterations: usize,
    /// Starts beyond the first.
    pub restarts: usize,
    /// The solve alone, microseconds.
    pub time_us: f64,
    /// The pose: a value for each of `joints`, radians or metres.
    pub values: Vec<f64>,
}

/// An arm that is ready to solve.
#[derive(Debug)]
struct Bench<'a> {
    arm: &'a Arm,
    loaded: Loaded,
    problem: Problem,
    target: TermId<PoseTarget>,
    tip: JointId,
    joints: Vec<JointId>,
    /// The middle of the ranges.
    start: Pose,
}

/// Solves `settings.n` targets of an arm, each cold from the middle of the ranges. `done` is called after each.
///
/// # Errors
/// A rig that cannot be read, or that has no such arm.
pub fn run(arm: &Arm, settings: &Settings, mut done: impl FnMut()) -> Result<Vec<Row>, Error> {
    let mut bench = Bench::new(arm)?;
    let solver = Solver::new(SolverOptions {
        method: settings.method,
        search: Search::Global { max_restarts: 100_000 },
        // The sum of both squares is below the square of the bar only where each part is within it.
        cost_below: Some(BAR * BAR),
        max_time: Some(settings.time_limit),
        ..SolverOptions::default()
    });
    let mut workspace = solver.workspace(&bench.problem);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
    let mut pose = bench.start.clone();
    let mut rows = Vec::with_capacity(settings.n);
    for idx in 0..settings.warmup + settings.n {
        let (position, rotation) = bench.reachable(&mut random)?;
        let objective = &mut bench.problem[bench.target];
        (objective.position, objective.rotation) = (position, rotation);
        pose.clone_from(&bench.start);
        let begin = Instant::now();
        let report = solver.solve(&bench.problem, &mut pose, &mut workspace);
        let time = begin.elapsed();
        if idx >= settings.warmup {
            let (iterations, restarts) = (report.iterations, report.restarts);
            rows.push(bench.judge(&pose, position, rotation, iterations, restarts, time)?);
            done();
        }
    }
    Ok(rows)
}

impl<'a> Bench<'a> {
    fn new(arm: &'a Arm) -> Result<Self, Error> {
        let loaded = ikiru_formats::read(&arm.rig)?;
        let rig = &loaded.rig;
        let wrong = |reason: String| Error::Arm { robot: arm.robot.clone(), reason };
        let joint = |name: &str| rig.joint(name).map_err(|e| wrong(e.to_string()));
        let (base, tip) = (joint(&arm.base)?, joint(&arm.tip)?);
        let mut joints: Vec<JointId> = rig.ancestors(tip).take_while(|j| *j != base).collect();
        if rig.ancestors(tip).all(|j| j != base) {
            return Err(wrong(format!("'{}' does not lie above '{}'", arm.base, arm.tip)));
        }
        joints.reverse();
        joints.retain(|j| rig.get(*j).is_some_and(|joint| joint.n_dofs() > 0));
        if joints.is_empty() {
            return Err(wrong(format!("nothing moves between '{}' and '{}'", arm.base, arm.tip)));
        }
        let mut start = rig.rest_pose();
        for &joint in &joints {
            let Some((min, max)) = range(&start, joint) else {
                let name = rig.get(joint).map_or("", |j| &j.name);
                return Err(wrong(format!("'{name}' is neither a hinge nor a slider of an arm")));
            };
            let set = start.set_value(joint, 0.5 * (min + max));
            set.map_err(|e| wrong(e.to_string()))?;
        }
        let problem = Problem::new(rig, joints.iter().copied());
        let mut problem = problem.map_err(|e| wrong(e.to_string()))?;
        let target = problem.add(1.0, PoseTarget::new(tip, DVec3::ZERO, DQuat::IDENTITY));
        Ok(Self { arm, problem, target, tip, joints, start, loaded })
    }

    /// Position and rotation of the tip in a random pose, uniform over the ranges.
    fn reachable(&self, random: &mut Xoshiro256PlusPlus) -> Result<(DVec3, DQuat), Error> {
        let mut goal = self.start.clone();
        for &joint in &self.joints {
            let (min, max) = range(&goal, joint).unwrap_or_default();
            let value = min + (max - min) * random.r#gen::<f64>();
            goal.set_value(joint, value).map_err(|e| self.wrong(&e))?;
        }
        let frame = goal.frame(self.tip).map_err(|e| self.wrong(&e))?;
        Ok((frame.position, frame.rotation))
    }

    fn wrong(&self, error: &dyn std::error::Error) -> Error {
        Error::Arm { robot: self.arm.robot.clone(), reason: error.to_string() }
    }

    fn judge(
        &self,
        pose: &Pose,
        position: DVec3,
        rotation: DQuat,
        iterations: usize,
        restarts: usize,
        time: Duration,
    ) -> Result<Row, Error> {
        let found = pose.frame(self.tip).map_err(|e| self.wrong(&e))?;
        let position_error = found.position.distance(position);
        // By the vector part: the arc cosine of a number near 1 knows no angles of 1e-5.
        let turn = found.rotation.inverse() * rotation;
        let rotation_error = 2.0 * turn.xyz().length().atan2(turn.w.abs());
        let within = position_error <= BAR && rotation_error <= BAR;
        let file_from_world = self.loaded.world_from_file().inverse();
        let name = |j: &JointId| pose.rig().get(*j).map_or_else(String::new, |joint| joint.name.clone());
        Ok(Row {
            robot: self.arm.robot.clone(),
            base: self.arm.base.clone(),
            tip: self.arm.tip.clone(),
            joints: self.joints.iter().map(name).collect(),
            target: Target {
                position: (file_from_world * position).to_array(),
                rotation: (file_from_world * rotation).to_array(),
            },
            success: within && pose.limit_violation() <= LIMIT_SLACK,
            position_error,
            rotation_error,
            iterations,
            restarts,
            time_us: time.as_secs_f64() * 1e6,
            values: self.joints.iter().filter_map(|j| pose.value(*j)).collect(),
        })
    }
}

/// The range of a hinge or slider; where it is unlimited, one turn or one metre about the rest.
fn range(pose: &Pose, joint: JointId) -> Option<(f64, f64)> {
    let motion = &pose.rig().get(joint)?.motion;
    let [range] = motion.ranges() else { return None };
    let reach = if let JointMotion::Slider { .. } = motion { 0.5 } else { PI };
    let min = if range.min.is_finite() { range.min } else { range.max.min(reach) - 2.0 * reach };
    let max = if range.max.is_finite() { range.max } else { min + 2.0 * reach };
    Some((min, max))
}

/// The rows of all robots as a table.
#[derive(Clone, Debug)]
pub struct Report {
    texts: Texts,
}

impl Report {
    /// Sums up rows, one line a robot, in the order in which they come.
    #[must_use]
    pub fn new(rows: &[Row]) -> Self {
        let mut robots: Vec<&str> = Vec::new();
        for row in rows {
            if !robots.contains(&row.robot.as_str()) {
                robots.push(&row.robot);
            }
        }
        let header = [
            "robot",
            "DoF",
            "targets",
            "success %",
            "mean µs",
            "median µs",
            "p99 µs",
            "iterations",
            "restarts",
        ];
        let lines = robots.iter().map(|robot| {
            let rows: Vec<&Row> = rows.iter().filter(|r| r.robot == *robot).collect();
            let time = Summary::of(rows.iter().map(|r| r.time_us));
            vec![
                (*robot).to_owned(),
                rows.first().map_or(0, |r| r.joints.len()).to_string(),
                rows.len().to_string(),
                percent(rows.iter().filter(|r| r.success).count(), rows.len()),
                short(time.mean),
                short(time.median),
                short(time.p99),
                short(Summary::of(rows.iter().map(|r| r.iterations as f64)).mean),
                short(Summary::of(rows.iter().map(|r| r.restarts as f64)).mean),
            ]
        });
        let rows = lines.collect();
        Self { texts: Texts { header: header.map(str::to_owned).to_vec(), rows, n_words: 1 } }
    }

    /// For a terminal.
    #[must_use]
    pub fn for_terminal(&self) -> String {
        self.texts.for_terminal()
    }

    /// As Markdown.
    #[must_use]
    pub fn markdown(&self) -> String {
        self.texts.markdown()
    }
}
