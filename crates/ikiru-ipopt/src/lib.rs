//! The system's Ipopt (Wächter and Biegler, 2006): least `f(x)` inside bounds and constraints, by an interior-point
//! method with a limited-memory Hessian.
//!
//! A safe wrapper of the few calls of Ipopt's C interface that `minimise` needs, for Ipopt 3.11 to 3.14, and by it the method
//! `IPOPT` of poses. Linking needs the feature `link` and the library (Debian: `coinor-libipopt-dev`); without the feature
//! only the types of `minimise` are there.
//!
//! ```
//! # #[cfg(feature = "link")] {
//! use ikiru_ipopt::{Bounds, Function, Options, Status, minimise};
//!
//! /// (x − 3)² + (y − 1)²
//! struct Bowl;
//!
//! impl Function for Bowl {
//!     fn value(&mut self, x: &[f64]) -> Option<f64> {
//!         Some((x[0] - 3.0).powi(2) + (x[1] - 1.0).powi(2))
//!     }
//!     fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) -> bool {
//!         gradient.copy_from_slice(&[2.0 * (x[0] - 3.0), 2.0 * (x[1] - 1.0)]);
//!         true
//!     }
//! }
//!
//! let bounds = Bounds { lower: &[0.0, f64::NEG_INFINITY], upper: &[2.0, f64::INFINITY], ..Bounds::default() };
//! let mut x = [0.5, 0.5];
//! assert_eq!(minimise(&mut Bowl, &bounds, &Options::default(), &mut x)?, Status::Solved);
//! assert!((x[0] - 2.0).abs() < 1e-6 && (x[1] - 1.0).abs() < 1e-6);
//! # }
//! # Ok::<(), ikiru_ipopt::Error>(())
//! ```

#![allow(
    unsafe_code,
    reason = "Ipopt has a C interface; this crate exists to keep the calls of it, and the reasons why they are sound, in one place"
)]

#[cfg(feature = "link")]
mod charts;
#[cfg(feature = "link")]
mod ffi;
#[cfg(feature = "link")]
mod method;
#[cfg(feature = "link")]
mod minimise;

#[cfg(feature = "link")]
pub use method::{IPOPT, Ipopt};
#[cfg(feature = "link")]
pub use minimise::minimise;

/// What is minimised: a smooth function, and the constraints on it. Every `x` has one entry for each variable.
pub trait Function {
    /// The function's value; `None` where it has none, so that a shorter step is tried.
    fn value(&mut self, x: &[f64]) -> Option<f64>;

    /// Writes the derivative by each variable; false where there is none.
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) -> bool;

    /// Writes the value of each constraint; false where there is none.
    fn constraints(&mut self, x: &[f64], values: &mut [f64]) -> bool {
        let _ = (x, values);
        true
    }

    /// Writes the derivatives of the constraints, in the order of [`Bounds::jacobian`]; false where there are none.
    fn constraint_jacobian(&mut self, x: &[f64], values: &mut [f64]) -> bool {
        let _ = (x, values);
        true
    }

    /// Called before the first iteration and after each; false ends the solve with [`Status::Stopped`].
    fn goes_on(&mut self, n_iterations: usize) -> bool {
        let _ = n_iterations;
        true
    }
}

/// Where `x` may lie. An infinite end is no bound.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bounds<'a> {
    /// Least value of each variable.
    pub lower: &'a [f64],
    /// Greatest value of each variable.
    pub upper: &'a [f64],
    /// Least value of each constraint.
    pub constraint_lower: &'a [f64],
    /// Greatest value of each constraint.
    pub constraint_upper: &'a [f64],
    /// Which derivatives of constraints are not zero everywhere: (constraint, variable), each once.
    pub jacobian: &'a [(usize, usize)],
}

/// How to solve. Bounds are never relaxed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Ipopt's `tol`: the scaled error of the optimality conditions at which it ends; 1e-8 by default.
    pub tolerance: f64,
    /// Most iterations; 3000 by default.
    pub max_iterations: usize,
    /// Ipopt's `bound_push` and `bound_frac`: by which part of a range the start is pushed away from its ends; 0.01
    /// by default.
    pub bound_push: f64,
    /// Ipopt's `limited_memory_max_history`: from how many steps the Hessian is guessed; 6 by default.
    pub history: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { tolerance: 1e-8, max_iterations: 3000, bound_push: 0.01, history: 6 }
    }
}

/// How it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// The optimality conditions hold within the tolerance.
    Solved,
    /// They hold within a wider one, and it got no further.
    Acceptable,
    /// [`Function::goes_on`] said so.
    Stopped,
    /// The allowed iterations were used up.
    IterationLimit,
    /// No point that meets the constraints was found.
    Infeasible,
    /// It got no further: steps too small, iterates that run away, or a system that could not be solved.
    Stuck,
    /// The function has no value or derivative at the start.
    NoValue,
    /// Something else; the number is Ipopt's `ApplicationReturnStatus`.
    Other(i32),
}

/// Why a problem was not handed to Ipopt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Slices do not fit together.
    #[error("{what} has {found} entries: expected {expected}")]
    Length {
        /// The slice.
        what: &'static str,
        /// How many entries it has.
        found: usize,
        /// How many it should have.
        expected: usize,
    },
    /// There is no variable.
    #[error("there is no variable: expected at least 1")]
    NoVariable,
    /// A range is not ordered.
    #[error("the bounds of {what} {idx} are not ordered")]
    Order {
        /// Variable or constraint.
        what: &'static str,
        /// Its position.
        idx: usize,
    },
    /// The start is not finite.
    #[error("variable {0} starts at a value that is not finite")]
    Start(usize),
    /// A derivative of something that does not exist.
    #[error("jacobian entry {0} names a constraint or variable that does not exist")]
    Jacobian(usize),
    /// Ipopt is not reentrant.
    #[error("a function that Ipopt evaluates called Ipopt")]
    Nested,
    /// Ipopt refused the problem's shape.
    #[error("Ipopt refused the problem")]
    Refused,
    /// An option that is not finite and positive, or that Ipopt refused.
    #[error("the option '{0}' has a value that Ipopt does not take")]
    Option(&'static str),
}
