//! Distance: two points of two joints a given way apart, at least, or at most.

use glam::DVec3;
use ikiru_rig::JointId;

use crate::objective::{Inputs, Objective, Part, Rows, Unit};
use crate::objectives::position::check_point;

/// How far apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Apart {
    /// Exactly this far (metres).
    Exactly(f64),
    /// This far or further (metres).
    AtLeast(f64),
    /// This far or nearer (metres).
    AtMost(f64),
}

/// Keeps two points of two joints a given distance apart.
///
/// Residual: distance minus the given one, 1 row in metres; 0 where a bound is kept. Two points in one place have
/// no direction to part in: the derivative is then 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// The two joints.
    pub joints: [JointId; 2],
    /// The points, each in its joint's frame (metres).
    pub points: [DVec3; 2],
    /// How far apart they should be.
    pub apart: Apart,
}

impl Distance {
    /// The origins of two joints.
    #[must_use]
    pub fn new(joints: [JointId; 2], apart: Apart) -> Self {
        Self { joints, points: [DVec3::ZERO; 2], apart }
    }
}

impl Objective for Distance {
    fn kind(&self) -> &'static str {
        "distance"
    }

    fn joints(&self) -> &[JointId] {
        &self.joints
    }

    fn parts(&self) -> &[Part] {
        &[Part { n_rows: 1, unit: Unit::Metres }]
    }

    fn check(&self) -> Result<(), &'static str> {
        self.points.into_iter().try_for_each(check_point)?;
        let (Apart::Exactly(d) | Apart::AtLeast(d) | Apart::AtMost(d)) = self.apart;
        if d.is_finite() && d >= 0.0 {
            Ok(())
        } else {
            Err("has a distance that is not a finite number of at least 0")
        }
    }

    fn evaluate(&self, inputs: &Inputs<'_>, rows: &mut Rows<'_>) {
        let arms = [0, 1].map(|i| inputs.frames[i].rotation.apply_constant(self.points[i]).value());
        let [a, b] = [0, 1].map(|i| inputs.frames[i].origin.value() + arms[i]);
        let length = a.distance(b);
        let (residual, kept) = match self.apart {
            Apart::Exactly(d) => (length - d, false),
            Apart::AtLeast(d) => (length - d, length >= d),
            Apart::AtMost(d) => (length - d, length <= d),
        };
        rows.residual[0] = if kept { 0.0 } else { residual };
        if rows.wants_jacobian() && !kept && length > 1e-12 {
            let away = (b - a) / length;
            for (frame, direction) in [(0, -away), (1, away)] {
                let out = rows.derivative(frame, 0);
                out[..3].copy_from_slice(&direction.to_array());
                out[3..].copy_from_slice(&arms[frame].cross(direction).to_array());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::{check_on_random_rigs, residual_at};
    use ikiru_rig::Frame;

    #[test]
    fn derivatives() {
        check_on_random_rigs(|joints, random| {
            let points = [random.vector(0.3), random.vector(0.3)];
            let apart = [Apart::Exactly(0.3), Apart::AtLeast(9.0), Apart::AtMost(0.0)][random.below(3)];
            Distance { points, ..Distance::new([joints[0], joints[1]], apart) }
        });
    }

    #[test]
    fn a_bound_that_is_kept_costs_nothing() {
        let joints = [0, 1].map(JointId::from_index);
        let mut away = Frame::identity();
        away.origin.x = 2.0;
        let frames = [Frame::identity(), away];
        for (apart, residual) in [
            (Apart::Exactly(1.5), 0.5),
            (Apart::AtLeast(1.5), 0.0),
            (Apart::AtLeast(3.0), -1.0),
            (Apart::AtMost(1.5), 0.5),
        ] {
            assert_eq!(residual_at(&Distance::new(joints, apart), &frames), [residual]);
        }
        assert!(Distance::new(joints, Apart::AtMost(-1.0)).check().is_err());
    }
}
