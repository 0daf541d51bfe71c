//! Bounded Levenberg–Marquardt: Gauss–Newton on reweighted residuals, damped by the gain ratio, inside the
//! limits at every iterate.

use crate::method::{Bar, Budget, Outcome};
use crate::model::{Effort, Model};
use crate::words::StopReason;

/// By how much a rejected step makes the damping grow; by twice as much each time.
const GROWTH: f64 = 4.0;
/// Damping, relative to the largest curvature, at which a step is too short to matter.
const MOST_DAMPING: f64 = 1e12;
/// By how much damping grows where the system cannot be solved with so little.
const MORE_TO_SOLVE: f64 = 10.0;
/// A step that gains more than the first part of what it promised halves the damping, one that gains less than the second
/// doubles it.
const GOOD: f64 = 0.75;
const BAD: f64 = 0.25;
/// A step shorter than this (radians or metres, in every tangent) is not worth taking.
const LEAST_STEP: f64 = 1e-11;
/// How much more a missed hard row costs than the largest multiplier: any more than 1 makes the penalty exact.
const EXACT: f64 = 2.0;
/// How fast that is forgotten: a multiplier may be large on the way alone.
const FORGET: f64 = 0.9;

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lm {
    accepted: Vec<f64>,
    first_try: Vec<f64>,
    /// The best coordinates accepted so far, where there are hard rows: on the way to a lower cost they may be missed a little.
    best: Vec<f64>,
}

impl Lm {
    /// Makes room for so many coordinates.
    pub(crate) fn fit(&mut self, n_coords: usize) {
        for coords in [&mut self.accepted, &mut self.first_try, &mut self.best] {
            coords.resize(n_coords, 0.0);
        }
    }

    /// Improves the coordinates of a model, whose cost is `cost` and which were evaluated last.
    ///
    /// With hard rows the measure of a step is the merit `cost + ν · violation`, which has its least value where they hold
    /// as soon as ν is larger than every multiplier (an exact penalty).
    pub(crate) fn run<M: Model>(
        &mut self,
        model: &mut M,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget<'_>,
        effort: &mut Effort,
    ) -> Outcome {
        let mut best = Outcome::new(cost, model.violation(), StopReason::NoProgress, false);
        let may_miss = model.may_have_forces();
        let mut damping = Damping { now: 0.0, scale: 0.0 };
        let last = if may_miss {
            self.best.copy_from_slice(model.coords());
            self.run_from::<M, true>(model, cost, bar, budget, effort, &mut damping, &mut best)
        } else {
            self.run_from::<M, false>(model, cost, bar, budget, effort, &mut damping, &mut best)
        };
        if damping.scale > 0.0 {
            effort.damping = damping.now / damping.scale;
        }
        if may_miss && best.is_better(&last) {
            model.set_coords(&self.best);
            best.stop = last.stop;
            return best;
        }
        last
    }

