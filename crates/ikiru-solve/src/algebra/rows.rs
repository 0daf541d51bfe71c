//! The linear algebra of a step, over residual rows: `J Jᵀ`, its Cholesky factor, and products with columns.
//!
//! Two shapes of the same thing: [`Dense`] for problems of few rows, whose count the compiler knows and whose
//! loops it unrolls, and [`Sparse`] for all others, where each degree of freedom touches only the span of
//! rows below its joint. (Where that is less work, [`Branched`] takes the other side.)
//!
//! [`Branched`]: crate::algebra::branched::Branched

use crate::algebra::cholesky::{self, NotPositiveDefinite, factor_fixed, solve_fixed};
use crate::layout::{Layout, Span};

/// The columns of a Jacobian: what each degree of freedom does to the rows.
pub(crate) trait Columns {
    /// `v · j_k`
    fn dot(&self, k: usize, v: &[f64]) -> f64;
    /// `v += factor · j_k`
    fn add_column(&self, k: usize, factor: f64, v: &mut [f64]);
}

/// A symmetric positive definite system over rows, built from columns of a Jacobian.
pub(crate) trait RowSystem: Columns {
    /// What [`factor`](Self::factor) makes.
    type RowFactor;
    /// `A := 0`
    fn clear(&mut self);
    /// `A += factor · j_k j_kᵀ`
    fn add_outer(&mut self, k: usize, factor: f64);
    /// Factors `A + damping · I`. `A` stays as it is.
    fn factor(&mut self, damping: f64) -> Result<Self::RowFactor, NotPositiveDefinite>;
    /// `x := (A + damping · I)⁻¹ x` at once.
    fn solve(&mut self, damping: f64, x: &mut [f64]) -> Result<(), NotPositiveDefinite>;
    /// `x := (A + damping · I)⁻¹ x`, as it was factored.
    fn substitute(&self, factor: &Self::RowFactor, x: &mut [f64]);
}

/// What a step is solved for: `min ‖J δ + r‖² + δᵀ D δ + 2 gᵀ δ` over the open degrees of freedom.
pub(crate) struct OpenStep<'a> {
    /// Which degrees of freedom are solved for.
    pub(crate) open: &'a [bool],
    /// `damping / D`, for each degree of freedom.
    pub(crate) inverse: &'a [f64],
    /// `g`, where there are joint rows.
    pub(crate) own: Option<&'a [f64]>,
    pub(crate) damping: f64,
    /// `r`, with what the closed ones do to it.
    pub(crate) residual: &'a [f64],
}

/// What solves for a step, over rows or over degrees of freedom: the matrix `H = JᵀJ + D` of what is open.
pub(crate) trait StepSystem: Columns {
    /// What [`factor`](Self::factor) makes.
    type Factor;
    /// Takes over a new linearization.
    fn begin(&mut self);
    /// Closes every degree of freedom.
    fn clear(&mut self);
    /// Opens one, of the given `damping / D`.
    fn open(&mut self, k: usize, inverse: f64);
    /// Closes it again.
    fn close(&mut self, k: usize, inverse: f64);
    /// Solves for the open ones; the others keep their `delta`. `y` is memory over rows.
    fn solve_open(
        &mut self,
        step: &OpenStep<'_>,
        y: &mut [f64],
        delta: &mut [f64],
    ) -> Result<(), NotPositiveDefinite>;
    /// Factors the system of the open ones.
    fn factor(&mut self, step: &OpenStep<'_>) -> Result<Self::Factor, NotPositiveDefinite>;
    /// Solves for the open ones as they were factored.
    fn solve_factored(
        &mut self,
        factor: &Self::Factor,
        step: &OpenStep<'_>,
        y: &mut [f64],
        delta: &mut [f64],
    );
    /// `out := H⁻¹ v` of the open ones, 0 for the others.
    fn respond(
        &mut self,
        factor: &Self::Factor,
        step: &OpenStep<'_>,
        v: &[f64],
        y: &mut [f64],
        out: &mut [f64],
    );
}

impl<T: RowSystem> StepSystem for T {
    type Factor = T::RowFactor;

