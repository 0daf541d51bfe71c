//! Why a solve ended.

/// Why a solve ended. Not converging is a result, and the best pose found always comes back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "snake_case"))]
pub enum StopReason {
    /// The bar was met: the cost below `cost_below`, or every mandatory term within its tolerance.
    Reached,
    /// No step makes the cost smaller by more than rounding: this is a (local) best. Of a [frame](crate::Settle::Tolerances) that cannot be
    /// met: steps gain next to nothing.
    Converged,
    /// The allowed iterations were used up (the paper's equation 21).
    IterationLimit,
    /// The time budget was used up (the paper's equations 23 and 24).
    TimeBudget,
    /// Somebody who [watches](crate::Watch) said so.
    Cancelled,
    /// The method found no better pose, although the gradient says that there is one.
    NoProgress,
    /// Something in the problem or pose is not usable; the pose was not touched.
    InvalidInput,
    /// An objective gave up in mid-solve; the best pose up to then came back, and `invalid` names the objective.
    ObjectiveFailed,
}

impl StopReason {
    /// Lower-case words, as `--json` prints them: `reached`, `iteration_limit`, …
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Reached => "reached",
            Self::Converged => "converged",
            Self::IterationLimit => "iteration_limit",
            Self::TimeBudget => "time_budget",
            Self::Cancelled => "cancelled",
            Self::NoProgress => "no_progress",
            Self::InvalidInput => "invalid_input",
            Self::ObjectiveFailed => "objective_failed",
        }
    }

    /// Whether no further start may follow.
    pub(crate) fn is_final(self) -> bool {
        matches!(self, Self::TimeBudget | Self::Cancelled | Self::ObjectiveFailed)
    }
}
