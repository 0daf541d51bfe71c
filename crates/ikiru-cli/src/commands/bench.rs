//! `ikiru bench paper`, `robots`, `track` and `motions`: measures, prints tables, writes rows and figures.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, anyhow};
use ikiru_eval::motions::{self, MotionSource, Way};
use ikiru_eval::paper::{self, CONTENDERS, Contender, Row, TargetSet, Task};
use ikiru_eval::robots::{self, Arm};
use ikiru_eval::track::{self, Course};
use ikiru_rig::Clip;
use ikiru_scenario::Scenario;
use ikiru_scenario::{method_named, methods};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::args::{BenchCommand, MotionsArgs, PaperArgs, RobotsArgs, TrackArgs, has_ending};
use crate::failure::{Failure, Outcome};
use crate::{features, output};

/// What is measured together: a task on a set of targets.
struct PaperRun {
    task: Task,
    /// Points of a trajectory; 0 for poses.
    points: usize,
    scenario: Scenario,
    set: TargetSet,
    contenders: Vec<Contender>,
    /// Whether it is the set that the paper does not have.
    is_beside: bool,
}

pub(crate) fn run(command: &BenchCommand) -> Result<Outcome, Failure> {
    match command {
        BenchCommand::Paper(args) => paper(args),
        BenchCommand::Robots(args) => robots(args),
        BenchCommand::Track(args) => track(args),
        BenchCommand::Motions(args) => motions(args),
    }
}

fn paper(args: &PaperArgs) -> Result<Outcome, Failure> {
    let contenders = contenders(&args.methods)?;
    let settings = paper::Settings { restarts: args.restarts, runs: args.runs, warmup: args.warmup };
    if let Some(folder) = &args.out {
        make_folder(folder)?;
    }
    let mut paper_runs = paper_runs(args, &contenders)?;
    let n_solves: usize =
        paper_runs.iter().map(|p| p.set.points.len() * p.contenders.len() * settings.runs).sum();
    let bar = progress(n_solves, "solving");
    let mut all: Vec<Vec<Row>> = Vec::new();
    for paper_run in &mut paper_runs {
        let done = || bar.inc(1);
        let rows = if paper_run.points == 0 {
            paper::run(
                paper_run.task,
                &mut paper_run.scenario,
                &paper_run.set,
                &paper_run.contenders,
                &settings,
                done,
            )
        } else {
            paper::run_trajectories(
                paper_run.task,
                paper_run.points,
                &paper_run.set,
                &paper_run.contenders,
                &settings,
                done,
            )
        };
        all.push(rows.map_err(Failure::input)?);
    }
    bar.finish_and_clear();
    let mut markdown = String::new();
    for (paper_run, rows) in paper_runs.iter().zip(&all) {
        let report = paper::Report::new(paper_run.task, rows);
        output::print(&format!("{}\n", report.for_terminal()))?;
        markdown += &format!("{}\n", report.markdown());
    }
    if let Some(path) = &args.json {
        let of_paper: Vec<&Row> = paper_runs
            .iter()
            .zip(&all)
            .filter(|(paper_run, _)| !paper_run.is_beside)
            .flat_map(|(_, rows)| rows)
            .collect();
        write_json(path, &of_paper)?;
    }
    if let Some(folder) = &args.out {
        let csv = paper::csv(&all.concat()).map_err(Failure::write)?;
        output::write(&folder.join("results.csv"), &csv)?;
        output::write(&folder.join("results.md"), markdown.as_bytes())?;
        let poses = |paper_run: &PaperRun| paper_run.points == 0 && !paper_run.is_beside;
        for (paper_run, rows) in paper_runs.iter_mut().zip(&all).filter(|(paper_run, _)| poses(paper_run)) {
            if args.sample.is_some() {
                let name = format!("targets_{}.json", paper_run.task.name());
                output::write(&folder.join(name), paper_run.set.to_json().as_bytes())?;
            }
            write_figures(paper_run, rows, folder)?;
        }
        if !cfg!(feature = "plot") {
            output::note(format!("no figures were drawn. {}", features::how_to_build("plot")));
        }
        output::print(&format!("wrote {}\n", output::printable(&folder.display().to_string())))?;
    }
    Ok(Outcome::Reached)
}

