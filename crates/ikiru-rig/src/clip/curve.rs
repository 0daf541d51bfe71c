//! The smooth curve of one joint between two neighbouring poses of a clip.

use glam::DVec3;

use super::Clip;
use super::turn::{rate_of_log, velocity_of_exp};
use crate::joint::{JointId, JointMotion};
use crate::limit::Range;
use crate::pose::{difference_joint, project_joint, retract_joint};

/// One number for each degree of freedom of a joint; those that it does not have are 0.
pub(super) type Dofs = [f64; 6];

/// The numbers of a joint in a pose; those that it does not have are 0.
pub(super) type Coords = [f64; 7];

/// A joint's way from one pose to the next: `q(u) = q₀ · exp(φ(u))` with a cubic `φ`, `u` from 0 to 1.
///
/// `φ` lies in the tangent space of the pose on the left: it is 0 there, the difference to the next pose at 1, and
/// its slopes give both poses the velocity that the neighbours on either side of them agree on.
pub(super) struct Curve<'c> {
    motion: &'c JointMotion,
    n_coords: usize,
    left: Coords,
    /// From the left pose to the right one.
    pub(super) secs: f64,
    /// `φ(u) = u (k₀ + u (k₁ + u k₂))`.
    k: [Dofs; 3],
    /// Whether the cone holds the joint on the way, as it does at both ends.
    pub(super) is_in_cone: bool,
}

/// How near to its limit a joint counts as inside, in radians.
const INSIDE: f64 = 1e-9;

impl<'c> Curve<'c> {
    /// The way of a joint with degrees of freedom of its own from pose number `before` to the next, which
    /// must exist.
    pub(super) fn new(clip: &'c Clip, joint: JointId, before: usize) -> Self {
        let rig = clip.rig();
        let motion = &rig.joints()[joint.index()].motion;
        let at = rig.coords_of(joint);
        let mut left = [0.0; 7];
        left[..at.len()].copy_from_slice(&clip.poses[before].coords()[at.clone()]);
        let secs = clip.times[before + 1] - clip.times[before];
        let keys = Keys { clip, joint, motion, rotation: rotation_dofs(motion) };
        let k = keys.cubic(before);
        let is_inside = |pose: usize| clip.poses[pose].violation(joint) <= INSIDE;
        let is_in_cone = motion.cone().is_some() && is_inside(before) && is_inside(before + 1);
        Self { motion, n_coords: at.len(), left, secs, k, is_in_cone }
    }

    /// The joint's numbers at `u`.
    pub(super) fn coords(&self, u: f64) -> Coords {
        let mut coords = self.unlimited_coords(u);
        if self.is_in_cone {
            project_joint(self.motion, &mut coords[..self.n_coords]);
        }
        coords
    }

    fn unlimited_coords(&self, u: f64) -> Coords {
        let mut coords = self.left;
        let [k0, k1, k2] = &self.k;
        let phi: Dofs = std::array::from_fn(|i| u * (k0[i] + u * (k1[i] + u * k2[i])));
        retract_joint(self.motion, &mut coords[..self.n_coords], &phi);
        coords
    }

    /// The joint's velocity at `u`: radians or metres a second along each degree of freedom.
    pub(super) fn velocity(&self, u: f64) -> Dofs {
        if self.is_in_cone {
            let mut coords = self.unlimited_coords(u);
            if project_joint(self.motion, &mut coords[..self.n_coords]) {
                // On its cone it moves as the cone lets it, which is seen by looking a little around.
                return self.mean_velocity([(u - 1e-4).max(0.0), (u + 1e-4).min(1.0)]);
            }
        }
        let [k0, k1, k2] = &self.k;
        let mut velocity: Dofs =
            std::array::from_fn(|i| (k0[i] + u * (2.0 * k1[i] + u * 3.0 * k2[i])) / self.secs);
        if let Some(r) = rotation_dofs(self.motion) {
            let phi: Dofs = std::array::from_fn(|i| u * (k0[i] + u * (k1[i] + u * k2[i])));
            let turned = velocity_of_exp(DVec3::from_slice(&phi[r..]), DVec3::from_slice(&velocity[r..]));
            velocity[r..r + 3].copy_from_slice(&turned.to_array());
        }
        velocity
    }

    /// The joint's acceleration at `u`: radians or metres a second² along each degree of freedom.
    pub(super) fn acceleration(&self, u: f64) -> Dofs {
        // The velocity is smooth: central differences are as exact as anyone can use.
        self.mean_acceleration([(u - 1e-4).max(0.0), (u + 1e-4).min(1.0)])
    }

    /// The mean acceleration between two values of `u`.
    pub(super) fn mean_acceleration(&self, [a, b]: [f64; 2]) -> Dofs {
        let (before, after) = (self.velocity(a), self.velocity(b));
        std::array::from_fn(|i| (after[i] - before[i]) / ((b - a) * self.secs))
    }

