//! Pose: position and orientation of a joint together.

use glam::{DQuat, DVec3};
use ikiru_rig::JointId;

use crate::objective::{Objective, Part, Reach, Reads, Rows, Unfit, View};
use crate::objectives::orientation::{check_rotation, evaluate_orientation};
use crate::objectives::position::{check_point, check_target, evaluate_position};
use crate::words::Unit;

/// Brings a point of a joint to a point of the world and the joint's frame to a rotation.
///
/// Residual: 3 rows in metres as [`Position`](crate::objectives::Position), then 3 rows in radians as
/// [`Orientation`](crate::objectives::Orientation); the loss and a tolerance hold for each part alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseTarget {
    /// The joint to move.
    pub joint: JointId,
    /// The point, in the joint's frame (metres).
    pub point: DVec3,
    /// Where the point should be, in the world (metres).
    pub position: DVec3,
    /// `world_from_joint`'s rotation as it should be; any length but 0.
    pub rotation: DQuat,
}

impl PoseTarget {
    /// The joint's frame at `position` and `rotation`.
    #[must_use]
    pub fn new(joint: JointId, position: DVec3, rotation: DQuat) -> Self {
        Self { joint, point: DVec3::ZERO, position, rotation }
    }
}

impl Objective for PoseTarget {
    fn kind(&self) -> &'static str {
        "pose"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.part(Part::new(3, Unit::Metres))?;
        reads.part(Part::new(3, Unit::Radians))
    }

    fn check(&self) -> Result<(), Unfit> {
        check_point(self.point)?;
        check_target(self.position)?;
        check_rotation(self.rotation)
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        evaluate_position(view.frame(0), self.point, self.position, rows);
        evaluate_orientation(view.frame(0), self.rotation, 1, rows);
    }

    fn reach(&self) -> Option<Reach> {
        Some(Reach { frame: 0, point: self.point, target: self.position })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::check_on_random_rigs;

    #[test]
    fn derivatives() {
        check_on_random_rigs(|joints, random| PoseTarget {
            joint: joints[0],
            point: random.vector(0.2),
            position: random.vector(1.0),
            rotation: random.rotation(),
        });
    }
}
