//! Rows with a sense and a force: what is hard, and what wants to be at least something, beside a base that a step can be
//! solved for.
//!
//! The base is `δᵀ H δ + 2 gᵀ δ`, whose step is `δ₀ = −H⁻¹ g`. Rows `c + A δ`, of which each wants to be 0 or at least 0,
//! act on it by forces `f`: `δ = δ₀ + H⁻¹ Aᵀ f`, where `c + A δ + E f = 0` for every row that acts. `E` is the compliance:
//! `1 / w` for a wish of weight `w`, next to nothing for a row that is hard. A row that wants to be at least 0 can push
//! and not pull: it acts while its force is positive, and a degree of freedom is held at a limit while its multiplier
//! says so. The force of a hard row has an end too, where the row gives way, so that rows which contradict each other are
//! missed by least in sum. Which ones act and are held is found by exchanging all that are wrong at once, and one at a time where that
//! does not get on (block principal pivoting, Júdice and Pires, 1994): `H` is positive definite, so that there is one answer,
//! and it is found.

use crate::algebra::cholesky;
use crate::algebra::rows::{OpenStep, StepSystem};
use crate::layout::{Layout, PartLayout, Place};
use crate::problem::Problem;
use crate::state::State;
use crate::step::active::{aim, inside, would_pull};
use crate::words::Sense;

/// The compliance of a hard row, relative to what answers its force.
const HARD_COMPLIANCE: f64 = 1e-9;
/// A hard row is taken to be moved by at least this part of the most that its force could move it.
const LEAST_MOVED: f64 = 1e-9;
/// A row, a step and a multiplier count as wrong beyond this (metres, radians; relative to the largest multiplier).
const SLACK: f64 = 1e-12;
/// So often all that is wrong is exchanged without getting better before one at a time is.
const PATIENCE: usize = 3;
/// Most exchanges; what is wrong after the last one is cut off.
const MOST_ROUNDS: usize = 200;

/// One row.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    sense: Sense,
    /// The weight of a wish; `None` for a hard row.
    weight: Option<f64>,
    /// Its residual, as of the last linearization.
    residual: f64,
    is_open: bool,
    /// Whether its force acts.
    acts: bool,
    /// The sign of a force that is the most that it may be; 0 where it is less.
    pressed: f64,
    /// Its compliance in this solve, as of when it first acted: one that changed with what is held would have no end.
    compliance: f64,
}

/// All rows with a force of a problem.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forces {
    rows: Vec<Row>,
    /// By the axes of the step's degrees of freedom, row by row.
    pub(crate) jacobian: Vec<f64>,
    /// The residuals that the step is solved for.
    now: Vec<f64>,
    /// The force of each row; 0 where it does not act.
    pub(crate) force: Vec<f64>,
    /// The largest force of a hard row; one that wants more gives way.
    pub(crate) most: f64,
    /// What pressed rows pull at, and the answer to it.
    press: Vec<f64>,
    pressed: Vec<f64>,
    /// The rows that act, their answers `H⁻¹ aᵀ`, and the matrix of those.
    acting: Vec<usize>,
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

