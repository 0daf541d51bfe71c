//! A term: one objective inside a problem, how much it counts, and when it is met.

use std::any::Any;
use std::marker::PhantomData;

use crate::objective::{Objective, Unfit, UnfitReason};
use crate::words::{Loss, Unit};

/// One objective inside a problem, and how it counts there.
#[derive(Clone, Debug)]
pub struct Term {
    /// The weight λ: the term costs `λ · ρ(r)`. At least 0; one of 0 never counts for success.
    pub weight: f64,
    /// The loss ρ on the length of each part's residual; the square by default.
    pub loss: Loss,
    /// How near is near enough.
    pub tolerance: Tolerance,
    /// Whether success asks for it; by default as the objective says.
    pub mandatory: bool,
    /// Whether it is a constraint: its rows hold at the end of a solve within its tolerance, whatever that costs, or the
    /// report names it. Weight and loss then say nothing, and it adds nothing to the cost.
    pub hard: bool,
    /// Whether it takes part. One that does not costs nothing, pulls at nothing and never counts for success; its
    /// residual is reported all the same.
    pub is_on: bool,
    /// What ids are told apart by: no two terms that a problem ever had have the same.
    pub(crate) key: u32,
    pub(crate) objective: Box<dyn AnyObjective>,
}

impl Term {
    pub(crate) fn new<T: Objective + Clone>(key: u32, weight: f64, objective: T) -> Self {
        Self {
            weight,
            loss: Loss::default(),
            tolerance: Tolerance::default(),
            mandatory: objective.mandatory(),
            hard: false,
            is_on: true,
            key,
            objective: Box::new(objective),
        }
    }

    /// What it wants.
    #[must_use]
    pub fn objective(&self) -> &dyn Objective {
        &*self.objective
    }

    /// Whether success asks for it.
    pub(crate) fn counts(&self) -> bool {
        self.is_on && (self.hard || (self.mandatory && self.weight > 0.0))
    }

    /// What is wrong with its own numbers.
    pub(crate) fn check(&self) -> Result<(), Unfit> {
        if !(self.weight.is_finite() && self.weight >= 0.0) {
            return Err(UnfitReason::Weight.into());
        }
        if !self.tolerance.is_valid() {
            return Err(UnfitReason::Tolerance.into());
        }
        if !self.loss.is_valid() {
            return Err(UnfitReason::HuberWidth.into());
        }
        Ok(())
    }
}

/// How near is near enough, by unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// For parts in metres; 1 mm by default.
    pub metres: f64,
    /// For parts in radians; 0.5° by default.
    pub radians: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { metres: 1e-3, radians: 0.5_f64.to_radians() }
    }
}

impl Tolerance {
    /// What hard terms hold to: 0.1 mm and 0.01°.
    pub const HARD: Self = Self { metres: 1e-4, radians: 0.01 * std::f64::consts::PI / 180.0 };

    /// A part of it.
    pub(crate) fn times(self, part: f64) -> Self {
        Self { metres: part * self.metres, radians: part * self.radians }
    }

    /// That of a unit, in it.
    #[must_use]
    pub fn of(&self, unit: Unit) -> f64 {
        match unit {
            Unit::Metres => self.metres,
            Unit::Radians => self.radians,
        }
    }

    fn is_valid(&self) -> bool {
        [self.metres, self.radians].iter().all(|t| *t >= 0.0)
    }
}

/// An objective that can be copied, and seen as what it is.
pub(crate) trait AnyObjective: Objective {
    fn as_any(&self) -> &dyn Any;
    fn as_any_mut(&mut self) -> &mut dyn Any;
    fn clone_boxed(&self) -> Box<dyn AnyObjective>;
}

impl<T: Objective + Clone> AnyObjective for T {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
    fn clone_boxed(&self) -> Box<dyn AnyObjective> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn AnyObjective> {
    fn clone(&self) -> Self {
        (**self).clone_boxed()
    }
}

/// The id of a term that knows what objective it is: `problem[id]` is that objective. It stays good in copies of the
/// problem, and when other terms are removed.
pub struct TermId<T> {
    pub(crate) key: u32,
    objective: PhantomData<fn() -> T>,
}

impl<T> TermId<T> {
    pub(crate) fn new(key: u32) -> Self {
        Self { key, objective: PhantomData }
    }
}

impl<T> Clone for TermId<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for TermId<T> {}
impl<T> std::fmt::Debug for TermId<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "TermId({})", self.key)
    }
}
