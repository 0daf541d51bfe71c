//! The limit of a ball once more, by the shortest arc of its axis and what remains: what poses are judged with.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec2, DVec3};
use ikiru_rig::{Cone, ConeCentre, JointId, JointMotion, Pose, Rig};

/// `L = P⁻¹ · (rest · q) · K`: what a cone limits of a rotation `q` of a joint with that rest rotation. Without a centre it is
/// `q`.
#[must_use]
pub fn limited_rotation(cone: &Cone, rest: DQuat, q: DQuat) -> DQuat {
    let about_rest = ConeCentre { parent_rotation: rest, ..ConeCentre::default() };
    let ConeCentre { parent_rotation, joint_rotation } = cone.centre().unwrap_or(about_rest);
    parent_rotation.inverse() * rest * q * joint_rotation
}

/// The swing, about the two axes of the half-widths, and the twist of L. Neither is defined where the swing is π.
#[must_use]
pub fn swing_and_twist(cone: &Cone, l: DQuat) -> (DVec2, f64) {
    let axis = cone.axis();
    let helper = if axis.x.abs() < 0.9 { DVec3::X } else { DVec3::Z };
    let first = (helper - axis * axis.dot(helper)).normalize();
    let arc = DQuat::from_rotation_arc(axis, (l * axis).normalize());
    let (swing, rest) = (arc.to_scaled_axis(), arc.inverse() * l);
    let twist = 2.0 * rest.xyz().dot(axis).atan2(rest.w);
    (DVec2::new(swing.dot(first), swing.dot(axis.cross(first))), twist - TAU * (twist / TAU).round())
}

/// How far outside its cone a joint of a pose lies, in radians; 0 inside, and for a joint without one. For the swing it is
/// the way along the ray from the middle, which is no shorter than the shortest.
#[must_use]
#[expect(clippy::expect_used, reason = "a joint that the pose does not have is a defect of the test")]
pub fn cone_excess(pose: &Pose, joint: JointId) -> f64 {
    let data = &pose.rig().joints()[joint.index()];
    let Some(cone) = data.motion.cone() else { return 0.0 };
    let l = limited_rotation(cone, data.rest_rotation, pose.rotation(joint).expect("a joint of the rig"));
    let (swing, twist) = swing_and_twist(cone, l);
    let widths = DVec2::from(cone.swing());
    let beyond = if widths.min_element() > 0.0 {
        let level = (swing / widths).length();
        swing.length() * (1.0 - 1.0 / level.max(1.0))
    } else {
        (swing.abs() - widths).max_element().max(0.0)
    };
    let (min, max) = (cone.twist().min, cone.twist().max);
    let around = |end: f64| (twist - end).abs().min(TAU - (twist - end).abs());
    let is_inside = (min..=max).contains(&twist) || swing.length() > PI - 1e-9;
    beyond.max(if is_inside { 0.0 } else { around(min).min(around(max)) })
}

/// The largest [`cone_excess`] of a pose.
#[must_use]
pub fn largest_cone_excess(pose: &Pose) -> f64 {
    pose.rig().ids().map(|joint| cone_excess(pose, joint)).fold(0.0, f64::max)
}

/// A rig with every cone about the rest pose.
#[must_use]
#[expect(clippy::expect_used, reason = "a valid rig stays one")]
pub fn without_centres(rig: &Rig) -> Rig {
    let mut builder = rig.to_builder();
    for joint in builder.joints_mut() {
        if let JointMotion::Ball { cone: Some(cone) } | JointMotion::Free { cone: Some(cone) } =
            &mut joint.motion
        {
            *cone = cone.without_centre();
        }
    }
    builder.build().expect("the rig was valid")
}
