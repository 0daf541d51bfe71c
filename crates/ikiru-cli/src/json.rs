//! Reports as JSON, for programs.

use std::time::Duration;

use ikiru_formats::pose_json;
use ikiru_rig::Pose;
use ikiru_scenario::{Scenario, ScenarioObjective};
use ikiru_solve::{PartReport, Problem, Report};
use serde_json::{Value, json};

use crate::constraints::Constraint;
use crate::obstacles::About;
use crate::report::{self, warnings};

/// What `solve --json` and `demo --json` print.
pub(crate) fn solved(scenario: &Scenario, solved: &Report<'_>, pose: &Pose, time: Duration) -> Value {
    let objectives: Vec<Value> = solved
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
                "level": level(&scenario.objectives, &scenario.problem, idx),
                "residual": term.residual,
                "unit": term.unit.symbol(),
                "cost": term.cost,
                "satisfied": term.satisfied,
            });
            add_other_parts(&mut objective, &term.others);
            objective
        })
        .collect();
    let constraints: Vec<Value> =
        report::constraints(scenario, solved).iter().map(Constraint::json).collect();
    let about = About::pose(scenario);
    json!({
        "success": solved.success,
        "stop": solved.stop.name(),
        "cost": solved.cost,
        "iterations": solved.iterations,
        "restarts": solved.restarts,
        "time_us": time.as_secs_f64() * 1e6,
        "objectives": objectives,
        "constraints": constraints,
        "obstacles": about.json(&solved.forces),
        "hint": solved.hint.map(|hint| about.hint(hint)),
        "warnings": warnings(scenario, solved),
        "pose": pose_json(pose, &scenario.active),
    })
}

/// The rank of an objective; null where it is optional.
pub(crate) fn level(objectives: &[ScenarioObjective], problem: &Problem, idx: usize) -> Option<u32> {
    let term = problem.terms().get(idx).filter(|term| term.mandatory || term.hard);
    term.and(objectives.get(idx)).map(|objective| objective.level)
}

/// The residuals of an objective beyond its first: a pose has an angle besides its distance.
pub(crate) fn add_other_parts(objective: &mut Value, others: &[PartReport]) {
    for (name, part) in ["second", "third", "fourth"].iter().zip(others) {
        objective[format!("{name}_residual")] = json!(part.residual);
        objective[format!("{name}_unit")] = json!(part.unit.symbol());
    }
}
