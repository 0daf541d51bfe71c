//! The way of the hips through a clip, on a body of another size.

use glam::{DQuat, DVec3};

use crate::clip::Clip;
use crate::humanoid::Role;
use crate::humanoid::transfer_warning::TransferWarning;
use crate::joint::{JointId, JointMotion};
use crate::pose::Pose;
use crate::pose_error::PoseError;
use crate::rig::Rig;
use crate::rig_error::RigError;

/// How the hips of a target get through a clip.
pub(super) struct Way {
    /// The target, or the target with its root floating.
    pub(super) rig: Rig,
    /// The joint that translates.
    joint: JointId,
    /// Its translations, one a pose.
    translations: Vec<DVec3>,
}

/// A way as long as this (metres) is none.
const STILL: f64 = 1e-9;

impl Way {
    /// The way of a clip whose rig has the stance `from`, for a target in the stance `to`; `turn` leads from the
    /// heading of the one to that of the other. `None` where the hips stay in place.
    pub(super) fn new(
        clip: &Clip,
        from: &Pose,
        to: &Pose,
        turn: DQuat,
    ) -> Result<Option<Self>, TransferWarning> {
        let Some((hips, at_rest)) = from.rig().role(Role::Hips).zip(at(from, Role::Hips)) else {
            let moves = clip.poses().iter().any(|pose| pose.root_translation().length() > STILL);
            return if moves { Err(TransferWarning::NoHips { rig: "the clip's rig" }) } else { Ok(None) };
        };
        let places: Vec<DVec3> =
            clip.poses().iter().map(|pose| pose.kernel_frame(hips).origin.value()).collect();
        if places.iter().all(|place| place.distance(at_rest) <= STILL) {
            return Ok(None);
        }
        let target = to.rig();
        let no_hips = TransferWarning::NoHips { rig: "the target" };
        let (hips, target_at_rest) = target.role(Role::Hips).zip(at(to, Role::Hips)).ok_or(no_hips)?;
        let scale = scale(from, to);
        let mut start = at_rest;
        let mean = places.iter().map(|place| place.y).sum::<f64>() / places.len() as f64;
        if !stands(from) && stands(to) && legs(from).is_some_and(|legs| mean - at_rest.y > 0.5 * legs) {
            // Rest with the hips at the origin, motion over the ground: places are those of the world.
            start = turn.inverse() * target_at_rest / scale;
        }
        let steps: Vec<DVec3> = places.iter().map(|place| turn * (*place - start) * scale).collect();
        let metres = steps.iter().map(|step| step.length()).fold(0.0, f64::max);
        let (rig, joint) =
            carrier(target, hips).map_err(|reason| TransferWarning::HipsStay { metres, reason })?;
        let axes_from_world = rig.rest_pose().kernel_frame(joint).rotation.quaternion().inverse();
        let translations = steps.into_iter().map(|step| axes_from_world * step).collect();
        Ok(Some(Self { rig, joint, translations }))
    }

    /// Takes the hips along, in the pose of that position.
    pub(super) fn follow(&self, idx: usize, pose: &mut Pose) -> Result<(), PoseError> {
        self.translations.get(idx).map_or(Ok(()), |step| pose.set_translation(self.joint, *step))
    }
}

/// The nearest free joint at or above the hips of a rig; without one, the root floats of the rig that comes back.
fn carrier(target: &Rig, hips: JointId) -> Result<(Rig, JointId), RigError> {
    let floats = |id: &JointId| matches!(target.joints()[id.index()].motion, JointMotion::Free { .. });
    if let Some(joint) = target.ancestors(hips).find(floats) {
        return Ok((target.clone(), joint));
    }
    let mut builder = target.to_builder();
    let root = builder.free_root()?;
    Ok((builder.build()?, root))
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
    pose.rig().role(role).map(|joint| pose.kernel_frame(joint).origin.value())
}

/// Height of the lower foot.
pub(super) fn foot(pose: &Pose) -> Option<f64> {
    let feet = [Role::LeftFoot, Role::RightFoot].into_iter().filter_map(|foot| at(pose, foot));
    feet.map(|foot| foot.y).reduce(f64::min)
}

/// Height of the hips over the lower foot.
fn legs(pose: &Pose) -> Option<f64> {
    Some(at(pose, Role::Hips)?.y - foot(pose)?)
}

/// Whether the feet are about where the ground is, at a height of 0; so they are of a rig without feet.
pub(super) fn stands(pose: &Pose) -> bool {
    let (Some(foot), Some(legs)) = (foot(pose), legs(pose)) else { return true };
    (-0.25 * legs..=0.5 * legs).contains(&foot)
}

/// Distance from the hips to the head.
fn trunk(pose: &Pose) -> Option<f64> {
    Some(at(pose, Role::Hips)?.distance(at(pose, Role::Head)?))
}
