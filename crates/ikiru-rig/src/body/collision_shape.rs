//! The solids that joints carry: what of a body must not run into things.

use glam::{DQuat, DVec3};

use crate::joint::JointId;

/// A solid that moves with a joint, for objectives that keep things apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollisionShape {
    /// The joint that it moves with.
    pub joint: JointId,
    /// Where its centre is in that joint's frame, metres.
    pub position: DVec3,
    /// How its axes are turned in that joint's frame, a unit quaternion.
    pub rotation: DQuat,
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
