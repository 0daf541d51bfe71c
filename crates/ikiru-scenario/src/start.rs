//! Poses that a scenario gives: `[start]` and `[motion.end]`, as joints or as the name of a file.

use std::path::Path;

use glam::DVec3;
use ikiru_formats::read_pose_json;
use ikiru_rig::{JointId, JointMotion, Pose, Rig};
use serde::ser::SerializeMap as _;
use serde::{Serialize, Serializer};

use crate::at::At;
use crate::axes::Axes;
use crate::error::{Error, ErrorKind};
use crate::key::Key;
use crate::keys::JointKeys;
use crate::scene::twice;
use crate::table::Value;
use crate::values::{joint_of_key, name_of, set};
use crate::warning::{ScenarioPose, Warning};

/// A pose: `[start]` and `[motion.end]`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum GivenPose {
    /// The path of a `.json` file, as `ikiru solve` writes it, from the scenario's folder.
    File(String),
    /// Joints; what is not named is as at rest, or, of an end, as at the start.
    Joints {
        /// `root_translation`: how far the floating root is from where it is at rest, metres along the axes of `world`.
        root_translation: Option<[f64; 3]>,
        /// Joints by name or humanoid role, and how each is turned or moved.
        joints: Vec<(String, JointKeys)>,
    },
}

/// The key of a given pose that is no joint's name.
pub(crate) const TRANSLATION: Key = Key::new(
    "root_translation",
    "a way in metres, [x, y, z]",
    "How far the floating root is from where it is at rest, along the axes of `world`; with `root = \"free\"`.",
)
.or("[0, 0, 0]");

impl Serialize for GivenPose {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::File(path) => serializer.serialize_str(path),
            Self::Joints { root_translation, joints } => {
                let mut map = serializer.serialize_map(None)?;
                if let Some(way) = root_translation {
                    map.serialize_entry(TRANSLATION.name, way)?;
                }
                for (name, keys) in joints {
                    map.serialize_entry(name, keys)?;
                }
                map.end()
            }
        }
    }
}

impl GivenPose {
    pub(crate) fn read(value: &Value<'_>) -> Result<Self, Error> {
        if value.is_text() {
            return Ok(Self::File(value.text()?.to_owned()));
        }
        let (mut root_translation, mut joints) = (None, Vec::new());
        let table = value.table()?;
        for value in table.entries(JointKeys::TAKES) {
            // A joint of that name has a table, as all have.
            let is_way = value.key == TRANSLATION.name && !value.is_table();
            match table.get(&TRANSLATION).filter(|_| is_way) {
                Some(way) => root_translation = Some(way.numbers()?),
                None => joints.push((value.key.clone(), JointKeys::read(&value)?)),
            }
        }
        Ok(Self::Joints { root_translation, joints })
    }

    /// The pose, inside the limits, with a warning for each joint that was outside. What it does not name is as in `base`. The
    /// way of the root is given in the scenario's `axes`.
    pub(crate) fn pose(
        &self,
        base: &Pose,
        which: ScenarioPose,
        folder: &Path,
        axes: Axes,
        at: &At<'_>,
        warnings: &mut Vec<Warning>,
    ) -> Result<Pose, Error> {
        match self {
            Self::File(path) => {
                let pose = of_file(&folder.join(path), base, at)?;
                Ok(inside(pose, |_| which, warnings))
            }
            Self::Joints { root_translation, joints } => {
                let mut pose = base.clone();
                if let Some(way) = root_translation {
                    let way = axes.vector(DVec3::from_array(*way));
                    let set = pose.set_root_translation(way);
                    set.map_err(|_| does_not_float(base.rig(), &at.key(TRANSLATION.name)))?;
                }
                let named = turn_joints(&mut pose, joints, at)?;
                let of = |joint: JointId| if named.contains(&joint) { which } else { ScenarioPose::Rest };
                Ok(inside(pose, of, warnings))
            }
        }
    }
}

/// The rest pose, inside the limits, with a warning for each joint that was outside.
pub(crate) fn rest(rig: &Rig, warnings: &mut Vec<Warning>) -> Pose {
    inside(rig.rest_pose(), |_| ScenarioPose::Rest, warnings)
}

/// The pose of a `.json` file, as `ikiru solve` writes and prints it.
fn of_file(path: &Path, base: &Pose, at: &At<'_>) -> Result<Pose, Error> {
    let bytes = std::fs::read(path)
        .map_err(|source| at.error(ErrorKind::PoseIo { file: path.display().to_string(), source }))?;
    read_pose_json(&bytes, &path.display().to_string(), base).map_err(|e| at.error(ErrorKind::PoseFile(e)))
}

/// Turns and moves joints, and tells which.
fn turn_joints(pose: &mut Pose, joints: &[(String, JointKeys)], at: &At<'_>) -> Result<Vec<JointId>, Error> {
    let rig = pose.rig().clone();
    let mut named: Vec<JointId> = Vec::with_capacity(joints.len());
    for (name, keys) in joints {
        let at_name = at.key(name);
        let joint = joint_of_key(&rig, name, &at_name)?;
        if named.contains(&joint) {
            return Err(at_name.key_error(twice(&rig, joint, name, at.place())));
        }
        set(pose, joint, keys.angles(&rig, joint, &at_name)?);
        named.push(joint);
    }
    Ok(named)
}

/// What `root_translation` answers where nothing floats.
fn does_not_float(rig: &Rig, at: &At<'_>) -> Error {
    let joint = rig.root().map_or("root", |root| name_of(rig, root)).to_owned();
    let reason = "is a root that does not translate: expected root = \"free\" beside it".to_owned();
    at.key_error(ErrorKind::Unfit { joint, reason })
}

/// The pose, moved inside its limits, with a warning for each joint that was outside; `of` says whose word that joint's
/// part of the pose is.
fn inside(mut pose: Pose, of: impl Fn(JointId) -> ScenarioPose, warnings: &mut Vec<Warning>) -> Pose {
    let wanted = pose.clone();
    pose.project();
    let rig = wanted.rig();
    for joint in rig.ids() {
        let Ok(distance) = wanted.limit_violation_of(joint) else { continue };
        if distance > 1e-9 {
            let is_slider = matches!(rig.get(joint).map(|j| j.motion), Some(JointMotion::Slider { .. }));
            let (pose, joint) = (of(joint), name_of(rig, joint).to_owned());
            warnings.push(Warning::Projected { pose, joint, distance, is_slider });
        }
    }
    pose
}
