//! All tests of the crate in one program, which links once.

mod objectives;
mod pages;
