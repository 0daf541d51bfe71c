//! Rigs for inverse kinematics: the skeleton and its joints, hard joint limits, poses, clips, and forward
//! kinematics that is generic over plain numbers and derivatives.
//!
//! Metres, radians and seconds; right-handed, y up, a character faces +z with its left at +x. A joint owns
//! the transform to its parent: `world_from_joint = world_from_parent · rest · motion(q)`.
//!
//! This crate knows no file and no solver.
//!
//! An id that is no joint of the rig is answered in one of three ways, everywhere: a number, a rotation, a frame is a
//! [`ForeignJoint`] error and never made up, and so is a change; what may be absent is `None`; what a joint has any number of
//! (its coordinates, its ancestors) is empty. Only the kernels in [`kinematics`] take their ids on trust, as a slice does.
//!
//! ```
//! use ikiru_rig::{Joint, JointMotion, Range, RigBuilder};
//! use glam::DVec3;
//!
//! let mut builder = RigBuilder::new();
//! let mut shoulder = Joint::new("shoulder", None);
//! shoulder.motion = JointMotion::BALL;
//! let shoulder = builder.add(shoulder);
//! let mut elbow = Joint::new("elbow", Some(shoulder));
//! elbow.rest_translation = DVec3::new(0.3, 0.0, 0.0);
//! elbow.motion = JointMotion::Hinge { axis: DVec3::Y, range: Range::degrees(-150.0, 0.0) };
//! let elbow = builder.add(elbow);
//! let mut hand = Joint::new("hand", Some(elbow));
//! hand.rest_translation = DVec3::new(0.25, 0.0, 0.0);
//! let hand = builder.add(hand);
//! let rig = builder.build()?;
//!
//! let mut pose = rig.rest_pose();
//! pose.set_value(elbow, -1.5_f64.to_radians() * 60.0)?;
//! assert!((pose.frame(hand)?.position - DVec3::new(0.3, 0.0, 0.25)).length() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod carrier;
mod clip;
#[cfg(feature = "serde")]
mod data;
mod dual;
mod foreign;
mod frame;
mod joint;
mod joint_frame;
mod lanes;
mod limit;
mod name;
mod pose;
mod pose_error;
mod rig;
mod rig_error;
mod rigid;
mod root;
mod scalar;
mod shape;
mod trig;

pub mod body;
pub mod humanoid;
pub mod kinematics;
pub mod maths;

pub use body::{CollisionShape, Segment, ShapeKind};
pub use clip::{
    Clip, ClipError, ClipMeasure, LimitMargin, Margin, Peak, Rate, RateExcess, RateLimit, RatePart,
    RateSummaries, RateSummary, Rates, Retimed,
};
#[cfg(feature = "serde")]
pub use data::{ClipData, DataError, JointData, PoseData};
pub use dual::Dual;
pub use foreign::ForeignJoint;
pub use frame::{Frame, Rotation, Vec3};
pub use humanoid::Role;
pub use joint::{EulerOrder, Joint, JointId, JointMotion, Mimic};
pub use joint_frame::JointFrame;
pub use lanes::{LaneScalar, Lanes};
pub use limit::{Cone, ConeCentre, ConeError, ConeNormal, Range, TangentBox};
pub use name::{UnknownName, unknown as unknown_name};
pub use pose::{Pose, difference_joint, project_joint, retract_joint, rotation_vector};
pub use pose_error::PoseError;
pub use rig::{ChainError, Rig, RigBuilder};
pub use rig_error::RigError;
pub use rigid::{RigidError, decompose_affine};
pub use scalar::{Mask, Scalar};
pub use shape::ShapeDifference;
