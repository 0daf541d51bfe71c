//! A trajectory as a model: the coordinates of all its samples, one behind the other.

use ikiru_rig::{Clip, RateExcess};

use crate::algebra::cholesky::NotPositiveDefinite;
use crate::algebra::room::make_room;
use crate::layout::Layout;
use crate::model::{Model, Rules};
use crate::problem::motion::MotionProblem;
use crate::problem::term::Term;
use crate::state::motion::MotionState;
use crate::step::motion::MotionStep;

/// Memory for steps of a trajectory.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrajectoryMemory {
    step: MotionStep,
    residual: Vec<f64>,
    guards: Vec<f64>,
    /// Tangents of a way from one motion to another.
    pub(crate) way: Vec<f64>,
    /// Coordinates of motions on the way back to limits on rates; the straight way, and the limits that it does not keep,
    /// once that is known; and those of a motion that was seen to keep all of them.
    pub(crate) reached: Vec<f64>,
    pub(crate) safe: Vec<f64>,
    pub(crate) safe_excess: Option<Vec<RateExcess>>,
    pub(crate) good: Vec<f64>,
    pub(crate) kept: Vec<f64>,
}

impl TrajectoryMemory {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self { step: MotionStep::new(layout), ..Self::default() }
    }

    /// Takes over the shape of a motion of the same layout.
    pub(crate) fn fit(&mut self, layout: &Layout, state: &MotionState) {
        self.step.fit(layout, state);
        make_room(&mut self.residual, state.most.rows.rows);
        make_room(&mut self.guards, state.most.guards.rows);
        self.safe_excess = None;
        self.good.clear();
    }
}

/// The motion of a state.
pub(crate) struct Trajectory<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) motion: &'a MotionProblem,
    pub(crate) state: &'a mut MotionState,
    pub(crate) memory: &'a mut TrajectoryMemory,
    /// The coordinates that the plan begins from.
    pub(crate) start: &'a [f64],
    /// The motion as a clip, made when it is measured.
    pub(crate) clip: &'a mut Clip,
    /// Whether all that is wanted was met as if nothing limited rates: another start hardly helps then.
    pub(crate) is_rate_bound: bool,
}

impl Trajectory<'_> {
    /// Writes the motion as it is into its clip.
    pub(crate) fn write_clip(&mut self) {
        for t in 0..self.state.n_samples {
            if let Some(coords) = self.clip.coords_mut(t) {
                self.state.store(self.layout, t, coords);
            }
        }
    }

    /// The straight way at constant speed from the last sample of the history to a given end, or standing still.
    pub(crate) fn go_straight(&mut self) {
        let nc = self.layout.n_coords;
        let last = self.state.n_samples - 1;
        self.state.coords.copy_from_slice(self.start);
        let is_given = |t: usize| self.motion.given(t).is_some();
        let from = (0..last).rfind(|t| is_given(*t));
        match (from, is_given(last)) {
            (Some(from), true) => self.state.interpolate(self.layout, from, last),
            (from, end_is_given) => {
                let from = from.unwrap_or(if end_is_given { last } else { 0 });
                for t in (0..=last).filter(|t| !is_given(*t)) {
                    self.state.coords.copy_within(from * nc..(from + 1) * nc, t * nc);
                }
            }
        }
    }
}

impl Model for Trajectory<'_> {
    fn coords(&self) -> &[f64] {
        &self.state.coords
    }

    fn set_coords(&mut self, coords: &[f64]) {
        self.state.coords.copy_from_slice(coords);
    }

    fn evaluate(&mut self) -> f64 {
        self.state.evaluate(self.layout, self.motion)
    }

    fn differentiate(&mut self) -> f64 {
        self.state.differentiate(self.layout, self.motion)
    }

    fn violation(&self) -> f64 {
        self.state.violation
    }

    fn hard_square(&self) -> f64 {
        self.state.hard_square
    }

    fn may_have_guards(&self) -> bool {
        self.layout.n_guards > 0
    }

    fn has_failed(&self) -> bool {
        self.state.failure.is_some()
    }

    fn holds(&self) -> bool {
        !self.may_have_guards() || self.state.is_within(self.layout, self.motion, 1.0, |term| term.hard)
    }

    fn is_satisfied(&self, part: f64) -> bool {
        self.state.is_within(self.layout, self.motion, part, Term::counts)
    }

    // No motion is solved as a frame is.
    fn remember(&mut self) {}

    fn gets_on(&self, _: f64, _: f64) -> bool {
        true
    }

    fn linearize(&mut self) {
        self.state.linearize(self.layout, self.motion);
    }

    fn gradient(&self, hard: f64, gradient: &mut [f64]) {
        let (state, n) = (&*self.state, self.layout.n_dofs);
        state.write_half_gradient(hard, gradient);
        for (t, given) in state.is_given.iter().enumerate() {
            let factor = if *given { 0.0 } else { 2.0 };
            gradient[t * n..(t + 1) * n].iter_mut().for_each(|g| *g *= factor);
        }
    }

    fn n_tangents(&self) -> (usize, usize) {
        let n_moving = self.state.is_given.iter().filter(|given| !**given).count();
        (self.layout.n_dofs * self.state.n_samples, self.layout.n_dofs * n_moving)
    }

    fn rules(&self) -> Rules {
        let is_iterative = self.memory.step.is_iterative(self.state);
        let rules = if is_iterative { Rules::TRAJECTORY_ITERATIVE } else { Rules::TRAJECTORY };
        if self.has_guards() { rules.with_guards() } else { rules }
    }

    fn forget_guards(&mut self) {
        self.memory.step.guards.acting.forget();
    }

    fn begin(&mut self) -> f64 {
        self.memory.step.begin(self.layout, self.state)
    }

    fn has_guards(&self) -> bool {
        !self.state.guards.is_empty()
    }

    fn scale(&mut self) -> f64 {
        self.memory.step.scale(self.state)
    }

    fn aim(&mut self, share: f64) {
        self.memory.step.guards.acting.aim(&self.state.guards, share);
    }

    fn solve(&mut self, damping: f64) -> Result<(), NotPositiveDefinite> {
        self.memory.step.solve(self.layout, self.state, damping)
    }

    fn largest_force(&self) -> f64 {
        self.memory.step.guards.acting.largest_hard(&self.state.guards)
    }

    fn promised(&mut self) -> (f64, f64) {
        self.memory.step.predicted(self.state)
    }

    fn longest(&self) -> f64 {
        self.memory.step.delta.iter().fold(0.0_f64, |a, d| a.max(d.abs()))
    }

    fn advance(&mut self, from: &[f64]) {
        self.state.step(self.layout, from, &self.memory.step.delta);
    }

    fn advance_by(&mut self, from: &[f64], tangent: &[f64]) {
        self.state.step(self.layout, from, tangent);
    }

    fn correct(&mut self, damping: f64) -> bool {
        if !self.has_guards() && self.state.rows.blocks.is_empty() {
            return false;
        }
        let TrajectoryMemory { step, residual, guards, .. } = &mut *self.memory;
        self.state.scaled_residuals(self.layout, self.motion, residual, guards);
        step.subtract_model(self.state, residual);
        step.correct(self.layout, self.state, damping, residual, guards);
        true
    }
}
