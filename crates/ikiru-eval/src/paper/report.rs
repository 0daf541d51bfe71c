//! The tables: one for each set, ours and the paper's figures side by side.

use crate::error::Error;
use crate::paper::published::{Published, Spread, published};
use crate::paper::run::Row;
use crate::paper::task::Task;
use crate::statistics::Summary;
use crate::table::{Texts, percent, short, spread};

/// The measured rows of one task on one set, as a table.
#[derive(Clone, Debug)]
pub struct Report {
    title: String,
    texts: Texts,
}

impl Report {
    /// Sums up rows of one task and set, one line a method, in the order in which they come.
    #[must_use]
    pub fn new(task: Task, rows: &[Row]) -> Self {
        let mut methods: Vec<&'static str> = Vec::new();
        for row in rows {
            if !methods.contains(&row.method) {
                methods.push(row.method);
            }
        }
        let set = rows.first().map_or("", |r| &r.set);
        let points = rows.first().map_or(0, |r| r.points);
        let runs = rows.iter().map(|r| r.run + 1).max().unwrap_or(0);
        let targets = rows.len() / (methods.len() * runs).max(1);
        let along = if points > 0 { format!(", trajectories of {points} points") } else { String::new() };
        let is_filtered = set != "reachable";
        let header = [
            "method",
            "time µs",
            "median µs",
            "iterations",
            "µs/iteration",
            "success %",
            "the paper's",
            "time ms",
            "iterations",
            "ms/iteration",
            "success %",
        ];
        let lines = methods.iter().map(|method| {
            let rows: Vec<&Row> = rows.iter().filter(|r| r.method == *method).collect();
            line(method, &rows, published(task, points, method).filter(|_| is_filtered))
        });
        let n_shown = if is_filtered { header.len() } else { 6 };
        Self {
            title: format!("{} objective{along}, {set}: {targets} targets, {runs} runs", task.name()),
            texts: Texts {
                header: header[..n_shown].iter().map(ToString::to_string).collect(),
                rows: lines.map(|mut line| line.drain(..n_shown).collect()).collect(),
                n_words: 1,
            },
        }
    }

    /// For a terminal.
    #[must_use]
    pub fn for_terminal(&self) -> String {
        format!("{}\n{}", self.title, self.texts.for_terminal())
    }

    /// As Markdown.
    #[must_use]
    pub fn markdown(&self) -> String {
        format!("### {}\n\n{}", self.title, self.texts.markdown())
    }
}

fn line(method: &str, rows: &[&Row], paper: Option<&Published>) -> Vec<String> {
    let time = Summary::of(rows.iter().map(|r| r.time_us));
    let iterations = Summary::of(rows.iter().map(|r| r.iterations as f64));
    // A start that meets the bar takes no iteration, and has no time for one.
    let each = rows.iter().filter(|r| r.iterations > 0).map(|r| r.time_us / r.iterations as f64);
    let each = Summary::of(each);
    let successes = rows.iter().filter(|r| r.success).count();
    let mut cells = vec![
        method.to_owned(),
        spread(time.mean, time.deviation),
        short(time.median),
        spread(iterations.mean, iterations.deviation),
        spread(each.mean, each.deviation),
        percent(successes, rows.len()),
    ];
    let of = |value: Spread| if value.0.is_nan() { String::new() } else { spread(value.0, value.1) };
    cells.extend(paper.map_or_else(
        || vec![String::new(); 5],
        |p| {
            vec![
                p.name.to_owned(),
                of(p.time_ms),
                of(p.iterations),
                of(p.time_per_iteration_ms),
                short(p.success_percent.0),
            ]
        },
    ));
    cells
}

/// Rows as CSV, with the set of each; the angles (of a trajectory's last frame) in columns of their own.
///
/// # Errors
/// None for rows that [`run`](crate::paper::run) made.
pub fn csv(rows: &[Row]) -> Result<Vec<u8>, Error> {
    let write = || -> Result<Vec<u8>, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let n_angles = rows.first().map_or(0, |r| r.angles.last().len());
        let mut header: Vec<String> = [
            "set",
            "method",
            "objective",
            "points",
            "run",
            "x",
            "y",
            "z",
            "success",
            "cost",
            "iterations",
            "time_us",
        ]
        .map(str::to_owned)
        .to_vec();
        header.extend((0..n_angles).map(|i| format!("angle{i}")));
        writer.write_record(&header)?;
        for r in rows {
            let mut record: Vec<String> = vec![
                r.set.clone(),
                r.method.to_owned(),
                r.objective.to_owned(),
                r.points.to_string(),
                r.run.to_string(),
            ];
            record.extend(r.target.map(|t| t.to_string()));
            record.extend([
                r.success.to_string(),
                r.cost.to_string(),
                r.iterations.to_string(),
                r.time_us.to_string(),
            ]);
            record.extend(r.angles.last().iter().map(ToString::to_string));
            writer.write_record(&record)?;
        }
        writer.into_inner().map_err(|e| csv::Error::from(e.into_error()))
    };
    write().map_err(|e| Error::Write { path: "results.csv".into(), reason: e.to_string() })
}
