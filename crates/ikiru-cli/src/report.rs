//! Reports for people: tables and sentences.

use std::fmt::Write as _;
use std::time::Duration;

use comfy_table::{CellAlignment, LineStyle, Table, presets};
use ikiru_rig::{JointId, JointMotion, Pose, Rig, Role};
use ikiru_scenario::Scenario;
use ikiru_solve::{ActiveLimit, LimitKind, Obstacle, PartReport, Report, SolverOptions, StopReason};

use crate::constraints::{self, Constraint};
use crate::numbers::{self, short};
use crate::output::printable;
use crate::warnings;

/// How many active limits are listed by name.
const MOST_LIMITS: usize = 4;

/// What the user should know besides the result.
pub(crate) fn warnings(scenario: &Scenario, report: &Report<'_>) -> Vec<String> {
    let of_terms =
        report.terms.iter().enumerate().filter_map(|(idx, term)| {
            term.warning.map(|w| format!("objective {} ({}) {w}", idx + 1, term.kind))
        });
    warnings::of_scenario(&scenario.warnings).into_iter().chain(of_terms).collect()
}

/// The report of a solve: the objectives as a table, then what came of it. `notes` follow the time.
pub(crate) fn solved(
    scenario: &Scenario,
    report: &Report<'_>,
    pose: &Pose,
    time: Duration,
    notes: &[String],
) -> String {
    let mut text = format!("{}\n\n", objectives(scenario, report));
    let mut line = |key: &str, value: String| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{key:<13}{value}");
    };
    let verdict = if report.success { "reached" } else { "not reached" };
    line(verdict, stop_text(report.stop, scenario.solver.options()));
    if let Some(constraints) = constraints::text(&constraints(scenario, report)) {
        line("constraints", constraints);
    }
    line("cost", numbers::cost(report.cost));
    let starts = match report.restarts {
        0 => "from the start alone".to_owned(),
        1 => "with 1 restart".to_owned(),
        n => format!("with {n} restarts"),
    };
    line("iterations", format!("{} {starts}, method {}", report.iterations, scenario.method()));
    let time = numbers::time(time);
    line("time", if notes.is_empty() { time } else { format!("{time} {}", notes.join(", ")) });
    if !report.limits.is_empty() {
        let named: Vec<String> =
            report.limits.iter().take(MOST_LIMITS).map(|limit| limit_text(limit, pose)).collect();
        let more = report.limits.len().saturating_sub(MOST_LIMITS);
        let more = if more > 0 { format!(", and {more} more") } else { String::new() };
        line("at limits", format!("{}{more}", named.join(", ")));
    }
    if let Some((term, obstacle)) = report.obstacle {
        line(
            "in the way",
            format!(
                "of {}: {}",
                objective_text(scenario, term),
                obstacle_text(scenario, term, obstacle, pose)
            ),
        );
    }
    printable(&text).into_owned()
}

/// The constraints among a scenario's objectives.
pub(crate) fn constraints<'a>(scenario: &'a Scenario, report: &Report<'_>) -> Vec<Constraint<'a>> {
    let parts = report.terms.iter().map(|term| (term.parts().collect(), None));
    constraints::constraints(&scenario.rig, &scenario.problem, &scenario.objectives, parts)
}

