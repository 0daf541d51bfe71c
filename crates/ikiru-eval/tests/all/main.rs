//! All tests of the crate in one program, which links once.

mod motions;
#[cfg(all(feature = "plot", feature = "sample"))]
mod paper;
mod robots;
mod track;
