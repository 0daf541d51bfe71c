//! What makes a rig impossible, each reason by itself.

use crate::foreign::ForeignJoint;
use crate::humanoid::Role;

/// Why a rig cannot exist.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RigError {
    /// There is no joint.
    #[error("a rig needs at least one joint")]
    Empty,
    /// More joints than any real character has.
    #[error("{found} joints are more than the {most} that a rig may have")]
    TooMany {
        /// How many there were.
        found: usize,
        /// How many may be.
        most: usize,
    },
    /// Two joints share a name (or another name that they answer to).
    #[error("two joints are called '{0}'")]
    DuplicateName(String),
    /// Two joints share a role.
    #[error("joints '{0}' and '{1}' are both the humanoid bone '{2}'")]
    DuplicateRole(String, String, Role),
    /// A joint without a name.
    #[error("joint {0} has no name")]
    Unnamed(usize),
    /// The parent does not stand earlier in the list.
    #[error("joint '{0}' names a parent that does not stand before it in the list")]
    Parent(String),
    /// A rest transform that is not finite, or not a unit rotation.
    #[error("joint '{0}': the rest transform must be finite, its rotation a unit quaternion")]
    Rest(String),
    /// An axis that is not a finite unit vector.
    #[error("joint '{0}': the axis must be a finite unit vector, not {1:?}")]
    Axis(String, [f64; 3]),
    /// A range whose ends are not ordered, or not numbers.
    #[error("joint '{joint}': the range must go from a smaller to a larger value, not from {min} to {max}")]
    Range {
        /// The joint.
        joint: String,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// A follower that cannot follow.
    #[error("joint '{joint}' cannot follow another: {reason}")]
    Mimic {
        /// The joint.
        joint: String,
        /// What is in the way.
        reason: &'static str,
    },
    /// The id of a joint that the builder does not hold.
    #[error(transparent)]
    NoJoint(#[from] ForeignJoint),
    /// There is no joint that could float.
    #[error("no joint of this rig moves, so none can be a free root")]
    NoRoot,
    /// What moves hangs on different roots.
    #[error(
        "'{first}' and '{second}' hang on different roots, so no one joint carries all that moves and could \
         float: expected one joint above both"
    )]
    NoCommonRoot {
        /// A joint that moves.
        first: String,
        /// One that moves below another root.
        second: String,
    },
    /// What carries all that moves cannot float itself, and nothing above it could in its place.
    #[error(
        "joint '{joint}', which carries all that moves, is {motion}, which a floating joint cannot stand in \
         for: expected a fixed joint above it, a ball, or three angles without ranges"
    )]
    CannotFloat {
        /// Its name.
        joint: String,
        /// How it moves: `hinge`, `slider` or `euler`.
        motion: &'static str,
    },
}
