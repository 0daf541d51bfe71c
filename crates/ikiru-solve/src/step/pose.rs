//! The damped Gauss–Newton step inside the limits: a small dense system over residual rows.
//!
//! With rows `J δ + r` and a diagonal `D = damping + curvature of the joint rows`, the step
//! minimises `‖J δ + r‖² + δᵀ D δ + 2 gᵀ δ`. There are far fewer rows than degrees of freedom, and a row sees
//! only the joints above it, so the system is solved over rows:
//! `(J D⁻¹ Jᵀ + I) y = r − J D⁻¹ g`, `δ = −D⁻¹ (g + Jᵀ y)`, here multiplied through by the damping, which keeps
//! it well scaled as the damping goes to zero. Where there are many more rows than degrees of freedom, the same step is
//! solved for over those.

use glam::{DMat3, DVec3};
use ikiru_rig::TangentBox;

use crate::algebra::branched::Branched;
use crate::algebra::cholesky::NotPositiveDefinite;
use crate::algebra::rows::{Columns, Dense, OpenStep, Sparse, StepSystem, SystemMemory};
use crate::layout::{Layout, PartLayout, Place};
use crate::problem::Problem;
use crate::state::State;
use crate::step::active::{Room, inside, is_blocked};
use crate::step::ball::{Ball, Blocked};
use crate::step::pose_guards::{Held, PoseGuards};

/// Rounds of finding limits that a step would cross, fixing those and solving again.
const MOST_ROUNDS: usize = 4;

/// Memory of the step, and the step itself in `delta`.
#[derive(Clone, Debug, Default)]
pub(crate) struct StepSolver {
    /// The Jacobian by the axes of [`boxes`](Self::boxes), where there are cones.
    jacobian: Vec<f64>,
    /// The balls with cones, and for each the axes along which its limits lie.
    balls: Vec<Ball>,
    boxes: Vec<TangentBox>,
    /// Half the gradient of the whole cost by each degree of freedom.
    gradient: Vec<f64>,
    /// Half the gradient and the curvature of the joint rows, by the same axes; the curvature of
    /// limits that hold the pose back is added.
    own_gradient: Vec<f64>,
    curvature: Vec<f64>,
    /// What those rows cost at the linearization: trials overwrite it in the state.
    own_cost: f64,
    /// How far each degree of freedom may move down (not positive) and up (not negative).
    room: Vec<Room>,
    /// Whether a degree of freedom may move at all in this iteration, by the sign of its multiplier.
    free: Vec<bool>,
    /// Whether it is still to be solved for, in the current round.
    open: Vec<bool>,
    /// Damping over `D`, for each degree of freedom.
    inverse: Vec<f64>,
    memory: SystemMemory,
    pub(crate) guards: PoseGuards,
    /// Residuals of the base's rows that a corrected step is solved for.
    corrected: Vec<f64>,
    residual: Vec<f64>,
    y: Vec<f64>,
    /// Memory over guards.
    along: Vec<f64>,
    /// The step, by the axes of the boxes.
    delta: Vec<f64>,
    /// The step as a tangent.
    pub(crate) tangent: Vec<f64>,
}

/// Runs one expression with the system of the layout's shape.
macro_rules! with_rows {
    ($layout:expr, $jacobian:expr, $memory:expr, $rows:ident => $body:expr) => {
        match ($layout.dense_rows, &$layout.paths) {
            (Some(3), _) => {
                let $rows = Dense::<3>::new($jacobian);
                $body
            }
            (Some(6), _) => {
                let $rows = Dense::<6>::new($jacobian);
                $body
            }
            (Some(9), _) => {
                let $rows = Dense::<9>::new($jacobian);
                $body
            }
            (Some(_), _) => {
                let $rows = Dense::<12>::new($jacobian);
                $body
            }
            (None, Some(paths)) => {
                let $rows = Branched::new($layout, paths, $jacobian, $memory);
                $body
            }
            (None, None) => {
                let $rows = Sparse::new($layout, $jacobian, $memory);
                $body
            }
        }
    };
}

