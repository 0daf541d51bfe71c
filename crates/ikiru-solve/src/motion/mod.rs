//! Motion planning: the same objectives, placed in time, and a whole trajectory solved at once (the paper's section
//! 3.7).

mod banded;
#[cfg(test)]
mod cases;
mod cones;
mod error;
mod explain;
mod guards;
mod iterative;
pub(crate) mod limited;
mod path;
mod planner;
pub(crate) mod problem;
mod rate_bounds;
mod report;
mod rows;
mod sample_terms;
mod slower;
mod smoothness;
mod spacing;
pub(crate) mod state;
pub(crate) mod step;
mod system;
mod timeline;
mod track;
mod when;

pub use error::MotionError;
pub use path::{TargetPath, TargetPathError};
pub use planner::{MotionWorkspace, PlannedMotion};
pub use problem::MotionProblem;
pub use timeline::{Timeline, TimelineError};
pub use when::When;
