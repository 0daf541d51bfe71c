//! The damped Gauss–Newton step of a whole motion inside all limits: [`System`] solved again and again, with what a step
//! would take beyond a limit held at it.

use crate::algebra::cholesky::NotPositiveDefinite;
use crate::algebra::room::make_room;
use crate::algebra::sample_rows::{Block, SampleRows};
use crate::layout::Layout;
use crate::state::motion::MotionState;
use crate::step::active::{Room, inside, is_blocked, would_pull};
use crate::step::cones::{Cones, HeldAxis};
use crate::step::motion_guards::MotionGuards;
use crate::step::system::{MOST_DIRECT_ROWS, System};

/// Rounds of finding limits that a step would cross, holding those and solving again; and the same where there are guards.
const MOST_ROUNDS: usize = 4;
const MOST_ROUNDS_OF_GUARDS: usize = 12;

/// So often rows give way in one solve, each time followed by as many rounds.
const MOST_TO_GIVE_WAY: usize = 4;

/// Memory of the step, and the step itself in `delta`, sample by sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct MotionStep {
    n_samples: usize,
    n_dofs: usize,
    system: System,
    /// Half the gradient of the whole cost, less what forces do that are known from the step before.
    pub(crate) gradient: Vec<f64>,
    /// What may move in this iteration, and what is still to be solved for in the current round.
    free: Vec<bool>,
    open: Vec<bool>,
    cones: Cones,
    pub(crate) guards: MotionGuards,
    pub(crate) delta: Vec<f64>,
    /// The rows of the state, those of what acts, and those of cones; and what each of them is.
    rows: SampleRows,
    sources: Vec<StepRow>,
    residual: Vec<f64>,
    y: Vec<f64>,
    /// Half the gradient beside those rows, less what guards press by.
    beside: Vec<f64>,
    /// Degrees of freedom that a range would have to pull at.
    pulled: Vec<usize>,
}

/// What a row is that a step is solved over.
#[derive(Clone, Copy, Debug)]
enum StepRow {
    State(usize),
    Guard(usize),
    Cone(HeldAxis),
}

impl MotionStep {
    /// Memory for steps of a layout's motions, to be [fitted](Self::fit) to one.
    pub(crate) fn new(layout: &Layout) -> Self {
        let mut rows = SampleRows::new(layout);
        Self {
            n_dofs: layout.n_dofs,
            system: System::new(layout),
            cones: Cones::new(layout, &mut rows),
            rows,
            ..Self::default()
        }
    }

    /// Takes over the shape of a motion.
    pub(crate) fn fit(&mut self, layout: &Layout, state: &MotionState) {
        let n = layout.n_dofs * state.n_samples;
        self.n_samples = state.n_samples;
        self.system.fit(state);
        self.cones.fit(state);
        self.gradient.resize(n, 0.0);
        self.delta.resize(n, 0.0);
        self.free.resize(n, true);
        self.open.resize(n, true);
        self.make_room(state);
    }

    /// Makes room for whatever may act and hold in the steps of a motion.
    fn make_room(&mut self, state: &MotionState) {
        let of_terms = state.most.rows.beside(state.most.guards);
        let of_cones = self.cones.make_room(state, of_terms.rows);
        let mut all = of_terms.beside(of_cones);
        // Cones have rows at other samples too.
        all.blocks = self.n_samples.min(of_terms.blocks + of_cones.blocks);
        self.guards.make_room(state.most.guards.rows);
        self.rows.make_room(all);
        make_room(&mut self.sources, all.rows);
        make_room(&mut self.residual, all.rows);
        make_room(&mut self.y, all.rows.max(self.delta.len()));
        make_room(&mut self.beside, self.delta.len());
        make_room(&mut self.pulled, self.delta.len());
        self.system.make_room(state, all);
    }

    /// Takes over a linearization: the gradient, and what limits block. The answer is the largest remaining entry
    /// of the gradient.
    pub(crate) fn begin(&mut self, layout: &Layout, state: &MotionState) -> f64 {
        let n = self.n_dofs;
        self.gradient.copy_from_slice(&state.gradient);
        state.rows.add_transposed(&state.rows.residual, &mut self.gradient);
        let is_iterative = self.is_iterative(state);
        if !state.guards.is_empty() {
            let scale = self.scale(state);
            self.guards.begin(&state.guards, is_iterative, scale);
            self.guards.acting.balance(&state.guards.rows, &mut self.gradient);
        }
        self.cones.begin(layout, state, is_iterative, &self.gradient);
        let mut largest = 0.0_f64;
        for t in 0..self.n_samples {
            for k in 0..n {
                let (g, idx) = (self.gradient[t * n + k], t * n + k);
                let blocked = is_blocked(room(layout, state, t, k), g);
                self.free[idx] = !state.is_given[t] && !blocked;
                if self.free[idx] {
                    largest = largest.max(g.abs());
                }
            }
        }
        largest
    }

