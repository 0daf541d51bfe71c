//! How to solve: method, search, and the stopping rules of the paper's section 3.6.

use std::time::Duration;

use crate::method::{Budget, Clock, PoseMethod};
use crate::words::Watch;

/// How a single start is improved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// Bounded Levenberg–Marquardt: second order, limits by an active set.
    #[default]
    Lm,
    /// The paper's cautious Adam (equations 8 to 15), to compare with.
    Adam(AdamOptions),
    /// Cyclic coordinate descent: one degree of freedom after the other, tips first, each to the best value inside
    /// its limits; one iteration is one sweep. A baseline (Wang and Chen, 1991).
    Ccd,
    /// Forward and backward reaching (Aristidou and Lasenby, 2011) on chains and trees, brought back inside the
    /// limits in every iteration. It sees the points that objectives want at places
    /// ([`Objective::reach`](crate::Objective::reach)) and nothing else; the cost judges. A baseline.
    Fabrik,
    /// A method from outside of this crate, of poses alone. Two of the same [`name`](PoseMethod::name) are equal. It is borrowed for
    /// ever since options are `Copy`: a constant, a `static`, or what `Box::leak` gives.
    Outside(&'static dyn PoseMethod),
}

impl Method {
    /// Every method of this crate, with its default settings.
    pub const ALL: &[Self] = &[Self::Lm, Self::ADAM, Self::Ccd, Self::Fabrik];
    const ADAM: Self = Self::Adam(AdamOptions::DEFAULT);

    /// One lower-case word, as scenarios and the command name it.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Lm => "lm",
            Self::Adam(_) => "adam",
            Self::Ccd => "ccd",
            Self::Fabrik => "fabrik",
            Self::Outside(method) => method.name(),
        }
    }

    /// The method of this crate of that [`name`](Self::name), with its default settings.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|m| m.name() == name).copied()
    }
}

/// The settings of [`Method::Adam`]; the defaults are those of the paper's authors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdamOptions {
    /// Learning rate η.
    pub rate: f64,
    /// Decay of the gradient's mean, β₁.
    pub beta1: f64,
    /// Decay of the squared gradient's mean, β₂.
    pub beta2: f64,
    /// ε in the denominator.
    pub epsilon: f64,
}

impl AdamOptions {
    /// The settings of the authors.
    pub const DEFAULT: Self = Self { rate: 0.1, beta1: 0.9, beta2: 0.999, epsilon: 1e-8 };
}

impl Default for AdamOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Where the answer is looked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Search {
    /// From the start alone: the answer stays in the start's basin, as frame-by-frame use needs it.
    #[default]
    Local,
    /// From the start, then from a fixed sequence of other poses until one succeeds; the best answer is kept.
    Global {
        /// How many more starts at most.
        max_restarts: usize,
    },
}

impl Search {
    /// How many more starts than one at most.
    pub(crate) fn max_restarts(self) -> usize {
        match self {
            Self::Local => 0,
            Self::Global { max_restarts } => max_restarts,
        }
    }
}

/// How far a pose is solved by [`Method::Lm`] where tolerances decide ([`SolverOptions::cost_below`] is `None`) and the search is
/// [local](Search::Local). Restarts, the other methods and motions go to the end in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Settle {
    /// As frames want it, each solved from the one before: a solve ends with the first step after which every mandatory term is within
    /// 0.3 of its tolerance and the step did what it promised, or within 0.1 of it in any case; or where steps in a row gain next to
    /// nothing, neither in all nor for a term that is unmet, since what is wanted cannot be met. At least one step is taken, and
    /// constraints are held as far as their tolerances ask. Forces and shares are then those of a pose near the best one. What
    /// mandatory terms leave open moves towards its optimum from frame to frame. A problem without mandatory terms is solved fully.
    #[default]
    Tolerances,
    /// Until no step gains anything: to the last digit, with everything at its optimum. Frame by frame that takes ten times as
    /// long and is less smooth, for what is open follows its optimum wherever it leads.
    Fully,
}

/// How to solve. All fields have defaults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// How a single start is improved; [`Method::Lm`] by default.
    pub method: Method,
    /// Where the answer is looked for; [`Search::Local`] by default.
    pub search: Search,
    /// Success means a cost below this (the paper's equation 22). `None`, the default: success means every
    /// mandatory term within its tolerance, and the solver goes on as far as [`settle`](Self::settle) says.
    pub cost_below: Option<f64>,
    /// How far a pose is solved; [`Settle::Tolerances`] by default.
    pub settle: Settle,
    /// Most iterations of one start (equation 21); 500 by default, as in the paper. The best of several starts is followed once
    /// more with as many where none succeeded.
    ///
    /// By [`Method::Lm`] a start of a motion has as many in each of the rounds that it takes: one where nothing else is asked
    /// for, one more before it with [even spacing](crate::MotionProblem::set_even_spacing), and at most 40 more where limits on
    /// speed and acceleration of a fixed duration bind. Shared by all rounds they would leave too few to those that lead
    /// inside the limits. What bounds a plan as a whole is `max_time`.
    pub max_iterations: usize,
    /// Time budget of the whole solve, from the call on, laying out included (equations 23 and 24); none by default. Only where it
    /// is set is a clock read. The solve ends at most one iteration after it; what is in the way is then still explained
    /// (about as long as an iteration), and of a motion that is not known to keep its limits on rates these are measured.
    pub max_time: Option<Duration>,
}

impl<'a> Budget<'a> {
    /// What options let a solve spend, whose clock was started with it.
    pub(crate) fn on(clock: Clock, options: &SolverOptions, watch: &'a Watch) -> Self {
        Self::of(options.max_iterations, clock, watch)
    }

    /// The same for one that has nothing to lay out.
    #[cfg(test)]
    pub(crate) fn new(options: &SolverOptions, watch: &'a Watch) -> Self {
        Self::on(Clock::start(options.max_time), options, watch)
    }
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self {
            method: Method::default(),
            search: Search::default(),
            cost_below: None,
            settle: Settle::default(),
            max_iterations: 500,
            max_time: None,
        }
    }
}
