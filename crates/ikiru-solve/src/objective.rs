//! What an objective is: which frames and motions it reads, and its residual with the derivative by them.

use std::fmt::Debug;

use glam::DVec3;
use ikiru_rig::{Dual, Frame, JointId, JointMotion, Rig};

/// The shape put on a part's residual: how its length `‖r‖` becomes cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Loss {
    /// `‖r‖²`
    #[default]
    Squared,
    /// `‖r‖`, the paper's unsquared distance (equation 16).
    Norm,
    /// `‖r‖²` up to `width`, and `2·width·‖r‖ − width²` beyond (Huber): far targets pull no harder than
    /// near ones. `width` is in the residual's unit and positive.
    Huber {
        /// Where the loss turns from square to linear.
        width: f64,
    },
}

/// Lengths below this count as this in the weight of an unsquared norm, which is infinite at 0.
const SMALLEST_NORM: f64 = 1e-12;

impl Loss {
    /// The cost of a residual whose squared length is `square`.
    #[inline(always)]
    #[must_use]
    pub fn cost(self, square: f64) -> f64 {
        match self {
            Self::Squared => square,
            Self::Norm => square.sqrt(),
            Self::Huber { width } => {
                if square <= width * width {
                    square
                } else {
                    2.0 * width * square.sqrt() - width * width
                }
            }
        }
    }

    /// The derivative of the cost by the squared length: the weight that makes a square of it here.
    #[inline(always)]
    #[must_use]
    pub fn weight(self, square: f64) -> f64 {
        match self {
            Self::Squared => 1.0,
            Self::Norm => 0.5 / square.sqrt().max(SMALLEST_NORM),
            Self::Huber { width } => {
                if square <= width * width {
                    1.0
                } else {
                    width / square.sqrt()
                }
            }
        }
    }

    pub(crate) fn is_valid(self) -> bool {
        match self {
            Self::Huber { width } => width.is_finite() && width > 0.0,
            _ => true,
        }
    }
}

/// What a residual is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Metres.
    Metres,
    /// Radians.
    Radians,
}

impl Unit {
    /// `m` or `rad`.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Metres => "m",
            Self::Radians => "rad",
        }
    }
}

/// Some rows of a residual that belong together: the loss is applied to their length, and a tolerance holds
/// for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// How many rows.
    pub n_rows: usize,
    /// Their unit.
    pub unit: Unit,
}

/// A point of a joint that an objective wants at a place: what a method that reaches for points (CCD,
/// FABRIK) sees of the objective.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// The position of the joint in [`Objective::joints`].
    pub joint: usize,
    /// The point, in the joint's frame (metres).
    pub point: DVec3,
    /// Where it should be, in the world (metres).
    pub target: DVec3,
}

/// What an objective sees when it is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// `world_from_joint` of [`Objective::joints`], in that order.
    pub frames: &'a [Frame<f64>],
}

/// Where an objective puts what it computes.
#[derive(Debug)]
pub struct Rows<'a> {
    /// The residual, one entry a row.
    pub residual: &'a mut [f64],
    /// `[frame][row][6]`, empty where no derivative is wanted.
    jacobian: &'a mut [f64],
    pub(crate) scratch: &'a mut Scratch,
}

/// Memory for residuals that are differentiated by dual numbers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    pub(crate) frames: Vec<Frame<Dual<6>>>,
    pub(crate) residual: Vec<Dual<6>>,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(residual: &'a mut [f64], jacobian: &'a mut [f64], scratch: &'a mut Scratch) -> Self {
        Self { residual, jacobian, scratch }
    }

    /// Whether the derivative is wanted too.
    #[inline(always)]
    #[must_use]
    pub fn wants_jacobian(&self) -> bool {
        !self.jacobian.is_empty()
    }

    /// The derivative of one row by one frame: first by a velocity of its origin (world axes), then by an
    /// angular velocity of the frame (world axes). It is all zeros when the objective is called.
    ///
    /// # Panics
    /// When the objective has no such row or frame.
    #[inline(always)]
    pub fn derivative(&mut self, frame: usize, row: usize) -> &mut [f64] {
        let at = (frame * self.residual.len() + row) * 6;
        &mut self.jacobian[at..at + 6]
    }
}

