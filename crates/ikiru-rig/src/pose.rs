//! A pose: the value of every degree of freedom of a rig, and how it changes along a tangent.

use glam::{DQuat, DVec3};

use crate::foreign::ForeignJoint;
use crate::joint::{Joint, JointId, JointMotion};
use crate::limit::Cone;
use crate::maths;
use crate::pose_error::PoseError;
use crate::rig::Rig;

/// The value of every degree of freedom of one rig. A plain value: clone it, store it, send it.
///
/// Its numbers lie joint after joint, parents first: an angle (radians) for a hinge, an offset (metres) for
/// a slider, angles (x, y, z) for an Euler joint, a quaternion (x, y, z, w) for a ball, and a translation
/// (metres, in the parent's frame after the rest transform) followed by a quaternion for a free joint.
#[derive(Debug)]
pub struct Pose {
    rig: Rig,
    coords: Vec<f64>,
}

impl Clone for Pose {
    fn clone(&self) -> Self {
        Self { rig: self.rig.clone(), coords: self.coords.clone() }
    }

    /// Does not allocate where `self` is a pose of the same rig already.
    fn clone_from(&mut self, source: &Self) {
        self.rig.clone_from(&source.rig);
        self.coords.clone_from(&source.coords);
    }
}

impl PartialEq for Pose {
    fn eq(&self, other: &Self) -> bool {
        self.rig.is_same(&other.rig) && self.coords == other.coords
    }
}

/// Ratio under which two quaternions are too near to opposite to be told apart.
const TINY: f64 = 1e-12;

impl Rig {
    /// The pose of all zeros: every joint at its rest transform. It may lie outside limits that do not
    /// contain zero; see [`Pose::project`].
    #[must_use]
    pub fn rest_pose(&self) -> Pose {
        Pose::rest(self)
    }
}

impl Pose {
    pub(crate) fn rest(rig: &Rig) -> Self {
        let mut coords = vec![0.0; rig.n_coords()];
        for joint in rig.ids() {
            // The last coordinate of a ball or free joint is the w of its quaternion.
            if let (JointMotion::Ball { .. } | JointMotion::Free { .. }, Some(w)) =
                (&rig.joints()[joint.index()].motion, rig.coords_of(joint).last())
            {
                coords[w] = 1.0;
            }
        }
        Self { rig: rig.clone(), coords }
    }

    /// A pose from its numbers (see [`Pose`]); quaternions are brought to unit length.
    ///
    /// # Errors
    /// When there are too few or too many, one is not finite, or a quaternion has the length 0.
    pub fn from_coords(rig: &Rig, coords: &[f64]) -> Result<Self, PoseError> {
        if coords.len() != rig.n_coords() {
            return Err(PoseError::Length { found: coords.len(), expected: rig.n_coords() });
        }
        let mut pose = Self { rig: rig.clone(), coords: coords.to_vec() };
        for joint in rig.ids() {
            let (range, data) = (rig.coords_of(joint), &rig.joints()[joint.index()]);
            let bad = || PoseError::Value(data.name.clone());
            if pose.coords[range.clone()].iter().any(|c| !c.is_finite()) {
                return Err(bad());
            }
            if let Some(q) = pose.quaternion_slot(joint) {
                let unit =
                    maths::unit_quaternion(DQuat::from_slice(&pose.coords[q..q + 4])).ok_or_else(bad)?;
                pose.coords[q..q + 4].copy_from_slice(&unit.to_array());
            }
        }
        Ok(pose)
    }

    /// The rig that it is a pose of.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// All numbers, joint after joint (see [`Pose`]).
    #[must_use]
    pub fn coords(&self) -> &[f64] {
        &self.coords
    }

    /// All numbers, to change them. The caller keeps them finite and quaternions at unit length; a solver
    /// refuses a pose where they are not.
    #[must_use]
    pub fn coords_mut(&mut self) -> &mut [f64] {
        &mut self.coords
    }

