//! What acts on a pose: which limits, terms and distances keep a term from what it wants, and by how much.

use ikiru_rig::{JointId, JointMotion};

use crate::words::Unit;

/// Which of a joint's limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum LimitKind {
    /// The angle or offset of a hinge or slider.
    Value,
    /// The angle of an Euler joint about an axis (0 = x).
    Angle(usize),
    /// The swing cone of a ball.
    Swing,
    /// The twist range of a ball.
    Twist,
}

impl LimitKind {
    /// The limit of a coordinate that has a range.
    pub(crate) fn of_coordinate(motion: &JointMotion, idx: usize) -> Self {
        if let JointMotion::Euler { .. } = motion { Self::Angle(idx) } else { Self::Value }
    }
}

/// What a force comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum ForceBy {
    /// A joint limit, which the pose lies on.
    Limit {
        /// The joint.
        joint: JointId,
        /// Which of its limits.
        kind: LimitKind,
    },
    /// Another term, by position: a wish that pulls the other way, or a constraint.
    Term(usize),
    /// In a motion: its smoothness and even spacing.
    Smoothness,
    /// In a motion: limits on speed and acceleration.
    RateLimits,
    /// Nothing: no motion of the joints brings the term nearer.
    Reach {
        /// Whether that is so wherever the joints are: the target is further from where its chain begins than the links
        /// are long together, or nearer than they can be folded. Else it is so from here.
        is_proven: bool,
    },
}

/// A force that acts on a pose, or on one of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Force {
    /// The term that is not met, and that this keeps from what it wants; `None` for a limit or constraint that acts and
    /// is in the way of no such term.
    pub on: Option<usize>,
    /// What it comes from.
    pub by: ForceBy,
    /// How much of the term's pull it bears, above 0; those of one term add up to at most 1. Without a term it is the part of the pull
    /// of all wishes together.
    pub share: f64,
    /// How much the cost would fall for each `unit` by which a limit or the bound of a constraint gave way, or by which
    /// another wish were met less; of smoothness, the length of its gradient. Where the term itself is a
    /// constraint, "cost" is the squared way of the joints that it misses. Of [`Reach`](ForceBy::Reach), how far out of
    /// reach the target is, which is proven or else what is missed.
    pub amount: f64,
    /// The unit of what gives way, or is out of reach.
    pub unit: Unit,
    /// In a motion, when: at the sample at which the term misses the most, or at which this acts the strongest where it is in
    /// nobody's way. `None` for a pose.
    pub secs: Option<f64>,
}

impl Force {
    /// The term that it proves to be out of reach.
    pub(crate) fn proves(&self) -> Option<usize> {
        self.on.filter(|_| self.by == ForceBy::Reach { is_proven: true })
    }
}

/// What would help.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Hint {
    /// The target is out of reach, and the root of the body stays where it is: this joint, if it floated
    /// ([`RigBuilder::free_root`](ikiru_rig::RigBuilder::free_root)), would bring the body there, with all else that is
    /// to be at some place.
    FreeRoot(JointId),
    /// The same, and this joint floats in the rig but is not among those that may move.
    MoveRoot(JointId),
}
