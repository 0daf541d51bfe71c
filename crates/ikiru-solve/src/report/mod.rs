//! What came of a solve: success, the reason it ended, every term's residual, and the forces that explain it.

use std::borrow::Cow;
use std::fmt::{self, Debug, Formatter};
use std::ops::{Deref, DerefMut, Index};

use ikiru_rig::{JointId, RateExcess};

use crate::objective::{MOST_PARTS, TermWarning};
use crate::problem::term::TermId;
use crate::report::force::{Force, Hint};
use crate::report::invalid::Invalid;
use crate::words::{StopReason, Unit};

pub(crate) mod explain;
pub(crate) mod force;
pub(crate) mod here;
pub(crate) mod invalid;
pub(crate) mod subject;
mod terms;

/// The length of one part's residual.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
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

#[cfg(feature = "serde")]
impl serde::Serialize for PartReports {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (**self).serialize(serializer)
    }
}

impl Debug for PartReports {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

/// The state of one term at the end: of a pose, or over all the samples of a motion at which it holds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct TermReport {
    /// What its [id](TermId) leads to.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) key: u32,
    /// The objective's kind.
    pub kind: &'static str,
    /// The first joint that it reads.
    pub joint: Option<JointId>,
    /// The weight λ.
    pub weight: f64,
    /// Length of the first part's residual, in `unit`; in a motion at the sample at which it is the longest.
    pub residual: f64,
    /// Unit of `residual`.
    pub unit: Unit,
    /// The smallest residual of the first part's rows, where they want to be at least 0: see [`PartReport::least`].
    pub least: Option<f64>,
    /// The residuals of its other parts, for objectives that have more than one.
    pub others: PartReports,
    /// What the term adds to the cost: `λ · ρ(r)`, in a motion over all its samples.
    pub cost: f64,
    /// Whether every part is within its tolerance; in a motion at every sample.
    pub satisfied: bool,
    /// Whether success asks for it; never where the weight is 0, always where it is hard.
    pub mandatory: bool,
    /// Whether it is a constraint: it adds nothing to the cost.
    pub hard: bool,
    /// When it holds, in a motion.
    pub times: Option<TermTimes>,
    /// Something odd about it that did not stop the solve; in a motion at the first of its samples at which there is such.
    pub warning: Option<TermWarning>,
}

/// When a term of a motion holds, and when it is met the least (seconds).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct TermTimes {
    /// The first sample at which it holds.
    pub from_secs: f64,
    /// The last one.
    pub to_secs: f64,
    /// The one at which its first part's residual is the longest.
    pub worst_secs: f64,
}

impl TermTimes {
    /// Each of them at another time.
    #[must_use]
    pub fn map(self, at: impl Fn(f64) -> f64) -> Self {
        let Self { from_secs, to_secs, worst_secs } = self;
        Self { from_secs: at(from_secs), to_secs: at(to_secs), worst_secs: at(worst_secs) }
    }
}

impl TermReport {
    /// All its parts, in the order of the objective's.
    pub fn parts(&self) -> impl Iterator<Item = PartReport> + '_ {
        let Self { residual, unit, least, .. } = *self;
        std::iter::once(PartReport { residual, unit, least }).chain(self.others.iter().copied())
    }
}

