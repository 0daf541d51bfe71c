//! Why not, of a pose or a motion: what is in the way of each term that is not met, and what else acts.

use crate::report::TermReport;
use crate::report::explain::hint::hint;
use crate::report::explain::unmet::{Standing, Unmet};
use crate::report::explain::{Explainer, LEAST_WAY};
use crate::report::force::{Force, Hint};
use crate::report::here::Of;
use crate::report::subject::Subject;

/// Finds the forces on each term that is not met, the worst term first, at the sample at which it misses the most; then the
/// limits and constraints that are in nobody's way, each at the sample at which it acts the strongest, where these are asked for
/// too. The answer is what would help. It was evaluated last, and is linearized here.
pub(crate) fn explain(
    subject: &mut impl Subject,
    terms: &[TermReport],
    (explainer, unmet): (&mut Explainer, &mut Unmet),
    success: bool,
    wants_others: bool,
) -> Option<Hint> {
    subject.linearize();
    let mut help = None;
    let mut was_read = None;
    if !success {
        unmet.find(terms.len(), |term| Standing::of(&terms[term]));
        let mut is_proven = false;
        // Constraints stand before wishes, so that those of one sample are explained by the same forces.
        for idx in 0..unmet.terms.len() {
            let term = unmet.terms[idx];
            let of = if terms[term].hard { Of::UnmetConstraints } else { Of::Wishes };
            let sample = subject.worst_sample(&terms[term]);
            let here = subject.at(sample, of);
            if was_read.replace((sample, of)) != Some((sample, of)) {
                explainer.read(&here, of);
            }
            let n_before = explainer.forces.len();
            let leader = explainer.explain(&here, term, unmet.leader(term));
            unmet.lead(term, leader);
            let proven = explainer.forces[n_before..].iter().find_map(Force::proves);
            if let Some(term) = proven.filter(|_| !is_proven) {
                (is_proven, help) = (true, hint(&here, term));
            }
        }
        unmet.end(subject.coords());
    }
    if !wants_others {
        return help;
    }
    let least = LEAST_WAY * subject.largest_curvature();
    for sample in 0..subject.n_samples() {
        if subject.is_given(sample) {
            continue;
        }
        let here = subject.at(sample, Of::Wishes);
        let of_sample = Some((sample, Of::Wishes));
        if was_read == of_sample || explainer.read_where_pushed(&here) {
            explainer.add_others(&here, least);
        }
        was_read = None;
    }
    explainer.tell_others();
    help
}

/// Whether nothing can act where all terms are met: no limit is touched, and no row has a force.
pub(crate) fn is_free(subject: &mut impl Subject, explainer: &mut Explainer) -> bool {
    (0..subject.n_samples())
        .all(|sample| subject.is_given(sample) || explainer.is_free(&subject.at(sample, Of::Wishes)))
}
