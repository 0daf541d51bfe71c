//! Rows with a sense and a force at the samples of a motion: what is hard, and what wants to be at least something. As in
//! `solvers/forces.rs` each has a compliance, and acts while its force says so; here they join the rows that the step is solved
//! over, as long as they act.

use crate::layout::{Layout, PartLayout, Place, TermLayout};
use crate::motion::rows::SampleRows;
use crate::state::State;
use crate::term::Term;
use crate::words::{Loss, Sense};

/// A row that wants to be at least 0 counts as missed beyond this (metres, radians).
const SLACK: f64 = 1e-12;
/// Where steps are solved for iteratively, the stiffness of hard rows relative to the largest curvature: forces that are
/// kept from step to step make up for what it leaves.
const STIFFNESS: f64 = 1e4;

/// Rows of one part at one sample.
#[derive(Clone, Copy, Debug)]
struct GuardPart {
    first: usize,
    n_rows: usize,
    sense: Sense,
    is_hard: bool,
    /// Whether nothing moves it.
    is_constant: bool,
    term_weight: f64,
    loss: Loss,
}

/// All rows with a force of a motion, as of the last linearization: as many, in the same order, at each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Guards {
    /// Residuals and derivatives as they are, not scaled.
    pub(crate) rows: SampleRows,
    parts: Vec<GuardPart>,
    guards: Vec<Guard>,
}

/// One row.
#[derive(Clone, Copy, Debug)]
struct Guard {
    sense: Sense,
    /// The weight of a wish; `None` for a hard row.
    weight: Option<f64>,
    is_open: bool,
}

impl Guards {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self { rows: SampleRows::new(layout), ..Self::default() }
    }

    pub(crate) fn clear(&mut self) {
        self.rows.clear();
        self.parts.clear();
        self.guards.clear();
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.guards.is_empty()
    }

    /// Copies the rows of one part of a term from the sample that was linearized, and from those before it.
    pub(crate) fn push(
        &mut self,
        layout: &Layout,
        sample: &State,
        earlier: &[State],
        t: &TermLayout,
        term: &Term,
        idx: usize,
    ) {
        let part = &layout.parts[idx];
        let PartLayout { n_rows, row, sense, place: Place::Force { first }, .. } = *part else { return };
        let weight = if t.is_hard { None } else { Some(sample.weights[idx]) };
        self.parts.push(GuardPart {
            first: self.guards.len(),
            n_rows,
            sense,
            is_hard: t.is_hard,
            is_constant: t.is_constant,
            term_weight: term.weight,
            loss: term.loss,
        });
        for i in 0..n_rows {
            let entry = |back: usize, k: usize| {
                let state = if back == 0 { sample } else { &earlier[back - 1] };
                state.force_jacobian[(first + i) * layout.n_dofs + k]
            };
            self.rows.push(row + i, sample.residual[row + i], entry);
            let is_open = i < sample.n_open[idx] && weight != Some(0.0);
            self.guards.push(Guard { sense, weight, is_open });
        }
    }

    /// What the linear model promises for a step: the cost of wishes, and by how much hard rows are missed.
    pub(crate) fn predicted(&self, delta: &[f64], along: &mut Vec<f64>) -> (f64, f64) {
        along.clear();
        along.extend_from_slice(&self.rows.residual);
        self.rows.add_product(delta, along);
        let (mut cost, mut violation) = (0.0, 0.0);
        for part in &self.parts {
            let open = (part.first..part.first + part.n_rows).filter(|row| self.guards[*row].is_open);
            let missing = open.map(|row| part.sense.missing(along[row]));
            if part.is_hard {
                violation += if part.is_constant { 0.0 } else { missing.map(f64::abs).sum() };
            } else {
                cost += part.term_weight * part.loss.cost(missing.map(|r| r * r).sum());
            }
        }
        (cost, violation)
    }

    /// Adds half the gradient of the wishes among the rows, and of `hard` times the squares of what hard rows miss.
    pub(crate) fn add_half_gradient(&self, hard: f64, gradient: &mut [f64]) {
        let pull = |row: usize| {
            let Guard { sense, weight, .. } = self.guards[row];
            weight.unwrap_or(hard) * sense.missing(self.rows.residual[row])
        };
        self.rows.add_transposed_of(pull, gradient);
    }
}

/// Which rows act in a step, and how.
#[derive(Clone, Debug, Default)]
pub(crate) struct Acting {
    acts: Vec<bool>,
    /// The force of each row; 0 where it does not act.
    force: Vec<f64>,
    /// The residuals that the step is solved for.
    aim: Vec<f64>,
    /// What the linear model says of each row.
    along: Vec<f64>,
    is_iterative: bool,
    /// The compliance of hard rows where steps are solved for iteratively.
    compliance: f64,
}

impl Acting {
    /// Forgets what acted.
    pub(crate) fn forget(&mut self) {
        self.acts.clear();
        self.force.clear();
    }

