//! What a value should be: exactly, at least or at most something.

use crate::objective::Part;
use crate::words::Unit;

/// What a value should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// Exactly this.
    Exactly(f64),
    /// This or more.
    AtLeast(f64),
    /// This or less.
    AtMost(f64),
}

impl Bound {
    /// The residual of a value, whose row wants to be 0 or at least 0; and the sign with which it grows.
    #[inline]
    pub(super) fn residual(self, value: f64) -> (f64, f64) {
        match self {
            Self::Exactly(bound) | Self::AtLeast(bound) => (value - bound, 1.0),
            Self::AtMost(bound) => (bound - value, -1.0),
        }
    }

    pub(super) fn part(self, most_rows: usize, unit: Unit) -> Part {
        match self {
            Self::Exactly(_) => Part::new(most_rows, unit),
            Self::AtLeast(_) | Self::AtMost(_) => Part::at_least(most_rows, unit),
        }
    }

    /// What it says.
    #[must_use]
    pub fn value(self) -> f64 {
        let (Self::Exactly(value) | Self::AtLeast(value) | Self::AtMost(value)) = self;
        value
    }
}
