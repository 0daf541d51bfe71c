//! JSON → a pose: a motion of one frame, as far as checking goes.

use ikiru_rig::{JointMotion, Pose, Rig};
use serde::Deserialize;

use super::document::{Angles, Document, List, Named, Numbers, parse};
use super::read;
use crate::error::{Error, Fault};

/// Reads a pose as [`pose_json`](crate::pose_json) and `ikiru solve --out pose.json` write it, on top of
/// another pose of the rig, or the one under `"pose"` in what `ikiru solve --json` prints; `name` stands in messages.
///
/// Other members are left alone. Joints answer to their names, other names and humanoid roles; those that the file does
/// not name stay as in `base`. Quaternions are brought to unit length. Angles count where the joint has such, since
/// they know of whole turns; else its rotation does. Followers follow. Limits are not applied.
///
/// # Errors
/// When the text is not JSON or lacks a member, the rig does not have a joint, or a joint cannot move as its entry
/// says. The error names the member (a JSON pointer), what was found and what was expected.
///
/// ```
/// let rig = ikiru_formats::builtin("human")?.rig;
/// let elbow = rig.joint("leftLowerArm")?;
/// let mut pose = rig.rest_pose();
/// pose.set_rotation(elbow, glam::DQuat::from_rotation_y(-1.0))?;
/// let text = ikiru_formats::pose_json(&pose, &[elbow]).to_string();
/// let again = ikiru_formats::read_pose_json(text.as_bytes(), "bent.json", &rig.rest_pose())?;
/// assert_eq!(again.rotation(elbow)?, pose.rotation(elbow)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_pose_json(bytes: &[u8], name: &str, base: &Pose) -> Result<Pose, Error> {
    read_one(bytes, base).map_err(|fault| fault.in_file(name))
}

/// What is read of a pose.
#[derive(Deserialize)]
#[serde(expecting = "a pose object")]
struct PoseMembers {
    root_translation: Numbers<3>,
    joints: Named<PoseJoint>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object with \"rotation\"")]
struct PoseJoint {
    rotation: Numbers<4>,
    euler_deg: Option<Numbers<3>>,
    angle_deg: Option<f64>,
    offset: Option<f64>,
    /// Of a free joint that is not the root.
    translation: Option<Numbers<3>>,
}

fn read_one(bytes: &[u8], base: &Pose) -> Result<Pose, Fault> {
    let members = members(bytes)?;
    let mut document = Document {
        times: List(vec![0.0]),
        root_translation: List(vec![members.root_translation]),
        joints: Named::default(),
        angles: Named::default(),
        translations: Named::default(),
    };
    for (name, joint) in members.joints.0 {
        if let Some(angles) = joint.angles(base.rig(), &name) {
            document.angles.0.push((name.clone(), angles));
        }
        if let Some(translation) = joint.translation {
            document.translations.0.push((name.clone(), List(vec![translation])));
        }
        document.joints.0.push((name, List(vec![joint.rotation])));
    }
    let mut poses = read::poses(&document, base).map_err(Fault::of_pose)?;
    Ok(poses.pop().unwrap_or_else(|| base.clone()))
}

/// A pose, or that of a report: which of both is seen before it is read, so that an error is about the right one.
fn members(bytes: &[u8]) -> Result<PoseMembers, Fault> {
    #[derive(Deserialize)]
    struct Report {
        pose: PoseMembers,
    }
    #[derive(Deserialize)]
    #[serde(expecting = "a pose object")]
    struct Kind {
        pose: Option<serde::de::IgnoredAny>,
    }
    let kind: Kind = parse(bytes)?;
    if kind.pose.is_some() { parse::<Report>(bytes).map(|report| report.pose) } else { parse(bytes) }
}

impl PoseJoint {
    /// Its angles in the one frame, where the joint can take such; an offset always counts, for no rotation tells it.
    fn angles(&self, rig: &Rig, name: &str) -> Option<Angles> {
        let motion = rig.joint(name).ok().and_then(|id| rig.get(id)).map(|joint| joint.motion);
        let mut angles = Angles { euler_deg: None, angle_deg: None, offset: None };
        match motion {
            Some(JointMotion::Euler { .. }) => {
                angles.euler_deg = self.euler_deg.as_ref().map(|Numbers(a)| List(vec![Numbers(*a)]));
            }
            Some(JointMotion::Hinge { .. }) => {
                angles.angle_deg = self.angle_deg.map(|angle| List(vec![angle]));
            }
            Some(
                JointMotion::Fixed
                | JointMotion::Slider { .. }
                | JointMotion::Ball { .. }
                | JointMotion::Free { .. },
            )
            | None => {}
        }
        angles.offset = self.offset.map(|offset| List(vec![offset]));
        let is_empty = angles.euler_deg.is_none() && angles.angle_deg.is_none() && angles.offset.is_none();
        (!is_empty).then_some(angles)
    }
}