    #[inline(always)]
    fn begin(&mut self) {}

    #[inline(always)]
    fn clear(&mut self) {
        RowSystem::clear(self);
    }

    #[inline(always)]
    fn open(&mut self, k: usize, inverse: f64) {
        self.add_outer(k, inverse);
    }

    #[inline(always)]
    fn close(&mut self, k: usize, inverse: f64) {
        self.add_outer(k, -inverse);
    }

    #[inline(always)]
    fn solve_open(
        &mut self,
        step: &OpenStep<'_>,
        y: &mut [f64],
        delta: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        right_side(self, step, y);
        self.solve(step.damping, y)?;
        step_of_rows(self, step, y, delta);
        Ok(())
    }

    #[inline(always)]
    fn factor(&mut self, step: &OpenStep<'_>) -> Result<T::RowFactor, NotPositiveDefinite> {
        RowSystem::factor(self, step.damping)
    }

    #[inline(always)]
    fn solve_factored(
        &mut self,
        factor: &T::RowFactor,
        step: &OpenStep<'_>,
        y: &mut [f64],
        delta: &mut [f64],
    ) {
        right_side(self, step, y);
        self.substitute(factor, y);
        step_of_rows(self, step, y, delta);
    }

    #[inline(always)]
    fn respond(
        &mut self,
        factor: &T::RowFactor,
        step: &OpenStep<'_>,
        v: &[f64],
        y: &mut [f64],
        out: &mut [f64],
    ) {
        y.fill(0.0);
        for (k, v) in v.iter().enumerate() {
            if step.open[k] && *v != 0.0 {
                self.add_column(k, step.inverse[k] * v / step.damping, y);
            }
        }
        self.substitute(factor, y);
        for (k, v) in v.iter().enumerate() {
            out[k] = if step.open[k] { step.inverse[k] * (v / step.damping - self.dot(k, y)) } else { 0.0 };
        }
    }
}

/// `y := r − J D⁻¹ g`
#[inline(always)]
fn right_side(rows: &impl Columns, step: &OpenStep<'_>, y: &mut [f64]) {
    let n = step.open.len();
    let (inverse, damping) = (&step.inverse[..n], step.damping);
    y.copy_from_slice(step.residual);
    if let Some(own) = step.own {
        for k in 0..n {
            if step.open[k] {
                rows.add_column(k, -inverse[k] * own[k] / damping, y);
            }
        }
    }
}

/// `δ = −D⁻¹ (g + Jᵀ y)`
#[inline(always)]
fn step_of_rows(rows: &impl Columns, step: &OpenStep<'_>, y: &[f64], delta: &mut [f64]) {
    let n = step.open.len();
    let (inverse, delta) = (&step.inverse[..n], &mut delta[..n]);
    for k in 0..n {
        if step.open[k] {
            let own = step.own.map_or(0.0, |own| own[k] / step.damping);
            delta[k] = -inverse[k] * (own + rows.dot(k, y));
        }
    }
}

/// Rows of which the compiler knows the number.
pub(crate) struct Dense<'a, const M: usize> {
    columns: &'a [[f64; M]],
    matrix: [[f64; M]; M],
}

impl<'a, const M: usize> Dense<'a, M> {
    pub(crate) fn new(jacobian: &'a [f64]) -> Self {
        Self { columns: jacobian.as_chunks::<M>().0, matrix: [[0.0; M]; M] }
    }
}

/// The first `M` entries; a layout gives every vector over rows at least that many.
#[inline(always)]
fn head<const M: usize>(v: &[f64]) -> &[f64; M] {
    v.first_chunk().unwrap_or(&[0.0; M])
}

