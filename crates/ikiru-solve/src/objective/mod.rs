//! What an objective is: what it reads of a rig, and the rows that it gives, with their derivative by what it reads.

use std::fmt::Debug;

use glam::DVec3;
use ikiru_rig::Rig;

mod duals;
pub(crate) mod lanes;
mod most;
pub(crate) mod places;
mod reads;
pub(crate) mod residual;
mod rows;
mod unfit;
mod view;

pub(crate) use duals::Scratch;
pub use lanes::LaneScratch;
pub use most::{MOST_EARLIER, MOST_PARTS, MOST_ROWS};
pub use reads::{Part, Reads, TermReads};
pub use residual::Residual;
pub(crate) use rows::RowMemory;
pub use rows::Rows;
pub use unfit::{TermWarning, Unfit, UnfitReason};
pub use view::{JointCoords, View};

/// A point of a joint that an objective wants at a place: what a method that reaches for points (CCD,
/// FABRIK) sees of the objective.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Which of the frames that it reads.
    pub frame: usize,
    /// The point, in the joint's frame (metres).
    pub point: DVec3,
    /// Where it should be, in the world (metres).
    pub target: DVec3,
}

/// Something that is wanted of a pose: rows of a residual, each of which wants to be zero or at least zero.
///
/// An objective knows nothing of chains, weights and solvers. It [reads](Self::reads) frames and local motions of
/// joints, and gives the derivative of its rows by their own few directions; the same rows are a soft wish or a hard
/// constraint, as the [term](crate::Term) says. To write one with automatic derivatives, implement
/// [`Residual`](crate::Residual) instead.
pub trait Objective: Debug + Send + Sync + 'static {
    /// One lower-case word, as scenarios name it.
    fn kind(&self) -> &'static str;

    /// Names what it reads, and the most rows that it may open. It is asked when a solve starts, and answers the same as
    /// long as it stands for the same joints: with another answer the problem is laid out anew.
    ///
    /// # Errors
    /// What does not fit the rig.
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit>;

    /// What is wrong with its numbers; checked before every solve.
    ///
    /// # Errors
    /// What is not usable, as in "has a target that is not finite".
    fn check(&self) -> Result<(), Unfit>;

    /// Opens the rows that count at what it sees, and gives their derivative where [`Rows::wants_jacobian`]. A row that
    /// is not opened wants nothing.
    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>);

    /// Whether success asks for it unless the term says otherwise. Objectives that only shape the pose say no.
    fn mandatory(&self) -> bool {
        true
    }

    /// The point that it wants at a place, for an objective that wants one: CCD and FABRIK reach for it.
    fn reach(&self) -> Option<Reach> {
        None
    }
}

/// Whether an objective's numbers are usable, and what it reads of a rig.
pub(crate) fn check_objective(
    rig: &Rig,
    objective: &dyn Objective,
    reads: &mut TermReads,
) -> Result<(), Unfit> {
    objective.check()?;
    objective.reads(&mut Reads::new(rig, reads))
}
