//! Which rows with a force act in a step of a motion. As in `step/forces.rs` each has a compliance, and acts while its force
//! says so; here they join the rows that the step is solved over, as long as they act.

use crate::algebra::sample_rows::SampleRows;
use crate::state::guards::Guards;
use crate::step::active::aim;
use crate::words::Sense;

/// A row that wants to be at least 0 counts as missed beyond this (metres, radians).
const SLACK: f64 = 1e-12;
/// Where steps are solved for iteratively, the stiffness of hard rows relative to the largest curvature: forces that are
/// kept from step to step make up for what it leaves.
const STIFFNESS: f64 = 1e4;

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
        self.aim.extend(rows.map(|(guard, residual)| aim(guard.sense, *residual, share)));
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
