//! Look-at: an axis of a joint towards a point (the paper's equation 17).

use glam::DVec3;
use ikiru_rig::{Frame, JointId};

use crate::objective::{Objective, Part, Reads, Rows, TermWarning, Unfit, UnfitReason, View};
use crate::objectives::angles::{DirectionChange, check_axis, evaluate_direction, unit_axis};
use crate::objectives::position::check_target;
use crate::words::Unit;

/// What a [`LookAt`] looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gaze {
    /// A point of the world (metres).
    Point(DVec3),
    /// A point that goes along with the bone's tip: `origin + R · axis · length + offset`, with the offset in
    /// world axes (metres). With a long offset this is nearly a direction.
    OffsetFromTip {
        /// Length of the bone along its axis.
        length: f64,
        /// From the tip to the point.
        offset: DVec3,
    },
}

/// Turns an axis of a joint towards a point (the paper's equation 17).
///
/// Residual: the angle between `R · axis` and `point − origin`, by atan2, as 2 rows in radians whose
/// length is the angle. At an angle of 0 it is 0 and smooth; at π a fixed perpendicular of the axis
/// decides where to turn; a point in the joint's origin gives 0 and a warning. The cost with the default loss is
/// the squared angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookAt {
    /// The joint to turn.
    pub joint: JointId,
    /// The axis that looks, in the joint's frame; any length but 0.
    pub axis: DVec3,
    /// What it looks at.
    pub gaze: Gaze,
}

impl LookAt {
    /// `axis` towards a point of the world.
    #[must_use]
    pub fn new(joint: JointId, axis: DVec3, point: DVec3) -> Self {
        Self { joint, axis, gaze: Gaze::Point(point) }
    }

    fn change(&self, frame: &Frame<f64>, axis: DVec3) -> DirectionChange {
        match self.gaze {
            Gaze::Point(point) => DirectionChange {
                direction: point - frame.origin.value(),
                origin_factor: -1.0,
                arm: DVec3::ZERO,
            },
            Gaze::OffsetFromTip { length, offset } => {
                let tip = frame.rotation.apply_constant(axis).value() * length;
                DirectionChange { direction: tip + offset, origin_factor: 0.0, arm: tip }
            }
        }
    }
}

impl Objective for LookAt {
    fn kind(&self) -> &'static str {
        "look_at"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.part(Part::new(2, Unit::Radians))
    }

    fn check(&self) -> Result<(), Unfit> {
        check_axis(self.axis)?;
        match self.gaze {
            Gaze::Point(point) => check_target(point),
            Gaze::OffsetFromTip { length, offset } if length.is_finite() => check_target(offset),
            Gaze::OffsetFromTip { .. } => Err(UnfitReason::Length.into()),
        }
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let (frame, axis) = (view.frame(0), unit_axis(self.axis));
        let change = self.change(frame, axis);
        if change.direction.length() < 1e-9 {
            rows.warn(TermWarning::LooksAtItself);
        }
        evaluate_direction(frame, axis, &change, rows);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::{check_on_random_rigs, residual_at, told_at};

    #[test]
    fn derivatives() {
        check_on_random_rigs(|joints, random| {
            let gaze = if random.below(2) == 0 {
                Gaze::Point(random.vector(2.0))
            } else {
                Gaze::OffsetFromTip { length: random.between(-0.1, 0.4), offset: random.vector(1.0) }
            };
            LookAt { joint: joints[0], axis: random.vector(1.0), gaze }
        });
    }

    #[test]
    fn the_angle_is_exact_also_near_zero_and_near_pi() {
        for angle in [0.0, 1e-12, 1e-8, 1e-4, 0.5, 3.0, std::f64::consts::PI - 1e-7, std::f64::consts::PI] {
            let point = DVec3::new(0.0, f64::cos(angle), f64::sin(angle)) * 2.0;
            let look = LookAt::new(JointId::from_index(0), DVec3::Y, point);
            let residual = residual_at(&look, &[Frame::identity()]);
            assert!(
                (residual[0].hypot(residual[1]) - angle).abs() < 1e-9 * angle.max(1e-3),
                "{angle}: {residual:?}"
            );
        }
    }

    #[test]
    fn a_point_in_the_origin_has_no_direction() {
        let look = LookAt::new(JointId::from_index(0), DVec3::Y, DVec3::ZERO);
        let (residual, warning) = told_at(&look, &[Frame::identity()]);
        assert_eq!(residual, [0.0, 0.0]);
        assert_eq!(warning, Some(TermWarning::LooksAtItself));
    }
}
