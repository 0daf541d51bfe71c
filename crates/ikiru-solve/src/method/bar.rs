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
}

/// The squared length of a residual that is nothing but rounding (metres², radians²).
const NOTHING: f64 = 1e-24;

impl Bar {
    /// A cost to come below, or none where the tolerances of a problem's terms decide.
    pub(crate) fn new(cost_below: Option<f64>, problem: &Problem, impatient: bool) -> Self {
        // Weights that are all tiny make every cost tiny, whether or not the terms are met.
        let largest = problem.terms().iter().filter(|t| t.is_on).map(|t| t.weight).fold(0.0, f64::max);
        Self { cost_below, nothing: NOTHING * largest.min(1.0), largest_weight: largest.max(1.0), impatient }
    }

    /// Whether the solve may end here. Without `cost_below` only coordinates that meet every term exactly, within
    /// rounding, end it early: otherwise it goes on until it converges.
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
