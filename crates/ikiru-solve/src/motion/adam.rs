//! The paper's cautious Adam over all samples of a trajectory at once.

use crate::layout::Layout;
use crate::motion::planner::Outcome;
use crate::motion::problem::MotionProblem;
use crate::motion::state::MotionState;
use crate::options::AdamOptions;
use crate::report::StopReason;
use crate::solvers::adam::{HARD_WEIGHT, Moments};
use crate::solvers::search::{Bar, Budget};

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct MotionAdam {
    moments: Moments,
    gradient: Vec<f64>,
    delta: Vec<f64>,
    best: Vec<f64>,
    from: Vec<f64>,
}

impl MotionAdam {
    pub(crate) fn new(layout: &Layout, state: &MotionState) -> Self {
        let zeros = vec![0.0; layout.n_dofs * state.n_samples];
        Self {
            moments: Moments::new(zeros.len()),
            gradient: zeros.clone(),
            delta: zeros,
            best: state.coords.clone(),
            from: state.coords.clone(),
        }
    }

    /// Improves the motion in `state`, whose cost is `cost` and which was evaluated last.
    pub(crate) fn run(
        &mut self,
        options: &AdamOptions,
        layout: &Layout,
        motion: &MotionProblem,
        state: &mut MotionState,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget,
    ) -> Outcome {
        let n = layout.n_dofs;
        let merit = |cost: f64, state: &MotionState| cost + HARD_WEIGHT * state.hard_square;
        let mut best = Outcome::new(cost, state.violation, StopReason::Converged);
        let (mut cost, mut least) = (cost, merit(cost, state));
        self.moments.clear();
        self.best.copy_from_slice(&state.coords);
        let n_moving = n * state.is_given.iter().filter(|given| !**given).count();
        best.stop = loop {
            if bar.is_met(cost) && state.holds(layout, motion) {
                break StopReason::Reached;
            }
            if let Some(stop) = budget.spend(state.sample.memory.failure.is_some()) {
                break stop;
            }
            state.linearize(layout, motion);
            self.gradient.copy_from_slice(&state.gradient);
            state.rows.add_transposed(&state.rows.residual, &mut self.gradient);
            state.guards.add_half_gradient(HARD_WEIGHT, &mut self.gradient);
            for (t, given) in state.is_given.iter().enumerate() {
                let of_sample = &mut self.gradient[t * n..(t + 1) * n];
                if *given {
                    of_sample.fill(0.0);
                }
                of_sample.iter_mut().for_each(|g| *g *= 2.0);
            }
            if self.gradient.iter().all(|g| *g == 0.0) {
                break StopReason::Converged;
            }
            self.moments.step(options, &self.gradient, n_moving, &mut self.delta);
            self.from.copy_from_slice(&state.coords);
            state.step(layout, &self.from, &self.delta);
            cost = state.evaluate(layout, motion);
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
