//! The linear system of a step of a motion, its structure in time exploited.
//!
//! Smoothness couples a degree of freedom with itself only, over at most three samples: for each there is one banded
//! matrix `A` over time, factored in a time that is linear in samples. Rows `J` exist at the samples at which something is
//! wanted, so that with few of them the step is solved over rows: `(J A⁻¹ Jᵀ + E) y = r − J A⁻¹ g`,
//! `δ = −A⁻¹ (g + Jᵀ y)`. Samples that are given, and what a limit holds back, take no part.
//!
//! Damping is by the speed of the step rather than by its length: samples between two keys then follow the keys
//! whatever the damping, which only shortens the step as a whole.

use crate::algebra::banded::Banded;
use crate::algebra::cholesky::{self, NotPositiveDefinite, dot};
use crate::algebra::iterative::Iterative;
use crate::algebra::room::{MostRows, make_room};
use crate::algebra::sample_rows::SampleRows;
use crate::layout::Layout;
use crate::state::motion::MotionState;
use crate::step::acting::hard_compliance;

/// Up to here the step is solved over rows; more would be a matrix too large.
pub(crate) const MOST_DIRECT_ROWS: usize = 600;
/// For so many entries of inverses room is made at once, 16 MB. All there could be of a long motion are many times what is ever
/// needed, since each degree of freedom would have to be held somewhere.
const MOST_INVERSES: usize = 1 << 21;

/// Memory of the system.
#[derive(Clone, Debug, Default)]
pub(crate) struct System {
    /// [`MOST_DIRECT_ROWS`], but for tests that want the other way.
    most_direct_rows: usize,
    n_samples: usize,
    n_dofs: usize,
    /// The weights of smoothness of each degree of freedom, and at which ends the motion is at rest.
    weights: Vec<[f64; 3]>,
    at_rest: [bool; 2],
    /// Smoothness matrices by distinct weights, and which one each degree of freedom has.
    classes: Vec<Banded>,
    class_of: Vec<usize>,
    /// The matrix of the squared speed, by which steps are damped.
    speed: Banded,
    /// How long a stretch of time one key moves (samples), and the damping of a shift of all samples.
    stretch: f64,
    shift: f64,
    /// Factors of the matrices of classes, then of those degrees of freedom that have their own.
    factors: Vec<Banded>,
    n_factors: usize,
    /// One matrix, while it is copied.
    one: Banded,
    factor_of: Vec<usize>,
    /// How many samples a row may read: its own, and some before.
    n_back: usize,
    /// The samples that rows read, in order, and `(A⁻¹)` at pairs of them, for each factor.
    touched: Vec<usize>,
    inverses: Vec<f64>,
    columns: Vec<f64>,
    right: Vec<f64>,
    /// The multiplier of each row, as of the last solve.
    pub(crate) y: Vec<f64>,
    dense: Vec<f64>,
    line: Vec<f64>,
    guess: Vec<f64>,
    along: Vec<f64>,
    iterative: Iterative,
}

impl System {
    /// Memory for the motions of a layout, to be [fitted](Self::fit) to one.
    pub(crate) fn new(layout: &Layout) -> Self {
        let n = layout.n_dofs;
        let most_direct_rows = MOST_DIRECT_ROWS;
        Self { most_direct_rows, n_back: 1 + layout.n_earlier, n_dofs: n, ..Self::default() }
    }

    /// Takes over the shape of a motion, and its smoothness.
    pub(crate) fn fit(&mut self, state: &MotionState) {
        let n_keys = state.keyed.len().max(1) as f64;
        let n_free = state.is_given.iter().filter(|given| !**given).count() as f64;
        self.stretch = (n_free / n_keys).max(1.0);
        self.shift = (n_keys / state.n_samples as f64).min(1.0);
        let (weights, at_rest) = (&state.smoothness.weights, state.smoothness.at_rest);
        if (self.n_samples, self.at_rest) == (state.n_samples, at_rest) && self.weights == *weights {
            return;
        }
        (self.n_samples, self.at_rest) = (state.n_samples, at_rest);
        self.weights.clone_from(weights);
        let mut distinct: Vec<[f64; 3]> = Vec::new();
        self.class_of.clear();
        self.class_of.extend(weights.iter().map(|w| {
            distinct.iter().position(|d| d == w).unwrap_or_else(|| {
                distinct.push(*w);
                distinct.len() - 1
            })
        }));
        let matrix = |weights| Banded::smoothness_at_rest(state.n_samples, weights, at_rest);
        self.classes = distinct.into_iter().map(matrix).collect();
        self.speed = Banded::smoothness(state.n_samples, [1.0, 0.0, 0.0]);
        self.factor_of.clear();
        self.factor_of.resize(self.n_dofs, 0);
    }

