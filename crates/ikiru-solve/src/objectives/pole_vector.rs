//! Pole vector: to which side a limb bends.

use glam::DVec3;
use ikiru_rig::{Frame, JointId, Scalar, Vec3};

use crate::objective::Unfit;
use crate::objective::residual::Residual;
use crate::objectives::position::check_target;
use crate::words::Unit;

/// Turns a limb about the line from its root to its end, so that its middle joint bends towards a point: an elbow
/// outwards, a knee forwards.
///
/// Residual: the angle about that line from the middle joint to the point, 1 row in radians, signed. A stretched limb,
/// and a point on the line, have no side: the residual is 0 there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoleVector {
    /// The limb's root, middle and end: shoulder, elbow, hand.
    pub joints: [JointId; 3],
    /// The point, in the world (metres).
    pub target: DVec3,
}

impl Residual for PoleVector {
    fn kind(&self) -> &'static str {
        "pole_vector"
    }

    fn joints(&self) -> &[JointId] {
        &self.joints
    }

    fn unit(&self) -> Unit {
        Unit::Radians
    }

    fn check(&self) -> Result<(), Unfit> {
        check_target(self.target)
    }

    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        let [root, middle, end] = [0, 1, 2].map(|i| frames[i].origin);
        let line = end - root;
        let length = line.length();
        let (to_middle, to_pole) =
            (line.cross(middle - root), line.cross(Vec3::constant(self.target) - root));
        let smallest = length * 1e-9 * length;
        let has_side = length.gt(1e-9) & to_middle.length().gt(smallest) & to_pole.length().gt(smallest);
        // Both are perpendicular to the line, turned a quarter: the angle between them is the same.
        let angle = (line.dot(to_middle.cross(to_pole)) / length).atan2(to_middle.dot(to_pole));
        residual[0] = S::select(has_side, angle, S::zero());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::{check_on_whole_rigs, residual_at};
    use crate::objective::UnfitReason;

    fn at(points: [DVec3; 3]) -> [Frame<f64>; 3] {
        points.map(|p| Frame { origin: p.into(), ..Frame::identity() })
    }

    #[test]
    fn derivatives() {
        check_on_whole_rigs(|rig, random| {
            let joints = [0, 1, 2].map(|_| JointId::from_index(random.below(rig.n_joints())));
            // A limb that is nearly stretched bends its angle faster than differences can follow.
            let frames = rig.rest_pose().frames();
            let [a, b, c] = joints.map(|j| frames[j.index()].position);
            let bent = (c - a).cross(b - a).length() > 0.05;
            PoleVector { joints: if bent { joints } else { [joints[0]; 3] }, target: random.vector(2.0) }
        });
    }

    #[test]
    fn the_angle_is_measured_about_the_line() {
        let joints = [0, 1, 2].map(JointId::from_index);
        let limb = at([DVec3::ZERO, DVec3::new(0.3, 0.1, 0.0), DVec3::new(0.6, 0.0, 0.0)]);
        let angle = |target: DVec3| residual_at(&PoleVector { joints, target }, &limb)[0];
        assert!(angle(DVec3::new(0.1, 5.0, 0.0)).abs() < 1e-12);
        assert!((angle(DVec3::new(0.1, 0.0, 5.0)).abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((angle(DVec3::new(0.1, 0.0, 5.0)) + angle(DVec3::new(0.1, 0.0, -5.0))).abs() < 1e-12);
        assert_eq!(angle(DVec3::new(7.0, 0.0, 0.0)), 0.0);
        let straight = at([DVec3::ZERO, DVec3::X, DVec3::X * 2.0]);
        assert_eq!(residual_at(&PoleVector { joints, target: DVec3::Y }, &straight), [0.0]);
    }
    #[test]
    fn a_target_that_is_not_finite_is_refused() {
        let joints = [0, 1, 2].map(JointId::from_index);
        assert!(Residual::check(&PoleVector { joints, target: DVec3::ONE }).is_ok());
        let refused = Residual::check(&PoleVector { joints, target: DVec3::NAN });
        assert_eq!(refused, Err(UnfitReason::Target.into()));
    }
}
