//! The gradient of the cost and its largest curvature, as of a linearization.

use crate::layout::{Layout, Place};
use crate::state::State;

/// The gradient of the cost by every degree of freedom, with `hard` times the squares of what hard rows miss.
pub(crate) fn whole_gradient(layout: &Layout, state: &State, hard: f64, gradient: &mut [f64]) {
    for (k, span) in layout.spans.iter().enumerate() {
        let column = &state.jacobian[span.start..span.start + span.len];
        let rows = &state.scaled[span.first..span.first + span.len];
        let sum = column.iter().zip(rows).map(|(a, b)| a * b).sum::<f64>();
        gradient[k] = 2.0 * (state.own_gradient[k] + sum);
    }
    if layout.n_guards == 0 {
        return;
    }
    for t in &layout.terms {
        for idx in t.parts.clone() {
            let part = &layout.parts[idx];
            let Place::Guard { first } = part.place else { continue };
            let weight = if t.is_hard { hard } else { state.weights[idx] };
            for row in 0..part.n_rows {
                let pull = 2.0 * weight * part.sense.missing(state.residual[part.row + row]);
                if pull != 0.0 {
                    let entries = &state.guard_jacobian[(first + row) * layout.n_dofs..][..layout.n_dofs];
                    gradient.iter_mut().zip(entries).for_each(|(g, a)| *g += pull * a);
                }
            }
        }
    }
}

impl State {
    /// The largest curvature of the cost along one degree of freedom, guards aside, as of a linearization.
    #[inline(always)]
    pub(crate) fn largest_curvature(&self, layout: &Layout) -> f64 {
        let mut largest = 0.0_f64;
        for (k, span) in layout.spans.iter().enumerate() {
            let column = &self.jacobian[span.start..span.start + span.len];
            largest = largest.max(self.own_curvature[k] + column.iter().map(|a| a * a).sum::<f64>());
        }
        largest
    }
}
