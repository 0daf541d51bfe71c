//! `cargo xtask fuzz`: every reader under cargo-fuzz for a while, from seeds that the repository holds.

mod seeds;

use std::collections::VecDeque;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};

use crate::cargo;

/// No input is longer: what matters about a format shows in less, and short inputs run by the thousand a second.
const MAX_INPUT_BYTES: usize = 65_536;

/// How libFuzzer runs. Time and memory hold the promise that no input makes a reader hang or grow.
const OPTIONS: [&str; 3] = ["-timeout=5", "-malloc_limit_mb=200", "-print_final_stats=1"];

/// Seconds for each target where neither time nor number of runs is given.
const DEFAULT_SECS: u64 = 60;

/// What of a failed run is shown: its last lines.
const MOST_LINES: usize = 40;

/// What was asked for: which target (all, if none is named), and when to stop.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Plan {
    target: Option<String>,
    /// Seconds for each target.
    secs: Option<u64>,
    /// Inputs for each target.
    runs: Option<u64>,
}

impl Plan {
    /// `[TARGET] [--secs N] [--runs N]`, in any order.
    pub(crate) fn parse(args: &[&str]) -> Result<Self> {
        let mut plan = Self::default();
        let mut args = args.iter();
        while let Some(arg) = args.next() {
            let slot = match *arg {
                "--secs" => &mut plan.secs,
                "--runs" => &mut plan.runs,
                option if option.starts_with('-') => {
                    bail!("fuzz: no option `{option}`, expected --secs N or --runs N")
                }
                target if plan.target.is_none() => {
                    plan.target = Some(target.to_owned());
                    continue;
                }
                more => bail!("fuzz: a second target `{more}`, expected one or none for all"),
            };
            let number = args.next().copied().unwrap_or("nothing");
            let parsed = number.parse().ok().filter(|n| *n > 0);
            *slot = Some(parsed.with_context(|| format!("fuzz: {arg} {number}, expected a number above 0"))?);
        }
        Ok(plan)
    }

    fn limits(&self) -> Vec<String> {
        let secs = self.secs.or(self.runs.is_none().then_some(DEFAULT_SECS));
        let secs = secs.map(|secs| format!("-max_total_time={secs}"));
        secs.into_iter().chain(self.runs.map(|runs| format!("-runs={runs}"))).collect()
    }
}

/// Builds and runs the targets one after the other, and prints a line of totals for each. What a run finds lies in
/// `fuzz/artifacts/`; the error names the targets that found something.
pub(crate) fn run(root: &Path, plan: &Plan) -> Result<()> {
    let known = targets(root)?;
    let targets = match &plan.target {
        None => known,
        Some(target) => {
            ensure!(
                known.contains(target),
                "no fuzz target `{target}`, expected one of: {}",
                known.join(", ")
            );
            vec![target.clone()]
        }
    };
    let tools = Tools::find(root)?;
    let mut failed = Vec::new();
    for target in &targets {
        let n_seeds = seeds::write(root, target, MAX_INPUT_BYTES)?;
        cargo::finish(tools.cargo_fuzz(root, "build").arg(target))?;
        let mut command = tools.cargo_fuzz(root, "run");
        command.arg(target).arg("--").args(OPTIONS).arg(format!("-max_len={MAX_INPUT_BYTES}"));
        command.args(plan.limits());
        let start = Instant::now();
        let outcome = watch(&mut command)?;
        let n_inputs = fs::read_dir(root.join("fuzz/corpus").join(target)).map_or(0, Iterator::count);
        println!(
            "fuzz {target}: {}, {:.0} s, {n_inputs} inputs ({n_seeds} of them seeds), {}",
            outcome.totals,
            start.elapsed().as_secs_f64(),
            if outcome.is_fine { "nothing found" } else { "FAILED" }
        );
        if !outcome.is_fine {
            outcome.last_lines.iter().for_each(|line| println!("    {line}"));
            failed.push(target.as_str());
        }
    }
    ensure!(failed.is_empty(), "fuzzing failed: {}; the inputs lie in fuzz/artifacts/", failed.join(", "));
    Ok(())
}

/// The binaries of `fuzz/Cargo.toml`, in its order.
fn targets(root: &Path) -> Result<Vec<String>> {
    let file = root.join("fuzz/Cargo.toml");
    let text = fs::read_to_string(&file).with_context(|| file.display().to_string())?;
    let manifest: toml::Table = text.parse().with_context(|| file.display().to_string())?;
    let bins =
        manifest.get("bin").and_then(toml::Value::as_array).context("fuzz/Cargo.toml has no [[bin]]")?;
    let name = |bin: &toml::Value| bin.get("name").and_then(toml::Value::as_str).map(str::to_owned);
    bins.iter().map(|bin| name(bin).context("fuzz/Cargo.toml: a [[bin]] has no name")).collect()
}

/// With which compiler to fuzz.
struct Tools {
    has_nightly: bool,
}

