//! Which degrees of freedom a step couples: the sparsity of `H = JᵀJ + D`, as a tree.
//!
//! Rows couple a degree of freedom with those that move the same rows: where every term reads one branch of the body, with those
//! above it. When the matrix is factored from the last to the first, each then couples what is left of its row, and of these again the
//! last is what all the others hang on. So every degree of freedom has one above it, and its row has entries for the whole path from
//! there to the root and for no others: no fill in a body of branches, the fill that it takes where a term ties two of them together.
//! (Rows that do without some of that path are filled up to it, with zeros: then a row begins as that of the one above does, and
//! all that is done with rows runs over neighbours in memory.)

/// Rows `first..first + len` of a degree of freedom, stored from `start` on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Span {
    pub(crate) first: usize,
    pub(crate) len: usize,
    pub(crate) start: usize,
}

/// The paths of all degrees of freedom, each from the root to the one above.
#[derive(Clone, Debug, Default)]
pub(crate) struct Paths {
    above: Vec<u32>,
    /// Where each begins in `above`, and where the last ends.
    starts: Vec<usize>,
}

impl Paths {
    /// From the degrees of freedom, of `n`, that each term couples, in any order.
    pub(crate) fn new(n: usize, terms: &[Vec<usize>]) -> Self {
        // Which lower ones each is coupled with, as bits.
        let n_words = n.div_ceil(64);
        let mut coupled = vec![0_u64; n * n_words];
        for dofs in terms {
            for &k in dofs {
                for &i in dofs.iter().filter(|i| **i < k) {
                    coupled[k * n_words + i / 64] |= 1 << (i % 64);
                }
            }
        }
        let mut parents = vec![None; n];
        for k in (0..n).rev() {
            let row = k * n_words..(k + 1) * n_words;
            let Some(parent) = last_bit(&coupled[row.clone()]) else { continue };
            parents[k] = Some(parent);
            coupled[row.start + parent / 64] &= !(1 << (parent % 64));
            let (lower, own) = coupled.split_at_mut(row.start);
            for (to, from) in lower[parent * n_words..].iter_mut().zip(&own[..n_words]) {
                *to |= from;
            }
        }
        let mut paths = Self { above: Vec::new(), starts: vec![0] };
        for parent in parents {
            if let Some(parent) = parent {
                paths.above.extend_from_within(paths.starts[parent]..paths.starts[parent + 1]);
                paths.above.push(u32::try_from(parent).unwrap_or(u32::MAX));
            }
            paths.starts.push(paths.above.len());
        }
        paths
    }

    pub(crate) fn n(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Those above one, from the root.
    #[inline]
    pub(crate) fn above(&self, k: usize) -> &[u32] {
        &self.above[self.starts[k]..self.starts[k + 1]]
    }

    /// Where the row of one begins in memory: entries for those above, then its own.
    #[inline]
    pub(crate) fn row(&self, k: usize) -> std::ops::Range<usize> {
        self.starts[k] + k..self.starts[k + 1] + k + 1
    }

    /// How many entries all rows have.
    pub(crate) fn n_entries(&self) -> usize {
        self.above.len() + self.n()
    }

    /// About how many multiplications a step takes: the matrix, from columns of such spans, its factor.
    pub(crate) fn work(&self, spans: &[Span]) -> usize {
        let of = |(depth, span): (usize, &Span)| (depth + 1) * (span.len + depth / 2);
        (0..self.n()).map(|k| self.above(k).len()).zip(spans).map(of).sum()
    }
}

/// About how many multiplications a step takes over rows: the matrix, its factor.
pub(crate) fn work_over_rows(n_rows: usize, spans: &[Span]) -> usize {
    spans.iter().map(|span| span.len * span.len / 2).sum::<usize>() + n_rows.pow(3) / 6
}

/// The highest bit that is set.
fn last_bit(words: &[u64]) -> Option<usize> {
    let word = words.iter().rposition(|word| *word != 0)?;
    Some(64 * word + 63 - words[word].leading_zeros() as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_of_branches_has_no_fill_and_a_tie_fills_what_it_must() {
        // A trunk of 0 and 1, an arm of 2 and 3, another of 4 and 5, and one that nothing reads.
        let (left, right) = (vec![0, 1, 2, 3], vec![5, 4, 1, 0]);
        let paths = Paths::new(7, &[left.clone(), right.clone()]);
        let above: Vec<&[u32]> = (0..7).map(|k| paths.above(k)).collect();
        assert_eq!(above, [&[][..], &[0], &[0, 1], &[0, 1, 2], &[0, 1], &[0, 1, 4], &[]]);
        assert_eq!((paths.n(), paths.n_entries(), paths.row(5)), (7, 18, 13..17));
        // The hands hold each other.
        let tied = Paths::new(7, &[left, right, vec![0, 1, 2, 3, 4, 5]]);
        assert_eq!(tied.above(5), [0, 1, 2, 3, 4]);
        let spans = [Span { first: 0, len: 6, start: 0 }; 7];
        assert!(tied.work(&spans) > paths.work(&spans));
        // Far apart, with more than one word of bits.
        let far = Paths::new(200, &[vec![3, 70], vec![70, 199], vec![150, 199]]);
        assert_eq!(
            (far.above(199), far.above(150), far.above(70)),
            (&[3, 70, 150][..], &[3, 70][..], &[3][..])
        );
    }
}
