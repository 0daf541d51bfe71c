//! Solving every target with every method, timed.

use std::time::Instant;

use glam::DVec3;
use ikiru_rig::{Clip, JointId, Pose};
use ikiru_scenario::{Scenario, ScenarioObjective};
use ikiru_solve::objectives::Position;
use ikiru_solve::{MotionProblem, MotionWorkspace, Solver, Timeline};
use serde::Serialize;

use crate::error::Error;
use crate::paper::contenders::Contender;
use crate::paper::targets::TargetSet;
use crate::paper::task::Task;

/// How often and how long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Most restarts of `lm`; 400 by default.
    pub restarts: usize,
    /// How often the whole set is solved; 5 by default, as in the paper.
    pub runs: usize,
    /// How many targets at the head of a set are solved and left out; 10 by default, as in the paper.
    pub warmup: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { restarts: 400, runs: 5, warmup: 10 }
    }
}

/// Collar, shoulder, elbow, wrist, each about x, y, z, radians.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Angles {
    /// Of a pose.
    Pose(Vec<f64>),
    /// Of each frame of a trajectory.
    Frames(Vec<Vec<f64>>),
}

impl Angles {
    /// The angles of the pose, or of a trajectory's last frame.
    #[must_use]
    pub fn last(&self) -> &[f64] {
        match self {
            Self::Pose(angles) => angles,
            Self::Frames(frames) => frames.last().map_or(&[], |f| f),
        }
    }
}

/// One solve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The contender's name.
    pub method: &'static str,
    /// The task's name.
    pub objective: &'static str,
    /// Points between the first and the last of a trajectory; 0 for a pose.
    pub points: usize,
    /// Which run, counted from 0.
    pub run: usize,
    /// The target, metres.
    pub target: [f64; 3],
    /// Whether the cost is below 0.005; nothing else decides.
    pub success: bool,
    /// The paper's J of the pose.
    pub cost: f64,
    /// Iterations over all starts.
    pub iterations: usize,
    /// The solve alone, microseconds.
    pub time_us: f64,
    /// The pose, or all frames of the trajectory.
    pub angles: Angles,
    /// The set that the target is from.
    #[serde(skip)]
    pub set: String,
}

/// Solves a set with each contender, from the rest pose each time, and says after each solve that it is done.
///
/// # Errors
/// A set without a target behind the warm-up.
pub fn run(
    task: Task,
    scenario: &mut Scenario,
    set: &TargetSet,
    contenders: &[Contender],
    settings: &Settings,
    mut done: impl FnMut(),
) -> Result<Vec<Row>, Error> {
    let n_measured = measured(set, settings)?;
    let mut rows = Vec::with_capacity(settings.runs * contenders.len() * n_measured);
    for run in 0..settings.runs {
        for contender in contenders {
            scenario.solver = Solver::new(contender.options(settings.restarts));
            let mut workspace = scenario.workspace();
            let mut pose = scenario.start.clone();
            for (idx, &target) in set.points.iter().enumerate() {
                set_target(scenario, target);
                pose.clone_from(&scenario.start);
                let begin = Instant::now();
                let report = scenario.solve(&mut pose, &mut workspace);
                let time = begin.elapsed();
                let (success, cost, iterations) = (report.success, report.cost, report.iterations);
                done();
                if idx < settings.warmup {
                    continue;
                }
                let angles = Angles::Pose(angles_of(&scenario.active, &pose));
                rows.push(Row {
                    method: contender.name,
                    objective: task.name(),
                    points: 0,
                    run,
                    target: target.to_array(),
                    success,
                    cost,
                    iterations,
                    time_us: time.as_secs_f64() * 1e6,
                    angles,
                    set: set.name.clone(),
                });
            }
        }
    }
    Ok(rows)
}

fn angles_of(joints: &[JointId], pose: &Pose) -> Vec<f64> {
    joints.iter().flat_map(|j| &pose.coords()[pose.rig().coords_of(*j)]).copied().collect()
}

/// Plans a trajectory to each target by each method (the paper's tables 3 and 4): `points` between the first frame, which is held
/// at the rest pose, and the last, at which the objectives hold; smoothness of orders 1 to 3 with the authors' weight of 0.001
/// each. Every plan starts from standing still.
///
/// # Errors
/// A set without a target behind the warm-up, methods that know poses alone, or too many points.
pub fn run_trajectories(
    task: Task,
    points: usize,
    set: &TargetSet,
    contenders: &[Contender],
    settings: &Settings,
    mut done: impl FnMut(),
) -> Result<Vec<Row>, Error> {
    let n_measured = measured(set, settings)?;
    let scenario = task.scenario(None)?;
    let (start, active) = (scenario.start.clone(), scenario.active.clone());
    let reach = scenario.objectives.first().and_then(ScenarioObjective::id::<Position>);
    let reach = reach.ok_or(Error::Task("its first objective is not a position"))?;
    let timeline = Timeline::points(points).map_err(|e| Error::Motion(e.into()))?;
    let mut motion = MotionProblem::from_problem(scenario.problem, timeline, &[]).map_err(Error::Motion)?;
    motion.fix_start(&start).map_err(Error::Motion)?;
    let still = Clip::still(start);
    let mut rows = Vec::with_capacity(settings.runs * contenders.len() * n_measured);
    for run in 0..settings.runs {
        for contender in contenders {
            let solver = Solver::new(contender.options(settings.restarts));
            let mut workspace = MotionWorkspace::default();
            for (idx, &target) in set.points.iter().enumerate() {
                motion[reach].target = target;
                let begin = Instant::now();
                let planned = solver.plan(&motion, &still, &mut workspace);
                let time = begin.elapsed();
                done();
                if planned.report.invalid.is_some() {
                    return Err(Error::Contender(contender.name));
                }
                if idx < settings.warmup {
                    continue;
                }
                let frames = planned.clip.poses().iter().map(|pose| angles_of(&active, pose));
                rows.push(Row {
                    method: contender.name,
                    objective: task.name(),
                    points,
                    run,
                    target: target.to_array(),
                    success: planned.report.success,
                    cost: planned.report.cost,
                    iterations: planned.report.iterations,
                    time_us: time.as_secs_f64() * 1e6,
                    angles: Angles::Frames(frames.collect()),
                    set: set.name.clone(),
                });
            }
        }
    }
    Ok(rows)
}

/// How many targets there are behind the warm-up.
fn measured(set: &TargetSet, settings: &Settings) -> Result<usize, Error> {
    match set.points.len().saturating_sub(settings.warmup) {
        0 => {
            let (found, warmup) = (set.points.len(), settings.warmup);
            Err(Error::TooFewTargets { name: set.name.clone(), found, warmup })
        }
        n => Ok(n),
    }
}

/// Moves the target of a task, which is its first objective.
pub(crate) fn set_target(scenario: &mut Scenario, target: DVec3) {
    let moved = scenario.set_target(0, target);
    debug_assert!(moved.is_ok(), "the first objective of both tasks is a position");
}
