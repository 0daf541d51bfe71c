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
/// A step that gains less than this part of what it promised is corrected, where there are rows with a force.
pub(crate) const POOR: f64 = 0.75;
/// How much more a missed hard row costs than the largest multiplier, and how fast a multiplier is forgotten.
const EXACT: f64 = 2.0;
const FORGET: f64 = 0.9;
/// The largest force of a hard row, in units of the largest squared column of the Jacobian times a metre or radian.
const MOST_FORCE: f64 = 1e5;
/// A step shorter than this (radians or metres, in every degree of freedom) is not worth taking.
const LEAST_STEP: f64 = 1e-11;

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lm {
    pub(crate) step: StepSolver,
    accepted: Vec<f64>,
    first_try: Vec<f64>,
    /// The best pose accepted so far, where there are hard rows: on the way to a lower cost they may be missed a little.
    best: Vec<f64>,
}

impl Lm {
    pub(crate) fn new(layout: &Layout) -> Self {
        let zeros = vec![0.0; layout.n_kept_coords()];
        Self { step: StepSolver::new(layout), accepted: zeros.clone(), first_try: zeros.clone(), best: zeros }
    }

    /// Improves the pose in `state`, whose cost is `cost` and which was evaluated last.
    ///
    /// With hard rows the measure of a step is the merit `cost + ν · violation`, which has its least value where they hold
    /// as soon as ν is larger than every multiplier (an exact penalty).
    pub(crate) fn run(
        &mut self,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget,
    ) -> Outcome {
        let mut best = Outcome::new(cost, state.violation, StopReason::NoProgress, false);
        if layout.n_force_rows > 0 {
            self.best.copy_from_slice(&state.coords);
        }
        let last = self.run_from(layout, problem, state, cost, bar, budget, &mut best);
        if layout.n_force_rows > 0 && best.is_better(&last) {
            state.coords.copy_from_slice(&self.best);
            best.stop = last.stop;
            return best;
        }
        last
    }

    fn run_from(
        &mut self,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget,
        best: &mut Outcome,
    ) -> Outcome {
        let (first, mut cost) = (cost, cost);
        let (mut damping, mut scale) = (0.0, 0.0);
        let mut patience = bar.patience(cost, state.violation);
        let has_forces = layout.n_force_rows > 0;
        let mut hard = Hard::new(state.violation);
        if has_forces {
            self.step.forces.forget();
        }
        'accepted: loop {
            if bar.is_met(cost) && (!has_forces || state.holds(layout, problem)) {
                return Outcome::new(cost, hard.violation, StopReason::Reached, true);
            }
            state.linearize(layout, problem, false);
            let gradient = self.step.begin(layout, state, problem);
            if gradient == 0.0 && !has_forces {
                return Outcome::new(cost, 0.0, StopReason::Converged, false);
            }
            if damping == 0.0 {
                scale = self.step.scale(layout, state);
                damping = FIRST_DAMPING * scale;
                self.step.forces.most = MOST_FORCE * scale;
            }
            self.accepted.copy_from_slice(&state.coords);
            let mut growth = GROWTH;
            loop {
                if let Some(stop) = budget.spend(state.memory.failure.is_some()) {
                    state.coords.copy_from_slice(&self.accepted);
                    return Outcome::new(cost, hard.violation, stop, false);
                }
                if damping > MOST_DAMPING * scale {
                    state.coords.copy_from_slice(&self.accepted);
                    return Outcome::new(cost, hard.violation, StopReason::NoProgress, false);
                }
                // Damping that falls with the residual keeps convergence fast to the end (Fan and Yuan, 2005).
                let damping_now = (damping * (cost / first).sqrt().min(1.0)).max(LEAST_DAMPING * scale);
                if has_forces {
                    self.step.forces.aim(hard.share);
                }
                if !self.step.solve(layout, state, damping_now) {
                    damping *= 10.0;
                    continue;
                }
                let (promised_cost, promised_violation) = self.step.predicted(layout, state, problem);
                if has_forces {
                    hard.weigh(self.step.forces.largest_hard());
                }
                let merit = hard.merit(cost, hard.violation);
                let promised = merit - hard.merit(promised_cost, promised_violation);
                let longest = self.step.tangent.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
                if longest < LEAST_STEP || promised.abs() < LEAST_GAIN * merit {
                    state.coords.copy_from_slice(&self.accepted);
                    return Outcome::new(cost, hard.violation, StopReason::Converged, false);
                }
                state.step(layout, &self.accepted, &self.step.tangent);
                let mut trial = state.differentiate(layout, problem);
                if has_forces && merit - hard.merit(trial, state.violation) < POOR * promised {
                    trial = self.correct(layout, problem, state, damping_now, trial, &hard);
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
                    if has_forces {
                        let found = Outcome::new(cost, hard.violation, best.stop, false);
                        if found.is_better(best) {
                            *best = found;
                            self.best.copy_from_slice(&state.coords);
                        }
                    }
                    if patience.is_over_with(cost, hard.violation) {
                        return Outcome::new(cost, hard.violation, StopReason::NoProgress, true);
                    }
                    continue 'accepted;
                }
                state.coords.copy_from_slice(&self.accepted);
                damping *= growth;
                growth *= 2.0;
                hard.share *= 0.5;
            }
        }
    }

    /// Follows the bend of rows away from their linear model by one more solve, where that leads to a better pose than the
    /// trial in `state`; the answer is the cost of the better one, which is in `state` then.
    fn correct(
        &mut self,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        damping: f64,
        trial: f64,
        hard: &Hard,
    ) -> f64 {
        let first = hard.merit(trial, state.violation);
        self.first_try.copy_from_slice(&state.coords);
        if first.is_finite() && self.step.correct(layout, state, damping) {
            state.step(layout, &self.accepted, &self.step.tangent);
            let corrected = state.differentiate(layout, problem);
            if hard.merit(corrected, state.violation) < first {
                return corrected;
            }
            state.coords.copy_from_slice(&self.first_try);
            return state.differentiate(layout, problem);
        }
        trial
    }
}

/// What hard rows ask of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hard {
    /// By how much they are missed now.
    pub(crate) violation: f64,
    /// ν
    weight: f64,
    /// How much of what is missed a step is to make good: all, unless that led nowhere.
    pub(crate) share: f64,
}

impl Hard {
    /// What they ask of the first step, missed by so much.
    pub(crate) fn new(violation: f64) -> Self {
        Self { violation, weight: 0.0, share: 1.0 }
    }

    #[inline(always)]
    pub(crate) fn merit(&self, cost: f64, violation: f64) -> f64 {
        if violation == 0.0 { cost } else { cost + self.weight * violation }
    }

    /// Takes over the largest force of a step. Forces are half of what the cost would fall by.
    pub(crate) fn weigh(&mut self, largest: f64) {
        self.weight = self.weight.max(2.0 * EXACT * largest);
    }

    #[inline(always)]
    pub(crate) fn accept(&mut self, violation: f64) {
        (self.violation, self.share) = (violation, (2.0 * self.share).min(1.0));
        self.weight *= FORGET;
    }
}
