//! `ikiru demo`: the main job on the built-in human, without a file to write first.

use std::time::{Duration, Instant};

use ikiru_scenario::Scenario;

use crate::args::DemoArgs;
use crate::commands::solve::finish;
use crate::failure::{Failure, Outcome};
use crate::numbers;

/// How often the demo is solved again to tell the warm time, and how long that may take at most.
const WARM_SOLVES: u32 = 1000;
const MOST_TIME: Duration = Duration::from_secs(1);

pub(crate) fn run(args: &DemoArgs) -> Result<Outcome, Failure> {
    let scenario = Scenario::builtin("demo").map_err(Failure::input)?;
    let mut workspace = scenario.workspace();
    let mut pose = scenario.start.clone();
    let begin = Instant::now();
    scenario.solve(&mut pose, &mut workspace);
    let first = begin.elapsed();
    let mut notes = Vec::new();
    if !args.json {
        let (begin, mut n_solves) = (Instant::now(), 0);
        while n_solves < WARM_SOLVES && (n_solves == 0 || begin.elapsed() < MOST_TIME) {
            pose.clone_from(&scenario.start);
            scenario.solve(&mut pose, &mut workspace);
            n_solves += 1;
        }
        let mean = begin.elapsed() / n_solves;
        let count = if n_solves == WARM_SOLVES { "1,000".to_owned() } else { n_solves.to_string() };
        notes.push(format!("first solve, mean of {count} warm ones: {}", numbers::time(mean)));
    }
    // Solving is deterministic: once more for the report gives the same pose.
    pose.clone_from(&scenario.start);
    let report = scenario.solve(&mut pose, &mut workspace);
    finish(&scenario, &report, &pose, first, Some(&args.out), args.json, &notes)
}
