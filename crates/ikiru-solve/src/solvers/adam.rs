//! The paper's cautious Adam (equations 8 to 15), as its authors run it: gradients of the whole cost, clipped to the
//! limits, the best of the clipped iterates kept.

use crate::gradient::whole_gradient;
use crate::layout::Layout;
use crate::options::AdamOptions;
use crate::problem::Problem;
use crate::report::StopReason;
use crate::solvers::search::{Bar, Budget, Outcome};
use crate::state::State;

/// The moving averages of a start, and the step that they give (equations 8 to 13): of poses and of motions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Moments {
    mean: Vec<f64>,
    square: Vec<f64>,
    power1: f64,
    power2: f64,
}

impl Moments {
    pub(crate) fn new(n: usize) -> Self {
        Self { mean: vec![0.0; n], square: vec![0.0; n], power1: 1.0, power2: 1.0 }
    }

    /// Forgets the start before.
    pub(crate) fn clear(&mut self) {
        self.mean.fill(0.0);
        self.square.fill(0.0);
        (self.power1, self.power2) = (1.0, 1.0);
    }

    /// The step for a gradient of which `n_moving` entries belong to what may move.
    pub(crate) fn step(
        &mut self,
        options: &AdamOptions,
        gradient: &[f64],
        n_moving: usize,
        delta: &mut [f64],
    ) {
        self.power1 *= options.beta1;
        self.power2 *= options.beta2;
        let mut n_agreeing = 0;
        for (k, g) in gradient.iter().enumerate() {
            self.mean[k] = options.beta1 * self.mean[k] + (1.0 - options.beta1) * g; // equation 8
            self.square[k] = options.beta2 * self.square[k] + (1.0 - options.beta2) * g * g; // equation 9
            n_agreeing += usize::from(self.mean[k] * g > 0.0);
        }
        // Equation 13, its mean bounded from below by 1e-3 as the authors have it; no second factor α.
        let mask = 1.0 / (n_agreeing as f64 / n_moving.max(1) as f64).max(1e-3);
        for (k, g) in gradient.iter().enumerate() {
            let mean = self.mean[k] / (1.0 - self.power1); // equation 10
            let square = self.square[k] / (1.0 - self.power2); // equation 11
            let cautious = if self.mean[k] * g > 0.0 { mean * mask } else { 0.0 };
            delta[k] = -options.rate * cautious / (square.sqrt() + options.epsilon); // equation 12
        }
    }
}

/// The weight of the squares of what hard rows miss: this method knows no constraints.
pub(crate) const HARD_WEIGHT: f64 = 1e3;

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct Adam {
    moments: Moments,
    gradient: Vec<f64>,
    delta: Vec<f64>,
    from: Vec<f64>,
    best: Vec<f64>,
}

impl Adam {
    pub(crate) fn new(layout: &Layout) -> Self {
        let n = layout.n_dofs;
        Self {
            moments: Moments::new(n),
            gradient: vec![0.0; n],
            delta: vec![0.0; n],
            from: vec![0.0; layout.n_kept_coords()],
            best: vec![0.0; layout.n_kept_coords()],
        }
    }

    /// Improves the pose in `state`, whose cost is `cost` and which was evaluated last.
    pub(crate) fn run(
        &mut self,
        options: &AdamOptions,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget,
    ) -> Outcome {
        let n = layout.n_dofs;
        let merit = |cost: f64, state: &State| cost + HARD_WEIGHT * state.hard_square(layout, problem);
        let mut best = Outcome::new(cost, state.violation, StopReason::Converged, false);
        let (mut cost, mut least) = (cost, merit(cost, state));
        self.moments.clear();
        self.best.copy_from_slice(&state.coords);
        best.stop = loop {
            if bar.is_met(cost) && state.holds(layout, problem) {
                break StopReason::Reached;
            }
            if let Some(stop) = budget.spend(state.memory.failure.is_some()) {
                break stop;
            }
            state.linearize(layout, problem, false);
            whole_gradient(layout, state, HARD_WEIGHT, &mut self.gradient);
            if n == 0 || self.gradient.iter().all(|g| *g == 0.0) {
                break StopReason::Converged;
            }
            self.moments.step(options, &self.gradient, n, &mut self.delta);
            self.from.copy_from_slice(&state.coords);
            state.step(layout, &self.from, &self.delta);
            cost = state.differentiate(layout, problem);
            let now = merit(cost, state);
            if now < least {
                least = now;
                (best.cost, best.violation) = (cost, state.violation);
                self.best.copy_from_slice(&state.coords);
            }
        };
        state.coords.copy_from_slice(&self.best);
        best
    }
}
