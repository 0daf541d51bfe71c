//! Guards beside the base of a pose's step: which of them act and which limits hold is found exactly.
//!
//! The base is `δᵀ H δ + 2 gᵀ δ`, whose step is `δ₀ = −H⁻¹ g`. Guards `c + A δ` act on it by forces `f`: `δ = δ₀ + H⁻¹ Aᵀ f`, where
//! `c + A δ + E f = 0` for every one that acts, `E` their compliance (`step/acting.rs` says when they act, and press). A degree of
//! freedom is held at a limit while its multiplier says so. Which ones act and are held is found by exchanging all that are wrong
//! at once, and one at a time where that does not get on (block principal pivoting, Júdice and Pires, 1994): `H` is positive
//! definite, so that there is one answer, and it is found.

use crate::algebra::cholesky::{self, NotPositiveDefinite};
use crate::algebra::full_rows::{Derivatives, FullRows};
use crate::algebra::rows::{OpenStep, StepSystem};
use crate::layout::{Layout, Place};
use crate::problem::Problem;
use crate::state::State;
use crate::state::guards::Guards;
use crate::step::acting::{Acting, SLACK, Stance, hard_compliance};
use crate::step::active::{inside, would_pull};

/// So often all that is wrong is exchanged without getting better before one at a time is.
const PATIENCE: usize = 3;
/// Most exchanges; what is wrong after the last one is cut off.
const MOST_ROUNDS: usize = 200;

/// All guards of a pose, and what they do in its steps.
#[derive(Clone, Debug, Default)]
pub(crate) struct PoseGuards {
    /// Their derivatives are by the axes of the step's degrees of freedom.
    pub(crate) guards: Guards<FullRows>,
    pub(crate) acting: Acting,
    /// The compliance of hard rows in this solve, as of when each first acted: one that changed with what is held would have no
    /// end. 0 before that.
    compliance: Vec<f64>,
    /// What pressing guards pull at, and the answer to it.
    press: Vec<f64>,
    pressed: Vec<f64>,
    /// The guards that act, their answers `H⁻¹ aᵀ`, and the matrix of those.
    that_act: Vec<usize>,
    answers: Vec<f64>,
    matrix: Vec<f64>,
    forces: Vec<f64>,
}

/// What a step may move, and how.
pub(crate) struct Held<'a> {
    /// Which degrees of freedom are solved for.
    pub(crate) open: &'a mut [bool],
    /// How far each may go down (not positive) and up (not negative).
    pub(crate) room: &'a [(f64, f64)],
    /// `damping / D`.
    pub(crate) inverse: &'a [f64],
    /// The gradient beside rows.
    pub(crate) own: Option<&'a [f64]>,
    pub(crate) damping: f64,
    /// The residuals of the base's rows; with what held degrees of freedom do to them afterwards.
    pub(crate) residual: &'a mut [f64],
    /// Memory over rows.
    pub(crate) y: &'a mut [f64],
    pub(crate) delta: &'a mut [f64],
}

