//! Symmetric matrices over time whose entries lie within three frames of the diagonal: what smoothness of up to the
//! third order couples.

/// The diagonal and three above it, one row a frame: `rows[t][d]` is the entry `(t, t + d)`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Banded {
    pub(crate) rows: Vec<[f64; 4]>,
}

/// Differences of order 1, 2 and 3 (equation 25).
const STENCILS: [&[f64]; 3] = [&[-1.0, 1.0], &[1.0, -2.0, 1.0], &[-1.0, 3.0, -3.0, 1.0]];

impl Banded {
    pub(crate) fn zeros(n: usize) -> Self {
        Self { rows: vec![[0.0; 4]; n] }
    }

    /// `Σ wₙ Dₙᵀ Dₙ` for the differences of order 1 to 3.
    pub(crate) fn smoothness(n: usize, weights: [f64; 3]) -> Self {
        let mut matrix = Self::zeros(n);
        for (stencil, weight) in STENCILS.iter().zip(weights) {
            if weight == 0.0 {
                continue;
            }
            for first in 0..(n + 1).saturating_sub(stencil.len()) {
                for (i, a) in stencil.iter().enumerate() {
                    for (j, b) in stencil.iter().enumerate().skip(i) {
                        matrix.rows[first + i][j - i] += weight * a * b;
                    }
                }
            }
        }
        matrix
    }

    /// `y += A x`
    pub(crate) fn add_product(&self, x: &[f64], y: &mut [f64]) {
        let n = self.rows.len();
        for t in 0..n {
            let row = &self.rows[t];
            y[t] += row[0] * x[t];
            for d in 1..4.min(n - t) {
                y[t] += row[d] * x[t + d];
                y[t + d] += row[d] * x[t];
            }
        }
    }

    /// Replaces the matrix by its Cholesky factor `Lᵀ` (rows of the upper triangle), reciprocals on its diagonal; false where it is not
    /// positive definite.
    pub(crate) fn factor(&mut self) -> bool {
        let n = self.rows.len();
        for t in 0..n {
            let before = t.saturating_sub(3)..t;
            let mut row = self.rows[t];
            let full = row[0];
            for s in before {
                let above = self.rows[s];
                let l = above[t - s];
                for d in 0..4 - (t - s) {
                    row[d] -= l * above[t - s + d];
                }
            }
            if row[0] <= full * 1e-15 {
                return false;
            }
            let reciprocal = 1.0 / row[0].sqrt();
            self.rows[t] = [reciprocal, row[1] * reciprocal, row[2] * reciprocal, row[3] * reciprocal];
        }
        true
    }

    /// `x := A⁻¹ x`, for a matrix that was [factored](Self::factor). Entries before `first` are zero and stay
    /// out of the way down.
    pub(crate) fn solve_from(&self, first: usize, x: &mut [f64]) {
        let n = self.rows.len();
        for t in first..n {
            let row = &self.rows[t];
            x[t] *= row[0];
            for d in 1..4.min(n - t) {
                x[t + d] -= row[d] * x[t];
            }
        }
        for t in (0..n).rev() {
            let row = &self.rows[t];
            let mut sum = x[t];
            for d in 1..4.min(n - t) {
                sum -= row[d] * x[t + d];
            }
            x[t] = sum * row[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ikiru_testkit::rigs::Random;

    #[test]
    fn the_quadratic_form_is_the_sum_of_squared_differences() {
        let mut random = Random::new(1);
        for n in [2, 3, 4, 7] {
            let x: Vec<f64> = (0..n).map(|_| random.between(-1.0, 1.0)).collect();
            let weights = [0.3, 0.7, 1.1];
            let mut differences = x.clone();
            let mut expected = 0.0;
            for weight in weights {
                differences = differences.windows(2).map(|w| w[1] - w[0]).collect();
                expected += weight * differences.iter().map(|d| d * d).sum::<f64>();
            }
            let mut product = vec![0.0; n];
            Banded::smoothness(n, weights).add_product(&x, &mut product);
            let form: f64 = product.iter().zip(&x).map(|(a, b)| a * b).sum();
            assert!((form - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn solutions_solve() {
        let mut random = Random::new(2);
        for n in [1, 2, 5, 40] {
            let mut matrix = Banded::smoothness(n, [0.5, 0.2, 0.1]);
            for row in &mut matrix.rows {
                row[0] += random.between(0.01, 1.0);
            }
            let x: Vec<f64> = (0..n).map(|_| random.between(-1.0, 1.0)).collect();
            let mut y = vec![0.0; n];
            matrix.add_product(&x, &mut y);
            assert!(matrix.factor());
            matrix.solve_from(0, &mut y);
            assert!(x.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-9));
        }
        assert!(!Banded::smoothness(5, [1.0, 0.0, 0.0]).factor(), "a shift of all frames is free");
    }
}