impl Forces {
    pub(crate) fn new(layout: &Layout) -> Self {
        let (n, m) = (layout.n_dofs, layout.n_force_rows);
        Self {
            rows: vec![Row::default(); m],
            jacobian: vec![0.0; n * m],
            now: vec![0.0; m],
            force: vec![0.0; m],
            most: f64::INFINITY,
            press: vec![0.0; if m > 0 { n } else { 0 }],
            pressed: vec![0.0; if m > 0 { n } else { 0 }],
            acting: Vec::with_capacity(m),
            answers: vec![0.0; n * m],
            matrix: vec![0.0; m * m],
            forces: vec![0.0; m],
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Forgets what acted.
    pub(crate) fn forget(&mut self) {
        self.force.fill(0.0);
        self.rows.iter_mut().for_each(|row| (row.acts, row.pressed) = (false, 0.0));
    }

    /// Takes over a linearization; the Jacobian is then turned to the axes of the step by the caller.
    pub(crate) fn begin(&mut self, layout: &Layout, state: &State, problem: &Problem) {
        self.jacobian.copy_from_slice(&state.force_jacobian);
        for t in &layout.terms {
            let term = &problem.terms()[t.term];
            for idx in t.parts.clone() {
                let part = &layout.parts[idx];
                let Place::Force { first } = part.place else { continue };
                let weight = if t.is_hard { None } else { Some(state.weights[idx]) };
                let counts = term.is_on && weight != Some(0.0);
                for i in 0..part.n_rows {
                    let is_open = counts && i < state.n_open[idx];
                    let row = &mut self.rows[first + i];
                    let (sense, residual) = (part.sense, state.residual[part.row + i]);
                    let pressed = if is_open { row.pressed } else { 0.0 };
                    *row =
                        Row { sense, weight, residual, is_open, acts: row.acts && is_open, pressed, ..*row };
                    if !is_open {
                        self.force[first + i] = 0.0;
                    }
                }
            }
        }
    }

    /// Takes what the forces do off a gradient.
    pub(crate) fn balance(&self, n: usize, gradient: &mut [f64]) {
        for (row, force) in self.force.iter().enumerate().filter(|(_, force)| **force != 0.0) {
            let entries = &self.jacobian[row * n..(row + 1) * n];
            gradient.iter_mut().zip(entries).for_each(|(g, a)| *g -= force * a);
        }
    }

    /// The residuals that the next step is solved for: `share` of what is missed is to be made good.
    pub(crate) fn aim(&mut self, share: f64) {
        for (now, row) in self.now.iter_mut().zip(&self.rows) {
            *now = aim(row.sense, row.residual, share);
        }
    }

    /// The same at another pose near by, less what the linear model says of the way there, so that the step is from where
    /// the model begins.
    pub(crate) fn aim_from(&mut self, layout: &Layout, state: &State, delta: &[f64]) {
        for t in &layout.terms {
            for idx in t.parts.clone() {
                let part = &layout.parts[idx];
                let Place::Force { first } = part.place else { continue };
                for i in 0..part.n_rows.min(state.n_open[idx]) {
                    let residual = state.residual[part.row + i];
                    self.now[first + i] = residual - self.along(first + i, delta);
                }
            }
        }
    }

    /// What the linear model says of a row's change.
    fn along(&self, row: usize, delta: &[f64]) -> f64 {
        let n = delta.len();
        self.jacobian[row * n..(row + 1) * n].iter().zip(delta).map(|(a, d)| a * d).sum()
    }

    /// The largest force of a hard row.
    pub(crate) fn largest_hard(&self) -> f64 {
        let hard = self.rows.iter().zip(&self.force).filter(|(row, _)| row.weight.is_none());
        hard.map(|(_, force)| force.abs()).fold(0.0, f64::max)
    }

    /// What the linear model promises for a step: the cost of wishes among the rows, and by how much hard rows are missed.
    pub(crate) fn predicted(&self, layout: &Layout, problem: &Problem, delta: &[f64]) -> (f64, f64) {
        let (mut cost, mut violation) = (0.0, 0.0);
        for t in layout.terms.iter().filter(|t| problem.terms()[t.term].is_on) {
            let term = &problem.terms()[t.term];
            for part in &layout.parts[t.parts.clone()] {
                let PartLayout { place: Place::Force { first }, n_rows, sense, .. } = *part else { continue };
                let open = (first..first + n_rows).filter(|row| self.rows[*row].is_open);
                let missing = open.map(|i| sense.missing(self.rows[i].residual + self.along(i, delta)));
                if t.is_hard {
                    // As in a state, what nothing moves does not count.
                    violation += if t.is_constant { 0.0 } else { missing.map(f64::abs).sum() };
                } else {
                    cost += term.weight * term.loss.cost(missing.map(|r| r * r).sum());
                }
            }
        }
        (cost, violation)
    }

    /// Solves for a step; what is open and what acts begins as it is. False where the base cannot be solved with so little
    /// damping.
    #[inline(never)]
    pub(crate) fn solve<S: StepSystem>(&mut self, base: &mut S, held: &mut Held<'_>) -> bool {
        for row in &mut self.rows {
            row.compliance = 0.0;
            row.acts = row.is_open && row.pressed == 0.0 && (row.acts || row.sense == Sense::Equal);
        }
        let (mut least_wrong, mut patience) = (usize::MAX, PATIENCE);
        for _ in 0..MOST_ROUNDS {
            if !self.solve_for_acting(base, held) {
                return false;
            }
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
        true
    }

    /// The step for what is open and what acts now.
    #[inline(always)]
    fn solve_for_acting<S: StepSystem>(&mut self, base: &mut S, held: &mut Held<'_>) -> bool {
        let n = held.delta.len();
        let Held { open, inverse, own, damping, residual, y, delta, .. } = held;
        let step = OpenStep { open, inverse, own: *own, damping: *damping, residual: &residual[..] };
        let Some(factor) = base.factor(&step) else { return false };
        base.solve_factored(&factor, &step, y, delta);
        self.acting.clear();
        self.acting.extend((0..self.rows.len()).filter(|row| self.rows[*row].acts));
        let m = self.acting.len();
        self.force.fill(0.0);
        if self.rows.iter().any(|row| row.pressed != 0.0) {
            self.press.fill(0.0);
            for (row, pressed) in self.rows.iter().enumerate().filter(|(_, row)| row.pressed != 0.0) {
                self.force[row] = pressed.pressed * self.most;
                let entries = &self.jacobian[row * n..(row + 1) * n];
                self.press
                    .iter_mut()
                    .zip(entries)
                    .for_each(|(press, a)| *press += pressed.pressed * self.most * a);
            }
            base.respond(&factor, &step, &self.press, y, &mut self.pressed);
            delta.iter_mut().zip(&self.pressed).for_each(|(delta, pressed)| *delta += pressed);
        }
        if m == 0 {
            return true;
        }
        for (a, &row) in self.acting.iter().enumerate() {
            let entries = &self.jacobian[row * n..(row + 1) * n];
            let answer = &mut self.answers[a * n..(a + 1) * n];
            base.respond(&factor, &step, entries, y, answer);
        }
        for a in 0..m {
            let row = self.acting[a];
            for b in 0..=a {
                self.matrix[a * m + b] = self.along(row, &self.answers[b * n..(b + 1) * n]);
            }
            let own = self.matrix[a * m + a];
            self.matrix[a * m + a] += match self.rows[row].weight {
                Some(weight) => 1.0 / weight,
                None => {
                    if self.rows[row].compliance == 0.0 {
                        self.rows[row].compliance = hard_compliance(own, self.movable(row, &step));
                    }
                    self.rows[row].compliance
                }
            };
            self.forces[a] = -(self.now[row] + self.along(row, delta));
        }
        if cholesky::factor(m, &mut self.matrix[..m * m]).is_err() {
            return false;
        }
        cholesky::solve(m, &self.matrix[..m * m], &mut self.forces[..m]);
        for a in 0..m {
            self.force[self.acting[a]] = self.forces[a];
            let answer = &self.answers[a * n..(a + 1) * n];
            for (delta, answer) in delta.iter_mut().zip(answer) {
                *delta += self.forces[a] * answer;
            }
        }
        true
    }

    /// By how much the force of a row would move it if nothing were held and nothing else wanted.
    fn movable(&self, row: usize, step: &OpenStep<'_>) -> f64 {
        let n = step.inverse.len();
        let entries = self.jacobian[row * n..(row + 1) * n].iter().zip(step.inverse);
        entries.map(|(a, inverse)| a * a * inverse).sum::<f64>() / step.damping
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
                let rows = self.force.iter().enumerate().filter(|(_, force)| **force != 0.0);
                let (mut pushed, mut size) = (0.0, 0.0_f64);
                for (row, force) in rows {
                    let push = force * self.jacobian[row * n + k];
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
        let largest = self.force.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        for row in 0..self.rows.len() {
            let Some(next) = self.next(row, largest, held.delta) else { continue };
            (n_wrong, last_row) = (n_wrong + 1, Some((row, next)));
            if which == Exchange::All {
                self.rows[row] = next;
            }
        }
        if which == Exchange::Last {
            match (last_row, last) {
                (Some((row, next)), _) => self.rows[row] = next,
                (None, Some(k)) => turn(base, held, k),
                (None, None) => {}
            }
        }
        n_wrong
    }

    /// A row as it should be where it is wrong about whether it acts.
    #[inline(always)]
    fn next(&self, row: usize, largest: f64, delta: &[f64]) -> Option<Row> {
        let this = self.rows[row];
        if !this.is_open {
            return None;
        }
        let force = self.force[row];
        if this.acts {
            let most = if this.weight.is_none() { self.most } else { f64::INFINITY };
            return if this.sense == Sense::AtLeast && force < -SLACK * largest {
                Some(Row { acts: false, ..this })
            } else if force.abs() > most {
                Some(Row { acts: false, pressed: force.signum(), ..this })
            } else {
                None
            };
        }
        let n = delta.len();
        let (mut then, mut size) = (self.now[row], 1.0 + self.now[row].abs());
        for (a, d) in self.jacobian[row * n..(row + 1) * n].iter().zip(delta) {
            (then, size) = (then + a * d, size + (a * d).abs());
        }
        let slack = SLACK * size;
        let is_wrong = if this.pressed == 0.0 { then < -slack } else { then * this.pressed > slack };
        is_wrong.then_some(Row { acts: true, pressed: 0.0, ..this })
    }
}

/// The compliance of a hard row whose force moves it by so much, and by so much at most if nothing were held and nothing else
/// wanted. Where all that moves it is held, its force grows large, but not without end, so that what is held is let go of;
/// a row that nothing moves gives way to any force: it has no say.
pub(crate) fn hard_compliance(moved: f64, at_most: f64) -> f64 {
    if at_most > 0.0 { HARD_COMPLIANCE * moved.max(LEAST_MOVED * at_most) } else { f64::MAX.sqrt() }
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
