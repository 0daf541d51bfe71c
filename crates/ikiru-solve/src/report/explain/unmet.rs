//! Which terms are not met, the worst first, and what is remembered of that from frame to frame.

use std::cmp::Ordering;

use crate::report::TermReport;
use crate::report::force::ForceBy;

/// What is told first stays so until another is so many times as strong: names do not flicker.
pub(super) const STAYS: f64 = 1.2;

/// How a term stands at the end of a solve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Standing {
    pub(crate) satisfied: bool,
    pub(crate) mandatory: bool,
    pub(crate) hard: bool,
    pub(crate) cost: f64,
    /// What it misses, all parts together.
    pub(crate) residual: f64,
}

impl Standing {
    /// That of a term as it is reported.
    pub(super) fn of(report: &TermReport) -> Self {
        let TermReport { satisfied, mandatory, hard, cost, residual, others, .. } = report;
        let residual = residual + others.iter().map(|part| part.residual).sum::<f64>();
        Self { satisfied: *satisfied, mandatory: *mandatory, hard: *hard, cost: *cost, residual }
    }

    /// How bad it is that it is not met, among terms of its kind.
    fn badness(&self) -> f64 {
        if self.hard { self.residual } else { self.cost }
    }

    /// The worse one is the greater one.
    fn order(&self, other: &Self) -> Ordering {
        self.hard.cmp(&other.hard).then(self.badness().total_cmp(&other.badness()))
    }
}

/// The terms that are not met, and what was in their way before.
#[derive(Clone, Debug, Default)]
pub(crate) struct Unmet {
    /// The worst first.
    pub(crate) terms: Vec<usize>,
    /// What came back last, if there were such terms, the worst of them, and what was first in the way of each
    /// term.
    pose: Vec<f64>,
    worst: Option<usize>,
    leaders: Vec<Option<ForceBy>>,
}

impl Unmet {
    pub(crate) fn new(n_terms: usize) -> Self {
        Self {
            terms: Vec::with_capacity(n_terms),
            pose: Vec::new(),
            worst: None,
            leaders: vec![None; n_terms],
        }
    }

    /// Makes room for so many coordinates.
    pub(crate) fn fit(&mut self, n_coords: usize) {
        if self.pose.len() != n_coords {
            self.pose.resize(n_coords, 0.0);
            self.forget();
        }
    }

    /// Takes over where a solve starts: what was in the way counts only where that is what came back last.
    pub(crate) fn begin(&mut self, coords: &[f64]) {
        if self.worst.is_some() && self.pose != coords {
            self.forget();
        }
    }

    pub(crate) fn forget(&mut self) {
        if self.worst.take().is_some() {
            self.leaders.fill(None);
        }
    }

    /// Finds the terms that success asks for and that are not met; where all are and the cost is still too high, those
    /// that are beyond their tolerance at a cost, else the one that costs most.
    pub(super) fn find(&mut self, n_terms: usize, standing: impl Fn(usize) -> Standing) {
        self.terms.clear();
        self.terms.extend((0..n_terms).filter(|t| standing(*t).mandatory && !standing(*t).satisfied));
        if self.terms.is_empty() {
            let costs = |t: &usize| !standing(*t).satisfied && standing(*t).cost > 0.0;
            self.terms.extend((0..n_terms).filter(costs));
        }
        if self.terms.is_empty() {
            let dearest = (0..n_terms).filter(|t| standing(*t).cost > 0.0);
            self.terms.extend(dearest.max_by(|a, b| standing(*a).cost.total_cmp(&standing(*b).cost)));
        }
        self.terms.sort_unstable_by(|a, b| standing(*b).order(&standing(*a)).then(a.cmp(b)));
        let (Some(&first), Some(before)) = (self.terms.first(), self.worst) else { return };
        let (now, then) = (standing(first), standing(before));
        if let Some(at) = self.terms.iter().position(|t| *t == before)
            && now.hard == then.hard
            && STAYS * then.badness() >= now.badness()
        {
            self.terms[..=at].rotate_right(1);
        }
    }

    /// What was first in the way of a term in the frame before.
    pub(crate) fn leader(&self, term: usize) -> Option<ForceBy> {
        self.leaders[term]
    }

    /// Keeps what is first in the way of a term now.
    pub(crate) fn lead(&mut self, term: usize, leader: Option<ForceBy>) {
        self.leaders[term] = leader;
    }

    /// Keeps what comes back.
    pub(crate) fn end(&mut self, coords: &[f64]) {
        self.worst = self.terms.first().copied();
        self.pose.copy_from_slice(coords);
    }
}
