//! The methods that improve a single start, and the search over many.

pub(crate) mod ccd;
pub(crate) mod columns;
pub(crate) mod fabrik;
pub(crate) mod forces;
#[cfg(feature = "ipopt")]
pub(crate) mod ipopt;
pub(crate) mod rows;
pub(crate) mod step;
pub(crate) mod turn;
