//! Reports as JSON, for programs.

use std::time::Duration;

use ikiru_formats::{Loaded, pose_json};
use ikiru_rig::{Motion, Pose, Range, Role};
use ikiru_scenario::Scenario;
use ikiru_solve::{PartReport, Report};
use serde_json::{Value, json};

use crate::report::warnings;

/// What `solve --json` and `demo --json` print.
pub(crate) fn solved(scenario: &Scenario, report: &Report<'_>, pose: &Pose, time: Duration) -> Value {
    let objectives: Vec<Value> = report
        .terms
        .iter()
        .enumerate()
        .map(|(idx, term)| {
            let kind = scenario.objectives.get(idx).map_or(term.kind, |o| o.kind);
            let mut objective = json!({
                "kind": kind,
                "joint": scenario.joint_name(idx),
                "target": scenario.target_json(idx),
                "weight": term.weight,
                "residual": term.residual,
                "unit": term.unit.symbol(),
                "cost": term.cost,
                "satisfied": term.satisfied,
            });
            add_other_parts(&mut objective, &term.others);
            objective
        })
        .collect();
    json!({
        "success": report.success,
        "stop": report.stop.name(),
        "cost": report.cost,
        "iterations": report.iterations,
        "restarts": report.restarts,
        "time_us": time.as_secs_f64() * 1e6,
        "objectives": objectives,
        "warnings": warnings(scenario, report),
        "pose": pose_json(pose, &scenario.active),
    })
}

/// The residuals of an objective beyond its first: a pose has an angle besides its distance.
pub(crate) fn add_other_parts(objective: &mut Value, others: &[PartReport]) {
    for (name, part) in ["second", "third", "fourth"].iter().zip(others) {
        objective[format!("{name}_residual")] = json!(part.residual);
        objective[format!("{name}_unit")] = json!(part.unit.symbol());
    }
}

/// What `inspect --json` prints.
pub(crate) fn inspected(loaded: &Loaded) -> Value {
    let rig = &loaded.rig;
    let joints: Vec<Value> = rig
        .joints()
        .iter()
        .map(|joint| {
            json!({
                "name": joint.name,
                "parent": joint.parent.and_then(|p| rig.get(p)).map(|p| p.name.as_str()),
                "motion": joint.motion.name(),
                "role": joint.role.map(Role::name),
                "limits": limits(&joint.motion),
            })
        })
        .collect();
    let clips: Vec<Value> = loaded.clips.iter().map(|clip| {
        json!({ "name": clip.name(), "duration_secs": clip.duration_secs(), "frames": clip.poses().len() })
    }).collect();
    let warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    json!({ "joints": joints, "n_dofs": rig.n_dofs(), "clips": clips, "warnings": warnings })
}

/// Limits under the keys that a scenario has for them; null where there are none, and for an open end.
fn limits(motion: &Motion) -> Value {
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
        Motion::Euler { .. } => json!({ "min_deg": min, "max_deg": max }),
        Motion::Hinge { .. } => json!({ "min_deg": min[0], "max_deg": max[0] }),
        Motion::Slider { .. } => json!({ "min": ends(|r| r.min)[0], "max": ends(|r| r.max)[0] }),
        Motion::Ball { cone: Some(cone) } | Motion::Free { cone: Some(cone) } => json!({
            "axis": cone.axis().to_array(),
            "swing_deg": cone.swing().map(f64::to_degrees),
            "twist_deg": [cone.twist().min.to_degrees(), cone.twist().max.to_degrees()],
        }),
        Motion::Fixed | Motion::Ball { cone: None } | Motion::Free { cone: None } => Value::Null,
    }
}
