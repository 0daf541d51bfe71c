//! The damped Gauss–Newton step of a whole motion inside all limits: [`System`] solved again and again, with what a step
//! would take beyond a limit held at it.

use crate::layout::Layout;
use crate::motion::cones::Cones;
use crate::motion::rows::SampleRows;
use crate::motion::state::MotionState;
use crate::motion::system::{MOST_DIRECT_ROWS, System};

/// How near to a limit counts as on it, in radians or metres.
pub(crate) const ON_LIMIT: f64 = 1e-9;
/// Rounds of finding limits that a step would cross, holding those and solving again.
const MOST_ROUNDS: usize = 4;

/// Memory of the step, and the step itself in `delta`, sample by sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct MotionStep {
    n_samples: usize,
    n_dofs: usize,
    system: System,
    /// Half the gradient of the whole cost.
    pub(crate) gradient: Vec<f64>,
    /// What may move in this iteration, and what is still to be solved for in the current round.
    free: Vec<bool>,
    open: Vec<bool>,
    cones: Cones,
    pub(crate) delta: Vec<f64>,
    /// The rows of the state, and those of cones.
    rows: SampleRows,
    /// The largest curvature of the linearization, which rows of cones are stiff beside.
    stiffness: f64,
    residual: Vec<f64>,
    y: Vec<f64>,
}

impl MotionStep {
    pub(crate) fn new(layout: &Layout, state: &MotionState) -> Self {
        let n = layout.n_dofs * state.n_samples;
        let mut rows = SampleRows::new(layout);
        Self {
            n_samples: state.n_samples,
            n_dofs: layout.n_dofs,
            system: System::new(layout, state),
            gradient: vec![0.0; n],
            free: vec![true; n],
            open: vec![true; n],
            cones: Cones::new(layout, state, &mut rows),
            delta: vec![0.0; n],
            rows,
            ..Self::default()
        }
    }

    /// Takes over a linearization: the gradient, and what limits block. The answer is the largest remaining entry
    /// of the gradient.
    pub(crate) fn begin(&mut self, layout: &Layout, state: &MotionState) -> f64 {
        let (n, nc) = (self.n_dofs, layout.n_coords);
        self.gradient.copy_from_slice(&state.gradient);
        state.rows.add_transposed(&state.rows.residual, &mut self.gradient);
        self.cones.begin(layout, state, &self.gradient);
        self.stiffness = self.scale(state);
        let mut largest = 0.0_f64;
        for t in 0..self.n_samples {
            for k in 0..n {
                let (g, idx) = (self.gradient[t * n + k], t * n + k);
                let x = state.coords[t * nc + layout.coord_of_dof[k]];
                let (down, up) = (layout.lower[k] - x, layout.upper[k] - x);
                let blocked =
                    (down >= -ON_LIMIT && (g > 0.0 || up <= ON_LIMIT)) || (up <= ON_LIMIT && g < 0.0);
                self.free[idx] = !state.is_given[t] && !blocked;
                if self.free[idx] {
                    largest = largest.max(g.abs());
                }
            }
        }
        largest
    }

    /// The largest curvature along one degree of freedom of one sample, by which damping is measured.
    pub(crate) fn scale(&self, state: &MotionState) -> f64 {
        self.system.scale(state)
    }

    /// Whether there are too many rows to solve over.
    pub(crate) fn is_iterative(&self, state: &MotionState) -> bool {
        state.rows.n_rows() > MOST_DIRECT_ROWS
    }

    /// Computes `delta` for a damping. False where the system cannot be solved with so little damping.
    pub(crate) fn solve(&mut self, layout: &Layout, state: &MotionState, damping: f64) -> bool {
        self.open.copy_from_slice(&self.free);
        self.delta.fill(0.0);
        self.cones.open();
        let mut is_held = false;
        for round in 0..MOST_ROUNDS {
            let rows = if self.cones.is_idle() {
                &state.rows
            } else {
                self.cones.gather(state, self.stiffness, &mut self.rows);
                &self.rows
            };
            if !self.system.factor(state, rows, &self.open, damping) {
                return false;
            }
            self.solve_factored(state, damping, &state.rows.residual);
            if round + 1 == MOST_ROUNDS {
                break;
            }
            let ranges = self.hold_crossed(layout, state);
            if !self.cones.hold_crossed(&self.delta) && !ranges {
                break;
            }
            is_held = true;
        }
        self.clamp(layout, state);
        if is_held {
            self.shorten(state);
        }
        true
    }

