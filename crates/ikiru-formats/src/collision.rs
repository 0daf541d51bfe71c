//! Collision geometry of a rig's joints, as a file gives it.

use ikiru_rig::{Frame, JointId};

/// A solid that moves with a joint, for objectives that keep things apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollisionShape {
    /// The joint that it moves with.
    pub joint: JointId,
    /// How it lies in that joint's frame, metres.
    pub joint_from_shape: Frame,
    /// What it is.
    pub kind: ShapeKind,
}

/// The simple solids, centred on the origin of their frame; all sizes in metres, none negative.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ShapeKind {
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// A cylinder along the frame's z axis.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// From one flat end to the other.
        length: f64,
    },
    /// A capsule along the frame's z axis.
    Capsule {
        /// Its radius.
        radius: f64,
        /// Between the centres of its round ends.
        length: f64,
    },
    /// A box along the frame's axes.
    Box {
        /// Its full size along each axis.
        size: [f64; 3],
    },
}
