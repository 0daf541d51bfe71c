//! Known rotation: joints at given angles or rotations (the paper's equation 18).

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, JointMotion, Rig, rotation_vector};

use crate::objective::{Inputs, JointRows, Objective, Part, Rows};
use crate::objectives::angles::inverse_right_jacobian;
use crate::objectives::orientation::check_rotation;

/// What a joint's own motion should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointAngles {
    /// The rotation of a ball or free joint; any length but 0.
    Rotation(DQuat),
    /// The angles (x, y, z) of an Euler joint, radians; `None` leaves one out.
    Euler([Option<f64>; 3]),
    /// The angle (radians) or offset (metres) of a hinge or slider.
    Value(f64),
}

/// Pulls joints to known angles (the paper's equation 18).
///
/// Cost: the squared difference of the joint angles to the given ones, summed over what is given and
/// divided by the number of joints named. Residual: those differences, each divided by the root of that
/// number, in radians; for a ball the rotation vector between the two. A joint without limits wraps. What does
/// not fit a joint's motion (an angle for a ball) is refused when a solve starts.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownRotation {
    joints: Vec<JointId>,
    angles: Vec<JointAngles>,
}

impl KnownRotation {
    /// The given joints at the given angles.
    #[must_use]
    pub fn new(targets: &[(JointId, JointAngles)]) -> Self {
        Self { joints: targets.iter().map(|t| t.0).collect(), angles: targets.iter().map(|t| t.1).collect() }
    }

    /// Changes what the `idx`-th joint should do; out of range, nothing changes.
    pub fn set(&mut self, idx: usize, angles: JointAngles) {
        if let Some(slot) = self.angles.get_mut(idx) {
            *slot = angles;
        }
    }

    /// The joints, and what they should do.
    pub fn targets(&self) -> impl ExactSizeIterator<Item = (JointId, JointAngles)> + '_ {
        self.joints.iter().copied().zip(self.angles.iter().copied())
    }
}

impl Objective for KnownRotation {
    fn kind(&self) -> &'static str {
        "known_rotation"
    }

    fn joints(&self) -> &[JointId] {
        &[]
    }

    fn parts(&self) -> &[Part] {
        &[]
    }

    fn check(&self) -> Result<(), &'static str> {
        self.angles.iter().try_for_each(|angles| match angles {
            JointAngles::Rotation(q) => check_rotation(*q),
            JointAngles::Euler(a) if a.iter().flatten().all(|a| a.is_finite()) => Ok(()),
            JointAngles::Value(v) if v.is_finite() => Ok(()),
            _ => Err("has an angle that is not finite"),
        })
    }

    fn evaluate(&self, _: &Inputs<'_>, _: &mut Rows<'_>) {}

    fn joint_rows(&self) -> Option<&dyn JointRows> {
        Some(self)
    }
}

impl JointRows for KnownRotation {
    fn joints(&self) -> &[JointId] {
        &self.joints
    }

    fn check(&self, rig: &Rig) -> Result<(), &'static str> {
        let fits = |(joint, angles): (&JointId, &JointAngles)| {
            let motion = rig.get(*joint).map(|joint| joint.motion);
            matches!(
                (angles, motion),
                (JointAngles::Rotation(_), Some(JointMotion::Ball { .. } | JointMotion::Free { .. }))
                    | (JointAngles::Euler(_), Some(JointMotion::Euler { .. }))
                    | (JointAngles::Value(_), Some(JointMotion::Hinge { .. } | JointMotion::Slider { .. }))
            )
        };
        if self.joints.iter().zip(&self.angles).all(fits) {
            return Ok(());
        }
        Err(
            "gives a joint what its motion does not have: a ball and a free joint take a rotation, an Euler joint \
             three angles, a hinge or slider one value",
        )
    }

    fn evaluate(
        &self,
        idx: usize,
        motion: &JointMotion,
        coords: &[f64],
        residual: &mut [f64],
        mut derivative: Option<&mut [f64]>,
    ) {
        let scale = 1.0 / (self.joints.len() as f64).sqrt();
        let n = residual.len();
        let mut row = |i: usize, difference: f64, residual: &mut [f64]| {
            residual[i] = scale * difference;
            if let Some(derivative) = derivative.as_deref_mut() {
                derivative[i * n + i] = scale;
            }
        };
        match (self.angles[idx], motion) {
            (JointAngles::Value(value), JointMotion::Hinge { range, .. }) => {
                row(0, short_way(coords[0] - value, range.is_unlimited()), residual);
            }
            (JointAngles::Value(value), JointMotion::Slider { .. }) => row(0, coords[0] - value, residual),
            (JointAngles::Euler(angles), JointMotion::Euler { ranges, .. }) => {
                for i in 0..3 {
                    if let Some(angle) = angles[i] {
                        row(i, short_way(coords[i] - angle, ranges[i].is_unlimited()), residual);
                    }
                }
            }
            (JointAngles::Rotation(target), JointMotion::Ball { .. }) => {
                turn_residual(target, coords, scale, residual, derivative, 0);
            }
            (JointAngles::Rotation(target), JointMotion::Free { .. }) => {
                turn_residual(target, &coords[3..], scale, residual, derivative, 3);
            }
            _ => {} // refused when the solve starts
        }
    }
}

fn short_way(difference: f64, wraps: bool) -> f64 {
    use std::f64::consts::TAU;
    if wraps { difference - TAU * (difference / TAU).round() } else { difference }
}

/// Three rows from `first` on: the rotation vector from the target to the ball's rotation.
pub(super) fn turn_residual(
    target: DQuat,
    coords: &[f64],
    scale: f64,
    residual: &mut [f64],
    derivative: Option<&mut [f64]>,
    first: usize,
) {
    let phi: DVec3 = rotation_vector(target.normalize().inverse() * DQuat::from_slice(coords));
    residual[first..first + 3].copy_from_slice(&(phi * scale).to_array());
    if let Some(derivative) = derivative {
        let (n, inverse) = (residual.len(), inverse_right_jacobian(phi));
        for i in 0..3 {
            let at = (first + i) * n + first;
            derivative[at..at + 3].copy_from_slice(&(inverse.row(i) * scale).to_array());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::check_on_whole_rigs;

    #[test]
    fn derivatives() {
        check_on_whole_rigs(|rig, random| {
            let mut targets = Vec::new();
            for id in rig.ids() {
                let value = random.between(-1.0, 1.0);
                let angles = match rig.get(id).unwrap().motion {
                    JointMotion::Fixed => continue,
                    JointMotion::Hinge { .. } | JointMotion::Slider { .. } => JointAngles::Value(value),
                    JointMotion::Euler { .. } => JointAngles::Euler([Some(value), None, Some(-value)]),
                    JointMotion::Ball { .. } | JointMotion::Free { .. } => {
                        JointAngles::Rotation(random.rotation())
                    }
                };
                if rig.get(id).unwrap().mimic.is_none() {
                    targets.push((id, angles));
                }
            }
            KnownRotation::new(&targets)
        });
    }
}
