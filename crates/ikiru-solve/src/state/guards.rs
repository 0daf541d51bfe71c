//! Guards: rows with a sense and a force, which stand beside what a step is solved over. What is hard is a guard, and what wants to
//! be at least something.
//!
//! Here is what they are as of a linearization, for a pose and for all samples of a motion alike; what they do in a step is
//! `step/acting.rs`.

use crate::algebra::full_rows::{Derivatives, FullRows};
use crate::algebra::room::{MostRows, make_room};
use crate::algebra::sample_rows::SampleRows;
use crate::layout::{Layout, PartLayout, Place, TermLayout};
use crate::problem::Terms;
use crate::problem::term::Term;
use crate::state::State;
use crate::words::{Loss, Sense};

/// One row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guard {
    pub(crate) sense: Sense,
    /// The weight of a wish; `None` for a hard row.
    pub(crate) weight: Option<f64>,
    pub(crate) is_open: bool,
}

/// Guards of one part (of a motion: at one sample), of a term that is on.
#[derive(Clone, Copy, Debug)]
struct GuardPart {
    first: usize,
    n_rows: usize,
    /// λ and the loss of a wish; `None` for what is hard.
    wish: Option<(f64, Loss)>,
    /// Whether nothing moves it.
    is_constant: bool,
}

/// All guards of a pose or of a motion, as of the last linearization: as many, in the same order, at each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Guards<D> {
    /// Residuals and derivatives as they are, not scaled.
    pub(crate) rows: D,
    parts: Vec<GuardPart>,
    pub(crate) guards: Vec<Guard>,
}

impl<D: Derivatives> Guards<D> {
    pub(crate) fn is_empty(&self) -> bool {
        self.guards.is_empty()
    }

    /// Adds the guards of one part of a term as a state has them, without what they derive.
    fn push_part(&mut self, state: &State, part: &PartLayout, idx: usize, t: &TermLayout, term: &Term) {
        let weight = if t.is_hard { None } else { Some(state.weights[idx]) };
        let counts = term.is_on && weight != Some(0.0);
        if term.is_on {
            let wish = if t.is_hard { None } else { Some((term.weight, term.loss)) };
            let (first, n_rows) = (self.guards.len(), part.n_rows);
            self.parts.push(GuardPart { first, n_rows, wish, is_constant: t.is_constant });
        }
        let n_open = if counts { state.n_open[idx] } else { 0 };
        let guard = |i| Guard { sense: part.sense, weight, is_open: i < n_open };
        self.guards.extend((0..part.n_rows).map(guard));
    }

    /// What the linear model promises for a step: the cost of wishes, and by how much hard rows are missed. `along` is memory
    /// over rows.
    pub(crate) fn predicted(&self, delta: &[f64], along: &mut Vec<f64>) -> (f64, f64) {
        along.clear();
        along.extend_from_slice(self.rows.residual());
        self.rows.add_product(delta, along);
        let (mut cost, mut violation) = (0.0, 0.0);
        for part in &self.parts {
            let open = (part.first..part.first + part.n_rows).filter(|row| self.guards[*row].is_open);
            let missing = open.map(|row| self.guards[row].sense.missing(along[row]));
            match part.wish {
                Some((weight, loss)) => cost += weight * loss.cost(missing.map(|r| r * r).sum()),
                // As in a state, what nothing moves does not count.
                None if part.is_constant => {}
                None => violation += missing.map(f64::abs).sum::<f64>(),
            }
        }
        (cost, violation)
    }

    /// Adds half the gradient of the wishes among the guards, and of `hard` times the squares of what hard rows miss.
    pub(crate) fn add_half_gradient(&self, hard: f64, gradient: &mut [f64]) {
        let pull = |row: usize| {
            let Guard { sense, weight, .. } = self.guards[row];
            weight.unwrap_or(hard) * sense.missing(self.rows.residual()[row])
        };
        self.rows.add_transposed_of(pull, gradient);
    }
}

impl Guards<FullRows> {
    /// Those of a pose, in the order of the layout, also of terms that are off.
    pub(crate) fn of_pose(layout: &Layout) -> Self {
        let n_guards = layout.n_guards;
        let has_guards = |part: &&PartLayout| matches!(part.place, Place::Guard { .. });
        Self {
            rows: FullRows::new(n_guards, layout.n_dofs),
            parts: Vec::with_capacity(layout.parts.iter().filter(has_guards).count()),
            guards: Vec::with_capacity(n_guards),
        }
    }