impl PoseGuards {
    pub(crate) fn new(layout: &Layout) -> Self {
        let (n, m) = (layout.n_dofs, layout.n_guards);
        Self {
            guards: Guards::of_pose(layout),
            acting: Acting::new(m),
            compliance: vec![0.0; m],
            press: vec![0.0; if m > 0 { n } else { 0 }],
            pressed: vec![0.0; if m > 0 { n } else { 0 }],
            that_act: Vec::with_capacity(m),
            answers: vec![0.0; n * m],
            matrix: vec![0.0; m * m],
            forces: vec![0.0; m],
        }
    }

    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.compliance.is_empty()
    }

    /// Takes over a linearization; the derivatives are then turned to the axes of the step by the caller.
    pub(crate) fn begin(&mut self, layout: &Layout, state: &State, problem: &Problem) {
        self.guards.take(layout, state, problem);
        self.acting.begin(&self.guards);
    }

    /// The next step is to make good a share of what is missed.
    pub(crate) fn aim(&mut self, share: f64) {
        self.acting.aim(&self.guards, share);
    }

    /// The largest force of a hard row.
    pub(crate) fn largest_hard(&self) -> f64 {
        self.acting.largest_hard(&self.guards)
    }

    /// Aims at the residuals of a state near by.
    pub(crate) fn aim_from(&mut self, layout: &Layout, state: &State, delta: &[f64]) {
        let open = layout.parts.iter().zip(&state.n_open).flat_map(|(part, n_open)| {
            let n_open = if matches!(part.place, Place::Guard { .. }) { *n_open } else { 0 };
            part.row..part.row + part.n_rows.min(n_open)
        });
        let residuals = open.map(|row| (row - layout.n_rows, state.residual[row]));
        self.acting.aim_from(&self.guards.rows, residuals, delta);
    }

    /// Solves for a step; what is open and what acts begins as it is. An error where the base cannot be solved with so
    /// little damping.
    #[inline(never)]
    pub(crate) fn solve<S: StepSystem>(
        &mut self,
        base: &mut S,
        held: &mut Held<'_>,
    ) -> Result<(), NotPositiveDefinite> {
        self.compliance.fill(0.0);
        self.acting.open(&self.guards);
        let (mut least_wrong, mut patience) = (usize::MAX, PATIENCE);
        for _ in 0..MOST_ROUNDS {
            self.solve_for_acting(base, held)?;
            let n_wrong = self.exchange(base, held, Exchange::None);
            if n_wrong == 0 {
                break;
            }
            let which = if n_wrong < least_wrong {
                (least_wrong, patience) = (n_wrong, PATIENCE);
                Exchange::All
            } else if patience > 0 {
                patience -= 1;
                Exchange::All
            } else {
                Exchange::Last
            };
            self.exchange(base, held, which);
        }
        for (delta, room) in held.delta.iter_mut().zip(held.room) {
            *delta = inside(*room, *delta);
        }
        Ok(())
    }

    /// The step for what is open and what acts now.
    #[inline(always)]
    fn solve_for_acting<S: StepSystem>(
        &mut self,
        base: &mut S,
        held: &mut Held<'_>,
    ) -> Result<(), NotPositiveDefinite> {
        let n = held.delta.len();
        let Held { open, inverse, own, damping, residual, y, delta, .. } = held;
        let step = OpenStep { open, inverse, own: *own, damping: *damping, residual: &residual[..] };
        let factor = base.factor(&step)?;
        base.solve_factored(&factor, &step, y, delta);
        let (rows, acting) = (&self.guards.rows, &mut self.acting);
        if acting.press() {
            self.press.fill(0.0);
            rows.add_transposed_of(|row| acting.pressing(row), &mut self.press);
            base.respond(&factor, &step, &self.press, y, &mut self.pressed);
            delta.iter_mut().zip(&self.pressed).for_each(|(delta, pressed)| *delta += pressed);
        }
        self.that_act.clear();
        self.that_act.extend((0..acting.force.len()).filter(|row| acting.acts(*row)));
        let m = self.that_act.len();
        if m == 0 {
            return Ok(());
        }
        for (a, &row) in self.that_act.iter().enumerate() {
            base.respond(&factor, &step, rows.entries(row), y, &mut self.answers[a * n..(a + 1) * n]);
        }
        for (a, &row) in self.that_act.iter().enumerate() {
            for b in 0..=a {
                self.matrix[a * m + b] = rows.along(row, &self.answers[b * n..(b + 1) * n]);
            }
            let own = self.matrix[a * m + a];
            self.matrix[a * m + a] += match self.guards.guards[row].weight {
                Some(weight) => 1.0 / weight,
                None => {
                    if self.compliance[row] == 0.0 {
                        self.compliance[row] = hard_compliance(own, movable(rows.entries(row), &step));
                    }
                    self.compliance[row]
                }
            };
            self.forces[a] = -(acting.aim[row] + rows.along(row, delta));
        }
        cholesky::factor(m, &mut self.matrix[..m * m])?;
        cholesky::solve(m, &self.matrix[..m * m], &mut self.forces[..m]);
        for (a, &row) in self.that_act.iter().enumerate() {
            acting.force[row] = self.forces[a];
            let answer = &self.answers[a * n..(a + 1) * n];
            for (delta, answer) in delta.iter_mut().zip(answer) {
                *delta += self.forces[a] * answer;
            }
        }
        Ok(())
    }

    /// Counts what is wrong about what is open and what acts, and exchanges it.
    #[inline(always)]
    fn exchange<S: StepSystem>(&mut self, base: &mut S, held: &mut Held<'_>, which: Exchange) -> usize {
        let n = held.delta.len();
        // The base's rows at the step, whose pull with the forces' is the multiplier of what is held.
        held.y.copy_from_slice(held.residual);
        for k in (0..n).filter(|k| held.open[*k]) {
            base.add_column(k, held.delta[k], held.y);
        }
        let (mut n_wrong, mut last) = (0, None);
        for k in 0..n {
            let (down, up) = held.room[k];
            let is_wrong = if held.open[k] {
                held.delta[k] < down - SLACK || held.delta[k] > up + SLACK
            } else {
                let own = held.own.map_or(0.0, |own| own[k]);
                let rows = self.acting.force.iter().enumerate().filter(|(_, force)| **force != 0.0);
                let (mut pushed, mut size) = (0.0, 0.0_f64);
                for (row, force) in rows {
                    let push = force * self.guards.rows.entries(row)[k];
                    (pushed, size) = (pushed + push, size + push.abs());
                }
                let pull = own + held.delta[k] * held.damping / held.inverse[k] + base.dot(k, held.y);
                let (multiplier, slack) = (pull - pushed, SLACK * (1.0 + pull.abs() + size));
                would_pull((down, up), held.delta[k], multiplier, slack)
            };
            if is_wrong {
                (n_wrong, last) = (n_wrong + 1, Some(k));
                if which == Exchange::All {
                    turn(base, held, k);
                }
            }
        }
        let mut last_row = None;
        let largest = self.acting.force.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        for row in 0..self.compliance.len() {
            let Some(next) = self.next(row, largest, held.delta) else { continue };
            (n_wrong, last_row) = (n_wrong + 1, Some((row, next)));
            if which == Exchange::All {
                self.acting.stances[row] = next;
            }
        }
        if which == Exchange::Last {
            match (last_row, last) {
                (Some((row, next)), _) => self.acting.stances[row] = next,
                (None, Some(k)) => turn(base, held, k),
                (None, None) => {}
            }
        }
        n_wrong
    }

    /// What a guard should do where it is wrong about that.
    #[inline(always)]
    fn next(&self, row: usize, largest: f64, delta: &[f64]) -> Option<Stance> {
        let then = || {
            let (mut then, mut size) = (self.acting.aim[row], 1.0 + self.acting.aim[row].abs());
            for (a, d) in self.guards.rows.entries(row).iter().zip(delta) {
                (then, size) = (then + a * d, size + (a * d).abs());
            }
            (then, SLACK * size)
        };
        self.acting.next(&self.guards.guards[row], row, SLACK * largest, then)
    }
}

/// By how much the force of a guard with these derivatives would move it if nothing were held and nothing else wanted.
fn movable(entries: &[f64], step: &OpenStep<'_>) -> f64 {
    let entries = entries.iter().zip(step.inverse);
    entries.map(|(a, inverse)| a * a * inverse).sum::<f64>() / step.damping
}

/// What is exchanged of all that is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exchange {
    None,
    All,
    Last,
}

/// Holds a degree of freedom at the limit that its step crosses, or lets go of it.
#[inline(always)]
fn turn<S: StepSystem>(base: &mut S, held: &mut Held<'_>, k: usize) {
    if held.open[k] {
        (held.open[k], held.delta[k]) = (false, inside(held.room[k], held.delta[k]));
        base.close(k, held.inverse[k]);
        base.add_column(k, held.delta[k], held.residual);
    } else {
        base.add_column(k, -held.delta[k], held.residual);
        (held.open[k], held.delta[k]) = (true, 0.0);
        base.open(k, held.inverse[k]);
    }
}

#[cfg(test)]
mod tests;