impl Tools {
    /// Fails without cargo-fuzz, and says how to get it. Without a nightly compiler the one at hand does, as far as
    /// it can.
    fn find(root: &Path) -> Result<Self> {
        let is_there = |command: &mut Command| {
            command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
        };
        ensure!(
            is_there(cargo::command(root).args(["fuzz", "--version"])),
            "cargo-fuzz is not installed: run `cargo install cargo-fuzz`"
        );
        let has_nightly = is_there(Command::new("rustup").args(["run", "nightly", "cargo", "--version"]));
        if !has_nightly {
            println!(
                "fuzz: no nightly compiler is installed (`rustup toolchain install nightly`): the one at hand is \
                 used, without the address sanitizer"
            );
        }
        Ok(Self { has_nightly })
    }

    fn cargo_fuzz(&self, root: &Path, subcommand: &str) -> Command {
        let mut command = if self.has_nightly {
            let mut command = Command::new("rustup");
            command.current_dir(root).args(["run", "nightly", "cargo"]);
            command
        } else {
            let mut command = cargo::command(root);
            command.env("RUSTC_BOOTSTRAP", "1");
            command
        };
        command.args(["fuzz", subcommand]);
        if !self.has_nightly {
            command.args(["--sanitizer", "none"]);
        }
        command
    }
}

/// How a run ended.
struct Outcome {
    is_fine: bool,
    /// `12345 runs, 678 edges`.
    totals: String,
    last_lines: VecDeque<String>,
}

/// Runs a target to its end and keeps what it says last.
fn watch(command: &mut Command) -> Result<Outcome> {
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("{command:?} could not be started"))?;
    let (mut totals, mut last_lines) = (Totals::default(), VecDeque::new());
    let stderr = child.stderr.take().context("the run has no output")?;
    for line in BufReader::new(stderr).split(b'\n') {
        let line = String::from_utf8_lossy(&line?).into_owned();
        totals.take(&line);
        last_lines.push_back(line);
        if last_lines.len() > MOST_LINES {
            last_lines.pop_front();
        }
    }
    let is_fine = child.wait()?.success();
    Ok(Outcome { is_fine, totals: totals.to_string(), last_lines })
}

/// What libFuzzer tells of a run.
#[derive(Debug, Default, PartialEq, Eq)]
struct Totals {
    runs: u64,
    edges: u64,
}

impl Totals {
    /// Reads a line such as `#4096 pulse  cov: 1530 ft: 2671 corp: 90/11Kb …` or
    /// `stat::number_of_executed_units: 4107`.
    fn take(&mut self, line: &str) {
        let mut words = line.split_whitespace();
        let Some(first) = words.next() else { return };
        let number = |word: Option<&str>| word.and_then(|word| word.parse::<u64>().ok());
        if let Some(runs) = number(first.strip_prefix('#')) {
            self.runs = self.runs.max(runs);
            if let Some(edges) = number(words.skip_while(|word| *word != "cov:").nth(1)) {
                self.edges = self.edges.max(edges);
            }
        } else if first == "stat::number_of_executed_units:" {
            self.runs = self.runs.max(number(words.next()).unwrap_or(0));
        }
    }
}

impl std::fmt::Display for Totals {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} runs, {} edges", self.runs, self.edges)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    #[test]
    fn arguments_in_any_order() {
        let plan = Plan::parse(&["--runs", "7", "bvh", "--secs", "3"]).unwrap();
        assert_eq!(plan, Plan { target: Some("bvh".into()), secs: Some(3), runs: Some(7) });
        assert_eq!(plan.limits(), ["-max_total_time=3", "-runs=7"]);
        assert_eq!(Plan::parse(&[]).unwrap().limits(), ["-max_total_time=60"]);
        assert_eq!(Plan::parse(&["--runs", "7"]).unwrap().limits(), ["-runs=7"]);
        let message = |args: &[&str]| Plan::parse(args).unwrap_err().to_string();
        assert_eq!(message(&["--secs"]), "fuzz: --secs nothing, expected a number above 0");
        assert_eq!(message(&["--runs", "0"]), "fuzz: --runs 0, expected a number above 0");
        assert_eq!(message(&["--time", "1"]), "fuzz: no option `--time`, expected --secs N or --runs N");
        assert_eq!(message(&["a", "b"]), "fuzz: a second target `b`, expected one or none for all");
    }

    #[test]
    fn totals_are_those_of_the_last_lines() {
        let mut totals = Totals::default();
        for line in [
            "INFO: Seed: 1",
            "#2\tINITED cov: 10 ft: 12 corp: 1/1b",
            "#4096\tpulse  cov: 1530 ft: 2671 corp: 90/11Kb lim: 4096",
            "",
            "Done 4107 runs in 2 second(s)",
            "stat::number_of_executed_units: 4107",
        ] {
            totals.take(line);
        }
        assert_eq!(totals.to_string(), "4107 runs, 1530 edges");
    }

    #[test]
    fn an_unknown_target_is_answered_with_the_known_ones() {
        let tree = Tree::new(&[("fuzz/Cargo.toml", "[[bin]]\nname = \"bvh\"\n[[bin]]\nname = \"urdf\"\n")]);
        let plan = Plan { target: Some("fbx".into()), ..Plan::default() };
        let message = run(tree.root(), &plan).unwrap_err().to_string();
        assert_eq!(message, "no fuzz target `fbx`, expected one of: bvh, urdf");
    }
}
