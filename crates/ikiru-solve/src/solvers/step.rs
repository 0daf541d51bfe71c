//! The damped Gauss–Newton step inside the limits: a small dense system over residual rows.
//!
//! With rows `J δ + r` and a diagonal `D = damping + curvature of the terms that read motions`, the step
//! minimises `‖J δ + r‖² + δᵀ D δ + 2 gᵀ δ`. There are far fewer rows than degrees of freedom, and a row sees
//! only the joints above it, so the system is solved over rows:
//! `(J D⁻¹ Jᵀ + I) y = r − J D⁻¹ g`, `δ = −D⁻¹ (g + Jᵀ y)`, here multiplied through by the damping, which keeps
//! it well scaled as the damping goes to zero.

use crate::plan::Plan;
use crate::state::State;

/// How near to a limit counts as on it, in radians or metres.
const ON_LIMIT: f64 = 1e-9;

/// Rounds of finding limits that a step would cross, fixing those and solving again.
const MOST_ROUNDS: usize = 4;

#[derive(Clone, Debug, Default)]
pub(crate) struct StepSolver {
    /// The Jacobian with the directions that limits block taken out of balls.
    jacobian: Vec<f64>,
    /// Half the gradient of the whole cost by each degree of freedom.
    pub(crate) gradient: Vec<f64>,
    /// Half the gradient of the terms that read motions, blocked directions taken out.
    motion_gradient: Vec<f64>,
    /// Whether a degree of freedom may move at all in this iteration, by the sign of its multiplier.
    free: Vec<bool>,
    /// Whether it is still to be solved for, in the current round.
    open: Vec<bool>,
    /// `J Jᵀ` over the free degrees of freedom, lower triangle.
    gram: Vec<f64>,
    gram_is_current: bool,
    /// Damping over `D`, for each degree of freedom.
    inverse: Vec<f64>,
    system: Vec<f64>,
    factor: Vec<f64>,
    residual: Vec<f64>,
    y: Vec<f64>,
    /// The step.
    pub(crate) delta: Vec<f64>,
}

impl StepSolver {
    pub(crate) fn new(plan: &Plan) -> Self {
        let (n, m) = (plan.n_dofs, plan.n_rows);
        Self {
            jacobian: vec![0.0; plan.n_jacobian],
            gradient: vec![0.0; n],
            motion_gradient: vec![0.0; n],
            free: vec![true; n],
            open: vec![true; n],
            gram: vec![0.0; m * m],
            gram_is_current: false,
            inverse: vec![1.0; n],
            system: vec![0.0; m * m],
            factor: vec![0.0; m * m],
            residual: vec![0.0; m],
            y: vec![0.0; m],
            delta: vec![0.0; n],
        }
    }

    /// Takes over a linearization: the gradient, and what the limits block. The answer is the largest
    /// remaining entry of the gradient.
    pub(crate) fn begin(&mut self, plan: &Plan, state: &State) -> f64 {
        for k in 0..plan.n_dofs {
            let span = plan.spans[k];
            let column = &state.jacobian[span.start..span.start + span.len];
            let rows = &state.scaled[span.first..span.first + span.len];
            let mut sum = state.motion_gradient[k];
            for (a, b) in column.iter().zip(rows) {
                sum += a * b;
            }
            self.gradient[k] = sum;
        }
        self.free.fill(true);
        self.gram_is_current = false;
        for m in &plan.movers {
            for (i, range) in m.motion.ranges().iter().enumerate() {
                let (x, g) = (state.coords[m.coord + i], self.gradient[m.dof + i]);
                let fixed = range.min == range.max;
                self.free[m.dof + i] =
                    !(fixed || (x <= range.min + ON_LIMIT && g > 0.0) || (x >= range.max - ON_LIMIT && g < 0.0));
            }
        }
        if plan.has_cones {
            self.jacobian.copy_from_slice(&state.jacobian);
            self.motion_gradient.copy_from_slice(&state.motion_gradient);
            self.block_cones(plan, state);
        }
        (0..plan.n_dofs).filter(|k| self.free[*k]).map(|k| self.gradient[k].abs()).fold(0.0, f64::max)
    }

    /// Takes the outward normals of cones that the descent pushes against out of the Jacobian and gradient.
    fn block_cones(&mut self, plan: &Plan, state: &State) {
        for m in &plan.movers {
            let Some(cone) = m.motion.cone() else { continue };
            let at = m.dof + m.n_dofs - 3;
            let coord = m.coord + m.n_coords - 4;
            let q = glam::DQuat::from_slice(&state.coords[coord..coord + 4]);
            let mut taken: [Option<glam::DVec3>; 3] = [None; 3];
            // Twice: a limit that was not pushed against may be, once the first one is taken out.
            for _ in 0..2 {
                for (slot, normal) in cone.normals(q, ON_LIMIT).into_iter().enumerate() {
                    let Some(normal) = normal.filter(|_| taken[slot].is_none()) else { continue };
                    let g = glam::DVec3::from_slice(&self.gradient[at..at + 3]);
                    if !(normal.both_ways || g.dot(normal.direction) < 0.0) {
                        continue;
                    }
                    // Perpendicular to those taken before, so that all of them stay out.
                    let mut n = normal.direction;
                    for other in taken.iter().flatten() {
                        n -= *other * n.dot(*other);
                    }
                    let Some(n) = n.try_normalize() else { continue };
                    taken[slot] = Some(n);
                    self.take_out(plan, at, n);
                }
            }
        }
    }