impl StepSolver {
    pub(crate) fn new(layout: &Layout) -> Self {
        let (n, m) = (layout.n_dofs, layout.n_rows);
        let balls: Vec<Ball> = Ball::all(layout).collect();
        Self {
            jacobian: vec![0.0; layout.n_jacobian],
            gradient: vec![0.0; n],
            boxes: Vec::with_capacity(balls.len()),
            balls,
            own_gradient: vec![0.0; n],
            curvature: vec![0.0; n],
            own_cost: 0.0,
            room: vec![(0.0, 0.0); n],
            free: vec![true; n],
            open: vec![true; n],
            inverse: vec![1.0; n],
            memory: SystemMemory::new(layout),
            guards: PoseGuards::new(layout),
            corrected: vec![0.0; if layout.n_guards > 0 { m } else { 0 }],
            residual: vec![0.0; m],
            y: vec![0.0; m],
            along: Vec::with_capacity(layout.n_guards),
            delta: vec![0.0; n],
            tangent: vec![0.0; n],
        }
    }

    /// Takes over a linearization: the gradient, and what the limits block. The answer is the largest
    /// remaining entry of the gradient, less what the forces do that are known from the step before.
    pub(crate) fn begin(&mut self, layout: &Layout, state: &State, problem: &Problem) -> f64 {
        for (k, room) in self.room.iter_mut().enumerate() {
            let x = state.coords[layout.coord_of_dof[k]];
            *room = (layout.lower[k] - x, layout.upper[k] - x);
        }
        if layout.has_own || layout.has_cones {
            self.own_gradient.copy_from_slice(&state.own_gradient);
            self.curvature.copy_from_slice(&state.own_curvature);
        }
        if layout.has_own {
            self.own_cost = own_cost(layout, state, problem);
        }
        if !self.guards.is_empty() {
            self.guards.begin(layout, state, problem);
        }
        if layout.has_cones {
            self.jacobian.copy_from_slice(&state.jacobian);
            self.turn_to_limits(layout, state);
        }
        let blocked = std::mem::take(&mut self.jacobian);
        let mut memory = std::mem::take(&mut self.memory);
        let jacobian = if layout.has_cones { &blocked } else { &state.jacobian };
        let largest = with_rows!(layout, jacobian, &mut memory, rows => self.begin_rows(layout, state, rows));
        (self.jacobian, self.memory) = (blocked, memory);
        for (ball, limits) in self.balls.iter().zip(&self.boxes) {
            let at = ball.dof;
            let gradient = [self.gradient[at], self.gradient[at + 1], self.gradient[at + 2]];
            let curvature = &mut self.curvature[at..at + 3];
            curvature.iter_mut().zip(Blocked::of(limits, gradient).bends).for_each(|(c, bend)| *c += bend);
        }
        largest
    }

    #[inline(always)]
    fn begin_rows(&mut self, layout: &Layout, state: &State, mut rows: impl StepSystem) -> f64 {
        rows.begin();
        let n = layout.n_dofs;
        let (gradient, room, free) = (&mut self.gradient[..n], &self.room[..n], &mut self.free[..n]);
        let mut largest = 0.0_f64;
        for k in 0..n {
            gradient[k] = self.own_gradient[k] + rows.dot(k, &state.scaled);
        }
        if !self.guards.is_empty() {
            self.guards.acting.balance(&self.guards.guards.rows, gradient);
        }
        for k in 0..n {
            let g = gradient[k];
            let blocked = is_blocked(room[k], g);
            if !blocked {
                largest = largest.max(g.abs());
            }
            free[k] = !blocked;
        }
        largest
    }

    /// Turns each ball's three directions to the axes of its cone, so that its limits too are ranges.
    fn turn_to_limits(&mut self, layout: &Layout, state: &State) {
        self.boxes.clear();
        for ball in &self.balls {
            let (at, limits) = (ball.dof, ball.limits(&state.coords));
            self.room[at..at + 3].copy_from_slice(&limits.room);
            let into_box = basis(&limits).transpose();
            let turn = |v: &mut [f64]| {
                let turned = into_box * DVec3::from_slice(v);
                v[..3].copy_from_slice(&turned.to_array());
            };
            turn(&mut self.own_gradient[at..at + 3]);
            let span = layout.spans[at];
            for row in 0..span.len {
                let index = |k: usize| layout.spans[at + k].start + row;
                let mut entry = [self.jacobian[index(0)], self.jacobian[index(1)], self.jacobian[index(2)]];
                turn(&mut entry);
                for (k, e) in entry.into_iter().enumerate() {
                    self.jacobian[index(k)] = e;
                }
            }
            for row in self.guards.guards.rows.jacobian.chunks_exact_mut(layout.n_dofs) {
                turn(&mut row[at..at + 3]);
            }
            self.boxes.push(limits);
        }
    }

