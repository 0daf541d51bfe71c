//! How a solve begins and ends, be it of a pose or of a motion.

use std::borrow::Cow;

use crate::layout::Layout;
use crate::method::{Outcome, SolverOptions};
use crate::report::explain::{Explainer, Unmet, explain, is_free};
use crate::report::invalid::{Invalid, InvalidTerm};
use crate::report::subject::Subject;
use crate::report::{Report, TermReport};
use crate::words::StopReason;

/// What is told of a solve, in memory that is kept.
#[derive(Clone, Debug, Default)]
pub(super) struct Told {
    pub(super) terms: Vec<TermReport>,
    pub(super) explainer: Explainer,
    pub(super) unmet: Unmet,
}

impl Told {
    pub(super) fn new(layout: &Layout) -> Self {
        let n_terms = layout.terms.len();
        Self {
            terms: Vec::with_capacity(n_terms),
            explainer: Explainer::new(layout),
            unmet: Unmet::new(n_terms),
        }
    }

    /// Nothing was told yet.
    pub(super) fn clear(&mut self) {
        self.terms.clear();
        self.explainer.forces.clear();
    }

    /// Has a report borrow what was told.
    pub(super) fn lend<'w>(&'w self, report: Report<'w>) -> Report<'w> {
        let forces = &self.explainer.forces;
        Report { terms: Cow::Borrowed(&self.terms), forces: Cow::Borrowed(forces), ..report }
    }
}

/// Refuses what no solve can begin from: it was evaluated last, and costs so much.
pub(super) fn check_start(subject: &mut impl Subject, cost: f64) -> Result<(), Invalid> {
    if let Some((term, reason)) = subject.take_failure() {
        return Err(Invalid::Term(term, InvalidTerm::GaveUp(reason)));
    }
    if (cost + subject.violation()).is_finite() { Ok(()) } else { Err(subject.not_finite()) }
}

/// Judges where a search ended, and tells what came of it and why not. `keeps_rates` sees that, gives it other times where
/// it needs them, and says whether limits on rates are kept.
pub(super) fn conclude(
    subject: &mut impl Subject,
    options: &SolverOptions,
    (outcome, restarts): (Outcome, usize),
    iterations: usize,
    told: &mut Told,
    keeps_rates: impl FnOnce(&mut Told) -> bool,
) -> Report<'static> {
    let failure = subject.take_failure();
    // No cost is known of what does not keep limits on rates.
    let is_known = outcome.is_evaluated && outcome.cost.is_finite();
    let mut cost = if is_known { subject.settled_cost() + outcome.cost } else { subject.evaluate() };
    if failure.is_some() {
        // What gave up once may give up again: the cost is what it was when this was found.
        cost = subject.settled_cost() + outcome.cost;
        subject.take_failure();
    }
    subject.report_terms(&mut told.terms);
    let within = match options.cost_below {
        Some(bar) => cost < bar && told.terms.iter().all(|t| t.satisfied || !t.hard),
        None => told.terms.iter().all(|t| t.satisfied || !t.mandatory),
    };
    // Where the bar is a cost and it is met, nothing is in the way, and this is the hot path.
    let is_plain = within && (options.cost_below.is_some() || is_free(subject, &mut told.explainer));
    let hint = if is_plain {
        None
    } else {
        // Who cancels waits for what is in the way at most, which is looked for at one sample a term, not at all of them.
        let wants_others = outcome.stop != StopReason::Cancelled;
        explain(subject, &told.terms, (&mut told.explainer, &mut told.unmet), within, wants_others)
    };
    if within {
        told.unmet.forget();
    }
    let success = keeps_rates(told) && within;
    let stop = match outcome.stop {
        _ if failure.is_some() => StopReason::ObjectiveFailed,
        _ if success => StopReason::Reached,
        // All that is wanted, but beyond a limit on rates.
        StopReason::Reached if within => StopReason::NoProgress,
        // The cost is as good as nothing, and yet a term of next to no weight is not met.
        StopReason::Reached => StopReason::Converged,
        other => other,
    };
    let invalid = failure.map(|(term, reason)| Invalid::Term(term, InvalidTerm::GaveUp(reason)));
    Report { success, stop, cost, iterations, restarts, hint, invalid, ..Report::EMPTY }
}
