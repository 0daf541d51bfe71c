//! A scenario as a motion over time, ready to plan.

use ikiru_formats::Loaded;
use ikiru_rig::{Clip, JointId, Pose, Rig};
use ikiru_solve::{MotionError, MotionProblem, Problem, Solver, When};

use crate::error::{Error, ErrorKind};
use crate::motion::MotionSettings;
use crate::objective::ScenarioObjective;
use crate::scenario::Scenario;
use crate::warning::{Warning, out_of_hand};

/// A scenario that is planned over time, ready to solve.
#[derive(Debug)]
pub struct MotionScenario {
    /// The file's name, as it was given.
    pub name: String,
    /// What the rig was read from; its rig is [`rig`](Self::rig).
    pub loaded: Loaded,
    /// The rig, with the scenario's limits and root.
    pub rig: Rig,
    /// The terms over time, smoothness, and samples that are given.
    pub motion: MotionProblem,
    /// The solver, with the scenario's method and stopping rules.
    pub solver: Solver,
    /// Where the motion starts, inside the limits.
    pub start: Pose,
    /// The joints that may move, parents first.
    pub active: Vec<JointId>,
    /// The objectives, in the order of the text and of the motion's terms.
    pub objectives: Vec<ScenarioObjective>,
    /// What is odd without being wrong.
    pub warnings: Vec<Warning>,
}

impl MotionScenario {
    /// The joint of an objective that no active joint moves, if there is one: nothing can then change its residual.
    #[must_use]
    pub fn out_of_hand(&self, objective: usize) -> Option<&str> {
        out_of_hand(&self.warnings, objective)
    }

    /// A clip that stands still at the start: the guess of a cold plan.
    #[must_use]
    pub fn still(&self) -> Clip {
        Clip::still(self.start.clone()).with_name("motion")
    }
}

impl Scenario {
    /// The scenario as a motion.
    ///
    /// # Errors
    /// A scenario without `[motion]`.
    pub fn into_motion(self) -> Result<MotionScenario, Error> {
        let Some(settings) = self.motion.clone() else {
            return Err(Error::new(&self.name, None, ErrorKind::NoMotion));
        };
        let wrong = |e: MotionError| Error::new(&self.name, None, ErrorKind::Motion(e));
        let motion = build(self.problem, &settings, &self.start, &self.objectives).map_err(wrong)?;
        Ok(MotionScenario {
            name: self.name,
            loaded: self.loaded,
            rig: self.rig,
            motion,
            solver: self.solver,
            start: self.start,
            active: self.active,
            objectives: self.objectives,
            warnings: self.warnings,
        })
    }
}

fn build(
    problem: Problem,
    settings: &MotionSettings,
    start: &Pose,
    objectives: &[ScenarioObjective],
) -> Result<MotionProblem, MotionError> {
    let when: Vec<When> = objectives.iter().map(|o| o.when).collect();
    let mut motion = MotionProblem::from_problem(problem, settings.timeline, &when)?;
    for objective in objectives {
        let Some(path) = &objective.path else { continue };
        objective.term.follow(&mut motion, path)?;
    }
    motion.set_smoothness(settings.smoothness)?;
    motion.set_even_spacing(settings.even_spacing)?;
    let [start_at_rest, end_at_rest] = settings.at_rest;
    motion.set_at_rest(start_at_rest, end_at_rest);
    if settings.fixed_start {
        motion.fix_start(start)?;
    }
    motion.fix_end(settings.end.as_ref())?;
    motion.set_rate_limits(&settings.rate_limits)?;
    motion.set_free_duration(settings.free_duration);
    Ok(motion)
}