    /// Solves once more with what was factored last, for other residuals at the same place. With those of a
    /// step, less what the linear model says of it, this is the step that its curvature asks for: along a narrow curved
    /// valley it leads back to the ground (a second-order correction).
    pub(crate) fn correct(&mut self, layout: &Layout, state: &MotionState, damping: f64, residual: &[f64]) {
        self.solve_factored(state, damping, residual);
        self.clamp(layout, state);
    }

    /// Solves for residuals of the state's rows.
    fn solve_factored(&mut self, state: &MotionState, damping: f64, residual: &[f64]) {
        let (rows, residual) = if self.cones.is_idle() {
            (&state.rows, residual)
        } else {
            self.cones.add_residuals(residual, &mut self.residual);
            (&self.rows, &self.residual[..])
        };
        self.system.solve(state, rows, &self.open, damping, residual, &mut self.delta);
    }

    /// `residual -= J delta`
    pub(crate) fn subtract_model(&mut self, state: &MotionState, residual: &mut [f64]) {
        self.delta.iter_mut().for_each(|d| *d = -*d);
        state.rows.add_product(&self.delta, residual);
        self.delta.iter_mut().for_each(|d| *d = -*d);
    }

    /// Holds what the step takes across a range at that range; says whether there was something.
    fn hold_crossed(&mut self, layout: &Layout, state: &MotionState) -> bool {
        let (n, nc) = (self.n_dofs, layout.n_coords);
        let mut crossed = false;
        for t in 0..self.n_samples {
            for k in 0..n {
                let idx = t * n + k;
                if !self.open[idx] {
                    continue;
                }
                let x = state.coords[t * nc + layout.coord_of_dof[k]];
                let inside = self.delta[idx].max(layout.lower[k] - x).min(layout.upper[k] - x);
                if inside != self.delta[idx] {
                    crossed = true;
                    (self.open[idx], self.delta[idx]) = (false, inside);
                }
            }
        }
        crossed
    }

    /// What is still beyond a limit after the last round ends at it.
    fn clamp(&mut self, layout: &Layout, state: &MotionState) {
        let (n, nc) = (self.n_dofs, layout.n_coords);
        self.cones.clamp(&mut self.delta);
        for t in (0..self.n_samples).filter(|t| !state.is_given[*t]) {
            for k in 0..n {
                let x = state.coords[t * nc + layout.coord_of_dof[k]];
                let delta = &mut self.delta[t * n + k];
                *delta = delta.max(layout.lower[k] - x).min(layout.upper[k] - x);
            }
        }
    }

    /// Goes only as far along `delta` as the model falls. What was held on the way to a limit went as far as that limit,
    /// which with others held as well can be too far.
    fn shorten(&mut self, state: &MotionState) {
        let slope: f64 = self.gradient.iter().zip(&self.delta).map(|(g, d)| g * d).sum();
        let mut along = std::mem::take(&mut self.y);
        along.clear();
        along.resize(state.rows.n_rows(), 0.0);
        state.rows.add_product(&self.delta, &mut along);
        let bend = along.iter().map(|a| a * a).sum::<f64>() + self.bend_beside_rows(state);
        self.y = along;
        if slope < 0.0 && bend > -slope {
            let part = -slope / bend;
            self.delta.iter_mut().for_each(|d| *d *= part);
        }
    }

    /// `deltaᵀ H delta` of what is not in the state's rows.
    fn bend_beside_rows(&mut self, state: &MotionState) -> f64 {
        self.system.bend_beside_rows(state, &self.delta) + self.cones.bend_of(&self.delta)
    }

