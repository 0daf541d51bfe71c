//! Cholesky's factorisation of symmetric matrices, of a size that the compiler knows and of any.

/// A matrix that is not positive definite, or not so within rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NotPositiveDefinite {
    /// The first row whose pivot rounding has eaten.
    pub(crate) row: usize,
}

/// A pivot below this part of its diagonal is rounding.
const LEAST_PIVOT: f64 = 1e-15;

/// The reciprocal of a pivot's root; an error also for what is not a number.
#[inline(always)]
fn reciprocal_root(pivot: f64, diagonal: f64, row: usize) -> Result<f64, NotPositiveDefinite> {
    sound(pivot, diagonal, row).map(|pivot| 1.0 / pivot.sqrt())
}

/// A pivot that is more than rounding; an error also for what is not a number.
#[inline(always)]
pub(crate) fn sound(pivot: f64, diagonal: f64, row: usize) -> Result<f64, NotPositiveDefinite> {
    if pivot > diagonal * LEAST_PIVOT { Ok(pivot) } else { Err(NotPositiveDefinite { row }) }
}

/// Puts its factor in the place of the lower half of a matrix with damping on its diagonal, reciprocals on the diagonal.
#[inline(always)]
pub(crate) fn factor_fixed<const M: usize>(
    a: &mut [[f64; M]; M],
    damping: f64,
) -> Result<(), NotPositiveDefinite> {
    for i in 0..M {
        for j in 0..i {
            let mut sum = a[i][j];
            for k in 0..j {
                sum -= a[i][k] * a[j][k];
            }
            a[i][j] = sum * a[j][j];
        }
        let diagonal = a[i][i] + damping;
        let mut sum = diagonal;
        for k in 0..i {
            sum -= a[i][k] * a[i][k];
        }
        a[i][i] = reciprocal_root(sum, diagonal, i)?;
    }
    Ok(())
}

/// `x := A⁻¹ x` for a matrix that was [factored](factor_fixed).
#[inline(always)]
pub(crate) fn solve_fixed<const M: usize>(a: &[[f64; M]; M], x: &mut [f64; M]) {
    for i in 0..M {
        let mut sum = x[i];
        for k in 0..i {
            sum -= a[i][k] * x[k];
        }
        x[i] = sum * a[i][i];
    }
    for i in (0..M).rev() {
        let mut sum = x[i];
        for k in i + 1..M {
            sum -= a[k][i] * x[k];
        }
        x[i] = sum * a[i][i];
    }
}

/// Puts its factor in the place of the lower half of a matrix of `n` rows, reciprocals on the diagonal.
pub(crate) fn factor(n: usize, a: &mut [f64]) -> Result<(), NotPositiveDefinite> {
    for i in 0..n {
        let (above, row) = a.split_at_mut(i * n);
        let row = &mut row[..=i];
        for j in 0..i {
            let other = &above[j * n..=j * n + j];
            let known = dot(&row[..j], &other[..j]);
            row[j] = (row[j] - known) * other[j];
        }
        let diagonal = row[i];
        let known = dot(&row[..i], &row[..i]);
        row[i] = reciprocal_root(diagonal - known, diagonal, i)?;
    }
    Ok(())
}

/// `x := A⁻¹ x` for a matrix that was [factored](factor).
pub(crate) fn solve(n: usize, a: &[f64], x: &mut [f64]) {
    for i in 0..n {
        let row = &a[i * n..=i * n + i];
        let known = dot(&row[..i], &x[..i]);
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
}

/// Four sums side by side, always in one order, which a processor adds up at once.
#[inline]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in a4.iter().zip(b4) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use ikiru_testkit::rigs::Random;

    /// `B Bᵀ + damping`, `B` having so many columns.
    fn matrix<const M: usize>(random: &mut Random, n_columns: usize, damping: f64) -> [[f64; M]; M] {
        let b: Vec<[f64; M]> = (0..n_columns).map(|_| [(); M].map(|()| random.between(-1.0, 1.0))).collect();
        let mut a = [[0.0; M]; M];
        for (i, row) in a.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = b.iter().map(|b| b[i] * b[j]).sum::<f64>() + if i == j { damping } else { 0.0 };
            }
        }
        a
    }

    #[test]
    fn both_sizes_solve_what_they_factored() {
        const M: usize = 11;
        let mut random = Random::new(5);
        for case in 0..50 {
            let damping = if case % 2 == 0 { 0.0 } else { 0.3 };
            let a = matrix::<M>(&mut random, M + 3, 0.0);
            let b = [(); M].map(|()| random.between(-1.0, 1.0));
            let (mut fixed, mut x) = (a, b);
            factor_fixed(&mut fixed, damping).unwrap();
            solve_fixed(&fixed, &mut x);
            let mut flat: Vec<f64> = a.concat();
            (0..M).for_each(|i| flat[i * M + i] += damping);
            let mut y = b;
            factor(M, &mut flat).unwrap();
            solve(M, &flat, &mut y);
            for i in 0..M {
                let back = (0..M).map(|j| a[i][j] * x[j]).sum::<f64>() + damping * x[i];
                assert!((back - b[i]).abs() < 1e-8, "case {case}: {back} is not {}", b[i]);
                assert!((x[i] - y[i]).abs() < 1e-8 * (1.0 + x[i].abs()), "case {case}");
            }
        }
    }

    #[test]
    fn the_row_is_named_at_which_a_matrix_is_not_positive_definite() {
        let mut random = Random::new(6);
        // Three columns span three rows; the fourth has nothing of its own.
        let a = matrix::<6>(&mut random, 3, 0.0);
        let mut fixed = a;
        assert_eq!(factor_fixed(&mut fixed, 0.0), Err(NotPositiveDefinite { row: 3 }));
        assert_eq!(factor(6, &mut a.concat()), Err(NotPositiveDefinite { row: 3 }));
        let mut broken = matrix::<4>(&mut random, 6, 0.0);
        broken[1][1] = f64::NAN;
        assert_eq!(factor(4, &mut broken.concat()), Err(NotPositiveDefinite { row: 1 }));
        assert_eq!(factor_fixed(&mut broken, 0.0), Err(NotPositiveDefinite { row: 1 }));
    }
}
