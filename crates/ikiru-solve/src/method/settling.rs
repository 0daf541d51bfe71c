//! Frame by frame: how a step is damped that begins near, which step is the last, and when a frame is left that cannot be met.
//!
//! Nothing is remembered from one frame to the next: damping that was carried over would be small after easy frames, and a hard one
//! then overshoots into another way to bend, and stays there.

use crate::model::Model;

/// Damping as a part of the cost, and the least of it, relative to the largest curvature, which is what keeps turns small that
/// nothing asks for (Sugihara, 2011, has both).
const PER_COST: f64 = 0.1;
const LEAST: f64 = 1e-6;
/// A frame is met well where every mandatory term is within this part of its tolerance.
const WELL: f64 = 0.3;
/// The model was right about a step where the cost is off by less than this part of it; and all is said where every mandatory term is
/// within this part of its tolerance.
const RIGHT: f64 = 0.1;
/// A frame cannot be met where so many steps in a row gain less than this part of the cost.
const LITTLE: f64 = 1e-3;
const N_LITTLE: usize = 2;

/// What the steps of a frame did so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Settling {
    n_little: usize,
}

/// A step that was taken: the merit before it, what it was promised to be, and what it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Taken {
    pub(crate) before: f64,
    pub(crate) promised: f64,
    pub(crate) now: f64,
}

impl Settling {
    /// The damping for a cost, where `scale` is the largest curvature.
    pub(crate) fn damping(cost: f64, scale: f64) -> f64 {
        PER_COST * cost + LEAST * scale
    }

    /// Whether a step was the last: the frame is met well and not much is left, or it cannot be met. `is_short` says of a step
    /// that it gained little for its damping alone.
    pub(crate) fn is_over<M: Model>(&mut self, model: &M, taken: Taken, is_short: bool) -> bool {
        let Taken { before, promised, now } = taken;
        self.n_little = if before - now < LITTLE * before && !is_short { self.n_little + 1 } else { 0 };
        if self.n_little >= N_LITTLE {
            return true;
        }
        let is_right = (now - promised).abs() < RIGHT * now;
        model.is_satisfied(if is_right { WELL } else { RIGHT })
    }
}
