//! Tables: one for the terminal and the same in Markdown.

use comfy_table::{CellAlignment, LineStyle, Table, presets};

/// A table of texts; every column but the first ones is set to the right.
#[derive(Clone, Debug)]
pub(crate) struct Texts {
    pub(crate) header: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
    /// How many columns hold words.
    pub(crate) n_words: usize,
}

impl Texts {
    pub(crate) fn for_terminal(&self) -> String {
        let mut table = self.table();
        table.load_style(presets::UTF8_HORIZONTAL_ONLY);
        table.style_mut().row_separator = LineStyle::none();
        self.align(&mut table);
        format!("{table}\n")
    }

    pub(crate) fn markdown(&self) -> String {
        // A cell of several lines becomes one; a word divided between them is whole again.
        let line =
            |cells: &[String]| format!("| {} |\n", cells.join(" | ").replace("-\n", "").replace('\n', " "));
        let rule = |idx: usize| if idx < self.n_words { "---" } else { "---:" };
        let rules: Vec<String> = (0..self.header.len()).map(|idx| rule(idx).to_owned()).collect();
        let mut text = line(&self.header) + &line(&rules).replace("| ", "|").replace(" |", "|");
        for row in &self.rows {
            text += &line(row);
        }
        text
    }

    fn table(&self) -> Table {
        let mut table = Table::new();
        table.set_header(&self.header);
        for row in &self.rows {
            table.add_row(row);
        }
        table
    }

    fn align(&self, table: &mut Table) {
        for idx in self.n_words..self.header.len() {
            if let Some(column) = table.column_mut(idx) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
    }
}

/// Three figures that count, without an exponent.
pub(crate) fn short(value: f64) -> String {
    let digits = match value.abs() {
        v if v >= 99.95 => 0,
        v if v >= 9.995 => 1,
        _ => 2,
    };
    format!("{value:.digits$}")
}

/// `mean ± deviation`
pub(crate) fn spread(mean: f64, deviation: f64) -> String {
    format!("{} ± {}", short(mean), short(deviation))
}

/// A part of a whole in percent, never rounded up to all of it.
pub(crate) fn percent(part: usize, whole: usize) -> String {
    if part == whole {
        return "100".to_owned();
    }
    let percent = 100.0 * part as f64 / whole.max(1) as f64;
    if percent > 99.99 { ">99.99".to_owned() } else { format!("{percent:.2}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_people_read_them() {
        assert_eq!([0.004_9, 7.456, 43.21, 123.4].map(short), ["0.00", "7.46", "43.2", "123"]);
        assert_eq!(spread(25.44, 62.61), "25.4 ± 62.6");
        assert_eq!(percent(1000, 1000), "100");
        assert_eq!(percent(99_999, 100_000), ">99.99");
        assert_eq!(percent(999, 1000), "99.90");
    }

    #[test]
    fn markdown_has_a_rule_below_its_header() {
        let texts = Texts {
            header: vec!["method".into(), "du-\nration\ns".into()],
            rows: vec![vec!["lm".into(), "7".into()]],
            n_words: 1,
        };
        assert_eq!(texts.markdown(), "| method | duration s |\n|---|---:|\n| lm | 7 |\n");
        assert!(texts.for_terminal().contains("method"));
    }
}
