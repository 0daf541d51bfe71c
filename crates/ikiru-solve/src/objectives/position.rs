//! Position: a point of a joint at a point of the world (the paper's equation 16).

use glam::DVec3;
use ikiru_rig::{Frame, JointId};

use crate::objective::{Objective, Part, Reach, Reads, Rows, Unfit, UnfitReason, View};
use crate::words::Unit;

/// Brings a point of a joint to a point of the world.
///
/// Residual: `world_from_joint · point − target`, 3 rows in metres. With [`Loss::Norm`](crate::Loss::Norm) the cost
/// is the paper's unsquared distance (equation 16).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// The joint to move.
    pub joint: JointId,
    /// The point, in the joint's frame (metres).
    pub point: DVec3,
    /// Where it should be, in the world (metres).
    pub target: DVec3,
}

impl Position {
    /// The joint's origin at `target`.
    #[must_use]
    pub fn new(joint: JointId, target: DVec3) -> Self {
        Self { joint, point: DVec3::ZERO, target }
    }
}

impl Objective for Position {
    fn kind(&self) -> &'static str {
        "position"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.part(Part::new(3, Unit::Metres))
    }

    fn check(&self) -> Result<(), Unfit> {
        check_point(self.point)?;
        check_target(self.target)
    }

    #[inline]
    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        evaluate_position(view.frame(0), self.point, self.target, rows);
    }

    fn reach(&self) -> Option<Reach> {
        Some(Reach { frame: 0, point: self.point, target: self.target })
    }
}

pub(super) fn check_point(point: DVec3) -> Result<(), Unfit> {
    if point.is_finite() { Ok(()) } else { Err(UnfitReason::Point.into()) }
}

pub(super) fn check_target(target: DVec3) -> Result<(), Unfit> {
    if target.is_finite() { Ok(()) } else { Err(UnfitReason::Target.into()) }
}

/// Three rows of part 0: where the point is, seen from where it should be.
#[inline(always)]
pub(super) fn evaluate_position(frame: &Frame<f64>, point: DVec3, target: DVec3, rows: &mut Rows<'_>) {
    let arm = frame.rotation.apply_constant(point).value();
    let residual = frame.origin.value() + arm - target;
    let first = rows.open(0, residual.to_array());
    if rows.wants_jacobian() {
        // The point moves by v + ω × arm.
        rows.by_frame(first, 0).copy_from_slice(&[1.0, 0.0, 0.0, 0.0, arm.z, -arm.y]);
        rows.by_frame(first + 1, 0).copy_from_slice(&[0.0, 1.0, 0.0, -arm.z, 0.0, arm.x]);
        rows.by_frame(first + 2, 0).copy_from_slice(&[0.0, 0.0, 1.0, arm.y, -arm.x, 0.0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::check_on_random_rigs;

    #[test]
    fn derivatives() {
        check_on_random_rigs(|joints, random| Position {
            joint: joints[0],
            point: random.vector(0.3),
            target: random.vector(1.0),
        });
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        let good = Position::new(JointId::from_index(0), DVec3::ZERO);
        assert!(good.check().is_ok());
        assert!(Position { target: DVec3::NAN, ..good }.check() == Err(UnfitReason::Target.into()));
        assert!(Position { point: DVec3::INFINITY, ..good }.check() == Err(UnfitReason::Point.into()));
    }
}
