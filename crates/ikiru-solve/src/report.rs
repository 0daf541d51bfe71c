//! What came of a solve: success, the reason it ended, every term's residual, and the forces that explain it.

use std::fmt::{self, Debug, Formatter};
use std::ops::{Deref, DerefMut};

use ikiru_rig::JointId;

use crate::force::{Force, Hint};
use crate::objective::{MOST_PARTS, Unfit};
use crate::words::Unit;

/// Why a solve ended. Not converging is a result, and the best pose found always comes back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The bar was met: the cost below `cost_below`, or every mandatory term within its tolerance.
    Reached,
    /// No step makes the cost smaller by more than rounding: this is a (local) best.
    Converged,
    /// The allowed iterations were used up (the paper's equation 21).
    IterationLimit,
    /// The time budget was used up (the paper's equations 23 and 24).
    TimeBudget,
    /// Somebody who [watches](crate::Watch) said so.
    Cancelled,
    /// The method found no better pose, although the gradient says that there is one.
    NoProgress,
    /// Something in the problem or pose is not usable; the pose was not touched.
    InvalidInput,
    /// An objective gave up in mid-solve; the best pose up to then came back, and `invalid` names the objective.
    ObjectiveFailed,
}

impl StopReason {
    /// Lower-case words, as `--json` prints them: `reached`, `iteration_limit`, …
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Reached => "reached",
            Self::Converged => "converged",
            Self::IterationLimit => "iteration_limit",
            Self::TimeBudget => "time_budget",
            Self::Cancelled => "cancelled",
            Self::NoProgress => "no_progress",
            Self::InvalidInput => "invalid_input",
            Self::ObjectiveFailed => "objective_failed",
        }
    }

    /// Whether no further start may follow.
    pub(crate) fn is_final(self) -> bool {
        matches!(self, Self::TimeBudget | Self::Cancelled | Self::ObjectiveFailed)
    }
}

/// What is not usable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invalid {
    /// A term, and what is not usable about it.
    Term(usize, Unfit),
    /// The pose, and what is wrong with it.
    Pose(&'static str),
    /// The solver's options, and what is wrong with them.
    Options(&'static str),
}

/// The length of one part's residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartReport {
    /// The length, in `unit`; rows that want to be at least 0 count by what they miss.
    pub residual: f64,
    /// Its unit.
    pub unit: Unit,
    /// Of rows that want to be at least 0, the smallest residual: what is left of the one that has the least left, below 0
    /// what it misses. `None` where rows want to be 0, and where none is open.
    pub least: Option<f64>,
}

impl PartReport {
    pub(crate) const ZERO: Self = Self { residual: 0.0, unit: Unit::Metres, least: None };
}

/// The parts of a term but for the first, in the order of the objective's; a slice that lies in the report itself.
#[derive(Clone, Copy, PartialEq)]
pub struct PartReports {
    parts: [PartReport; MOST_PARTS - 1],
    n_parts: usize,
}

impl PartReports {
    /// No parts.
    pub(crate) const NONE: Self = Self { parts: [PartReport::ZERO; MOST_PARTS - 1], n_parts: 0 };

    /// Takes one over, as long as there is room: an objective has at most [`MOST_PARTS`], the first not among these.
    pub(crate) fn push(&mut self, part: PartReport) {
        if let Some(slot) = self.parts.get_mut(self.n_parts) {
            *slot = part;
            self.n_parts += 1;
        }
    }
}

impl Deref for PartReports {
    type Target = [PartReport];

    fn deref(&self) -> &[PartReport] {
        &self.parts[..self.n_parts]
    }
}

impl DerefMut for PartReports {
    fn deref_mut(&mut self) -> &mut [PartReport] {
        &mut self.parts[..self.n_parts]
    }
}

impl Debug for PartReports {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

/// The state of one term at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TermReport {
    /// The objective's kind.
    pub kind: &'static str,
    /// The first joint that it reads.
    pub joint: Option<JointId>,
    /// The weight λ.
    pub weight: f64,
    /// Length of the first part's residual, in `unit`.
    pub residual: f64,
    /// Unit of `residual`.
    pub unit: Unit,
    /// The smallest residual of the first part's rows, where they want to be at least 0: see [`PartReport::least`].
    pub least: Option<f64>,
    /// The residuals of its other parts, for objectives that have more than one.
    pub others: PartReports,
    /// What the term adds to the cost: `λ · ρ(r)`.
    pub cost: f64,
    /// Whether every part is within its tolerance.
    pub satisfied: bool,
    /// Whether success asks for it; never where the weight is 0, always where it is hard.
    pub mandatory: bool,
    /// Whether it is a constraint: it adds nothing to the cost.
    pub hard: bool,
    /// Something odd that did not stop the solve.
    pub warning: Option<&'static str>,
}

impl TermReport {
    /// All its parts, in the order of the objective's.
    pub fn parts(&self) -> impl Iterator<Item = PartReport> + '_ {
        let Self { residual, unit, least, .. } = *self;
        std::iter::once(PartReport { residual, unit, least }).chain(self.others.iter().copied())
    }
}

/// What came of a solve.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// Whether the bar was met.
    pub success: bool,
    /// Why it ended.
    pub stop: StopReason,
    /// The cost J of the pose that came back.
    pub cost: f64,
    /// Iterations over all starts.
    pub iterations: usize,
    /// Starts beyond the first.
    pub restarts: usize,
    /// Whether the start lay outside its limits and was moved inside.
    pub start_projected: bool,
    /// The terms, in the order in which they were added.
    pub terms: &'a [TermReport],
    /// What is in the way of each term that is not met, the worst term first and of each at most its eight strongest
    /// forces, the strongest first; then the limits and constraints that act and are in nobody's way. A term is not met
    /// where success asks for it and it is beyond its tolerance; where that is none and the cost is not below its bar,
    /// where it is beyond its tolerance at all, else the one that costs most. Empty where a cost below
    /// `cost_below` was reached.
    pub forces: &'a [Force],
    /// What would help the worst term that is not met and proven to be out of reach.
    pub hint: Option<Hint>,
    /// What was not usable, where `stop` is [`StopReason::InvalidInput`] or [`StopReason::ObjectiveFailed`].
    pub invalid: Option<Invalid>,
}

/// The parts of a report that do not borrow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Summary {
    pub(crate) success: bool,
    pub(crate) stop: StopReason,
    pub(crate) cost: f64,
    pub(crate) iterations: usize,
    pub(crate) restarts: usize,
    pub(crate) start_projected: bool,
    pub(crate) hint: Option<Hint>,
    pub(crate) invalid: Option<Invalid>,
}

impl Summary {
    pub(crate) fn invalid(invalid: Invalid) -> Self {
        Self {
            success: false,
            stop: StopReason::InvalidInput,
            cost: f64::INFINITY,
            iterations: 0,
            restarts: 0,
            start_projected: false,
            hint: None,
            invalid: Some(invalid),
        }
    }

    pub(crate) fn report<'a>(self, terms: &'a [TermReport], forces: &'a [Force]) -> Report<'a> {
        let Self { success, stop, cost, iterations, restarts, start_projected, hint, invalid } = self;
        Report { success, stop, cost, iterations, restarts, start_projected, terms, forces, hint, invalid }
    }
}