    /// The loop; where no row has a force (`FORCES`), nothing of them is asked for.
    fn run_from<M: Model, const FORCES: bool>(
        &mut self,
        model: &mut M,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget<'_>,
        effort: &Effort,
        used: &mut Damping,
        best: &mut Outcome,
    ) -> Outcome {
        let (first, mut cost) = (cost, cost);
        let (mut damping, mut scale) = (0.0, 0.0);
        let mut patience = bar.patience(cost, model.violation());
        let mut hard = Hard::<FORCES>::new(model.violation());
        let mut n_little = 0;
        if FORCES {
            model.forget_forces();
        }
        'accepted: loop {
            if bar.is_met(cost) && (!FORCES || model.holds()) {
                return Outcome::new(cost, hard.violation, StopReason::Reached, true);
            }
            model.linearize();
            let gradient = model.begin();
            let has_forces = FORCES && model.has_forces();
            if gradient == 0.0 && !has_forces {
                return Outcome::new(cost, 0.0, StopReason::Converged, false);
            }
            if damping == 0.0 {
                scale = model.scale();
                (used.scale, damping) = (scale, effort.damping * scale);
            }
            let rules = model.rules();
            self.accepted.copy_from_slice(model.coords());
            let mut growth = GROWTH;
            loop {
                if let Some(stop) = budget.spend(model.has_failed(), cost) {
                    model.set_coords(&self.accepted);
                    return Outcome::new(cost, hard.violation, stop, false);
                }
                if damping > MOST_DAMPING * scale {
                    model.set_coords(&self.accepted);
                    return Outcome::new(cost, hard.violation, StopReason::NoProgress, false);
                }
                // Damping that falls with the residual keeps convergence fast to the end (Fan and Yuan, 2005).
                let damping_now = (damping * (cost / first).sqrt().min(1.0)).max(rules.least_damping * scale);
                used.now = damping_now;
                if has_forces {
                    model.aim(hard.share);
                }
                if !model.solve(damping_now) {
                    damping *= MORE_TO_SOLVE;
                    continue;
                }
                let (promised_cost, promised_violation) = model.promised();
                if has_forces {
                    hard.weigh(model.largest_force());
                }
                let merit = hard.merit(cost, hard.violation);
                let promised = merit - hard.merit(promised_cost, promised_violation);
                let gain = promised.abs();
                n_little = if gain < rules.little_gain * merit { n_little + 1 } else { 0 };
                if model.longest() < LEAST_STEP
                    || gain < rules.least_gain.max(effort.least_gain) * merit
                    || (n_little >= rules.n_little && model.is_satisfied())
                {
                    model.set_coords(&self.accepted);
                    return Outcome::new(cost, hard.violation, StopReason::Converged, false);
                }
                model.advance(&self.accepted);
                let mut trial = model.differentiate();
                if merit - hard.merit(trial, model.violation()) < rules.poor * promised {
                    trial = self.correct(model, damping_now, trial, &hard);
                }
                let trial_merit = hard.merit(trial, model.violation());
                if trial_merit < merit {
                    let ratio = (merit - trial_merit) / promised.max(1e-300);
                    damping *= if ratio > GOOD {
                        0.5
                    } else if ratio < BAD {
                        2.0
                    } else {
                        0.8
                    };
                    cost = trial;
                    hard.accept(model.violation());
                    if has_forces {
                        let found = Outcome::new(cost, hard.violation, best.stop, false);
                        if found.is_better(best) {
                            *best = found;
                            self.best.copy_from_slice(model.coords());
                        }
                    }
                    if patience.is_over(cost, hard.violation) {
                        return Outcome::new(cost, hard.violation, StopReason::NoProgress, true);
                    }
                    continue 'accepted;
                }
                model.set_coords(&self.accepted);
                damping *= growth;
                growth *= 2.0;
                hard.share *= 0.5;
            }
        }
    }

    /// Follows the bend of rows away from their linear model by one more solve, where that leads to better coordinates than
    /// the trial that the model is at; the answer is the cost of the better ones, at which the model is then.
    fn correct<M: Model, const FORCES: bool>(
        &mut self,
        model: &mut M,
        damping: f64,
        trial: f64,
        hard: &Hard<FORCES>,
    ) -> f64 {
        let first = hard.merit(trial, model.violation());
        self.first_try.copy_from_slice(model.coords());
        if first.is_finite() && model.correct(damping) {
            model.advance(&self.accepted);
            let corrected = model.differentiate();
            if hard.merit(corrected, model.violation()) < first {
                return corrected;
            }
            model.set_coords(&self.first_try);
            return model.differentiate();
        }
        trial
    }
}

/// The damping of the last step, and by what it is measured.
#[derive(Clone, Copy, Debug)]
struct Damping {
    now: f64,
    scale: f64,
}

/// What hard rows ask of a step.
#[derive(Clone, Copy, Debug)]
struct Hard<const ANY: bool> {
    /// By how much they are missed now.
    violation: f64,
    /// ν
    weight: f64,
    /// How much of what is missed a step is to make good: all, unless that led nowhere.
    share: f64,
}

impl<const ANY: bool> Hard<ANY> {
    /// What they ask of the first step, missed by so much.
    fn new(violation: f64) -> Self {
        Self { violation, weight: 0.0, share: 1.0 }
    }

    #[inline(always)]
    fn merit(&self, cost: f64, violation: f64) -> f64 {
        if !ANY || violation == 0.0 { cost } else { cost + self.weight * violation }
    }

    /// Takes over the largest force of a step. Forces are half of what the cost would fall by.
    fn weigh(&mut self, largest: f64) {
        self.weight = self.weight.max(2.0 * EXACT * largest);
    }

    #[inline(always)]
    fn accept(&mut self, violation: f64) {
        if !ANY {
            return;
        }
        (self.violation, self.share) = (violation, (2.0 * self.share).min(1.0));
        self.weight *= FORGET;
    }
}
