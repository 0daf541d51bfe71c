//! What Ikiru's tests share: random rigs and poses, an independent matrix-based forward kinematics, an
//! independent judge of cones, and an allocator that counts.

pub mod allocations;
pub mod cones;
pub mod reference;
pub mod rigs;
