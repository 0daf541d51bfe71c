//! The most that one objective may have.

/// The most parts of one objective.
pub const MOST_PARTS: usize = 4;

/// The most rows of one part that is not [separable](crate::Part::separable).
pub const MOST_ROWS: usize = 1024;

/// The most samples before its own that an objective may read.
pub const MOST_EARLIER: usize = 3;
