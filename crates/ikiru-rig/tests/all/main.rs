//! All tests of the crate in one program, which links once.

mod clip;
mod cones;
#[cfg(feature = "serde")]
mod data;
mod foreign;
mod humanoid;
mod laws;
mod no_allocation;
mod rate_limits;
mod retime;
mod root;
mod validity;

/// Counts for the tests that bound memory or allow no allocation.
#[global_allocator]
static ALLOCATOR: ikiru_testkit::allocations::Counting = ikiru_testkit::allocations::Counting;
