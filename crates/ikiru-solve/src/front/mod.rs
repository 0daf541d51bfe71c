//! What users call: solving, planning, checking.

pub(crate) mod check;
mod options;
pub(crate) mod planner;
mod slower;
pub(crate) mod solver;
