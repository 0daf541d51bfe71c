//! What must hold at the end: the hard objectives, part by part, for programs and for people.

use ikiru_rig::{JointId, Rig};
use ikiru_scenario::ScenarioObjective;
use ikiru_solve::{PartReport, Problem, Unit};
use serde_json::{Value, json};

use crate::numbers;

/// What became of one part of a hard objective.
pub(crate) struct Constraint<'a> {
    /// Position of the objective.
    objective: usize,
    about: &'a ScenarioObjective,
    /// The joints that it reads, where these are one or two.
    joints: [Option<&'a str>; 2],
    /// Of an equality, how far it is missed; of an inequality, what is left to its bound, below 0 what is missed.
    value: f64,
    unit: Unit,
    is_satisfied: bool,
    /// The time of the value, in a motion (seconds).
    at: Option<f64>,
}

/// The constraints among the terms of a report, given with their times: each part is one.
pub(crate) fn constraints<'a>(
    rig: &'a Rig,
    problem: &Problem,
    objectives: &'a [ScenarioObjective],
    parts: impl Iterator<Item = (Vec<PartReport>, Option<f64>)>,
) -> Vec<Constraint<'a>> {
    let mut constraints = Vec::new();
    for (((idx, about), term), (parts, at)) in objectives.iter().enumerate().zip(problem.terms()).zip(parts) {
        if !term.hard {
            continue;
        }
        let reads = problem.reads(term).unwrap_or_default();
        let joints = pair(rig, reads.frames.into_iter().chain(reads.motions));
        for part in parts {
            constraints.push(Constraint {
                objective: idx,
                about,
                joints,
                value: value(&part),
                unit: part.unit,
                is_satisfied: part.residual <= term.tolerance.of(part.unit),
                at,
            });
        }
    }
    constraints
}

/// Of a part that is a bound: what is left to it, below 0 what is missed; else how far it is missed.
fn value(part: &PartReport) -> f64 {
    match part.least {
        Some(_) if part.residual > 0.0 => -part.residual,
        Some(least) => least,
        None => part.residual,
    }
}

/// The names of joints, where they are one or two.
fn pair(rig: &Rig, joints: impl Iterator<Item = JointId>) -> [Option<&str>; 2] {
    let mut names: Vec<&str> = Vec::new();
    for joint in joints.filter_map(|joint| rig.get(joint)) {
        if !names.contains(&joint.name.as_str()) {
            names.push(&joint.name);
        }
    }
    match names[..] {
        [a] => [Some(a), None],
        [a, b] => [Some(a), Some(b)],
        [..] => [None, None],
    }
}

impl Constraint<'_> {
    /// One of the entries of `constraints`.
    pub(crate) fn json(&self) -> Value {
        let [a, b] = self.joints;
        let mut constraint = json!({
            "kind": self.about.constraint,
            "a": a,
            "b": b,
            "value": self.value,
            // Of what is left, or of what is missed.
            "bound": 0.0,
            "unit": self.unit.symbol(),
            "satisfied": self.is_satisfied,
        });
        if let Some(at) = self.at {
            constraint["at"] = json!(at);
        }
        constraint
    }
}

/// How many hold, and which do not; `None` where there are none.
pub(crate) fn text(constraints: &[Constraint<'_>]) -> Option<String> {
    let n_all = constraints.len();
    let missed: Vec<String> = constraints
        .iter()
        .filter(|constraint| !constraint.is_satisfied)
        .map(|c| {
            let by = numbers::residual(c.value.abs(), c.unit);
            let at = c.at.map_or(String::new(), |secs| format!(" at {} s", numbers::short(secs)));
            format!("objective {} ({}) is missed by {by}{at}", c.objective + 1, c.about.kind)
        })
        .collect();
    match (n_all, &missed[..]) {
        (0, _) => None,
        (1, []) => Some("it holds".to_owned()),
        (n, []) => Some(format!("all {n} hold")),
        (n, missed) => Some(format!("{} of {n} hold: {}", n - missed.len(), missed.join(", "))),
    }
}
