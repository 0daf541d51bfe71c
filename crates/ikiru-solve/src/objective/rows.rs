//! Where an objective puts what it computes: the rows that it opens, and their derivative.

use crate::objective::Scratch;
use crate::objective::places::{PartLayout, Place, TermLayout};
use crate::objective::{MOST_PARTS, TermWarning};

/// The derivatives of the rows of all terms, and what else these said.
#[derive(Clone, Debug, Default)]
pub(crate) struct RowMemory {
    /// For each term `[samples back][frame][slot][6]`.
    pub(crate) by_frame: Vec<f64>,
    /// For each term whose rows may read several motions, `[slot][degree of freedom of the motions that are read]`.
    pub(crate) by_motion: Vec<f64>,
    /// For each separable row of the layout, which motion it reads, and its derivative by it.
    pub(crate) own_motion: Vec<usize>,
    pub(crate) own: Vec<[f64; 6]>,
    /// How many rows of each part are open.
    pub(crate) n_open: [usize; MOST_PARTS],
    /// The potential, and its slope and curvature by the degrees of freedom of the motions that are read.
    pub(crate) value: f64,
    pub(crate) slope: Vec<f64>,
    pub(crate) curvature: Vec<f64>,
    /// The first term that gave up, and why.
    pub(crate) failure: Option<(usize, &'static str)>,
    /// What the last term that found something odd said.
    pub(crate) warning: Option<TermWarning>,
    pub(crate) scratch: Scratch,
}

/// Where an objective puts what it computes.
#[derive(Debug)]
pub struct Rows<'a> {
    residual: &'a mut [f64],
    term: &'a TermLayout,
    parts: &'a [PartLayout],
    memory: &'a mut RowMemory,
    wants_jacobian: bool,
}

impl<'a> Rows<'a> {
    /// No rows open yet; `residual` is that of the whole layout.
    #[inline(always)]
    pub(crate) fn new(
        residual: &'a mut [f64],
        term: &'a TermLayout,
        parts: &'a [PartLayout],
        memory: &'a mut RowMemory,
        wants_jacobian: bool,
    ) -> Self {
        memory.n_open = [0; MOST_PARTS];
        if wants_jacobian {
            memory.by_frame[term.by_frame.clone()].fill(0.0);
            if term.n_motion_dofs > 0 {
                memory.by_motion[term.by_motion.clone()].fill(0.0);
                memory.own[term.own_rows.clone()].fill([0.0; 6]);
            }
        }
        if term.has_potential {
            memory.value = 0.0;
            memory.slope[term.slope.clone()].fill(0.0);
            memory.curvature[term.slope.clone()].fill(0.0);
        }
        Self { residual, term, parts, memory, wants_jacobian }
    }

    /// Whether the derivative is wanted too.
    #[inline(always)]
    #[must_use]
    pub fn wants_jacobian(&self) -> bool {
        self.wants_jacobian
    }

    /// Opens the next `N` rows of a part with their residuals; the answer is the number of the first of them among all
    /// rows that the objective may open. More rows than it said it might open end the solve, and name it.
    ///
    /// # Panics
    /// When the objective has no such part.
    #[inline(always)]
    pub fn open<const N: usize>(&mut self, part: usize, residual: [f64; N]) -> usize {
        let (first, row) = self.reserve(part, N);
        if let Some(to) = self.residual[row..].first_chunk_mut::<N>() {
            *to = residual;
        }
        first
    }

    /// Opens all rows of a part; their residuals are 0 until they are set.
    ///
    /// # Panics
    /// When the objective has no such part.
    #[inline(always)]
    pub fn open_all(&mut self, part: usize) -> &mut [f64] {
        let n = self.parts[part].n_rows;
        let (_, row) = self.reserve(part, n - self.memory.n_open[part].min(n));
        let rows = &mut self.residual[row..row + n];
        rows.fill(0.0);
        rows
    }

