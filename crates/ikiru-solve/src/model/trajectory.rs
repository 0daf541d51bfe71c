//! A trajectory as a model: the coordinates of all its samples, one behind the other.

use ikiru_rig::Clip;

use crate::layout::Layout;
use crate::method::Methods;
use crate::method::lm::Lm;
use crate::model::{Effort, Model, Rules};
use crate::motion::limited::run_limited;
use crate::motion::problem::MotionProblem;
use crate::motion::state::MotionState;
use crate::motion::step::MotionStep;
use crate::options::Method;
use crate::search::seeds::Seeds;
use crate::search::{Bar, Budget, Outcome};

/// Most restarts of a motion that limits on rates keep from what it reaches without them.
const MOST_RATE_BOUND: usize = 2;
/// How exactly a motion is solved without even spacing before it is with it.
const LEAST_GAIN_UNSPACED: f64 = 1e-4;
/// Keys beside each other in the sequence of starts are so many poses apart.
const SEEDS_APART: usize = 17;

/// Memory for steps of a trajectory.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrajectoryMemory {
    step: MotionStep,
    residual: Vec<f64>,
    guards: Vec<f64>,
    seeds: Seeds,
    /// Samples between which a start goes straight.
    anchors: Vec<usize>,
    /// Tangents of a way from one motion to another.
    pub(crate) way: Vec<f64>,
    /// Coordinates of motions on the way back to limits on rates.
    pub(crate) reached: Vec<f64>,
    pub(crate) safe: Vec<f64>,
    pub(crate) kept: Vec<f64>,
}

impl TrajectoryMemory {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self { step: MotionStep::new(layout), seeds: Seeds::new(layout), ..Self::default() }
    }

    /// Takes over the shape of a motion of the same layout.
    pub(crate) fn fit(&mut self, layout: &Layout, state: &MotionState) {
        self.step.fit(layout, state);
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

    /// Improves the motion, whose cost is `cost` and which was evaluated last, as if nothing limited
    /// speed and acceleration.
    ///
    /// Even spacing begins from the motion as it is without: its curvature is only bounded, loosely along steps that all
    /// grow together, so that a motion which has still everything to reach would hardly get away.
    pub(crate) fn run_unlimited(
        &mut self,
        lm: &mut Lm,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget<'_>,
    ) -> Outcome {
        let (mut cost, weight) = (cost, self.state.spacing.weight);
        if weight > 0.0 {
            self.state.spacing.weight = 0.0;
            let to_the_end = Bar { cost_below: None, ..*bar };
            let mut effort = Effort { least_gain: LEAST_GAIN_UNSPACED, ..Effort::FULL };
            let first = lm.run(self, cost, &to_the_end, budget, &mut effort);
            self.state.spacing.weight = weight;
            cost = self.evaluate();
            if first.stop.is_final() {
                return Outcome::new(cost, self.violation(), first.stop, true);
            }
            budget.next_start();
        }
        lm.run(self, cost, bar, budget, &mut { Effort::FULL })
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

    fn may_have_forces(&self) -> bool {
        self.layout.n_force_rows > 0
    }

    fn has_failed(&self) -> bool {
        self.state.failure.is_some()
    }

    fn holds(&self) -> bool {
        !self.may_have_forces() || self.state.is_within(self.layout, self.motion, |term| term.hard)
    }

    fn is_satisfied(&self) -> bool {
        self.state.is_within(self.layout, self.motion, crate::term::Term::counts)
    }

    fn linearize(&mut self) {
        self.state.linearize(self.layout, self.motion);
    }

    fn gradient(&self, hard: f64, gradient: &mut [f64]) {
        let (state, n) = (&*self.state, self.layout.n_dofs);
        gradient.copy_from_slice(&state.gradient);
        state.rows.add_transposed(&state.rows.residual, gradient);
        state.guards.add_half_gradient(hard, gradient);
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
        if self.has_forces() { rules.with_forces() } else { rules }
    }

    fn forget_forces(&mut self) {
        self.memory.step.acting.forget();
    }

    fn begin(&mut self) -> f64 {
        self.memory.step.begin(self.layout, self.state)
    }

    fn has_forces(&self) -> bool {
        !self.state.guards.is_empty()
    }

    fn scale(&mut self) -> f64 {
        self.memory.step.scale(self.state)
    }

    fn aim(&mut self, share: f64) {
        self.memory.step.acting.aim(&self.state.guards, share);
    }

    fn solve(&mut self, damping: f64) -> bool {
        self.memory.step.solve(self.layout, self.state, damping)
    }

    fn largest_force(&self) -> f64 {
        self.memory.step.acting.largest_hard(&self.state.guards)
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
        if !self.has_forces() && self.state.rows.blocks.is_empty() {
            return false;
        }
        let TrajectoryMemory { step, residual, guards, .. } = &mut *self.memory;
        self.state.scaled_residuals(self.layout, self.motion, residual, guards);
        step.subtract_model(self.state, residual);
        step.correct(self.layout, self.state, damping, residual, guards);
        true
    }

    /// Other poses at the keys, and the straight way between them and what is given.
    fn seed(&mut self, number: usize, start: &[f64]) {
        let (layout, state) = (self.layout, &mut *self.state);
        let TrajectoryMemory { seeds, anchors, .. } = &mut *self.memory;
        let (nc, last) = (layout.n_coords, state.n_samples - 1);
        state.coords.copy_from_slice(start);
        anchors.clear();
        anchors.extend((0..=last).filter(|t| state.is_given[*t]));
        // Runs of keyed samples share one pose: the seed of their number.
        let (mut n_runs, mut before) = (0, None);
        for i in 0..state.keyed.len() {
            let t = state.keyed[i];
            n_runs += usize::from(before.is_none_or(|b: usize| b + 1 != t));
            before = Some(t);
            if !state.is_given[t] {
                let at = t * nc..(t + 1) * nc;
                let number = number + (n_runs - 1) * SEEDS_APART;
                seeds.write(layout, number, &start[at.clone()], &mut state.coords[at]);
                anchors.push(t);
            }
        }
        anchors.sort_unstable();
        anchors.dedup();
        for pair in anchors.windows(2) {
            state.interpolate(layout, pair[0], pair[1]);
        }
        // Before the first and after the last there is nowhere to go.
        if let (Some(&first), Some(&end)) = (anchors.first(), anchors.last()) {
            for t in (0..first).chain(end + 1..=last) {
                let from = if t < first { first } else { end };
                state.coords.copy_within(from * nc..(from + 1) * nc, t * nc);
            }
        }
    }

    fn most_restarts(&self, wanted: usize) -> usize {
        if self.is_rate_bound { wanted.min(MOST_RATE_BOUND) } else { wanted }
    }

    fn improve(
        &mut self,
        method: &Method,
        methods: &mut Methods,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget<'_>,
    ) -> Outcome {
        match method {
            Method::Adam(options) => methods.adam.run(options, self, cost, bar, budget),
            _ if self.motion.holds_rates() => run_limited(self, &mut methods.lm, cost, bar, budget),
            _ => self.run_unlimited(&mut methods.lm, cost, bar, budget),
        }
    }
}