    fn take_out(&mut self, plan: &Plan, at: usize, n: glam::DVec3) {
        let remove = |v: &mut [f64]| {
            let along = n.dot(glam::DVec3::from_slice(v));
            for i in 0..3 {
                v[i] -= along * n[i];
            }
        };
        remove(&mut self.gradient[at..at + 3]);
        remove(&mut self.motion_gradient[at..at + 3]);
        let span = plan.spans[at];
        for row in 0..span.len {
            let index = |k: usize| plan.spans[at + k].start + row;
            let mut entry = [self.jacobian[index(0)], self.jacobian[index(1)], self.jacobian[index(2)]];
            remove(&mut entry);
            for (k, e) in entry.into_iter().enumerate() {
                self.jacobian[index(k)] = e;
            }
        }
    }

    /// The largest squared length of a column, by which the first damping is chosen.
    pub(crate) fn scale(&self, plan: &Plan, state: &State) -> f64 {
        let mut largest = 0.0_f64;
        for k in 0..plan.n_dofs {
            let span = plan.spans[k];
            let column = &state.jacobian[span.start..span.start + span.len];
            let mut square = state.motion_curvature[k];
            for a in column {
                square += a * a;
            }
            largest = largest.max(square);
        }
        largest
    }

    /// Computes `delta` for a damping. False where the system cannot be solved with so little damping.
    pub(crate) fn solve(&mut self, plan: &Plan, state: &State, damping: f64) -> bool {
        let mut jacobian = std::mem::take(&mut self.jacobian);
        let ok = if plan.has_cones {
            self.solve_with(plan, state, &jacobian, damping)
        } else {
            self.solve_with(plan, state, &state.jacobian, damping)
        };
        std::mem::swap(&mut self.jacobian, &mut jacobian);
        ok
    }

    fn solve_with(&mut self, plan: &Plan, state: &State, jacobian: &[f64], damping: f64) -> bool {
        let m = plan.n_rows;
        self.open.copy_from_slice(&self.free);
        self.residual.copy_from_slice(&state.scaled);
        self.delta.fill(0.0);
        if plan.has_motions {
            for k in 0..plan.n_dofs {
                self.inverse[k] = damping / (damping + state.motion_curvature[k]);
            }
            self.gram_is_current = false;
        }
        if !self.gram_is_current {
            self.gram.fill(0.0);
            for k in 0..plan.n_dofs {
                if self.free[k] {
                    add_outer(&mut self.gram, m, plan, jacobian, k, self.inverse[k]);
                }
            }
            self.gram_is_current = true;
        }
        self.system.copy_from_slice(&self.gram);
        for round in 0..MOST_ROUNDS {
            if !self.solve_open(plan, state, jacobian, damping) {
                return false;
            }
            if round + 1 == MOST_ROUNDS || !self.fix_crossed(plan, state, jacobian) {
                break;
            }
        }
        // What is still beyond a range after the last round ends at it.
        for mover in &plan.movers {
            for (i, range) in mover.motion.ranges().iter().enumerate() {
                let x = state.coords[mover.coord + i];
                let delta = &mut self.delta[mover.dof + i];
                *delta = range.clamp(x + *delta) - x;
            }
        }
        true
    }

    /// Solves for the open degrees of freedom; the others keep their `delta`.
    fn solve_open(&mut self, plan: &Plan, state: &State, jacobian: &[f64], damping: f64) -> bool {
        let m = plan.n_rows;
        self.factor.copy_from_slice(&self.system);
        for i in 0..m {
            self.factor[i * m + i] += damping;
        }
        self.y.copy_from_slice(&self.residual);
        let motion_gradient = if plan.has_cones { &self.motion_gradient } else { &state.motion_gradient };
        if plan.has_motions {
            for k in (0..plan.n_dofs).filter(|k| self.open[*k]) {
                let (span, f) = (plan.spans[k], self.inverse[k] * motion_gradient[k] / damping);
                for (y, j) in self.y[span.first..span.first + span.len].iter_mut().zip(&jacobian[span.start..]) {
                    *y -= f * j;
                }
            }
        }
        if !solve_cholesky(&mut self.factor, m, &mut self.y) {
            return false;
        }
        for k in 0..plan.n_dofs {
            if self.open[k] {
                let span = plan.spans[k];
                let column = &jacobian[span.start..span.start + span.len];
                let mut sum = if plan.has_motions { motion_gradient[k] / damping } else { 0.0 };
                for (j, y) in column.iter().zip(&self.y[span.first..span.first + span.len]) {
                    sum += j * y;
                }
                self.delta[k] = -self.inverse[k] * sum;
            }
        }
        true
    }

