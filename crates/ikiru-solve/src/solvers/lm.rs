//! Bounded Levenberg–Marquardt: Gauss–Newton on reweighted residuals, damped by the gain ratio, inside the
//! limits at every iterate.

use crate::layout::Layout;
use crate::problem::Problem;
use crate::report::StopReason;
use crate::solvers::search::{Bar, Budget, Outcome};
use crate::solvers::step::StepSolver;
use crate::state::State;

/// First damping, relative to the largest squared column of the Jacobian.
const FIRST_DAMPING: f64 = 0.05;
/// By how much a rejected step makes the damping grow.
const GROWTH: f64 = 4.0;
/// Damping, relative to the same, at which a step is too short to matter.
const MOST_DAMPING: f64 = 1e12;
/// Damping is never smaller than this, relative to the same.
const LEAST_DAMPING: f64 = 1e-12;
/// A step that promises less than this part of the cost is not worth taking.
const LEAST_GAIN: f64 = 1e-12;
/// A step shorter than this (radians or metres, in every degree of freedom) is not worth taking.
const LEAST_STEP: f64 = 1e-11;

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lm {
    pub(crate) step: StepSolver,
    accepted: Vec<f64>,
}

impl Lm {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self { step: StepSolver::new(layout), accepted: vec![0.0; layout.n_kept_coords()] }
    }

    /// Improves the pose in `state`, whose cost is `cost` and which was evaluated last.
    pub(crate) fn run(
        &mut self,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget,
    ) -> Outcome {
        let first = cost;
        let mut cost = cost;
        let (mut damping, mut scale) = (0.0, 0.0);
        let mut patience = bar.patience(cost);
        'accepted: loop {
            if bar.is_met(cost) {
                return Outcome { cost, stop: StopReason::Reached, is_evaluated: true };
            }
            state.linearize(layout, problem, false);
            let gradient = self.step.begin(layout, state);
            if gradient == 0.0 {
                return Outcome { cost, stop: StopReason::Converged, is_evaluated: false };
            }
            if damping == 0.0 {
                scale = self.step.scale(layout, state);
                damping = FIRST_DAMPING * scale;
            }
            self.accepted.copy_from_slice(&state.coords);
            let mut growth = GROWTH;
            loop {
                if let Some(stop) = budget.spend() {
                    state.coords.copy_from_slice(&self.accepted);
                    return Outcome { cost, stop, is_evaluated: false };
                }
                if damping > MOST_DAMPING * scale {
                    state.coords.copy_from_slice(&self.accepted);
                    return Outcome { cost, stop: StopReason::NoProgress, is_evaluated: false };
                }
                // Damping that falls with the residual keeps convergence fast to the end (Fan and Yuan, 2005).
                let damping_now = (damping * (cost / first).sqrt()).max(LEAST_DAMPING * scale);
                if !self.step.solve(layout, state, damping_now) {
                    damping *= 10.0;
                    continue;
                }
                let promised = cost - self.step.predicted_cost(layout, state, problem);
                let longest = self.step.tangent.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
                if longest < LEAST_STEP || promised.abs() < LEAST_GAIN * cost {
                    state.coords.copy_from_slice(&self.accepted);
                    return Outcome { cost, stop: StopReason::Converged, is_evaluated: false };
                }
                state.step(layout, &self.accepted, &self.step.tangent);
                let trial = state.evaluate(layout, problem);
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
                        return Outcome { cost, stop: StopReason::NoProgress, is_evaluated: true };
                    }
                    continue 'accepted;
                }
                state.coords.copy_from_slice(&self.accepted);
                damping *= growth;
                growth *= 2.0;
            }
        }
    }
}