    /// The number of the first of `n` new rows among those of the objective, and among those of the layout.
    #[inline(always)]
    fn reserve(&mut self, part: usize, n: usize) -> (usize, usize) {
        let layout = &self.parts[part];
        let mut open = self.memory.n_open[part];
        if open + n > layout.n_rows {
            let term = self.term.term;
            self.memory.failure.get_or_insert((term, "opened more rows than it said it might"));
            open = 0;
        }
        self.memory.n_open[part] = (open + n).min(layout.n_rows);
        (layout.slot + open, layout.row + open)
    }

    /// The derivative of a row by a frame that is read: first by a velocity of its origin (world axes), then by an angular
    /// velocity of the frame (world axes). It is all zeros when the objective is called. Only where
    /// [`wants_jacobian`](Self::wants_jacobian).
    ///
    /// # Panics
    /// When the objective has no such row or frame.
    #[inline(always)]
    pub fn by_frame(&mut self, row: usize, frame: usize) -> &mut [f64] {
        let at = self.term.by_frame.start + (frame * self.term.n_slots + row) * 6;
        &mut self.memory.by_frame[at..at + 6]
    }

    /// The derivative of a row by a frame that is read, so many samples earlier, from 1; as [`by_frame`](Self::by_frame) has it.
    ///
    /// # Panics
    /// When the objective has no such row or frame, or does not read so many [earlier](crate::Reads::earlier) samples.
    pub fn by_earlier_frame(&mut self, row: usize, back: usize, frame: usize) -> &mut [f64] {
        self.by_frame(row, back * self.term.nodes.len() + frame)
    }

    /// The derivative of a row by the tangent of a joint whose own motion is read: translations first, then turns. It is
    /// all zeros when the objective is called. A row of a [separable](crate::Part::separable) part has one by one joint
    /// alone. Only where [`wants_jacobian`](Self::wants_jacobian).
    ///
    /// # Panics
    /// When the objective has no such row or motion.
    #[inline(always)]
    pub fn by_motion(&mut self, row: usize, motion: usize) -> &mut [f64] {
        let read = &self.term.joint_reads[motion];
        let part = self.parts.iter().find(|part| (part.slot..part.slot + part.n_rows).contains(&row));
        if let Some(PartLayout { place: Place::Own { first }, slot, .. }) = part {
            let at = first + row - slot;
            self.memory.own_motion[at] = motion;
            return &mut self.memory.own[at][..read.n_dofs];
        }
        let at = self.term.by_motion.start + row * self.term.n_motion_dofs + read.at;
        &mut self.memory.by_motion[at..at + read.n_dofs]
    }

    /// Adds to the potential: a cost `λ · value` that is no residual, for an objective that [said](crate::Reads::potential)
    /// that it has one.
    #[inline]
    pub fn add_value(&mut self, value: f64) {
        self.memory.value += value;
    }

    /// The derivative of the potential by the tangent of a joint whose own motion is read, and a bound on its curvature
    /// along each of those directions (at least 0). Both are all zeros when the objective is called.
    ///
    /// # Panics
    /// When the objective has no such motion, or said that it has no potential.
    pub fn slope(&mut self, motion: usize) -> (&mut [f64], &mut [f64]) {
        let read = &self.term.joint_reads[motion];
        let first = self.term.slope.start + read.at;
        let dofs = first..first + read.n_dofs;
        (&mut self.memory.slope[dofs.clone()], &mut self.memory.curvature[dofs])
    }

    /// Gives up: the solve ends with the best pose so far, and the report names the objective. `reason` ends the sentence
    /// "the objective …".
    pub fn fail(&mut self, reason: &'static str) {
        let term = self.term.term;
        self.memory.failure.get_or_insert((term, reason));
    }

    /// Tells something odd that does not stop a solve, such as a look-at point in the joint's own origin; the report
    /// has it if it is so at the end. A text of your own ends the sentence "the objective …".
    #[inline]
    pub fn warn(&mut self, warning: impl Into<TermWarning>) {
        self.memory.warning = Some(warning.into());
    }

    pub(crate) fn scratch(&mut self) -> &mut Scratch {
        &mut self.memory.scratch
    }
}
