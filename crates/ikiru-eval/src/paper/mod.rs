//! The paper's evaluation (section 4): two tasks on the reference human, every method from the rest pose,
//! success = cost below 0.005, at most 500 iterations a start.

mod contenders;
#[cfg(feature = "plot")]
mod figures;
mod published;
mod report;
mod run;
#[cfg(feature = "sample")]
mod sample;
mod targets;
mod task;

pub use contenders::{CONTENDERS, Contender};
#[cfg(feature = "plot")]
pub use figures::write_figures;
pub use report::{Report, csv};
pub use run::{Angles, Row, Settings, run, run_trajectories};
#[cfg(feature = "sample")]
pub use sample::{N_TARGETS, sample};
pub use targets::TargetSet;
pub use task::Task;
