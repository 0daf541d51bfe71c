//! All tests of the crate in one program, which links once.

mod baselines;
mod bits;
mod centred_cones;
mod common;
mod contract;
mod custom;
mod evaluation;
mod forces;
mod foreign;
mod hard;
mod hard_cases;
mod hard_motions;
mod lanes;
mod motion;
mod motion_cones;
mod motion_forces;
mod motion_given;
mod no_allocation;
mod outside;
mod rate_limits;
mod reach;
mod settling;
mod solving;
mod terms;
mod tracking;
mod values;
mod watch;

/// Counts for the tests that bound memory or allow no allocation.
#[global_allocator]
static ALLOCATOR: ikiru_testkit::allocations::Counting = ikiru_testkit::allocations::Counting;
