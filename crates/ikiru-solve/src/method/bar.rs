//! What counts as done, and when a start is given up while others wait.

use crate::problem::Problem;

/// What counts as done.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bar {
    pub(crate) cost_below: Option<f64>,
    /// A cost below this is nothing but rounding.
    pub(crate) nothing: f64,
    /// The largest weight of a term, at least 1: what a metre or radian of a missed hard row counts when starts are chosen.
    pub(crate) largest_weight: f64,
    /// Whether another start waits, so that a slow one is given up.
    pub(crate) impatient: bool,
    /// Whether it is enough that what is wanted is well within its tolerance, or cannot be met.
    pub(crate) settles: bool,
}

/// The squared length of a residual that is nothing but rounding (metres², radians²).
const NOTHING: f64 = 1e-24;

impl Bar {
    /// A cost to come below, or none where the tolerances of a problem's terms decide.
    pub(crate) fn new(cost_below: Option<f64>, problem: &Problem, impatient: bool) -> Self {
        // Weights that are all tiny make every cost tiny, whether or not the terms are met.
        let largest = problem.terms().iter().filter(|t| t.is_on).map(|t| t.weight).fold(0.0, f64::max);
        Self {
            cost_below,
            nothing: NOTHING * largest.min(1.0),
            largest_weight: largest.max(1.0),
            impatient,
            settles: false,
        }
    }

    /// Whether the solve may end here. Without `cost_below` only coordinates that meet every term exactly, within
    /// rounding, end it early: otherwise it goes on until it converges or settles.
    #[inline]
    pub(crate) fn is_met(&self, cost: f64) -> bool {
        match self.cost_below {
            Some(bar) => cost < bar,
            None => cost < self.nothing,
        }
    }

    /// The patience with a start of this cost, whose hard rows are missed by so much.
    pub(crate) fn patience(&self, cost: f64, violation: f64) -> Patience {
        // Where the bar is a cost, each step must bring it a good deal nearer. Where tolerances decide, the
        // cost that a success ends at is not known, so that more steps are given; and more again where constraints are
        // missed, on the way to which the cost may have to rise first.
        let most_steps = match self.cost_below {
            Some(_) => 1,
            None if violation > 0.0 => 8,
            None => 4,
        };
        Patience {
            most_steps,
            impatient: self.impatient,
            last: cost,
            violation,
            steps: 0,
            bar: self.cost_below.unwrap_or(0.0),
        }
    }
}

/// Gives up a start that gets on too slowly while others wait.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    impatient: bool,
    most_steps: usize,
    last: f64,
    violation: f64,
    steps: usize,
    bar: f64,
}

/// The part of the cost above the bar, or of what hard rows miss, that must have gone after each round of steps.
const PATIENCE_GAIN: f64 = 0.1;

impl Patience {
    /// Whether it is over after one more step, to this cost and with hard rows missed by so much: as long as one of them
    /// falls, it gets on.
    #[inline]
    pub(crate) fn is_over(&mut self, cost: f64, violation: f64) -> bool {
        if !self.impatient {
            return false;
        }
        self.steps += 1;
        if self.steps < self.most_steps {
            return false;
        }
        self.steps = 0;
        let slow = cost > self.bar && self.last - cost < PATIENCE_GAIN * (self.last - self.bar);
        let falls = violation < (1.0 - PATIENCE_GAIN) * self.violation;
        (self.last, self.violation) = (cost, violation);
        slow && !falls
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(cost_below: Option<f64>, impatient: bool) -> Bar {
        Bar { cost_below, nothing: 1e-24, largest_weight: 1.0, impatient, settles: false }
    }

    #[test]
    fn a_bar_is_met_below_it_and_not_at_it() {
        for (bar, at) in [(bar(Some(0.5), false), 0.5), (bar(None, false), 1e-24)] {
            assert!(bar.is_met(0.9 * at) && !bar.is_met(at) && !bar.is_met(1.1 * at), "{bar:?}");
        }
    }

    #[test]
    fn a_start_is_given_up_where_neither_cost_nor_violation_falls_enough() {
        // From a cost of 2 with a bar of 1, each step has to gain a tenth of what is above it.
        for (cost, violation, is_over) in [
            (1.89, 1.0, false),
            (1.91, 1.0, true),
            (1.91, 0.89, false),
            (1.91, 0.91, true),
            (1.0, 1.0, false),
        ] {
            let mut patience = bar(Some(1.0), true).patience(2.0, 1.0);
            assert_eq!(patience.is_over(cost, violation), is_over, "{cost} {violation}");
        }
        // At the bar there is nothing left to gain, however slowly it got there.
        let mut patience = bar(Some(1.0), true).patience(1.05, 1.0);
        assert!(!patience.is_over(1.05 - 1e-9, 0.5) && !patience.is_over(1.0, 0.5));
        // Each round is measured from the one before.
        let mut patience = bar(Some(1.0), true).patience(2.0, 1.0);
        assert!(!patience.is_over(1.5, 1.0) && !patience.is_over(1.44, 1.0) && patience.is_over(1.40, 1.0));
    }

    #[test]
    fn where_tolerances_decide_a_round_has_four_steps() {
        let mut patience = bar(None, true).patience(1.0, 0.0);
        assert_eq!([1, 2, 3, 4].map(|_| patience.is_over(1.0, 0.0)), [false, false, false, true]);
        assert_eq!([1, 2, 3, 4].map(|_| patience.is_over(1.0, 0.0)), [false, false, false, true]);
    }

    #[test]
    fn nothing_is_given_up_while_nobody_waits() {
        let mut patience = bar(Some(1.0), false).patience(2.0, 0.0);
        assert!((0..20).all(|_| !patience.is_over(2.0, 0.0)));
    }
}
