//! The joints and terms of a motion, by their ids: what a problem of a single pose answers, a motion answers too.

use std::ops::{Index, IndexMut};

use ikiru_rig::JointId;

use crate::objective::{Objective, TermReads, Unfit};
use crate::problem::motion::MotionProblem;
use crate::problem::term::{Term, TermId};

impl MotionProblem {
    /// Whether a joint may move.
    #[must_use]
    pub fn is_active(&self, joint: JointId) -> bool {
        self.base.is_active(joint)
    }

    /// The joints that may move and have degrees of freedom of their own, parents first.
    pub fn active(&self) -> impl Iterator<Item = JointId> + '_ {
        self.base.active()
    }

    /// The position of a term among [`terms`](Self::terms) and in reports; `None` where there is no such term.
    #[must_use]
    pub fn position<T>(&self, id: TermId<T>) -> Option<usize> {
        self.base.position(id)
    }

    /// What a term reads, and the rows that it may open at one sample.
    ///
    /// # Errors
    /// What does not fit the rig, or is not usable otherwise.
    pub fn reads(&self, term: &Term) -> Result<TermReads, Unfit> {
        self.base.reads(term)
    }

    /// The objective of a term, of one that moves that of its first sample; `None` where the id is of another motion
    /// and does not fit.
    #[must_use]
    pub fn get<T: Objective>(&self, id: TermId<T>) -> Option<&T> {
        self.base.get(id)
    }

    /// The objective of a term that stays, to change it between plans; `None` where the id is of another motion and does
    /// not fit. Of a term that moves this is only a copy of its first sample's:
    /// [`set_moving`](Self::set_moving) changes it.
    #[must_use]
    pub fn get_mut<T: Objective>(&mut self, id: TermId<T>) -> Option<&mut T> {
        self.base.get_mut(id)
    }

    /// A term: its weight, loss and tolerance at all its samples.
    ///
    /// # Panics
    /// When the motion has no such term; [`position`](Self::position) does not.
    #[must_use]
    pub fn term<T>(&self, id: TermId<T>) -> &Term {
        self.base.term(id)
    }

    /// A term, to change how it counts at all its samples.
    ///
    /// # Panics
    /// When the motion has no such term; [`position`](Self::position) does not.
    #[must_use]
    pub fn term_mut<T>(&mut self, id: TermId<T>) -> &mut Term {
        self.base.term_mut(id)
    }

    /// The terms, to change how they count: they stay as many, in the same order.
    pub fn terms_mut(&mut self) -> &mut [Term] {
        self.base.terms_mut()
    }

    /// Takes a term out for good; `None` where it is gone already. The answer is the objective that the id led to.
    pub fn remove<T: Objective + Clone>(&mut self, id: TermId<T>) -> Option<T> {
        self.base.get(id)?;
        let at = self.base.position(id)?;
        self.tracks.remove(at);
        self.base.remove(id)
    }
}

impl<T: Objective> Index<TermId<T>> for MotionProblem {
    type Output = T;

    /// # Panics
    /// When the id is of another problem and does not fit; [`MotionProblem::get`] does not.
    fn index(&self, id: TermId<T>) -> &T {
        &self.base[id]
    }
}

impl<T: Objective> IndexMut<TermId<T>> for MotionProblem {
    /// An objective that stays, to change it between solves. Of one that moves this is only a copy of its first
    /// sample's.
    ///
    /// # Panics
    /// When the id is of another problem and does not fit; [`MotionProblem::get_mut`] does not.
    fn index_mut(&mut self, id: TermId<T>) -> &mut T {
        &mut self.base[id]
    }
}
