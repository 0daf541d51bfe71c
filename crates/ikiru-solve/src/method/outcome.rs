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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_on_rates_come_first_then_what_is_hard_then_the_cost() {
        let of = |cost, violation| Outcome::new(cost, violation, StopReason::Converged, true);
        // The better one, then the worse one.
        for (better, worse) in [
            (of(1.0, 0.0), of(2.0, 0.0)),
            (of(5.0, 0.1), of(1.0, 0.2)),
            (of(5.0, 0.2), of(f64::INFINITY, 0.0)),
            // What is missed by nothing but rounding is held.
            (of(1.0, 0.5 * HELD), of(2.0, 0.0)),
        ] {
            assert!(better.is_better(&worse) && !worse.is_better(&better), "{better:?} {worse:?}");
        }
        let one = of(1.0, 0.1);
        assert!(!one.is_better(&one), "nothing is better than its like");
    }
}