    /// Makes room for the most rows that a step may be solved over, for as many degrees of freedom as there are with a matrix of
    /// their own.
    pub(crate) fn make_room(&mut self, state: &MotionState, most: MostRows) {
        let (n, n_tangents) = (self.n_dofs, self.n_dofs * self.n_samples);
        for over_rows in [&mut self.y, &mut self.along] {
            make_room(over_rows, most.rows);
        }
        for per_tangent in [&mut self.right, &mut self.guess] {
            make_room(per_tangent, n_tangents);
        }
        make_room(&mut self.line, self.n_samples.max(n * self.n_back));
        if most.rows > self.most_direct_rows {
            make_room(&mut self.one.rows, self.n_samples);
            self.iterative.make_room(n, self.n_samples, state.most.at.iter().copied());
        }
        // With more rows than that the guards among them may rest.
        if state.most.rows.rows > self.most_direct_rows {
            return;
        }
        let (n_factors, n_rows) = (self.classes.len() + n, most.rows.min(self.most_direct_rows));
        let n_touched = self.n_samples.min(most.blocks * self.n_back);
        self.factors.resize_with(n_factors.max(self.factors.len()), Banded::default);
        self.factors.iter_mut().for_each(|factor| make_room(&mut factor.rows, self.n_samples));
        make_room(&mut self.touched, n_touched);
        make_room(&mut self.inverses, MOST_INVERSES.min(n_factors * n_touched * n_touched));
        make_room(&mut self.columns, self.n_samples * n.max(n_touched));
        make_room(&mut self.dense, n_rows * n_rows);
    }

    /// The largest curvature along one degree of freedom of one sample, by which damping is measured.
    pub(crate) fn scale(&mut self, state: &MotionState) -> f64 {
        let mut largest = 0.0_f64;
        let squares = &mut self.line;
        squares.clear();
        squares.resize(self.n_dofs, 0.0);
        for block in &state.rows.blocks {
            let first = block.sample * self.n_dofs;
            squares.copy_from_slice(&state.curvature[first..first + self.n_dofs]);
            for row in block.first..block.first + block.n_rows {
                for (run, entries) in state.rows.runs(row).take_while(|(run, _)| run.back == 0) {
                    squares[run.dofs.clone()].iter_mut().zip(entries).for_each(|(s, a)| *s += a * a);
                }
            }
            largest = squares.iter().fold(largest, |a, s| a.max(*s));
        }
        largest = state.curvature.iter().fold(largest, |a, c| a.max(*c));
        let smooth = self.classes.iter().flat_map(|c| &c.rows).map(|row| row[0]).fold(0.0, f64::max);
        [largest, smooth].into_iter().find(|scale| *scale > 0.0).unwrap_or(1.0)
    }

    /// Writes the matrix of one degree of freedom, without what is held: what is not open, or given where all of a class
    /// share it.
    fn write_matrix(
        &self,
        state: &MotionState,
        k: usize,
        damping: f64,
        open: Option<&[bool]>,
        matrix: &mut Banded,
    ) {
        let n = self.n_dofs;
        let is_shared = open.is_none();
        matrix.rows.clone_from(&self.classes[self.class_of[k]].rows);
        let (speed, shift) = (damping * self.stretch + state.spacing.weight, damping * self.shift);
        for t in 0..self.n_samples {
            for d in 0..4 {
                matrix.rows[t][d] += speed * self.speed.rows[t][d];
            }
            matrix.rows[t][0] += shift + if is_shared { 0.0 } else { state.curvature[t * n + k] };
        }
        if !is_shared && state.rate_bounds.is_bent[k] {
            state.rate_bounds.curvature.add_to(k, matrix);
        }
        for t in 0..self.n_samples {
            let is_held = open.map_or(state.is_given[t], |open| !open[t * n + k]);
            if is_held {
                matrix.rows[t] = [1.0, 0.0, 0.0, 0.0];
                for d in 1..4.min(t + 1) {
                    matrix.rows[t - d][d] = 0.0;
                }
            }
        }
    }

