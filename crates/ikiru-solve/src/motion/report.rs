//! What came of planning a motion.

use ikiru_rig::{JointId, RateExcess};

use crate::force::{Force, Hint};
use crate::layout::Layout;
use crate::motion::problem::MotionProblem;
use crate::motion::sample_terms::SampleTerms;
use crate::motion::state::MotionState;
use crate::problem::Terms;
use crate::report::{Invalid, PartReport, PartReports, StopReason};
use crate::state::State;
use crate::words::Unit;

/// One term over all the samples at which it holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionTermReport {
    /// The objective's kind.
    pub kind: &'static str,
    /// The first joint that it reads.
    pub joint: Option<JointId>,
    /// The weight λ.
    pub weight: f64,
    /// When it holds first and last, seconds.
    pub from_secs: f64,
    /// When it holds last, seconds.
    pub to_secs: f64,
    /// Length of the first part's residual at the sample at which it is the longest, in `unit`.
    pub residual: f64,
    /// Unit of `residual`.
    pub unit: Unit,
    /// When that is, seconds.
    pub worst_secs: f64,
    /// The smallest residual that the first part's rows have at any sample, where they want to be at least 0: see
    /// [`PartReport::least`].
    pub least: Option<f64>,
    /// The longest residuals of its other parts, for objectives that have more than one.
    pub others: PartReports,
    /// What the term adds to the cost, over all its samples.
    pub cost: f64,
    /// Whether every part is within its tolerance at every sample.
    pub satisfied: bool,
    /// Whether success asks for it.
    pub mandatory: bool,
    /// Whether it is a constraint: it adds nothing to the cost.
    pub hard: bool,
}

impl MotionTermReport {
    /// All its parts, in the order of the objective's.
    pub fn parts(&self) -> impl Iterator<Item = PartReport> + '_ {
        let Self { residual, unit, least, .. } = *self;
        std::iter::once(PartReport { residual, unit, least }).chain(self.others.iter().copied())
    }
}

/// What came of planning.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionReport {
    /// Whether the bar was met: a cost below `cost_below` where that is given, else every mandatory term within its
    /// tolerance at each of its samples; and no limit on speed and acceleration exceeded.
    pub success: bool,
    /// Why it ended.
    pub stop: StopReason,
    /// The cost of the motion, smoothness included.
    pub cost: f64,
    /// What of it is smoothness: velocity, acceleration, jerk.
    pub smoothness: [f64; 3],
    /// What of it is even spacing.
    pub spacing: f64,
    /// Iterations over all starts.
    pub iterations: usize,
    /// Starts beyond the first.
    pub restarts: usize,
    /// The terms, in the order in which they were added.
    pub terms: Vec<MotionTermReport>,
    /// What is in the way of each term that is not met, at the sample at which it misses the most: the worst term first, and
    /// of each at most its eight strongest forces, the strongest first, as in [`Report::forces`](crate::Report::forces).
    /// Empty where the bar was met, but for limits on speed and acceleration.
    pub forces: Vec<Force>,
    /// What would help the worst term that is not met and proven to be out of reach.
    pub hint: Option<Hint>,
    /// Limits on speed and acceleration that the motion does not keep, the worst first: only where no motion was found
    /// that keeps them: samples that are given are too far apart or too fast, a ball is stopped at once by its cone, or
    /// iterations or time ended before a history in full motion was led within its limits. Between samples of a history
    /// nothing is judged. Success asks for none.
    pub exceeded: Vec<RateExcess>,
    /// What was not usable, where `stop` is [`StopReason::InvalidInput`] or [`StopReason::ObjectiveFailed`].
    pub invalid: Option<Invalid>,
}

impl MotionReport {
    pub(crate) fn invalid(invalid: Invalid) -> Self {
        Self {
            success: false,
            stop: StopReason::InvalidInput,
            cost: f64::INFINITY,
            smoothness: [0.0; 3],
            spacing: 0.0,
            iterations: 0,
            restarts: 0,
            terms: Vec::new(),
            forces: Vec::new(),
            hint: None,
            exceeded: Vec::new(),
            invalid: Some(invalid),
        }
    }
}

/// The terms of a motion as its state holds it.
pub(crate) fn report_terms(
    layout: &Layout,
    motion: &MotionProblem,
    state: &mut MotionState,
) -> Vec<MotionTermReport> {
    let timeline = motion.timeline();
    let mut reports: Vec<MotionTermReport> = layout
        .terms
        .iter()
        .map(|t| {
            let (term, samples) = (&motion.terms().terms()[t.term], &motion.tracks()[t.term].samples);
            let objective = &term.objective;
            let mut units = layout.reported_parts(t).map(|part| layout.parts[part].unit);
            let unit = units.next().unwrap_or(Unit::Metres);
            let mut others = PartReports::NONE;
            units.for_each(|unit| others.push(PartReport { unit, ..PartReport::ZERO }));
            MotionTermReport {
                kind: objective.kind(),
                joint: t.joint,
                weight: term.weight,
                from_secs: timeline.time(samples.start),
                to_secs: timeline.time(samples.end - 1),
                residual: 0.0,
                unit,
                least: None,
                worst_secs: timeline.time(samples.start),
                others,
                cost: 0.0,
                satisfied: true,
                mandatory: term.counts(),
                hard: term.hard,
            }
        })
        .collect();
    let mut add = |state: &State, terms: &SampleTerms<'_>, sample: usize| {
        for (t, report) in layout.terms.iter().zip(&mut reports).filter(|(t, _)| terms.is_on(t.term)) {
            let loss = terms.term(t.term).loss;
            for (idx, part) in layout.reported_parts(t).enumerate() {
                let length = state.squares[part].sqrt();
                if terms.term(t.term).is_on && !t.is_hard {
                    report.cost += report.weight * loss.cost(state.squares[part]);
                }
                let tolerance = motion.terms().terms()[t.term].tolerance.of(layout.parts[part].unit);
                report.satisfied &= length <= tolerance;
                let least = if idx > 0 { &mut report.others[idx - 1].least } else { &mut report.least };
                let here = state.least(layout, part);
                let is_worst = here.is_some_and(|here| least.is_none_or(|least| here < least));
                if is_worst {
                    *least = here;
                }
                if idx > 0 {
                    let other = &mut report.others[idx - 1].residual;
                    *other = other.max(length);
                } else if length > report.residual || (is_worst && report.residual == 0.0) {
                    (report.residual, report.worst_secs) = (length, timeline.time(sample));
                }
            }
        }
        true
    };
    state.visit_wanted(motion, &mut add);
    state.visit_settled(layout, motion, &mut add);
    state.visit_off(layout, motion, &mut add);
    reports
}