    /// The largest curvature along one degree of freedom of one sample, by which damping is measured.
    pub(crate) fn scale(&mut self, state: &MotionState) -> f64 {
        self.system.scale(state)
    }

    /// Whether there are too many rows to solve over.
    pub(crate) fn is_iterative(&self, state: &MotionState) -> bool {
        state.rows.n_rows() + state.guards.rows.n_rows() > MOST_DIRECT_ROWS
    }

    /// Computes `delta` for a damping. An error where the system cannot be solved with so little damping.
    pub(crate) fn solve(
        &mut self,
        layout: &Layout,
        state: &MotionState,
        damping: f64,
    ) -> Result<(), NotPositiveDefinite> {
        self.open.copy_from_slice(&self.free);
        self.delta.fill(0.0);
        self.cones.open();
        self.guards.acting.open(&state.guards);
        let has_guards = !state.guards.is_empty();
        let most_rounds = if has_guards { MOST_ROUNDS_OF_GUARDS } else { MOST_ROUNDS };
        let (mut is_held, mut round, mut n_gave_way) = (false, 0, 0);
        loop {
            self.press(state);
            self.gather(state);
            let rows = if self.is_plain(state) { &state.rows } else { &self.rows };
            self.system.factor(state, rows, &self.open, damping)?;
            self.solve_factored(state, damping, &state.rows.residual);
            if round + 1 == most_rounds {
                break;
            }
            // What is let go of may be crossed again: only in the first rounds, so that this ends.
            let may_let_go = 2 * round < most_rounds;
            self.pulled.clear();
            if may_let_go && has_guards {
                self.find_pulled(layout, state, damping);
            }
            let ranges = self.hold_crossed(layout, state);
            let rows = has_guards && self.guards.exchange(&state.guards, &self.delta);
            let cones = self.cones.hold_crossed(&self.delta);
            let let_go = may_let_go && self.let_go(state);
            is_held |= let_go || ranges || cones || rows;
            round += 1;
            if !let_go && !ranges && !cones && !rows {
                // A force may be large only because of what is held beside it: rows give way where nothing else is wrong.
                if n_gave_way == MOST_TO_GIVE_WAY || !self.guards.give_way(&state.guards) {
                    break;
                }
                (round, n_gave_way) = (0, n_gave_way + 1);
            }
        }
        self.clamp(layout, state);
        if is_held && !has_guards {
            self.shorten(state);
        }
        Ok(())
    }

    /// Whether the rows of the state are all that a step is solved over.
    fn is_plain(&self, state: &MotionState) -> bool {
        self.cones.is_idle() && state.guards.is_empty()
    }

    /// Takes what presses off the gradient beside rows.
    fn press(&mut self, state: &MotionState) {
        self.beside.clone_from(&state.gradient);
        if self.guards.acting.press() {
            let acting = &self.guards.acting;
            state.guards.rows.add_transposed_of(|row| -acting.pressing(row), &mut self.beside);
        }
    }

    /// Gathers the rows of the state, those that act, and those of cones that hold, sample by sample.
    fn gather(&mut self, state: &MotionState) {
        if self.is_plain(state) {
            return;
        }
        let (rows, sources) = (&mut self.rows, &mut self.sources);
        rows.clear();
        sources.clear();
        self.cones.find_room(state.rows.n_rows() + state.guards.rows.n_rows(), state);
        let mut blocks = state.rows.blocks.iter().peekable();
        let mut guards = state.guards.rows.blocks.iter().peekable();
        for sample in 0..state.n_samples {
            let first = rows.n_rows();
            while let Some(block) = blocks.next_if(|block| block.sample == sample) {
                for row in block.first..block.first + block.n_rows {
                    rows.push_copy(&state.rows, row);
                    sources.push(StepRow::State(row));
                }
            }
            while let Some(block) = guards.next_if(|block| block.sample == sample) {
                for row in
                    (block.first..block.first + block.n_rows).filter(|row| self.guards.acting.acts(*row))
                {
                    self.guards.push_to(&state.guards, row, rows);
                    sources.push(StepRow::Guard(row));
                }
            }
            self.cones.push_to(sample, rows, |held| sources.push(StepRow::Cone(held)));
            let n_rows = rows.n_rows() - first;
            if n_rows > 0 {
                rows.blocks.push(Block { sample, first, n_rows });
            }
        }
    }

