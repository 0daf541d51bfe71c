//! The T-pose of any humanoid, and the skeleton that VRM calls normalised.

use glam::{DQuat, DVec3};

use crate::humanoid::way::{foot, stands};
use crate::humanoid::{Role, facing};
use crate::joint::{Joint, JointId, JointMotion};
use crate::maths;
use crate::pose::Pose;
use crate::rig::{Rig, RigBuilder};
use crate::rig_error::RigError;

/// Bones of the left side and where they point in a T-pose, from the trunk outwards: the joint, the joints of
/// which the first that exists is its end, and whether it is a leg's (down) or an arm's (sideways).
const LIMBS: [(Role, &[Role], bool); 13] = {
    use Role::{
        LeftFoot, LeftHand, LeftIndexDistal, LeftIndexIntermediate, LeftIndexProximal, LeftLittleDistal,
        LeftLittleIntermediate, LeftLittleProximal, LeftLowerArm, LeftLowerLeg, LeftMiddleDistal,
        LeftMiddleIntermediate, LeftMiddleProximal, LeftRingDistal, LeftRingIntermediate, LeftRingProximal,
        LeftUpperArm, LeftUpperLeg,
    };
    [
        (LeftUpperLeg, &[LeftLowerLeg], true),
        (LeftLowerLeg, &[LeftFoot], true),
        (LeftUpperArm, &[LeftLowerArm], false),
        (LeftLowerArm, &[LeftHand], false),
        (LeftHand, &[LeftMiddleProximal, LeftRingProximal, LeftIndexProximal], false),
        (LeftIndexProximal, &[LeftIndexIntermediate], false),
        (LeftIndexIntermediate, &[LeftIndexDistal], false),
        (LeftMiddleProximal, &[LeftMiddleIntermediate], false),
        (LeftMiddleIntermediate, &[LeftMiddleDistal], false),
        (LeftRingProximal, &[LeftRingIntermediate], false),
        (LeftRingIntermediate, &[LeftRingDistal], false),
        (LeftLittleProximal, &[LeftLittleIntermediate], false),
        (LeftLittleIntermediate, &[LeftLittleDistal], false),
    ]
};

/// The T-pose of a rig with humanoid roles: from the rest pose, arms and fingers are turned sideways, legs
/// down, each the shortest way; feet keep their orientation in the world, trunk, head and thumbs stay as they
/// are. Joints that cannot turn freely, or have no role, stay at rest. Limits are not applied.
///
/// The character is taken to stand along +y; it may face +x, −x or −z as well as +z.
#[must_use]
pub fn t_pose(rig: &Rig) -> Pose {
    let mut pose = rig.rest_pose();
    let left = maths::turn_about(DVec3::Y, facing::heading(rig)) * DVec3::X;
    for (role, ends, down) in LIMBS {
        for mirrored in [false, true] {
            let side = |role: Role| rig.role(if mirrored { role.mirrored() } else { role });
            let (Some(joint), Some(end)) = (side(role), ends.iter().find_map(|end| side(*end))) else {
                continue;
            };
            let direction = match (down, mirrored) {
                (true, _) => DVec3::NEG_Y,
                (false, false) => left,
                (false, true) => -left,
            };
            let bone = pose.kernel_frame(end).origin.value() - pose.kernel_frame(joint).origin.value();
            if let Some(bone) = bone.try_normalize() {
                turn(&mut pose, joint, DQuat::from_rotation_arc(bone, direction));
            }
        }
    }
    let rest = rig.rest_pose();
    for foot in [Role::LeftFoot, Role::RightFoot].into_iter().filter_map(|foot| rig.role(foot)) {
        let (now, was) =
            (pose.kernel_frame(foot).rotation.quaternion(), rest.kernel_frame(foot).rotation.quaternion());
        turn(&mut pose, foot, was * now.inverse());
    }
    pose
}

/// Turns a joint about its origin by a rotation of the world, where it can turn.
fn turn(pose: &mut Pose, joint: JointId, by: DQuat) {
    let motion = pose.rotation_of(joint);
    let before = pose.kernel_frame(joint).rotation.quaternion() * motion.inverse();
    if pose.rig().get(joint).is_some_and(|j| turns_freely(&j.motion)) {
        // The rotation is finite, so it is never refused.
        let _ = pose.set_rotation(joint, before.inverse() * by * before * motion);
    }
}

pub(super) fn turns_freely(motion: &JointMotion) -> bool {
    matches!(motion, JointMotion::Ball { .. } | JointMotion::Free { .. } | JointMotion::Euler { .. })
}

/// The skeleton of a rig's humanoid bones alone, as VRM calls it normalised: one joint a role, called by its
/// role, at rest in T-pose and facing +z with all axes along the world's. The hips are free, all others balls.
/// A rig that rests with its hips at the origin is set on the ground: players measure a body by the height of
/// its hips. The eyes are left out: VRM's animations move them by where they look.
///
/// # Errors
/// When the rig has no humanoid roles at all: a rig needs a joint.
pub fn normalised(rig: &Rig) -> Result<Rig, RigError> {
    let (pose, turned) = (t_pose(rig), maths::turn_about(DVec3::Y, facing::heading(rig)).inverse());
    let at = |role: Role| rig.role(role).map(|joint| turned * pose.kernel_frame(joint).origin.value());
    let lift = if stands(&pose) { 0.0 } else { -foot(&pose).unwrap_or_default() };
    let mut builder = RigBuilder::new();
    let mut ids: [Option<JointId>; Role::ALL.len()] = [None; Role::ALL.len()];
    for role in Role::ALL.into_iter().filter(|role| !matches!(role, Role::LeftEye | Role::RightEye)) {
        let Some(position) = at(role) else { continue };
        let above = role.ancestors().find(|above| ids[*above as usize].is_some());
        let mut joint = Joint::new(role.name(), above.and_then(|above| ids[above as usize]));
        joint.rest_translation = position - above.and_then(at).unwrap_or_default();
        if above.is_none() {
            joint.rest_translation.y += lift;
        }
        joint.motion = if role == Role::Hips { JointMotion::FREE } else { JointMotion::BALL };
        joint.role = Some(role);
        ids[role as usize] = Some(builder.add(joint));
    }
    builder.build()
}
