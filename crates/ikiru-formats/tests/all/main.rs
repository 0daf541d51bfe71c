//! All tests of the crate in one program, which links once.

mod animation;
mod bvh;
mod bvh_body;
mod bvh_hostile;
mod bvh_malformed;
mod bvh_write;
mod clip_order;
mod common;
mod containers;
mod floating;
mod hostile;
mod malformed;
mod motion;
mod mutation;
mod read;
mod roles;
mod root_motion;
mod scale;
mod transfer;
mod transfer_way;
mod urdf;
mod urdf_hostile;
mod urdf_kinematics;
mod urdf_malformed;
mod vrm;
mod vrma;
mod write;

/// Counts for the tests that bound memory or allow no allocation.
#[global_allocator]
static ALLOCATOR: ikiru_testkit::allocations::Counting = ikiru_testkit::allocations::Counting;
