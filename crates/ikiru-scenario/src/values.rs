//! What names and numbers of a scenario mean: joints, directions, quaternions.

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, JointMotion, Pose, Rig};
use ikiru_solve::objectives::JointAngles;

use crate::at::At;
use crate::error::{Error, ErrorKind};

/// A joint of the rig by name or role, which is the value at a place.
pub(crate) fn joint(rig: &Rig, name: &str, at: &At<'_>) -> Result<JointId, Error> {
    rig.joint(name).map_err(|unknown| at.error(ErrorKind::UnknownJoint(unknown)))
}

/// A joint of the rig by name or role, which is the key at a place.
pub(crate) fn joint_of_key(rig: &Rig, name: &str, at: &At<'_>) -> Result<JointId, Error> {
    rig.joint(name).map_err(|unknown| at.key_error(ErrorKind::UnknownJoint(unknown)))
}

/// The joint's name; ids come from the rig itself.
pub(crate) fn name_of(rig: &Rig, joint: JointId) -> &str {
    rig.get(joint).map_or("", |j| &j.name)
}

/// A joint's motion as sentences have it.
pub(crate) fn with_article(motion: &JointMotion) -> String {
    match motion {
        JointMotion::Fixed | JointMotion::Free { .. } => motion.name().to_owned(),
        JointMotion::Euler { .. } => "an Euler joint".to_owned(),
        JointMotion::Hinge { .. } | JointMotion::Slider { .. } | JointMotion::Ball { .. } => {
            format!("a {}", motion.name())
        }
    }
}

/// Sets a joint's own motion.
pub(crate) fn set(pose: &mut Pose, joint: JointId, angles: JointAngles) {
    // What does not fit was refused when it was read.
    let _ = match angles {
        JointAngles::Rotation(q) => pose.set_rotation(joint, q),
        JointAngles::Euler(a) => pose.set_euler(joint, a.map(Option::unwrap_or_default)),
        JointAngles::Value(v) => pose.set_value(joint, v),
    };
}

/// A number that fits a rule, which `expected` words.
pub(crate) fn number_that(
    found: f64,
    at: &At<'_>,
    fits: impl Fn(f64) -> bool,
    expected: &'static str,
) -> Result<f64, Error> {
    if fits(found) {
        return Ok(found);
    }
    Err(at.error(ErrorKind::OutOfRange { key: at.name().to_owned(), found, expected }))
}

/// A vector that has a direction.
pub(crate) fn direction(numbers: [f64; 3], at: &At<'_>) -> Result<DVec3, Error> {
    let vector = DVec3::from_array(numbers);
    if vector.try_normalize().is_some() {
        return Ok(vector);
    }
    Err(at.error(ErrorKind::NoLength(at.name().to_owned(), "a direction, such as [0, 1, 0]")))
}

/// A rotation as a quaternion (x, y, z, w) of any length but 0.
pub(crate) fn quaternion(numbers: [f64; 4], at: &At<'_>) -> Result<DQuat, Error> {
    // Scaled first, so that neither huge nor tiny numbers overflow on the way.
    let largest = numbers.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    if largest > 0.0 {
        return Ok(DQuat::from_array(numbers.map(|c| c / largest)).normalize());
    }
    Err(at.error(ErrorKind::NoLength(at.name().to_owned(), "a quaternion, [x, y, z, w]")))
}

/// Degrees of radians that were made of degrees: the shortest number that gives them back, which is the one written.
pub(crate) fn degrees(radians: f64) -> f64 {
    let exact = radians.to_degrees();
    let short = (exact * 1e9).round() / 1e9;
    if short.to_radians() == radians { short } else { exact }
}
