//! A clip of one humanoid, on another: through roles, whatever the joints are called and however they lie.

use glam::{DQuat, DVec3};

use crate::clip::{Clip, ClipError};
use crate::humanoid::t_pose::{t_pose, turns_freely};
use crate::humanoid::{Role, facing};
use crate::joint::{JointId, Motion};
use crate::maths;
use crate::pose::{Pose, PoseError};
use crate::rig::Rig;

/// The pose in which two rigs are taken to look alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// Both rigs' rest poses, as they are: right for rigs that rest in the same pose.
    Rest,
    /// The [T-pose](t_pose) of both: right for a clip of a rig that rests with its arms out on one whose arms
    /// hang.
    TPose,
}

/// Why a clip cannot be transferred.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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

/// The same motion on another rig, through humanoid roles.
///
/// For every role that both rigs have, the joint turns in the world from the reference pose as the clip's joint
/// does: with `R` the world rotation in the clip and `R₀`, `T₀` those of the two reference poses, it becomes
/// `R·R₀⁻¹·T₀`. So neither names nor the directions of local axes matter, nor joints in between that one of
/// the rigs lacks. Joints without a role, or with one that the clip's rig lacks, stay at rest. A hinge turns
/// about its axis as far as that rotation does. Limits are not applied; see [`Pose::project`].
///
/// The way of the hips from the reference, times the ratio of the hips' heights over the feet (of the lengths
/// of the trunk, where a rig has no feet), goes to the nearest [free](Motion::Free) joint at or above the
/// target's hips; without one the hips stay in place.
///
/// Both characters are taken to stand along +y; each may face +z, −z, +x or −x.
///
/// # Errors
/// When a rig has no roles, or the two have none in common; when the clip has numbers that are not finite.
pub fn transfer(clip: &Clip, target: &Rig, reference: Reference) -> Result<Clip, TransferError> {
    let Some(source) = clip.poses().first().map(Pose::rig) else { return Err(ClipError::Empty.into()) };
    let has_roles = |rig: &Rig| Role::ALL.iter().any(|role| rig.role(*role).is_some());
    if !has_roles(source) {
        return Err(TransferError::NoRoles("the clip's rig"));
    }
    if !has_roles(target) {
        return Err(TransferError::NoRoles("the target"));
    }
    let map = Map::new(source, target, reference);
    if map.pairs.iter().all(Option::is_none) {
        return Err(TransferError::NothingInCommon);
    }
    let mut poses: Vec<Pose> = Vec::with_capacity(clip.poses().len());
    for pose in clip.poses() {
        poses.push(map.pose(pose, poses.last())?);
    }
    Ok(Clip::new(clip.name(), clip.times().to_vec(), poses)?)
}

/// What is the same for all poses of a clip.
struct Map<'t> {
    target: &'t Rig,
    /// For each joint of the target: the source's joint of the same role, and what follows its world rotation.
    pairs: Vec<Option<(JointId, DQuat)>>,
    /// From the heading of the source to that of the target.
    turn: DQuat,
    hips: Option<Hips>,
}

/// How the hips translate.
struct Hips {
    source: JointId,
    source_at: DVec3,
    /// The joint that takes the translation.
    free: JointId,
    /// From the world to the frame in which that joint translates.
    frame_from_world: DQuat,
    scale: f64,
}

impl<'t> Map<'t> {
    fn new(source: &Rig, target: &'t Rig, reference: Reference) -> Self {
        let stance = |rig: &Rig| match reference {
            Reference::Rest => rig.rest_pose(),
            Reference::TPose => t_pose(rig),
        };
        let (from, to) = (stance(source), stance(target));
        let turn = maths::turn_about(DVec3::Y, facing::heading(target) - facing::heading(source));
        let mut pairs = vec![None; target.n_joints()];
        for role in Role::ALL {
            let (Some(a), Some(b)) = (source.role(role), target.role(role)) else { continue };
            let (r, t) = (from.frame(a).rotation.quaternion(), to.frame(b).rotation.quaternion());
            pairs[b.index()] = Some((a, r.inverse() * turn.inverse() * t));
        }
        let hips = Hips::new(&from, &to);
        Self { target, pairs, turn, hips }
    }

