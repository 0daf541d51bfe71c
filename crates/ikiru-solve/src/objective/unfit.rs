//! What is not usable about an objective, and what it warns of: as data that ends the sentence "the objective …".

use std::fmt;

use ikiru_rig::JointId;

use crate::objective::{MOST_EARLIER, MOST_PARTS, MOST_ROWS};

/// What is not usable about an objective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unfit {
    /// What is wrong.
    pub reason: UnfitReason,
    /// The joint that it is about, where it is about one.
    pub joint: Option<JointId>,
}

impl Unfit {
    /// The reason, about a joint.
    #[must_use]
    pub fn of_joint(reason: impl Into<UnfitReason>, joint: JointId) -> Self {
        Self { reason: reason.into(), joint: Some(joint) }
    }
}

impl From<UnfitReason> for Unfit {
    fn from(reason: UnfitReason) -> Self {
        Self { reason, joint: None }
    }
}

impl From<&'static str> for Unfit {
    fn from(reason: &'static str) -> Self {
        UnfitReason::Own(reason).into()
    }
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.reason.fmt(f)
    }
}

/// Why an objective is not usable. Its text ends the sentence "the objective …", as in "has a target that is not finite".
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UnfitReason {
    /// It names a joint that the rig does not have.
    #[error("names a joint that the rig does not have")]
    NoJoint,
    /// It reads the motion of a joint that follows another.
    #[error("reads the motion of a joint that follows another: name its leader")]
    ReadsFollower,
    /// It has more than [`MOST_PARTS`] parts.
    #[error("has more parts than reports have room for: at most {MOST_PARTS}")]
    Parts,
    /// A part that is not separable has more than [`MOST_ROWS`] rows.
    #[error("has a part of more than {MOST_ROWS} rows")]
    Rows,
    /// It reads more than [`MOST_EARLIER`] earlier samples.
    #[error("reads more than {MOST_EARLIER} earlier samples")]
    Earlier,
    /// A point of a joint is not finite.
    #[error("has a point that is not finite")]
    Point,
    /// A target is not finite.
    #[error("has a target that is not finite")]
    Target,
    /// A direction to turn to is none.
    #[error("has a target direction that is not finite, or of length 0")]
    TargetDirection,
    /// An axis is none.
    #[error("has an axis that is not finite, or of length 0")]
    Axis,
    /// A rotation is none.
    #[error("has a rotation that is not finite, or of length 0")]
    Rotation,
    /// A length is not finite.
    #[error("has a length that is not finite")]
    Length,
    /// An angle is not finite.
    #[error("has an angle that is not finite")]
    Angle,
    /// A distance is none.
    #[error("has a distance that is not a finite number of at least 0")]
    Distance,
    /// A pose is not finite.
    #[error("has a pose that is not finite")]
    Pose,
    /// A pose is of another rig than the problem.
    #[error("has a pose of another rig than the problem")]
    PoseOfOtherRig,
    /// The weight of the term is none.
    #[error("has a weight that is not a finite number of at least 0")]
    Weight,
    /// The tolerance of the term is none.
    #[error("has a tolerance that is not a number of at least 0")]
    Tolerance,
    /// The loss of the term has a width that is none.
    #[error("has a Huber loss whose width is not finite and positive")]
    HuberWidth,
    /// A target of a known rotation that it does not have.
    #[error("has no target {idx} (counted from 0): it has {n_targets}")]
    TargetIndex {
        /// Which was asked for.
        idx: usize,
        /// How many there are.
        n_targets: usize,
    },
    /// A known rotation of a joint that does not move.
    #[error("gives an angle to a joint that does not move")]
    GivesToFixed,
    /// A known rotation that is not the one value of a hinge or slider.
    #[error("gives a joint what its motion does not have: a hinge or slider takes one value")]
    TakesValue,
    /// A known rotation that is not the three angles of an Euler joint.
    #[error("gives a joint what its motion does not have: an Euler joint takes three angles")]
    TakesEuler,
    /// A known rotation that is not the rotation of a ball or free joint.
    #[error("gives a joint what its motion does not have: a ball and a free joint take a rotation")]
    TakesRotation,
    /// A coupling of no angle.
    #[error("couples no angle")]
    CouplesNothing,
    /// A coupling of a joint that follows another.
    #[error("couples a joint that follows another: name its leader")]
    CouplesFollower,
    /// A coupling of a joint that does not move.
    #[error("couples a joint that does not move")]
    CouplesFixed,
    /// A coupling of angles with offsets.
    #[error("adds angles and offsets")]
    CouplesUnits,
    /// A coupling of an Euler joint about an axis that is none of its three.
    #[error("couples an angle of an Euler joint: its axis is [1, 0, 0], [0, 1, 0] or [0, 0, 1]")]
    CouplesEuler,
    /// A coupling of a ball of which nothing says about what it twists.
    #[error(
        "couples the swing of a ball that has no cone and not exactly one child to say about what it twists"
    )]
    CouplesSwing,
    /// A coupling that was made for another rig.
    #[error("couples an angle that the joint does not have: it was made for another rig")]
    CouplesOtherRig,
    /// A coupling that gives an axis to a joint with its own.
    #[error("gives an axis to a hinge or slider, which has its own")]
    OwnAxis,
    /// A coupling that gives no axis to a joint that needs one.
    #[error("leaves out the axis of a joint that turns about several")]
    NoAxis,
    /// A coupling with numbers that are not finite.
    #[error("has a factor or bound that is not finite")]
    Factor,
    /// A centre of mass of nothing.
    #[error("has no masses")]
    NoMasses,
    /// A centre of mass with a mass that is none.
    #[error("has a mass that is not a finite number above 0")]
    Mass,
    /// A centre of mass over an area that knows no up.
    #[error("has no direction that is up")]
    NoUp,
    /// A centre of mass over an area whose numbers are not usable.
    #[error("has a margin or points that are not finite, or a margin below 0")]
    Area,
    /// A centre of mass over an area that is a line or a point.
    #[error("has an area without extent: three points that are not on one line are needed")]
    NoArea,
    /// A centre of mass over an area that is smaller than the margin.
    #[error("has a margin that leaves nothing of its area")]
    NoRoom,
    /// What an objective of a user's own says, in its words.
    #[error("{0}")]
    Own(&'static str),
}