    /// Factors one matrix for each class, and one for each degree of freedom that differs from its class.
    fn factor_over_time(
        &mut self,
        state: &MotionState,
        open: &[bool],
        damping: f64,
    ) -> Result<(), NotPositiveDefinite> {
        let n = self.n_dofs;
        let mut factors = std::mem::take(&mut self.factors);
        self.n_factors = self.classes.len();
        factors.resize_with(factors.len().max(self.n_factors + n), Banded::default);
        for (class, factor) in factors.iter_mut().enumerate().take(self.n_factors) {
            let k = self.class_of.iter().position(|c| *c == class).unwrap_or(0);
            self.write_matrix(state, k, damping, None, factor);
        }
        for k in 0..n {
            let differs = |t: usize| {
                let idx = t * n + k;
                state.curvature[idx] != 0.0 || open[idx] == state.is_given[t]
            };
            let is_own = state.rate_bounds.is_bent[k] || (0..self.n_samples).any(differs);
            self.factor_of[k] = if is_own { self.n_factors } else { self.class_of[k] };
            if is_own {
                self.write_matrix(state, k, damping, Some(open), &mut factors[self.n_factors]);
                self.n_factors += 1;
            }
        }
        let factored = factors[..self.n_factors].iter_mut().try_for_each(Banded::factor);
        self.factors = factors;
        factored
    }

    /// `x := A⁻¹ x` where open, 0 elsewhere.
    fn apply_inverse(&mut self, open: &[bool], x: &mut [f64]) {
        let n = self.n_dofs;
        x.iter_mut().zip(open).filter(|(_, open)| !**open).for_each(|(x, _)| *x = 0.0);
        // Degrees of freedom with the first matrix all at once, the others one by one.
        let n_others = self.factor_of.iter().filter(|factor| **factor != 0).count();
        let mut others = std::mem::take(&mut self.columns);
        others.clear();
        for k in (0..n).filter(|k| self.factor_of[*k] != 0) {
            let line = &mut self.line;
            line.clear();
            line.extend((0..self.n_samples).map(|t| x[t * n + k]));
            self.factors[self.factor_of[k]].solve_from(0, line);
            others.extend_from_slice(line);
        }
        if n_others < n {
            self.factors[0].solve_columns(n, x);
        }
        let lines = (0..n).filter(|k| self.factor_of[*k] != 0).zip(others.chunks_exact(self.n_samples));
        for (k, line) in lines {
            line.iter().enumerate().for_each(|(t, value)| x[t * n + k] = *value);
        }
        self.columns = others;
        x.iter_mut().zip(open).filter(|(_, open)| !**open).for_each(|(x, _)| *x = 0.0);
    }

    /// Factors the system for a damping. An error where it cannot be solved with so little of it.
    pub(crate) fn factor(
        &mut self,
        state: &MotionState,
        rows: &SampleRows,
        open: &[bool],
        damping: f64,
    ) -> Result<(), NotPositiveDefinite> {
        if rows.n_rows() <= self.most_direct_rows {
            self.factor_over_time(state, open, damping)?;
            return self.factor_rows(rows, open);
        }
        let mut iterative = std::mem::take(&mut self.iterative);
        iterative.over_time().clear(self.n_dofs, self.n_samples);
        let mut matrix = std::mem::take(&mut self.one);
        for k in 0..self.n_dofs {
            self.write_matrix(state, k, damping, Some(open), &mut matrix);
            iterative.over_time().set(k, &matrix);
        }
        self.one = matrix;
        let prepared = iterative.prepare(rows, open);
        self.iterative = iterative;
        prepared
    }

