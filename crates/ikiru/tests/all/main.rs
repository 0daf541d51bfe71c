//! All tests of the crate in one program, which links once.

#[cfg(all(feature = "builtin", feature = "scenario"))]
mod objectives;
mod pages;
mod threads;