/// A table of objectives, its numbers to the right.
pub(crate) fn table(header: [&str; 7]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.style_mut().row_separator = LineStyle::none();
    table.set_header(header);
    for column in [0, 4, 5] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

fn objectives(scenario: &Scenario, report: &Report<'_>) -> Table {
    let by_cost = scenario.solver.options().cost_below.is_some();
    let mut table = table(["", "objective", "joint", "target", "weight", "residual", ""]);
    for (idx, term) in report.terms.iter().enumerate() {
        let mark = match (term.satisfied, term.mandatory) {
            // Nothing is wanted of it.
            _ if term.weight == 0.0 && !term.hard => "off",
            (true, _) => "ok",
            // Where the cost decides, a tolerance does not.
            (false, true) if by_cost && report.success => "",
            (false, true) => "unmet",
            (false, false) => "shapes", // it only shapes the pose
        };
        table.add_row([
            (idx + 1).to_string(),
            scenario.objectives.get(idx).map_or(term.kind, |o| o.kind).to_owned(),
            joint_text(scenario, idx),
            scenario.target_text(idx, short),
            weight_text(term.weight, term.hard),
            residual_text(term.parts()),
            mark.to_owned(),
        ]);
    }
    table
}

/// The joint's own name, with its role where that is another.
fn joint_text(scenario: &Scenario, objective: usize) -> String {
    let joint = scenario.objectives.get(objective).and_then(|o| o.joint).and_then(|id| scenario.rig.get(id));
    match joint {
        None => "several".to_owned(),
        Some(joint) => match joint.role.map(Role::name) {
            Some(role) if role != joint.name => printable(&format!("{} ({role})", joint.name)).into_owned(),
            _ => printable(&joint.name).into_owned(),
        },
    }
}

/// What a term weighs; `hard` where it must hold.
pub(crate) fn weight_text(weight: f64, is_hard: bool) -> String {
    if is_hard { "hard".to_owned() } else { short(weight) }
}

/// The residuals of all parts; of a bound that is kept, what is left to it.
pub(crate) fn residual_text(parts: impl Iterator<Item = PartReport>) -> String {
    let text = |PartReport { residual, unit, least }| match least {
        Some(least) if least > 0.0 => format!("{} left", numbers::residual(least, unit)),
        _ => numbers::residual(residual, unit),
    };
    parts.map(text).collect::<Vec<_>>().join(", ")
}

pub(crate) fn stop_text(stop: StopReason, options: &SolverOptions) -> String {
    match (stop, options.cost_below) {
        (StopReason::Reached, Some(bar)) => format!("the cost is below {}", short(bar)),
        (StopReason::Reached, None) => "every objective that counts is within its tolerance".to_owned(),
        (StopReason::Converged, _) => {
            "this is the best pose nearby: no step makes the cost smaller".to_owned()
        }
        (StopReason::IterationLimit, _) => {
            format!("all {} iterations of a start were used up", options.max_iterations)
        }
        (StopReason::TimeBudget, _) => "the time budget was used up".to_owned(),
        (StopReason::NoProgress, _) => "the method found no better pose".to_owned(),
        (StopReason::InvalidInput, _) => "the input is not usable".to_owned(),
        (StopReason::ObjectiveFailed, _) => "an objective gave up".to_owned(),
    }
}

/// Why an objective stays as it is.
pub(crate) fn nothing_moves(joint: &str) -> String {
    format!("no active joint moves '{joint}'")
}

fn objective_text(scenario: &Scenario, term: usize) -> String {
    let kind = scenario.objectives.get(term).map_or("", |o| o.kind);
    match scenario.joint_name(term) {
        Some(joint) => format!("objective {} ({kind} of {joint})", term + 1),
        None => format!("objective {} ({kind})", term + 1),
    }
}

fn obstacle_text(scenario: &Scenario, term: usize, obstacle: Obstacle, pose: &Pose) -> String {
    if let Some(joint) = scenario.out_of_hand(term) {
        return format!("{}: expected a joint above it in 'active'", nothing_moves(joint));
    }
    match obstacle {
        Obstacle::Limit(limit) => format!("the limit of {}", limit_text(&limit, pose)),
        Obstacle::Term(other) => format!("{} pulls the other way", objective_text(scenario, other)),
        Obstacle::Reach => "its target is out of reach from here".to_owned(),
    }
}

/// The joint, which of its limits, and the value there.
fn limit_text(limit: &ActiveLimit, pose: &Pose) -> String {
    let rig = pose.rig();
    let name = name(rig, limit.joint);
    match limit.kind {
        LimitKind::Angle(axis) => {
            let angle = pose.euler(limit.joint).and_then(|a| a.get(axis).copied()).unwrap_or_default();
            format!("{name} angle {} {}", ["x", "y", "z"].get(axis).unwrap_or(&""), numbers::angle(angle))
        }
        LimitKind::Value => {
            let value = pose.value(limit.joint).unwrap_or_default();
            match rig.get(limit.joint).map(|j| j.motion) {
                Some(JointMotion::Slider { .. }) => format!("{name} offset {} m", numbers::length(value)),
                Some(
                    JointMotion::Fixed
                    | JointMotion::Hinge { .. }
                    | JointMotion::Euler { .. }
                    | JointMotion::Ball { .. }
                    | JointMotion::Free { .. },
                )
                | None => format!("{name} angle {}", numbers::angle(value)),
            }
        }
        LimitKind::Swing | LimitKind::Twist => {
            let cone = rig.get(limit.joint).and_then(|j| j.motion.cone().copied());
            let (swing, twist) = cone.map(|c| c.decompose(pose.rotation(limit.joint))).unwrap_or_default();
            match limit.kind {
                LimitKind::Swing => format!("{name} swing {}", numbers::angle(swing[0].hypot(swing[1]))),
                _ => format!("{name} twist {}", numbers::angle(twist)),
            }
        }
    }
}

fn name(rig: &Rig, joint: JointId) -> &str {
    rig.get(joint).map_or("", |j| &j.name)
}
