//! What users call: solving, planning, checking.

pub(crate) mod check;
pub(crate) mod evaluation;
pub(crate) mod motion_evaluation;
mod options;
pub(crate) mod planner;
mod slower;
pub(crate) mod solver;
