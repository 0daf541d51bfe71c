//! Bounded Levenberg–Marquardt: Gauss–Newton on reweighted residuals, damped by the gain ratio, inside the
//! limits at every iterate.

use crate::method::settling::{Settling, Taken};
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
        let mut best = Outcome::new(cost, missed(model, bar), StopReason::NoProgress, false);
        let may_miss = model.may_have_guards();
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

    /// The loop; where there are no guards (`GUARDS`), nothing of them is asked for.
    fn run_from<M: Model, const GUARDS: bool>(
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
        let mut hard = Hard::<GUARDS>::new(model.violation(), missed(model, bar));
        let mut n_little = 0;
        let mut settling = Settling::default();
        if GUARDS {
            model.forget_guards();
        }
        'accepted: loop {
            if bar.is_met(cost) && (!GUARDS || model.holds()) {
                return Outcome::new(cost, hard.missed, StopReason::Reached, true);
            }
            model.linearize();
            let gradient = model.begin();
            let has_guards = GUARDS && model.has_guards();
            if gradient == 0.0 && !has_guards {
                return Outcome::new(cost, 0.0, StopReason::Converged, false);
            }
            if damping == 0.0 {
                scale = model.scale();
                (used.scale, damping) = (scale, if bar.settles { 1.0 } else { effort.damping * scale });
            }
            let rules = model.rules();
            let settled = if bar.settles {
                let missed = if has_guards { scale * model.hard_square() } else { 0.0 };
                model.remember();
                Settling::damping(cost + missed, scale)
            } else {
                0.0
            };
            let most_damping = if bar.settles { MOST_DAMPING } else { MOST_DAMPING * scale };
            self.accepted.copy_from_slice(model.coords());
            let mut growth = GROWTH;
            loop {
                if let Some(stop) = budget.spend(model.has_failed(), cost) {
                    model.set_coords(&self.accepted);
                    return Outcome::new(cost, hard.missed, stop, false);
                }
                if damping > most_damping {
                    model.set_coords(&self.accepted);
                    return Outcome::new(cost, hard.missed, StopReason::NoProgress, false);
                }
                let damping_now = if bar.settles {
                    damping * settled
                } else {
                    // Damping that falls with the residual keeps convergence fast to the end (Fan and Yuan, 2005).
                    (damping * (cost / first).sqrt().min(1.0)).max(rules.least_damping * scale)
                };
                used.now = damping_now;
                if has_guards {
                    model.aim(hard.share);
                }
                if model.solve(damping_now).is_err() {
                    damping *= MORE_TO_SOLVE;
                    continue;
                }
                let (promised_cost, promised_violation) = model.promised();
                if has_guards {
                    hard.weigh(model.largest_force());
                }
                let merit = hard.merit(cost, hard.violation);
                let promised = merit - hard.merit(promised_cost, promised_violation);
                let least_gain = rules.least_gain.max(effort.least_gain);
                let (mut gain, mut whole) = (promised.abs(), merit);
                let is_stuck = GUARDS && cost > bar.nothing && hard.is_stuck(promised_violation, least_gain);
                if is_stuck {
                    (gain, whole) = ((cost - promised_cost).abs(), cost);
                }
                n_little = if gain < rules.little_gain * whole { n_little + 1 } else { 0 };
                if model.longest() < LEAST_STEP
                    || gain < least_gain * whole
                    || (n_little >= rules.n_little && model.is_satisfied(1.0))
                {
                    model.set_coords(&self.accepted);
                    return Outcome::new(cost, hard.missed, StopReason::Converged, false);
                }
                model.advance(&self.accepted);
                let mut trial = model.differentiate();
                if merit - hard.merit(trial, model.violation()) < rules.poor * promised {
                    trial = self.correct(model, damping_now, trial, &hard);
                }
                let trial_merit = hard.merit(trial, model.violation());
                if trial_merit < merit {
                    let ratio = (merit - trial_merit) / promised.max(1e-300);
                    // A frame's damping is small to begin with: what grew on the way is taken back, and no more.
                    let least = if bar.settles { 1.0 } else { 0.0 };
                    let is_short = damping > least && damping_now > scale;
                    damping *= if ratio > GOOD {
                        0.5
                    } else if ratio < BAD {
                        2.0
                    } else {
                        0.8
                    };
                    damping = damping.max(least);
                    let before = cost;
                    cost = trial;
                    hard.accept(model.violation(), missed(model, bar));
                    if has_guards {
                        let found = Outcome::new(cost, hard.missed, best.stop, false);
                        if found.is_better(best) {
                            *best = found;
                            self.best.copy_from_slice(model.coords());
                        }
                    }
                    let taken = if is_stuck {
                        Taken { before, promised: promised_cost, now: trial, is_short }
                    } else {
                        Taken { before: merit, promised: merit - promised, now: trial_merit, is_short }
                    };
                    if bar.settles && settling.is_over(model, taken) {
                        return Outcome::new(cost, hard.missed, StopReason::Converged, true);
                    }
                    if patience.is_over(cost, hard.violation) {
                        return Outcome::new(cost, hard.missed, StopReason::NoProgress, true);
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
    fn correct<M: Model, const GUARDS: bool>(
        &mut self,
        model: &mut M,
        damping: f64,
        trial: f64,
        hard: &Hard<GUARDS>,
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

/// By how much hard rows are missed when answers are compared, as of the last evaluation.
fn missed<M: Model>(model: &M, bar: &Bar) -> f64 {
    if bar.settles && model.holds() { 0.0 } else { model.violation() }
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
    /// By how much when answers are compared: not at all where it is enough that they are within their tolerances, and they are.
    missed: f64,
    /// ν
    weight: f64,
    /// How much of what is missed a step is to make good: all, unless that led nowhere.
    share: f64,
}

impl<const ANY: bool> Hard<ANY> {
    /// What they ask of the first step, missed by so much.
    fn new(violation: f64, missed: f64) -> Self {
        Self { violation, missed, weight: 0.0, share: 1.0 }
    }

    #[inline(always)]
    fn merit(&self, cost: f64, violation: f64) -> f64 {
        if !ANY || violation == 0.0 { cost } else { cost + self.weight * violation }
    }

    /// Whether what they miss changes by no more than a part of it. Where they contradict each other that is nearly all of
    /// the merit, beside which a wish that has not settled yet would count for nothing.
    fn is_stuck(&self, promised_violation: f64, part: f64) -> bool {
        (self.violation - promised_violation).abs() <= part * self.violation
    }

    /// Takes over the largest force of a step. Forces are half of what the cost would fall by.
    fn weigh(&mut self, largest: f64) {
        self.weight = self.weight.max(2.0 * EXACT * largest);
    }

    #[inline(always)]
    fn accept(&mut self, violation: f64, missed: f64) {
        if !ANY {
            return;
        }
        (self.violation, self.missed, self.share) = (violation, missed, (2.0 * self.share).min(1.0));
        self.weight *= FORGET;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::SolverOptions;
    use crate::model::cases::Line;
    use crate::words::Watch;

    /// What comes of a model in so many iterations, and the damping that is left, relative to the curvature.
    fn run(model: &mut Line, cost_below: Option<f64>, max_iterations: usize) -> (Outcome, f64) {
        let (mut lm, watch) = (Lm::default(), Watch::new());
        lm.fit(1);
        let cost = model.evaluate();
        let bar = Bar { cost_below, nothing: 0.0, largest_weight: 1.0, impatient: false, settles: false };
        let options = SolverOptions { max_iterations, ..SolverOptions::default() };
        let (mut budget, mut effort) = (Budget::new(&options, &watch), Effort::FULL);
        let outcome = lm.run(model, cost, &bar, &mut budget, &mut effort);
        (outcome, effort.damping)
    }

    #[test]
    fn it_goes_on_until_the_bar_is_met() {
        let mut model = Line::new(|x| 10.0 - x);
        let (outcome, _) = run(&mut model, Some(6.5), 100);
        assert_eq!((outcome.stop, outcome.cost, model.x), (StopReason::Reached, 6.0, [4.0]));
    }

    #[test]
    fn a_step_that_does_not_lower_the_cost_is_not_taken() {
        let mut model = Line::new(|_| 1.0);
        model.promise_of = |_| 0.5;
        let (outcome, damping) = run(&mut model, None, 100);
        assert_eq!((outcome.stop, outcome.cost, model.x), (StopReason::NoProgress, 1.0, [0.0]));
        assert!(damping > 1e6 && model.dampings.windows(2).all(|d| d[1] > d[0]), "{damping}");
    }

    #[test]
    fn nothing_is_begun_without_a_gradient_nor_gone_on_with_for_less_than_is_worth_it() {
        let mut model = Line::new(|x| 10.0 - x);
        model.gradient = 0.0;
        assert_eq!((run(&mut model, None, 9).0.stop, model.x), (StopReason::Converged, [0.0]));
        // A gain of 0.05 is less than a thousandth of 100, and more than a thousandth of 10.
        for (cost_of, wanted) in [
            ((|x| 100.0 - 0.05 * x) as fn(f64) -> f64, StopReason::Converged),
            (|x| 10.0 - 0.05 * x, StopReason::IterationLimit),
        ] {
            let mut model = Line::new(cost_of);
            model.rules.least_gain = 1e-3;
            assert_eq!(run(&mut model, None, 9).0.stop, wanted);
        }
    }

    #[test]
    fn little_gains_in_a_row_end_it_only_where_all_that_is_wanted_is_there() {
        for (is_satisfied, little_gain, wanted) in [
            (true, 1e-2, StopReason::Converged),
            (false, 1e-2, StopReason::IterationLimit),
            (true, 1e-6, StopReason::IterationLimit),
        ] {
            let mut model = Line::new(|x| 10.0 - 0.01 * x);
            model.is_satisfied = is_satisfied;
            (model.rules.little_gain, model.rules.n_little) = (little_gain, 3);
            assert_eq!(run(&mut model, None, 9).0.stop, wanted);
            // The third of them is not taken.
            assert!(wanted != StopReason::Converged || model.x == [2.0], "{:?}", model.x);
        }
    }

    #[test]
    fn damping_follows_what_steps_gain_of_what_they_promised_and_falls_with_the_cost() {
        // The first step leads from 1 to 0.81, whose root is 0.9, and gains all, half or a fifth of what it promised.
        for (promise_of, factor) in
            [((|_| 0.81) as fn(f64) -> f64, 0.5), (|_| 1.0 - 0.38, 0.8), (|_| 1.0 - 0.95, 2.0)]
        {
            let mut model = Line::new(|x| if x == 0.0 { 1.0 } else { 0.81 });
            model.promise_of = promise_of;
            run(&mut model, None, 2);
            let wanted = [2.0 * Effort::FIRST_DAMPING, 2.0 * Effort::FIRST_DAMPING * factor * 0.9];
            assert!(model.dampings.len() == 2, "{:?}", model.dampings);
            assert!(
                (model.dampings[1] - wanted[1]).abs() < 1e-12 && model.dampings[0] == wanted[0],
                "{factor}"
            );
        }
    }

    #[test]
    fn a_poor_step_is_corrected_only_where_that_leads_lower() {
        // The trial at 1 costs 0.9; what the correction leads to costs more, as much, or less.
        for (corrected, wanted) in [(2.0, 1.0), (3.0, 1.0), (4.0, 4.0)] {
            let mut model = Line::new(|x| [1.0, 0.9, 0.95, 0.9, 0.8][x as usize]);
            model.promise_of = |_| 0.1;
            model.rules.poor = 0.5;
            model.corrected = Some(corrected);
            let (outcome, _) = run(&mut model, None, 1);
            assert_eq!((model.x, outcome.cost), ([wanted], (model.cost_of)(wanted)));
        }
        // One that gains enough is not.
        let mut model = Line::new(|x| [1.0, 0.9, 0.95, 0.9, 0.8][x as usize]);
        (model.rules.poor, model.corrected) = (0.5, Some(4.0));
        run(&mut model, None, 1);
        assert_eq!(model.x, [1.0]);
    }

    #[test]
    fn what_is_hard_costs_more_than_any_wish_and_less_of_it_is_asked_for_where_that_led_nowhere() {
        // A force of 1 makes a missed metre cost 4: the wish gains 1 with each step, and misses half a metre more.
        let mut model = Line::new(|x| 10.0 - x);
        (model.has_guards, model.violation_of) = (true, |x| 0.5 * x);
        let (outcome, _) = run(&mut model, None, 4);
        assert_eq!((model.x, outcome.violation), ([0.0], 0.0));
        assert_eq!(model.shares, [1.0, 0.5, 0.25, 0.125]);
        // What makes good what is missed is worth a cost.
        let mut model = Line::new(|x| 10.0 + x);
        (model.has_guards, model.violation_of) = (true, |x: f64| (3.0 - x).max(0.0));
        let (outcome, _) = run(&mut model, None, 3);
        assert_eq!((model.x, outcome.violation), ([3.0], 0.0));
        assert_eq!(model.shares, [1.0; 3]);
    }

    #[test]
    fn where_what_is_missed_falls_no_more_a_gain_is_measured_by_the_cost() {
        // A thousandth of what is missed counts 40, of the cost 0.01.
        for (cost_of, wanted) in [
            ((|x| 10.0 - x) as fn(f64) -> f64, StopReason::IterationLimit),
            (|x| 10.0 - 1e-3 * x, StopReason::Converged),
            (|_| 0.0, StopReason::Converged),
        ] {
            for violation_of in [(|_| 1e4) as fn(f64) -> f64, |x| 1e4 + 1e-6 * x] {
                let mut model = Line::new(cost_of);
                (model.has_guards, model.violation_of, model.rules.least_gain) = (true, violation_of, 1e-3);
                assert_eq!(run(&mut model, None, 4).0.stop, wanted);
            }
        }
    }

    #[test]
    fn a_measure_of_hard_rows_forgets_what_was_on_the_way_alone() {
        let mut hard = Hard::<true>::new(0.5, 0.5);
        assert_eq!(hard.merit(3.0, 0.5), 3.0);
        hard.weigh(2.0);
        hard.weigh(1.0);
        assert_eq!((hard.merit(3.0, 0.5), hard.merit(3.0, 0.0)), (3.0 + 4.0 * EXACT * 0.5, 3.0));
        hard.share = 0.25;
        hard.accept(0.25, 0.25);
        assert_eq!((hard.violation, hard.share, hard.weight), (0.25, 0.5, 4.0 * EXACT * FORGET));
        // Where there are none, the cost is the measure.
        assert_eq!(Hard::<false>::new(0.5, 0.5).merit(3.0, 0.5), 3.0);
    }
}
