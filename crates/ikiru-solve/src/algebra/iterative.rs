//! The step of a motion with targets at most of its samples: too many rows to solve over, so that the
//! normal equations are solved by conjugate gradients.
//!
//! At each sample rows fix a few directions `Jₜ` and leave the others to smoothness. Along what they fix, the rows alone
//! are the matrix, sample by sample; along what they leave, smoothness alone is, one degree of freedom at a time over all
//! samples. With `B = (Jₜᵀ Jₜ + s)⁻¹` and `P = s B`, which keeps what the rows leave, the preconditioner is
//! `P A⁻¹ P + B (1 − P)`: exact where smoothness `A` is `s` times the identity.

use crate::algebra::banded::BandedLines;
use crate::algebra::cholesky::{self, NotPositiveDefinite, dot};
use crate::algebra::room::make_room;
use crate::algebra::sample_rows::SampleRows;

/// How far the residual must fall; the step is one of many.
const TOLERANCE: f64 = 0.02;
/// Most iterations for one step.
const MOST_ITERATIONS: usize = 60;

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct Iterative {
    /// `A`, factored.
    over_time: BandedLines,
    /// `s`: the mean of the diagonal of `A`.
    stiffness: f64,
    /// `J Jᵀ + s` of each block of rows by what is open, factored, one behind the other.
    grams: Vec<f64>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
    conditioned: Vec<f64>,
    kept: Vec<f64>,
    of_rows: Vec<f64>,
    masked: Vec<f64>,
}

impl Iterative {
    /// Makes room for so many degrees of freedom and samples, of which each has so many rows at most, by sample.
    pub(crate) fn make_room(&mut self, n: usize, n_samples: usize, most_rows: impl Iterator<Item = usize>) {
        let (mut of_grams, mut most) = (0, 0);
        most_rows.for_each(|m| (of_grams, most) = (of_grams + m * m, most.max(m)));
        self.over_time.make_room(n, n_samples);
        make_room(&mut self.grams, of_grams);
        make_room(&mut self.of_rows, most);
        make_room(&mut self.masked, n);
        let Self { residual, direction, product, conditioned, kept, .. } = self;
        for per_tangent in [residual, direction, product, conditioned, kept] {
            make_room(per_tangent, n * n_samples);
        }
    }

    /// Memory for smoothness and damping of all degrees of freedom, to be filled before [`prepare`](Self::prepare).
    pub(crate) fn over_time(&mut self) -> &mut BandedLines {
        &mut self.over_time
    }

    /// Makes the preconditioner. An error where it is not positive definite.
    pub(crate) fn prepare(&mut self, rows: &SampleRows, open: &[bool]) -> Result<(), NotPositiveDefinite> {
        self.stiffness = self.over_time.mean_diagonal();
        self.over_time.factor()?;
        let n = rows.n_dofs;
        self.grams.clear();
        for block in &rows.blocks {
            let (m, at) = (block.n_rows, self.grams.len());
            self.grams.resize(at + m * m, 0.0);
            let gram = &mut self.grams[at..];
            let open = &open[block.sample * n..(block.sample + 1) * n];
            for i in 0..m {
                self.masked.clear();
                self.masked.resize(n, 0.0);
                let own = rows.runs(block.first + i).take_while(|(run, _)| run.back == 0);
                for (run, entries) in own {
                    for (k, a) in run.dofs.clone().zip(entries) {
                        self.masked[k] = if open[k] { *a } else { 0.0 };
                    }
                }
                for j in 0..=i {
                    gram[i * m + j] = rows.dot_own(block.first + j, &self.masked);
                }
                gram[i * m + i] += self.stiffness;
            }
            cholesky::factor(m, gram)?;
        }
        Ok(())
    }

    /// Solves `A x = b` where `open`, from the guess in `x`, which is 0 elsewhere, as `b` is. `apply` adds `A x`
    /// to its second argument.
    pub(crate) fn solve(
        &mut self,
        rows: &SampleRows,
        open: &[bool],
        mut apply: impl FnMut(&[f64], &mut [f64]),
        b: &[f64],
        x: &mut [f64],
    ) {
        let size = x.len();
        self.residual.clear();
        self.residual.extend_from_slice(b);
        self.condition(rows, open);
        let bar = TOLERANCE * TOLERANCE * dot(&self.residual, &self.conditioned);
        self.product.clear();
        self.product.resize(size, 0.0);
        if x.iter().any(|x| *x != 0.0) {
            apply(x, &mut self.product);
            for i in 0..size {
                self.residual[i] -= if open[i] { self.product[i] } else { 0.0 };
            }
            self.condition(rows, open);
        }
        self.direction.clone_from(&self.conditioned);
        let mut rho = dot(&self.residual, &self.conditioned);
        for _ in 0..MOST_ITERATIONS {
            if rho <= bar || rho <= 0.0 {
                break;
            }
            self.product.fill(0.0);
            apply(&self.direction, &mut self.product);
            for (p, open) in self.product.iter_mut().zip(open) {
                if !open {
                    *p = 0.0;
                }
            }
            let curvature = dot(&self.direction, &self.product);
            if curvature <= 0.0 {
                break;
            }
            let length = rho / curvature;
            for i in 0..size {
                x[i] += length * self.direction[i];
                self.residual[i] -= length * self.product[i];
            }
            self.condition(rows, open);
            let next = dot(&self.residual, &self.conditioned);
            let part = next / rho;
            rho = next;
            for i in 0..size {
                self.direction[i] = self.conditioned[i] + part * self.direction[i];
            }
        }
    }

