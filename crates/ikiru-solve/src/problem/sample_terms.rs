//! The terms of a motion at one sample, seen as those of a single pose.

use crate::objective::Objective;
use crate::problem::Terms;
use crate::problem::motion::MotionProblem;
use crate::problem::term::Term;

/// Which of the terms that hold at a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Holding {
    /// Those that a plan can still do something for.
    Wanted,
    /// Those that given samples settle.
    Settled,
    /// Those that are switched off.
    Off,
}

/// The terms that hold at one sample: those that are wanted of it, those that given samples settle, or those that are
/// switched off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleTerms<'a> {
    motion: &'a MotionProblem,
    sample: usize,
    holding: Holding,
}

impl<'a> SampleTerms<'a> {
    pub(crate) fn wanted(motion: &'a MotionProblem, sample: usize) -> Self {
        Self { motion, sample, holding: Holding::Wanted }
    }

    pub(crate) fn off(motion: &'a MotionProblem, sample: usize) -> Self {
        Self { motion, sample, holding: Holding::Off }
    }

    pub(crate) fn settled(motion: &'a MotionProblem, sample: usize) -> Self {
        Self { motion, sample, holding: Holding::Settled }
    }
}

impl Terms for SampleTerms<'_> {
    #[inline]
    fn is_on(&self, term: usize) -> bool {
        match self.holding {
            Holding::Wanted => self.motion.wants(term, self.sample),
            Holding::Settled => self.motion.settles(term, self.sample),
            Holding::Off => self.motion.is_off_at(term, self.sample),
        }
    }
    #[inline]
    fn term(&self, term: usize) -> &Term {
        Terms::term(self.motion.terms(), term)
    }
    #[inline]
    fn objective(&self, term: usize) -> &dyn Objective {
        let track = &self.motion.tracks()[term];
        match track.moving.get(self.sample.wrapping_sub(track.samples.start)) {
            Some(objective) => &**objective,
            None => Terms::objective(self.motion.terms(), term),
        }
    }
}
