//! The step's system over degrees of freedom: `H = JᵀJ + D` with the sparsity of the tree, and its factor without fill.
//!
//! `H = Lᵀ D L`, eliminated from the leaves to the root (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 6.5): every
//! row of `L` has entries for the path above alone, in the same places as the rows above.

use crate::algebra::cholesky::{NotPositiveDefinite, dot, sound};
use crate::algebra::rows::{Columns, OpenStep, SpanColumns, StepSystem, SystemMemory};
use crate::layout::{Layout, Paths};

/// The memory's matrix has the rows of `JᵀJ` one behind the other.
pub(crate) struct Branched<'a> {
    paths: &'a Paths,
    columns: SpanColumns<'a>,
    memory: &'a mut SystemMemory,
}

impl<'a> Branched<'a> {
    pub(crate) fn new(
        layout: &'a Layout,
        paths: &'a Paths,
        jacobian: &'a [f64],
        memory: &'a mut SystemMemory,
    ) -> Self {
        Self { paths, columns: SpanColumns::new(layout, jacobian), memory }
    }

    /// `x := H⁻¹ x`, as it was factored; what is closed is to be 0.
    #[inline]
    fn substitute(paths: &Paths, factor: &[f64], x: &mut [f64]) {
        for k in (0..paths.n()).rev() {
            let (row, xk) = (&factor[paths.row(k)], x[k]);
            for (i, l) in paths.above(k).iter().zip(row) {
                x[*i as usize] -= l * xk;
            }
        }
        for k in 0..paths.n() {
            let row = &factor[paths.row(k)];
            let above = paths.above(k);
            let known: f64 = above.iter().zip(row).map(|(i, l)| l * x[*i as usize]).sum();
            x[k] = x[k] * row[above.len()] - known;
        }
    }
}

impl Columns for Branched<'_> {
    #[inline]
    fn dot(&self, k: usize, v: &[f64]) -> f64 {
        self.columns.dot(k, v)
    }

    #[inline]
    fn add_column(&self, k: usize, factor: f64, v: &mut [f64]) {
        self.columns.add_column(k, factor, v);
    }
}

