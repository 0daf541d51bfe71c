//! What can be wrong with a motion problem.

use ikiru_rig::{ClipError, ForeignJoint, ShapeDifference};

use crate::problem::TimelineError;

/// Why something cannot be part of a motion problem.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// A time that is not on the timeline.
    #[error(transparent)]
    Timeline(#[from] TimelineError),
    /// Given samples that leave nothing to plan, or meet each other.
    #[error(
        "{given} samples are given at the {side}, but the timeline has {n_samples} in all, {taken} of them given already"
    )]
    GivenSamples {
        /// How many samples are given.
        given: usize,
        /// `start` or `end`.
        side: &'static str,
        /// How many samples there are.
        n_samples: usize,
        /// How many of them are given at the other side.
        taken: usize,
    },
    /// The id of a joint that the rig does not have.
    #[error(transparent)]
    NoJoint(#[from] ForeignJoint),
    /// A pose of another rig.
    #[error("a pose belongs to another rig than the motion")]
    OtherRig,
    /// Another rig whose joints have other names, parents or rest transforms.
    #[error("the other rig has another shape: {0}")]
    Shape(#[from] ShapeDifference),
    /// Another rig on which the numbers of given poses mean something else.
    #[error("joint '{joint}' moves otherwise on the other rig, where the poses that are given do not fit")]
    GivenMoves {
        /// Name of the joint.
        joint: String,
    },
    /// A pose that is not usable.
    #[error("a given pose has numbers that are not finite, or quaternions that are not of unit length")]
    Pose,
    /// Weights of smoothness that are none.
    #[error("weights of smoothness are finite and at least 0, not {0:?}")]
    Smoothness([f64; 3]),
    /// A weight of even spacing that is none.
    #[error("the weight of even spacing is finite and at least 0, not {0}")]
    EvenSpacing(f64),
    /// A limit on speed or acceleration that means nothing for the rig.
    #[error(transparent)]
    RateLimit(#[from] ClipError),
    /// The id of a term of another problem.
    #[error("the motion has no such term: its id is of another motion, or it was removed")]
    Term,
    /// Two samples of a moving objective that read different joints.
    #[error(
        "a moving objective reads the same joints, motions and parts at every time; at {0} s it does not"
    )]
    Changes(f64),
}
