//! Symmetric matrices over time whose entries lie within three samples of the diagonal: what smoothness of up to the
//! third order couples.

use crate::algebra::cholesky::NotPositiveDefinite;
use crate::algebra::room::make_room;

/// The diagonal and three above it, one row a sample: `rows[t][d]` is the entry `(t, t + d)`.
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
                matrix.add_square(first, stencil, weight);
            }
        }
        matrix
    }

    /// As [`smoothness`](Self::smoothness), with the differences across the ends at which the motion is at rest: there it goes on as
    /// if samples like the first or the last stood before or behind it.
    pub(crate) fn smoothness_at_rest(n: usize, weights: [f64; 3], at_rest: [bool; 2]) -> Self {
        let mut matrix = Self::smoothness(n, weights);
        let [_, acceleration, jerk] = weights;
        let ends: [(usize, usize, &[f64]); 2] = [(0, 0, &[2.0, -3.0, 1.0]), (2, 3, &[-1.0, 3.0, -2.0])];
        for ((step, pair, bend), _) in ends.iter().zip(at_rest).filter(|(_, at_rest)| *at_rest) {
            if n >= 2 {
                matrix.add_square(if *step == 0 { 0 } else { n - step }, STENCILS[0], acceleration + jerk);
            }
            if n >= 3 {
                matrix.add_square(if *pair == 0 { 0 } else { n - pair }, bend, jerk);
            }
        }
        if n == 2 && at_rest == [true; 2] {
            matrix.add_square(0, &[-2.0, 2.0], jerk);
        }
        matrix
    }

    /// Adds `weight (Σ stencil · x)²` from an entry on.
    fn add_square(&mut self, first: usize, stencil: &[f64], weight: f64) {
        for (i, a) in stencil.iter().enumerate() {
            for (j, b) in stencil.iter().enumerate().skip(i) {
                self.rows[first + i][j - i] += weight * a * b;
            }
        }
    }

    /// `y += A x`
    #[cfg(test)]
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

    /// Replaces the matrix by its Cholesky factor `Lᵀ` (rows of the upper triangle), reciprocals on its diagonal. An error where it is
    /// not positive definite.
    pub(crate) fn factor(&mut self) -> Result<(), NotPositiveDefinite> {
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
                return Err(NotPositiveDefinite { row: t });
            }
            let reciprocal = 1.0 / row[0].sqrt();
            self.rows[t] = [reciprocal, row[1] * reciprocal, row[2] * reciprocal, row[3] * reciprocal];
        }
        Ok(())
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

impl Banded {
    /// `X := A⁻¹ X` for a matrix of `width` columns, sample by sample, that was [factored](Self::factor): all
    /// columns at once, where each alone would wait for itself.
    pub(crate) fn solve_columns(&self, width: usize, x: &mut [f64]) {
        let n = self.rows.len();
        for t in 0..n {
            let row = &self.rows[t];
            let (this, after) = x[t * width..].split_at_mut(width);
            this.iter_mut().for_each(|x| *x *= row[0]);
            for d in 1..4.min(n - t) {
                for (y, x) in after[(d - 1) * width..d * width].iter_mut().zip(&*this) {
                    *y -= row[d] * x;
                }
            }
        }
        for t in (0..n).rev() {
            let row = &self.rows[t];
            let (this, after) = x[t * width..].split_at_mut(width);
            for d in 1..4.min(n - t) {
                for (x, y) in this.iter_mut().zip(&after[(d - 1) * width..d * width]) {
                    *x -= row[d] * y;
                }
            }
            this.iter_mut().for_each(|x| *x *= row[0]);
        }
    }
}

/// One such matrix for each degree of freedom, sample by sample, so that all are worked on at once: entry
/// `(t, t + d)` of number `k` is `rows[(4 t + d) n + k]`.
#[derive(Clone, Debug, Default)]
pub(crate) struct BandedLines {
    n: usize,
    rows: Vec<f64>,
}

