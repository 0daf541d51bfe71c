//! The step of a motion that is wanted something of at most of its frames: too many rows to solve over, so that the
//! normal equations are solved by conjugate gradients.
//!
//! They are preconditioned by `S ⊗ I + I ⊗ H`, smoothness over time beside the mean curvature `H` of all frames:
//! along the eigenvectors of `H` that falls apart into one banded matrix each.

use crate::motion::banded::Banded;
use crate::motion::rows::FrameRows;

/// How far the residual must fall; the step is one of many.
const TOLERANCE: f64 = 0.02;
/// Most iterations for one step.
const MOST_ITERATIONS: usize = 60;
/// For how many steps the same eigenvectors are used.
const STEPS_PER_BASIS: usize = 8;

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct Iterative {
    /// Eigenvectors of the mean curvature, one a row, and their eigenvalues.
    basis: Vec<f64>,
    values: Vec<f64>,
    age: usize,
    /// One factored matrix over time for each eigenvector.
    modes: Vec<Banded>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
    conditioned: Vec<f64>,
    turned: Vec<f64>,
    line: Vec<f64>,
}

impl Iterative {
    /// Makes the preconditioner: `over_time` is smoothness and damping, with what is given held; `curvature` that of
    /// motions, for all frames. False where it is not positive definite.
    pub(crate) fn prepare(
        &mut self,
        n: usize,
        rows: &FrameRows,
        curvature: &[f64],
        over_time: &Banded,
    ) -> bool {
        if self.values.len() != n || self.age >= STEPS_PER_BASIS {
            let mut mean = mean_curvature(n, rows, curvature, over_time.rows.len());
            self.basis = eigenvectors(n, &mut mean);
            self.values = (0..n).map(|k| mean[k * n + k].max(0.0)).collect();
            self.age = 0;
        }
        self.age += 1;
        self.modes.clear();
        for value in &self.values {
            let mut mode = over_time.clone();
            mode.rows.iter_mut().for_each(|row| row[0] += value);
            if !mode.factor() {
                return false;
            }
            self.modes.push(mode);
        }
        true
    }

