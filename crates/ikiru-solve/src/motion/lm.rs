//! Bounded Levenberg–Marquardt over all samples of a motion at once: the method of poses (`solvers/lm.rs`), with a
//! correction for curved valleys.

use crate::motion::planner::{MotionWorkspace, Outcome, Run};
use crate::report::StopReason;
use crate::solvers::search::Bar;

/// First damping, relative to the largest curvature along one degree of freedom.
pub(super) const FIRST_DAMPING: f64 = 0.05;
/// By how much a rejected step makes the damping grow.
const GROWTH: f64 = 4.0;
/// Damping, relative to the same, at which a step is too short to matter; and the least that there is.
const MOST_DAMPING: f64 = 1e12;
const LEAST_DAMPING: f64 = 1e-10;
/// The least where steps are solved for iteratively, which takes the longer, the less of it there is.
const LEAST_DAMPING_ITERATIVE: f64 = 1e-6;
/// A step that promises less than this part of the cost is not worth taking.
const LEAST_GAIN: f64 = 1e-9;
/// The same where steps are solved for iteratively, to a few parts in a hundred; and where all that is wanted is within
/// its tolerance there, so that only smoothness is left to gain.
const LEAST_GAIN_ITERATIVE: f64 = 1e-6;
const LEAST_GAIN_WITHIN: f64 = 1e-2;
/// The same where they are solved for exactly.
const LEAST_GAIN_WITHIN_EXACT: f64 = 1e-6;
/// So many such steps in a row end it, where steps are solved for iteratively and exactly: a first one may be short for its
/// damping alone.
const SLOW_STEPS: [usize; 2] = [2, 5];
/// A step that gains less than this part of what it promised is corrected.
const POOR: f64 = 0.5;
/// A step shorter than this (radians or metres, in every degree of freedom) is not worth taking.
const LEAST_STEP: f64 = 1e-11;

/// How exactly a motion is solved without even spacing before it is with it.
const LEAST_GAIN_UNSPACED: f64 = 1e-4;

impl Run<'_> {
    /// Improves the motion in the state, whose cost is `cost` and which was evaluated last, as if nothing limited
    /// speed and acceleration.
    ///
    /// Even spacing begins from the motion as it is without: its curvature is only bounded, loosely along steps that all
    /// grow together, so that a motion which has still everything to reach would hardly get away.
    pub(super) fn run_unlimited(&mut self, cost: f64, bar: &Bar) -> Outcome {
        if self.state.spacing.weight == 0.0 {
            return self.run_lm(cost, bar, LEAST_GAIN);
        }
        let weight = std::mem::take(&mut self.state.spacing.weight);
        let to_the_end = Bar { cost_below: None, ..*bar };
        let first = self.run_lm(cost, &to_the_end, LEAST_GAIN_UNSPACED);
        self.state.spacing.weight = weight;
        let cost = self.state.evaluate(&self.layout, self.motion);
        if first.stop.is_final() {
            return Outcome::new(cost, first.stop);
        }
        self.budget.next_start();
        self.run_lm(cost, bar, LEAST_GAIN)
    }

    /// Improves the motion in the state, whose cost is `cost` and which was evaluated last, until a step promises
    /// less than a part of it.
    fn run_lm(&mut self, cost: f64, bar: &Bar, least_gain: f64) -> Outcome {
        self.run_lm_from(cost, bar, least_gain, &mut { FIRST_DAMPING })
    }

    /// The same with the damping to begin with, relative to the largest curvature; the last one is left in it.
    pub(super) fn run_lm_from(&mut self, cost: f64, bar: &Bar, least_gain: f64, last: &mut f64) -> Outcome {
        let (layout, motion, state) = (&self.layout, self.motion, &mut self.state);
        let MotionWorkspace { step, accepted, first_try, residual, .. } = &mut *self.workspace;
        let first = cost;
        let mut cost = cost;
        let (mut damping, mut scale) = (0.0, 0.0);
        let mut patience = bar.patience(cost);
        let mut slow = 0;
        'accepted: loop {
            if bar.is_met(cost) {
                return Outcome::new(cost, StopReason::Reached);
            }
            state.linearize(layout, motion);
            if step.begin(layout, state) == 0.0 {
                return Outcome::new(cost, StopReason::Converged);
            }
            if damping == 0.0 {
                scale = step.scale(state);
                damping = *last * scale;
            }
            accepted.copy_from_slice(&state.coords);
            let mut growth = GROWTH;
            loop {
                if let Some(stop) = self.budget.spend(state.sample.memory.failure.is_some()) {
                    state.coords.copy_from_slice(accepted);
                    return Outcome::new(cost, stop);
                }
                if damping > MOST_DAMPING * scale {
                    state.coords.copy_from_slice(accepted);
                    return Outcome::new(cost, StopReason::NoProgress);
                }
                let least = if step.is_iterative(state) { LEAST_DAMPING_ITERATIVE } else { LEAST_DAMPING };
                let damping_now = (damping * (cost / first).sqrt()).max(least * scale);
                *last = damping_now / scale;
                if !step.solve(layout, state, damping_now) {
                    damping *= 10.0;
                    continue;
                }
                let promised = cost - step.predicted_cost(state);
                let longest = step.delta.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
                let gain = promised.abs() / cost;
                let (least, little, n_slow) = if step.is_iterative(state) {
                    (LEAST_GAIN_ITERATIVE.max(least_gain), LEAST_GAIN_WITHIN, SLOW_STEPS[0])
                } else {
                    (least_gain, LEAST_GAIN_WITHIN_EXACT, SLOW_STEPS[1])
                };
                slow = if gain < little { slow + 1 } else { 0 };
                let is_done = gain < least || (slow >= n_slow && state.is_satisfied(layout, motion));
                if longest < LEAST_STEP || is_done {
                    state.coords.copy_from_slice(accepted);
                    return Outcome::new(cost, StopReason::Converged);
                }
                state.step(layout, accepted, &step.delta);
                let mut trial = state.evaluate(layout, motion);
                if cost - trial < POOR * promised && !state.rows.blocks.is_empty() {
                    // Residuals bend away from their linear model: one more solve follows the bend.
                    state.scaled_residuals(layout, motion, residual);
                    first_try.copy_from_slice(&state.coords);
                    step.subtract_model(state, residual);
                    step.correct(layout, state, damping_now, residual);
                    state.step(layout, accepted, &step.delta);
                    let corrected = state.evaluate(layout, motion);
                    if corrected < trial {
                        trial = corrected;
                    } else {
                        state.coords.copy_from_slice(first_try);
                        trial = state.evaluate(layout, motion);
                    }
                }
                if trial < cost {
                    let ratio = (cost - trial) / promised.max(1e-300);
                    damping *= if ratio > 0.75 {
                        0.5
                    } else if ratio < 0.25 {
                        2.0
                    } else {
                        0.8
                    };
                    cost = trial;
                    if patience.is_over(cost) {
                        return Outcome::new(cost, StopReason::NoProgress);
                    }
                    continue 'accepted;
                }
                state.coords.copy_from_slice(accepted);
                damping *= growth;
                growth *= 2.0;
            }
        }
    }
}