/// What came of a solve or a plan. It borrows from the workspace; [`into_owned`](Self::into_owned) keeps it. `report[id]` is
/// the report of a term.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Report<'a> {
    /// Whether the bar was met: a cost below `cost_below` where that is given, else every mandatory term within its
    /// tolerance (in a motion at each of its samples); every constraint within its own; and no limit on speed and
    /// acceleration exceeded.
    pub success: bool,
    /// Why it ended.
    pub stop: StopReason,
    /// The cost J of what came back, smoothness included.
    pub cost: f64,
    /// What of it is smoothness: velocity, acceleration, jerk; 0 for a pose.
    pub smoothness: [f64; 3],
    /// What of it is even spacing; 0 for a pose.
    pub spacing: f64,
    /// Iterations over all starts.
    pub iterations: usize,
    /// Starts beyond the first.
    pub restarts: usize,
    /// Whether the start lay outside its limits and was moved inside; of a motion, any of its samples.
    pub start_projected: bool,
    /// The terms, in the order in which they were added.
    pub terms: Cow<'a, [TermReport]>,
    /// What is in the way of each term that is not met, the worst term first and of each at most its eight strongest
    /// forces, the strongest first; then the limits and constraints that act and are in nobody's way. A term is not met
    /// where success asks for it and it is beyond its tolerance; where that is none and the cost is not below its bar,
    /// where it is beyond its tolerance at all, else the one that costs most. In a motion terms are explained at the sample
    /// at which they miss the most, and what is in nobody's way is told once, at the sample at which it acts the strongest
    /// (smoothness and limits on rates only where they are in the way). Empty where a cost below `cost_below` was reached; what is in
    /// nobody's way is left out where somebody stopped the solve.
    pub forces: Cow<'a, [Force]>,
    /// What would help the worst term that is not met and proven to be out of reach.
    pub hint: Option<Hint>,
    /// The limits on speed and acceleration that a motion does not keep, each with its peak.
    pub exceeded: Cow<'a, [RateExcess]>,
    /// What was not usable, where `stop` is [`StopReason::InvalidInput`] or [`StopReason::ObjectiveFailed`].
    #[cfg_attr(feature = "serde", serde(serialize_with = "as_text"))]
    pub invalid: Option<Invalid>,
}

/// Reasons are for people: as text.
#[cfg(feature = "serde")]
fn as_text<S: serde::Serializer>(invalid: &Option<Invalid>, serializer: S) -> Result<S::Ok, S::Error> {
    match invalid {
        Some(invalid) => serializer.serialize_some(&invalid.to_string()),
        None => serializer.serialize_none(),
    }
}

impl<'a> Report<'a> {
    /// What a report begins with: nothing was done yet, and nothing is listed.
    pub(crate) const EMPTY: Self = Self {
        success: false,
        stop: StopReason::InvalidInput,
        cost: f64::INFINITY,
        smoothness: [0.0; 3],
        spacing: 0.0,
        iterations: 0,
        restarts: 0,
        start_projected: false,
        terms: Cow::Borrowed(&[]),
        forces: Cow::Borrowed(&[]),
        hint: None,
        exceeded: Cow::Borrowed(&[]),
        invalid: None,
    };

    /// A report of a solve that did not begin.
    pub(crate) fn invalid(invalid: Invalid) -> Self {
        Self { invalid: Some(invalid), ..Self::EMPTY }
    }

    /// The same, borrowing nothing.
    #[must_use]
    pub fn into_owned(self) -> Report<'static> {
        let Self { success, stop, cost, smoothness, spacing, iterations, restarts, .. } = self;
        Report {
            success,
            stop,
            cost,
            smoothness,
            spacing,
            iterations,
            restarts,
            start_projected: self.start_projected,
            terms: Cow::Owned(self.terms.into_owned()),
            forces: Cow::Owned(self.forces.into_owned()),
            hint: self.hint,
            exceeded: Cow::Owned(self.exceeded.into_owned()),
            invalid: self.invalid,
        }
    }

    /// Has all times at which terms hold and forces act be other ones, as where the motion is played more slowly.
    pub fn map_times(&mut self, at: impl Fn(f64) -> f64) {
        map_times(self.terms.to_mut(), self.forces.to_mut(), at);
    }

    /// The report of a term; `None` where there is none: the input was invalid, or the term was removed. The id is one of the
    /// problem's that was solved, or of a copy of it.
    #[must_use]
    pub fn get<T>(&self, id: TermId<T>) -> Option<&TermReport> {
        self.terms.binary_search_by_key(&id.key, |term| term.key).ok().map(|at| &self.terms[at])
    }
}

/// Gives what is told of terms and forces other times.
pub(crate) fn map_times(terms: &mut [TermReport], forces: &mut [Force], at: impl Fn(f64) -> f64) {
    for times in terms.iter_mut().filter_map(|term| term.times.as_mut()) {
        *times = times.map(&at);
    }
    for secs in forces.iter_mut().filter_map(|force| force.secs.as_mut()) {
        *secs = at(*secs);
    }
}

impl<T> Index<TermId<T>> for Report<'_> {
    type Output = TermReport;

    /// # Panics
    /// Where there is [no such report](Report::get).
    #[expect(clippy::expect_used, reason = "indexing with a wrong id is a programming error, as for a slice")]
    fn index(&self, id: TermId<T>) -> &TermReport {
        self.get(id).expect("the id belongs to another problem, or nothing was solved")
    }
}
