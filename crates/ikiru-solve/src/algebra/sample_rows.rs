//! The residual rows of all samples at which something is wanted.

use std::ops::Range;

use crate::algebra::cholesky::dot;
use crate::algebra::room::{MostRows, make_room};
use crate::layout::Layout;
use crate::words::Loss;

/// The rows of one sample: `n_rows` from `first` on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub(crate) sample: usize,
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
pub(crate) struct SampleRows {
    pub(crate) n_dofs: usize,
    pub(crate) blocks: Vec<Block>,
    pub(crate) parts: Vec<RowPart>,
    /// Scaled residuals.
    pub(crate) residual: Vec<f64>,
    /// How much each row gives way to its force: 1 for a wish that is scaled by its weight, 0 for what is hard.
    pub(crate) compliance: Vec<f64>,
    /// Row by row, by those degrees of freedom that move it: of the row's own sample, then of those before that it reads.
    jacobian: Vec<f64>,
    /// Which row of the layout each row is, and where its entries begin.
    of_layout: Vec<(usize, usize)>,
    /// For each row of the layout, the runs of degrees of freedom that move it, and how many samples back: a hand does not
    /// see a foot.
    support: Vec<Vec<Run>>,
}

/// Degrees of freedom of one sample.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// How many samples before the row's own.
    pub(crate) back: usize,
    pub(crate) dofs: Range<usize>,
}

impl SampleRows {
    /// No rows yet, of a layout's degrees of freedom.
    pub(crate) fn new(layout: &Layout) -> Self {
        let mut support = vec![Vec::<Run>::new(); layout.n_rows];
        for (k, span) in layout.spans.iter().enumerate() {
            for runs in &mut support[span.first..span.first + span.len] {
                match runs.last_mut() {
                    Some(run) if run.dofs.end == k => run.dofs.end = k + 1,
                    _ => runs.push(Run { back: 0, dofs: k..k + 1 }),
                }
            }
        }
        // Guards have an entry for every degree of freedom.
        let all = Run { back: 0, dofs: 0..layout.n_dofs };
        support.extend((0..layout.n_guards).map(|_| vec![all.clone()]));
        for t in layout.terms.iter().filter(|t| t.n_earlier > 0) {
            for part in &layout.parts[t.parts.clone()] {
                for runs in support.iter_mut().skip(part.row).take(part.n_rows) {
                    let own = runs.clone();
                    for back in 1..=t.n_earlier {
                        runs.extend(own.iter().map(|run| Run { back, dofs: run.dofs.clone() }));
                    }
                }
            }
        }
        Self { n_dofs: layout.n_dofs, support, ..Self::default() }
    }

    /// No rows yet, of which every one may have all entries.
    #[cfg(test)]
    pub(crate) fn dense(n_dofs: usize, n_rows_of_layout: usize) -> Self {
        let all = Run { back: 0, dofs: 0..n_dofs };
        Self { n_dofs, support: vec![vec![all]; n_rows_of_layout], ..Self::default() }
    }

    /// Makes room for rows that only one run of degrees of freedom moves; the answer is their number in the layout.
    pub(crate) fn add_support(&mut self, dofs: Range<usize>) -> usize {
        self.support.push(vec![Run { back: 0, dofs }]);
        self.support.len() - 1
    }

    /// How many entries a row of the layout has.
    pub(crate) fn n_entries(&self, of_layout: usize) -> usize {
        self.support[of_layout].iter().map(|run| run.dofs.len()).sum()
    }

    /// Makes room for the most rows that there may be.
    pub(crate) fn make_room(&mut self, most: MostRows) {
        make_room(&mut self.blocks, most.blocks);
        make_room(&mut self.parts, most.parts);
        make_room(&mut self.residual, most.rows);
        make_room(&mut self.compliance, most.rows);
        make_room(&mut self.of_layout, most.rows);
        make_room(&mut self.jacobian, most.entries);
    }

    /// Adds a row of another set, which has the same layout.
    pub(crate) fn push_copy(&mut self, other: &Self, row: usize) {
        let (of_layout, at) = other.of_layout[row];
        let n = other.n_entries(of_layout);
        self.residual.push(other.residual[row]);
        self.compliance.push(other.compliance[row]);
        self.of_layout.push((of_layout, self.jacobian.len()));
        self.jacobian.extend_from_slice(&other.jacobian[at..at + n]);
    }

