//! `inspect --json`.

use ikiru_rig::{ConeCentre, Joint, JointId, JointMotion, Range, Rig, Role, Segment};
use serde_json::{Value, json};

use super::facts::{Facts, LimitSource};

/// What `inspect --json` prints.
pub(super) fn inspected(facts: &Facts) -> Value {
    let rig = &facts.loaded.rig;
    let joints: Vec<Value> = rig
        .joints()
        .iter()
        .zip(facts.rest.iter().zip(&facts.limits_from))
        .map(|(joint, (rest, limits_from))| {
            json!({
                "name": joint.name,
                "parent": joint.parent.and_then(|p| rig.get(p)).map(|p| p.name.as_str()),
                "motion": joint.motion.name(),
                "role": joint.role.map(Role::name),
                "limits": limits(joint),
                "limits_from": limits_from.map(LimitSource::name),
                "rest": { "position": rest.position.to_array(), "rotation": rest.rotation.to_array() },
                "follows": follows(rig, joint),
            })
        })
        .collect();
    let clips: Vec<Value> = facts.loaded.clips.iter().map(|clip| {
        json!({ "name": clip.name(), "duration_secs": clip.duration_secs(), "frames": clip.poses().len() })
    }).collect();
    json!({
        "joints": joints,
        "n_dofs": rig.n_dofs(),
        "height": facts.height,
        "facing": facts.facing.map(|facing| facing.to_array()),
        "clips": clips,
        "warnings": facts.warnings,
        "body": { "segments": segments(facts) },
    })
}

/// The parts of the body whose masses the file knows.
fn segments(facts: &Facts) -> Vec<Value> {
    let name = |joint: JointId| facts.loaded.rig.get(joint).map(|joint| joint.name.as_str());
    let segments = facts.loaded.segments().iter();
    let segment = |segment: &Segment| json!({ "joint": name(segment.joint), "kg": segment.kg, "center": segment.center.to_array() });
    segments.map(segment).collect()
}

/// The leader of a joint that follows one; its value is `multiplier` times the leader's, plus the offset.
fn follows(rig: &Rig, joint: &Joint) -> Value {
    let Some(mimic) = joint.mimic else { return Value::Null };
    let leader = rig.get(mimic.leader).map(|leader| leader.name.as_str());
    let mut follows = json!({ "joint": leader, "multiplier": mimic.multiplier });
    if let JointMotion::Slider { .. } = joint.motion {
        follows["offset"] = json!(mimic.offset);
    } else {
        follows["offset_deg"] = json!(mimic.offset.to_degrees());
    }
    follows
}

/// Limits under the keys that a scenario has for them; null where there are none, and for an open end.
fn limits(joint: &Joint) -> Value {
    let motion = &joint.motion;
    let ranges = motion.ranges();
    let ends = |end: fn(&Range) -> f64| -> Vec<Value> {
        ranges
            .iter()
            .map(|r| Some(end(r)).filter(|e| e.is_finite()).map_or(Value::Null, |e| json!(e)))
            .collect()
    };
    let (min, max) = (ends(|r| r.min.to_degrees()), ends(|r| r.max.to_degrees()));
    match motion {
        _ if !ranges.is_empty() && ranges.iter().all(Range::is_unlimited) => Value::Null,
        JointMotion::Euler { .. } => json!({ "min_deg": min, "max_deg": max }),
        JointMotion::Hinge { .. } => json!({ "min_deg": min[0], "max_deg": max[0] }),
        JointMotion::Slider { .. } => json!({ "min": ends(|r| r.min)[0], "max": ends(|r| r.max)[0] }),
        JointMotion::Ball { cone: Some(cone) } | JointMotion::Free { cone: Some(cone) } => {
            let of_rest = ConeCentre { parent_rotation: joint.rest_rotation, ..ConeCentre::default() };
            let centre = cone.centre().unwrap_or(of_rest);
            json!({
                "axis": cone.axis().to_array(),
                "swing_deg": cone.swing().map(f64::to_degrees),
                "twist_deg": [cone.twist().min.to_degrees(), cone.twist().max.to_degrees()],
                "parent_rotation": centre.parent_rotation.to_array(),
                "joint_rotation": centre.joint_rotation.to_array(),
            })
        }
        JointMotion::Fixed | JointMotion::Ball { cone: None } | JointMotion::Free { cone: None } => {
            Value::Null
        }
    }
}