    /// Whether all numbers are finite and all quaternions have unit length (within 1e-6).
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.coords.iter().all(|c| c.is_finite())
            && self
                .rig
                .ids()
                .filter_map(|j| self.quaternion_slot(j))
                .all(|at| (DQuat::from_slice(&self.coords[at..at + 4]).length_squared() - 1.0).abs() < 2e-6)
    }

    fn no(joint: &Joint, wanted: &'static str) -> PoseError {
        let motion = if joint.mimic.is_some() { "a follower of another" } else { joint.motion.name() };
        PoseError::Kind { joint: joint.name.clone(), motion, wanted }
    }

    /// Where the quaternion of a ball or free joint starts.
    fn quaternion_slot(&self, joint: JointId) -> Option<usize> {
        match self.rig.get(joint)?.motion {
            JointMotion::Ball { .. } | JointMotion::Free { .. } => Some(self.rig.coords_of(joint).end - 4),
            JointMotion::Fixed
            | JointMotion::Hinge { .. }
            | JointMotion::Slider { .. }
            | JointMotion::Euler { .. } => None,
        }
    }

    /// The angle (radians) or offset (metres) of a hinge or slider, a follower's included. `None` for other joints, and for
    /// the id of another, larger rig.
    #[must_use]
    pub fn value(&self, joint: JointId) -> Option<f64> {
        let (data, kernel) = (self.rig.get(joint)?, self.rig.kernels().get(joint.index())?);
        let scalar = data.motion.is_scalar().then(|| self.coords[kernel.coord as usize])?;
        Some(kernel.mimic.map_or(scalar, |(multiplier, offset)| scalar * multiplier + offset))
    }

    /// Sets the angle (radians) or offset (metres) of a hinge or slider. Limits are not applied.
    ///
    /// # Errors
    /// When the joint has no such value, follows another, or the value is not finite.
    pub fn set_value(&mut self, joint: JointId, value: f64) -> Result<(), PoseError> {
        let data = self.rig.own(joint)?;
        if !data.motion.is_scalar() || data.mimic.is_some() {
            return Err(Self::no(data, "angle or offset"));
        }
        if !value.is_finite() {
            return Err(PoseError::Value(data.name.clone()));
        }
        let at = self.rig.coords_of(joint).start;
        self.coords[at] = value;
        Ok(())
    }

    /// The angles (x, y, z) of an Euler joint, radians. `None` for other joints, and for the id of another, larger rig.
    #[must_use]
    pub fn euler(&self, joint: JointId) -> Option<[f64; 3]> {
        let JointMotion::Euler { .. } = self.rig.get(joint)?.motion else { return None };
        self.coords[self.rig.coords_of(joint)].try_into().ok()
    }

    /// Sets the angles (x, y, z) of an Euler joint, radians. Limits are not applied.
    ///
    /// # Errors
    /// When the joint is not Euler or an angle is not finite.
    pub fn set_euler(&mut self, joint: JointId, angles: [f64; 3]) -> Result<(), PoseError> {
        let data = self.rig.own(joint)?;
        let JointMotion::Euler { .. } = data.motion else { return Err(Self::no(data, "Euler angles")) };
        if angles.iter().any(|a| !a.is_finite()) {
            return Err(PoseError::Value(data.name.clone()));
        }
        let range = self.rig.coords_of(joint);
        self.coords[range].copy_from_slice(&angles);
        Ok(())
    }

    /// The rotation of a joint's motion, on top of its rest rotation; the identity for one that does not rotate.
    ///
    /// # Errors
    /// For the id of another, larger rig.
    pub fn rotation(&self, joint: JointId) -> Result<DQuat, ForeignJoint> {
        self.rig.own(joint)?;
        Ok(self.rotation_of(joint))
    }

    /// The [rotation](Self::rotation) of a joint of the rig's own.
    pub(crate) fn rotation_of(&self, joint: JointId) -> DQuat {
        match self.rig.joints()[joint.index()].motion {
            JointMotion::Hinge { axis, .. } => maths::turn_about(axis, self.value(joint).unwrap_or(0.0)),
            JointMotion::Euler { order, .. } => order.quaternion(self.euler(joint).unwrap_or_default()),
            JointMotion::Ball { .. } | JointMotion::Free { .. } => {
                let at = self.rig.coords_of(joint).end - 4;
                DQuat::from_slice(&self.coords[at..at + 4])
            }
            JointMotion::Fixed | JointMotion::Slider { .. } => DQuat::IDENTITY,
        }
    }

    /// Sets the rotation of a ball, free or Euler joint's motion, on top of its rest rotation. Any non-zero
    /// length is accepted. Limits are not applied.
    ///
    /// # Errors
    /// When the joint has no rotation to set, or the value is not finite.
    pub fn set_rotation(&mut self, joint: JointId, rotation: DQuat) -> Result<(), PoseError> {
        let data = self.rig.own(joint)?;
        let unit = maths::unit_quaternion(rotation).ok_or_else(|| PoseError::Value(data.name.clone()))?;
        if let JointMotion::Euler { order, .. } = data.motion {
            return self.set_euler(joint, order.angles(unit));
        }
        let at = self.quaternion_slot(joint).ok_or_else(|| Self::no(data, "rotation"))?;
        self.coords[at..at + 4].copy_from_slice(&unit.to_array());
        Ok(())
    }

    /// The translation of a joint's motion, in its parent's frame after the rest transform (metres); zero for one that does
    /// not translate.
    ///
    /// # Errors
    /// For the id of another, larger rig.
    pub fn translation(&self, joint: JointId) -> Result<DVec3, ForeignJoint> {
        self.rig.own(joint)?;
        Ok(self.translation_of(joint))
    }

    /// The [translation](Self::translation) of a joint of the rig's own.
    pub(crate) fn translation_of(&self, joint: JointId) -> DVec3 {
        match self.rig.joints()[joint.index()].motion {
            JointMotion::Free { .. } => DVec3::from_slice(&self.coords[self.rig.coords_of(joint)]),
            JointMotion::Slider { axis, .. } => axis * self.value(joint).unwrap_or(0.0),
            JointMotion::Fixed
            | JointMotion::Hinge { .. }
            | JointMotion::Euler { .. }
            | JointMotion::Ball { .. } => DVec3::ZERO,
        }
    }

    /// Sets the translation of a free joint, in its parent's frame after the rest transform (metres).
    ///
    /// # Errors
    /// When the joint is not free or the value is not finite.
    pub fn set_translation(&mut self, joint: JointId, translation: DVec3) -> Result<(), PoseError> {
        let data = self.rig.own(joint)?;
        let JointMotion::Free { .. } = data.motion else { return Err(Self::no(data, "translation")) };
        if !translation.is_finite() {
            return Err(PoseError::Value(data.name.clone()));
        }
        let at = self.rig.coords_of(joint).start;
        self.coords[at..at + 3].copy_from_slice(&translation.to_array());
        Ok(())
    }

    /// Moves along a tangent ([`Rig::n_dofs`] entries): angles and offsets add up, a ball turns to `q · exp(ω)`.
    ///
    /// # Errors
    /// When the tangent has the wrong length or a number that is not finite; the pose is then as it was.
    pub fn retract(&mut self, tangent: &[f64]) -> Result<(), PoseError> {
        let expected = self.rig.n_dofs();
        if tangent.len() != expected {
            return Err(PoseError::Length { found: tangent.len(), expected });
        }
        for joint in self.rig.ids() {
            if tangent[self.rig.dofs_of(joint)].iter().any(|t| !t.is_finite()) {
                return Err(PoseError::Value(self.rig.joints()[joint.index()].name.clone()));
            }
        }
        let rig = self.rig.clone();
        for joint in rig.ids() {
            let data = &rig.joints()[joint.index()];
            if data.n_dofs() > 0 {
                retract_joint(
                    &data.motion,
                    &mut self.coords[rig.coords_of(joint)],
                    &tangent[rig.dofs_of(joint)],
                );
            }
        }
        Ok(())
    }

    /// The tangent that leads from `self` to `other` ([`Rig::n_dofs`] entries): the inverse of
    /// [`retract`](Self::retract). Angles without limits take the short way around, unless others follow them.
    ///
    /// # Errors
    /// When the poses belong to rigs with different numbers of coordinates.
    pub fn difference(&self, other: &Self) -> Result<Vec<f64>, PoseError> {
        if self.coords.len() != other.coords.len() {
            return Err(PoseError::Length { found: other.coords.len(), expected: self.coords.len() });
        }
        let mut tangent = vec![0.0; self.rig.n_dofs()];
        for joint in self.rig.ids() {
            self.difference_of(joint, other, &mut tangent[self.rig.dofs_of(joint)]);
        }
        Ok(tangent)
    }

    /// One joint's part of the [`difference`](Self::difference) to another pose of the same rig.
    pub(crate) fn difference_of(&self, joint: JointId, other: &Self, tangent: &mut [f64]) {
        let (data, at) = (&self.rig.joints()[joint.index()], self.rig.coords_of(joint));
        if data.n_dofs() == 0 {
            return;
        }
        if self.rig.kernels()[joint.index()].leads {
            tangent[0] = other.coords[at.start] - self.coords[at.start];
        } else {
            difference_joint(&data.motion, &self.coords[at.clone()], &other.coords[at], tangent);
        }
    }

    /// The pose a fraction `t` of the way to `other`, on the manifold: balls turn about one axis. `t` outside 0 to 1
    /// goes on along the same path.
    ///
    /// # Errors
    /// When the poses belong to different rigs.
    pub fn interpolate(&self, other: &Self, t: f64) -> Result<Self, PoseError> {
        let tangent: Vec<f64> = self.difference(other)?.into_iter().map(|d| d * t).collect();
        let mut pose = self.clone();
        pose.retract(&tangent)?;
        Ok(pose)
    }

    /// Moves every joint that is outside its limits to the nearest pose inside; says whether one was.
    pub fn project(&mut self) -> bool {
        let rig = self.rig.clone();
        let mut moved = false;
        for joint in rig.ids() {
            let data = &rig.joints()[joint.index()];
            if data.n_dofs() > 0 {
                moved |= project_joint(&data.motion, &mut self.coords[rig.coords_of(joint)]);
            }
        }
        moved
    }

    /// How far the joint that is furthest outside its limits lies outside, in radians or metres; 0 when all
    /// hold.
    #[must_use]
    pub fn limit_violation(&self) -> f64 {
        self.rig.ids().map(|j| self.violation(j)).fold(0.0, f64::max)
    }

    /// How far one joint lies outside its limits, in radians or metres; 0 inside.
    ///
    /// # Errors
    /// For the id of another, larger rig.
    pub fn limit_violation_of(&self, joint: JointId) -> Result<f64, ForeignJoint> {
        self.rig.own(joint)?;
        Ok(self.violation(joint))
    }

    pub(crate) fn violation(&self, joint: JointId) -> f64 {
        let data = &self.rig.joints()[joint.index()];
        if data.mimic.is_some() {
            return self.value(joint).map_or(0.0, |v| data.motion.ranges()[0].distance(v));
        }
        let coords = &self.coords[self.rig.coords_of(joint)];
        let angles = data.motion.ranges().iter().zip(coords).map(|(r, c)| r.distance(*c)).fold(0.0, f64::max);
        let cone = data.motion.cone().map_or([0.0; 2], |cone| cone.distance(self.rotation_of(joint)));
        angles.max(cone[0]).max(cone[1])
    }
}

