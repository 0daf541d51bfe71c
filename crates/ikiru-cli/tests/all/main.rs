//! All tests of the crate in one program, which links once.

mod command;
mod common;
mod defects_front;
mod plan;
mod round_trips;
mod suite;