    /// Fixes the degrees of freedom whose step crosses a range at that range; says whether there was one.
    fn fix_crossed(&mut self, plan: &Plan, state: &State, jacobian: &[f64]) -> bool {
        let mut crossed = false;
        for mover in &plan.movers {
            for (i, range) in mover.motion.ranges().iter().enumerate() {
                let (k, x) = (mover.dof + i, state.coords[mover.coord + i]);
                let inside = range.clamp(x + self.delta[k]);
                if !self.open[k] || inside == x + self.delta[k] {
                    continue;
                }
                crossed = true;
                self.open[k] = false;
                self.delta[k] = inside - x;
                add_outer(&mut self.system, plan.n_rows, plan, jacobian, k, -self.inverse[k]);
                let span = plan.spans[k];
                let rows = &mut self.residual[span.first..span.first + span.len];
                for (r, j) in rows.iter_mut().zip(&jacobian[span.start..]) {
                    *r += j * (inside - x);
                }
            }
        }
        crossed
    }

    /// The cost that the linear model promises for `delta`, losses and all.
    pub(crate) fn predicted_cost(&mut self, plan: &Plan, state: &State, problem: &crate::Problem) -> f64 {
        self.y.copy_from_slice(&state.scaled);
        let mut motion_change = 0.0;
        for k in 0..plan.n_dofs {
            let (span, d) = (plan.spans[k], self.delta[k]);
            for (y, j) in self.y[span.first..span.first + span.len].iter_mut().zip(&state.jacobian[span.start..]) {
                *y += d * j;
            }
            motion_change += d * (2.0 * state.motion_gradient[k] + d * state.motion_curvature[k]);
        }
        let mut cost = motion_change;
        for t in &plan.terms {
            let term = &problem.terms()[t.term];
            let loss = term.objective.loss();
            let mut row = t.rows.start;
            for part in t.parts.clone() {
                if t.has_motion_part && part + 1 == t.parts.end {
                    cost += term.weight * loss.cost(state.squares[part]);
                    continue;
                }
                let rows = &self.y[row..row + plan.parts[part].n_rows];
                row += rows.len();
                if state.weights[part] > 0.0 {
                    let square = rows.iter().map(|r| r * r).sum::<f64>() / state.weights[part];
                    cost += term.weight * loss.cost(square);
                }
            }
        }
        cost
    }
}

/// `matrix += factor · j_k j_kᵀ`, lower triangle.
#[inline(always)]
fn add_outer(matrix: &mut [f64], m: usize, plan: &Plan, jacobian: &[f64], k: usize, factor: f64) {
    let span = plan.spans[k];
    let column = &jacobian[span.start..span.start + span.len];
    for i in 0..span.len {
        let f = factor * column[i];
        let at = (span.first + i) * m + span.first;
        for (a, j) in matrix[at..at + i + 1].iter_mut().zip(column) {
            *a += f * j;
        }
    }
}

/// Solves `A x = b` for a positive definite matrix given by its lower triangle, which becomes its factor;
/// `x` holds `b` at first. False where the matrix is not positive definite.
#[inline(always)]
fn solve_cholesky(a: &mut [f64], m: usize, x: &mut [f64]) -> bool {
    for i in 0..m {
        for j in 0..i {
            let mut sum = a[i * m + j];
            for k in 0..j {
                sum -= a[i * m + k] * a[j * m + k];
            }
            a[i * m + j] = sum * a[j * m + j];
        }
        let mut sum = a[i * m + i];
        let diagonal = sum;
        for k in 0..i {
            sum -= a[i * m + k] * a[i * m + k];
        }
        if sum.is_nan() || sum <= diagonal * 1e-15 {
            return false;
        }
        // The reciprocal of the factor's diagonal, so that nothing below divides.
        a[i * m + i] = 1.0 / sum.sqrt();
    }
    for i in 0..m {
        let mut sum = x[i];
        for k in 0..i {
            sum -= a[i * m + k] * x[k];
        }
        x[i] = sum * a[i * m + i];
    }
    for i in (0..m).rev() {
        let mut sum = x[i];
        for k in i + 1..m {
            sum -= a[k * m + i] * x[k];
        }
        x[i] = sum * a[i * m + i];
    }
    true
}

#[cfg(test)]
mod tests {
    use super::solve_cholesky;

    #[test]
    fn cholesky_solves_and_refuses() {
        let a = [4.0, 0.0, 0.0, 2.0, 5.0, 0.0, -1.0, 0.5, 3.0];
        let x = [1.0, -2.0, 0.25];
        let full = |i: usize, j: usize| if i >= j { a[i * 3 + j] } else { a[j * 3 + i] };
        let mut b = [0, 1, 2].map(|i| (0..3).map(|j| full(i, j) * x[j]).sum::<f64>());
        assert!(solve_cholesky(&mut a.clone(), 3, &mut b));
        for i in 0..3 {
            assert!((b[i] - x[i]).abs() < 1e-14);
        }
        assert!(!solve_cholesky(&mut [1.0, 0.0, 2.0, 1.0], 2, &mut [1.0, 1.0]));
        assert!(!solve_cholesky(&mut [f64::NAN], 1, &mut [1.0]));
    }
}
