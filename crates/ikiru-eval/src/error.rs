//! What can go wrong before anything is measured, or when it is written.

use std::path::PathBuf;

/// Why an evaluation cannot run, or its results cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scenario of a task does not fit the rig.
    #[error(transparent)]
    Scenario(#[from] ikiru_scenario::Error),
    /// A rig cannot be read.
    #[error(transparent)]
    Rig(#[from] ikiru_formats::Error),
    /// A file cannot be read.
    #[error("{} cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("{} cannot be written: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A target set is not a list of points.
    #[error("{name}: expected a JSON list of points, [[x, y, z], …] in metres: {source}")]
    TargetSyntax {
        /// The set's file or name.
        name: String,
        /// What and where.
        source: serde_json::Error,
    },
    /// A target is not usable.
    #[error("{name}: target {idx} (counted from 0) is not finite")]
    Target {
        /// The set's file or name.
        name: String,
        /// Which.
        idx: usize,
    },
    /// There are no targets left to measure.
    #[error("{name} has {found} targets, of which {warmup} are warm-up: there is nothing to measure")]
    TooFewTargets {
        /// The set's file or name.
        name: String,
        /// How many there are.
        found: usize,
        /// How many of them are warm-up.
        warmup: usize,
    },
    /// Sampling kept too little.
    #[error(
        "of {sampled} sampled points only {kept} can be reached, and the protocol wants {wanted}: sample about {advice}"
    )]
    TooFewKept {
        /// Points that were sampled.
        sampled: usize,
        /// Points that a method solved.
        kept: usize,
        /// Points that a set has.
        wanted: usize,
        /// A number that should be enough.
        advice: usize,
    },
    /// A trajectory that cannot be.
    #[error(transparent)]
    Motion(ikiru_solve::MotionError),
    /// A scenario whose motion is refused before it is planned.
    #[error("{file}: {way} cannot be planned: {reason}")]
    Plan {
        /// The scenario's file.
        file: String,
        /// The way in which it was to be planned.
        way: &'static str,
        /// What is not usable.
        reason: String,
    },
    /// A method that knows poses alone.
    #[error("method '{0}' plans no trajectories: expected lm, lm-local or adam")]
    Contender(&'static str),
    /// A task that is not as it ships.
    #[error("the task cannot be run: {0}")]
    Task(&'static str),
    /// A name that nothing has.
    #[error("there is no {what} '{name}': expected one of {known}")]
    Unknown {
        /// What was named.
        what: &'static str,
        /// The name.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// The links of a robot's arm do not fit its rig.
    #[error("{robot}: {reason}")]
    Arm {
        /// The robot.
        robot: String,
        /// What does not fit, and what would.
        reason: String,
    },
    /// A body that cannot be led along a course.
    #[error("the course cannot be followed: {reason}")]
    Course {
        /// What does not fit.
        reason: String,
    },
    /// K-means failed.
    #[error("the sampled points cannot be clustered: {0}")]
    Clustering(String),
}

impl Error {
    pub(crate) fn course(error: impl std::error::Error) -> Self {
        Self::Course { reason: error.to_string() }
    }
}
