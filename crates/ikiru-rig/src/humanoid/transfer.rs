//! A clip of one humanoid, on another: through roles, whatever the joints are called and however they lie.

use glam::{DQuat, DVec3};

use crate::clip::{Clip, ClipError};
use crate::humanoid::t_pose::{t_pose, turns_freely};
use crate::humanoid::transfer_warning::TransferWarning;
use crate::humanoid::way::Way;
use crate::humanoid::{Role, facing};
use crate::joint::{JointId, JointMotion};
use crate::maths;
use crate::pose::Pose;
use crate::pose_error::PoseError;
use crate::rig::Rig;

/// The pose in which two rigs are taken to look alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reference {
    /// Both rigs' rest poses, as they are: right for rigs that rest in the same pose.
    Rest,
    /// The [T-pose](t_pose) of both: right for a clip of a rig that rests with its arms out on one whose arms
    /// hang.
    TPose,
}

/// A clip on another rig.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Transferred {
    /// The clip. Its rig is the target, or the target with its root floating, where the hips need that.
    pub clip: Clip,
    /// What got lost on the way.
    pub warnings: Vec<TransferWarning>,
}

/// Why a clip cannot be transferred.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TransferError {
    /// No joint of the clip's rig, or of the target, has a role.
    #[error("{0} has no humanoid roles, by which its joints could be found")]
    NoRoles(&'static str),
    /// The two rigs share no role.
    #[error("the rigs have no humanoid role in common")]
    NothingInCommon,
    /// The clip has a pose with numbers that are not finite.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// The poses do not make a clip.
    #[error(transparent)]
    Clip(#[from] ClipError),
}

/// A clip's motion on another rig, through humanoid roles.
///
/// For every role that both rigs have, the joint turns in the world from the reference pose as the clip's joint
/// does: with `R` the world rotation in the clip and `R₀`, `T₀` those of the two reference poses, it becomes
/// `R·R₀⁻¹·T₀`. So neither names nor the directions of local axes matter, nor joints in between that one of
/// the rigs lacks. Joints without a role, or with one that the clip's rig lacks, stay at rest. A hinge turns
/// about its axis as far as that rotation does. Limits are not applied; see [`Pose::project`].
///
/// The way of the hips from the reference, times the ratio of the hips' heights over the feet (of the lengths
/// of the trunk, where a rig has no feet), goes to the nearest [free](JointMotion::Free) joint at or above the
/// target's hips. A target without one gets one, where the hips move at all: its root floats
/// ([`RigBuilder::free_root`](crate::RigBuilder::free_root)), and the clip is one of that rig, which has the target's joints at the
/// target's places. Many motion files rest with the hips at the origin and move over the ground: on a target
/// that stands on the ground at rest, the hips are then where those of the clip are in the world, times that ratio.
///
/// Both characters are taken to stand along +y; each may face +z, −z, +x or −x.
///
/// # Errors
/// When a rig has no roles, or the two have none in common; when the clip has numbers that are not finite.
pub fn transfer(clip: &Clip, target: &Rig, reference: Reference) -> Result<Transferred, TransferError> {
    let Some(source) = clip.poses().first().map(Pose::rig) else { return Err(ClipError::Empty.into()) };
    let has_roles = |rig: &Rig| Role::ALL.iter().any(|role| rig.role(*role).is_some());
    if !has_roles(source) {
        return Err(TransferError::NoRoles("the clip's rig"));
    }
    if !has_roles(target) {
        return Err(TransferError::NoRoles("the target"));
    }
    let stance = |rig: &Rig| match reference {
        Reference::Rest => rig.rest_pose(),
        Reference::TPose => t_pose(rig),
    };
    let (from, to) = (stance(source), stance(target));
    let turn = maths::turn_about(DVec3::Y, facing::heading(target) - facing::heading(source));
    let (way, warnings) = match Way::new(clip, &from, &to, turn) {
        Ok(way) => (way, Vec::new()),
        Err(warning) => (None, vec![warning]),
    };
    let rig = way.as_ref().map_or(target, |way| &way.rig);
    let map = Map::new(&from, &to, rig.clone(), turn);
    if map.pairs.iter().all(Option::is_none) {
        return Err(TransferError::NothingInCommon);
    }
    let mut poses: Vec<Pose> = Vec::with_capacity(clip.poses().len());
    for (idx, from) in clip.poses().iter().enumerate() {
        let mut pose = map.pose(from, poses.last())?;
        if let Some(way) = &way {
            way.follow(idx, &mut pose)?;
        }
        poses.push(pose);
    }
    Ok(Transferred { clip: Clip::new(clip.name(), clip.times().to_vec(), poses)?, warnings })
}

/// What is the same for all poses of a clip.
struct Map {
    target: Rig,
    /// For each joint of the target: the source's joint of the same role, and what follows its world rotation.
    pairs: Vec<Option<(JointId, DQuat)>>,
    /// From the heading of the source to that of the target.
    turn: DQuat,
}

impl Map {
    /// `target` has the joints of the stance `to`.
    fn new(from: &Pose, to: &Pose, target: Rig, turn: DQuat) -> Self {
        let mut pairs = vec![None; target.n_joints()];
        for role in Role::ALL {
            let (Some(a), Some(b)) = (from.rig().role(role), target.role(role)) else { continue };
            let (r, t) =
                (from.kernel_frame(a).rotation.quaternion(), to.kernel_frame(b).rotation.quaternion());
            pairs[b.index()] = Some((a, r.inverse() * turn.inverse() * t));
        }
        Self { target, pairs, turn }
    }

    fn pose(&self, from: &Pose, before: Option<&Pose>) -> Result<Pose, PoseError> {
        let source_frames = from.kernel_frames();
        let mut pose = self.target.rest_pose();
        let mut world: Vec<DQuat> = Vec::with_capacity(self.target.n_joints());
        for (id, joint) in self.target.ids().zip(self.target.joints()) {
            let parent = joint.parent.map_or(DQuat::IDENTITY, |parent| world[parent.index()]);
            let at_rest = parent * joint.rest_rotation;
            if let Some((source, after)) = self.pairs[id.index()] {
                let wanted = self.turn * source_frames[source.index()].rotation.quaternion() * after;
                set(&mut pose, id, (at_rest.inverse() * wanted).normalize(), before)?;
            }
            world.push((at_rest * pose.rotation_of(id)).normalize());
        }
        Ok(pose)
    }
}

/// Lets one joint turn as near to a rotation as it can.
fn set(pose: &mut Pose, id: JointId, rotation: DQuat, before: Option<&Pose>) -> Result<(), PoseError> {
    let Some(joint) = pose.rig().get(id) else { return Ok(()) };
    match (joint.motion, joint.mimic) {
        (JointMotion::Euler { order, .. }, _) => {
            let previous = before.and_then(|pose| pose.euler(id)).unwrap_or_default();
            pose.set_euler(id, order.angles_near(rotation, previous))
        }
        (JointMotion::Hinge { axis, .. }, None) => {
            let angle = 2.0 * maths::atan2(rotation.xyz().dot(axis), rotation.w);
            pose.set_value(id, angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round())
        }
        (motion, _) if turns_freely(&motion) => pose.set_rotation(id, rotation),
        (JointMotion::Hinge { .. }, Some(_))
        | (
            JointMotion::Fixed
            | JointMotion::Slider { .. }
            | JointMotion::Ball { .. }
            | JointMotion::Free { .. },
            _,
        ) => Ok(()),
    }
}