/// The rotation vector of a unit quaternion, of length at most π.
#[must_use]
#[inline]
pub fn rotation_vector(q: DQuat) -> DVec3 {
    let q = if q.w < 0.0 { -q } else { q };
    let v = q.xyz();
    let sin = v.length();
    if sin < TINY { v * 2.0 } else { v * (2.0 * maths::atan2(sin, q.w) / sin) }
}

/// Moves one joint's coordinates along its tangent.
#[inline(always)]
pub fn retract_joint(motion: &JointMotion, coords: &mut [f64], tangent: &[f64]) {
    match motion {
        JointMotion::Fixed => {}
        JointMotion::Hinge { .. } | JointMotion::Slider { .. } => coords[0] += tangent[0],
        JointMotion::Euler { .. } => {
            for i in 0..3 {
                coords[i] += tangent[i];
            }
        }
        JointMotion::Ball { .. } => turn(coords, tangent),
        JointMotion::Free { .. } => {
            for i in 0..3 {
                coords[i] += tangent[i];
            }
            turn(&mut coords[3..], &tangent[3..]);
        }
    }
}

#[inline(always)]
fn turn(coords: &mut [f64], tangent: &[f64]) {
    let q = DQuat::from_slice(coords) * maths::turn_by(DVec3::from_slice(tangent));
    coords[..4].copy_from_slice(&q.normalize().to_array());
}

