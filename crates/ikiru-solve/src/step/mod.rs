//! The damped step inside limits, of a pose and of a motion: what is held, what acts, and the system that is solved for it.

pub(crate) mod acting;
pub(crate) mod active;
pub(crate) mod ball;
pub(crate) mod cones;
pub(crate) mod motion;
pub(crate) mod motion_guards;
pub(crate) mod pose;
pub(crate) mod pose_guards;
pub(crate) mod system;
