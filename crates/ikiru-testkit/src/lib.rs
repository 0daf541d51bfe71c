//! What Ikiru's tests share: random rigs and poses, and an independent matrix-based forward kinematics.

pub mod reference;
pub mod rigs;
