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

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};
    use ikiru_rig::JointId;
    use ikiru_testkit::rigs::random_rig;

    use super::*;
    use crate::objective::Objective;

    #[test]
    fn every_objective_is_named_as_scenarios_name_it() {
        let rig = random_rig(3, 1);
        let [a, b, c] = [0, 1, 2].map(JointId::from_index);
        let (point, turn) = (DVec3::X, DQuat::IDENTITY);
        let all: [(&dyn Objective, &str); 10] = [
            (&Direction::new(a, point, point), "direction"),
            (&Distance::new([a, b], Bound::AtMost(1.0)), "distance"),
            (&KnownRotation::new(&[]), "known_rotation"),
            (&LookAt::new(a, point, point), "look_at"),
            (&Orientation::new(a, turn), "orientation"),
            (&PoleVector { joints: [a, b, c], target: point }, "pole_vector"),
            (&PoseTarget::new(a, point, turn), "pose"),
            (&Position::new(a, point), "position"),
            (&RelativePose::new(a, b, None, Some(turn)), "relative_pose"),
            (&RestPose::new(&[a], rig.rest_pose()), "rest_pose"),
        ];
        for (objective, name) in all {
            assert_eq!(objective.kind(), name);
        }
    }
}
