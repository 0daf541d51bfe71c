//! Reports as JSON, for programs.

use std::time::Duration;

use ikiru_formats::pose_json;
use ikiru_rig::Pose;
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
