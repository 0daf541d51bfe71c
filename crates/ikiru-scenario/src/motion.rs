//! `[motion]`: a scenario as a motion over time.

use std::path::Path;

use ikiru_formats::Loaded;
use ikiru_rig::{Clip, JointId, Pose, RateLimit, Rig};
use ikiru_solve::{MotionError, MotionProblem, Problem, Solver, Timeline, TimelineError, When};

use crate::axes::Axes;
use crate::error::{Error, ErrorKind};
use crate::objective::ScenarioObjective;
use crate::rate_limits;
use crate::scenario::{Scenario, out_of_hand};
use crate::start;
use crate::table::{Table, Value};
use crate::values::name_of;
use crate::warning::{ScenarioPose, Warning};

/// What `[motion]` asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionSettings {
    /// How many samples there are, and when.
    pub timeline: Timeline,
    /// Weights of speed, acceleration and jerk; 0.001 each by default.
    pub smoothness: [f64; 3],
    /// The weight of even spacing; 0 by default.
    pub even_spacing: f64,
    /// Whether the body stands still before the first and after the last sample; not by default.
    pub at_rest: [bool; 2],
    /// Whether the first sample is the scenario's start; it is by default.
    pub fixed_start: bool,
    /// The last sample, where it is given.
    pub end: Option<Pose>,
    /// The most that joints' speeds and accelerations may be.
    pub rate_limits: Vec<RateLimit>,
    /// Whether the motion may take longer, to keep those; false by default.
    pub free_duration: bool,
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
        let wrong = |e: MotionError| Error::new(&self.name, None, ErrorKind::JointMotion(e));
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

const LENGTH: &str = "'duration_secs' (with 'rate' in samples a second, 30 by default) or 'points'";

/// Reads `[motion]`, if it is there. An end pose has the joints that it does not name as the start has them.
pub(crate) fn read(
    active: &[JointId],
    scenario: &Table<'_>,
    start: &Pose,
    folder: &Path,
    axes: Axes,
    warnings: &mut Vec<Warning>,
) -> Result<Option<MotionSettings>, Error> {
    let Some(table) = scenario.table("motion")? else { return Ok(None) };
    let own = [
        "duration_secs",
        "rate",
        "points",
        "smoothness",
        "even_spacing",
        "start_at_rest",
        "end_at_rest",
        "fixed_start",
        "end",
        "free_duration",
        "limits",
    ];
    let keys: Vec<&'static str> = own.into_iter().chain(rate_limits::KEYS).collect();
    table.only(&keys)?;
    let timeline = timeline(&table)?;
    let smoothness = match table.get("smoothness") {
        Some(value) => {
            let weights = value.numbers::<3>("three weights, of speed, acceleration and jerk")?;
            if weights.iter().any(|w| *w < 0.0) {
                return Err(value.error(ErrorKind::JointMotion(MotionError::Smoothness(weights))));
            }
            weights
        }
        None => [0.001; 3],
    };
    let at_least_0 = "a weight of at least 0";
    let even_spacing =
        table.get("even_spacing").map_or(Ok(0.0), |v| v.number_that(|w| w >= 0.0, at_least_0))?;
    let truth = |key: &str| table.get(key).map_or(Ok(false), |v| v.truth());
    let at_rest = [truth("start_at_rest")?, truth("end_at_rest")?];
    let fixed_start = table.get("fixed_start").map_or(Ok(true), |v| v.truth())?;
    let end = match table.get("end") {
        Some(end) => Some(start::given(&end, start, ScenarioPose::End, folder, axes, warnings)?),
        None => None,
    };
    if end.is_some() && fixed_start && timeline.n_samples() == 2 {
        let kind = MotionError::GivenSamples { given: 1, side: "end", n_samples: 2, taken: 1 };
        return Err(table.error(ErrorKind::JointMotion(kind)));
    }
    let rate_limits = rate_limits::read(start.rig(), active, &table)?;
    let mut free_duration = false;
    if let Some(value) = table.get("free_duration") {
        free_duration = value.truth()?;
        if free_duration && rate_limits.is_empty() {
            let (place, found) =
                ("[motion] with 'free_duration'".to_owned(), "no limits on rates".to_owned());
            let expected =
                "'max_speed_deg', 'max_acceleration_deg', 'max_speed' or 'max_acceleration' beside it";
            return Err(value.error(ErrorKind::Alternatives { place, found, expected }));
        }
    }
    Ok(Some(MotionSettings {
        timeline,
        smoothness,
        even_spacing,
        at_rest,
        fixed_start,
        end,
        rate_limits,
        free_duration,
    }))
}

fn timeline(table: &Table<'_>) -> Result<Timeline, Error> {
    match (table.get("duration_secs"), table.get("rate"), table.get("points")) {
        (Some(duration), rate, None) => {
            let hertz = rate
                .map_or(Ok(30.0), |r| r.number_that(|n| n > 0.0, "a number of samples a second above 0"))?;
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
    value.error(ErrorKind::JointMotion(MotionError::Timeline(error)))
}

/// The first sample is given: a target that is wanted from there on, and is elsewhere, leaves one sample to get there.
pub(crate) fn warn_of_what_begins_elsewhere(
    settings: &MotionSettings,
    start: &Pose,
    problem: &Problem,
    objectives: &[ScenarioObjective],
    warnings: &mut Vec<Warning>,
) {
    let begins = |when: When| {
        when.samples(&settings.timeline).is_ok_and(|samples| samples.start == 0 && samples.len() > 1)
    };
    for (idx, (objective, term)) in objectives.iter().zip(problem.terms()).enumerate() {
        if !(settings.fixed_start && begins(objective.when)) {
            continue;
        }
        let Some(reach) = term.objective().reach() else { continue };
        let Some(joint) = objective.joint else { continue };
        let target = objective.path.as_ref().map_or(reach.target, |path| path.at(0.0));
        let frame = start.frame(joint);
        let point = frame.origin.value() + frame.rotation.quaternion() * reach.point;
        let distance = point.distance(target);
        if distance > objective.tolerance.metres {
            let joint = name_of(start.rig(), joint).to_owned();
            warnings.push(Warning::AwayAtStart { objective: idx + 1, kind: objective.kind, joint, distance });
        }
    }
}
