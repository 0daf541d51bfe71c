//! The id of a joint that a rig does not have.

/// A [`JointId`](crate::JointId) that is no joint of the rig it was used with: it was made by another, larger one, or by hand.
///
/// An id is a position, and does not know its rig. One that comes of another rig of at least as many joints cannot be
/// told from a right one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no joint {joint} among the {n_joints} of this rig: expected an id that comes from it")]
pub struct ForeignJoint {
    /// The position that the id stands for.
    pub joint: usize,
    /// How many joints the rig has.
    pub n_joints: usize,
}
