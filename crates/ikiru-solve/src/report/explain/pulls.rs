//! What each term pulls at: gradients of wishes, and the forces of constraints that balance them.

use ikiru_rig::maths;

use crate::layout::{Layout, Place, TermLayout};
use crate::problem::Terms;
use crate::report::explain::balance::dot;
use crate::report::explain::{Explainer, Pull};
use crate::report::here::{Here, Of};
use crate::state::State;
use crate::words::{Sense, Unit};

impl Explainer {
    /// Takes over a sample that was linearized, and finds the forces there.
    pub(super) fn read(&mut self, here: &Here<'_, impl Terms>, of: Of) {
        self.balance.begin(here.layout, here.state);
        self.read_begun(here, of);
    }

    /// The same where a limit is touched or rows may have a force; false elsewhere.
    pub(super) fn read_where_pushed(&mut self, here: &Here<'_, impl Terms>) -> bool {
        let is_pushed = !self.is_free(here);
        if is_pushed {
            self.read_begun(here, Of::Wishes);
        }
        is_pushed
    }

    fn read_begun(&mut self, here: &Here<'_, impl Terms>, of: Of) {
        let Here { layout, state, ref terms, .. } = *here;
        self.gradients.fill(0.0);
        self.pulls.iter_mut().for_each(|pull| *pull = Pull::NONE);
        self.squares.fill(0.0);
        for span in &layout.spans {
            let column = &state.jacobian[span.start..span.start + span.len];
            for (square, entry) in self.squares[span.first..].iter_mut().zip(column) {
                *square += entry * entry;
            }
        }
        for t in layout.terms.iter().filter(|t| terms.is_on(t.term)) {
            if t.is_hard {
                self.read_constraint(layout, state, terms, t, of);
            } else if of == Of::Wishes {
                self.read_wish(layout, state, terms, t);
            }
        }
        self.whole.fill(0.0);
        for gradient in self.gradients.chunks_exact(layout.n_dofs.max(1)) {
            self.whole.iter_mut().zip(gradient).for_each(|(w, g)| *w += g);
        }
        if let Some(beside) = here.beside {
            self.whole.iter_mut().zip(beside.smoothness).for_each(|(w, g)| *w += g);
        }
        self.balance.solve(&state.guard_jacobian, &self.whole);
        // The forces of constraints are pulls like those of wishes from here on.
        let n = layout.n_dofs;
        for row in &self.balance.rows {
            let entries = &state.guard_jacobian[row.row * n..][..n];
            let gradient = &mut self.gradients[row.part * n..][..n];
            gradient.iter_mut().zip(entries).for_each(|(g, a)| *g -= row.force * a);
            let pull = &mut self.pulls[row.part];
            (pull.amount, pull.unit) = (maths::hypot(pull.amount, row.force), layout.parts[row.part].unit);
        }
    }

    fn read_wish(&mut self, layout: &Layout, state: &State, terms: &impl Terms, t: &TermLayout) {
        let n = layout.n_dofs;
        for idx in t.parts.clone() {
            let part = &layout.parts[idx];
            let weight = state.weights[idx];
            let gradient = &mut self.gradients[idx * n..(idx + 1) * n];
            let rows = part.row..part.row + part.n_rows;
            let mut pull = Pull { unit: part.unit, ..Pull::NONE };
            match part.place {
                Place::Step => {
                    for (g, span) in gradient.iter_mut().zip(&layout.spans) {
                        let both = rows.start.max(span.first)..rows.end.min(span.first + span.len);
                        for row in both {
                            *g += 2.0 * state.jacobian[span.start + row - span.first] * state.scaled[row];
                        }
                    }
                    for row in rows {
                        pull.add(2.0 * state.scaled[row], self.squares[row]);
                    }
                }
                Place::Guard { first } => {
                    for (row, residual) in state.residual[rows].iter().enumerate() {
                        let factor = 2.0 * weight * part.sense.missing(*residual);
                        let entries = &state.guard_jacobian[(first + row) * n..][..n];
                        gradient.iter_mut().zip(entries).for_each(|(g, a)| *g += factor * a);
                        pull.add(factor, dot(entries, entries));
                    }
                }
                Place::Own { .. } => {
                    for row in 0..state.n_open[idx] {
                        let factor = 2.0 * weight * state.residual[part.row + row];
                        let mut square = 0.0;
                        for (k, g) in gradient.iter_mut().enumerate() {
                            let entry = state.entry(layout, t, part, row, k);
                            *g += factor * entry;
                            square += entry * entry;
                        }
                        pull.add(factor, square);
                    }
                }
            }
            pull.amount = 2.0 * weight * state.squares[idx].sqrt();
            self.pulls[idx] = pull;
        }
        if t.has_potential {
            let idx = layout.parts.len() + t.term;
            let gradient = &mut self.gradients[idx * n..(idx + 1) * n];
            for read in &t.joint_reads {
                let Some(dof) = read.dof else { continue };
                let slope = &state.memory.slope[t.slope.start + read.at..][..read.n_dofs];
                let own = gradient[dof..].iter_mut().zip(slope);
                own.for_each(|(g, slope)| *g += terms.term(t.term).weight * slope);
            }
            let square = dot(gradient, gradient);
            self.pulls[idx] =
                Pull { amount: square.sqrt(), unit: Unit::Radians, pushes: square, longest: 1.0 };
        }
    }

    /// The rows of a constraint take part in the balance, but for those whose forces are to be balanced: their cost is the
    /// square of the way to where they hold, `(c / ‖a‖)²`.
    fn read_constraint(
        &mut self,
        layout: &Layout,
        state: &State,
        terms: &impl Terms,
        t: &TermLayout,
        of: Of,
    ) {
        let n = layout.n_dofs;
        let tolerance = terms.term(t.term).tolerance;
        let is_balanced = of == Of::UnmetConstraints && !state.is_within(layout, t, &tolerance);
        for idx in t.parts.clone() {
            let part = &layout.parts[idx];
            let Place::Guard { first } = part.place else { continue };
            for row in 0..state.n_open[idx] {
                let residual = state.residual[part.row + row];
                if !is_balanced {
                    let both_ways = part.sense == Sense::Equal;
                    if both_ways || residual <= tolerance.of(part.unit) {
                        self.balance.push_row(idx, first + row, both_ways);
                    }
                    continue;
                }
                let entries = &state.guard_jacobian[(first + row) * n..][..n];
                let square = dot(entries, entries);
                let missing = part.sense.missing(residual);
                // Of unit length, but for a row that nothing moves.
                let unit_push = if square > 0.0 { 2.0 * missing / square.sqrt() } else { 2.0 * missing };
                let factor = if square > 0.0 { 2.0 * missing / square } else { 0.0 };
                let gradient = &mut self.gradients[idx * n..(idx + 1) * n];
                gradient.iter_mut().zip(entries).for_each(|(g, a)| *g += factor * a);
                let pull = &mut self.pulls[idx];
                (pull.amount, pull.unit) = (maths::hypot(pull.amount, factor), part.unit);
                pull.add(unit_push, if square > 0.0 { 1.0 } else { 0.0 });
            }
        }
    }
}
