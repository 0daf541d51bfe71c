//! The command `ikiru`: what was typed → what it means → library calls.

mod args;
mod commands;
mod constraints;
mod failure;
mod features;
mod input;
mod json;
mod numbers;
mod obstacles;
mod output;
mod report;
mod warnings;

use std::process::ExitCode;

use clap::Parser;

use args::{Args, Command};

fn main() -> ExitCode {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(error) => {
            // Help and version come this way as well. A closed pipe is no reason to complain.
            let _ = error.print();
            if error.use_stderr() && args::asks_for_json(std::env::args_os()) {
                let _ = output::print(&format!("{}\n", failure::misuse(&error)));
            }
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let as_json = args.command.is_json();
    let done = match args.command {
        Command::Demo(demo) => commands::demo::run(&demo),
        Command::Inspect(inspect) => commands::inspect::run(&inspect),
        Command::Solve(solve) => commands::solve::run(&solve),
        Command::Plan(plan) => commands::plan::run(&plan),
        Command::Convert(convert) => commands::convert::run(&convert),
        #[cfg(feature = "bench")]
        Command::Bench(bench) => commands::bench::run(&bench),
        #[cfg(not(feature = "bench"))]
        Command::Bench(_) => Err(features::left_out("ikiru bench", "bench")),
    };
    match done {
        Ok(outcome) => outcome.exit_code(),
        Err(failure) => {
            output::error(&failure, as_json);
            failure.exit_code()
        }
    }
}