impl From<&'static str> for UnfitReason {
    fn from(reason: &'static str) -> Self {
        Self::Own(reason)
    }
}

/// What an objective warns of at a pose. Its text ends the sentence "the objective …".
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TermWarning {
    /// A joint looks at its own origin, which no turn brings in view.
    #[error("looks at a point in the joint's own origin: it has no direction to turn to")]
    LooksAtItself,
    /// What an objective of a user's own says, in its words.
    #[error("{0}")]
    Own(&'static str),
}

impl From<&'static str> for TermWarning {
    fn from(reason: &'static str) -> Self {
        Self::Own(reason)
    }
}

/// As its text.
#[cfg(feature = "serde")]
impl serde::Serialize for TermWarning {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_data_with_a_text() {
        let joint = JointId::from_index(3);
        let own = Unfit::of_joint("has no taste", joint);
        assert_eq!((own.reason, own.joint), (UnfitReason::Own("has no taste"), Some(joint)));
        assert_eq!(own.to_string(), "has no taste");
        assert_eq!(Unfit::from("has no taste"), Unfit { joint: None, ..own });
        let texts = [
            (UnfitReason::Parts, "has more parts than reports have room for: at most 4"),
            (UnfitReason::Rows, "has a part of more than 1024 rows"),
            (UnfitReason::Earlier, "reads more than 3 earlier samples"),
            (UnfitReason::Target, "has a target that is not finite"),
        ];
        for (reason, text) in texts {
            assert_eq!(Unfit::from(reason).to_string(), text);
        }
        assert_eq!(TermWarning::from("is bored"), TermWarning::Own("is bored"));
        assert!(TermWarning::LooksAtItself.to_string().starts_with("looks at a point"));
    }
}
