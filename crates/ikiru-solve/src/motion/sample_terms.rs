//! The terms of a motion at one sample, seen as those of a single pose.

use crate::motion::problem::MotionProblem;
use crate::objective::Objective;
use crate::problem::Terms;

/// The terms that hold at one sample: those that are wanted of it, or those that given samples settle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleTerms<'a> {
    motion: &'a MotionProblem,
    sample: usize,
    settled: bool,
}

impl<'a> SampleTerms<'a> {
    pub(crate) fn wanted(motion: &'a MotionProblem, sample: usize) -> Self {
        Self { motion, sample, settled: false }
    }

    pub(crate) fn settled(motion: &'a MotionProblem, sample: usize) -> Self {
        Self { motion, sample, settled: true }
    }
}

impl Terms for SampleTerms<'_> {
    #[inline]
    fn is_on(&self, term: usize) -> bool {
        if self.settled {
            self.motion.settles(term, self.sample)
        } else {
            self.motion.wants(term, self.sample)
        }
    }
    #[inline]
    fn weight(&self, term: usize) -> f64 {
        Terms::weight(self.motion.terms(), term)
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
