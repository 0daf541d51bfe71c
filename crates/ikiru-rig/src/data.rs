//! Poses and clips as plain data for serde, with joints by their names and numbers to the last bit.

use std::collections::BTreeMap;

use glam::DQuat;
use serde::{Deserialize, Serialize, Serializer};

use crate::clip::{Clip, ClipError};
use crate::joint::{Joint, JointId, JointMotion};
use crate::name::UnknownName;
use crate::pose::Pose;
use crate::rig::Rig;

/// How far the length of a quaternion may be from 1, squared.
const UNIT: f64 = 2e-6;

/// A pose as data: what [`Pose`] serialises to, and what it is read back from.
///
/// Every joint with a degree of freedom of its own stands under the rig's own name for it. Data knows no rig, so that reading
/// takes two steps, and [`pose`](Self::pose) says what does not fit.
///
/// Angles are radians and lengths metres, so that they come back to the last bit (degrees would not). That is up to the format, too:
/// of `serde_json` it takes the feature `float_roundtrip`, which `ikiru-formats` turns on.
///
/// ```
/// use ikiru_rig::{Joint, JointMotion, PoseData, Range, RigBuilder};
/// use glam::DVec3;
///
/// let mut builder = RigBuilder::new();
/// let mut knee = Joint::new("knee", None);
/// knee.motion = JointMotion::Hinge { axis: DVec3::X, range: Range::degrees(0.0, 150.0) };
/// let knee = builder.add(knee);
/// let rig = builder.build()?;
/// let mut pose = rig.rest_pose();
/// pose.set_value(knee, 0.25)?;
///
/// let text = serde_json::to_string(&pose)?;
/// assert_eq!(text, r#"{"joints":{"knee":{"angle":0.25}}}"#);
/// let data: PoseData = serde_json::from_str(&text)?;
/// assert_eq!(data.pose(&rig)?, pose);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseData {
    /// What each joint does, by its name.
    pub joints: BTreeMap<String, JointData>,
}

/// What one joint does on top of its rest transform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum JointData {
    /// The angle of a hinge, radians.
    Angle(f64),
    /// The offset of a slider, metres.
    Offset(f64),
    /// The angles (x, y, z) of an Euler joint, radians.
    Euler([f64; 3]),
    /// The rotation of a ball, a unit quaternion (x, y, z, w).
    Rotation([f64; 4]),
    /// What a joint that floats does.
    Free {
        /// Its translation in its parent's frame after the rest transform, metres.
        translation: [f64; 3],
        /// Its rotation, a unit quaternion (x, y, z, w).
        rotation: [f64; 4],
    },
}

/// A clip as data: what [`Clip`] serialises to, and what it is read back from; see [`PoseData`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClipData {
    /// Its name; may be empty.
    pub name: String,
    /// The times of its poses, seconds, increasing.
    pub times: Vec<f64>,
    /// The poses, one a time.
    pub poses: Vec<PoseData>,
}

/// Why data is no pose or clip of a rig.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// A name that no joint of the rig has.
    #[error("the rig has no such joint: {0}")]
    Unknown(#[from] UnknownName),
    /// A joint of the rig that the data does not have.
    #[error("joint '{joint}' is missing: expected {expected}")]
    Missing {
        /// Name of the joint.
        joint: String,
        /// What it has.
        expected: &'static str,
    },
    /// The data of another kind of joint.
    #[error("joint '{joint}' has {found}: expected {expected}")]
    Kind {
        /// Name of the joint.
        joint: String,
        /// What the data has.
        found: &'static str,
        /// What the joint has.
        expected: &'static str,
    },
    /// A number that is not finite, or a quaternion that is not of length 1.
    #[error("joint '{0}': expected finite numbers, a rotation of length 1 (to 1e-6)")]
    Value(String),
    /// A pose of a clip.
    #[error("pose {idx}: {source}")]
    Pose {
        /// Its position.
        idx: usize,
        /// What is wrong with it.
        source: Box<DataError>,
    },
    /// Times and poses that make no clip.
    #[error(transparent)]
    Clip(#[from] ClipError),
}

impl JointData {
    /// What it is, in messages.
    fn name(&self) -> &'static str {
        match self {
            Self::Angle(_) => "an angle",
            Self::Offset(_) => "an offset",
            Self::Euler(_) => "Euler angles",
            Self::Rotation(_) => "a rotation",
            Self::Free { .. } => "a rotation and a translation (free)",
        }
    }

    /// The coordinates of a joint that does it.
    fn coords(&self) -> ([f64; 7], usize) {
        let mut coords = [0.0; 7];
        let mut put = |at: usize, numbers: &[f64]| coords[at..at + numbers.len()].copy_from_slice(numbers);
        let n_coords = match self {
            Self::Angle(number) | Self::Offset(number) => {
                put(0, &[*number]);
                1
            }
            Self::Euler(angles) => {
                put(0, angles);
                3
            }
            Self::Rotation(rotation) => {
                put(0, rotation);
                4
            }
            Self::Free { translation, rotation } => {
                put(0, translation);
                put(3, rotation);
                7
            }
        };
        (coords, n_coords)
    }
}

