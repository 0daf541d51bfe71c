//! When a term of a motion holds, and what it wants at each of its samples.

use std::ops::Range;

use ikiru_rig::Rig;

use crate::objective::{Objective, Reads, TermReads};
use crate::problem::term::AnyObjective;

/// Where a term holds, and its objectives where they move.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    pub(crate) samples: Range<usize>,
    /// How many samples before its own the term reads.
    pub(crate) n_earlier: usize,
    /// One a sample; empty for an objective that stays.
    pub(crate) moving: Vec<Box<dyn AnyObjective>>,
}

impl Track {
    /// Whether the term holds at a sample, which has to have as many before it as the term reads.
    pub(crate) fn holds(&self, sample: usize) -> bool {
        self.samples.contains(&sample) && sample >= self.n_earlier
    }
}

/// How many samples before its own an objective reads; what does not fit the rig is told when the motion is planned.
pub(crate) fn n_earlier(rig: &Rig, objective: &dyn Objective) -> usize {
    let mut reads = TermReads::default();
    objective.reads(&mut Reads::new(rig, &mut reads)).map_or(0, |()| reads.n_earlier)
}

/// Whether two objectives read the same of a rig, and open as many rows.
pub(crate) fn reads_the_same(rig: &Rig, a: &dyn Objective, b: &dyn Objective) -> bool {
    let reads = |objective: &dyn Objective| {
        let mut reads = TermReads::default();
        // What does not fit the rig is told when the motion is planned.
        objective.reads(&mut Reads::new(rig, &mut reads)).map(|()| reads)
    };
    reads(a) == reads(b)
}