    /// The largest squared length of a column, by which damping is measured, and how large the forces of guards may be.
    #[inline(always)]
    pub(crate) fn scale(&mut self, layout: &Layout, state: &State) -> f64 {
        let mut largest = state.largest_curvature(layout);
        if largest == 0.0 {
            // Nothing but guards: any base will do that is of their size.
            largest = state.guard_jacobian.iter().map(|a| a * a).fold(0.0, f64::max);
        }
        self.guards.acting.bound_force(largest);
        largest
    }

    /// Computes `delta` for a damping. An error where the system cannot be solved with so little damping.
    pub(crate) fn solve(
        &mut self,
        layout: &Layout,
        state: &State,
        damping: f64,
    ) -> Result<(), NotPositiveDefinite> {
        self.solve_for(layout, state, &state.scaled[..layout.n_rows], damping)
    }

    /// Solves once more at the same place, for the residuals at the trial that the last step led to, less what the linear
    /// model says of them: the step that their curvature asks for (a second-order correction).
    pub(crate) fn correct(&mut self, layout: &Layout, state: &State, damping: f64) -> bool {
        let mut corrected = std::mem::take(&mut self.corrected);
        self.y.fill(0.0);
        let mut memory = std::mem::take(&mut self.memory);
        let jacobian = if layout.has_cones { &self.jacobian } else { &state.jacobian };
        with_rows!(layout, jacobian, &mut memory, rows => {
            for (k, d) in self.delta.iter().enumerate() {
                rows.add_column(k, *d, &mut self.y);
            }
        });
        self.memory = memory;
        corrected.fill(0.0);
        for (idx, part) in layout.parts.iter().enumerate().filter(|(_, part)| part.place == Place::Step) {
            let scale = state.weights[idx].sqrt();
            for row in part.row..part.row + part.n_rows {
                corrected[row] = scale * state.residual[row] - self.y[row];
            }
        }
        self.guards.aim_from(layout, state, &self.delta);
        let solved = self.solve_for(layout, state, &corrected, damping);
        self.corrected = corrected;
        solved.is_ok()
    }

    fn solve_for(
        &mut self,
        layout: &Layout,
        state: &State,
        residual: &[f64],
        damping: f64,
    ) -> Result<(), NotPositiveDefinite> {
        let blocked = std::mem::take(&mut self.jacobian);
        let mut memory = std::mem::take(&mut self.memory);
        let jacobian = if layout.has_cones { &blocked } else { &state.jacobian };
        let solved = with_rows!(layout, jacobian, &mut memory, rows => self.solve_rows(layout, residual, rows, damping));
        (self.jacobian, self.memory) = (blocked, memory);
        solved
    }

    #[inline(always)]
    fn solve_rows(
        &mut self,
        layout: &Layout,
        residual: &[f64],
        mut rows: impl StepSystem,
        damping: f64,
    ) -> Result<(), NotPositiveDefinite> {
        let n = layout.n_dofs;
        self.open.copy_from_slice(&self.free);
        self.residual.copy_from_slice(residual);
        self.delta.fill(0.0);
        rows.clear();
        let has_curvature = layout.has_own || layout.has_cones;
        let (inverse, free) = (&mut self.inverse[..n], &self.free[..n]);
        for k in 0..n {
            if has_curvature {
                inverse[k] = damping / (damping + self.curvature[k]);
            }
            if free[k] {
                rows.open(k, inverse[k]);
            }
        }
        if !self.guards.is_empty() {
            let mut held = Held {
                open: &mut self.open,
                room: &self.room,
                inverse: &self.inverse,
                own: layout.has_own.then_some(&self.own_gradient[..n]),
                damping,
                residual: &mut self.residual,
                y: &mut self.y,
                delta: &mut self.delta,
            };
            let solved = self.guards.solve(&mut rows, &mut held);
            self.write_tangent();
            return solved;
        }
        for round in 0..MOST_ROUNDS {
            self.solve_open(layout, &mut rows, damping)?;
            if round + 1 == MOST_ROUNDS || !self.fix_crossed(layout, &mut rows) {
                break;
            }
        }
        // What is still beyond a range after the last round ends at it.
        for (delta, room) in self.delta.iter_mut().zip(&self.room) {
            *delta = inside(*room, *delta);
        }
        self.write_tangent();
        Ok(())
    }

