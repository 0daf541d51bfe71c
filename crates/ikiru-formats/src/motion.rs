//! What the plain formats of a motion share: rotations that can be blended.

use glam::DQuat;
use ikiru_rig::{Clip, JointId};

/// The rotations of a joint's motion, one a pose (none for a joint that the rig does not have), neighbours on the same side of the sphere of quaternions.
pub(crate) fn aligned_rotations(clip: &Clip, joint: JointId) -> impl Iterator<Item = DQuat> + '_ {
    clip.poses().iter().scan(None, move |previous: &mut Option<DQuat>, pose| {
        let rotation = pose.rotation(joint).ok()?;
        let is_opposite = previous.is_some_and(|previous| rotation.dot(previous) < 0.0);
        *previous = Some(if is_opposite { -rotation } else { rotation });
        *previous
    })
}
