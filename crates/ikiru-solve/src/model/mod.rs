//! What a method improves: a pose, or all poses of a trajectory at once.
//!
//! The loops (`method/`, `search/`) exist once, over [`Model`]: they know coordinates, a cost, what hard rows miss, and steps,
//! and nothing of joints, objectives or time.

#[cfg(test)]
pub(crate) mod cases;
mod pose;
mod rules;
mod trajectory;

use crate::algebra::cholesky::NotPositiveDefinite;

pub(crate) use pose::PoseModel;
pub(crate) use rules::{Effort, Rules};
pub(crate) use trajectory::{Trajectory, TrajectoryMemory};

/// Coordinates inside limits, with a cost that steps bring down. Limits hold wherever it is moved to.
pub(crate) trait Model {
    /// Where it is now.
    fn coords(&self) -> &[f64];

    /// Moves it somewhere inside its limits. Nothing is evaluated.
    fn set_coords(&mut self, coords: &[f64]);

    /// The cost at the coordinates, infinite where it is not a number; what hard rows miss is evaluated with it.
    fn evaluate(&mut self) -> f64;

    /// The same, of coordinates from which a step will likely be taken: the linearization then finds what it needs.
    fn differentiate(&mut self) -> f64;

    /// By how much hard rows are missed, summed up (metres, radians), as of the last evaluation.
    fn violation(&self) -> f64;

    /// The squares of what they miss, summed up.
    fn hard_square(&self) -> f64;

    /// Whether there may be guards: what is hard, and what wants to be at least something.
    fn may_have_guards(&self) -> bool;

    /// Whether an objective gave up.
    fn has_failed(&self) -> bool;

    /// Whether every hard term is within its tolerance, as of the last evaluation.
    fn holds(&self) -> bool;

    /// Whether every mandatory term is within a part of its tolerance, as of the last evaluation.
    fn is_satisfied(&self, part: f64) -> bool;

    /// Keeps what terms miss, as of the last evaluation, for [`gets_on`](Self::gets_on).
    fn remember(&mut self);

    /// Whether a mandatory term that is not within a part of its tolerance, `well`, misses less by the part `little` of the square of
    /// what it missed when that was kept.
    fn gets_on(&self, well: f64, little: f64) -> bool;

    /// Linearizes at the coordinates that were evaluated last.
    fn linearize(&mut self);

    /// The gradient of the cost by every tangent, with `hard` times the squares of what hard rows miss, as of the last
    /// linearization; 0 for what may not move.
    fn gradient(&self, hard: f64, gradient: &mut [f64]);

    /// How many tangents there are, and how many of them may move.
    fn n_tangents(&self) -> (usize, usize);

    /// Numbers that steer the loop, as of the last linearization.
    fn rules(&self) -> Rules;

    /// Forgets what guards did in an earlier solve.
    fn forget_guards(&mut self);

    /// Takes over a linearization for steps from it. The answer is the largest entry of half the gradient that
    /// neither limits nor the forces of the step before hold up.
    fn begin(&mut self) -> f64;

    /// Whether guards are there, as of the last linearization.
    fn has_guards(&self) -> bool;

    /// The largest curvature along one tangent, by which damping is measured; steps take it over.
    fn scale(&mut self) -> f64;

    /// The next step is to make good a share of what hard rows miss.
    fn aim(&mut self, share: f64);

    /// Computes a step for a damping. An error where the system cannot be solved with so little of it.
    fn solve(&mut self, damping: f64) -> Result<(), NotPositiveDefinite>;

    /// The largest force of a hard row in the step.
    fn largest_force(&self) -> f64;

    /// The cost and the violation that the linear model promises for the step.
    fn promised(&mut self) -> (f64, f64);

    /// The longest entry of the step.
    fn longest(&self) -> f64;

    /// Moves it by its step from some coordinates.
    fn advance(&mut self, from: &[f64]);

    /// Moves it by a tangent from some coordinates.
    fn advance_by(&mut self, from: &[f64], tangent: &[f64]);

    /// Solves the step once more, for the residuals at the coordinates that it led to, less what the linear model
    /// says of them (a second-order correction). False where there is nothing to correct.
    fn correct(&mut self, damping: f64) -> bool;
}
