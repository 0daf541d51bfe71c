//! Room in memory, made once for the most that there may be, so that later steps and plans allocate nothing.

/// The most rows that there may be.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MostRows {
    pub(crate) rows: usize,
    /// Entries of their derivatives, all together.
    pub(crate) entries: usize,
    pub(crate) parts: usize,
    /// Samples that have rows.
    pub(crate) blocks: usize,
}

impl MostRows {
    /// As many as of two sets together, whose rows lie in the same blocks.
    pub(crate) fn beside(self, other: Self) -> Self {
        Self {
            rows: self.rows + other.rows,
            entries: self.entries + other.entries,
            parts: self.parts + other.parts,
            blocks: self.blocks.max(other.blocks),
        }
    }
}

/// Makes room for so many elements, those that are there among them.
pub(crate) fn make_room<T>(elements: &mut Vec<T>, most: usize) {
    elements.reserve_exact(most.saturating_sub(elements.len()));
}