#[cfg(feature = "plot")]
fn write_figures(paper_run: &mut PaperRun, rows: &[Row], folder: &Path) -> Result<(), Failure> {
    let PaperRun { task, scenario, set, contenders, .. } = paper_run;
    paper::write_figures(*task, scenario, set, contenders, rows, folder).map_err(Failure::write)?;
    Ok(())
}

#[cfg(not(feature = "plot"))]
fn write_figures(_: &mut PaperRun, _: &[Row], _: &Path) -> Result<(), Failure> {
    Ok(())
}

fn contenders(names: &[String]) -> Result<Vec<Contender>, Failure> {
    if names.is_empty() {
        return Ok(CONTENDERS.to_vec());
    }
    names.iter().map(|name| Contender::from_name(name.trim()).map_err(Failure::input)).collect()
}

fn paper_runs(args: &PaperArgs, contenders: &[Contender]) -> Result<Vec<PaperRun>, Failure> {
    let tasks = match &args.objective {
        Some(name) => vec![Task::from_name(name).map_err(Failure::input)?],
        None => Task::ALL.to_vec(),
    };
    let given = args.targets.as_deref().map(TargetSet::read).transpose().map_err(Failure::input)?;
    let planners: Vec<Contender> = contenders.iter().filter(|c| c.plans()).copied().collect();
    if args.points.iter().any(|p| *p > 0) && planners.is_empty() {
        return Err(Failure::input(anyhow!(
            "none of the methods plans trajectories: expected lm, lm-local or adam"
        )));
    }
    let mut paper_runs = Vec::new();
    for (task, &points) in tasks.into_iter().flat_map(|task| args.points.iter().map(move |p| (task, p))) {
        let mut scenario = task.scenario(args.rig.as_deref()).map_err(Failure::input)?;
        let set = match (&given, args.sample) {
            (Some(set), _) => set.clone(),
            (None, Some(n)) => {
                let bar = progress(n, "sampling");
                let set = paper::sample(task, &mut scenario, n, args.seed, args.restarts, || bar.inc(1));
                bar.finish_and_clear();
                set.map_err(Failure::input)?
            }
            (None, None) if points > 0 => TargetSet::of_points(points).map_err(Failure::input)?,
            (None, None) => TargetSet::of_task(task).map_err(Failure::input)?,
        };
        let is_alone = points > 0 || given.is_some() || args.sample.is_some() || args.rig.is_some();
        let contenders = if points > 0 { planners.clone() } else { contenders.to_vec() };
        paper_runs.push(PaperRun {
            task,
            points,
            scenario,
            set,
            contenders: contenders.clone(),
            is_beside: false,
        });
        if task == Task::Simple && !is_alone {
            let scenario = task.scenario(None).map_err(Failure::input)?;
            let set = TargetSet::builtin("reachable").map_err(Failure::input)?;
            paper_runs.push(PaperRun { task, points, scenario, set, contenders, is_beside: true });
        }
    }
    Ok(paper_runs)
}

fn robots(args: &RobotsArgs) -> Result<Outcome, Failure> {
    let arms = arms(args)?;
    let method = method_named(&args.method).ok_or_else(|| {
        let known: Vec<&str> = methods().map(|method| method.name()).collect();
        Failure::input(anyhow!("there is no method '{}': expected one of {}", args.method, known.join(", ")))
    })?;
    let settings = robots::Settings {
        n: args.n,
        seed: args.seed,
        time_limit: Duration::from_secs_f64(args.time_limit_ms / 1e3),
        method,
        ..robots::Settings::default()
    };
    let bar = progress(arms.len() * settings.n, "solving");
    let mut rows = Vec::new();
    for arm in &arms {
        rows.extend(robots::run(arm, &settings, || bar.inc(1)).map_err(Failure::input)?);
    }
    bar.finish_and_clear();
    let report = robots::Report::new(&rows);
    output::print(&if args.markdown { report.markdown() } else { report.for_terminal() })?;
    if let Some(path) = &args.json {
        write_json(path, &rows)?;
    }
    Ok(Outcome::Reached)
}

fn arms(args: &RobotsArgs) -> Result<Vec<Arm>, Failure> {
    if let (Some(rig), Some(base), Some(tip)) = (&args.urdf, &args.base, &args.tip) {
        let robot = rig.file_stem().map_or_else(|| "robot".into(), |s| s.to_string_lossy().into_owned());
        return Ok(vec![Arm { robot, rig: rig.clone(), base: base.clone(), tip: tip.clone() }]);
    }
    if args.robots.is_empty() {
        return Ok(Arm::all());
    }
    args.robots.iter().map(|name| Arm::from_name(name.trim()).map_err(Failure::input)).collect()
}

