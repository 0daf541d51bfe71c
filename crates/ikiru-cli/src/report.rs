//! Reports for people: tables and sentences.

use std::fmt::Write as _;
use std::time::Duration;

use comfy_table::{CellAlignment, LineStyle, Table, presets};
use ikiru_rig::{Pose, Role};
use ikiru_scenario::Scenario;
use ikiru_solve::{PartReport, Report, SolverOptions, StopReason};

use crate::constraints::{self, Constraint};
use crate::numbers::{self, short};
use crate::obstacles::About;
use crate::output::printable;
use crate::warnings;

/// What the user should know besides the result.
pub(crate) fn warnings(scenario: &Scenario, report: &Report<'_>) -> Vec<String> {
    warnings::of_scenario(&scenario.warnings).into_iter().chain(of_terms(report)).collect()
}

/// What of that objectives told.
pub(crate) fn of_terms(report: &Report<'_>) -> impl Iterator<Item = String> {
    report
        .terms
        .iter()
        .enumerate()
        .filter_map(|(idx, term)| term.warning.map(|w| format!("objective {} ({}) {w}", idx + 1, term.kind)))
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
    let about = About::pose(scenario);
    for (key, words) in about.lines(&report.forces, report.hint, report.success, |_| pose.clone()) {
        line(key, words);
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
    let text = |PartReport { residual, unit, least, .. }| match least {
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
        (StopReason::Cancelled, _) => "cancelled".to_owned(),
        (other, _) => other.name().replace('_', " "),
    }
}
