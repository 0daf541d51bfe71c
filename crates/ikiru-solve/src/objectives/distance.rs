//! Distance: two points of two joints a given way apart, at least, or at most.

use glam::DVec3;
use ikiru_rig::JointId;

use crate::objective::{Objective, Reads, Rows, Unfit, UnfitReason, View};
use crate::objectives::bound::Bound;
use crate::objectives::position::check_point;
use crate::words::Unit;

/// Keeps two points of two joints a given distance apart.
///
/// Residual: 1 row in metres that wants to be 0, distance minus the given one; of a bound, one that wants to be at
/// least 0, what is left to it. Two points in one place have no direction to part in: the derivative is then 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// The two joints.
    pub joints: [JointId; 2],
    /// The points, each in its joint's frame (metres).
    pub points: [DVec3; 2],
    /// How far apart they should be (metres).
    pub bound: Bound,
}

impl Distance {
    /// The origins of two joints.
    #[must_use]
    pub fn new(joints: [JointId; 2], bound: Bound) -> Self {
        Self { joints, points: [DVec3::ZERO; 2], bound }
    }
}

impl Objective for Distance {
    fn kind(&self) -> &'static str {
        "distance"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frames(&self.joints)?;
        reads.part(self.bound.part(1, Unit::Metres))
    }

    fn check(&self) -> Result<(), Unfit> {
        self.points.into_iter().try_for_each(check_point)?;
        let d = self.bound.value();
        if d.is_finite() && d >= 0.0 { Ok(()) } else { Err(UnfitReason::Distance.into()) }
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let arms = [0, 1].map(|i| view.frame(i).rotation.apply_constant(self.points[i]).value());
        let [a, b] = [0, 1].map(|i| view.frame(i).origin.value() + arms[i]);
        let length = a.distance(b);
        let (residual, sign) = self.bound.residual(length);
        let row = rows.open(0, [residual]);
        if rows.wants_jacobian() && length > 1e-12 {
            let away = sign * (b - a) / length;
            for (frame, direction) in [(0, -away), (1, away)] {
                let out = rows.by_frame(row, frame);
                out[..3].copy_from_slice(&direction.to_array());
                out[3..].copy_from_slice(&arms[frame].cross(direction).to_array());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::{check_on_random_rigs, residual_at};
    use ikiru_rig::Frame;

    #[test]
    fn derivatives() {
        check_on_random_rigs(|joints, random| {
            let points = [random.vector(0.3), random.vector(0.3)];
            let bound = [Bound::Exactly(0.3), Bound::AtLeast(9.0), Bound::AtMost(0.0)][random.below(3)];
            Distance { points, ..Distance::new([joints[0], joints[1]], bound) }
        });
    }

    #[test]
    fn bounds_are_measured_from_inside() {
        let joints = [0, 1].map(JointId::from_index);
        let mut away = Frame::identity();
        away.origin.x = 2.0;
        let frames = [Frame::identity(), away];
        for (bound, residual) in [
            (Bound::Exactly(1.5), 0.5),
            (Bound::AtLeast(1.5), 0.5),
            (Bound::AtLeast(3.0), -1.0),
            (Bound::AtMost(1.5), -0.5),
        ] {
            assert_eq!(residual_at(&Distance::new(joints, bound), &frames), [residual]);
        }
        assert!(Distance::new(joints, Bound::AtMost(-1.0)).check().is_err());
    }
}