    /// Solves `A x = b` where `open`: `b` comes in `x`, and is 0 elsewhere. `apply` computes `A x` into its
    /// second argument.
    pub(crate) fn solve(
        &mut self,
        n: usize,
        open: &[bool],
        apply: impl Fn(&[f64], &mut [f64]),
        x: &mut [f64],
    ) {
        let size = x.len();
        self.residual.clear();
        self.residual.extend_from_slice(x);
        x.fill(0.0);
        self.product.resize(size, 0.0);
        self.condition(n, open);
        self.direction.clone_from(&self.conditioned);
        let mut rho = dot(&self.residual, &self.conditioned);
        let bar = TOLERANCE * TOLERANCE * rho;
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
            self.condition(n, open);
            let next = dot(&self.residual, &self.conditioned);
            let part = next / rho;
            rho = next;
            for i in 0..size {
                self.direction[i] = self.conditioned[i] + part * self.direction[i];
            }
        }
    }

    /// `conditioned := M⁻¹ residual`, where open.
    fn condition(&mut self, n: usize, open: &[bool]) {
        let size = self.residual.len();
        let n_frames = size / n;
        self.turned.clear();
        self.turned.resize(size, 0.0);
        // Along eigenvectors, each line of time in one piece.
        for t in 0..n_frames {
            let from = &self.residual[t * n..(t + 1) * n];
            for i in 0..n {
                self.turned[i * n_frames + t] = dot(&self.basis[i * n..(i + 1) * n], from);
            }
        }
        for (mode, line) in self.modes.iter().zip(self.turned.chunks_exact_mut(n_frames)) {
            mode.solve_from(0, line);
        }
        self.conditioned.clear();
        self.conditioned.resize(size, 0.0);
        self.line.resize(n, 0.0);
        for t in 0..n_frames {
            let to = &mut self.conditioned[t * n..(t + 1) * n];
            for i in 0..n {
                let along = self.turned[i * n_frames + t];
                for (x, v) in to.iter_mut().zip(&self.basis[i * n..(i + 1) * n]) {
                    *x += along * v;
                }
            }
            for (x, open) in to.iter_mut().zip(&open[t * n..(t + 1) * n]) {
                if !open {
                    *x = 0.0;
                }
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `Jᵀ J` and the curvature of motions, the mean over all frames.
fn mean_curvature(n: usize, rows: &FrameRows, curvature: &[f64], n_frames: usize) -> Vec<f64> {
    let mut mean = vec![0.0; n * n];
    for r in 0..rows.n_rows() {
        let row = rows.row(r);
        for i in 0..n {
            if row[i] != 0.0 {
                for (m, j) in mean[i * n..(i + 1) * n].iter_mut().zip(row) {
                    *m += row[i] * j;
                }
            }
        }
    }
    for (idx, c) in curvature.iter().enumerate() {
        mean[(idx % n) * (n + 1)] += c;
    }
    mean.iter_mut().for_each(|m| *m /= n_frames as f64);
    mean
}

/// Eigenvectors of a symmetric matrix, one a row; the eigenvalues are left on its diagonal (Jacobi's rotations).
fn eigenvectors(n: usize, a: &mut [f64]) -> Vec<f64> {
    const MOST_SWEEPS: usize = 12;
    let mut basis = vec![0.0; n * n];
    (0..n).for_each(|i| basis[i * n + i] = 1.0);
    let scale: f64 = (0..n).map(|i| a[i * n + i] * a[i * n + i]).sum();
    for _ in 0..MOST_SWEEPS {
        let mut off = 0.0;
        for p in 0..n {
            for q in p + 1..n {
                let apq = a[p * n + q];
                off += apq * apq;
                if apq * apq <= 1e-24 * scale {
                    continue;
                }
                let theta = (a[q * n + q] - a[p * n + p]) / (2.0 * apq);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..n {
                    let (x, y) = (a[k * n + p], a[k * n + q]);
                    (a[k * n + p], a[k * n + q]) = (c * x - s * y, s * x + c * y);
                }
                for k in 0..n {
                    let (x, y) = (a[p * n + k], a[q * n + k]);
                    (a[p * n + k], a[q * n + k]) = (c * x - s * y, s * x + c * y);
                    let (x, y) = (basis[p * n + k], basis[q * n + k]);
                    (basis[p * n + k], basis[q * n + k]) = (c * x - s * y, s * x + c * y);
                }
            }
        }
        if off <= 1e-14 * scale {
            break;
        }
    }
    basis
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::rows::Block;
    use ikiru_testkit::rigs::Random;

    #[test]
    fn eigenvectors_make_a_matrix_diagonal() {
        let mut random = Random::new(3);
        let n = 9;
        let mut a = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let entry = random.between(-1.0, 1.0);
                (a[i * n + j], a[j * n + i]) = (entry, entry);
            }
        }
        let full = a.clone();
        let basis = eigenvectors(n, &mut a);
        for i in 0..n {
            let v = &basis[i * n..(i + 1) * n];
            for j in 0..n {
                let av = dot(&full[j * n..(j + 1) * n], v);
                assert!((av - a[i * n + i] * v[j]).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn solutions_solve_within_the_tolerance() {
        let mut random = Random::new(8);
        let (n, n_frames) = (5, 30);
        let mut rows = FrameRows { n_dofs: n, ..FrameRows::default() };
        for frame in 0..n_frames {
            rows.blocks.push(Block { frame, first: 2 * frame, n_rows: 2 });
            rows.residual.extend([0.0; 2]);
            rows.jacobian.extend((0..2 * n).map(|_| random.between(-1.0, 1.0)));
        }
        let mut over_time = Banded::smoothness(n_frames, [0.01, 0.02, 0.03]);
        over_time.rows.iter_mut().for_each(|row| row[0] += 1e-3);
        let open: Vec<bool> = (0..n * n_frames).map(|_| random.unit() < 0.9).collect();
        let apply = |x: &[f64], out: &mut [f64]| {
            let mut y = vec![0.0; rows.n_rows()];
            rows.add_product(x, &mut y);
            rows.add_transposed(&y, out);
            for k in 0..n {
                let line: Vec<f64> = (0..n_frames).map(|t| x[t * n + k]).collect();
                let mut product = vec![0.0; n_frames];
                over_time.add_product(&line, &mut product);
                (0..n_frames).for_each(|t| out[t * n + k] += product[t]);
            }
        };
        let b: Vec<f64> = open.iter().map(|o| if *o { random.between(-1.0, 1.0) } else { 0.0 }).collect();
        let mut iterative = Iterative::default();
        assert!(iterative.prepare(n, &rows, &vec![0.0; n * n_frames], &over_time));
        let mut x = b.clone();
        iterative.solve(n, &open, apply, &mut x);
        let mut left = vec![0.0; b.len()];
        apply(&x, &mut left);
        let wrong: f64 = (0..b.len()).filter(|i| open[*i]).map(|i| (left[i] - b[i]).powi(2)).sum();
        assert!(wrong < 0.01 * dot(&b, &b), "{wrong} of {}", dot(&b, &b));
        assert!(open.iter().zip(&x).all(|(o, x)| *o || *x == 0.0));
    }
}
