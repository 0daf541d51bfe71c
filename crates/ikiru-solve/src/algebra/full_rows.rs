//! Rows of derivatives: what guards need of them, and such as have an entry for every degree of freedom of a pose.

use crate::algebra::sample_rows::SampleRows;

/// Residuals, and their derivatives by what a step moves.
pub(crate) trait Derivatives {
    /// The residual of each row, as of the last linearization.
    fn residual(&self) -> &[f64];
    /// `y += A x`
    fn add_product(&self, x: &[f64], y: &mut [f64]);
    /// `x += Aᵀ y` for a `y` that is made row by row.
    fn add_transposed_of(&self, y: impl Fn(usize) -> f64, x: &mut [f64]);
}

/// Few rows with all their entries.
#[derive(Clone, Debug, Default)]
pub(crate) struct FullRows {
    n_dofs: usize,
    pub(crate) residual: Vec<f64>,
    /// Row by row.
    pub(crate) jacobian: Vec<f64>,
}

impl FullRows {
    /// So many rows of zeros.
    pub(crate) fn new(n_rows: usize, n_dofs: usize) -> Self {
        Self { n_dofs, residual: vec![0.0; n_rows], jacobian: vec![0.0; n_rows * n_dofs] }
    }

    /// The derivative of one row.
    #[inline(always)]
    pub(crate) fn entries(&self, row: usize) -> &[f64] {
        &self.jacobian[row * self.n_dofs..(row + 1) * self.n_dofs]
    }

    /// What the linear model says of one row's change.
    #[inline(always)]
    pub(crate) fn along(&self, row: usize, x: &[f64]) -> f64 {
        self.entries(row).iter().zip(x).map(|(a, x)| a * x).sum()
    }

    /// Adds a multiple of one row.
    #[inline(always)]
    pub(crate) fn add(&self, row: usize, factor: f64, x: &mut [f64]) {
        x.iter_mut().zip(self.entries(row)).for_each(|(x, a)| *x += factor * a);
    }
}

impl Derivatives for FullRows {
    fn residual(&self) -> &[f64] {
        &self.residual
    }

    fn add_product(&self, x: &[f64], y: &mut [f64]) {
        y.iter_mut().enumerate().for_each(|(row, y)| *y += self.along(row, x));
    }

    fn add_transposed_of(&self, y: impl Fn(usize) -> f64, x: &mut [f64]) {
        let rows = (0..self.residual.len()).map(|row| (row, y(row)));
        rows.filter(|(_, y)| *y != 0.0).for_each(|(row, y)| self.add(row, y, x));
    }
}

impl Derivatives for SampleRows {
    fn residual(&self) -> &[f64] {
        &self.residual
    }

    fn add_product(&self, x: &[f64], y: &mut [f64]) {
        Self::add_product(self, x, y);
    }

    fn add_transposed_of(&self, y: impl Fn(usize) -> f64, x: &mut [f64]) {
        Self::add_transposed_of(self, y, x);
    }
}