    /// Solves once more with what was factored last, for other residuals at the same place. With those of a
    /// step, less what the linear model says of it, this is the step that its curvature asks for: along a narrow curved
    /// valley it leads back to the ground (a second-order correction). `guards` are residuals of those.
    pub(crate) fn correct(
        &mut self,
        layout: &Layout,
        state: &MotionState,
        damping: f64,
        residual: &[f64],
        guards: &[f64],
    ) {
        self.guards.acting.aim_from(&state.guards.rows, guards.iter().copied().enumerate(), &self.delta);
        self.solve_factored(state, damping, residual);
        self.clamp(layout, state);
    }

    /// Solves for residuals of the state's rows, and for what the others are to be.
    fn solve_factored(&mut self, state: &MotionState, damping: f64, residual: &[f64]) {
        let is_plain = self.is_plain(state);
        let (rows, residual) = if is_plain {
            (&state.rows, residual)
        } else {
            self.residual.clear();
            self.residual.extend(self.sources.iter().map(|source| match source {
                StepRow::State(row) => residual[*row],
                StepRow::Guard(row) => self.guards.residual(&state.guards, *row),
                StepRow::Cone(held) => held.residual,
            }));
            (&self.rows, &self.residual[..])
        };
        self.system.solve(state, &self.beside, rows, &self.open, damping, residual, &mut self.delta);
        for (source, multiplier) in self.sources.iter().zip(&self.system.y).filter(|_| !is_plain) {
            if let StepRow::Guard(row) = source {
                self.guards.set_force(&state.guards, *row, *multiplier);
            }
        }
    }

    /// Lets go of limits that would have to pull: of cones, and of the ranges that were [found](Self::find_pulled).
    fn let_go(&mut self, state: &MotionState) -> bool {
        let mut changed = !self.pulled.is_empty();
        for idx in self.pulled.drain(..) {
            (self.open[idx], self.delta[idx]) = (true, 0.0);
        }
        if !self.is_plain(state) {
            for (source, multiplier) in self.sources.iter().zip(&self.system.y) {
                if let StepRow::Cone(held) = source {
                    changed |= self.cones.let_go(*held, *multiplier);
                }
            }
        }
        changed
    }

    /// Finds degrees of freedom that are held at a range which would have to pull.
    fn find_pulled(&mut self, layout: &Layout, state: &MotionState, damping: f64) {
        // Half the gradient of the model at the step, forces included: what they are held against.
        let mut pull = std::mem::take(&mut self.y);
        pull.clear();
        pull.extend_from_slice(&self.beside);
        self.rows.add_transposed(&self.system.y, &mut pull);
        self.system.add_product_beside_rows(state, damping, &self.delta, &mut pull);
        let n = self.n_dofs;
        for t in (0..self.n_samples).filter(|t| !state.is_given[*t]) {
            for k in (0..n).filter(|k| !self.open[t * n + k]) {
                let idx = t * n + k;
                if would_pull(room(layout, state, t, k), self.delta[idx], pull[idx], 0.0) {
                    self.pulled.push(idx);
                }
            }
        }
        self.y = pull;
    }

    /// `residual -= J delta`
    pub(crate) fn subtract_model(&mut self, state: &MotionState, residual: &mut [f64]) {
        self.delta.iter_mut().for_each(|d| *d = -*d);
        state.rows.add_product(&self.delta, residual);
        self.delta.iter_mut().for_each(|d| *d = -*d);
    }

    /// Holds what the step takes across a range at that range; says whether there was something.
    fn hold_crossed(&mut self, layout: &Layout, state: &MotionState) -> bool {
        let n = self.n_dofs;
        let mut crossed = false;
        for t in 0..self.n_samples {
            for k in 0..n {
                let idx = t * n + k;
                if !self.open[idx] {
                    continue;
                }
                let inside = inside(room(layout, state, t, k), self.delta[idx]);
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
        let n = self.n_dofs;
        self.cones.clamp(&mut self.delta);
        for t in (0..self.n_samples).filter(|t| !state.is_given[*t]) {
            for k in 0..n {
                let delta = &mut self.delta[t * n + k];
                *delta = inside(room(layout, state, t, k), *delta);
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

    /// The cost that the linear model promises for `delta`, losses and all, and by how much hard rows are then missed.
    pub(crate) fn predicted(&mut self, state: &MotionState) -> (f64, f64) {
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
        cost += self.bend_beside_rows(state);
        let (wishes, violation) = state.guards.predicted(&self.delta, &mut self.y);
        (cost + wishes, violation)
    }
}

/// How far a degree of freedom of a sample may go.
#[inline]
fn room(layout: &Layout, state: &MotionState, t: usize, k: usize) -> Room {
    let x = state.coords[t * layout.n_coords + layout.coord_of_dof[k]];
    (layout.lower[k] - x, layout.upper[k] - x)
}

#[cfg(test)]
mod tests;