/// The data of a joint by its coordinates; `None` for one that has none of its own.
fn data_of(joint: &Joint, coords: &[f64]) -> Option<JointData> {
    match (joint.motion, coords) {
        (JointMotion::Hinge { .. }, [angle]) => Some(JointData::Angle(*angle)),
        (JointMotion::Slider { .. }, [offset]) => Some(JointData::Offset(*offset)),
        (JointMotion::Euler { .. }, [x, y, z]) => Some(JointData::Euler([*x, *y, *z])),
        (JointMotion::Ball { .. }, [x, y, z, w]) => Some(JointData::Rotation([*x, *y, *z, *w])),
        (JointMotion::Free { .. }, [x, y, z, rotation @ ..]) => {
            Some(JointData::Free { translation: [*x, *y, *z], rotation: rotation.try_into().ok()? })
        }
        (
            JointMotion::Fixed
            | JointMotion::Hinge { .. }
            | JointMotion::Slider { .. }
            | JointMotion::Euler { .. }
            | JointMotion::Ball { .. }
            | JointMotion::Free { .. },
            _,
        ) => None,
    }
}

/// The joint of that very name: roles and other names are for people, and two of them could mean one joint.
fn joint_named(rig: &Rig, name: &str) -> Result<JointId, UnknownName> {
    let id = rig.joint(name)?;
    let own = &rig.joints()[id.index()].name;
    if own == name { Ok(id) } else { Err(UnknownName { name: name.to_owned(), nearest: vec![own.clone()] }) }
}

impl From<&Pose> for PoseData {
    fn from(pose: &Pose) -> Self {
        let rig = pose.rig();
        let joints = rig.ids().zip(rig.joints()).filter_map(|(id, joint)| {
            Some((joint.name.clone(), data_of(joint, &pose.coords()[rig.coords_of(id)])?))
        });
        Self { joints: joints.collect() }
    }
}

impl PoseData {
    /// The pose of a rig: to the last bit the one that the data was made of. Limits are not applied.
    ///
    /// # Errors
    /// A name that no joint of the rig has (its own names alone count); a joint that is missing or of another kind; a
    /// number that is not finite, and a rotation that is not of length 1.
    pub fn pose(&self, rig: &Rig) -> Result<Pose, DataError> {
        for name in self.joints.keys() {
            joint_named(rig, name)?;
        }
        let mut pose = rig.rest_pose();
        for (id, joint) in rig.ids().zip(rig.joints()) {
            let at = rig.coords_of(id);
            let expected = data_of(joint, &pose.coords()[at.clone()]);
            match (self.joints.get(&joint.name), expected) {
                (None, None) => {}
                (None, Some(expected)) => {
                    return Err(DataError::Missing { joint: joint.name.clone(), expected: expected.name() });
                }
                (Some(found), Some(expected))
                    if std::mem::discriminant(found) == std::mem::discriminant(&expected) =>
                {
                    let (coords, n_coords) = found.coords();
                    pose.coords_mut()[at].copy_from_slice(&coords[..n_coords]);
                }
                (Some(found), expected) => {
                    let expected = expected
                        .as_ref()
                        .map_or("nothing, since it does not move by itself", JointData::name);
                    return Err(DataError::Kind { joint: joint.name.clone(), found: found.name(), expected });
                }
            }
            if !self.joints.get(&joint.name).is_none_or(is_valid) {
                return Err(DataError::Value(joint.name.clone()));
            }
        }
        Ok(pose)
    }
}

fn is_valid(data: &JointData) -> bool {
    let (coords, n_coords) = data.coords();
    let is_unit = |q: [f64; 4]| (DQuat::from_array(q).length_squared() - 1.0).abs() < UNIT;
    coords[..n_coords].iter().all(|number| number.is_finite())
        && match *data {
            JointData::Rotation(rotation) | JointData::Free { rotation, .. } => is_unit(rotation),
            JointData::Angle(_) | JointData::Offset(_) | JointData::Euler(_) => true,
        }
}

impl From<&Clip> for ClipData {
    fn from(clip: &Clip) -> Self {
        let poses = clip.poses().iter().map(PoseData::from).collect();
        Self { name: clip.name().to_owned(), times: clip.times().to_vec(), poses }
    }
}

impl ClipData {
    /// The clip of a rig: to the last bit the one that the data was made of.
    ///
    /// # Errors
    /// The first pose that is none of the rig ([`PoseData::pose`]), with its position; and what [`Clip::new`] refuses.
    pub fn clip(&self, rig: &Rig) -> Result<Clip, DataError> {
        let pose = |(idx, data): (usize, &PoseData)| {
            data.pose(rig).map_err(|source| DataError::Pose { idx, source: Box::new(source) })
        };
        let poses = self.poses.iter().enumerate().map(pose).collect::<Result<Vec<_>, _>>()?;
        Ok(Clip::new(self.name.as_str(), self.times.clone(), poses)?)
    }
}

/// As [`PoseData`], which is what it is read back from.
impl Serialize for Pose {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        PoseData::from(self).serialize(serializer)
    }
}

/// As [`ClipData`], which is what it is read back from.
impl Serialize for Clip {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        ClipData::from(self).serialize(serializer)
    }
}
