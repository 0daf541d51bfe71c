//! Linear systems, and nothing of what they are about: rows over degrees of freedom, bands over time.

pub(crate) mod banded;
pub(crate) mod branched;
pub(crate) mod cholesky;
pub(crate) mod full_rows;
pub(crate) mod iterative;
pub(crate) mod room;
pub(crate) mod rows;
pub(crate) mod sample_rows;
