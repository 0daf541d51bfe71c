//! The objectives that come with the library, one a file: data, `impl Objective`, helpers, tests.

mod bound;
mod center_of_mass;
mod coupling;
mod direction;
mod distance;
mod known_rotation;
mod look_at;
mod orientation;
mod pole_vector;
mod pose;
mod position;
mod relative_pose;
mod rest_pose;

pub(crate) mod angles;

pub use bound::Bound;
pub use center_of_mass::CenterOfMass;
pub use coupling::Coupling;
pub use direction::Direction;
pub use distance::Distance;
pub use known_rotation::{JointAngles, KnownRotation};
pub use look_at::{Gaze, LookAt};
pub use orientation::Orientation;
pub use pole_vector::PoleVector;
pub use pose::PoseTarget;
pub use position::Position;
pub use relative_pose::RelativePose;
pub use rest_pose::RestPose;
