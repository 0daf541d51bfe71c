//! What came of one start.

use crate::words::StopReason;

/// Hard rows that are missed by less than this in all (metres, radians) count as held when answers are compared.
pub(crate) const HELD: f64 = 1e-6;

/// What came of one start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    /// The cost; infinite where limits on rates do not hold.
    pub(crate) cost: f64,
    /// By how much hard rows are missed.
    pub(crate) violation: f64,
    pub(crate) stop: StopReason,
    /// Whether the model was evaluated last at the coordinates that it has.
    pub(crate) is_evaluated: bool,
}

impl Outcome {
    pub(crate) fn new(cost: f64, violation: f64, stop: StopReason, is_evaluated: bool) -> Self {
        Self { cost, violation, stop, is_evaluated }
    }

    /// Whether it is better than another one: limits on rates come first, then what is hard.
    pub(crate) fn is_better(&self, other: &Self) -> bool {
        let (own, others) = (self.violation.max(HELD), other.violation.max(HELD));
        let comparable = self.cost.is_finite() && other.cost.is_finite();
        if own == others || !comparable { self.cost < other.cost } else { own < others }
    }
}
