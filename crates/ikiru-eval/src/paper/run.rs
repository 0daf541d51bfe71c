//! Solving every target with every method, timed.

use std::time::Instant;

use glam::DVec3;
use ikiru_scenario::Scenario;
use ikiru_solve::Solver;
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
    /// The pose: collar, shoulder, elbow, wrist, each about x, y, z, radians.
    pub angles: Vec<f64>,
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
    let n_measured = set.points.len().saturating_sub(settings.warmup);
    if n_measured == 0 {
        let (found, warmup) = (set.points.len(), settings.warmup);
        return Err(Error::TooFewTargets { name: set.name.clone(), found, warmup });
    }
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
                let angles =
                    scenario.active.iter().flat_map(|j| &pose.coords()[scenario.rig.coords_of(*j)]).copied();
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
                    angles: angles.collect(),
                    set: set.name.clone(),
                });
            }
        }
    }
    Ok(rows)
}

/// Moves the target of a task, which is its first objective.
pub(crate) fn set_target(scenario: &mut Scenario, target: DVec3) {
    let moved = scenario.set_target(0, target);
    debug_assert!(moved.is_ok(), "the first objective of both tasks is a position");
}