impl BandedLines {
    /// Makes room for `n` degrees of freedom over some samples.
    pub(crate) fn make_room(&mut self, n: usize, n_samples: usize) {
        make_room(&mut self.rows, 4 * n * n_samples);
    }

    /// Zeros for `n` degrees of freedom over some samples.
    pub(crate) fn clear(&mut self, n: usize, n_samples: usize) {
        self.n = n;
        self.rows.clear();
        self.rows.resize(4 * n * n_samples, 0.0);
    }

    /// Sets one of them.
    pub(crate) fn set(&mut self, k: usize, matrix: &Banded) {
        for (t, row) in matrix.rows.iter().enumerate() {
            for (d, entry) in row.iter().enumerate() {
                self.rows[(4 * t + d) * self.n + k] = *entry;
            }
        }
    }

    /// Adds to entry `(t, t + d)` of one of them.
    #[inline]
    pub(crate) fn add(&mut self, t: usize, d: usize, k: usize, value: f64) {
        self.rows[(4 * t + d) * self.n + k] += value;
    }

    /// Adds one of them to a matrix.
    pub(crate) fn add_to(&self, k: usize, matrix: &mut Banded) {
        for (t, row) in matrix.rows.iter_mut().enumerate() {
            for (d, entry) in row.iter_mut().enumerate() {
                *entry += self.rows[(4 * t + d) * self.n + k];
            }
        }
    }

    /// `y += A x` of all lines, sample by sample.
    pub(crate) fn add_product(&self, x: &[f64], y: &mut [f64]) {
        let n = self.n;
        let n_samples = x.len().checked_div(n).unwrap_or(0);
        for t in 0..n_samples {
            for d in 0..4.min(n_samples - t) {
                let row = &self.rows[(4 * t + d) * n..(4 * t + d + 1) * n];
                for (k, entry) in row.iter().enumerate() {
                    y[t * n + k] += entry * x[(t + d) * n + k];
                    if d > 0 {
                        y[(t + d) * n + k] += entry * x[t * n + k];
                    }
                }
            }
        }
    }

    /// The mean of what is on the diagonals.
    pub(crate) fn mean_diagonal(&self) -> f64 {
        let n = self.n.max(1);
        let sum: f64 = self.rows.chunks_exact(4 * n).flat_map(|rows| &rows[..n]).sum();
        sum / (self.rows.len() / 4).max(1) as f64
    }

    /// As [`Banded::factor`], all of them; an error where one is not positive definite.
    pub(crate) fn factor(&mut self) -> Result<(), NotPositiveDefinite> {
        let n = self.n;
        let n_samples = self.rows.len().checked_div(4 * n).unwrap_or(0);
        for t in 0..n_samples {
            let (before, this) = self.rows.split_at_mut(4 * n * t);
            let this = &mut this[..4 * n];
            let mut least = f64::INFINITY;
            for k in 0..n {
                let full = this[k];
                for back in 1..4.min(t + 1) {
                    let above = &before[4 * n * (t - back)..];
                    let l = above[back * n + k];
                    for d in 0..4 - back {
                        this[d * n + k] -= l * above[(back + d) * n + k];
                    }
                }
                least = least.min(this[k] - full * 1e-15);
                let reciprocal = 1.0 / this[k].max(f64::MIN_POSITIVE).sqrt();
                this[k] = reciprocal;
                for d in 1..4 {
                    this[d * n + k] *= reciprocal;
                }
            }
            if least <= 0.0 {
                return Err(NotPositiveDefinite { row: t });
            }
        }
        Ok(())
    }

