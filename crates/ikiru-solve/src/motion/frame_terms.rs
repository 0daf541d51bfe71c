//! The terms of a motion at one frame, seen as those of a single pose.

use crate::motion::problem::MotionProblem;
use crate::objective::Objective;
use crate::problem::Terms;

/// The terms that hold at one frame: those that are wanted of it, or those that given frames settle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameTerms<'a> {
    motion: &'a MotionProblem,
    frame: usize,
    settled: bool,
}

impl<'a> FrameTerms<'a> {
    pub(crate) fn wanted(motion: &'a MotionProblem, frame: usize) -> Self {
        Self { motion, frame, settled: false }
    }

    pub(crate) fn settled(motion: &'a MotionProblem, frame: usize) -> Self {
        Self { motion, frame, settled: true }
    }
}

impl Terms for FrameTerms<'_> {
    #[inline]
    fn is_on(&self, term: usize) -> bool {
        if self.settled { self.motion.settles(term, self.frame) } else { self.motion.wants(term, self.frame) }
    }
    #[inline]
    fn weight(&self, term: usize) -> f64 {
        Terms::weight(self.motion.terms(), term)
    }
    #[inline]
    fn objective(&self, term: usize) -> &dyn Objective {
        let track = &self.motion.tracks()[term];
        match track.moving.get(self.frame.wrapping_sub(track.frames.start)) {
            Some(objective) => &**objective,
            None => Terms::objective(self.motion.terms(), term),
        }
    }
}
