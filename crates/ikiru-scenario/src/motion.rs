//! `[motion]`: what a scenario asks of a motion over time.

use std::path::Path;

use ikiru_rig::{JointId, Pose, RateLimit};
use ikiru_solve::{MotionError, Problem, Timeline, TimelineError, When};
use serde::Serialize;

use crate::at::At;
use crate::axes::Axes;
use crate::error::{Error, ErrorKind};
use crate::key::Key;
use crate::keys::{TABLE, as_table, is_false, is_plain_zero, is_true};
use crate::objective::ScenarioObjective;
use crate::rate_limits::{self, RateKeys};
use crate::start::GivenPose;
use crate::table::Table;
use crate::values::{name_of, number_that};
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

/// What `[motion]` of a scenario has.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionKeys {
    /// How long it is and how many samples it has: `duration_secs` and `rate`, or `points`.
    #[serde(flatten)]
    pub length: LengthKeys,
    /// Weights of speed, acceleration and jerk, each at least 0; 0.001 each by default.
    #[serde(skip_serializing_if = "is_default_smoothness")]
    pub smoothness: [f64; 3],
    /// The weight of even spacing, at least 0; 0 by default.
    #[serde(skip_serializing_if = "is_plain_zero")]
    pub even_spacing: f64,
    /// Whether the body stands still before the first sample; false by default.
    #[serde(skip_serializing_if = "is_false")]
    pub start_at_rest: bool,
    /// Whether the body stands still after the last sample; false by default.
    #[serde(skip_serializing_if = "is_false")]
    pub end_at_rest: bool,
    /// Whether the first sample is the scenario's start; true by default.
    #[serde(skip_serializing_if = "is_true")]
    pub fixed_start: bool,
    /// Whether the motion may take longer, to keep its limits on rates; false by default.
    #[serde(skip_serializing_if = "is_false")]
    pub free_duration: bool,
    /// Limits on rates of every active joint.
    #[serde(flatten)]
    pub rates: RateKeys,
    /// Limits on rates of one joint each, by name or humanoid role: `[motion.limits.NAME]`.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "as_table")]
    pub limits: Vec<(String, RateKeys)>,
    /// The last sample, where it is given: `[motion.end]`. What it does not name is as in the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<GivenPose>,
}

/// How long a motion is and how many samples it has.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum LengthKeys {
    /// So many seconds.
    Seconds {
        /// `duration_secs`
        duration_secs: f64,
        /// `rate`: samples a second; 30 by default.
        #[serde(skip_serializing_if = "is_default_rate")]
        rate: f64,
    },
    /// `points`: so many samples between the first and the last, a second apart.
    Points {
        /// How many.
        points: u32,
    },
}

const DURATION_SECS: Key = Key::new("duration_secs", "seconds, above 0", "How long it takes.").one_of();
const RATE: Key =
    Key::new("rate", "a number of samples a second above 0", "Samples a second, beside `duration_secs`.")
        .or("30");
const POINTS: Key = Key::new(
    "points",
    "how many points lie between the first and the last",
    "So many samples between the first and the last, a second apart, as in the paper.",
)
.one_of();
const SMOOTHNESS: Key = Key::new(
    "smoothness",
    "three weights, of speed, acceleration and jerk",
    "Each at least 0, on squared differences from sample to sample.",
)
.or("[0.001, 0.001, 0.001]");
const EVEN_SPACING: Key =
    Key::new("even_spacing", "a weight of at least 0", "Of steps that are equally long.").or("0");
const TRUTHS: [Key; 4] = [
    Key::new("start_at_rest", "true or false", "Whether the body stands still before the first sample.")
        .or("false"),
    Key::new("end_at_rest", "true or false", "Whether it stands still after the last one.").or("false"),
    Key::new("fixed_start", "true or false", "Whether the first sample is the start.").or("true"),
    Key::new(
        "free_duration",
        "true or false",
        "Whether it may take longer where limits on rates ask for that.",
    )
    .or("false"),
];
const END: Key = Key::new(
    "end",
    "a table of joints, [motion.end], or the path of a pose's .json file",
    "The last sample, given as `[start]` is; what it does not name is as in the start.",
)
.or_as("found by the plan");
const LIMITS: Key = Key::new(
    "limits",
    TABLE,
    "`[motion.limits.NAME]`: the keys below for one joint, in the place of those for every active one.",
)
.or_as("none");
/// The keys of `[motion]` but those of [`rate_limits`].
pub(crate) const KEYS: [Key; 11] = [
    DURATION_SECS,
    RATE,
    POINTS,
    SMOOTHNESS,
    EVEN_SPACING,
    TRUTHS[0],
    TRUTHS[1],
    TRUTHS[2],
    TRUTHS[3],
    END,
    LIMITS,
];
const DEFAULT_RATE_HZ: f64 = 30.0;
const DEFAULT_SMOOTHNESS: [f64; 3] = [0.001; 3];

impl MotionKeys {
    /// A motion of some length, with the default of everything else.
    #[must_use]
    pub fn new(length: LengthKeys) -> Self {
        Self {
            length,
            smoothness: DEFAULT_SMOOTHNESS,
            even_spacing: 0.0,
            start_at_rest: false,
            end_at_rest: false,
            fixed_start: true,
            free_duration: false,
            rates: RateKeys::default(),
            limits: Vec::new(),
            end: None,
        }
    }