    fn pose(&self, from: &Pose, before: Option<&Pose>) -> Result<Pose, PoseError> {
        let source_frames = from.frames();
        let mut pose = self.target.rest_pose();
        let mut world: Vec<DQuat> = Vec::with_capacity(self.target.n_joints());
        for (id, joint) in self.target.ids().zip(self.target.joints()) {
            let parent = joint.parent.map_or(DQuat::IDENTITY, |parent| world[parent.index()]);
            let at_rest = parent * joint.rest_rotation;
            if let Some((source, after)) = self.pairs[id.index()] {
                let wanted = self.turn * source_frames[source.index()].rotation.quaternion() * after;
                set(&mut pose, id, (at_rest.inverse() * wanted).normalize(), before)?;
            }
            world.push((at_rest * pose.rotation(id)).normalize());
        }
        if let Some(hips) = &self.hips {
            let way = source_frames[hips.source.index()].origin.value() - hips.source_at;
            let way = self.turn * way * hips.scale;
            pose.set_translation(hips.free, hips.frame_from_world * way)?;
        }
        Ok(pose)
    }
}

impl Hips {
    fn new(from: &Pose, to: &Pose) -> Option<Self> {
        let (source, hips) = (from.rig().role(Role::Hips)?, to.rig().role(Role::Hips)?);
        let target = to.rig();
        let is_free = |joint: &JointId| {
            target.get(*joint).is_some_and(|joint| matches!(joint.motion, Motion::Free { .. }))
        };
        let free = target.ancestors(hips).find(is_free)?;
        Some(Self {
            source,
            source_at: from.frame(source).origin.value(),
            free,
            frame_from_world: target.rest_pose().frame(free).rotation.quaternion().inverse(),
            scale: scale(from, to),
        })
    }
}

/// How much larger the target is than the source.
fn scale(from: &Pose, to: &Pose) -> f64 {
    let ratio = |length: fn(&Pose) -> Option<f64>| {
        let (from, to) = (length(from)?, length(to)?);
        (from > 1e-9 && to > 1e-9).then_some(to / from)
    };
    ratio(legs).or_else(|| ratio(trunk)).unwrap_or(1.0)
}

fn at(pose: &Pose, role: Role) -> Option<DVec3> {
    pose.rig().role(role).map(|joint| pose.frame(joint).origin.value())
}

/// Height of the hips over the lower foot.
fn legs(pose: &Pose) -> Option<f64> {
    let feet = [Role::LeftFoot, Role::RightFoot].into_iter().filter_map(|foot| at(pose, foot));
    let lowest = feet.map(|foot| foot.y).reduce(f64::min)?;
    Some(at(pose, Role::Hips)?.y - lowest)
}

/// Distance from the hips to the head.
fn trunk(pose: &Pose) -> Option<f64> {
    Some(at(pose, Role::Hips)?.distance(at(pose, Role::Head)?))
}

/// Lets one joint turn as near to a rotation as it can.
fn set(pose: &mut Pose, id: JointId, rotation: DQuat, before: Option<&Pose>) -> Result<(), PoseError> {
    let Some(joint) = pose.rig().get(id) else { return Ok(()) };
    match (joint.motion, joint.mimic) {
        (Motion::Euler { order, .. }, _) => {
            let previous = before.and_then(|pose| pose.euler(id)).unwrap_or_default();
            pose.set_euler(id, order.angles_near(rotation, previous))
        }
        (Motion::Hinge { axis, .. }, None) => {
            let angle = 2.0 * maths::atan2(rotation.xyz().dot(axis), rotation.w);
            pose.set_value(id, angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round())
        }
        (motion, _) if turns_freely(&motion) => pose.set_rotation(id, rotation),
        _ => Ok(()),
    }
}