    /// The cost that the linear model promises for `delta`, losses and all.
    pub(crate) fn predicted_cost(&mut self, state: &MotionState) -> f64 {
        self.y.clear();
        self.y.extend_from_slice(&state.rows.residual);
        state.rows.add_product(&self.delta, &mut self.y);
        let mut cost = state.cost_beside_rows;
        for part in state.rows.parts.iter().filter(|part| part.weight > 0.0) {
            let rows = &self.y[part.first..part.first + part.n_rows];
            let square = rows.iter().map(|r| r * r).sum::<f64>() / part.weight;
            cost += part.term_weight * part.loss.cost(square);
        }
        cost += 2.0 * state.gradient.iter().zip(&self.delta).map(|(g, d)| g * d).sum::<f64>();
        cost + self.bend_beside_rows(state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::cases::case;

    #[test]
    fn a_step_stays_inside_all_limits_and_falls() {
        let mut n_held = 0;
        for number in 0..60 {
            let mut case = case(number, number % 3 == 1);
            let (layout, motion) = (&case.layout, &case.motion);
            let cost = case.state.evaluate(layout, motion);
            case.state.linearize(layout, motion);
            let mut step = MotionStep::new(layout, &case.state);
            assert!(step.begin(layout, &case.state) > 0.0);
            for part in [1e-4, 0.05, 10.0] {
                assert!(step.solve(layout, &case.state, part * step.scale(&case.state)));
                let predicted = step.predicted_cost(&case.state);
                assert!(predicted < cost * (1.0 + 1e-12), "case {number}: {predicted} from {cost}");
                let slope: f64 = step.gradient.iter().zip(&step.delta).map(|(g, d)| g * d).sum();
                assert!(slope < 0.0, "case {number}: {slope}");
                for t in 0..case.state.n_samples {
                    for k in 0..layout.n_dofs {
                        let (delta, idx) = (step.delta[t * layout.n_dofs + k], t * layout.n_dofs + k);
                        assert!(!case.state.is_given[t] || delta == 0.0);
                        let x = case.state.coords[t * layout.n_coords + layout.coord_of_dof[k]];
                        let inside = delta.max(layout.lower[k] - x).min(layout.upper[k] - x);
                        assert!((delta - inside).abs() < 1e-12, "case {number}: {delta} at {x}");
                        n_held += usize::from(!step.open[idx] && !case.state.is_given[t]);
                    }
                }
                // Cones are boxes in the tangent spaces of their balls, each at its own sample.
                for m in layout.movers.iter().filter(|m| m.motion.cone().is_some()) {
                    let cone = m.motion.cone().unwrap();
                    for t in (0..case.state.n_samples).filter(|t| !case.state.is_given[*t]) {
                        let at = t * layout.n_coords + m.coord + m.n_coords - 4;
                        let q = glam::DQuat::from_slice(&case.state.coords[at..at + 4]);
                        let limits = cone.tangent_box(q);
                        let dof = t * layout.n_dofs + m.dof + m.n_dofs - 3;
                        let turn = glam::DVec3::from_slice(&step.delta[dof..dof + 3]);
                        for (axis, (down, up)) in limits.axes.iter().zip(limits.room) {
                            let along = axis.dot(turn);
                            assert!(along >= down - 1e-9 && along <= up + 1e-9, "case {number}: {along}");
                        }
                    }
                }
            }
        }
        assert!(n_held > 20, "{n_held}");
    }

    #[test]
    fn small_steps_gain_what_the_model_promises() {
        for number in 0..30 {
            let mut case = case(number, false);
            let (layout, motion) = (&case.layout, &case.motion);
            let cost = case.state.evaluate(layout, motion);
            case.state.linearize(layout, motion);
            let mut step = MotionStep::new(layout, &case.state);
            step.begin(layout, &case.state);
            assert!(step.solve(layout, &case.state, 1e5 * step.scale(&case.state)));
            let promised = cost - step.predicted_cost(&case.state);
            let from = case.state.coords.clone();
            case.state.step(layout, &from, &step.delta);
            let gained = cost - case.state.evaluate(layout, motion);
            assert!((gained - promised).abs() < 0.02 * promised, "case {number}: {gained} of {promised}");
        }
    }
}
