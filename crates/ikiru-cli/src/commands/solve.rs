//! `ikiru solve SCENARIO`: reads, solves, writes, reports.

use std::time::{Duration, Instant};

use anyhow::anyhow;
use ikiru_rig::{Pose, Rig};
use ikiru_scenario::{Scenario, ScenarioObjective, refusal};
use ikiru_solve::{Invalid, Report};

use crate::args::{Out, SolveArgs, has_ending};
use crate::failure::{Failure, InFile, Outcome};
use crate::input::read_scenario;
use crate::{json, output, report};

pub(crate) fn run(args: &SolveArgs) -> Result<Outcome, Failure> {
    if has_ending(&args.scenario, &["glb", "gltf", "vrm", "bvh", "urdf"]) {
        let path = args.scenario.display();
        return Err(Failure::input(anyhow!(
            "{path} is a rig, not a scenario: expected a .toml file that names it, rig = \"{path}\"; \
             'ikiru inspect {path}' shows what is in it"
        )));
    }
    let scenario = read_scenario(&args.scenario)?;
    if scenario.motion.is_some() {
        let path = args.scenario.display();
        return Err(Failure::input(anyhow!("{path} has a [motion]: 'ikiru plan {path}' plans it over time")));
    }
    let mut workspace = scenario.workspace();
    let mut pose = scenario.start.clone();
    let begin = Instant::now();
    let solved = scenario.solve(&mut pose, &mut workspace);
    let time = begin.elapsed();
    finish(&scenario, &solved, &pose, time, args.out.as_ref(), args.json, &[])
}

/// Writes the pose, prints the report, and says how it came out. `notes` are lines for people alone.
pub(crate) fn finish(
    scenario: &Scenario,
    solved: &Report<'_>,
    pose: &Pose,
    time: Duration,
    out: Option<&Out>,
    as_json: bool,
    notes: &[String],
) -> Result<Outcome, Failure> {
    if let Some(invalid) = solved.invalid {
        return Err(invalid_input(&scenario.name, &scenario.rig, &scenario.objectives, invalid));
    }
    for warning in report::warnings(scenario, solved) {
        output::note(format!("warning: {warning}"));
    }
    // The result is printed even where it cannot be written.
    let written = out.map(|out| output::write_posed(scenario, pose, out).map(|()| out));
    if as_json {
        output::print(&format!("{}\n", json::solved(scenario, solved, pose, time)))?;
    } else {
        output::print(&report::solved(scenario, solved, pose, time, notes))?;
    }
    if let Some(out) = written.transpose()? {
        let line = format!("wrote {}", out.path.display());
        if as_json { output::note(line) } else { output::print(&format!("{}\n", output::printable(&line)))? }
    }
    Ok(if solved.success { Outcome::Reached } else { Outcome::BestEffort })
}

/// What the solver refused, at the objective's place in the text.
pub(crate) fn invalid_input(
    file: &str,
    rig: &Rig,
    objectives: &[ScenarioObjective],
    invalid: Invalid,
) -> Failure {
    let place = match invalid {
        Invalid::Term(term, _) => objectives.get(term).and_then(|objective| objective.place),
        _ => None,
    };
    Failure::input(InFile { file: file.to_owned(), place, what: refusal(rig, objectives, invalid) })
}