    /// `conditioned := (P A⁻¹ P + P (1 − P) / s) residual`, where open.
    fn condition(&mut self, rows: &SampleRows, open: &[bool]) {
        let mut kept = std::mem::take(&mut self.kept);
        kept.clone_from(&self.residual);
        self.keep(rows, open, &mut kept);
        self.conditioned.clone_from(&kept);
        self.over_time.solve(&mut self.conditioned);
        for (i, open) in open.iter().enumerate() {
            let fixed = (self.residual[i] - kept[i]) / self.stiffness;
            self.conditioned[i] = if *open { self.conditioned[i] + fixed } else { 0.0 };
        }
        self.kept = kept;
        let mut conditioned = std::mem::take(&mut self.conditioned);
        self.keep(rows, open, &mut conditioned);
        self.conditioned = conditioned;
    }

    /// `x := P x` for an `x` that is 0 where it is not open.
    fn keep(&mut self, rows: &SampleRows, open: &[bool], x: &mut [f64]) {
        let n = rows.n_dofs;
        let mut at = 0;
        for block in &rows.blocks {
            let m = block.n_rows;
            let sample = block.sample * n..(block.sample + 1) * n;
            let x = &mut x[sample.clone()];
            self.of_rows.clear();
            self.of_rows.extend((block.first..block.first + m).map(|r| rows.dot_own(r, x)));
            cholesky::solve(m, &self.grams[at..at + m * m], &mut self.of_rows);
            for (r, y) in (block.first..).zip(&self.of_rows) {
                rows.add_own(r, -y, x);
            }
            for (x, open) in x.iter_mut().zip(&open[sample]) {
                if !open {
                    *x = 0.0;
                }
            }
            at += m * m;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::banded::Banded;
    use crate::algebra::sample_rows::Block;
    use ikiru_testkit::rigs::Random;

    #[test]
    fn solutions_solve_within_the_tolerance() {
        let mut random = Random::new(8);
        let (n, n_samples) = (5, 30);
        let mut rows = SampleRows::dense(n, 2);
        for sample in 0..n_samples {
            rows.blocks.push(Block { sample, first: 2 * sample, n_rows: 2 });
            for row in 0..2 {
                let entries: Vec<f64> = (0..n).map(|_| random.between(-1.0, 1.0)).collect();
                rows.push(row, 0.0, |_, k| entries[k]);
            }
        }
        let mut over_time = Banded::smoothness(n_samples, [0.01, 0.02, 0.03]);
        over_time.rows.iter_mut().for_each(|row| row[0] += 1e-3);
        let open: Vec<bool> = (0..n * n_samples).map(|_| random.unit() < 0.9).collect();
        let apply = |x: &[f64], out: &mut [f64]| {
            let mut y = vec![0.0; rows.n_rows()];
            rows.add_product(x, &mut y);
            rows.add_transposed(&y, out);
            for k in 0..n {
                let line: Vec<f64> = (0..n_samples).map(|t| x[t * n + k]).collect();
                let mut product = vec![0.0; n_samples];
                over_time.add_product(&line, &mut product);
                (0..n_samples).for_each(|t| out[t * n + k] += product[t]);
            }
        };
        let b: Vec<f64> = open.iter().map(|o| if *o { random.between(-1.0, 1.0) } else { 0.0 }).collect();
        let mut iterative = Iterative::default();
        iterative.over_time().clear(n, n_samples);
        (0..n).for_each(|k| iterative.over_time().set(k, &over_time));
        iterative.prepare(&rows, &open).unwrap();
        for from_guess in [false, true] {
            let mut x: Vec<f64> = b.iter().map(|b| if from_guess { 0.3 * b } else { 0.0 }).collect();
            iterative.solve(&rows, &open, apply, &b, &mut x);
            let mut left = vec![0.0; b.len()];
            apply(&x, &mut left);
            let wrong: f64 = (0..b.len()).filter(|i| open[*i]).map(|i| (left[i] - b[i]).powi(2)).sum();
            assert!(wrong < 0.01 * dot(&b, &b), "{wrong} of {}", dot(&b, &b));
            assert!(open.iter().zip(&x).all(|(o, x)| *o || *x == 0.0));
        }
    }
}
