//! A motion, checked and laid out: once for motions of the same shape.

use ikiru_rig::JointId;

use crate::layout::Layout;
use crate::objective::{TermReads, Unfit};
use crate::problem::motion::MotionProblem;
use crate::report::invalid::Invalid;
use crate::state::motion::MotionState;

/// The layout of a motion and its state, in memory that is kept.
#[derive(Clone, Debug, Default)]
pub(super) struct MotionLayout {
    pub(super) layout: Layout,
    pub(super) state: MotionState,
    led: Vec<JointId>,
    reads: TermReads,
}

impl MotionLayout {
    /// Checks a motion, and lays it out as far as it is another one than before; says whether the layout is another one.
    pub(super) fn fit(&mut self, motion: &MotionProblem) -> Result<bool, Invalid> {
        let unfit = |(term, unfit): (usize, Unfit)| Invalid::Term(term, unfit.into());
        motion.check_moving(&mut self.reads).map_err(unfit)?;
        motion.led(&mut self.led);
        if self.layout.signature.check(motion.terms(), &self.led).map_err(unfit)? {
            self.state.fit(&self.layout, motion);
            return Ok(false);
        }
        self.layout = Layout::with(motion.terms(), &self.led).map_err(unfit)?;
        self.state = MotionState::new(&self.layout, motion);
        Ok(true)
    }
}