    /// Takes over a linearization of this largest curvature; what acted before, acts at first.
    pub(crate) fn begin(&mut self, guards: &Guards, is_iterative: bool, scale: f64) {
        (self.is_iterative, self.compliance) = (is_iterative, 1.0 / (STIFFNESS * scale));
        self.acts.resize(guards.guards.len(), false);
        self.force.resize(guards.guards.len(), 0.0);
        for ((guard, acts), force) in guards.guards.iter().zip(&mut self.acts).zip(&mut self.force) {
            if !guard.is_open {
                (*acts, *force) = (false, 0.0);
            }
        }
    }

    /// Takes what the forces do off half a gradient.
    pub(crate) fn balance(&self, guards: &Guards, gradient: &mut [f64]) {
        guards.rows.add_transposed_of(|row| -self.force[row], gradient);
    }

    /// The next step is to make good a share of what is missed.
    pub(crate) fn aim(&mut self, guards: &Guards, share: f64) {
        let rows = guards.guards.iter().zip(&guards.rows.residual);
        self.aim.clear();
        self.aim.extend(rows.map(|(guard, residual)| {
            let missed = guard.sense.missing(*residual);
            if missed == 0.0 { *residual } else { share * missed }
        }));
    }

    /// The next step is from where the model begins, for the residuals at another motion near by, less what the linear
    /// model says of the way there.
    pub(crate) fn aim_from(&mut self, guards: &Guards, residual: &[f64], delta: &[f64]) {
        self.aim.clear();
        self.aim.extend_from_slice(residual);
        self.along.clear();
        self.along.resize(self.aim.len(), 0.0);
        guards.rows.add_product(delta, &mut self.along);
        self.aim.iter_mut().zip(&self.along).for_each(|(aim, along)| *aim -= along);
    }

    /// Begins a step: what must act, and what acted.
    pub(crate) fn open(&mut self, guards: &Guards) {
        for (acts, guard) in self.acts.iter_mut().zip(&guards.guards) {
            *acts = guard.is_open && (*acts || guard.sense == Sense::Equal);
        }
    }

    /// Whether a row acts.
    pub(crate) fn acts(&self, row: usize) -> bool {
        self.acts[row]
    }

    /// The compliance of a row: 0 for a hard one where steps are solved for exactly.
    fn compliance(&self, guards: &Guards, row: usize) -> f64 {
        match guards.guards[row].weight {
            Some(weight) => 1.0 / weight,
            None if self.is_iterative => self.compliance,
            None => 0.0,
        }
    }

    /// Adds a row that acts to those that a step is solved over.
    pub(crate) fn push_to(&self, guards: &Guards, row: usize, rows: &mut SampleRows) {
        let compliance = self.compliance(guards, row);
        if self.is_iterative {
            rows.push_scaled(&guards.rows, row, self.residual(guards, row), 1.0 / compliance.sqrt(), 1.0);
        } else {
            rows.push_scaled(&guards.rows, row, self.residual(guards, row), 1.0, compliance);
        }
    }

    /// The residual of a row among those that a step is solved over.
    pub(crate) fn residual(&self, guards: &Guards, row: usize) -> f64 {
        if !self.is_iterative {
            return self.aim[row];
        }
        let compliance = self.compliance(guards, row);
        let kept = if guards.guards[row].weight.is_none() { compliance * self.force[row] } else { 0.0 };
        (self.aim[row] - kept) / compliance.sqrt()
    }

    /// Takes over the multiplier of a row that acts among those that the step was solved over.
    pub(crate) fn set_force(&mut self, guards: &Guards, row: usize, multiplier: f64) {
        let scale = if self.is_iterative { 1.0 / self.compliance(guards, row).sqrt() } else { 1.0 };
        self.force[row] = -scale * multiplier;
    }

    /// Lets rows go that would have to pull, and has those act that a step misses; says whether there was one.
    pub(crate) fn exchange(&mut self, guards: &Guards, delta: &[f64]) -> bool {
        self.along.clone_from(&self.aim);
        guards.rows.add_product(delta, &mut self.along);
        let mut changed = false;
        for (row, guard) in guards.guards.iter().enumerate() {
            if guard.sense == Sense::Equal || !guard.is_open {
                continue;
            }
            let is_wrong = if self.acts[row] { self.force[row] < 0.0 } else { self.along[row] < -SLACK };
            if is_wrong {
                (changed, self.acts[row]) = (true, !self.acts[row]);
            }
            if !self.acts[row] {
                self.force[row] = 0.0;
            }
        }
        changed
    }

    /// The largest force of a hard row.
    pub(crate) fn largest_hard(&self, guards: &Guards) -> f64 {
        let hard = guards.guards.iter().zip(&self.force).filter(|(guard, _)| guard.weight.is_none());
        hard.map(|(_, force)| force.abs()).fold(0.0, f64::max)
    }
}
