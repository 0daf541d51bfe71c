//! The step's system over degrees of freedom, for problems of many more rows than those: `JᵀJ`, built once a
//! linearization, and its Cholesky factor for what is open.

use crate::algebra::cholesky::{self, NotPositiveDefinite};
use crate::algebra::rows::{Columns, OpenStep, StepSystem, SystemMemory};
use crate::layout::{Layout, Span};

/// Many rows over few degrees of freedom. A column is the span of rows that its degree of freedom can move; the memory's
/// matrix is the lower half of `JᵀJ`.
pub(crate) struct Tall<'a> {
    spans: &'a [Span],
    jacobian: &'a [f64],
    memory: &'a mut SystemMemory,
}

impl<'a> Tall<'a> {
    pub(crate) fn new(layout: &'a Layout, jacobian: &'a [f64], memory: &'a mut SystemMemory) -> Self {
        Self { spans: &layout.spans, jacobian, memory }
    }

    fn column(&self, k: usize) -> (usize, &'a [f64]) {
        let span = self.spans[k];
        (span.first, &self.jacobian[span.start..span.start + span.len])
    }
}

/// `a · b` in eight sums, always in one order, which the compiler turns into vector code.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let ((a, a_rest), (b, b_rest)) = (a[..n].as_chunks::<8>(), b[..n].as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

impl Columns for Tall<'_> {
    fn dot(&self, k: usize, v: &[f64]) -> f64 {
        let (first, column) = self.column(k);
        dot(column, &v[first..])
    }

    fn add_column(&self, k: usize, factor: f64, v: &mut [f64]) {
        let (first, column) = self.column(k);
        for (v, j) in v[first..].iter_mut().zip(column) {
            *v += factor * j;
        }
    }
}

impl StepSystem for Tall<'_> {
    /// It lies in the memory.
    type Factor = ();

    fn begin(&mut self) {
        let n = self.spans.len();
        for k in 0..n {
            let (first, column) = self.column(k);
            for l in 0..=k {
                let (other_first, other) = self.column(l);
                // Only the rows that both can move.
                let from = first.max(other_first);
                let to = (first + column.len()).min(other_first + other.len());
                let shared = if from < to {
                    dot(&column[from - first..to - first], &other[from - other_first..to - other_first])
                } else {
                    0.0
                };
                self.memory.matrix[k * n + l] = shared;
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
        let n = self.spans.len();
        let (matrix, factor) = (&self.memory.matrix, &mut self.memory.factor[..n * n]);
        for k in 0..n {
            let row = &mut factor[k * n..=k * n + k];
            if step.open[k] {
                row.copy_from_slice(&matrix[k * n..=k * n + k]);
                for (l, entry) in row[..k].iter_mut().enumerate() {
                    if !step.open[l] {
                        *entry = 0.0;
                    }
                }
                row[k] += step.damping / step.inverse[k];
            } else {
                row.fill(0.0);
                row[k] = 1.0;
            }
        }
        cholesky::factor(n, factor)
    }

    fn solve_factored(&mut self, (): &(), step: &OpenStep<'_>, _: &mut [f64], delta: &mut [f64]) {
        let n = self.spans.len();
        let mut memory = std::mem::take(&mut self.memory.factor);
        // The right side lies behind the matrix.
        let (factor, right) = memory.split_at_mut(n * n);
        for k in 0..n {
            let pull = || step.own.map_or(0.0, |own| own[k]) + self.dot(k, step.residual);
            right[k] = if step.open[k] { -pull() } else { 0.0 };
        }
        cholesky::solve(n, factor, right);
        for k in (0..n).filter(|k| step.open[*k]) {
            delta[k] = right[k];
        }
        self.memory.factor = memory;
    }

    fn respond(&mut self, (): &(), step: &OpenStep<'_>, v: &[f64], _: &mut [f64], out: &mut [f64]) {
        for (k, out) in out.iter_mut().enumerate() {
            *out = if step.open[k] { v[k] } else { 0.0 };
        }
        cholesky::solve(self.spans.len(), &self.memory.factor, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::rows::Sparse;
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
        (Layout { n_rows, n_dofs: n, spans, is_tall: true, ..Layout::default() }, jacobian)
    }

    #[test]
    fn the_smaller_side_takes_the_same_step_as_the_larger() {
        let mut random = Random::new(5);
        for _ in 0..50 {
            let (n_rows, n) = (8 + random.below(40), 1 + random.below(7));
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
            let mut columns = Tall::new(&layout, &jacobian, &mut memory);
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
