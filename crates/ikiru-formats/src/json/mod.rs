//! Poses and motions as JSON: what the command prints and other programs read and write.

mod document;
mod read;
mod read_onto;
mod read_pose;
mod write;

pub use read::read_motion_json;
pub use read_onto::{MotionRig, motion_rig, name_motion_rig, read_motion};
pub use read_pose::read_pose_json;
pub use write::{motion_json, pose_json};

/// Numbers of a joint besides its rotation, in a motion.
mod key {
    pub(super) const EULER: &str = "euler_deg";
    pub(super) const ANGLE: &str = "angle_deg";
    pub(super) const OFFSET: &str = "offset";
}
