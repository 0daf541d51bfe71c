//! Objectives and solvers: inverse kinematics as the minimum of `J = Σ λ · ρ(r)` inside hard joint limits.
//!
//! An [`Objective`] is a soft wish: residual rows and their derivative by the frames that it reads. A
//! [`Problem`] weighs objectives and says which joints may move. A [`Solver`] improves a pose in a
//! [`Workspace`] that the caller owns, and reports what came of it.
//!
//! This crate knows no file and no name: joints are ids.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod check;
mod explain;
mod force;
mod gradient;
mod invalid;
mod lanes;
mod layout;
mod method;
mod model;
mod motion;
mod objective;
mod options;
mod problem;
mod report;
mod residual;
mod search;
mod solver;
mod solvers;
mod state;
mod term;
mod watch;
mod words;

pub mod objectives;

pub use check::{CheckError, check_jacobian};
pub use force::{Force, ForceBy, Hint, LimitKind};
pub use invalid::{Invalid, InvalidOptions, InvalidPose, InvalidTerm};
pub use lanes::LaneScratch;
pub use motion::{
    MotionError, MotionProblem, MotionWorkspace, PlannedMotion, TargetPath, TargetPathError, Timeline,
    TimelineError, When,
};
pub use objective::{
    JointCoords, MOST_EARLIER, MOST_PARTS, MOST_ROWS, Objective, Part, Reach, Reads, Rows, TermReads, Unfit,
    View,
};
pub use options::{AdamOptions, Method, Search, SolverOptions};
pub use problem::Problem;
pub use report::{PartReport, PartReports, Report, StopReason, TermReport, TermTimes};
pub use residual::Residual;
pub use solver::{Solver, Workspace};
pub use term::{Term, TermId, Tolerance};
pub use watch::{Progress, Watch};
pub use words::{Loss, Sense, Unit};