impl<const M: usize> Columns for Dense<'_, M> {
    #[inline(always)]
    fn dot(&self, k: usize, v: &[f64]) -> f64 {
        let (column, v) = (&self.columns[k], head::<M>(v));
        let mut sum = 0.0;
        for i in 0..M {
            sum += column[i] * v[i];
        }
        sum
    }

    #[inline(always)]
    fn add_column(&self, k: usize, factor: f64, v: &mut [f64]) {
        let column = &self.columns[k];
        if let Some(v) = v.first_chunk_mut::<M>() {
            for i in 0..M {
                v[i] += factor * column[i];
            }
        }
    }
}

impl<const M: usize> RowSystem for Dense<'_, M> {
    type RowFactor = [[f64; M]; M];

    #[inline(always)]
    fn clear(&mut self) {
        self.matrix = [[0.0; M]; M];
    }

    #[inline(always)]
    fn add_outer(&mut self, k: usize, factor: f64) {
        let column = &self.columns[k];
        for i in 0..M {
            let f = factor * column[i];
            for j in 0..=i {
                self.matrix[i][j] += f * column[j];
            }
        }
    }

    #[inline(always)]
    fn factor(&mut self, damping: f64) -> Result<[[f64; M]; M], NotPositiveDefinite> {
        let mut a = self.matrix;
        factor_fixed(&mut a, damping)?;
        Ok(a)
    }

    #[inline(always)]
    fn solve(&mut self, damping: f64, x: &mut [f64]) -> Result<(), NotPositiveDefinite> {
        let mut a = self.matrix;
        factor_fixed(&mut a, damping)?;
        self.substitute(&a, x);
        Ok(())
    }

    #[inline(always)]
    fn substitute(&self, a: &[[f64; M]; M], x: &mut [f64]) {
        if let Some(x) = x.first_chunk_mut::<M>() {
            solve_fixed(a, x);
        }
    }
}

/// Memory of a system whose size the compiler does not know: [`Sparse`], or
/// [`Branched`](crate::algebra::branched::Branched).
#[derive(Clone, Debug, Default)]
pub(crate) struct SystemMemory {
    /// The matrix without damping, its lower half.
    pub(crate) matrix: Vec<f64>,
    /// Its factor with damping, and one right side.
    pub(crate) factor: Vec<f64>,
}

impl SystemMemory {
    pub(crate) fn new(layout: &Layout) -> Self {
        match (layout.dense_rows, &layout.paths) {
            (Some(_), _) => Self::of_size(0),
            (None, Some(paths)) => Self {
                matrix: vec![0.0; paths.n_entries()],
                factor: vec![0.0; paths.n_entries() + layout.n_dofs],
            },
            (None, None) => Self::of_size(layout.n_rows),
        }
    }

    /// Memory for a system of some number of unknowns.
    pub(crate) fn of_size(n: usize) -> Self {
        Self { matrix: vec![0.0; n * n], factor: vec![0.0; n * n + n] }
    }
}

/// Columns of any length: each is the span of rows that its degree of freedom can move.
#[derive(Clone, Copy)]
pub(crate) struct SpanColumns<'a> {
    spans: &'a [Span],
    jacobian: &'a [f64],
}

impl<'a> SpanColumns<'a> {
    pub(crate) fn new(layout: &'a Layout, jacobian: &'a [f64]) -> Self {
        Self { spans: &layout.spans, jacobian }
    }

    /// The first row of a column, and its entries.
    #[inline(always)]
    pub(crate) fn column(&self, k: usize) -> (usize, &'a [f64]) {
        let span = self.spans[k];
        (span.first, &self.jacobian[span.start..span.start + span.len])
    }
}

impl Columns for SpanColumns<'_> {
    #[inline]
    fn dot(&self, k: usize, v: &[f64]) -> f64 {
        let (first, column) = self.column(k);
        cholesky::dot(column, &v[first..first + column.len()])
    }

    #[inline]
    fn add_column(&self, k: usize, factor: f64, v: &mut [f64]) {
        let (first, column) = self.column(k);
        for (v, j) in v[first..].iter_mut().zip(column) {
            *v += factor * j;
        }
    }
}

