//! Direction: an axis of a joint along a direction of the world.

use glam::DVec3;
use ikiru_rig::JointId;

use crate::objective::{Objective, Part, Reads, Rows, Unfit, UnfitReason, View};
use crate::objectives::angles::{DirectionChange, check_axis, evaluate_direction, unit_axis};
use crate::words::Unit;

/// Turns an axis of a joint to a direction of the world: a palm down, a foot flat.
///
/// Residual: the angle between the two, 2 rows in radians whose length is the angle (see
/// [`LookAt`](crate::objectives::LookAt) for its singular points).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// The joint to turn.
    pub joint: JointId,
    /// The axis, in the joint's frame; any length but 0.
    pub axis: DVec3,
    /// Where it should point, in the world; any length but 0.
    pub target: DVec3,
}

impl Direction {
    /// `axis` along `target`.
    #[must_use]
    pub fn new(joint: JointId, axis: DVec3, target: DVec3) -> Self {
        Self { joint, axis, target }
    }
}

impl Objective for Direction {
    fn kind(&self) -> &'static str {
        "direction"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.part(Part::new(2, Unit::Radians))
    }

    fn check(&self) -> Result<(), Unfit> {
        check_axis(self.axis)?;
        check_axis(self.target).map_err(|_| UnfitReason::TargetDirection.into())
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let change =
            DirectionChange { direction: unit_axis(self.target), origin_factor: 0.0, arm: DVec3::ZERO };
        evaluate_direction(view.frame(0), unit_axis(self.axis), &change, rows);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::check_on_random_rigs;

    #[test]
    fn derivatives() {
        check_on_random_rigs(|joints, random| Direction {
            joint: joints[0],
            axis: random.vector(2.0),
            target: random.vector(3.0),
        });
    }

    #[test]
    fn directions_without_length_are_refused() {
        let good = Direction::new(JointId::from_index(0), DVec3::Y, DVec3::Z);
        assert!(good.check().is_ok());
        assert!(Direction { axis: DVec3::ZERO, ..good }.check() == Err(UnfitReason::Axis.into()));
        assert!(
            Direction { target: DVec3::ZERO, ..good }.check() == Err(UnfitReason::TargetDirection.into())
        );
    }
}