fn track(args: &TrackArgs) -> Result<Outcome, Failure> {
    let courses = courses(args)?;
    let settings = track::Settings { runs: args.runs, ..track::Settings::default() };
    let n_frames: usize = courses.iter().map(|course| course.frames.len()).sum();
    let bar = progress(n_frames * settings.runs, "following");
    let mut rows = Vec::with_capacity(n_frames);
    for course in &courses {
        rows.extend(track::run(course, &settings, || bar.inc(1)).map_err(Failure::input)?);
    }
    bar.finish_and_clear();
    let report = track::Report::new(&rows);
    output::print(&if args.markdown { report.markdown() } else { report.for_terminal() })?;
    if let Some(path) = &args.json {
        write_json(path, &rows)?;
    }
    Ok(Outcome::Reached)
}

fn courses(args: &TrackArgs) -> Result<Vec<Course>, Failure> {
    let bodies: Vec<&str> = args.bodies.iter().map(|body| body.trim()).collect();
    let mut clips = Vec::new();
    if bodies != ["g1"] {
        for clip in &args.clips {
            clips.push(Course::clip(clip).map_err(Failure::input)?);
        }
    }
    let mut courses = Vec::new();
    for body in bodies {
        for &rate in &args.rates {
            let of_clips = |course: fn(&str, &Clip, f64, usize) -> Result<Course, ikiru_eval::Error>| {
                clips.iter().map(move |(name, clip)| course(name, clip, rate, args.frames)).collect()
            };
            let made: Result<Vec<Course>, _> = match body {
                "g1" => Course::g1(args.seed, rate, args.frames).map(|course| vec![course]),
                "human" => of_clips(Course::human),
                "reference" => of_clips(Course::reference),
                _ => {
                    let unknown = ikiru_rig::unknown_name(body, ["g1", "human", "reference"]);
                    return Err(Failure::input(anyhow!(
                        "--bodies: {unknown}: expected g1, human or reference"
                    )));
                }
            };
            courses.extend(made.map_err(Failure::input)?);
        }
    }
    Ok(if args.away { courses.into_iter().map(Course::away).collect() } else { courses })
}

fn motions(args: &MotionsArgs) -> Result<Outcome, Failure> {
    let sources = if args.scenarios.is_empty() {
        MotionSource::all()
    } else {
        let found: Result<_, _> =
            args.scenarios.iter().map(|scenario| MotionSource::find(scenario)).collect();
        found.map_err(Failure::input)?
    };
    let settings = motions::Settings { runs: args.runs };
    let bar = progress(sources.len() * Way::ALL.len() * settings.runs, "planning");
    let mut rows: Vec<motions::Row> = Vec::new();
    for source in &sources {
        let outcomes = motions::run(source, &settings, || bar.inc(1)).map_err(Failure::input)?;
        rows.extend(outcomes.into_iter().map(|outcome| outcome.row));
    }
    bar.finish_and_clear();
    let report = motions::Report::new(&rows);
    if args.json {
        output::print(&json_text(&rows)?)?;
    } else {
        output::print(&output::printable(&report.for_terminal()))?;
    }
    if let Some(path) = &args.out {
        let text = if has_ending(path, &["json"]) { json_text(&rows)? } else { report.markdown() };
        output::write(path, text.as_bytes())?;
        output::note(format!("wrote {}", path.display()));
    }
    Ok(Outcome::Reached)
}

/// A bar on stderr; nothing where stderr is no terminal.
fn progress(n: usize, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(u64::try_from(n).unwrap_or(u64::MAX));
    let style = ProgressStyle::with_template("{msg} [{bar:40}] {human_pos} of {human_len}, {eta} left");
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())).with_message(what)
}

fn make_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("the folder {} cannot be made", folder.display()))
        .map_err(Failure::write)
}

fn write_json(path: &Path, rows: &impl Serialize) -> Result<(), Failure> {
    output::write(path, json_text(rows)?.as_bytes())
}

fn json_text(rows: &impl Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string(rows).map_err(Failure::write)? + "\n")
}