impl StepSystem for Branched<'_> {
    /// It lies in the memory.
    type Factor = ();

    fn begin(&mut self) {
        for k in 0..self.paths.n() {
            let (first, column) = self.columns.column(k);
            let row = &mut self.memory.matrix[self.paths.row(k)];
            for (entry, i) in row.iter_mut().zip(self.paths.above(k)) {
                let (other_first, other) = self.columns.column(*i as usize);
                // Only the rows that both can move: mostly all of the lower one's.
                let from = first.max(other_first);
                let to = (first + column.len()).min(other_first + other.len());
                *entry = if from < to {
                    dot(&column[from - first..to - first], &other[from - other_first..to - other_first])
                } else {
                    0.0
                };
            }
            if let Some(own) = row.last_mut() {
                *own = dot(column, column);
            }
        }
    }

    // What is open is read from the step itself.
    fn clear(&mut self) {}
    fn open(&mut self, _: usize, _: f64) {}
    fn close(&mut self, _: usize, _: f64) {}

    fn solve_open(
        &mut self,
        step: &OpenStep<'_>,
        y: &mut [f64],
        delta: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        self.factor(step)?;
        self.solve_factored(&(), step, y, delta);
        Ok(())
    }

    fn factor(&mut self, step: &OpenStep<'_>) -> Result<(), NotPositiveDefinite> {
        let (paths, n) = (self.paths, self.paths.n());
        let factor = &mut self.memory.factor[..self.paths.n_entries()];
        factor.copy_from_slice(&self.memory.matrix);
        let all_open = step.open[..n].iter().all(|open| *open);
        for k in (0..n).rev() {
            let at = paths.row(k);
            let (lower, row) = factor.split_at_mut(at.start);
            let (row, above) = (&mut row[..at.len()], paths.above(k));
            let depth = above.len();
            if !step.open[k] {
                row.fill(0.0);
                continue;
            }
            if !all_open {
                for (entry, i) in row.iter_mut().zip(above) {
                    if !step.open[*i as usize] {
                        *entry = 0.0;
                    }
                }
            }
            // What was taken off it is what those below it did.
            let whole = self.memory.matrix[at.start + depth] + step.damping / step.inverse[k];
            let pivot = row[depth] + step.damping / step.inverse[k];
            let reciprocal = 1.0 / sound(pivot, whole, k)?;
            for (p, i) in above.iter().enumerate() {
                let l = row[p] * reciprocal;
                // The row of the one above begins in the same places.
                let other = &mut lower[paths.row(*i as usize)];
                for (to, from) in other[..=p].iter_mut().zip(&row[..=p]) {
                    *to -= l * from;
                }
            }
            for entry in &mut row[..depth] {
                *entry *= reciprocal;
            }
            row[depth] = reciprocal;
        }
        Ok(())
    }

    fn solve_factored(&mut self, (): &(), step: &OpenStep<'_>, _: &mut [f64], delta: &mut [f64]) {
        let n = self.paths.n();
        let mut memory = std::mem::take(&mut self.memory.factor);
        // The right side lies behind the matrix.
        let (factor, right) = memory.split_at_mut(self.paths.n_entries());
        for (k, right) in right.iter_mut().enumerate() {
            let pull = || step.own.map_or(0.0, |own| own[k]) + self.dot(k, step.residual);
            *right = if step.open[k] { -pull() } else { 0.0 };
        }
        Self::substitute(self.paths, factor, right);
        for k in (0..n).filter(|k| step.open[*k]) {
            delta[k] = right[k];
        }
        self.memory.factor = memory;
    }

    fn respond(&mut self, (): &(), step: &OpenStep<'_>, v: &[f64], _: &mut [f64], out: &mut [f64]) {
        for (k, out) in out.iter_mut().enumerate() {
            *out = if step.open[k] { v[k] } else { 0.0 };
        }
        Self::substitute(self.paths, &self.memory.factor, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::rows::Sparse;
    use crate::layout::Span;
    use ikiru_testkit::rigs::Random;

    /// Spans of any length at any place, empty ones among them.
    fn random_columns(random: &mut Random, n_rows: usize, n: usize) -> (Layout, Vec<f64>) {
        let mut spans = Vec::new();
        let mut start = 0;
        for _ in 0..n {
            let first = random.below(n_rows);
            let len = random.below(n_rows - first + 1);
            spans.push(Span { first, len, start });
            start += len;
        }
        let jacobian = (0..start).map(|_| random.between(-1.0, 1.0)).collect();
        // Each row couples those whose span it lies in.
        let rows = (0..n_rows).map(|row| {
            let has_it = |k: &usize| (spans[*k].first..spans[*k].first + spans[*k].len).contains(&row);
            (0..n).filter(has_it).collect()
        });
        let paths = Paths::new(n, &rows.collect::<Vec<_>>());
        (Layout { n_rows, n_dofs: n, spans, paths: Some(paths), ..Layout::default() }, jacobian)
    }

    #[test]
    fn over_degrees_of_freedom_it_is_the_step_that_it_is_over_rows() {
        let mut random = Random::new(5);
        for _ in 0..50 {
            let (n_rows, n) = (8 + random.below(40), 1 + random.below(20));
            let (layout, jacobian) = random_columns(&mut random, n_rows, n);
            let residual: Vec<f64> = (0..n_rows).map(|_| random.between(-1.0, 1.0)).collect();
            let own: Vec<f64> = (0..n).map(|_| random.between(-1.0, 1.0)).collect();
            let inverse: Vec<f64> = (0..n).map(|_| random.between(0.1, 1.0)).collect();
            let open: Vec<bool> = (0..n).map(|_| random.below(4) > 0).collect();
            let damping = random.between(1e-3, 1.0);
            let own = Some(&own[..]);
            let step = OpenStep { open: &open, inverse: &inverse, own, damping, residual: &residual };
            let mut memory = SystemMemory::of_size(n_rows);
            let mut rows = Sparse::new(&layout, &jacobian, &mut memory);
            rows.clear();
            for k in (0..n).filter(|k| open[*k]) {
                rows.open(k, inverse[k]);
            }
            let (mut by_rows, mut by_columns) = (vec![0.25; n], vec![0.25; n]);
            let mut y = vec![0.0; n_rows];
            let v: Vec<f64> = (0..n).map(|_| random.between(-1.0, 1.0)).collect();
            let (mut from_rows, mut from_columns) = (vec![0.25; n], vec![0.25; n]);
            StepSystem::factor(&mut rows, &step).unwrap();
            rows.solve_factored(&(), &step, &mut y, &mut by_rows);
            rows.respond(&(), &step, &v, &mut y, &mut from_rows);
            let mut memory = SystemMemory::new(&layout);
            let paths = layout.paths.as_ref().unwrap();
            let mut columns = Branched::new(&layout, paths, &jacobian, &mut memory);
            columns.begin();
            for _ in 0..2 {
                // Twice: what was factored must not spoil what is kept.
                columns.factor(&step).unwrap();
                columns.solve_factored(&(), &step, &mut y, &mut by_columns);
                columns.respond(&(), &step, &v, &mut y, &mut from_columns);
                for (k, (a, b)) in from_rows.iter().zip(&from_columns).enumerate() {
                    assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} is not {b}");
                    assert!(open[k] || *b == 0.0, "what is closed does not answer");
                }
                for (k, (a, b)) in by_rows.iter().zip(&by_columns).enumerate() {
                    assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} is not {b}");
                    assert!(open[k] || *b == 0.25, "what is closed keeps its step");
                }
            }
        }
    }
}
