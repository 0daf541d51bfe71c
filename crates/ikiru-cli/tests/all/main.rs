//! All tests of the crate in one program, which links once.

#[cfg(feature = "bench")]
mod bench;
mod command;
mod common;
mod constraints;
mod defects_front;
mod features;
mod inspect;
mod plan;
mod round_trips;
mod suite;
