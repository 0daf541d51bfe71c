//! Why a pose was not changed.

use crate::foreign::ForeignJoint;

/// Why a pose was not changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// The joint does not have what was set.
    #[error("joint '{joint}' is {motion}: it has no {wanted} to set")]
    Kind {
        /// Name of the joint.
        joint: String,
        /// How it moves.
        motion: &'static str,
        /// What was to be set.
        wanted: &'static str,
    },
    /// A number that is not finite, or a quaternion of length 0.
    #[error("joint '{0}': the value must be finite, a rotation not of length 0")]
    Value(String),
    /// The id of a joint of another rig.
    #[error(transparent)]
    NoJoint(#[from] ForeignJoint),
    /// The root of the body is to translate, and does not float.
    #[error("the rig's root does not float: a root that does comes of RigBuilder::free_root")]
    NoFloatingRoot,
    /// The wrong number of coordinates.
    #[error("the rig's poses have {expected} numbers, not {found}")]
    Length {
        /// How many there were.
        found: usize,
        /// How many the rig has.
        expected: usize,
    },
}
