//! What options must be.

use crate::method::{Method, SolverOptions};
use crate::report::invalid::InvalidOptions;

/// Whether options can be solved by.
pub(super) fn check_options(options: &SolverOptions) -> Result<(), InvalidOptions> {
    if options.cost_below.is_some_and(|c| !c.is_finite()) {
        return Err(InvalidOptions::CostBelow);
    }
    if let Method::Adam(a) = options.method {
        let rates = [a.beta1, a.beta2].iter().all(|b| (0.0..1.0).contains(b));
        if !(a.rate.is_finite() && a.rate > 0.0 && a.epsilon.is_finite() && a.epsilon > 0.0 && rates) {
            return Err(InvalidOptions::Adam);
        }
    }
    Ok(())
}
