//! Motion planning: the same objectives, placed in time, and a whole trajectory solved at once (the paper's section
//! 3.7).

mod adam;
mod banded;
mod iterative;
mod planner;
mod problem;
mod report;
mod rows;
mod smoothness;
mod state;
mod step;
mod timeline;

pub use planner::{MotionWorkspace, PlannedMotion};
pub use problem::{MotionError, MotionProblem, When};
pub use report::{MotionReport, MotionTermReport};
pub use timeline::{Timeline, TimelineError};