    /// `x := A⁻¹ x` of all lines, `x` being sample by sample, for what was [factored](Self::factor).
    pub(crate) fn solve(&self, x: &mut [f64]) {
        let n = self.n;
        let n_samples = x.len().checked_div(n).unwrap_or(0);
        for t in 0..n_samples {
            let row = &self.rows[4 * n * t..4 * n * (t + 1)];
            let (this, after) = x[t * n..].split_at_mut(n);
            for (x, reciprocal) in this.iter_mut().zip(row) {
                *x *= reciprocal;
            }
            for d in 1..4.min(n_samples - t) {
                for ((y, x), l) in after[(d - 1) * n..d * n].iter_mut().zip(&*this).zip(&row[d * n..]) {
                    *y -= l * x;
                }
            }
        }
        for t in (0..n_samples).rev() {
            let row = &self.rows[4 * n * t..4 * n * (t + 1)];
            let (this, after) = x[t * n..].split_at_mut(n);
            for d in 1..4.min(n_samples - t) {
                for ((x, y), l) in this.iter_mut().zip(&after[(d - 1) * n..d * n]).zip(&row[d * n..]) {
                    *x -= l * y;
                }
            }
            for (x, reciprocal) in this.iter_mut().zip(row) {
                *x *= reciprocal;
            }
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
    fn at_rest_means_more_samples_of_the_same() {
        let mut random = Random::new(4);
        for n in [2, 3, 4, 9] {
            for at_rest in [[true, false], [false, true], [true, true]] {
                let x: Vec<f64> = (0..n).map(|_| random.between(-1.0, 1.0)).collect();
                let weights = [0.3, 0.7, 1.1];
                let mut padded = x.clone();
                if at_rest[0] {
                    padded.splice(0..0, [x[0]; 3]);
                }
                if at_rest[1] {
                    padded.extend([x[n - 1]; 3]);
                }
                let mut differences = padded;
                let mut expected = 0.0;
                for weight in weights {
                    differences = differences.windows(2).map(|w| w[1] - w[0]).collect();
                    expected += weight * differences.iter().map(|d| d * d).sum::<f64>();
                }
                let mut product = vec![0.0; n];
                Banded::smoothness_at_rest(n, weights, at_rest).add_product(&x, &mut product);
                let form: f64 = product.iter().zip(&x).map(|(a, b)| a * b).sum();
                assert!((form - expected).abs() < 1e-12, "{n} {at_rest:?}: {form} is not {expected}");
            }
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
            matrix.factor().unwrap();
            let mut columns: Vec<f64> = y.iter().flat_map(|y| [*y, -2.0 * y]).collect();
            matrix.solve_from(0, &mut y);
            assert!(x.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-9));
            matrix.solve_columns(2, &mut columns);
            let both = x.iter().flat_map(|x| [*x, -2.0 * x]);
            assert!(both.zip(&columns).all(|(a, b)| (a - b).abs() < 1e-9));
        }
        let free = Banded::smoothness(5, [1.0, 0.0, 0.0]).factor();
        assert_eq!(free, Err(NotPositiveDefinite { row: 4 }), "a shift of all samples is free");
    }

    #[test]
    fn many_at_once_solve_as_one_alone() {
        let mut random = Random::new(3);
        for n_samples in [1, 3, 20] {
            let n = 3;
            let (mut lines, mut alone) = (BandedLines::default(), Vec::new());
            lines.clear(n, n_samples);
            for k in 0..n {
                let mut matrix = Banded::smoothness(n_samples, [0.5, 0.2, 0.1]);
                for row in &mut matrix.rows {
                    row[0] += random.between(0.01, 1.0);
                }
                lines.set(k, &matrix);
                alone.push(matrix);
            }
            let mut x: Vec<f64> = (0..n * n_samples).map(|_| random.between(-1.0, 1.0)).collect();
            let expected = x.clone();
            lines.factor().unwrap();
            lines.solve(&mut x);
            for (k, matrix) in alone.iter_mut().enumerate() {
                matrix.factor().unwrap();
                let mut line: Vec<f64> = (0..n_samples).map(|t| expected[t * n + k]).collect();
                matrix.solve_from(0, &mut line);
                assert!((0..n_samples).all(|t| (x[t * n + k] - line[t]).abs() < 1e-12));
            }
        }
        let mut singular = BandedLines::default();
        singular.clear(1, 5);
        singular.set(0, &Banded::smoothness(5, [1.0, 0.0, 0.0]));
        assert!(singular.factor().is_err());
    }
}
