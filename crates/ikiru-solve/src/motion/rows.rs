//! The residual rows of all frames at which something is wanted, and the small dense system over them.

use crate::objective::Loss;

/// The rows of one frame: `n_rows` from `first` on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub(crate) frame: usize,
    pub(crate) first: usize,
    pub(crate) n_rows: usize,
}

/// Rows that belong together: what the loss is applied to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowPart {
    pub(crate) first: usize,
    pub(crate) n_rows: usize,
    /// λ of its term.
    pub(crate) term_weight: f64,
    pub(crate) loss: Loss,
    /// `λ · ρ'`, by whose root the rows are scaled.
    pub(crate) weight: f64,
}

/// All rows of a motion, as of the last linearization.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameRows {
    pub(crate) n_dofs: usize,
    pub(crate) blocks: Vec<Block>,
    pub(crate) parts: Vec<RowPart>,
    /// Scaled residuals.
    pub(crate) residual: Vec<f64>,
    /// Row by row, by the degrees of freedom of the row's own frame.
    pub(crate) jacobian: Vec<f64>,
}

impl FrameRows {
    pub(crate) fn clear(&mut self) {
        self.blocks.clear();
        self.parts.clear();
        self.residual.clear();
        self.jacobian.clear();
    }

    pub(crate) fn n_rows(&self) -> usize {
        self.residual.len()
    }

    /// The derivative of one row.
    #[inline]
    pub(crate) fn row(&self, row: usize) -> &[f64] {
        &self.jacobian[row * self.n_dofs..(row + 1) * self.n_dofs]
    }

    /// `y += J x`, `x` being the tangents of all frames.
    pub(crate) fn add_product(&self, x: &[f64], y: &mut [f64]) {
        let n = self.n_dofs;
        for block in &self.blocks {
            let x = &x[block.frame * n..(block.frame + 1) * n];
            for row in block.first..block.first + block.n_rows {
                y[row] += self.row(row).iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }

    /// `x += Jᵀ y`
    pub(crate) fn add_transposed(&self, y: &[f64], x: &mut [f64]) {
        let n = self.n_dofs;
        for block in &self.blocks {
            let x = &mut x[block.frame * n..(block.frame + 1) * n];
            for row in block.first..block.first + block.n_rows {
                for (x, a) in x.iter_mut().zip(self.row(row)) {
                    *x += a * y[row];
                }
            }
        }
    }
}

/// `x := A⁻¹ x` for a symmetric positive definite matrix of `n` rows, of which the lower triangle is read and
/// replaced by its Cholesky factor; false where it is not positive definite.
pub(crate) fn solve_dense(n: usize, a: &mut [f64], x: &mut [f64]) -> bool {
    for i in 0..n {
        let (above, row) = a.split_at_mut(i * n);
        let row = &mut row[..=i];
        for j in 0..i {
            let other = &above[j * n..=j * n + j];
            let known: f64 = row[..j].iter().zip(&other[..j]).map(|(a, b)| a * b).sum();
            row[j] = (row[j] - known) * other[j];
        }
        let full = row[i];
        let pivot = full - row[..i].iter().map(|v| v * v).sum::<f64>();
        if !(pivot > full * 1e-15) {
            return false;
        }
        row[i] = 1.0 / pivot.sqrt();
    }
    for i in 0..n {
        let row = &a[i * n..=i * n + i];
        let known: f64 = row[..i].iter().zip(&x[..i]).map(|(a, b)| a * b).sum();
        x[i] = (x[i] - known) * row[i];
    }
    for i in (0..n).rev() {
        let row = &a[i * n..=i * n + i];
        x[i] *= row[i];
        let (before, this) = x.split_at_mut(i);
        for (b, l) in before.iter_mut().zip(row) {
            *b -= l * this[0];
        }
    }
    true
}
