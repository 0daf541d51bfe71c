//! `ikiru plan SCENARIO`: a motion over time: reads, plans, writes, reports.

use std::time::{Duration, Instant};

use ikiru_formats::{motion_csv, motion_json, name_motion_rig, write_clip};
use ikiru_rig::{Clip, Rate, RateExcess, RateLimit, RatePart, Rig};
use ikiru_scenario::{MotionScenario, PlannedScenario};
use ikiru_solve::{Force, MotionWorkspace, Report};
use serde_json::{Value, json};

use crate::args::{MotionFormat, PlanArgs};
use crate::commands::solve::invalid_input;
use crate::constraints::{self, Constraint};
use crate::failure::{Failure, Outcome};
use crate::input::read_scenario;
use crate::numbers::{self, short};
use crate::obstacles::{About, nothing_moves};
use crate::{features, json, output, report, warnings};

/// What is said of an objective besides its figures.
struct Label {
    kind: &'static str,
    joint: Option<String>,
    target: Value,
    level: Option<u32>,
}

pub(crate) fn run(args: &PlanArgs) -> Result<Outcome, Failure> {
    if args.plot.is_some() {
        features::require_plot("--plot")?;
    }
    let scenario = read_scenario(&args.scenario)?;
    let mut labels: Vec<Label> = (0..scenario.objectives.len())
        .map(|idx| Label {
            kind: scenario.objectives[idx].kind,
            joint: scenario.joint_name(idx).map(str::to_owned),
            target: scenario.target_json(idx),
            level: json::level(&scenario.objectives, &scenario.problem, idx),
        })
        .collect();
    let mut motion = scenario.into_motion().map_err(Failure::input)?;
    let mut warnings = warnings::of_scenario(&motion.warnings);
    let warn = |warning: &String| output::note(format!("warning: {warning}"));
    warnings.iter().for_each(warn);
    let begin = Instant::now();
    let planned = motion.plan(&mut MotionWorkspace::default());
    let time = begin.elapsed();
    // A given end may be the same place a turn away: what plays the numbers would go all the way around.
    let (clip, report) = (&planned.clip.clone().unwrapped(), &planned.report);
    for (label, _) in labels.iter_mut().zip(&motion.objectives).filter(|(_, o)| o.path.is_some()) {
        put_on_clock(&mut label.target, &planned);
    }
    if let Some(invalid) = report.invalid {
        return Err(invalid_input(&motion.name, &motion.rig, &motion.objectives, invalid));
    }
    warnings.extend(report::of_terms(report).inspect(warn));
    let described = described(&motion, &labels, &warnings, clip, report, time);
    if args.json {
        output::print(&format!("{described}\n"))?;
    } else {
        output::print(&text(&motion, &labels, clip, report, time))?;
    }
    let mut written = Vec::new();
    if let Some(out) = &args.out {
        let bytes = match out.format {
            MotionFormat::Body(format) => {
                let written = write_clip(&motion.loaded, clip, format).map_err(Failure::write)?;
                output::warn(&written.warnings);
                written.bytes
            }
            MotionFormat::Csv => motion_csv(clip, &motion.active).map_err(Failure::write)?,
            MotionFormat::Json => format!("{described}\n").into_bytes(),
        };
        output::write(&out.path, &bytes)?;
        written.push(&out.path);
    }
    #[cfg(feature = "plot")]
    if let Some(path) = &args.plot {
        let effector = motion.objectives.iter().find_map(|o| o.joint);
        ikiru_eval::write_motion_figure(clip, &motion.active, effector, path).map_err(Failure::write)?;
        written.push(path);
    }
    for path in written {
        let line = format!("wrote {}", path.display());
        if args.json {
            output::note(line);
        } else {
            output::print(&format!("{}\n", output::printable(&line)))?;
        }
    }
    Ok(if report.success { Outcome::Reached } else { Outcome::BestEffort })
}

/// Gives the points of a path, `[[secs, x, y, z]]`, the times that they have in the clip.
fn put_on_clock(path: &mut Value, planned: &PlannedScenario) {
    for point in path.as_array_mut().into_iter().flatten() {
        if let Some(secs) = point.get_mut(0) {
            *secs = json!(planned.at(secs.as_f64().unwrap_or_default()));
        }
    }
}

/// What `plan --json` prints, and what a motion's `.json` holds.
fn described(
    motion: &MotionScenario,
    labels: &[Label],
    warnings: &[String],
    clip: &Clip,
    report: &Report<'_>,
    time: Duration,
) -> Value {
    let objectives: Vec<Value> = report
        .terms
        .iter()
        .zip(labels)
        .map(|(term, label)| {
            let times = term.times.unwrap_or_default();
            let mut objective = json!({
                "kind": label.kind,
                "joint": label.joint,
                "target": label.target,
                "weight": term.weight,
                "level": label.level,
                "residual": term.residual,
                "unit": term.unit.symbol(),
                "cost": term.cost,
                "satisfied": term.satisfied,
                "at": times.worst_secs,
                "from": times.from_secs,
                "to": times.to_secs,
            });
            json::add_other_parts(&mut objective, &term.others);
            objective
        })
        .collect();
    let mut described = json!({
        "success": report.success,
        "stop": report.stop.name(),
        "cost": report.cost,
        "smoothness": report.smoothness,
        "spacing": report.spacing,
        "iterations": report.iterations,
        "restarts": report.restarts,
        "time_us": time.as_secs_f64() * 1e6,
    });
    let poses = motion_json(clip, &motion.active);
    if let (Some(described), Value::Object(poses)) = (described.as_object_mut(), poses) {
        described.extend(poses);
        described.insert("objectives".to_owned(), Value::Array(objectives));
        let constraints = constraints(motion, report).iter().map(Constraint::json).collect();
        described.insert("constraints".to_owned(), Value::Array(constraints));
        let exceeded: Vec<Value> = report.exceeded.iter().map(|e| exceeded_json(clip.rig(), e)).collect();
        let about = About::motion(motion);
        described.insert("obstacles".to_owned(), about.json(&report.forces));
        described.insert("hint".to_owned(), json!(report.hint.map(|hint| about.hint(hint))));
        described.insert("exceeded".to_owned(), Value::Array(exceeded));
        described.insert("warnings".to_owned(), json!(warnings));
    }
    name_motion_rig(&mut described, &motion.loaded);
    described
}

