//! `ikiru inspect RIG`: what a rig has, so that targets and limits can be chosen.

mod facts;
mod json;
mod text;
mod tree;

use anyhow::anyhow;

use crate::args::{InspectArgs, has_ending};
use crate::failure::{Failure, Outcome};
use crate::input::{is_stdin, read_rig, read_scenario};
use crate::output;

use facts::Facts;

pub(crate) fn run(args: &InspectArgs) -> Result<Outcome, Failure> {
    let facts = if is_stdin(&args.rig) || has_ending(&args.rig, &["toml"]) {
        if args.roles.is_some() || args.scale.is_some() {
            let path = args.rig.display();
            let reason =
                "is a scenario, which says roles and scale itself: expected a rig beside --roles and --scale";
            return Err(Failure::input(anyhow!("{path} {reason}")));
        }
        Facts::of_scenario(read_scenario(&args.rig)?)
    } else {
        Facts::of_rig(read_rig(&args.rig, args.roles.as_deref(), args.scale)?)
    };
    if args.json {
        output::print(&format!("{}\n", json::inspected(&facts)))?;
    } else {
        output::print(&output::printable(&text::inspected(&facts)))?;
    }
    Ok(Outcome::Reached)
}