    /// Adds a row of another set with another residual, its derivative scaled, of another compliance.
    pub(crate) fn push_scaled(
        &mut self,
        other: &Self,
        row: usize,
        residual: f64,
        scale: f64,
        compliance: f64,
    ) {
        let (of_layout, at) = other.of_layout[row];
        let n = other.n_entries(of_layout);
        self.residual.push(residual);
        self.compliance.push(compliance);
        self.of_layout.push((of_layout, self.jacobian.len()));
        self.jacobian.extend(other.jacobian[at..at + n].iter().map(|entry| scale * entry));
    }

    /// Adds a row: number `of_layout` of a layout, its scaled residual, and its derivative by a degree of freedom so many
    /// samples back.
    pub(crate) fn push(&mut self, of_layout: usize, residual: f64, derivative: impl Fn(usize, usize) -> f64) {
        self.residual.push(residual);
        self.compliance.push(1.0);
        self.of_layout.push((of_layout, self.jacobian.len()));
        let (support, derivative) = (&self.support[of_layout], &derivative);
        let entries = |run: &Run| {
            let back = run.back;
            run.dofs.clone().map(move |k| derivative(back, k))
        };
        self.jacobian.extend(support.iter().flat_map(entries));
    }

    pub(crate) fn clear(&mut self) {
        self.of_layout.clear();
        self.blocks.clear();
        self.parts.clear();
        self.residual.clear();
        self.compliance.clear();
        self.jacobian.clear();
    }

    pub(crate) fn n_rows(&self) -> usize {
        self.residual.len()
    }

    /// The entries of one row in runs: the degrees of freedom, and the derivative by them. Those of its own sample come
    /// first.
    #[inline]
    pub(crate) fn runs(&self, row: usize) -> impl Iterator<Item = (&Run, &[f64])> {
        let (of_layout, mut at) = self.of_layout[row];
        self.support[of_layout].iter().map(move |run| {
            let entries = &self.jacobian[at..at + run.dofs.len()];
            at += run.dofs.len();
            (run, entries)
        })
    }

    /// The squared length of one row's derivative.
    pub(crate) fn square(&self, row: usize) -> f64 {
        self.runs(row).flat_map(|(_, entries)| entries).map(|a| a * a).sum()
    }

    /// The product of one row with the tangents of its sample and of those before it, one after the other backwards.
    #[inline]
    pub(crate) fn dot_back(&self, row: usize, x: &[f64]) -> f64 {
        let of_run = |(run, entries): (&Run, &[f64])| {
            let at = run.back * self.n_dofs;
            dot(entries, &x[at + run.dofs.start..at + run.dofs.end])
        };
        self.runs(row).map(of_run).sum()
    }

    /// The product of one row with the tangent of its own sample, whatever else it reads.
    #[inline]
    pub(crate) fn dot_own(&self, row: usize, x: &[f64]) -> f64 {
        let own = self.runs(row).take_while(|(run, _)| run.back == 0);
        own.map(|(run, entries)| dot(entries, &x[run.dofs.clone()])).sum()
    }

    /// Adds a multiple of one row to the tangent of its own sample.
    #[inline]
    pub(crate) fn add_own(&self, row: usize, factor: f64, x: &mut [f64]) {
        for (run, entries) in self.runs(row).take_while(|(run, _)| run.back == 0) {
            for (x, a) in x[run.dofs.clone()].iter_mut().zip(entries) {
                *x += factor * a;
            }
        }
    }

    /// `y += J x`, `x` being the tangents of all samples.
    pub(crate) fn add_product(&self, x: &[f64], y: &mut [f64]) {
        let n = self.n_dofs;
        for block in &self.blocks {
            for row in block.first..block.first + block.n_rows {
                let of_run = |(run, entries): (&Run, &[f64])| {
                    let at = (block.sample - run.back) * n;
                    dot(entries, &x[at + run.dofs.start..at + run.dofs.end])
                };
                y[row] += self.runs(row).map(of_run).sum::<f64>();
            }
        }
    }

    /// `x += Jᵀ y`
    pub(crate) fn add_transposed(&self, y: &[f64], x: &mut [f64]) {
        self.add_transposed_of(|row| y[row], x);
    }

    /// `x += Jᵀ y` for a `y` that is made row by row.
    pub(crate) fn add_transposed_of(&self, y: impl Fn(usize) -> f64, x: &mut [f64]) {
        let n = self.n_dofs;
        for block in &self.blocks {
            for row in block.first..block.first + block.n_rows {
                let y = y(row);
                for (run, entries) in self.runs(row) {
                    let at = (block.sample - run.back) * n;
                    for (x, a) in x[at + run.dofs.start..at + run.dofs.end].iter_mut().zip(entries) {
                        *x += y * a;
                    }
                }
            }
        }
    }
}
