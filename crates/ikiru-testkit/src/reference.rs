//! Forward kinematics once more, by 4×4 matrices alone and none of the library's kernels: what results are
//! recomputed with.

use glam::{DMat4, DQuat, DVec3, EulerRot};
use ikiru_rig::{EulerOrder, JointMotion, Pose};

/// `world_from_joint` of every joint, as matrices.
#[must_use]
pub fn world_matrices(pose: &Pose) -> Vec<DMat4> {
    let rig = pose.rig();
    let mut world: Vec<DMat4> = Vec::with_capacity(rig.n_joints());
    for id in rig.ids() {
        let joint = &rig.joints()[id.index()];
        let rest = DMat4::from_rotation_translation(joint.rest_rotation, joint.rest_translation);
        let coords = &pose.coords()[rig.coords_of(id)];
        let scalar = match joint.mimic {
            Some(mimic) => pose.coords()[rig.coords_of(mimic.leader)][0] * mimic.multiplier + mimic.offset,
            None => coords.first().copied().unwrap_or(0.0),
        };
        let quaternion = |c: &[f64]| DMat4::from_quat(DQuat::from_xyzw(c[0], c[1], c[2], c[3]));
        let motion = match joint.motion {
            JointMotion::Fixed => DMat4::IDENTITY,
            JointMotion::Hinge { axis, .. } => DMat4::from_axis_angle(axis, scalar),
            JointMotion::Slider { axis, .. } => DMat4::from_translation(axis * scalar),
            JointMotion::Euler { order, .. } => {
                let (x, y, z) = (coords[0], coords[1], coords[2]);
                let (order, a, b, c) = match order {
                    EulerOrder::Xyz => (EulerRot::XYZ, x, y, z),
                    EulerOrder::Xzy => (EulerRot::XZY, x, z, y),
                    EulerOrder::Yxz => (EulerRot::YXZ, y, x, z),
                    EulerOrder::Yzx => (EulerRot::YZX, y, z, x),
                    EulerOrder::Zxy => (EulerRot::ZXY, z, x, y),
                    EulerOrder::Zyx => (EulerRot::ZYX, z, y, x),
                };
                DMat4::from_euler(order, a, b, c)
            }
            JointMotion::Ball { .. } => quaternion(coords),
            JointMotion::Free { .. } => {
                DMat4::from_translation(DVec3::new(coords[0], coords[1], coords[2]))
                    * quaternion(&coords[3..])
            }
        };
        let parent = joint.parent.map_or(DMat4::IDENTITY, |p| world[p.index()]);
        world.push(parent * rest * motion);
    }
    world
}
