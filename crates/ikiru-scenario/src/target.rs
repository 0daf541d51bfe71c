//! What objectives aim at: as JSON, in the axes of the scenario, and turned into the rig's world.

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, JointMotion, Rig};
use ikiru_solve::Problem;
use ikiru_solve::objectives::{Bound, Gaze, JointAngles, RelativePose};
use serde_json::{Map, Value, json};

use crate::axes::Axes;
use crate::objective::{ScenarioObjective, TermHandle};
use crate::values::name_of;

/// What an objective aims at, in the axes that `targets_from_rig` leads to.
pub(crate) fn target_json(
    rig: &Rig,
    problem: &Problem,
    objective: &ScenarioObjective,
    targets_from_rig: Axes,
) -> Value {
    let point = |p: DVec3| json!(targets_from_rig.vector(p).to_array());
    let turn = |q: DQuat| json!(targets_from_rig.rotation(q).to_array());
    if let Some(path) = &objective.path {
        let at = |(secs, p): (f64, DVec3)| {
            let p = targets_from_rig.vector(p);
            json!([secs, p.x, p.y, p.z])
        };
        return Value::Array(path.points().map(at).collect());
    }
    match objective.term {
        TermHandle::Position(id) => point(problem[id].target),
        TermHandle::Pose(id) => point(problem[id].position),
        TermHandle::Orientation(id) => turn(problem[id].target),
        TermHandle::Direction(id) => point(problem[id].target),
        TermHandle::PoleVector(id) => point(problem[id].target),
        TermHandle::RelativePose(id) => {
            let RelativePose { position, rotation, .. } = &problem[id];
            json!({ "position": position.map(|p| p.to_array()), "rotation": rotation.map(|q| q.to_array()) })
        }
        TermHandle::Distance(id) => match problem[id].bound {
            Bound::Exactly(d) => json!({ "exactly": d }),
            Bound::AtLeast(d) => json!({ "at_least": d }),
            Bound::AtMost(d) => json!({ "at_most": d }),
        },
        TermHandle::LookAt(id) => match problem[id].gaze {
            Gaze::Point(at) => point(at),
            Gaze::OffsetFromTip { length, offset } => {
                json!({ "length": length, "offset_from_tip": point(offset) })
            }
        },
        TermHandle::KnownRotation(id) => {
            let objective = &problem[id];
            let mut joints = Map::new();
            for (joint, angles) in objective.targets() {
                joints.insert(name_of(rig, joint).to_owned(), angles_json(rig, joint, &angles));
            }
            Value::Object(joints)
        }
        TermHandle::RestPose(_) => Value::Null,
    }
}

fn angles_json(rig: &Rig, joint: JointId, angles: &JointAngles) -> Value {
    let is_slider = matches!(rig.get(joint).map(|j| j.motion), Some(JointMotion::Slider { .. }));
    match angles {
        JointAngles::Rotation(q) => json!({ "rotation": q.to_array() }),
        JointAngles::Euler(a) => json!({ "euler_deg": a.map(|a| a.map(degrees)) }),
        JointAngles::Value(v) if is_slider => json!({ "offset": v }),
        JointAngles::Value(v) => json!({ "angle_deg": degrees(*v) }),
    }
}

/// Degrees of radians that were made of degrees: the shortest number that gives them back, which is the one written.
fn degrees(radians: f64) -> f64 {
    let exact = radians.to_degrees();
    let short = (exact * 1e9).round() / 1e9;
    if short.to_radians() == radians { short } else { exact }
}

/// Takes a target from the axes that the scenario gives it in to the rig's world.
pub(crate) fn turn_target(problem: &mut Problem, term: TermHandle, axes: Axes) {
    match term {
        TermHandle::Position(id) => problem[id].target = axes.vector(problem[id].target),
        TermHandle::Orientation(id) => problem[id].target = axes.rotation(problem[id].target),
        TermHandle::Pose(id) => {
            problem[id].position = axes.vector(problem[id].position);
            problem[id].rotation = axes.rotation(problem[id].rotation);
        }
        TermHandle::LookAt(id) => match &mut problem[id].gaze {
            Gaze::Point(at) => *at = axes.vector(*at),
            Gaze::OffsetFromTip { offset, .. } => *offset = axes.vector(*offset),
        },
        TermHandle::Direction(id) => problem[id].target = axes.vector(problem[id].target),
        TermHandle::PoleVector(id) => problem[id].target = axes.vector(problem[id].target),
        // These are about joints alone.
        TermHandle::RelativePose(_)
        | TermHandle::Distance(_)
        | TermHandle::KnownRotation(_)
        | TermHandle::RestPose(_) => {}
    }
}
