//! Poses that a scenario gives: `[start]` and `[motion.end]`, as a table of joints or as the name of a file.

use std::path::Path;

use glam::DVec3;
use ikiru_formats::read_pose_json;
use ikiru_rig::{JointId, JointMotion, Pose, Rig};

use crate::axes::Axes;
use crate::error::{Error, ErrorKind};
use crate::keys::JointKeys;
use crate::table::{Table, Value};
use crate::values::{joint_of_key, name_of, set};
use crate::warning::{ScenarioPose, Warning};

/// The start: what the scenario says of it on top of the rest pose, inside the limits, with a warning for each joint that
/// was outside.
pub(crate) fn start(
    rig: &Rig,
    scenario: &Table<'_>,
    folder: &Path,
    axes: Axes,
    warnings: &mut Vec<Warning>,
) -> Result<Pose, Error> {
    let rest = rig.rest_pose();
    match scenario.get("start") {
        Some(value) => given(&value, &rest, ScenarioPose::Start, folder, axes, warnings),
        None => Ok(inside(rest, |_| ScenarioPose::Rest, warnings)),
    }
}

/// A pose that is given: the name of a file, or a table of joints and how they are turned. What it does not name is as in
/// `base`. The way of the root is given in the scenario's `axes`.
pub(crate) fn given(
    value: &Value<'_>,
    base: &Pose,
    which: ScenarioPose,
    folder: &Path,
    axes: Axes,
    warnings: &mut Vec<Warning>,
) -> Result<Pose, Error> {
    if value.is_text() {
        let pose = of_file(value, base, folder)?;
        return Ok(inside(pose, |_| which, warnings));
    }
    let (pose, named) = of_table(value, base, which, axes)?;
    let of = |joint: JointId| if named.contains(&joint) { which } else { ScenarioPose::Rest };
    Ok(inside(pose, of, warnings))
}

/// The pose of a `.json` file, as `ikiru solve` writes and prints it.
fn of_file(value: &Value<'_>, base: &Pose, folder: &Path) -> Result<Pose, Error> {
    const EXPECTED: &str = "the path of a pose's .json file, or a table of joints";
    let path = folder.join(value.text(EXPECTED)?);
    let bytes = std::fs::read(&path)
        .map_err(|source| value.error(ErrorKind::PoseIo { file: path.display().to_string(), source }))?;
    read_pose_json(&bytes, &path.display().to_string(), base).map_err(|e| value.error(ErrorKind::PoseFile(e)))
}

/// A table of joints and how they are turned, and which joints it names.
fn of_table(
    value: &Value<'_>,
    base: &Pose,
    which: ScenarioPose,
    axes: Axes,
) -> Result<(Pose, Vec<JointId>), Error> {
    const TRANSLATION: &str = "root_translation";
    let place = if which == ScenarioPose::End { "[motion.end]" } else { "[start]" };
    let mut pose = base.clone();
    let rig = base.rig();
    let mut named: Vec<JointId> = Vec::new();
    for value in value.table()?.entries() {
        if value.key == TRANSLATION && rig.joint(TRANSLATION).is_err() {
            let way = DVec3::from_array(value.vector()?);
            pose.set_root_translation(axes.vector(way)).map_err(|_| does_not_float(rig, &value))?;
            continue;
        }
        let joint = joint_of_key(rig, &value.key, value.at())?;
        if named.contains(&joint) {
            let (place, first) = (place.to_owned(), name_of(rig, joint).to_owned());
            let kind = ErrorKind::Twice { place, first, second: value.key.clone() };
            return Err(value.key_error(kind));
        }
        set(&mut pose, joint, JointKeys::read(&value)?.angles(rig, joint, value.at())?);
        named.push(joint);
    }
    Ok((pose, named))
}

/// What `root_translation` answers where nothing floats.
fn does_not_float(rig: &Rig, value: &Value<'_>) -> Error {
    let joint = rig.root().map_or("root", |root| name_of(rig, root)).to_owned();
    let reason = "is a root that does not translate: expected root = \"free\" beside it".to_owned();
    value.key_error(ErrorKind::Unfit { joint, reason })
}

/// The pose, moved inside its limits, with a warning for each joint that was outside; `of` says whose word that joint's
/// part of the pose is.
fn inside(mut pose: Pose, of: impl Fn(JointId) -> ScenarioPose, warnings: &mut Vec<Warning>) -> Pose {
    let wanted = pose.clone();
    pose.project();
    let rig = wanted.rig();
    for joint in rig.ids() {
        let distance = wanted.limit_violation_of(joint);
        if distance > 1e-9 {
            let is_slider = matches!(rig.get(joint).map(|j| j.motion), Some(JointMotion::Slider { .. }));
            let (pose, joint) = (of(joint), name_of(rig, joint).to_owned());
            warnings.push(Warning::Projected { pose, joint, distance, is_slider });
        }
    }
    pose
}
