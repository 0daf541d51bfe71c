//! The paper's cautious Adam over all frames of a trajectory at once.

use crate::motion::problem::MotionProblem;
use crate::motion::state::MotionState;
use crate::options::AdamOptions;
use crate::plan::Plan;
use crate::report::StopReason;
use crate::solvers::search::{Bar, Budget};

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct MotionAdam {
    mean: Vec<f64>,
    square: Vec<f64>,
    gradient: Vec<f64>,
    delta: Vec<f64>,
    best: Vec<f64>,
    from: Vec<f64>,
}

impl MotionAdam {
    pub(crate) fn new(plan: &Plan, state: &MotionState) -> Self {
        let zeros = vec![0.0; plan.n_dofs * state.n_frames];
        Self {
            mean: zeros.clone(),
            square: zeros.clone(),
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
        plan: &Plan,
        motion: &MotionProblem,
        state: &mut MotionState,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget,
    ) -> (f64, StopReason) {
        let n = plan.n_dofs;
        let (mut best, mut cost) = (cost, cost);
        self.mean.fill(0.0);
        self.square.fill(0.0);
        self.best.copy_from_slice(&state.coords);
        let n_moving = n * state.is_given.iter().filter(|given| !**given).count();
        let (mut power1, mut power2) = (1.0, 1.0);
        let stop = loop {
            if bar.is_met(cost) {
                break StopReason::Reached;
            }
            if let Some(stop) = budget.spend() {
                break stop;
            }
            state.linearize(plan, motion);
            self.gradient.copy_from_slice(&state.gradient);
            state.rows.add_transposed(&state.rows.residual, &mut self.gradient);
            for (t, given) in state.is_given.iter().enumerate() {
                let of_frame = &mut self.gradient[t * n..(t + 1) * n];
                if *given {
                    of_frame.fill(0.0);
                }
                of_frame.iter_mut().for_each(|g| *g *= 2.0);
            }
            if self.gradient.iter().all(|g| *g == 0.0) {
                break StopReason::Converged;
            }
            power1 *= options.beta1;
            power2 *= options.beta2;
            let mut n_agreeing = 0;
            for (i, g) in self.gradient.iter().enumerate() {
                self.mean[i] = options.beta1 * self.mean[i] + (1.0 - options.beta1) * g; // equation 8
                self.square[i] = options.beta2 * self.square[i] + (1.0 - options.beta2) * g * g; // equation 9
                n_agreeing += usize::from(self.mean[i] * g > 0.0);
            }
            // Equation 13, as for poses.
            let mask = 1.0 / (n_agreeing as f64 / n_moving.max(1) as f64).max(1e-3);
            for (i, g) in self.gradient.iter().enumerate() {
                let mean = self.mean[i] / (1.0 - power1); // equation 10
                let square = self.square[i] / (1.0 - power2); // equation 11
                let cautious = if self.mean[i] * g > 0.0 { mean * mask } else { 0.0 };
                self.delta[i] = -options.rate * cautious / (square.sqrt() + options.epsilon); // equation 12
            }
            self.from.copy_from_slice(&state.coords);
            state.step(plan, &self.from, &self.delta);
            cost = state.evaluate(plan, motion);
            if cost < best {
                best = cost;
                self.best.copy_from_slice(&state.coords);
            }
        };
        state.coords.copy_from_slice(&self.best);
        (best, stop)
    }
}
