//! All tests of the crate in one program, which links once.

mod motions;
mod paper;
mod robots;
