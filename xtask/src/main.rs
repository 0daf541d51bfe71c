//! The project's own chores: `cargo xtask test`, `cargo xtask tidy`, `cargo xtask page`, `cargo xtask api`, `cargo xtask fuzz`.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a command for developers: it talks by printing"
)]

mod api;
mod cargo;
mod deny;
mod features;
mod fuzz;
mod ipopt;
mod package;
mod test;
mod tidy;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};

const HELP: &str = "\
The project's own chores.

Usage: cargo xtask <COMMAND>

Commands:
  test   everything that must pass before a change is done, in order, stopping at the first failure
  tidy   the project's own rules: file heads and sizes, code map, dependency order, reasons,
         names of types, licences, words
  page   writes docs/scenario.md anew, from the tables by which scenarios are read
  api    writes what the published crates show to users into docs/api, where `test` compares it
  fuzz   [TARGET] [--secs N] [--runs N]: cargo-fuzz on one reader, or on all in turn, 60 s each by default
";

fn main() -> ExitCode {
    if let Some(rustdoc) = std::env::var_os(api::STANDS_IN_FOR) {
        return api::stand_in(&rustdoc);
    }
    let args: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["test"] => root().and_then(|root| test::run(&root)),
        ["tidy"] => root().and_then(|root| tidy::run(&root)),
        ["page"] => root().and_then(|root| write_page(&root)),
        ["api"] => root().and_then(|root| api::renew(&root)),
        ["fuzz", ref args @ ..] => match fuzz::Plan::parse(args) {
            Ok(plan) => root().and_then(|root| fuzz::run(&root, &plan)),
            Err(error) => {
                eprintln!("xtask: {error:#}");
                return ExitCode::from(2);
            }
        },
        [] | ["help" | "-h" | "--help"] => {
            print!("{HELP}");
            return ExitCode::SUCCESS;
        }
        _ => {
            eprintln!("xtask: no command `{}`, expected one of: test, tidy, page, api, fuzz", args.join(" "));
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The test that compares the page writes it where it is asked to.
fn write_page(root: &Path) -> Result<()> {
    let mut command = cargo::command(root);
    command.args([
        "test",
        "--quiet",
        "-p",
        "ikiru-scenario",
        "--test",
        "all",
        "the_page_is_what_the_tables_say",
    ]);
    cargo::finish(command.env("IKIRU_WRITE_PAGE", "1"))
}

/// The project's root: the folder above this crate.
fn root() -> Result<PathBuf> {
    let here = std::env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
    here.parent().map(Path::to_path_buf).context("xtask has no parent folder")
}
