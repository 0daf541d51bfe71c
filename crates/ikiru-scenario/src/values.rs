//! What a joint does, as `[start]` and `known_rotation` say it.

use glam::DQuat;
use ikiru_rig::{EulerOrder, JointId, JointMotion, Pose, Range, Rig};
use ikiru_solve::objectives::JointAngles;

use crate::error::{Error, ErrorKind};
use crate::table::Value;

const KEYS: [&str; 4] = ["euler_deg", "rotation", "angle_deg", "offset"];

/// A joint of the rig by name or role.
pub(crate) fn joint(rig: &Rig, value: &Value<'_>) -> Result<JointId, Error> {
    let name = value.text("the name of a joint, or a humanoid role")?;
    rig.joint(name).map_err(|unknown| value.error(ErrorKind::UnknownJoint(unknown)))
}

/// A joint of the rig, by the key of a value.
pub(crate) fn joint_of_key(rig: &Rig, value: &Value<'_>) -> Result<JointId, Error> {
    rig.joint(&value.key).map_err(|unknown| value.key_error(ErrorKind::UnknownJoint(unknown)))
}

/// The joint's name; ids come from the rig itself.
pub(crate) fn name_of(rig: &Rig, joint: JointId) -> &str {
    rig.get(joint).map_or("", |j| &j.name)
}

/// The motion of one joint, `NAME = { euler_deg = [..] }` and so on, as that joint can take it.
pub(crate) fn joint_angles(rig: &Rig, joint: JointId, value: &Value<'_>) -> Result<JointAngles, Error> {
    let table = value.table(format!("'{}'", value.key))?;
    table.only(&KEYS)?;
    let [Some(given)] = &table.entries().into_iter().map(Some).collect::<Vec<_>>()[..] else {
        let found = table.present(&KEYS).replace("neither", "no value");
        let expected = "one of 'euler_deg', 'rotation', 'angle_deg' or 'offset'";
        return Err(table.error(ErrorKind::Alternatives { place: table.place.clone(), found, expected }));
    };
    let data = rig.get(joint);
    let follows = data.is_some_and(|j| j.mimic.is_some());
    let motion = data.map_or(JointMotion::Fixed, |j| j.motion);
    let expected = match (&motion, given.key.as_str()) {
        _ if follows => "nothing, since it follows another joint",
        (JointMotion::Ball { .. } | JointMotion::Free { .. }, "euler_deg") => {
            return Ok(JointAngles::Rotation(EulerOrder::Zyx.quaternion(given.angles()?)));
        }
        (JointMotion::Ball { .. } | JointMotion::Free { .. }, "rotation") => {
            return Ok(JointAngles::Rotation(given.quaternion()?));
        }
        (JointMotion::Euler { .. }, "euler_deg") => return Ok(JointAngles::Euler(given.angles()?.map(Some))),
        (JointMotion::Euler { order, ranges }, "rotation") => {
            return Ok(JointAngles::Euler(angles_inside(*order, ranges, given.quaternion()?).map(Some)));
        }
        (JointMotion::Hinge { .. }, "angle_deg") => {
            return Ok(JointAngles::Value(given.number()?.to_radians()));
        }
        (JointMotion::Slider { .. }, "offset") => return Ok(JointAngles::Value(given.number()?)),
        (JointMotion::Ball { .. } | JointMotion::Free { .. } | JointMotion::Euler { .. }, _) => {
            "'euler_deg' or 'rotation'"
        }
        (JointMotion::Hinge { .. }, _) => "'angle_deg'",
        (JointMotion::Slider { .. }, _) => "'offset'",
        (JointMotion::Fixed, _) => "nothing, since it does not move",
    };
    let reason = format!("is {} and cannot take '{}': expected {expected}", with_article(&motion), given.key);
    Err(given.key_error(ErrorKind::Unfit { joint: name_of(rig, joint).to_owned(), reason }))
}

pub(crate) fn with_article(motion: &JointMotion) -> String {
    match motion {
        JointMotion::Fixed | JointMotion::Free { .. } => motion.name().to_owned(),
        JointMotion::Euler { .. } => "an Euler joint".to_owned(),
        _ => format!("a {}", motion.name()),
    }
}

/// Sets what [`joint_angles`] gave.
pub(crate) fn set(pose: &mut Pose, joint: JointId, angles: JointAngles) {
    // What does not fit was refused when it was read.
    let _ = match angles {
        JointAngles::Rotation(q) => pose.set_rotation(joint, q),
        JointAngles::Euler(a) => pose.set_euler(joint, a.map(Option::unwrap_or_default)),
        JointAngles::Value(v) => pose.set_value(joint, v),
    };
}

/// Of the two sets of angles that give a rotation, the one that lies nearer to its ranges.
fn angles_inside(order: EulerOrder, ranges: &[Range; 3], q: DQuat) -> [f64; 3] {
    use std::f64::consts::PI;
    let [_, middle, _] = order.axes();
    let first = order.angles(q);
    let mut second = first;
    for (axis, angle) in second.iter_mut().enumerate() {
        *angle = if axis == middle { PI.copysign(*angle) - *angle } else { *angle - PI.copysign(*angle) };
    }
    let outside = |a: &[f64; 3]| ranges.iter().zip(a).map(|(r, a)| r.distance(*a)).sum::<f64>();
    if outside(&second) < outside(&first) { second } else { first }
}