/// The constraints among a motion's objectives, each where it is missed the most or has the least left.
fn constraints<'a>(motion: &'a MotionScenario, report: &Report) -> Vec<Constraint<'a>> {
    let parts =
        report.terms.iter().map(|term| (term.parts().collect(), term.times.map(|times| times.worst_secs)));
    constraints::constraints(&motion.rig, motion.motion.terms(), &motion.objectives, parts)
}

fn text(
    motion: &MotionScenario,
    labels: &[Label],
    clip: &Clip,
    report: &Report<'_>,
    time: Duration,
) -> String {
    let mut table = report::table(["", "objective", "joint", "when", "weight", "residual", ""]);
    for (idx, (term, label)) in report.terms.iter().zip(labels).enumerate() {
        let times = term.times.unwrap_or_default();
        let span = if times.from_secs == times.to_secs {
            format!("{} s", short(times.from_secs))
        } else {
            format!("{} to {} s", short(times.from_secs), short(times.to_secs))
        };
        let mark = match (term.satisfied, term.mandatory) {
            _ if term.weight == 0.0 && !term.hard => "off".to_owned(),
            (true, _) => "ok".to_owned(),
            (false, true) if motion.solver.options().cost_below.is_some() && report.success => String::new(),
            (false, true) => match motion.out_of_hand(idx) {
                Some(joint) => format!("unmet: {}", nothing_moves(joint)),
                None => format!("unmet, worst at {} s", short(times.worst_secs)),
            },
            (false, false) => "shapes".to_owned(),
        };
        table.add_row([
            (idx + 1).to_string(),
            label.kind.to_owned(),
            label.joint.clone().unwrap_or_else(|| "several".to_owned()),
            span,
            report::weight_text(term.weight, term.hard),
            report::residual_text(term.parts()),
            mark,
        ]);
    }
    let mut text = format!("{table}\n\n");
    let mut line = |key: &str, value: String| text += &format!("{key:<13}{value}\n");
    for excess in report.exceeded.iter() {
        line("exceeded", exceeded_text(clip.rig(), excess));
    }
    let verdict = if report.success { "reached" } else { "not reached" };
    line(verdict, report::stop_text(report.stop, motion.solver.options()));
    if let Some(constraints) = constraints::text(&constraints(motion, report)) {
        line("constraints", constraints);
    }
    let [speed, acceleration, jerk] = report.smoothness.map(numbers::cost);
    let smooth = format!("of which speed {speed}, acceleration {acceleration}, jerk {jerk}");
    line("cost", format!("{}, {smooth}", numbers::cost(report.cost)));
    line("iterations", format!("{} with {} restarts", report.iterations, report.restarts));
    line("time", numbers::time(time));
    // What is exceeded stands above.
    let is_told = report.success || !report.exceeded.is_empty();
    let at = |force: &Force| clip.sample(force.secs.unwrap_or_default());
    for (key, words) in About::motion(motion).lines(&report.forces, report.hint, is_told, at) {
        line(key, words);
    }
    let (n, secs) = (clip.poses().len(), clip.duration_secs());
    let measured = |rate| clip.rates(rate).summary(&motion.active, RatePart::Rotation).unwrap_or_default();
    let peak = |rate| measured(rate).peak.to_degrees();
    let peaks = format!("peak speed {:.0}°/s, peak jerk {:.0}°/s³", peak(Rate::Speed), peak(Rate::Jerk));
    line("motion", format!("{n} frames over {} s, {peaks}", short(secs)));
    output::printable(&text).into_owned()
}

/// A limit on speed or acceleration that does not hold: value, limit and unit.
fn exceeded_numbers(excess: &RateExcess) -> (f64, f64, String) {
    let RateLimit { part, rate, most, .. } = excess.limit;
    let per = if rate == Rate::Speed { "/s" } else { "/s²" };
    let value = excess.peak.value;
    match part {
        RatePart::Rotation => (value.to_degrees(), most.to_degrees(), format!("°{per}")),
        RatePart::Translation => (value, most, format!(" m{per}")),
    }
}

fn exceeded_text(rig: &Rig, excess: &RateExcess) -> String {
    let (value, most, unit) = exceeded_numbers(excess);
    let joint = rig.get(excess.limit.joint).map_or("", |j| &j.name);
    let secs = short(excess.peak.secs);
    format!("{joint} reaches {value:.4}{unit} at {secs} s, where at most {most:.4}{unit} are allowed")
}

fn exceeded_json(rig: &Rig, excess: &RateExcess) -> Value {
    let (value, most, unit) = exceeded_numbers(excess);
    let kind = if excess.limit.rate == Rate::Speed { "speed" } else { "acceleration" };
    let unit = unit.trim().replace('°', "deg").replace('²', "2");
    json!({
        "joint": rig.get(excess.limit.joint).map(|j| &j.name),
        "kind": kind,
        "at": excess.peak.secs,
        "value": value,
        "most": most,
        "unit": unit,
    })
}
