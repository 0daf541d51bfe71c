//! `[motion]`: a scenario as a motion over time.

use ikiru_formats::Loaded;
use ikiru_rig::{Clip, JointId, Pose, Rig};
use ikiru_solve::{
    MotionError, MotionProblem, MotionWorkspace, PlannedMotion, Problem, Solver, Timeline, TimelineError,
    When,
};

use crate::error::{Error, ErrorKind};
use crate::objective::ScenarioObjective;
use crate::scenario::{Scenario, pose_of_table};
use crate::table::{Table, Value};
use crate::warning::Warning;

/// What `[motion]` asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionSettings {
    /// How many frames there are, and when.
    pub timeline: Timeline,
    /// Weights of speed, acceleration and jerk; 0.001 each by default.
    pub smoothness: [f64; 3],
    /// Whether the first frame is the scenario's start; it is by default.
    pub fixed_start: bool,
    /// The last frame, where it is given.
    pub end: Option<Pose>,
}

/// A scenario that is planned over time, ready to solve.
#[derive(Debug)]
pub struct MotionScenario {
    /// The file's name, as it was given.
    pub name: String,
    /// What the rig was read from; its rig is [`rig`](Self::rig).
    pub loaded: Loaded,
    /// The rig, with the scenario's limits and root.
    pub rig: Rig,
    /// The terms over time, smoothness, and frames that are given.
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
    /// Plans from standing still at the start.
    pub fn plan(&self, workspace: &mut MotionWorkspace) -> PlannedMotion {
        self.solver.plan(&self.motion, &self.still(), workspace)
    }

    /// A clip that stands still at the start: the guess of a cold plan.
    #[must_use]
    #[expect(clippy::expect_used, reason = "one pose at one time is always a clip")]
    pub fn still(&self) -> Clip {
        Clip::new("motion", vec![0.0], vec![self.start.clone()]).expect("one pose at 0 s")
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
        let when: Vec<When> = self.objectives.iter().map(|o| o.when).collect();
        let wrong = |e: MotionError| Error::new(&self.name, None, ErrorKind::Motion(e));
        let motion = build(self.problem, &settings, &self.start, &when).map_err(wrong)?;
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
    when: &[When],
) -> Result<MotionProblem, MotionError> {
    let mut motion = MotionProblem::from_problem(problem, settings.timeline, when)?;
    motion.set_smoothness(settings.smoothness)?;
    if settings.fixed_start {
        motion.fix_start(start)?;
    }
    motion.fix_end(settings.end.as_ref())?;
    Ok(motion)
}

const LENGTH: &str = "'duration_secs' (with 'rate' in frames a second, 30 by default) or 'points'";

/// Reads `[motion]`, if it is there. An end pose has the joints that it does not name as the start has them.
pub(crate) fn read(
    rig: &Rig,
    scenario: &Table<'_>,
    start: &Pose,
    warnings: &mut Vec<Warning>,
) -> Result<Option<MotionSettings>, Error> {
    let Some(table) = scenario.table("motion")? else { return Ok(None) };
    table.only(&["duration_secs", "rate", "points", "smoothness", "fixed_start", "end"])?;
    let timeline = timeline(&table)?;
    let smoothness = match table.get("smoothness") {
        Some(value) => {
            let weights = value.numbers::<3>("three weights, of speed, acceleration and jerk")?;
            if weights.iter().any(|w| *w < 0.0) {
                return Err(value.error(ErrorKind::Motion(MotionError::Smoothness(weights))));
            }
            weights
        }
        None => [0.001; 3],
    };
    let fixed_start = table.get("fixed_start").map_or(Ok(true), |v| v.truth())?;
    let end = match table.table("end")? {
        Some(end) => Some(pose_of_table(rig, &end, start.clone(), "[motion.end]", warnings)?),
        None => None,
    };
    if end.is_some() && fixed_start && timeline.n_frames() == 2 {
        let kind = MotionError::GivenFrames { given: 1, side: "end", n_frames: 2, taken: 1 };
        return Err(table.error(ErrorKind::Motion(kind)));
    }
    Ok(Some(MotionSettings { timeline, smoothness, fixed_start, end }))
}

fn timeline(table: &Table<'_>) -> Result<Timeline, Error> {
    match (table.get("duration_secs"), table.get("rate"), table.get("points")) {
        (Some(duration), rate, None) => {
            let hertz =
                rate.map_or(Ok(30.0), |r| r.number_that(|n| n > 0.0, "a number of frames a second above 0"))?;
            Timeline::seconds(duration.number()?, hertz).map_err(|e| wrong(&duration, e))
        }
        (None, None, Some(points)) => {
            let n = points.count(0, "how many points lie between the first and the last")?;
            Timeline::points(n).map_err(|e| wrong(&points, e))
        }
        _ => {
            let found = table.present(&["duration_secs", "rate", "points"]);
            Err(table.error(ErrorKind::Alternatives {
                place: "[motion]".to_owned(),
                found,
                expected: LENGTH,
            }))
        }
    }
}

fn wrong(value: &Value<'_>, error: TimelineError) -> Error {
    value.error(ErrorKind::Motion(MotionError::Timeline(error)))
}

/// When an objective holds: `at`, or `from` and `to`; the last frame by default.
pub(crate) fn when(table: &Table<'_>, timeline: Option<&Timeline>) -> Result<When, Error> {
    let keys = ["at", "from", "to"].map(|key| table.get(key));
    let Some(first) = keys.iter().flatten().next() else { return Ok(When::End) };
    let Some(timeline) = timeline else {
        return Err(first.key_error(ErrorKind::NeedsMotion(first.key.clone())));
    };
    let secs = |value: &Value<'_>| -> Result<f64, Error> {
        let secs = value.number()?;
        let on_line = timeline.frame_at(secs);
        on_line.map_err(|e| wrong(value, e))?;
        Ok(secs)
    };
    match &keys {
        [Some(at), None, None] => Ok(When::At(secs(at)?)),
        [None, Some(from), Some(to)] => {
            let (from_secs, to_secs) = (secs(from)?, secs(to)?);
            if from_secs > to_secs {
                let (what, min, max) = ("time of a span in seconds", from_secs, to_secs);
                return Err(to.error(ErrorKind::Order { what, min, max }));
            }
            Ok(When::Span { from: from_secs, to: to_secs })
        }
        _ => {
            let found = table.present(&["at", "from", "to"]);
            let expected = "'at', or both 'from' and 'to', in seconds";
            Err(table.error(ErrorKind::Alternatives { place: "the objective".to_owned(), found, expected }))
        }
    }
}
