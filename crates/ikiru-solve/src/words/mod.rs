//! Words that everything else is said in: what residuals are measured in and how their length becomes cost, why a solve
//! ended, who watches it.

mod stop;
mod watch;

pub use stop::StopReason;
pub use watch::{Progress, Watch};

/// The shape put on a part's residual: how its length `‖r‖` becomes cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
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
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "snake_case"))]
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

/// What a row wants of its residual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sense {
    /// To be 0.
    #[default]
    Equal,
    /// To be at least 0: above, it costs nothing and pulls at nothing.
    AtLeast,
}

impl Sense {
    /// How far a residual is from what the row wants, signed as the residual.
    #[inline(always)]
    #[must_use]
    pub fn missing(self, residual: f64) -> f64 {
        match self {
            Self::Equal => residual,
            Self::AtLeast => residual.min(0.0),
        }
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
