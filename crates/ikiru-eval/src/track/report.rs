//! The rows of all courses as a table.

use crate::statistics::{Summary, quantile};
use crate::table::{Texts, percent, short};
use crate::track::run::Row;

/// One line a course and rate.
#[derive(Clone, Debug)]
pub struct Report {
    texts: Texts,
}

impl Report {
    /// Sums up rows, in the order in which courses come.
    #[must_use]
    pub fn new(rows: &[Row]) -> Self {
        let header = [
            "course",
            "Hz",
            "frames",
            "met %",
            "iterations",
            "most",
            "mean µs",
            "median µs",
            "p99 µs",
            "p99.9 µs",
            "worst µs",
            "median mm",
            "turn °",
            "own °",
        ];
        let courses = rows.chunk_by(|a, b| a.course == b.course && a.rate_hz == b.rate_hz);
        let rows = courses.map(line).collect();
        Self { texts: Texts { header: header.map(str::to_owned).to_vec(), rows, n_words: 1 } }
    }

    /// For a terminal.
    #[must_use]
    pub fn for_terminal(&self) -> String {
        self.texts.for_terminal()
    }

    /// As Markdown.
    #[must_use]
    pub fn markdown(&self) -> String {
        self.texts.markdown()
    }
}

fn line(rows: &[Row]) -> Vec<String> {
    let can_be_met: Vec<&Row> = rows.iter().filter(|row| row.can_be_met).collect();
    let iterations = Summary::of(rows.iter().map(|row| row.iterations as f64));
    let time = Summary::of(rows.iter().map(|row| row.time_us));
    let mut times: Vec<f64> = rows.iter().map(|row| row.time_us).collect();
    times.sort_unstable_by(f64::total_cmp);
    let largest = |of: fn(&Row) -> f64| rows.iter().map(of).fold(0.0, f64::max);
    let error = Summary::of(can_be_met.iter().map(|row| row.position_error));
    vec![
        rows.first().map_or_else(String::new, |row| row.course.clone()),
        rows.first().map_or_else(String::new, |row| row.rate_hz.to_string()),
        rows.len().to_string(),
        percent(can_be_met.iter().filter(|row| row.success).count(), can_be_met.len()),
        short(iterations.mean),
        rows.iter().map(|row| row.iterations).max().unwrap_or(0).to_string(),
        short(time.mean),
        short(time.median),
        short(time.p99),
        short(quantile(&times, 0.999)),
        short(largest(|row| row.time_us)),
        format!("{:.3}", 1e3 * error.median),
        short(largest(|row| row.turn).to_degrees()),
        short(rows.first().map_or(0.0, |row| row.own_turn).to_degrees()),
    ]
}
