//! Where what a term reads and gives lies in a layout.

use std::ops::Range;

use ikiru_rig::{JointId, JointMotion};

use crate::words::{Sense, Unit};

/// A joint whose own motion a term reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointRead {
    pub(crate) motion: JointMotion,
    pub(crate) coord: usize,
    pub(crate) n_coords: usize,
    pub(crate) n_dofs: usize,
    /// Where its degrees of freedom lie among those of all motions that the term reads.
    pub(crate) at: usize,
    /// Where its degrees of freedom lie; `None` for a joint that does not move.
    pub(crate) dof: Option<usize>,
}

/// Where the rows of a part take part in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// In the rows that the step is solved over: wishes.
    Step,
    /// Among the guards, which have a sense and a force of their own: what is hard, and what wants to be at least something.
    Guard {
        /// The first one among those.
        first: usize,
    },
    /// In gradient and curvature alone, since each reads a single joint.
    Own {
        /// The first one among those.
        first: usize,
    },
}

/// A part of a term.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PartLayout {
    /// The most rows.
    pub(crate) n_rows: usize,
    pub(crate) unit: Unit,
    pub(crate) sense: Sense,
    pub(crate) place: Place,
    /// Its first row among all rows of the layout, and among those of its term.
    pub(crate) row: usize,
    pub(crate) slot: usize,
}

/// Neighbouring rows of a term in one kind of place.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    pub(crate) slots: Range<usize>,
    /// The first row: of the step's, or of the guards.
    pub(crate) first: usize,
    pub(crate) is_guard: bool,
}

/// Where a term's rows, frames and parts lie.
#[derive(Clone, Debug)]
pub(crate) struct TermLayout {
    pub(crate) term: usize,
    /// Nodes whose frames it reads.
    pub(crate) nodes: Vec<u32>,
    /// Its rows among those of the step.
    pub(crate) rows: Range<usize>,
    pub(crate) parts: Range<usize>,
    /// The most rows of all parts together.
    pub(crate) n_slots: usize,
    /// Its rows but for the separable ones, in runs.
    pub(crate) runs: Vec<Run>,
    pub(crate) joint_reads: Vec<JointRead>,
    /// How many degrees of freedom the motions have that it reads.
    pub(crate) n_motion_dofs: usize,
    /// Where the derivative of its rows lies by frames; by motions, where there are rows that may read several of them
    /// at once; and that of its potential.
    pub(crate) by_frame: Range<usize>,
    pub(crate) by_motion: Range<usize>,
    pub(crate) slope: Range<usize>,
    /// Its separable rows.
    pub(crate) own_rows: Range<usize>,
    pub(crate) has_potential: bool,
    pub(crate) is_hard: bool,
    /// Whether its derivatives come by dual numbers.
    pub(crate) is_by_duals: bool,
    /// Whether nothing that moves is read: it costs the same at every pose of a solve.
    pub(crate) is_constant: bool,
    /// Whether its frames are so many that their rows are summed up from the leaves to the root.
    pub(crate) sums_up: bool,
    /// At how many earlier samples it reads the same frames.
    pub(crate) n_earlier: usize,
    /// The first joint that it reads.
    pub(crate) joint: Option<JointId>,
}
