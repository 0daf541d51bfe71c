//! What Ikiru's tests share: random rigs and poses, an independent matrix-based forward kinematics, and an
//! allocator that counts.

pub mod allocations;
pub mod reference;
pub mod rigs;
