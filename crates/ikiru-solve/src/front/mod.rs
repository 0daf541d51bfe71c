//! What users call: solving, planning, checking.

pub(crate) mod check;
mod course;
pub(crate) mod evaluation;
pub(crate) mod motion_evaluation;
mod motion_layout;
mod options;
pub(crate) mod planner;
mod slower;
pub(crate) mod solver;
