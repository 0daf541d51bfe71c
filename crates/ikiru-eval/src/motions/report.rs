//! The table: one for each scenario, a line for each way.

use super::row::Row;
use super::way::Way;
use crate::table::{Texts, short};

/// What the tables show, said once above them.
const EXPLANATION: &str = "\
Six ways to get one motion. straight: each key solved as a pose of its own, the straight way between them. paper: the
whole motion by the paper's method and smoothness. plan: the scenario as it is; within 0.7 of its own peak speed in the
same time; within that and with as much time as it takes. Terms met: all mandatory ones, at every frame. Speed, path and
distance to joint limits are of the curve through the frames; acceleration and jerk are finite differences, and do not
count how abruptly a motion begins and ends: the speed at its ends does.
";

/// The rows of some scenarios as tables.
#[derive(Clone, Debug)]
pub struct Report {
    /// Title and table of each scenario.
    tables: Vec<(String, Texts)>,
}

impl Report {
    /// One table a scenario, in the order in which they come.
    #[must_use]
    pub fn new<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Self {
        let mut tables: Vec<(String, Texts)> = Vec::new();
        for row in rows {
            if tables.last().is_none_or(|(last, _)| *last != title(row)) {
                let header = HEADER.map(str::to_owned).to_vec();
                tables.push((title(row), Texts { header, rows: Vec::new(), n_words: 2 }));
            }
            if let Some((_, texts)) = tables.last_mut() {
                texts.rows.push(line(row));
            }
        }
        Self { tables }
    }

    /// For a terminal.
    #[must_use]
    pub fn for_terminal(&self) -> String {
        let tables = self.tables.iter().map(|(name, texts)| format!("\n{name}\n{}", texts.for_terminal()));
        format!("{EXPLANATION}{}", tables.collect::<String>())
    }

    /// As Markdown.
    #[must_use]
    pub fn markdown(&self) -> String {
        let tables = self.tables.iter().map(|(name, texts)| format!("\n### {name}\n\n{}", texts.markdown()));
        format!("{EXPLANATION}{}", tables.collect::<String>())
    }
}

const HEADER: [&str; 12] = [
    "way",
    "terms met",
    "duration\ns",
    "peak\nspeed\n°/s",
    "of\nlimit\n%",
    "speed\nat ends\n°/s",
    "peak accel-\neration\n°/s²",
    "peak\njerk\n°/s³",
    "total\njerk\nrad²/s⁵",
    "path\nm",
    "to joint\nlimits\n°",
    "time\nms",
];

fn title(row: &Row) -> String {
    let path = row.path_joint.as_ref().map_or(String::new(), |joint| format!(", path of {joint}"));
    format!("{}{path}", row.scenario)
}

fn line(row: &Row) -> Vec<String> {
    let way = Way::ALL.iter().find(|way| way.name() == row.way).map_or(row.way, |way| way.title());
    let or_none = |value: Option<String>| value.unwrap_or_else(|| "–".to_owned());
    vec![
        way.to_owned(),
        row.unmet.as_ref().map_or("yes".to_owned(), |unmet| format!("no: {}", unmet.text())),
        short(row.duration_secs),
        format!("{:.1}", row.peak_speed_deg),
        or_none(row.part_of_limit.map(of_limit)),
        format!("{:.1}", row.end_speed_deg),
        format!("{:.0}", row.peak_acceleration_deg),
        format!("{:.0}", row.peak_jerk_deg),
        short(row.total_jerk),
        or_none(row.path_length.map(|metres| format!("{metres:.3}"))),
        or_none(row.limit_margin_deg.map(margin)),
        short(row.time_ms),
    ]
}

/// Degrees; rounding error below 0 is 0.
fn margin(degrees: f64) -> String {
    format!("{:.1}", (10.0 * degrees).round() / 10.0 + 0.0)
}

/// In percent; what is above a limit is never rounded down to it.
fn of_limit(part: f64) -> String {
    let percent = format!("{:.1}", 100.0 * part);
    if part > 1.0 + 1e-9 && percent == "100.0" { ">100".to_owned() } else { percent }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_above_a_limit_is_seen() {
        assert_eq!([-1e-12, -0.2, 4.16].map(margin), ["0.0", "-0.2", "4.2"]);
        assert_eq!(
            [0.7, 0.999_4, 1.0, 1.000_1, 1.2].map(of_limit),
            ["70.0", "99.9", "100.0", ">100", "120.0"]
        );
    }
}
