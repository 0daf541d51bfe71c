//! Bounded Levenberg–Marquardt over all samples of a motion at once: the method of poses (`solvers/lm.rs`), with a
//! correction for curved valleys.

use crate::motion::planner::{MotionWorkspace, Outcome, Run};
use crate::report::StopReason;
use crate::solvers::lm::{Hard, POOR as POOR_FORCES};
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
            return Outcome::new(cost, self.state.violation, first.stop);
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
        let MotionWorkspace { step, accepted, first_try, residual, guards, .. } = &mut *self.workspace;
        let (first, mut cost) = (cost, cost);
        let (mut damping, mut scale) = (0.0, 0.0);
        let mut patience = bar.patience(cost, 0.0);
        let mut slow = 0;
        let mut hard = Hard::new(state.violation);
        step.acting.forget();
        'accepted: loop {
            if bar.is_met(cost) && state.holds(layout, motion) {
                return Outcome::new(cost, hard.violation, StopReason::Reached);
            }
            state.linearize(layout, motion);
            let has_forces = !state.guards.is_empty();
            if step.begin(layout, state) == 0.0 && !has_forces {
                return Outcome::new(cost, 0.0, StopReason::Converged);
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
                    return Outcome::new(cost, hard.violation, stop);
                }
                if damping > MOST_DAMPING * scale {
                    state.coords.copy_from_slice(accepted);
                    return Outcome::new(cost, hard.violation, StopReason::NoProgress);
                }
                let least = if step.is_iterative(state) { LEAST_DAMPING_ITERATIVE } else { LEAST_DAMPING };
                let damping_now = (damping * (cost / first).sqrt().min(1.0)).max(least * scale);
                *last = damping_now / scale;
                step.acting.aim(&state.guards, hard.share);
                if !step.solve(layout, state, damping_now) {
                    damping *= 10.0;
                    continue;
                }
                let (promised_cost, promised_violation) = step.predicted(state);
                hard.weigh(step.acting.largest_hard(&state.guards));
                let merit = hard.merit(cost, hard.violation);
                let promised = merit - hard.merit(promised_cost, promised_violation);
                let longest = step.delta.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
                let gain = promised.abs() / merit;
                let (least, little, n_slow) = if step.is_iterative(state) {
                    (LEAST_GAIN_ITERATIVE.max(least_gain), LEAST_GAIN_WITHIN, SLOW_STEPS[0])
                } else {
                    (least_gain, LEAST_GAIN_WITHIN_EXACT, SLOW_STEPS[1])
                };
                slow = if gain < little { slow + 1 } else { 0 };
                let is_done = gain < least || (slow >= n_slow && state.is_satisfied(layout, motion));
                if longest < LEAST_STEP || is_done {
                    state.coords.copy_from_slice(accepted);
                    return Outcome::new(cost, hard.violation, StopReason::Converged);
                }
                state.step(layout, accepted, &step.delta);
                let mut trial = state.evaluate(layout, motion);
                let gained = merit - hard.merit(trial, state.violation);
                let is_poor = gained < if has_forces { POOR_FORCES } else { POOR } * promised;
                if is_poor && (has_forces || !state.rows.blocks.is_empty()) {
                    // Residuals bend away from their linear model: one more solve follows the bend.
                    let before = hard.merit(trial, state.violation);
                    state.scaled_residuals(layout, motion, residual, guards);
                    first_try.copy_from_slice(&state.coords);
                    step.subtract_model(state, residual);
                    step.correct(layout, state, damping_now, residual, guards);
                    state.step(layout, accepted, &step.delta);
                    let corrected = state.evaluate(layout, motion);
                    if hard.merit(corrected, state.violation) < before {
                        trial = corrected;
                    } else {
                        state.coords.copy_from_slice(first_try);
                        trial = state.evaluate(layout, motion);
                    }
                }
                let trial_merit = hard.merit(trial, state.violation);
                if trial_merit < merit {
                    let ratio = (merit - trial_merit) / promised.max(1e-300);
                    damping *= if ratio > 0.75 {
                        0.5
                    } else if ratio < 0.25 {
                        2.0
                    } else {
                        0.8
                    };
                    cost = trial;
                    hard.accept(state.violation);
                    if patience.is_over(hard.merit(cost, hard.violation)) {
                        return Outcome::new(cost, hard.violation, StopReason::NoProgress);
                    }
                    continue 'accepted;
                }
                state.coords.copy_from_slice(accepted);
                damping *= growth;
                growth *= 2.0;
                hard.share *= 0.5;
            }
        }
    }
}
