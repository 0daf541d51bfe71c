//! The most rows that linearizations of a motion may have, counted once, so that memory for them is found at once.

use crate::algebra::room::MostRows;
use crate::algebra::sample_rows::SampleRows;
use crate::layout::{Layout, Place};
use crate::problem::Terms;
use crate::problem::motion::MotionProblem;

/// The most rows that a step is solved over, and the most guards.
#[derive(Clone, Debug, Default)]
pub(crate) struct Most {
    pub(crate) rows: MostRows,
    pub(crate) guards: MostRows,
    /// Both together, of each sample of which a term wants something.
    pub(crate) at: Vec<usize>,
}

impl Most {
    /// Takes over the terms of a motion, which want something of the samples `keyed`; `rows` know their entries.
    pub(crate) fn fit(
        &mut self,
        layout: &Layout,
        motion: &MotionProblem,
        keyed: &[usize],
        rows: &SampleRows,
    ) {
        let none = MostRows { blocks: keyed.len(), ..MostRows::default() };
        (self.rows, self.guards) = (none, none);
        self.at.clear();
        for &t in keyed {
            let terms = motion.wanted_at(t);
            let n_before = self.rows.rows + self.guards.rows;
            for term in layout.terms.iter().filter(|term| terms.is_on(term.term)) {
                for part in &layout.parts[term.parts.clone()] {
                    let most = match part.place {
                        Place::Step => &mut self.rows,
                        Place::Guard { .. } => &mut self.guards,
                        Place::Own { .. } => continue,
                    };
                    most.parts += 1;
                    most.rows += part.n_rows;
                    let own = part.row..part.row + part.n_rows;
                    most.entries += own.map(|row| rows.n_entries(row)).sum::<usize>();
                }
            }
            self.at.push(self.rows.rows + self.guards.rows - n_before);
        }
    }
}
