//! What came of the terms of a pose, and what is in their way.

use crate::layout::Layout;
use crate::problem::Problem;
use crate::report::explain::{Explainer, Of, Standing, Unmet, hint};
use crate::report::force::{Force, Hint};
use crate::report::{PartReport, PartReports, TermReport};
use crate::state::State;

/// Adds what came of each term, as the state holds it: evaluated last.
pub(crate) fn report_terms(
    layout: &Layout,
    problem: &Problem,
    state: &mut State,
    terms: &mut Vec<TermReport>,
) {
    // Whether something is odd now is asked only where something was.
    let has_warned = state.memory.warning.take().is_some();
    for t in &layout.terms {
        let term = &problem.terms()[t.term];
        let objective = &term.objective;
        let loss = term.loss;
        let mut warning = None;
        if !term.is_on || has_warned {
            state.memory.warning = None;
            state.measure::<false>(layout, &**objective, t);
            warning = state.memory.warning;
        }
        let (mut first, mut others) = (None, PartReports::NONE);
        let mut cost = 0.0;
        let mut satisfied = true;
        let costs = term.is_on && !term.hard;
        for part in layout.reported_parts(t) {
            let (square, unit) = (state.squares[part], layout.parts[part].unit);
            let least = state.least(layout, part);
            let length = PartReport { residual: square.sqrt(), unit, least };
            if costs {
                cost += term.weight * loss.cost(square);
            }
            satisfied &= length.residual <= term.tolerance.of(unit);
            if first.is_none() {
                first = Some(length);
            } else {
                others.push(length);
            }
        }
        if costs && t.has_potential {
            cost += term.weight * state.values[t.term];
        }
        let first = first.unwrap_or(PartReport::ZERO);
        terms.push(TermReport {
            key: term.key,
            times: None,
            kind: objective.kind(),
            joint: t.joint,
            weight: term.weight,
            residual: first.residual,
            unit: first.unit,
            least: first.least,
            others,
            cost,
            satisfied,
            mandatory: term.counts(),
            hard: term.hard,
            warning,
        });
    }
}

/// Tells what is in the way of each term that is not met, and what else acts.
pub(crate) fn explain(
    layout: &Layout,
    problem: &Problem,
    state: &mut State,
    terms: &[TermReport],
    (explainer, unmet): (&mut Explainer, &mut Unmet),
    success: bool,
) -> Option<Hint> {
    state.linearize(layout, problem, false);
    let mut found = None;
    if !success {
        unmet.find(terms.len(), |term| Standing::of(&terms[term]));
        // Constraints stand before wishes.
        let n_constraints = unmet.terms.iter().take_while(|term| terms[**term].hard).count();
        for (of, range) in
            [(Of::UnmetConstraints, 0..n_constraints), (Of::Wishes, n_constraints..unmet.terms.len())]
        {
            if of == Of::Wishes || !range.is_empty() {
                explainer.read(layout, state, problem, of, None);
            }
            for idx in range {
                let term = unmet.terms[idx];
                let leader = explainer.explain(layout, state, problem, term, None, unmet.leader(term));
                unmet.lead(term, leader);
            }
        }
        unmet.end(&state.coords);
        let out_of_reach = explainer.forces.iter().find_map(Force::proves);
        found = out_of_reach.and_then(|term| hint(layout, state, problem, problem.rig(), term));
    } else {
        explainer.read(layout, state, problem, Of::Wishes, None);
    }
    explainer.explain_others(layout, state, None);
    found
}