    /// The mean velocity between two values of `u`.
    pub(super) fn mean_velocity(&self, [a, b]: [f64; 2]) -> Dofs {
        let (from, to) = (self.coords(a), self.coords(b));
        let mut tangent = [0.0; 6];
        difference_joint(self.motion, &from[..self.n_coords], &to[..self.n_coords], &mut tangent);
        tangent.map(|t| t / ((b - a) * self.secs))
    }
}

/// Where the three degrees of freedom of a ball stand among those of a joint.
fn rotation_dofs(motion: &JointMotion) -> Option<usize> {
    match motion {
        JointMotion::Ball { .. } => Some(0),
        JointMotion::Free { .. } => Some(3),
        JointMotion::Fixed
        | JointMotion::Hinge { .. }
        | JointMotion::Slider { .. }
        | JointMotion::Euler { .. } => None,
    }
}

/// The poses of one joint, seen as the keys of its curve.
struct Keys<'c> {
    clip: &'c Clip,
    joint: JointId,
    motion: &'c JointMotion,
    rotation: Option<usize>,
}

impl Keys<'_> {
    fn secs(&self, before: usize) -> f64 {
        self.clip.times[before + 1] - self.clip.times[before]
    }

    /// The difference between two neighbouring poses. Its components are the same in the tangent space of
    /// either, since a rotation leaves its own axis alone.
    fn step(&self, before: usize) -> Dofs {
        let mut step = [0.0; 6];
        let poses = &self.clip.poses;
        poses[before].difference_of(self.joint, &poses[before + 1], &mut step);
        step
    }

    /// The coefficients of `φ`.
    fn cubic(&self, before: usize) -> [Dofs; 3] {
        let (last, secs, step) = (self.clip.times.len() - 1, self.secs(before), self.step(before));
        let start = (before > 0).then(|| self.velocity(before, &self.step(before - 1), &step));
        let end = (before + 1 < last).then(|| self.velocity(before + 1, &step, &self.step(before + 1)));
        let start = start.map(|v| v.map(|v| v * secs));
        // The velocity of the right pose, carried to where φ lives.
        let end = end.map(|v| {
            let mut rate = v.map(|v| v * secs);
            if let Some(r) = self.rotation {
                let carried = rate_of_log(DVec3::from_slice(&step[r..]), DVec3::from_slice(&rate[r..]));
                rate[r..r + 3].copy_from_slice(&carried.to_array());
            }
            rate
        });
        // At either end of the clip the curve is a parabola, which asks for no velocity there.
        let other = |slope: Dofs| std::array::from_fn(|i| 2.0 * step[i] - slope[i]);
        let (mut start, mut end) = match (start, end) {
            (Some(start), Some(end)) => (start, end),
            (Some(start), None) => (start, other(start)),
            (None, Some(end)) => (other(end), end),
            (None, None) => (step, step),
        };
        for (i, range) in self.motion.ranges().iter().enumerate() {
            let [rise_left, fall_left] = self.room(before, before, i, range);
            let [rise_right, fall_right] = self.room(before, before + 1, i, range);
            start[i] = start[i].max(-3.0 * fall_left).min(3.0 * rise_left);
            end[i] = end[i].max(-3.0 * rise_right).min(3.0 * fall_right);
        }
        [
            start,
            std::array::from_fn(|i| 3.0 * step[i] - 2.0 * start[i] - end[i]),
            std::array::from_fn(|i| start[i] + end[i] - 2.0 * step[i]),
        ]
    }

    /// The velocity at a pose between two others: that of the parabola through the three, for any times.
    fn velocity(&self, key: usize, step_before: &Dofs, step_after: &Dofs) -> Dofs {
        let (h0, h1) = (self.secs(key - 1), self.secs(key));
        let mut velocity: Dofs =
            std::array::from_fn(|i| (step_before[i] / h0 * h1 + step_after[i] / h1 * h0) / (h0 + h1));
        // A cubic stays between its Bézier points, which lie a third of the slope beside the keys: where
        // those stay inside a range, so does the whole curve, on both sides.
        for (i, range) in self.motion.ranges().iter().enumerate() {
            let [rise_before, fall_before] = self.room(key - 1, key, i, range);
            let [rise_after, fall_after] = self.room(key, key, i, range);
            let most = (3.0 * fall_before / h0).min(3.0 * rise_after / h1);
            let least = -(3.0 * rise_before / h0).min(3.0 * fall_after / h1);
            velocity[i] = velocity[i].max(least).min(most);
        }
        velocity
    }

    /// How far number `i` may rise above and fall below a key's on the way from pose `before` to the next:
    /// to its range, widened to hold both poses.
    fn room(&self, before: usize, key: usize, i: usize, range: &Range) -> [f64; 2] {
        let coord = self.clip.rig().coords_of(self.joint).start + i;
        let [a, b, at] = [before, before + 1, key].map(|pose| self.clip.poses[pose].coords()[coord]);
        [(range.max.max(a).max(b) - at), (at - range.min.min(a).min(b))]
    }
}
