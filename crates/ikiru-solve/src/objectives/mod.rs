//! The objectives that come with the library, one a file: data, `impl Objective`, helpers, tests.

mod direction;
mod known_rotation;
mod look_at;
mod orientation;
mod pose;
mod position;
mod rest_pose;

pub(crate) mod angles;

pub use direction::Direction;
pub use known_rotation::{JointAngles, KnownRotation};
pub use look_at::{Gaze, LookAt};
pub use orientation::Orientation;
pub use pose::PoseTarget;
pub use position::Position;
pub use rest_pose::RestPose;
