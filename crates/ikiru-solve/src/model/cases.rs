//! A model of one coordinate for the unit tests of the loops: its cost is a function, its steps are what a test says.

use crate::algebra::cholesky::NotPositiveDefinite;
use crate::model::{Model, Rules};

/// A point on a line. Every step is as long as it is told to be, and promises a cost that need not come.
pub(crate) struct Line {
    pub(crate) x: [f64; 1],
    pub(crate) cost_of: fn(f64) -> f64,
    /// What is hard, as far as it is missed there.
    pub(crate) violation_of: fn(f64) -> f64,
    pub(crate) has_guards: bool,
    pub(crate) is_satisfied: bool,
    pub(crate) step: f64,
    /// The step once it is corrected, if it is.
    pub(crate) corrected: Option<f64>,
    /// The cost that a step promises.
    pub(crate) promise_of: fn(f64) -> f64,
    pub(crate) gradient: f64,
    pub(crate) rules: Rules,
    /// The shares that were aimed at, and the dampings that were solved with.
    pub(crate) shares: Vec<f64>,
    pub(crate) dampings: Vec<f64>,
    now: f64,
}

impl Line {
    /// Stands at 0, steps by 1, and promises what comes.
    pub(crate) fn new(cost_of: fn(f64) -> f64) -> Self {
        Self {
            x: [0.0],
            cost_of,
            violation_of: |_| 0.0,
            has_guards: false,
            is_satisfied: false,
            step: 1.0,
            corrected: None,
            promise_of: cost_of,
            gradient: 1.0,
            rules: Rules::POSE,
            shares: Vec::new(),
            dampings: Vec::new(),
            now: 0.0,
        }
    }
}

impl Model for Line {
    fn coords(&self) -> &[f64] {
        &self.x
    }
    fn set_coords(&mut self, coords: &[f64]) {
        self.x.copy_from_slice(coords);
    }
    fn evaluate(&mut self) -> f64 {
        self.now = (self.violation_of)(self.x[0]);
        (self.cost_of)(self.x[0])
    }
    fn differentiate(&mut self) -> f64 {
        self.evaluate()
    }
    fn violation(&self) -> f64 {
        self.now
    }
    fn hard_square(&self) -> f64 {
        self.now * self.now
    }
    fn may_have_guards(&self) -> bool {
        self.has_guards
    }
    fn has_failed(&self) -> bool {
        false
    }
    fn holds(&self) -> bool {
        self.now == 0.0
    }
    fn is_satisfied(&self, _: f64) -> bool {
        self.is_satisfied
    }
    fn remember(&mut self) {}
    fn gets_on(&self, _: f64, _: f64) -> bool {
        true
    }
    fn linearize(&mut self) {}
    fn gradient(&self, _: f64, gradient: &mut [f64]) {
        gradient[0] = self.gradient;
    }
    fn n_tangents(&self) -> (usize, usize) {
        (1, 1)
    }
    fn rules(&self) -> Rules {
        self.rules
    }
    fn forget_guards(&mut self) {}
    fn begin(&mut self) -> f64 {
        self.gradient
    }
    fn has_guards(&self) -> bool {
        self.has_guards
    }
    fn scale(&mut self) -> f64 {
        2.0
    }
    fn aim(&mut self, share: f64) {
        self.shares.push(share);
    }
    fn solve(&mut self, damping: f64) -> Result<(), NotPositiveDefinite> {
        self.dampings.push(damping);
        Ok(())
    }
    fn largest_force(&self) -> f64 {
        1.0
    }
    fn promised(&mut self) -> (f64, f64) {
        let to = self.x[0] + self.step;
        ((self.promise_of)(to), (self.violation_of)(to))
    }
    fn longest(&self) -> f64 {
        self.step.abs()
    }
    fn advance(&mut self, from: &[f64]) {
        self.x[0] = from[0] + self.step;
    }
    fn advance_by(&mut self, from: &[f64], tangent: &[f64]) {
        self.x[0] = from[0] + tangent[0];
    }
    fn correct(&mut self, _: f64) -> bool {
        let corrected = self.corrected.take();
        self.step = corrected.unwrap_or(self.step);
        corrected.is_some()
    }
}
