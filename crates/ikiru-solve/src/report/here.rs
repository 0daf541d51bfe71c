//! One sample of what is explained: a pose, or one of a motion.

use ikiru_rig::Rig;

use crate::layout::Layout;
use crate::state::State;

/// Whose forces are to be balanced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Of {
    /// Those of wishes, by constraints too.
    Wishes,
    /// Those of constraints that are not met.
    UnmetConstraints,
}

/// What pulls besides the terms of one pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beside<'a> {
    /// The gradient of smoothness.
    pub(crate) smoothness: &'a [f64],
    /// Whether what is not balanced is held by limits on rates.
    pub(crate) holds_rates: bool,
}

/// One sample of what is explained.
pub(crate) struct Here<'a, T> {
    pub(crate) layout: &'a Layout,
    pub(crate) rig: &'a Rig,
    /// Linearized.
    pub(crate) state: &'a State,
    /// Those that hold here.
    pub(crate) terms: T,
    /// What pulls besides them.
    pub(crate) beside: Option<Beside<'a>>,
    /// When that is, in a motion.
    pub(crate) secs: Option<f64>,
}