/// Any number of rows.
pub(crate) struct Sparse<'a> {
    n_rows: usize,
    columns: SpanColumns<'a>,
    memory: &'a mut SystemMemory,
}

impl<'a> Sparse<'a> {
    pub(crate) fn new(layout: &'a Layout, jacobian: &'a [f64], memory: &'a mut SystemMemory) -> Self {
        Self { n_rows: layout.n_rows, columns: SpanColumns::new(layout, jacobian), memory }
    }
}

impl Columns for Sparse<'_> {
    #[inline]
    fn dot(&self, k: usize, v: &[f64]) -> f64 {
        self.columns.dot(k, v)
    }

    #[inline]
    fn add_column(&self, k: usize, factor: f64, v: &mut [f64]) {
        self.columns.add_column(k, factor, v);
    }
}

impl RowSystem for Sparse<'_> {
    /// It lies in the memory.
    type RowFactor = ();

    fn clear(&mut self) {
        self.memory.matrix.fill(0.0);
    }

    fn add_outer(&mut self, k: usize, factor: f64) {
        let (first, column) = self.columns.column(k);
        for i in 0..column.len() {
            let f = factor * column[i];
            let at = (first + i) * self.n_rows + first;
            for (a, j) in self.memory.matrix[at..=at + i].iter_mut().zip(column) {
                *a += f * j;
            }
        }
    }

    fn factor(&mut self, damping: f64) -> Result<(), NotPositiveDefinite> {
        let m = self.n_rows;
        let a = &mut self.memory.factor[..m * m];
        a.copy_from_slice(&self.memory.matrix);
        for i in 0..m {
            a[i * m + i] += damping;
        }
        cholesky::factor(m, a)
    }

    fn solve(&mut self, damping: f64, x: &mut [f64]) -> Result<(), NotPositiveDefinite> {
        RowSystem::factor(self, damping)?;
        self.substitute(&(), x);
        Ok(())
    }

    fn substitute(&self, (): &(), x: &mut [f64]) {
        cholesky::solve(self.n_rows, &self.memory.factor, x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ikiru_testkit::rigs::Random;

    #[test]
    fn both_shapes_solve_the_same_system() {
        let mut random = Random::new(3);
        let columns: Vec<f64> = (0..4 * 6).map(|_| random.between(-1.0, 1.0)).collect();
        let spans: Vec<Span> = (0..4).map(|k| Span { first: 0, len: 6, start: 6 * k }).collect();
        let layout = Layout { n_rows: 6, spans, ..Layout::default() };
        let mut memory = SystemMemory::of_size(6);
        let (mut dense, mut sparse) =
            (Dense::<6>::new(&columns), Sparse::new(&layout, &columns, &mut memory));
        RowSystem::clear(&mut dense);
        RowSystem::clear(&mut sparse);
        for k in 0..4 {
            dense.add_outer(k, 1.0 + k as f64);
            sparse.add_outer(k, 1.0 + k as f64);
        }
        let b = [1.0, -2.0, 0.5, 3.0, 0.0, -1.0];
        let (mut x, mut y) = (b, b);
        let factor = RowSystem::factor(&mut dense, 0.1).unwrap();
        dense.substitute(&factor, &mut x);
        RowSystem::factor(&mut sparse, 0.1).unwrap();
        sparse.substitute(&(), &mut y);
        // (A + 0.1 I) x = b, recomputed from the columns.
        let mut back = x.map(|v| 0.1 * v);
        for k in 0..4 {
            let along = dense.dot(k, &x) * (1.0 + k as f64);
            dense.add_column(k, along, &mut back);
        }
        for i in 0..6 {
            assert!((x[i] - y[i]).abs() < 1e-12 && (back[i] - b[i]).abs() < 1e-12);
        }
        assert!(RowSystem::factor(&mut dense, 0.0).is_err(), "four columns do not span six rows");
    }
}
