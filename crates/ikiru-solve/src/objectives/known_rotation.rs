//! Known rotation: joints at given angles or rotations (the paper's equation 18).

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, JointMotion, rotation_vector};

use crate::objective::{JointCoords, Objective, Part, Reads, Rows, Unfit, UnfitReason, View};
use crate::objectives::angles::inverse_right_jacobian;
use crate::objectives::orientation::check_rotation;
use crate::words::Unit;

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

    /// Changes what the `idx`-th joint should do, counted from 0 in the order of [`targets`](Self::targets).
    ///
    /// # Errors
    /// [`UnfitReason::TargetIndex`] where there are not so many; nothing changes then.
    pub fn set(&mut self, idx: usize, angles: JointAngles) -> Result<(), Unfit> {
        let n_targets = self.angles.len();
        let slot = self.angles.get_mut(idx).ok_or(UnfitReason::TargetIndex { idx, n_targets })?;
        *slot = angles;
        Ok(())
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

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        let (mut n_turning, mut n_sliding) = (0, 0);
        for (joint, angles) in self.targets() {
            reads.motion(joint)?;
            let motion = reads.rig().joints()[joint.index()].motion;
            // What its motion takes, by which a misfit is explained too.
            let (is_fit, n_rows, takes) = match motion {
                JointMotion::Fixed => (false, 0, UnfitReason::GivesToFixed),
                JointMotion::Hinge { .. } | JointMotion::Slider { .. } => {
                    (matches!(angles, JointAngles::Value(_)), 1, UnfitReason::TakesValue)
                }
                JointMotion::Euler { .. } => {
                    (matches!(angles, JointAngles::Euler(_)), 3, UnfitReason::TakesEuler)
                }
                JointMotion::Ball { .. } | JointMotion::Free { .. } => {
                    (matches!(angles, JointAngles::Rotation(_)), 3, UnfitReason::TakesRotation)
                }
            };
            if !is_fit {
                return Err(Unfit::of_joint(takes, joint));
            }
            if matches!(motion, JointMotion::Slider { .. }) {
                n_sliding += n_rows;
            } else {
                n_turning += n_rows;
            }
        }
        reads.part(Part::separable(n_turning, Unit::Radians))?;
        reads.part(Part::separable(n_sliding, Unit::Metres))
    }

    fn check(&self) -> Result<(), Unfit> {
        self.angles.iter().try_for_each(|angles| match angles {
            JointAngles::Rotation(q) => check_rotation(*q),
            JointAngles::Euler(a) if a.iter().flatten().all(|a| a.is_finite()) => Ok(()),
            JointAngles::Value(v) if v.is_finite() => Ok(()),
            JointAngles::Euler(_) | JointAngles::Value(_) => Err(UnfitReason::Angle.into()),
        })
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let scale = 1.0 / (self.joints.len() as f64).sqrt();
        for (idx, angles) in self.angles.iter().enumerate() {
            let JointCoords { motion, coords } = view.motion(idx);
            let mut difference = |part: usize, dof: usize, difference: f64| {
                let row = rows.open(part, [scale * difference]);
                if rows.wants_jacobian() {
                    rows.by_motion(row, idx)[dof] = scale;
                }
            };
            match (angles, motion) {
                (JointAngles::Value(value), JointMotion::Hinge { range, .. }) => {
                    difference(TURNING, 0, short_way(coords[0] - value, range.is_unlimited()));
                }
                (JointAngles::Value(value), JointMotion::Slider { .. }) => {
                    difference(SLIDING, 0, coords[0] - value);
                }
                (JointAngles::Euler(angles), JointMotion::Euler { ranges, .. }) => {
                    for i in 0..3 {
                        if let Some(angle) = angles[i] {
                            difference(TURNING, i, short_way(coords[i] - angle, ranges[i].is_unlimited()));
                        }
                    }
                }
                (JointAngles::Rotation(target), _) => open_turn(*target, coords, scale, idx, rows),
                (JointAngles::Value(_) | JointAngles::Euler(_), _) => {} // refused when the solve starts
            }
        }
    }
}

/// The parts of objectives of joints' own motions: what turns, and what slides.
pub(super) const TURNING: usize = 0;
pub(super) const SLIDING: usize = 1;

fn short_way(difference: f64, wraps: bool) -> f64 {
    use std::f64::consts::TAU;
    if wraps { difference - TAU * (difference / TAU).round() } else { difference }
}

/// Three rows that turn: the rotation vector from the target to the rotation of the `motion`-th joint that is read, whose
/// coordinates end in a quaternion.
pub(super) fn open_turn(target: DQuat, coords: &[f64], scale: f64, motion: usize, rows: &mut Rows<'_>) {
    let at = coords.len() - 4;
    let phi: DVec3 = rotation_vector(target.normalize().inverse() * DQuat::from_slice(&coords[at..]));
    let first = rows.open(TURNING, (phi * scale).to_array());
    if rows.wants_jacobian() {
        let inverse = inverse_right_jacobian(phi);
        for i in 0..3 {
            // Before the turn come as many translations as coordinates.
            rows.by_motion(first + i, motion)[at..at + 3]
                .copy_from_slice(&(inverse.row(i) * scale).to_array());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::check_on_whole_rigs;

    #[test]
    fn what_one_joint_should_do_changes_and_no_other_and_there_are_no_more_than_there_are() {
        let joints = [0, 1].map(JointId::from_index);
        let [one, two, three] = [1.0, 2.0, 3.0].map(JointAngles::Value);
        let mut known = KnownRotation::new(&[(joints[0], one), (joints[1], two)]);
        known.set(1, three).unwrap();
        let wanted = [(joints[0], one), (joints[1], three)];
        assert!(known.targets().eq(wanted));
        let error = known.set(2, one).unwrap_err();
        assert_eq!(error.reason, UnfitReason::TargetIndex { idx: 2, n_targets: 2 });
        assert_eq!(error.to_string(), "has no target 2 (counted from 0): it has 2");
        assert!(known.targets().eq(wanted));
    }

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