/// The tangent from one value of a joint to another.
#[inline(always)]
pub fn difference_joint(motion: &JointMotion, from: &[f64], to: &[f64], tangent: &mut [f64]) {
    match motion {
        JointMotion::Fixed => {}
        JointMotion::Hinge { range, .. } => {
            tangent[0] = angle_difference(to[0] - from[0], range.is_unlimited());
        }
        JointMotion::Slider { .. } => tangent[0] = to[0] - from[0],
        JointMotion::Euler { ranges, .. } => {
            for i in 0..3 {
                tangent[i] = angle_difference(to[i] - from[i], ranges[i].is_unlimited());
            }
        }
        JointMotion::Ball { .. } => turn_difference(from, to, tangent),
        JointMotion::Free { .. } => {
            for i in 0..3 {
                tangent[i] = to[i] - from[i];
            }
            turn_difference(&from[3..], &to[3..], &mut tangent[3..]);
        }
    }
}

fn turn_difference(from: &[f64], to: &[f64], tangent: &mut [f64]) {
    let omega = rotation_vector(DQuat::from_slice(from).inverse() * DQuat::from_slice(to));
    tangent[..3].copy_from_slice(&omega.to_array());
}

/// An angle that has no limits wraps: its difference takes the short way around.
#[inline(always)]
fn angle_difference(difference: f64, wraps: bool) -> f64 {
    use std::f64::consts::TAU;
    if wraps { difference - TAU * (difference / TAU).round() } else { difference }
}

/// Moves one joint's coordinates into its limits; says whether they were outside.
#[inline(always)]
pub fn project_joint(motion: &JointMotion, coords: &mut [f64]) -> bool {
    let mut moved = false;
    for (range, coord) in motion.ranges().iter().zip(coords.iter_mut()) {
        let clamped = range.clamp(*coord);
        moved |= clamped != *coord;
        *coord = clamped;
    }
    match motion {
        JointMotion::Ball { cone: Some(cone) } => moved |= project_ball(cone, coords),
        JointMotion::Free { cone: Some(cone) } => moved |= project_ball(cone, &mut coords[3..]),
        JointMotion::Ball { cone: None }
        | JointMotion::Free { cone: None }
        | JointMotion::Fixed
        | JointMotion::Hinge { .. }
        | JointMotion::Slider { .. }
        | JointMotion::Euler { .. } => {}
    }
    moved
}

fn project_ball(cone: &Cone, coords: &mut [f64]) -> bool {
    let q = DQuat::from_slice(coords);
    let Some(inside) = cone.project(q) else { return false };
    coords[..4].copy_from_slice(&inside.to_array());
    // A pose on the boundary comes back with rounding alone: that is not a move.
    q.dot(inside).abs() < 1.0 - 1e-15
}
