//! Why not: what keeps the terms of a motion from what they want, each at the sample at which it misses the most.

use crate::explain::{Beside, Explainer, Of, Standing, Unmet, hint};
use crate::force::{Force, Hint};
use crate::layout::Layout;
use crate::motion::problem::MotionProblem;
use crate::motion::report::MotionTermReport;
use crate::motion::state::MotionState;

/// The forces on every term that is not met, the worst term first, and what would help. The motion was evaluated last,
/// and the times of the reports are still those of its timeline. What terms pull at samples before their own is left aside.
pub(super) fn explain(
    layout: &Layout,
    motion: &MotionProblem,
    state: &mut MotionState,
    terms: &[MotionTermReport],
) -> (Vec<Force>, Option<Hint>) {
    let mut unmet = Unmet::new(terms.len(), 0);
    unmet.find(terms.len(), |term| {
        let MotionTermReport { satisfied, mandatory, hard, cost, residual, others, .. } = &terms[term];
        let residual = residual + others.iter().map(|part| part.residual).sum::<f64>();
        Standing { satisfied: *satisfied, mandatory: *mandatory, hard: *hard, cost: *cost, residual }
    });
    let mut explainer = Explainer::new(layout);
    let mut found = None;
    state.linearize(layout, motion);
    let holds_rates = motion.holds_rates();
    let mut smoothness = vec![0.0; layout.n_dofs];
    let mut was_read = None;
    for &term in &unmet.terms {
        let Ok(sample) = motion.timeline().sample_at(terms[term].worst_secs) else { continue };
        let of = if terms[term].hard { Of::UnmetConstraints } else { Of::Wishes };
        let wanted = motion.wanted_at(sample);
        let Some(here) = state.wanted(sample) else { continue };
        state.gradient_beside(layout, sample, &mut smoothness);
        let beside = (of == Of::Wishes).then_some(Beside { smoothness: &smoothness, holds_rates });
        if was_read != Some((sample, of)) {
            explainer.read(layout, here, &wanted, of, beside);
            was_read = Some((sample, of));
        }
        let n_before = explainer.forces.len();
        explainer.explain(layout, here, &wanted, term, beside, None);
        let mut new = explainer.forces[n_before..].iter();
        if found.is_none()
            && let Some(term) = new.find_map(Force::proves)
        {
            found = hint(layout, here, &wanted, motion.rig(), term);
        }
    }
    (explainer.forces, found)
}
