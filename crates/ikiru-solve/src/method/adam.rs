//! The paper's cautious Adam (equations 8 to 15), as its authors run it: gradients of the whole cost, clipped to the
//! limits, the best of the clipped iterates kept.

use crate::method::AdamOptions;
use crate::method::{Bar, Budget, Outcome};
use crate::model::Model;
use crate::words::StopReason;

/// The weight of the squares of what hard rows miss: this method knows no constraints.
const HARD_WEIGHT: f64 = 1e3;

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
    /// Makes room for so many coordinates and tangents.
    pub(crate) fn fit(&mut self, n_coords: usize, n_tangents: usize) {
        for coords in [&mut self.from, &mut self.best] {
            coords.resize(n_coords, 0.0);
        }
        let Moments { mean, square, .. } = &mut self.moments;
        for tangents in [&mut self.gradient, &mut self.delta, mean, square] {
            tangents.resize(n_tangents, 0.0);
        }
    }

    /// Improves the coordinates of a model, whose cost is `cost` and which were evaluated last.
    pub(crate) fn run<M: Model>(
        &mut self,
        options: &AdamOptions,
        model: &mut M,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget<'_>,
    ) -> Outcome {
        let merit = |cost: f64, model: &M| cost + HARD_WEIGHT * model.hard_square();
        let mut best = Outcome::new(cost, model.violation(), StopReason::Converged, false);
        let (mut cost, mut least) = (cost, merit(cost, model));
        let (_, n_moving) = model.n_tangents();
        self.moments.clear();
        self.best.copy_from_slice(model.coords());
        best.stop = loop {
            if bar.is_met(cost) && model.holds() {
                break StopReason::Reached;
            }
            if let Some(stop) = budget.spend(model.has_failed(), best.cost) {
                break stop;
            }
            model.linearize();
            model.gradient(HARD_WEIGHT, &mut self.gradient);
            if self.gradient.iter().all(|g| *g == 0.0) {
                break StopReason::Converged;
            }
            self.moments.step(options, &self.gradient, n_moving, &mut self.delta);
            self.from.copy_from_slice(model.coords());
            model.advance_by(&self.from, &self.delta);
            cost = model.differentiate();
            let now = merit(cost, model);
            if now < least {
                least = now;
                (best.cost, best.violation) = (cost, model.violation());
                self.best.copy_from_slice(model.coords());
            }
        };
        model.set_coords(&self.best);
        best
    }
}

/// The moving averages of a start, and the step that they give (equations 8 to 13).
#[derive(Clone, Debug, Default)]
struct Moments {
    mean: Vec<f64>,
    square: Vec<f64>,
    power1: f64,
    power2: f64,
}

impl Moments {
    /// Forgets the start before.
    fn clear(&mut self) {
        self.mean.fill(0.0);
        self.square.fill(0.0);
        (self.power1, self.power2) = (1.0, 1.0);
    }

    /// The step for a gradient of which `n_moving` entries belong to what may move.
    fn step(&mut self, options: &AdamOptions, gradient: &[f64], n_moving: usize, delta: &mut [f64]) {
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
