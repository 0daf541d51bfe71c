//! A pose as a model: what moves of it is in the coordinates of its state.

use crate::algebra::cholesky::NotPositiveDefinite;
use crate::layout::Layout;
use crate::model::{Model, Rules};
use crate::problem::Problem;
use crate::state::State;
use crate::state::gradient::whole_gradient;
use crate::step::pose::StepSolver;

/// The pose of a state, with the terms of a problem.
pub(crate) struct PoseModel<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) problem: &'a Problem,
    pub(crate) state: &'a mut State,
    pub(crate) step: &'a mut StepSolver,
}

impl Model for PoseModel<'_> {
    #[inline(always)]
    fn coords(&self) -> &[f64] {
        &self.state.coords
    }

    #[inline(always)]
    fn set_coords(&mut self, coords: &[f64]) {
        self.state.coords.copy_from_slice(coords);
    }

    #[inline(always)]
    fn evaluate(&mut self) -> f64 {
        self.state.evaluate(self.layout, self.problem)
    }

    #[inline(always)]
    fn differentiate(&mut self) -> f64 {
        self.state.differentiate(self.layout, self.problem)
    }

    #[inline(always)]
    fn violation(&self) -> f64 {
        self.state.violation
    }

    fn hard_square(&self) -> f64 {
        self.state.hard_square(self.layout, self.problem)
    }

    #[inline(always)]
    fn may_have_guards(&self) -> bool {
        self.layout.n_guards > 0
    }

    #[inline(always)]
    fn has_failed(&self) -> bool {
        self.state.memory.failure.is_some()
    }

    #[inline(always)]
    fn holds(&self) -> bool {
        !self.may_have_guards() || self.state.holds(self.layout, self.problem)
    }

    fn is_satisfied(&self, part: f64) -> bool {
        self.state.is_satisfied(self.layout, self.problem, part)
    }

    fn remember(&mut self) {
        self.state.kept_squares.copy_from_slice(&self.state.squares);
    }

    fn gets_on(&self, well: f64, little: f64) -> bool {
        self.state.gets_on(self.layout, self.problem, well, little)
    }

    #[inline(always)]
    fn linearize(&mut self) {
        self.state.linearize(self.layout, self.problem, false);
    }

    fn gradient(&self, hard: f64, gradient: &mut [f64]) {
        whole_gradient(self.layout, self.state, hard, gradient);
    }

    fn n_tangents(&self) -> (usize, usize) {
        (self.layout.n_dofs, self.layout.n_dofs)
    }

    #[inline(always)]
    fn rules(&self) -> Rules {
        if self.may_have_guards() { Rules::POSE.with_guards() } else { Rules::POSE }
    }

    fn forget_guards(&mut self) {
        self.step.guards.acting.forget();
    }

    #[inline(always)]
    fn begin(&mut self) -> f64 {
        self.step.begin(self.layout, self.state, self.problem)
    }

    #[inline(always)]
    fn has_guards(&self) -> bool {
        self.may_have_guards()
    }

    #[inline(always)]
    fn scale(&mut self) -> f64 {
        self.step.scale(self.layout, self.state)
    }

    fn aim(&mut self, share: f64) {
        self.step.guards.aim(share);
    }

    #[inline(always)]
    fn solve(&mut self, damping: f64) -> Result<(), NotPositiveDefinite> {
        self.step.solve(self.layout, self.state, damping)
    }

    fn largest_force(&self) -> f64 {
        self.step.guards.largest_hard()
    }

    #[inline(always)]
    fn promised(&mut self) -> (f64, f64) {
        self.step.predicted(self.layout, self.state, self.problem)
    }

    #[inline(always)]
    fn longest(&self) -> f64 {
        self.step.tangent.iter().fold(0.0_f64, |a, d| a.max(d.abs()))
    }

    #[inline(always)]
    fn advance(&mut self, from: &[f64]) {
        self.state.step(self.layout, from, &self.step.tangent);
    }

    fn advance_by(&mut self, from: &[f64], tangent: &[f64]) {
        self.state.step(self.layout, from, tangent);
    }

    fn correct(&mut self, damping: f64) -> bool {
        self.may_have_guards() && self.step.correct(self.layout, self.state, damping)
    }
}
