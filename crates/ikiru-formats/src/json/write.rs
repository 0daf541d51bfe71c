//! A pose → JSON, under the rig's own names.

use ikiru_rig::{JointId, Motion, Pose};
use serde_json::{Map, Value, json};

/// A pose as JSON:
/// `{"root_translation": [x, y, z], "joints": {NAME: {"rotation": [x, y, z, w], …}}}`.
///
/// Each of `joints` has its motion's rotation, on top of the rest rotation; besides it an Euler joint has
/// `"euler_deg"` (x, y, z), a hinge `"angle_deg"`, and a slider `"offset"` in metres. `root_translation` is
/// that of the topmost joint that moves, in metres on top of rest; zeros where it does not float. Ids that
/// the rig does not have are left out.
#[must_use]
pub fn pose_json(pose: &Pose, joints: &[JointId]) -> Value {
    let root = pose.rig().root().filter(|root| {
        pose.rig().get(*root).is_some_and(|joint| matches!(joint.motion, Motion::Free { .. }))
    });
    let translation = root.map_or([0.0; 3], |root| pose.translation(root).to_array());
    let mut named = Map::with_capacity(joints.len());
    for id in joints {
        let Some(joint) = pose.rig().get(*id) else { continue };
        let mut value = Map::new();
        value.insert("rotation".to_owned(), json!(pose.rotation(*id).to_array()));
        let scalar = pose.value(*id).unwrap_or(0.0);
        match joint.motion {
            Motion::Euler { .. } => {
                let angles = pose.euler(*id).unwrap_or_default().map(f64::to_degrees);
                value.insert("euler_deg".to_owned(), json!(angles));
            }
            Motion::Hinge { .. } => {
                value.insert("angle_deg".to_owned(), json!(scalar.to_degrees()));
            }
            Motion::Slider { .. } => {
                value.insert("offset".to_owned(), json!(scalar));
            }
            Motion::Fixed | Motion::Ball { .. } | Motion::Free { .. } => {}
        }
        named.insert(joint.name.clone(), Value::Object(value));
    }
    json!({ "root_translation": translation, "joints": named })
}
