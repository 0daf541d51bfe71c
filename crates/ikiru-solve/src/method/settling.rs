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
/// The model was right about a step where the cost is off by less than this part of it.
const RIGHT: f64 = 0.1;
/// Whether it was or not, all is said where every mandatory term is within this part of its tolerance.
const VERY_WELL: f64 = 0.1;
/// A frame cannot be met where so many steps in a row, none short for its damping alone, gain less than this part of the cost, and bring
/// down no mandatory term, of those that are not met well, by this part of the square of what it misses. The cost alone does not tell:
/// beside one target far out of reach, what all others gain is next to nothing.
const LITTLE: f64 = 1e-3;
const LITTLE_OF_TERM: f64 = 0.1;
const N_LITTLE: usize = 2;

/// What the steps of a frame did so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Settling {
    n_little: usize,
}

/// A step that was taken: what it was judged by before it, what that was promised to be, and what it is; and whether it was short for
/// damping that rejected steps had made more than the largest curvature.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Taken {
    pub(crate) before: f64,
    pub(crate) promised: f64,
    pub(crate) now: f64,
    pub(crate) is_short: bool,
}

impl Settling {
    /// The damping for a cost, where `scale` is the largest curvature.
    pub(crate) fn damping(cost: f64, scale: f64) -> f64 {
        if scale > 0.0 { PER_COST * cost + LEAST * scale } else { 1.0 }
    }

    /// Whether a step was the last: the frame is met well and not much is left, or it cannot be met.
    pub(crate) fn is_over<M: Model>(&mut self, model: &M, taken: Taken) -> bool {
        let Taken { before, promised, now, is_short } = taken;
        if before - now >= LITTLE * before || model.gets_on(WELL, LITTLE_OF_TERM) {
            self.n_little = 0;
        } else if !is_short {
            self.n_little += 1;
        }
        let is_right = (now - promised).abs() < RIGHT * now;
        self.n_little >= N_LITTLE || model.is_satisfied(if is_right { WELL } else { VERY_WELL })
    }
}
