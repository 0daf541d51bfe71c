//! `ikiru solve SCENARIO`: reads, solves, writes, reports.

use std::time::{Duration, Instant};

use anyhow::anyhow;
use ikiru_rig::Pose;
use ikiru_scenario::Scenario;
use ikiru_solve::{Invalid, Report};

use crate::args::{Out, SolveArgs, has_ending};
use crate::failure::{Failure, Outcome};
use crate::{json, output, report};

pub(crate) fn run(args: &SolveArgs) -> Result<Outcome, Failure> {
    if has_ending(&args.scenario, &["glb", "gltf", "vrm", "bvh", "urdf"]) {
        let path = args.scenario.display();
        return Err(Failure::input(anyhow!(
            "{path} is a rig, not a scenario: expected a .toml file that names it, rig = \"{path}\"; \
             'ikiru inspect {path}' shows what is in it"
        )));
    }
    let scenario = Scenario::read(&args.scenario).map_err(Failure::input)?;
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
    for warning in report::warnings(scenario, solved) {
        output::note(format!("warning: {warning}"));
    }
    let invalid = solved.invalid.map(|invalid| invalid_input(scenario, invalid));
    // A pose that was not solved for is not written.
    let written =
        out.filter(|_| invalid.is_none()).map(|out| output::write_posed(scenario, pose, out).map(|()| out));
    if as_json {
        output::print(&format!("{}\n", json::solved(scenario, solved, pose, time)))?;
    } else if invalid.is_none() {
        output::print(&report::solved(scenario, solved, pose, time, notes))?;
    }
    if let Some(invalid) = invalid {
        return Err(invalid);
    }
    if let Some(out) = written.transpose()? {
        let line = format!("wrote {}", out.path.display());
        if as_json { output::note(line) } else { output::print(&format!("{}\n", output::printable(&line)))? }
    }
    Ok(if solved.success { Outcome::Reached } else { Outcome::BestEffort })
}

fn invalid_input(scenario: &Scenario, invalid: Invalid) -> Failure {
    let name = &scenario.name;
    Failure::input(match invalid {
        Invalid::Term(term, what) => {
            let kind = scenario.objectives.get(term).map_or("", |o| o.kind);
            anyhow!("{name}: objective {} ({kind}) {what}", term + 1)
        }
        Invalid::Pose(what) => anyhow!("{name}: the start {what}"),
        Invalid::Options(what) => anyhow!("{name}: {what}"),
    })
}