    /// The step as a tangent, from that by the axes of the boxes.
    #[inline(always)]
    fn write_tangent(&mut self) {
        self.tangent.copy_from_slice(&self.delta);
        for (ball, limits) in self.balls.iter().zip(&self.boxes) {
            let turn = ball.dof..ball.dof + 3;
            let turned = basis(limits) * DVec3::from_slice(&self.delta[turn.clone()]);
            self.tangent[turn].copy_from_slice(&turned.to_array());
        }
    }

    /// Solves for the open degrees of freedom; the others keep their `delta`.
    #[inline(always)]
    fn solve_open(
        &mut self,
        layout: &Layout,
        rows: &mut impl StepSystem,
        damping: f64,
    ) -> Result<(), NotPositiveDefinite> {
        let n = layout.n_dofs;
        let own = layout.has_own.then_some(&self.own_gradient[..n]);
        let (open, inverse, residual) = (&self.open[..n], &self.inverse[..n], &self.residual[..]);
        let step = OpenStep { open, inverse, own, damping, residual };
        rows.solve_open(&step, &mut self.y, &mut self.delta)
    }

    /// Fixes the degrees of freedom whose step crosses a range at that range; says whether there was one.
    #[inline(always)]
    fn fix_crossed(&mut self, layout: &Layout, rows: &mut impl StepSystem) -> bool {
        let n = layout.n_dofs;
        let (open, delta, room) = (&mut self.open[..n], &mut self.delta[..n], &self.room[..n]);
        let mut crossed = false;
        for k in 0..n {
            let inside = inside(room[k], delta[k]);
            if open[k] && inside != delta[k] {
                crossed = true;
                (open[k], delta[k]) = (false, inside);
                rows.close(k, self.inverse[k]);
                rows.add_column(k, inside, &mut self.residual);
            }
        }
        crossed
    }

    /// The cost that the linear model promises for `delta`, losses and all, and by how much hard rows are then missed.
    #[inline(always)]
    pub(crate) fn predicted(&mut self, layout: &Layout, state: &State, problem: &Problem) -> (f64, f64) {
        self.y.copy_from_slice(&state.scaled[..layout.n_rows]);
        let mut memory = std::mem::take(&mut self.memory);
        let (delta, y) = (&self.delta[..layout.n_dofs], &mut self.y);
        let jacobian = if layout.has_cones { &self.jacobian } else { &state.jacobian };
        with_rows!(layout, jacobian, &mut memory, rows => {
            for (k, d) in delta.iter().enumerate() {
                rows.add_column(k, *d, y);
            }
        });
        self.memory = memory;
        let mut cost = self.own_cost;
        if layout.has_own || layout.has_cones {
            for (k, d) in delta.iter().enumerate() {
                cost += d * (2.0 * self.own_gradient[k] + d * self.curvature[k]);
            }
        }
        for t in layout.terms.iter().filter(|t| problem.terms()[t.term].is_on && !t.is_hard) {
            let term = &problem.terms()[t.term];
            let loss = term.loss;
            for part in t.parts.clone() {
                let PartLayout { place, row, n_rows, .. } = layout.parts[part];
                if place == Place::Step && state.weights[part] > 0.0 {
                    let rows = &self.y[row..row + n_rows];
                    let square = rows.iter().map(|r| r * r).sum::<f64>() / state.weights[part];
                    cost += term.weight * loss.cost(square);
                }
            }
        }
        if self.guards.is_empty() {
            return (cost, 0.0);
        }
        let (wishes, violation) = self.guards.guards.predicted(&self.delta, &mut self.along);
        (cost + wishes, violation)
    }
}

/// The axes of a box, as columns.
#[inline(always)]
fn basis(limits: &TangentBox) -> DMat3 {
    let [first, second, third] = limits.axes;
    DMat3::from_cols(first, second, third)
}

/// What separable rows and potentials cost.
fn own_cost(layout: &Layout, state: &State, problem: &Problem) -> f64 {
    let mut cost = 0.0;
    for t in layout.terms.iter().filter(|t| problem.terms()[t.term].is_on && !t.is_hard) {
        let term = &problem.terms()[t.term];
        for part in t.parts.clone().filter(|part| matches!(layout.parts[*part].place, Place::Own { .. })) {
            cost += term.weight * term.loss.cost(state.squares[part]);
        }
        if t.has_potential {
            cost += term.weight * state.values[t.term];
        }
    }
    cost
}