    /// Solves what was factored last for half the gradient beside its rows and for residuals of these; what is not open keeps its
    /// `delta`.
    pub(crate) fn solve(
        &mut self,
        state: &MotionState,
        gradient: &[f64],
        rows: &SampleRows,
        open: &[bool],
        damping: f64,
        residual: &[f64],
        delta: &mut [f64],
    ) {
        let mut right = std::mem::take(&mut self.right);
        let mut y = std::mem::take(&mut self.y);
        // What is held moves its neighbours in time, and its own sample's rows.
        right.clear();
        right.extend_from_slice(gradient);
        y.clear();
        y.extend_from_slice(residual);
        let mut guess = std::mem::take(&mut self.guess);
        guess.clear();
        guess.extend_from_slice(delta);
        for (delta, open) in delta.iter_mut().zip(open) {
            if *open {
                *delta = 0.0;
            }
        }
        if delta.iter().any(|d| *d != 0.0) {
            self.add_product_beside_rows(state, damping, delta, &mut right);
            rows.add_product(delta, &mut y);
        }
        if rows.n_rows() > self.most_direct_rows {
            rows.add_transposed(&y, &mut right);
            self.solve_iteratively(state, rows, open, damping, &mut right, &mut guess, delta);
            y.copy_from_slice(residual);
            rows.add_product(delta, &mut y);
        } else {
            // u = A⁻¹ g, then y = (E + J A⁻¹ Jᵀ)⁻¹ (r − J u).
            let mut u = guess;
            u.clone_from(&right);
            self.apply_inverse(open, &mut u);
            u.iter_mut().for_each(|v| *v = -*v);
            rows.add_product(&u, &mut y);
            cholesky::solve(y.len(), &self.dense, &mut y);
            rows.add_transposed(&y, &mut right);
            self.apply_inverse(open, &mut right);
            for idx in (0..delta.len()).filter(|idx| open[*idx]) {
                delta[idx] = -right[idx];
            }
            guess = u;
        }
        (self.right, self.y, self.guess) = (right, y, guess);
    }

    /// The open part of `delta` from half the gradient of the model where that part is 0, and a guess.
    fn solve_iteratively(
        &mut self,
        state: &MotionState,
        rows: &SampleRows,
        open: &[bool],
        damping: f64,
        right: &mut [f64],
        x: &mut [f64],
        delta: &mut [f64],
    ) {
        for ((b, x), open) in right.iter_mut().zip(&mut *x).zip(open) {
            (*b, *x) = if *open { (-*b, *x) } else { (0.0, 0.0) };
        }
        let mut iterative = std::mem::take(&mut self.iterative);
        let mut along = std::mem::take(&mut self.along);
        let apply =
            |x: &[f64], out: &mut [f64]| self.add_model_product(state, rows, damping, x, &mut along, out);
        iterative.solve(rows, open, apply, right, x);
        (self.iterative, self.along) = (iterative, along);
        for idx in (0..x.len()).filter(|idx| open[*idx]) {
            delta[idx] = x[idx];
        }
    }

    /// `out += (Jᵀ J + smoothness + damping + curvature) x`; `y` is memory over rows.
    fn add_model_product(
        &self,
        state: &MotionState,
        rows: &SampleRows,
        damping: f64,
        x: &[f64],
        y: &mut Vec<f64>,
        out: &mut [f64],
    ) {
        y.clear();
        y.resize(rows.n_rows(), 0.0);
        rows.add_product(x, y);
        rows.add_transposed(y, out);
        self.add_product_beside_rows(state, damping, x, out);
    }

    /// `out += (smoothness + damping + curvature) x`
    pub(crate) fn add_product_beside_rows(
        &self,
        state: &MotionState,
        damping: f64,
        x: &[f64],
        out: &mut [f64],
    ) {
        let n = self.n_dofs;
        let (speed, shift) = (damping * self.stretch + state.spacing.weight, damping * self.shift);
        for t in 0..self.n_samples {
            for d in 0..4.min(self.n_samples - t) {
                let of_speed = speed * self.speed.rows[t][d];
                for k in 0..n {
                    let entry = self.classes[self.class_of[k]].rows[t][d] + of_speed;
                    out[t * n + k] += entry * x[(t + d) * n + k];
                    if d > 0 {
                        out[(t + d) * n + k] += entry * x[t * n + k];
                    }
                }
            }
        }
        for (idx, out) in out.iter_mut().enumerate() {
            *out += (shift + state.curvature[idx]) * x[idx];
        }
        if !state.rate_bounds.is_off() {
            state.rate_bounds.curvature.add_product(x, out);
        }
    }

