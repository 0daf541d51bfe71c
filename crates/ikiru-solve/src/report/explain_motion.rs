//! Why not: what keeps the terms of a motion from what they want, each at the sample at which it misses the most.

use crate::layout::Layout;
use crate::problem::motion::MotionProblem;
use crate::report::TermReport;
use crate::report::explain::{Beside, Explainer, Of, Standing, Unmet, hint};
use crate::report::force::{Force, Hint};
use crate::state::motion::MotionState;

/// Finds the forces on every term that is not met, the worst term first; the answer is what would help. The motion was
/// evaluated last, and the times of the reports are still those of its timeline. What terms pull at samples before their own
/// is left aside.
pub(crate) fn explain(
    layout: &Layout,
    motion: &MotionProblem,
    state: &mut MotionState,
    terms: &[TermReport],
    (explainer, unmet): (&mut Explainer, &mut Unmet),
    smoothness: &mut Vec<f64>,
) -> Option<Hint> {
    unmet.find(terms.len(), |term| Standing::of(&terms[term]));
    let mut found = None;
    state.linearize(layout, motion);
    let holds_rates = motion.holds_rates();
    smoothness.resize(layout.n_dofs, 0.0);
    let mut was_read = None;
    for &term in &unmet.terms {
        let worst = terms[term].times.map_or(0.0, |times| times.worst_secs);
        let Ok(sample) = motion.timeline().sample_at(worst) else { continue };
        let Some(here) = state.wanted(sample) else { continue };
        let of = if terms[term].hard { Of::UnmetConstraints } else { Of::Wishes };
        let wanted = motion.wanted_at(sample);
        state.gradient_beside(layout, sample, smoothness);
        let beside = (of == Of::Wishes).then_some(Beside { smoothness, holds_rates });
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
    found
}
