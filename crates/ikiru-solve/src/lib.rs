//! Objectives and solvers: inverse kinematics as the minimum of `J = Σ λ · ρ(r)` inside hard joint limits.
//!
//! An [`Objective`] is a soft wish: residual rows and their derivative by the frames that it reads. A
//! [`Problem`] weighs objectives and says which joints may move. A [`Solver`] improves a pose in a
//! [`Workspace`] that the caller owns, and reports what came of it.
//!
//! This crate knows no file and no name: joints are ids.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

// In the order of dependency: none imports from one below it.
mod words;

mod objective;

pub mod objectives;

mod problem;

mod layout;

mod algebra;

mod state;

mod step;

mod model;

mod method;

mod search;

mod report;

mod front;

pub use front::check::{CheckError, check_jacobian};
pub use front::evaluation::{EvaluatedRow, Evaluation};
pub use front::motion_evaluation::MotionEvaluation;
pub use front::planner::{MotionWorkspace, PlannedMotion};
pub use front::solver::{Solver, Workspace};
pub use method::{AdamOptions, Method, PoseMethod, Search, Settle, SolverOptions, Start};
pub use objective::{
    JointCoords, LaneScratch, MOST_EARLIER, MOST_PARTS, MOST_ROWS, Objective, Part, Reach, Reads, Residual,
    Rows, TermReads, TermWarning, Unfit, UnfitReason, View,
};
pub use problem::{
    MotionError, MotionProblem, Problem, TargetPath, TargetPathError, Term, TermId, Timeline, TimelineError,
    Tolerance, When,
};
pub use report::force::{Force, ForceBy, Hint, LimitKind};
pub use report::invalid::{Invalid, InvalidOptions, InvalidPose, InvalidTerm};
pub use report::{PartReport, PartReports, Report, TermReport, TermTimes};
pub use words::{Loss, Progress, Sense, StopReason, Unit, Watch};
