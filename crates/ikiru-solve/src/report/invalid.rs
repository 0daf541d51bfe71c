//! What of a solve's input is not usable, and why.

use crate::objective::Unfit;

/// What is not usable. Each text ends the sentence that its place begins: "the objective …", "the pose …", "the options: …".
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Invalid {
    /// A term by its position, and what is wrong with it.
    #[error("the objective at position {0} {1}")]
    Term(usize, InvalidTerm),
    /// The pose, or one that a motion is given or guessed to have, and what is wrong with it.
    #[error("a given pose {0}")]
    Pose(InvalidPose),
    /// The solver's options, and what is wrong with them.
    #[error("{0}")]
    Options(InvalidOptions),
}

/// What is wrong with a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidTerm {
    /// Its numbers are not usable, or do not fit the rig.
    #[error("{0}")]
    Unfit(Unfit),
    /// Its residual is not finite where a solve begins.
    #[error("gives a residual that is not finite")]
    NotFinite,
    /// The same at a sample of a motion.
    #[error("gives a residual that is not finite at one of its samples")]
    NotFiniteAtSample,
    /// It is hard, and the method knows wishes alone.
    #[error("is hard, which the methods ccd and fabrik do not know: use lm, or a wish of some weight")]
    Hard,
    /// It holds at given samples alone, whose poses do not meet it.
    #[error(
        "holds at given samples alone, and their poses do not meet it: \
         give it another time, or leave those samples free"
    )]
    Settled,
    /// It gave up while it was evaluated ([`Rows::fail`](crate::Rows::fail)), with this reason.
    #[error("{0}")]
    GaveUp(&'static str),
}

impl From<Unfit> for InvalidTerm {
    fn from(unfit: Unfit) -> Self {
        Self::Unfit(unfit)
    }
}

/// What is wrong with a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidPose {
    /// It is of another rig.
    #[error("belongs to another rig than the problem")]
    OtherRig,
    /// It has numbers that nothing can be computed with.
    #[error("has numbers that are not finite, or quaternions that are not of unit length")]
    NotFinite,
    /// What it costs is not finite, though every residual is.
    #[error("gives a cost that is not finite")]
    Cost,
    /// Poses that a motion is given differ in joints that may not move.
    #[error(
        "and the given samples differ in joints that are not active: make those active, or give them alike"
    )]
    GivenDiffer,
}

/// What is wrong with the options.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidOptions {
    /// `cost_below` is not finite.
    #[error("cost_below must be finite")]
    CostBelow,
    /// The settings of [`Method::Adam`](crate::Method::Adam).
    #[error("adam needs a positive rate and epsilon, and betas from 0 up to 1")]
    Adam,
    /// [`Method::Fabrik`](crate::Method::Fabrik), and nothing to reach for.
    #[error("fabrik reaches for points: it needs a position or pose objective of a weight above 0")]
    NothingToReach,
    /// A motion by a method that knows poses alone.
    #[error("plan motions by lm or adam: the other methods know poses alone")]
    MethodOfPoses,
    /// Limits on rates in a fixed time by a method that does not know them.
    #[error(
        "limits on speed and acceleration of a fixed duration need the method lm: \
         adam knows them only where the duration is free"
    )]
    RateLimitsNeedLm,
    /// A free duration with a history whose times have been.
    #[error(
        "a free duration gives all samples new times, those of a history too: \
         fix one first sample, or the duration"
    )]
    FreeDurationWithHistory,
}