    pub(crate) fn read(table: &Table<'_>) -> Result<Self, Error> {
        table.only(&[&KEYS[..], &rate_limits::KEYS].concat())?;
        let mut motion = Self::new(LengthKeys::read(table)?);
        if let Some(value) = table.get(&SMOOTHNESS) {
            motion.smoothness = value.numbers()?;
        }
        if let Some(value) = table.get(&EVEN_SPACING) {
            motion.even_spacing = value.number()?;
        }
        let truths = [
            &mut motion.start_at_rest,
            &mut motion.end_at_rest,
            &mut motion.fixed_start,
            &mut motion.free_duration,
        ];
        for (key, truth) in TRUTHS.iter().zip(truths) {
            if let Some(value) = table.get(key) {
                *truth = value.truth()?;
            }
        }
        motion.rates = RateKeys::read(table)?;
        for value in table.table(&LIMITS)?.iter().flat_map(|limits| limits.entries(TABLE)) {
            let table = value.table()?;
            table.only(&rate_limits::KEYS)?;
            motion.limits.push((value.key.clone(), RateKeys::read(&table)?));
        }
        motion.end = table.get(&END).map(|end| GivenPose::read(&end)).transpose()?;
        Ok(motion)
    }

    /// What it asks for. `at` is the table `[motion]`.
    pub(crate) fn settings(
        &self,
        active: &[JointId],
        start: &Pose,
        folder: &Path,
        axes: Axes,
        at: &At<'_>,
        warnings: &mut Vec<Warning>,
    ) -> Result<MotionSettings, Error> {
        let timeline = self.length.timeline(at)?;
        if self.smoothness.iter().any(|weight| *weight < 0.0) {
            let kind = ErrorKind::Motion(MotionError::Smoothness(self.smoothness));
            return Err(at.key("smoothness").error(kind));
        }
        let at_spacing = at.key("even_spacing");
        number_that(self.even_spacing, &at_spacing, |w| w >= 0.0, EVEN_SPACING.takes)?;
        let end = match &self.end {
            Some(end) => Some(end.pose(start, ScenarioPose::End, folder, axes, &at.key("end"), warnings)?),
            None => None,
        };
        if end.is_some() && self.fixed_start && timeline.n_samples() == 2 {
            let kind = MotionError::GivenSamples { given: 1, side: "end", n_samples: 2, taken: 1 };
            return Err(at.error(ErrorKind::Motion(kind)));
        }
        let rate_limits = rate_limits::rate_limits(start.rig(), active, &self.rates, &self.limits, at)?;
        if self.free_duration && rate_limits.is_empty() {
            let (place, found) =
                ("[motion] with 'free_duration'".to_owned(), "no limits on rates".to_owned());
            let expected =
                "'max_speed_deg', 'max_acceleration_deg', 'max_speed' or 'max_acceleration' beside it";
            let kind = ErrorKind::Alternatives { place, found, expected };
            return Err(at.key("free_duration").error(kind));
        }
        Ok(MotionSettings {
            timeline,
            smoothness: self.smoothness,
            even_spacing: self.even_spacing,
            at_rest: [self.start_at_rest, self.end_at_rest],
            fixed_start: self.fixed_start,
            end,
            rate_limits,
            free_duration: self.free_duration,
        })
    }
}

impl LengthKeys {
    fn read(table: &Table<'_>) -> Result<Self, Error> {
        match (table.get(&DURATION_SECS), table.get(&RATE), table.get(&POINTS)) {
            (Some(duration), rate, None) => Ok(Self::Seconds {
                duration_secs: duration.number()?,
                rate: rate.map_or(Ok(DEFAULT_RATE_HZ), |rate| rate.number())?,
            }),
            (None, None, Some(points)) => Ok(Self::Points { points: points.count()? }),
            _ => Err(table.alternatives(
                &[DURATION_SECS, RATE, POINTS],
                "'duration_secs' (with 'rate' in samples a second, 30 by default) or 'points'",
            )),
        }
    }

    fn timeline(self, at: &At<'_>) -> Result<Timeline, Error> {
        let wrong = |key: &str, error: TimelineError| {
            at.key(key).error(ErrorKind::Motion(MotionError::Timeline(error)))
        };
        match self {
            Self::Seconds { duration_secs, rate } => {
                number_that(rate, &at.key("rate"), |n| n > 0.0, RATE.takes)?;
                Timeline::seconds(duration_secs, rate).map_err(|e| wrong("duration_secs", e))
            }
            Self::Points { points } => Timeline::points(points as usize).map_err(|e| wrong("points", e)),
        }
    }
}

fn is_default_smoothness(weights: &[f64; 3]) -> bool {
    *weights == DEFAULT_SMOOTHNESS
}

fn is_default_rate(rate_hz: &f64) -> bool {
    *rate_hz == DEFAULT_RATE_HZ
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
        let Ok(frame) = start.frame(joint) else { continue };
        let target = objective.path.as_ref().map_or(reach.target, |path| path.at(0.0));
        let distance = frame.point(reach.point).distance(target);
        if distance > objective.tolerance.metres {
            let joint = name_of(start.rig(), joint).to_owned();
            warnings.push(Warning::AwayAtStart { objective: idx + 1, kind: objective.kind, joint, distance });
        }
    }
}
