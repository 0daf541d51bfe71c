//! Where a joint is, in glam's types: what a user gets of forward kinematics.

use glam::{DAffine3, DQuat, DVec3};

use crate::frame::Frame;

/// A joint's frame, `world_from_joint`, as a position and a rotation: what [`Pose::frame`](crate::Pose::frame) gives.
///
/// [`Frame<S>`](Frame) is the same over any [`Scalar`](crate::Scalar), for residuals and kernels; either becomes the other
/// by `from`.
///
/// ```
/// use glam::{DAffine3, DVec3};
/// use ikiru_rig::{Joint, JointMotion, RigBuilder, Range};
///
/// let mut builder = RigBuilder::new();
/// let mut elbow = Joint::new("elbow", None);
/// elbow.rest_translation = DVec3::new(0.0, 1.0, 0.0);
/// elbow.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED };
/// let elbow = builder.add(elbow);
/// let mut pose = builder.build()?.rest_pose();
/// pose.set_value(elbow, 90_f64.to_radians())?;
///
/// let frame = pose.frame(elbow)?;
/// let hand = frame.point(DVec3::new(0.3, 0.0, 0.0));
/// assert!(hand.distance(DVec3::new(0.0, 1.3, 0.0)) < 1e-12);
/// assert!(frame.point_in_joint(hand).distance(DVec3::new(0.3, 0.0, 0.0)) < 1e-12);
/// assert!(DAffine3::from(frame).transform_point3(DVec3::X).distance(frame.point(DVec3::X)) < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointFrame {
    /// Where the joint's origin is in the world, metres.
    pub position: DVec3,
    /// How the joint's axes are turned in the world: a unit quaternion with `w ≥ 0`.
    pub rotation: DQuat,
}

impl JointFrame {
    /// Where a point that is given in the joint's frame lies in the world, metres.
    #[must_use]
    pub fn point(&self, point_in_joint: DVec3) -> DVec3 {
        self.position + self.rotation * point_in_joint
    }

    /// Where a point of the world lies in the joint's frame, metres: the inverse of [`point`](Self::point).
    #[must_use]
    pub fn point_in_joint(&self, point_in_world: DVec3) -> DVec3 {
        self.rotation.inverse() * (point_in_world - self.position)
    }
}

impl From<Frame<f64>> for JointFrame {
    fn from(frame: Frame<f64>) -> Self {
        Self { position: frame.origin.value(), rotation: frame.rotation.quaternion() }
    }
}

impl From<JointFrame> for Frame<f64> {
    fn from(frame: JointFrame) -> Self {
        Self::new(frame.rotation, frame.position)
    }
}

impl From<JointFrame> for DAffine3 {
    fn from(frame: JointFrame) -> Self {
        Self::from_rotation_translation(frame.rotation, frame.position)
    }
}
