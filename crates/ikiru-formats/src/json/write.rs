//! A pose or a motion → JSON, under the rig's own names.

use glam::DVec3;
use ikiru_rig::{Clip, JointId, JointMotion, Pose};
use serde_json::{Map, Value, json};

use super::key;
use crate::motion::aligned_rotations;

/// A pose as JSON:
/// `{"root": NAME or null, "root_translation": [x, y, z], "joints": {NAME: {"rotation": [x, y, z, w], …}}}`.
///
/// Each of `joints` has its motion's rotation, on top of the rest rotation; besides it an Euler joint has
/// `"euler_deg"` (x, y, z), a hinge `"angle_deg"`, and a slider `"offset"` in metres. `root` is the root of the
/// body where it floats ([`Rig::floating_root`](ikiru_rig::Rig::floating_root)), `root_translation` how far it
/// is from where it is at rest, in metres along the world's axes; null and zeros where it does not float. Any
/// other free joint has a `"translation"`, as [`Pose::translation`] gives it. Ids that the rig does not have
/// are left out.
#[must_use]
pub fn pose_json(pose: &Pose, joints: &[JointId]) -> Value {
    let root = pose.rig().floating_root();
    let mut named = Map::with_capacity(joints.len());
    for id in joints {
        let (Some(joint), Ok(rotation)) = (pose.rig().get(*id), pose.rotation(*id)) else { continue };
        let mut value = Map::new();
        value.insert("rotation".to_owned(), json!(rotation.to_array()));
        let scalar = pose.value(*id).unwrap_or(0.0);
        match joint.motion {
            JointMotion::Euler { .. } => {
                let angles = pose.euler(*id).unwrap_or_default().map(f64::to_degrees);
                value.insert(key::EULER.to_owned(), json!(angles));
            }
            JointMotion::Hinge { .. } => {
                value.insert(key::ANGLE.to_owned(), json!(scalar.to_degrees()));
            }
            JointMotion::Slider { .. } => {
                value.insert(key::OFFSET.to_owned(), json!(scalar));
            }
            JointMotion::Free { .. } if Some(*id) != root => {
                value.insert(
                    "translation".to_owned(),
                    json!(pose.translation(*id).unwrap_or_default().to_array()),
                );
            }
            JointMotion::Fixed | JointMotion::Ball { .. } | JointMotion::Free { .. } => {}
        }
        named.insert(joint.name.clone(), Value::Object(value));
    }
    let root = root.and_then(|root| pose.rig().get(root)).map(|joint| &joint.name);
    json!({ "root": root, "root_translation": pose.root_translation().to_array(), "joints": named })
}

/// A clip as JSON, one entry a frame:
/// `{"times": [s], "root_translation": [[x, y, z]], "joints": {NAME: [[x, y, z, w]]}}`.
///
/// Each of `joints` has the rotations of its motion, on top of the rest rotation, neighbours on the same side (so
/// that numbers may be blended); `root_translation` is how far the root of the body is from where it is at rest,
/// in metres along the world's axes, zeros where it does not float. Where rotations do not tell everything, two more members do:
/// `"angles": {NAME: {"euler_deg": [[x, y, z]]}}` for an Euler joint, `{"angle_deg": [°]}` for a hinge,
/// `{"offset": [m]}` for a slider; and `"translations": {NAME: [[x, y, z]]}` for free joints besides the
/// root. Both are left out where they would be empty. Angles without limits go on from frame to frame and may be more
/// than a turn ([`Clip::unwrapped`]). Ids that the rig does not have are left out.
///
/// [`read_motion_json`](crate::read_motion_json) reads it. Numbers that are not finite become `null`, which
/// it refuses.
///
/// ```
/// use ikiru_rig::Clip;
///
/// let rig = ikiru_formats::builtin("human")?.rig;
/// let wrist = rig.joint("leftHand")?;
/// let mut wave = rig.rest_pose();
/// wave.set_rotation(wrist, glam::DQuat::from_rotation_z(0.5))?;
/// let clip = Clip::new("wave", vec![0.0, 0.5], vec![rig.rest_pose(), wave])?;
/// let text = ikiru_formats::motion_json(&clip, &[wrist]).to_string();
/// let again = ikiru_formats::read_motion_json(text.as_bytes(), "wave.json", &rig)?;
/// assert!((again.poses()[1].rotation(wrist)?.z - 0.25_f64.sin()).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn motion_json(clip: &Clip, joints: &[JointId]) -> Value {
    let clip = &clip.clone().unwrapped();
    let rig = clip.rig();
    let root = rig.floating_root();
    let numbers = |of: &dyn Fn(&Pose) -> DVec3| -> Vec<[f64; 3]> {
        clip.poses().iter().map(|pose| of(pose).to_array()).collect()
    };
    let (mut rotations, mut angles, mut moved) = (Map::new(), Map::new(), Map::new());
    for id in joints {
        let Some(joint) = rig.get(*id) else { continue };
        let turns: Vec<[f64; 4]> = aligned_rotations(clip, *id).map(|q| q.to_array()).collect();
        rotations.insert(joint.name.clone(), json!(turns));
        let values = || clip.poses().iter().map(|pose| pose.value(*id).unwrap_or_default());
        let angles_of = match joint.motion {
            JointMotion::Euler { .. } => {
                let euler = |pose: &Pose| pose.euler(*id).unwrap_or_default().map(f64::to_degrees);
                json!({ key::EULER: clip.poses().iter().map(euler).collect::<Vec<_>>() })
            }
            JointMotion::Hinge { .. } => {
                json!({ key::ANGLE: values().map(f64::to_degrees).collect::<Vec<_>>() })
            }
            JointMotion::Slider { .. } => json!({ key::OFFSET: values().collect::<Vec<_>>() }),
            JointMotion::Free { .. } if Some(*id) != root => {
                moved.insert(
                    joint.name.clone(),
                    json!(numbers(&|pose| pose.translation(*id).unwrap_or_default())),
                );
                continue;
            }
            JointMotion::Fixed | JointMotion::Ball { .. } | JointMotion::Free { .. } => continue,
        };
        angles.insert(joint.name.clone(), angles_of);
    }
    let mut motion = Map::new();
    motion.insert("times".to_owned(), json!(clip.times()));
    motion.insert("root_translation".to_owned(), json!(numbers(&Pose::root_translation)));
    motion.insert("joints".to_owned(), Value::Object(rotations));
    for (name, members) in [("angles", angles), ("translations", moved)] {
        if !members.is_empty() {
            motion.insert(name.to_owned(), Value::Object(members));
        }
    }
    Value::Object(motion)
}