/// The rows of an objective that read how joints themselves are turned or moved, wherever the body is: one row a
/// degree of freedom of each joint.
///
/// Their residuals make up to two more parts of the objective, behind those of its frames: what turns, in radians, then
/// what slides (sliders and the translation of a free root), in metres.
pub trait JointRows {
    /// The joints that it reads, none of which follows another.
    fn joints(&self) -> &[JointId];

    /// Whether what it wants fits these joints; checked before every solve.
    ///
    /// # Errors
    /// A short text that ends the sentence "the objective …", as in "gives an angle to a ball".
    fn check(&self, rig: &Rig) -> Result<(), &'static str>;

    /// The residual of the `idx`-th joint at its coordinates, one row a degree of freedom (zeros when it is called):
    /// translations first, as in its tangent.
    ///
    /// With `derivative`, also its derivative by the joint's own tangent, row by row (`n_dofs × n_dofs`,
    /// zeros when it is called).
    fn evaluate(
        &self,
        idx: usize,
        motion: &JointMotion,
        coords: &[f64],
        residual: &mut [f64],
        derivative: Option<&mut [f64]>,
    );
}

/// The most parts of one objective, those of its [`JointRows`] included.
pub const MOST_PARTS: usize = 4;

/// One soft wish: a residual that a solver drives to zero.
///
/// An objective knows nothing of chains: it declares the frames that it reads and gives the derivative by
/// their own six directions. To write one with automatic derivatives, implement
/// [`Residual`](crate::Residual) instead.
pub trait Objective: Debug + Send + Sync + 'static {
    /// One lower-case word, as scenarios name it.
    fn kind(&self) -> &'static str;

    /// The joints whose world frames it reads.
    fn joints(&self) -> &[JointId];

    /// The parts of the residual that is computed from frames, in the order of their rows; at most
    /// [`MOST_PARTS`], less those of [`joint_rows`](Self::joint_rows).
    fn parts(&self) -> &[Part];

    /// What is wrong with its numbers; checked before every solve.
    ///
    /// # Errors
    /// A short text that ends the sentence "the objective …", as in "has a target that is not finite".
    fn check(&self) -> Result<(), &'static str>;

    /// Computes the residual, and its derivative where [`Rows::wants_jacobian`].
    fn evaluate(&self, inputs: &Inputs<'_>, rows: &mut Rows<'_>);

    /// Whether success asks for it. Objectives that only shape the pose say no.
    fn mandatory(&self) -> bool {
        true
    }

    /// The rows by joints' own motions, for an objective that has some. Most have none.
    fn joint_rows(&self) -> Option<&dyn JointRows> {
        None
    }

    /// The point that it wants at a place. Most objectives want none; those that do give it here, so that CCD
    /// and FABRIK can reach for it.
    fn reach(&self) -> Option<Reach> {
        None
    }

    /// A text for people: what the objective aims at.
    fn target(&self) -> Option<[f64; 3]> {
        None
    }

    /// Something odd that does not stop a solve, such as a look-at point in the joint's own origin.
    fn warning(&self, inputs: &Inputs<'_>) -> Option<&'static str> {
        let _ = inputs;
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_of_a_loss_is_the_slope_of_its_cost() {
        for loss in [Loss::Squared, Loss::Norm, Loss::Huber { width: 0.3 }, Loss::Huber { width: 2.0 }] {
            for square in [1e-6, 0.04, 0.089, 0.0901, 0.5, 3.9, 4.1, 100.0] {
                let h = 1e-4 * square;
                let slope = (loss.cost(square + h) - loss.cost(square - h)) / (2.0 * h);
                let weight = loss.weight(square);
                assert!(
                    (weight - slope).abs() < 1e-6 * (1.0 + slope),
                    "{loss:?} at {square}: {weight}, {slope}"
                );
            }
        }
        // Square inside, straight outside, and the same where the two meet.
        let huber = Loss::Huber { width: 0.5 };
        assert_eq!([0.04, 0.25, 4.0].map(|square| huber.cost(square)), [0.04, 0.25, 1.75]);
        assert_eq!([Loss::Squared, Loss::Norm].map(|loss| loss.cost(9.0)), [9.0, 3.0]);
        assert!(Loss::Norm.weight(0.0).is_finite());
    }
}