    /// Takes over a linearization.
    pub(crate) fn take(&mut self, layout: &Layout, state: &State, terms: &impl Terms) {
        self.parts.clear();
        self.guards.clear();
        for t in &layout.terms {
            for idx in t.parts.clone() {
                let part = &layout.parts[idx];
                if let Place::Guard { first } = part.place {
                    debug_assert_eq!(first, self.guards.len(), "parts come in the order of their guards");
                    self.push_part(state, part, idx, t, terms.term(t.term));
                }
            }
        }
        self.rows.residual.copy_from_slice(state.guard_residual(layout));
        self.rows.jacobian.copy_from_slice(&state.guard_jacobian);
    }
}

impl Guards<SampleRows> {
    /// Those of a motion, none yet.
    pub(crate) fn of_motion(layout: &Layout) -> Self {
        Self { rows: SampleRows::new(layout), ..Self::default() }
    }

    /// Makes room for the most guards that there may be.
    pub(crate) fn make_room(&mut self, most: MostRows) {
        self.rows.make_room(most);
        make_room(&mut self.parts, most.parts);
        make_room(&mut self.guards, most.rows);
    }

    pub(crate) fn clear(&mut self) {
        self.rows.clear();
        self.parts.clear();
        self.guards.clear();
    }

    /// Copies the guards of one part of a term from the sample that was linearized, and from those before it.
    pub(crate) fn push(
        &mut self,
        layout: &Layout,
        sample: &State,
        earlier: &[State],
        t: &TermLayout,
        term: &Term,
        idx: usize,
    ) {
        let part = &layout.parts[idx];
        let PartLayout { n_rows, row, place: Place::Guard { first }, .. } = *part else { return };
        self.push_part(sample, part, idx, t, term);
        for i in 0..n_rows {
            let entry = |back: usize, k: usize| {
                let state = if back == 0 { sample } else { &earlier[back - 1] };
                state.guard_jacobian[(first + i) * layout.n_dofs + k]
            };
            self.rows.push(row + i, sample.residual[row + i], entry);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::problem::Terms;
    use crate::state::cases::case_with_guards;
    use crate::words::Sense;

    #[test]
    fn guards_are_what_terms_miss_and_closed_ones_want_nothing() {
        let (mut n_hard, mut n_wished, mut n_closed, mut n_missed) = (0, 0, 0, 0);
        for number in 0..30 {
            let mut case = case_with_guards(number);
            let (layout, motion) = (&case.layout, &case.motion);
            case.state.evaluate(layout, motion);
            case.state.linearize(layout, motion);
            let guards = &case.state.guards;
            // Those of samples one after the other, in the order of their parts.
            let (mut row, mut wishes) = (0, 0.0);
            case.state.visit_wanted(motion, |sample, terms, _| {
                for t in layout.terms.iter().filter(|t| terms.is_on(t.term)) {
                    for idx in t.parts.clone() {
                        let part = &layout.parts[idx];
                        if !matches!(part.place, crate::layout::Place::Guard { .. }) {
                            continue;
                        }
                        let mut square = 0.0;
                        for i in 0..part.n_rows {
                            let guard = guards.guards[row];
                            let residual = sample.residual[part.row + i];
                            assert_eq!(guards.rows.residual[row], residual);
                            assert_eq!((guard.sense, guard.weight.is_none()), (part.sense, t.is_hard));
                            // Of the bounds, those of the last axis are closed.
                            assert_eq!(guard.is_open, part.sense == Sense::Equal || i < 2, "case {number}");
                            square += part.sense.missing(residual).powi(2);
                            n_hard += usize::from(t.is_hard);
                            n_wished += usize::from(!t.is_hard);
                            n_closed += usize::from(!guard.is_open);
                            row += 1;
                        }
                        n_missed += usize::from(square > 0.0);
                        if !t.is_hard {
                            let term = terms.term(t.term);
                            wishes += term.weight * term.loss.cost(square);
                        }
                    }
                }
                true
            });
            assert_eq!(row, guards.guards.len());
            // A step of nothing promises what there is.
            let still = vec![0.0; layout.n_dofs * case.state.n_samples];
            let (cost, violation) = guards.predicted(&still, &mut Vec::new());
            assert!((cost - wishes).abs() < 1e-12 * (1.0 + wishes), "case {number}: {cost} {wishes}");
            assert!((violation - case.state.violation).abs() < 1e-12, "case {number}: {violation}");
        }
        assert!([n_hard, n_wished, n_closed, n_missed].iter().all(|n| *n > 50));
    }
}