    /// Factors `E + J A⁻¹ Jᵀ`, with the compliances on the diagonal.
    fn factor_rows(&mut self, rows: &SampleRows, open: &[bool]) -> Result<(), NotPositiveDefinite> {
        let (n, m, n_back) = (self.n_dofs, rows.n_rows(), self.n_back);
        self.invert_at(rows);
        let n_touched = self.touched.len();
        let inverse_of = |k: usize| &self.inverses[self.factor_of[k] * n_touched * n_touched..];
        let mut dense = std::mem::take(&mut self.dense);
        dense.clear();
        dense.resize(m * m, 0.0);
        let mut weighted = std::mem::take(&mut self.line);
        weighted.clear();
        weighted.resize(n * n_back, 0.0);
        for (a, later) in rows.blocks.iter().enumerate() {
            for earlier in &rows.blocks[..=a] {
                // Where the samples of both lie among those that rows touch.
                let at_earlier = self.place_of(earlier.sample);
                let reach = n_back.min(earlier.sample + 1);
                for i in later.first..later.first + later.n_rows {
                    weighted.fill(0.0);
                    for (run, entries) in rows.runs(i) {
                        let sample = later.sample - run.back;
                        let at = self.place_of(sample);
                        for back in 0..reach {
                            let other = earlier.sample - back;
                            for (k, entry) in run.dofs.clone().zip(entries) {
                                if open[sample * n + k] && open[other * n + k] {
                                    let inverse = inverse_of(k)[at * n_touched + at_earlier - back];
                                    weighted[back * n + k] += entry * inverse;
                                }
                            }
                        }
                    }
                    for j in earlier.first..(earlier.first + earlier.n_rows).min(i + 1) {
                        dense[i * m + j] = rows.dot_back(j, &weighted);
                    }
                }
            }
        }
        for i in 0..m {
            let own = dense[i * m + i];
            dense[i * m + i] += match rows.compliance[i] {
                0.0 => hard_compliance(own, rows.square(i)),
                compliance => compliance,
            };
        }
        let factored = cholesky::factor(m, &mut dense);
        (self.dense, self.line) = (dense, weighted);
        factored
    }

    /// Where a sample that rows touch lies among those.
    fn place_of(&self, sample: usize) -> usize {
        self.touched.partition_point(|touched| *touched < sample)
    }

    /// The entries of the inverses at pairs of samples that rows touch.
    fn invert_at(&mut self, rows: &SampleRows) {
        self.touched.clear();
        for block in &rows.blocks {
            let next = self.touched.last().map_or(0, |last| last + 1);
            let first = (block.sample + 1).saturating_sub(self.n_back);
            self.touched.extend(first.max(next)..=block.sample);
        }
        let n_touched = self.touched.len();
        self.inverses.clear();
        let columns = &mut self.columns;
        for factor in &self.factors[..self.n_factors] {
            columns.clear();
            columns.resize(self.n_samples * n_touched, 0.0);
            for (idx, sample) in self.touched.iter().enumerate() {
                columns[sample * n_touched + idx] = 1.0;
            }
            factor.solve_columns(n_touched, columns);
            for sample in &self.touched {
                let at = sample * n_touched;
                self.inverses.extend_from_slice(&columns[at..at + n_touched]);
            }
        }
    }

    /// `deltaᵀ H delta` of what is not in rows, without damping.
    pub(crate) fn bend_beside_rows(&mut self, state: &MotionState, delta: &[f64]) -> f64 {
        let mut product = std::mem::take(&mut self.guess);
        product.clear();
        product.resize(delta.len(), 0.0);
        self.add_product_beside_rows(state, 0.0, delta, &mut product);
        let bend = dot(delta, &product);
        self.guess = product;
        bend
    }
}

#[cfg(test)]
mod tests;
